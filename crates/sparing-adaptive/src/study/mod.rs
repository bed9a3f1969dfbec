//! How policies compare: curves of error over cost, costs at equal error, what an oracle would save. Plain numbers, no
//! files; `sparing study` renders and writes.

mod curve;
mod oracle;
mod ratio;

pub use curve::{Cost, Curve, interpolate};
pub use oracle::oracle_ratio;
pub use ratio::{Mean, Ratio};
