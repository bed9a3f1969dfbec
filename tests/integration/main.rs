//! End-to-end tests: the command as people run it, and whole renders against stored references.
//!
//! The tests of the command run the binary in a folder of its own, with a time limit, and check on every run
//! that nothing panicked ([`common::run`]).

mod adaptive;
mod bad_input;
mod checkpoint;
mod cli;
mod common;
mod convert;
mod guards;
mod interrupt;
mod limits;
mod merge;
mod output;
mod paper;
mod references;
mod stress;
mod study;
mod tradeoff;
mod train;
mod trouble;
