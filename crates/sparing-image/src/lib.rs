//! Film buffers, pictures in and out, colour, error metrics.

pub mod film;
pub mod picture;
