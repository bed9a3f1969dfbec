//! Instances: a scene within a scene.

use embree4_sys as sys;

use super::sealed::Sealed;
use super::{CreateContext, Options, RawGeometry, geometry_options, transform};
use crate::{Error, FeatureMask, Scene};

/// The transform that changes nothing.
pub const IDENTITY: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];

/// A committed scene placed in another one.
///
/// A transform is an affine 3x4 matrix stored by columns: three for the linear part, the fourth is the translation. It
/// maps the instanced scene's space to that of the scene around it. Through a transform that cannot be inverted nothing
/// is hit. A scene with curves, points or subdivision surfaces needs one that can be inverted at all times: it may not
/// turn by more than 20 degrees, or scale as much, between two time steps. Instances keep their scene alive. Embree is built for one level: a scene with instances cannot be instanced.
#[must_use]
pub struct Instance {
    scene: Scene,
    transforms: Vec<[f32; 12]>,
    options: Options,
}

geometry_options!(Instance);

impl Instance {
    /// Places `scene`.
    pub fn new(scene: &Scene, transform: [f32; 12]) -> Self {
        Self { scene: scene.clone(), transforms: vec![transform], options: Options::default() }
    }

    /// Adds transforms for further time steps, which divide the time range evenly. Matrices between are
    /// interpolated component by component.
    pub fn time_steps(mut self, later: impl IntoIterator<Item = [f32; 12]>) -> Self {
        self.transforms.extend(later);
        self
    }
}

impl Sealed for Instance {
    #[allow(private_interfaces, reason = "nobody outside can name this trait")]
    fn create(self, context: &CreateContext<'_>) -> Result<RawGeometry, Error> {
        check_instanceable(&self.scene, context)?;
        let steps: Vec<_> = self.transforms.iter().map(std::slice::from_ref).collect();
        transform::check(std::slice::from_ref(&self.scene), &steps)?;
        let kind = sys::RTCGeometryType::RTC_GEOMETRY_TYPE_INSTANCE;
        let features = FeatureMask::INSTANCE | self.scene.features();
        let mut geometry = RawGeometry::new(context, kind, features, 1)?;
        geometry.set_steps(self.transforms.len())?;
        // SAFETY: both objects are valid, of the same device and not being changed; Embree counts the scene.
        unsafe { sys::rtcSetGeometryInstancedScene(geometry.raw(), self.scene.raw()) };
        for (step, transform) in (0..).zip(&self.transforms) {
            geometry.set_transform(step, transform);
        }
        geometry.scenes.push(self.scene);
        geometry.set_options(self.options, context.panics)?;
        geometry.commit()
    }
}

pub(super) fn check_instanceable(scene: &Scene, context: &CreateContext<'_>) -> Result<(), Error> {
    if !scene.device().is_same(context.device) {
        return Err(Error::DifferentDevice);
    }
    if scene.features().intersects(FeatureMask::INSTANCE | FeatureMask::INSTANCE_ARRAY) {
        return Err(Error::NestedInstance);
    }
    Ok(())
}
