//! The evaluator against the definition: bounds that hold, signs that never differ, extremes.

mod bounds;
mod extremes;
mod models;
mod signs;
