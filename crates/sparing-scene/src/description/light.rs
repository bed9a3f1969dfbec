//! Lights that are not shapes.

use super::ImageId;
use glam::{Mat3, Vec3};

/// A light that no ray can hit, or one infinitely far away. Emitting shapes carry a [`super::Emission`].
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Isotropic point light.
    Point {
        /// World position.
        position: Vec3,
        /// Radiant intensity, W/sr.
        intensity: Vec3,
    },
    /// Cone with a smooth edge.
    Spot {
        /// World position.
        position: Vec3,
        /// Unit axis, away from the light.
        direction: Vec3,
        /// Radiant intensity on the axis, W/sr.
        intensity: Vec3,
        /// Half-angle in degrees at which the light ends.
        cone_angle: f32,
        /// Degrees before `cone_angle` at which the fall-off starts.
        cone_delta: f32,
        /// How it goes from there.
        edge: SpotEdge,
    },
    /// Parallel light.
    Distant {
        /// Unit direction in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces the light, W/m².
        irradiance: Vec3,
    },
    /// Light from every direction.
    Environment {
        /// Radiance, or a factor on the image.
        radiance: Vec3,
        /// Picture of the surroundings.
        image: Option<EnvironmentImage>,
        /// From light space (z up, as in pbrt) to world space, orthonormal but possibly mirrored.
        light_to_world: Mat3,
    },
    /// Point light whose intensity is a picture of directions.
    Goniometric {
        /// World position.
        position: Vec3,
        /// Factor on the picture, W/sr.
        intensity: Vec3,
        /// The mean of its channels counts.
        image: Option<ImageId>,
        /// How directions map to the picture.
        mapping: SphereMapping,
        /// Power that the light is scaled to, W.
        power: Option<f32>,
        /// From light space (z is the pole of the picture) to world space, orthonormal but possibly mirrored.
        light_to_world: Mat3,
    },
    /// Slide projector: a point light that throws a picture along the z axis of its space.
    Projection {
        /// World position.
        position: Vec3,
        /// Factor on the picture, W/sr.
        intensity: Vec3,
        /// The slide; without one the light is even.
        image: Option<ImageId>,
        /// Angle of the shorter side in degrees.
        fov: f32,
        /// Power that the light is scaled to, W.
        power: Option<f32>,
        /// From light space (x and y along the rows and columns of the picture, from its upper left) to world space,
        /// orthonormal but possibly mirrored.
        light_to_world: Mat3,
    },
}

/// How the edge of a spot light falls off, from 1 where the fall-off starts to 0 where the light ends. With t between the
/// cosines of the two angles, from 0 at the end to 1 at the start:
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SpotEdge {
    /// t² (3 - 2 t): pbrt-v4.
    #[default]
    Smooth,
    /// t²: glTF (KHR_lights_punctual).
    Square,
    /// t⁴: pbrt before version 4.
    Fourth,
}

/// A picture of the surroundings.
#[derive(Clone, Copy, PartialEq)]
pub struct EnvironmentImage {
    /// Which.
    pub image: ImageId,
    /// How directions map to it.
    pub mapping: SphereMapping,
    /// Illuminance that the light is scaled to, measured as pbrt-v4 does it: half of what arrives on a patch that faces
    /// +z of light space.
    pub illuminance: Option<f32>,
}

/// A picture without further wishes prints as its id.
impl std::fmt::Debug for EnvironmentImage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if *self == Self::from(self.image) {
            return self.image.fmt(f);
        }
        write!(f, "{:?} {:?} {:?}", self.image, self.mapping, self.illuminance)
    }
}

impl From<ImageId> for EnvironmentImage {
    fn from(image: ImageId) -> Self {
        Self { image, mapping: SphereMapping::Auto, illuminance: None }
    }
}

/// How directions map to a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SphereMapping {
    /// Latitude and longitude if twice as wide as high, equal-area if square.
    #[default]
    Auto,
    /// Latitude and longitude, the upper edge towards +z.
    LatLong,
    /// Equal-area octahedral (P. Clarberg 2008), square.
    EqualArea,
}
