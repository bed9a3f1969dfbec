//! Catmull-Clark subdivision surfaces.

use embree4_sys as sys;

use super::sealed::Sealed;
use super::{
    CreateContext, Options, RawGeometry, Slot, Steps, check_count, check_finite, check_indices, check_length,
};
use super::{filter_options, geometry_options, vertex_options};
use crate::{Error, FeatureMask, SharedBuffer};

/// What happens at the border of a subdivision mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum BoundaryMode {
    /// Faces at the border are not drawn.
    None,
    /// The border is a smooth curve. The default.
    #[default]
    Smooth,
    /// Smooth, but corners stay where they are.
    PinCorners,
    /// The border stays where the control mesh has it.
    PinBoundary,
    /// Nothing is smoothed: plain bilinear patches.
    PinAll,
}

/// Most corners of a face.
const MAX_CORNERS: u32 = 15;
/// Most faces that meet at a vertex; Embree's own limit is one more.
const MAX_RING_FACES: usize = 63;
/// Most vertices of the faces that meet at a vertex.
const MAX_RING_POINTS: usize = 126;

/// A control mesh of polygons and the smooth surface that it describes.
///
/// A face has 3 to 15 corners, all different. Up to 63 faces may meet at a vertex, fewer if they have many corners.
#[must_use]
pub struct Subdivision {
    vertices: Steps<[f32; 3]>,
    face_sizes: SharedBuffer<u32>,
    indices: SharedBuffer<u32>,
    levels: Option<SharedBuffer<f32>>,
    rate: Option<f32>,
    boundary: BoundaryMode,
    edge_creases: Option<(SharedBuffer<[u32; 2]>, SharedBuffer<f32>)>,
    vertex_creases: Option<(SharedBuffer<u32>, SharedBuffer<f32>)>,
    holes: Option<SharedBuffer<u32>>,
    options: Options,
}

geometry_options!(Subdivision);
filter_options!(Subdivision);
vertex_options!(Subdivision, [f32; 3]);

impl Subdivision {
    /// A mesh of faces: how many corners each has (3 to 15), and the vertices of all corners, face by face.
    pub fn new(
        vertices: impl Into<SharedBuffer<[f32; 3]>>,
        face_sizes: impl Into<SharedBuffer<u32>>,
        indices: impl Into<SharedBuffer<u32>>,
    ) -> Self {
        Self {
            vertices: Steps::new(vertices.into()),
            face_sizes: face_sizes.into(),
            indices: indices.into(),
            levels: None,
            rate: None,
            boundary: BoundaryMode::default(),
            edge_creases: None,
            vertex_creases: None,
            holes: None,
            options: Options::default(),
        }
    }

    /// Into how many pieces every edge is divided, 1 to 4096; values outside are moved there.
    pub fn tessellation_rate(mut self, rate: f32) -> Self {
        self.rate = Some(rate);
        self
    }

    /// The same for every corner's outgoing edge by itself. Replaces the rate.
    pub fn edge_levels(mut self, levels: impl Into<SharedBuffer<f32>>) -> Self {
        self.levels = Some(levels.into());
        self
    }

    /// What happens at the border.
    pub fn boundary(mut self, mode: BoundaryMode) -> Self {
        self.boundary = mode;
        self
    }

    /// Edges (pairs of vertices) that stay sharp, and how sharp: 0 is smooth, infinity stays a crease for ever.
    pub fn edge_creases(
        mut self,
        edges: impl Into<SharedBuffer<[u32; 2]>>,
        weights: impl Into<SharedBuffer<f32>>,
    ) -> Self {
        self.edge_creases = Some((edges.into(), weights.into()));
        self
    }

    /// Vertices that stay sharp, and how sharp.
    pub fn vertex_creases(
        mut self,
        vertices: impl Into<SharedBuffer<u32>>,
        weights: impl Into<SharedBuffer<f32>>,
    ) -> Self {
        self.vertex_creases = Some((vertices.into(), weights.into()));
        self
    }

    /// Faces that are not drawn but shape their neighbours.
    pub fn holes(mut self, faces: impl Into<SharedBuffer<u32>>) -> Self {
        self.holes = Some(faces.into());
        self
    }

    fn check(&self) -> Result<(), Error> {
        check_count("corners", self.indices.len(), u32::MAX as usize - 1)?;
        let vertices = self.vertices.first.len();
        if self.face_sizes.iter().any(|corners| !(3..=MAX_CORNERS).contains(corners)) {
            return Err(Error::InvalidOption { what: "face sizes", reason: "a face has 3 to 15 corners" });
        }
        let corners = self.face_sizes.iter().fold(0_usize, |sum, &n| sum.saturating_add(n as usize));
        check_length("corners of subdivision faces", self.indices.len(), corners)?;
        check_indices("vertex index", &self.indices, vertices)?;
        self.check_rings()?;
        if let Some(levels) = &self.levels {
            check_length("edge levels", levels.len(), corners)?;
            check_finite("edge level", levels)?;
        }
        check_finite("tessellation rate", self.rate.as_slice())?;
        if let Some((edges, weights)) = &self.edge_creases {
            check_indices("vertex of an edge crease", edges.as_flattened(), vertices)?;
            check_weights("edge crease weights", weights, edges.len())?;
        }
        if let Some((sharp, weights)) = &self.vertex_creases {
            check_indices("vertex of a vertex crease", sharp, vertices)?;
            check_weights("vertex crease weights", weights, sharp.len())?;
        }
        match &self.holes {
            Some(holes) => check_indices("face of a hole", holes, self.face_sizes.len()),
            None => Ok(()),
        }
    }

    /// Embree's tables hold the faces around a vertex, and the vertices of those faces, up to a limit. It leaves
    /// out faces beyond it when it builds, but not when it interpolates. With a vertex twice in a face it goes by
    /// memory that was never written.
    fn check_rings(&self) -> Result<(), Error> {
        let mut rings = vec![(0_usize, 1_usize); self.vertices.first.len()];
        let mut rest = &self.indices[..];
        for &size in self.face_sizes.iter() {
            let (face, others) = rest.split_at(size as usize);
            rest = others;
            if (1..face.len()).any(|i| face[..i].contains(&face[i])) {
                let reason = "the corners of a face are different vertices";
                return Err(Error::InvalidOption { what: "subdivision faces", reason });
            }
            for &vertex in face {
                let (faces, points) = &mut rings[vertex as usize];
                *faces += 1;
                *points += size as usize - 2;
            }
        }
        let faces = rings.iter().map(|ring| ring.0).max().unwrap_or(0);
        let points = rings.iter().map(|ring| ring.1).max().unwrap_or(0);
        check_count("faces around a vertex", faces, MAX_RING_FACES)?;
        check_count("vertices around a vertex", points, MAX_RING_POINTS)?;
        Ok(())
    }
}

fn check_weights(what: &'static str, weights: &[f32], count: usize) -> Result<(), Error> {
    check_length(what, weights.len(), count)?;
    match weights.iter().position(|w| w.is_nan()) {
        None => Ok(()),
        Some(position) => Err(Error::NotFinite { what, position }),
    }
}

impl Sealed for Subdivision {
    #[allow(private_interfaces, reason = "nobody outside can name this trait")]
    fn create(self, context: &CreateContext<'_>) -> Result<RawGeometry, Error> {
        use sys::{RTCBufferType as B, RTCSubdivisionMode as M};
        self.check()?;
        let kind = sys::RTCGeometryType::RTC_GEOMETRY_TYPE_SUBDIVISION;
        let mut geometry = RawGeometry::new(context, kind, FeatureMask::SUBDIVISION, self.face_sizes.len())?;
        self.vertices.bind(&mut geometry)?;
        geometry.set_buffer(Slot(B::RTC_BUFFER_TYPE_FACE.0, 0), self.face_sizes);
        geometry.set_buffer(Slot::INDEX, self.indices);
        if let Some(levels) = self.levels {
            geometry.set_buffer(Slot(B::RTC_BUFFER_TYPE_LEVEL.0, 0), levels);
        }
        if let Some((edges, weights)) = self.edge_creases {
            geometry.set_buffer(Slot(B::RTC_BUFFER_TYPE_EDGE_CREASE_INDEX.0, 0), edges);
            geometry.set_buffer(Slot(B::RTC_BUFFER_TYPE_EDGE_CREASE_WEIGHT.0, 0), weights);
        }
        if let Some((sharp, weights)) = self.vertex_creases {
            geometry.set_buffer(Slot(B::RTC_BUFFER_TYPE_VERTEX_CREASE_INDEX.0, 0), sharp);
            geometry.set_buffer(Slot(B::RTC_BUFFER_TYPE_VERTEX_CREASE_WEIGHT.0, 0), weights);
        }
        if let Some(holes) = self.holes {
            geometry.set_buffer(Slot(B::RTC_BUFFER_TYPE_HOLE.0, 0), holes);
        }
        let mode = match self.boundary {
            BoundaryMode::None => M::RTC_SUBDIVISION_MODE_NO_BOUNDARY,
            BoundaryMode::Smooth => M::RTC_SUBDIVISION_MODE_SMOOTH_BOUNDARY,
            BoundaryMode::PinCorners => M::RTC_SUBDIVISION_MODE_PIN_CORNERS,
            BoundaryMode::PinBoundary => M::RTC_SUBDIVISION_MODE_PIN_BOUNDARY,
            BoundaryMode::PinAll => M::RTC_SUBDIVISION_MODE_PIN_ALL,
        };
        geometry.set_subdivision(mode, self.rate);
        geometry.set_options(self.options, context.panics)?;
        geometry.commit()
    }
}
