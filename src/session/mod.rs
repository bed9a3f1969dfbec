//! What a render on the command line needs around it: progress, viewers, statistics, memory.

pub mod checkpoint;
pub mod console;
pub mod cpu;
pub mod loading;
pub mod memory;
pub mod progress;
pub mod stats;
pub mod tev;
