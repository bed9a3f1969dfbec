//! Axis-aligned boxes.

use embree4_sys as sys;

/// An axis-aligned box. It is empty if `lower` exceeds `upper` anywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub lower: [f32; 3],
    /// Largest coordinates.
    pub upper: [f32; 3],
}

impl Bounds {
    /// The box that contains nothing.
    pub const EMPTY: Self = Self { lower: [f32::INFINITY; 3], upper: [f32::NEG_INFINITY; 3] };

    /// Whether the box contains nothing (or is not made of numbers).
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !(0..3).all(|axis| self.lower[axis] <= self.upper[axis])
    }

    pub(crate) fn to_raw(self) -> sys::RTCBounds {
        let ([lower_x, lower_y, lower_z], [upper_x, upper_y, upper_z]) = (self.lower, self.upper);
        sys::RTCBounds { lower_x, lower_y, lower_z, align0: 0.0, upper_x, upper_y, upper_z, align1: 0.0 }
    }

    pub(crate) fn from_raw(raw: &sys::RTCBounds) -> Self {
        Self {
            lower: [raw.lower_x, raw.lower_y, raw.lower_z],
            upper: [raw.upper_x, raw.upper_y, raw.upper_z],
        }
    }
}

/// Boxes at the start and the end of the time range; in between they are interpolated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearBounds {
    /// At time 0.
    pub start: Bounds,
    /// At time 1.
    pub end: Bounds,
}
