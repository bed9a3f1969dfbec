//! Options that geometries have in common.

use super::RawGeometry;
use super::raw::Slot;
use super::{check_count, check_length};
use crate::buffer::{Element, SharedBuffer};
use crate::filter::Filter;
use crate::{BuildQuality, Error};

/// Most vertex attributes of a geometry.
const MAX_ATTRIBUTES: usize = 16;

pub(crate) struct Options {
    pub(crate) mask: u32,
    pub(crate) quality: BuildQuality,
    pub(crate) time_range: Option<(f32, f32)>,
    pub(crate) filter: Option<Filter>,
    pub(crate) occlusion_filter: Option<Filter>,
}

impl Default for Options {
    fn default() -> Self {
        let quality = BuildQuality::Medium;
        Self { mask: 1, quality, time_range: None, filter: None, occlusion_filter: None }
    }
}

impl Options {
    pub(crate) fn check(&self) -> Result<(), Error> {
        match self.time_range {
            Some((a, b)) if !(a.is_finite() && b.is_finite() && a < b && (b - a).is_finite()) => {
                Err(Error::InvalidOption { what: "time range", reason: "not finite, or end not after start" })
            }
            // Embree looks for the first step after the scene's time 0, also past the last one.
            Some((a, b)) if b.min(1.0 - a) <= (b - a) * 1e-5 => {
                Err(Error::InvalidOption { what: "time range", reason: "not within the scene's, 0 to 1" })
            }
            _ => Ok(()),
        }
    }
}

/// A buffer of values per vertex: any of `SharedBuffer<f32>`, `<[f32; 2]>`, `<[f32; 3]>`, `<[f32; 4]>`.
#[derive(Clone, Debug)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say it")]
pub enum Attribute {
    F1(SharedBuffer<f32>),
    F2(SharedBuffer<[f32; 2]>),
    F3(SharedBuffer<[f32; 3]>),
    F4(SharedBuffer<[f32; 4]>),
}

macro_rules! attribute_from {
    ($($kind:ident: $element:ty),*) => {$(
        impl From<SharedBuffer<$element>> for Attribute {
            fn from(buffer: SharedBuffer<$element>) -> Self {
                Self::$kind(buffer)
            }
        }
        impl From<Vec<$element>> for Attribute {
            fn from(values: Vec<$element>) -> Self {
                Self::$kind(values.into())
            }
        }
    )*};
}
attribute_from!(F1: f32, F2: [f32; 2], F3: [f32; 3], F4: [f32; 4]);

impl Attribute {
    fn len(&self) -> usize {
        match self {
            Self::F1(b) => b.len(),
            Self::F2(b) => b.len(),
            Self::F3(b) => b.len(),
            Self::F4(b) => b.len(),
        }
    }

    fn bind(self, geometry: &mut RawGeometry, slot: Slot) {
        match self {
            Self::F1(b) => geometry.set_buffer(slot, b),
            Self::F2(b) => geometry.set_buffer(slot, b),
            Self::F3(b) => geometry.set_buffer(slot, b),
            Self::F4(b) => geometry.set_buffer(slot, b),
        }
    }
}

/// Vertices for every time step, and values that belong to them.
pub(crate) struct Steps<T: Element> {
    pub(crate) first: SharedBuffer<T>,
    pub(crate) later: Vec<SharedBuffer<T>>,
    pub(crate) attributes: Vec<(u32, Attribute)>,
}

impl<T: Element> Steps<T> {
    pub(crate) fn new(first: SharedBuffer<T>) -> Self {
        Self { first, later: Vec::new(), attributes: Vec::new() }
    }

    pub(crate) fn bind(self, geometry: &mut RawGeometry) -> Result<(), Error> {
        let count = self.first.len();
        check_count("vertices", count, u32::MAX as usize - 1)?;
        geometry.set_steps(1 + self.later.len())?;
        for step in &self.later {
            check_length("vertices of a time step", step.len(), count)?;
        }
        for (step, vertices) in (0..).zip(std::iter::once(self.first).chain(self.later)) {
            geometry.set_buffer(Slot::vertex(step), vertices);
        }
        bind_attributes(self.attributes, count, geometry)
    }
}

fn bind_attributes(
    mut attributes: Vec<(u32, Attribute)>,
    vertices: usize,
    geometry: &mut RawGeometry,
) -> Result<(), Error> {
    if attributes.is_empty() {
        return Ok(());
    }
    let count = check_count("vertex attributes", attributes.len(), MAX_ATTRIBUTES)?;
    attributes.sort_by_key(|(slot, _)| *slot);
    if !attributes.iter().map(|(slot, _)| *slot).eq(0..count) {
        let reason = "slots must be numbered from 0 without gaps or repetition";
        return Err(Error::InvalidOption { what: "vertex attributes", reason });
    }
    for (_, values) in &attributes {
        check_length("vertex attribute", values.len(), vertices)?;
    }
    geometry.set_attribute_count(count);
    for (slot, values) in attributes {
        values.bind(geometry, Slot::attribute(slot));
    }
    Ok(())
}

/// Methods that every geometry has; the type needs a field `options`.
macro_rules! geometry_options {
    ($type:ty) => {
        impl $type {
            /// Only rays whose mask shares a bit with this one see the geometry. The default is 1.
            pub fn mask(mut self, mask: u32) -> Self {
                self.options.mask = mask;
                self
            }

            /// How much work the build may spend on this geometry, in scenes with
            /// [`SceneFlags::DYNAMIC`](crate::SceneFlags::DYNAMIC).
            pub fn build_quality(mut self, quality: $crate::BuildQuality) -> Self {
                self.options.quality = quality;
                self
            }

            /// The times of the first and last time step, instead of 0 and 1. A part of them must be within 0 to 1.
            pub fn time_range(mut self, start: f32, end: f32) -> Self {
                self.options.time_range = Some((start, end));
                self
            }
        }

        impl $crate::geometry::Geometry for $type {}
    };
}
pub(crate) use geometry_options;

/// Filters, for geometries that are not instances.
macro_rules! filter_options {
    ($type:ty) => {
        impl $type {
            /// Calls `filter` for every possible hit of `intersect`; it returns true to accept the hit.
            ///
            /// A panic in a filter rejects the hit and can be fetched with
            /// [`Scene::take_panic`](crate::Scene::take_panic). Filters may be called several times for one hit.
            pub fn filter(
                mut self,
                filter: impl Fn(&$crate::FilterHit<'_>) -> bool + Send + Sync + 'static,
            ) -> Self {
                self.options.filter = Some(Box::new(filter));
                self
            }

            /// Calls `filter` for every possible hit of `occluded`; it returns true if the hit blocks the ray.
            pub fn occlusion_filter(
                mut self,
                filter: impl Fn(&$crate::FilterHit<'_>) -> bool + Send + Sync + 'static,
            ) -> Self {
                self.options.occlusion_filter = Some(Box::new(filter));
                self
            }
        }
    };
}
pub(crate) use filter_options;

/// Motion blur and attributes, for geometries with a field `vertices` of type `Steps<$element>`.
macro_rules! vertex_options {
    ($type:ty, $element:ty) => {
        impl $type {
            /// Adds vertices for further time steps, which divide the time range evenly; the vertices given to
            /// the constructor are the first step. There can be 129 steps in all, and every one needs as many
            /// vertices as the first.
            pub fn time_steps<B: Into<$crate::SharedBuffer<$element>>>(
                mut self,
                later: impl IntoIterator<Item = B>,
            ) -> Self {
                self.vertices.later.extend(later.into_iter().map(Into::into));
                self
            }

            /// Attaches values to the vertices, for [`Scene::interpolate`](crate::Scene::interpolate). Slots
            /// count from 0; there can be 16.
            pub fn vertex_attribute(
                mut self,
                slot: u32,
                values: impl Into<$crate::geometry::Attribute>,
            ) -> Self {
                self.vertices.attributes.push((slot, values.into()));
                self
            }
        }
    };
}
pub(crate) use vertex_options;
