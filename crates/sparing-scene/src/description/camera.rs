//! Camera, film, filter, sampler and integrator settings.

use glam::Mat4;

/// A camera. Camera space is x right, y up, z forward, as in pbrt.
#[derive(Clone, PartialEq)]
pub struct Camera {
    /// From camera space to world space; may mirror. Where the camera moves, at the start.
    pub camera_to_world: Mat4,
    /// The same at the end, if the camera moves.
    pub end: Option<Mat4>,
    /// When the shutter opens and closes; everything that moves starts at 0 and ends at 1, and stands still before and
    /// after.
    pub shutter: [f32; 2],
    /// How rays leave it.
    pub projection: Projection,
    /// Visible part of the image plane: x0, x1, y0, y1. `None`: the shorter axis spans -1..1.
    pub screen_window: Option<[f32; 4]>,
    /// Radius of the thin lens in scene units; 0 is a pinhole.
    pub lens_radius: f32,
    /// Distance from the lens to the plane in focus, scene units.
    pub focal_distance: f32,
}

/// How camera rays spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Field of view in degrees of the shorter image axis, in (0, 180).
    Perspective {
        /// Degrees.
        fov: f32,
    },
    /// Parallel rays.
    Orthographic,
    /// All directions, as an equal-area octahedral map of the sphere (P. Clarberg, "Fast Equal-Area Mapping of the
    /// (Hemi)Sphere using SIMD", 2008), y up.
    EqualArea,
    /// All directions, longitude by latitude, y up.
    Equirectangular,
}

/// A camera at rest prints without its motion: what is derived from that text stays as it is for still scenes.
impl std::fmt::Debug for Camera {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { camera_to_world, end, shutter, projection, screen_window, lens_radius, focal_distance } =
            self;
        let mut text = f.debug_struct("Camera");
        text.field("camera_to_world", camera_to_world).field("projection", projection);
        text.field("screen_window", screen_window).field("lens_radius", lens_radius);
        text.field("focal_distance", focal_distance);
        if end.is_some() {
            text.field("end", end);
        }
        if *shutter != [0.0, 1.0] {
            text.field("shutter", shutter);
        }
        text.finish()
    }
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            camera_to_world: Mat4::IDENTITY,
            end: None,
            shutter: [0.0, 1.0],
            projection: Projection::Perspective { fov: 90.0 },
            screen_window: None,
            lens_radius: 0.0,
            focal_distance: 1e6,
        }
    }
}

/// Picture size and crop.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmSettings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Pixel bounds x0, y0, x1, y1 (end exclusive) of the part to render; `None` is all.
    pub crop: Option<[u32; 4]>,
    /// Output file named by the scene.
    pub filename: Option<String>,
    /// Factor on radiance (pbrt's `iso` / `exposuretime` scaling); 1 by default.
    pub scale: f32,
}

impl Default for FilmSettings {
    fn default() -> Self {
        Self { width: 1280, height: 720, crop: None, filename: None, scale: 1.0 }
    }
}

/// Pixel filters; radii in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PixelFilter {
    /// Constant inside the radius.
    Box {
        /// x and y radius.
        radius: [f32; 2],
    },
    /// Tent.
    Triangle {
        /// x and y radius.
        radius: [f32; 2],
    },
    /// Gaussian minus its value at the radius.
    Gaussian {
        /// x and y radius.
        radius: [f32; 2],
        /// Standard deviation in pixels.
        sigma: f32,
    },
    /// Blackman-Harris window over the radius.
    BlackmanHarris {
        /// x and y radius.
        radius: [f32; 2],
    },
    /// Mitchell-Netravali; has negative lobes.
    Mitchell {
        /// x and y radius.
        radius: [f32; 2],
        /// B parameter.
        b: f32,
        /// C parameter.
        c: f32,
    },
}

impl Default for PixelFilter {
    fn default() -> Self {
        Self::Gaussian { radius: [1.5, 1.5], sigma: 0.5 }
    }
}

/// Which numbers drive the sampling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SamplerKind {
    /// Owen-scrambled Sobol.
    #[default]
    Sobol,
    /// Independent uniform.
    Independent,
}

/// Sampler settings of the scene file; the command line overrides them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SamplerSettings {
    /// Kind.
    pub kind: SamplerKind,
    /// Samples per pixel asked for by the scene.
    pub spp: Option<u32>,
    /// Seed.
    pub seed: u64,
}

/// Integrator settings of the scene file; the command line overrides them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IntegratorSettings {
    /// Number of bounces after the camera ray: 0 shows emission only, 1 adds direct light.
    pub max_depth: u32,
}

impl Default for IntegratorSettings {
    fn default() -> Self {
        Self { max_depth: 8 }
    }
}
