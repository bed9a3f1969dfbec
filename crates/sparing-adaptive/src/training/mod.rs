//! Training: rows from rendered scenes, and the machine fitted to them.
//!
//! A scene is rendered evenly, layer by layer, with several seeds ([`Replay`]), and once well (the reference). Policies
//! are then replayed on the stored layers, exactly, at no cost; at their barriers, pixels near the rule's threshold
//! become rows ([`collect`]): features of the pixel, and what doubling its samples gained ([`Label`]). [`fit`] makes
//! a machine of the rows of many scenes. [`paper`] trains the sampler of 2015.

mod collect;
mod fit;
mod label;
pub mod paper;
mod random;
mod replay;

pub use collect::{Collection, Row, collect};
pub use fit::{Fit, FitError, Fitted, fit};
pub use label::Label;
pub use random::Random;
pub use replay::Replay;
