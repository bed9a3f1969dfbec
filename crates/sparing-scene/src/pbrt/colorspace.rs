//! Colour spaces of `rgb` parameters, converted to linear Rec.709.
//!
//! Primaries and white points: IEC 61966-2-1 (sRGB), SMPTE RP 431-2 with a D65 white (DCI-P3), ITU-R BT.2020,
//! SMPTE ST 2065-1 (ACES). Surfaces keep their white: the white point is adapted after Bradford (K. Lam 1985).

use glam::{DMat3, DVec3, Vec3};

/// The space of `rgb` values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum ColorSpace {
    #[default]
    Srgb,
    DciP3,
    Rec2020,
    Aces,
}

const D65: [f64; 2] = [0.3127, 0.329];
const D60: [f64; 2] = [0.321_68, 0.337_67];

/// xy of red, green, blue and white.
fn primaries(space: ColorSpace) -> ([[f64; 2]; 3], [f64; 2]) {
    match space {
        ColorSpace::Srgb => ([[0.64, 0.33], [0.3, 0.6], [0.15, 0.06]], D65),
        ColorSpace::DciP3 => ([[0.68, 0.32], [0.265, 0.69], [0.15, 0.06]], D65),
        ColorSpace::Rec2020 => ([[0.708, 0.292], [0.17, 0.797], [0.131, 0.046]], D65),
        ColorSpace::Aces => ([[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077]], D60),
    }
}

fn xyz([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// To XYZ: white is (1, 1, 1) (for example B. Lindbloom, "RGB/XYZ Matrices").
fn to_xyz(space: ColorSpace) -> DMat3 {
    let (p, white) = primaries(space);
    // Blue of ACES has a negative y; x / y is well-defined for all of these.
    let m = DMat3::from_cols(xyz(p[0]), xyz(p[1]), xyz(p[2]));
    let scale = m.inverse() * xyz(white);
    m * DMat3::from_diagonal(scale)
}

/// Bradford adaptation of one white to another.
fn adapt(from: DVec3, to: DVec3) -> DMat3 {
    let cones =
        DMat3::from_cols_array(&[0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296]);
    cones.inverse() * DMat3::from_diagonal((cones * to) / (cones * from)) * cones
}

impl ColorSpace {
    /// pbrt-v4's names.
    pub fn parse(name: &str) -> Option<Self> {
        match name.to_ascii_lowercase().as_str() {
            "srgb" | "rec709" => Some(Self::Srgb),
            "dci-p3" => Some(Self::DciP3),
            "rec2020" => Some(Self::Rec2020),
            "aces2065-1" => Some(Self::Aces),
            _ => None,
        }
    }

    /// As linear Rec.709; what that cannot show ends at 0.
    pub fn to_rec709(self, rgb: Vec3, is_light: bool) -> Vec3 {
        if self == Self::Srgb {
            return rgb;
        }
        let mut color = to_xyz(self) * rgb.as_dvec3();
        let white = primaries(self).1;
        if !is_light && white != D65 {
            color = adapt(xyz(white), xyz(D65)) * color;
        }
        (to_xyz(Self::Srgb).inverse() * color).max(DVec3::ZERO).as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_stays_white_and_primaries_leave_the_gamut() {
        for space in [ColorSpace::Srgb, ColorSpace::DciP3, ColorSpace::Rec2020, ColorSpace::Aces] {
            let white = space.to_rec709(Vec3::ONE, false);
            assert!(white.abs_diff_eq(Vec3::ONE, 1e-5), "{space:?} {white}");
        }
        // ITU-R BT.2087, table 2: BT.2020 red is 1.6605 times Rec.709 red, with less than nothing of the others.
        let red = ColorSpace::Rec2020.to_rec709(Vec3::X, false);
        assert!((red.x - 1.6605).abs() < 2e-3 && red.y == 0.0 && red.z == 0.0, "{red}");
        // Light of the ACES white is D60: warmer than Rec.709 white, of the same luminance.
        let warm = ColorSpace::Aces.to_rec709(Vec3::ONE, true);
        assert!(warm.x > 1.0 && warm.z < 1.0);
        assert!((warm.dot(Vec3::new(0.2126, 0.7152, 0.0722)) - 1.0).abs() < 1e-3);
        assert!(ColorSpace::parse("adobe").is_none());
    }
}
