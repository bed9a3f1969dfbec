//! Many instances as one geometry.

use embree4_sys as sys;

use super::instance::check_instanceable;
use super::sealed::Sealed;
use super::{
    CreateContext, Options, RawGeometry, Slot, check_indices, check_length, geometry_options, transform,
};
use crate::{Error, FeatureMask, Scene, SharedBuffer};

/// Scenes placed many times, with far less memory than as many [`Instance`](super::Instance)s.
///
/// Hits carry the place's number as `inst_prim_id`. Transforms are as for single instances.
#[must_use]
pub struct InstanceArray {
    scenes: Vec<Scene>,
    choice: Option<SharedBuffer<u32>>,
    transforms: Vec<SharedBuffer<[f32; 12]>>,
    options: Options,
}

geometry_options!(InstanceArray);

impl InstanceArray {
    /// One scene at many places.
    pub fn new(scene: &Scene, transforms: impl Into<SharedBuffer<[f32; 12]>>) -> Self {
        Self {
            scenes: vec![scene.clone()],
            choice: None,
            transforms: vec![transforms.into()],
            options: Options::default(),
        }
    }

    /// Several scenes; `choice` says which one stands at each place.
    pub fn of_many(
        scenes: impl IntoIterator<Item = Scene>,
        choice: impl Into<SharedBuffer<u32>>,
        transforms: impl Into<SharedBuffer<[f32; 12]>>,
    ) -> Self {
        Self {
            scenes: scenes.into_iter().collect(),
            choice: Some(choice.into()),
            transforms: vec![transforms.into()],
            options: Options::default(),
        }
    }

    /// Adds transforms for further time steps.
    pub fn time_steps<B: Into<SharedBuffer<[f32; 12]>>>(
        mut self,
        later: impl IntoIterator<Item = B>,
    ) -> Self {
        self.transforms.extend(later.into_iter().map(Into::into));
        self
    }
}

impl Sealed for InstanceArray {
    #[allow(private_interfaces, reason = "nobody outside can name this trait")]
    fn create(self, context: &CreateContext<'_>) -> Result<RawGeometry, Error> {
        let count = self.transforms[0].len();
        let mut features = FeatureMask::INSTANCE_ARRAY;
        for scene in &self.scenes {
            check_instanceable(scene, context)?;
            features |= scene.features();
        }
        for transforms in &self.transforms {
            check_length("instance transforms", transforms.len(), count)?;
        }
        let steps: Vec<_> = self.transforms.iter().map(|step| &step[..]).collect();
        transform::check(&self.scenes, &steps)?;
        if let Some(choice) = &self.choice {
            check_length("scene choice", choice.len(), count)?;
            check_indices("instanced scene", choice, self.scenes.len())?;
        }
        let kind = sys::RTCGeometryType::RTC_GEOMETRY_TYPE_INSTANCE_ARRAY;
        let mut geometry = RawGeometry::new(context, kind, features, count)?;
        geometry.set_steps(self.transforms.len())?;
        let mut handles: Vec<_> = self.scenes.iter().map(Scene::raw).collect();
        // SAFETY: all objects are valid, of the same device and not being changed; Embree copies the list and
        // counts the scenes.
        unsafe {
            match self.choice {
                None => sys::rtcSetGeometryInstancedScene(geometry.raw(), handles[0]),
                Some(_) => {
                    sys::rtcSetGeometryInstancedScenes(geometry.raw(), handles.as_mut_ptr(), handles.len());
                }
            }
        }
        if let Some(choice) = self.choice {
            geometry.set_buffer(Slot::INDEX, choice);
        }
        for (step, transforms) in (0..).zip(self.transforms) {
            geometry.set_buffer(Slot(sys::RTCBufferType::RTC_BUFFER_TYPE_TRANSFORM.0, step), transforms);
        }
        geometry.scenes = self.scenes;
        geometry.set_options(self.options, context.panics)?;
        geometry.commit()
    }
}
