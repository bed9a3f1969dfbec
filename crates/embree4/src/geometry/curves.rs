//! Hair, fibres and other curves.

use embree4_sys as sys;

use super::sealed::Sealed;
use super::{CreateContext, Options, RawGeometry, Slot, Steps, check_length};
use super::{filter_options, geometry_options, vertex_options};
use crate::{Error, FeatureMask, SharedBuffer};

/// How control points make a curve segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum CurveBasis {
    /// Two points joined by a line.
    Linear,
    /// Four Bézier control points.
    Bezier,
    /// Four uniform cubic B-spline control points.
    BSpline,
    /// Four Catmull-Rom control points; the segment runs between the middle ones.
    CatmullRom,
}

/// The cross-section of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum CurveShape {
    /// A tube. Linear segments have spherical ends.
    Round,
    /// A ribbon that faces the ray.
    Flat,
}

/// Curve segments over shared control points: position, then radius.
///
/// An index is the first control point of a segment. Segments with control points that are not finite are never hit.
#[must_use]
pub struct Curves {
    vertices: Steps<[f32; 4]>,
    indices: SharedBuffer<u32>,
    kind: Kind,
    options: Options,
}

enum Kind {
    Plain(CurveBasis, CurveShape),
    /// Tangents for every time step.
    Hermite(CurveShape, Vec<SharedBuffer<[f32; 4]>>),
    /// Normals for every time step.
    Oriented(CurveBasis, Vec<SharedBuffer<[f32; 3]>>),
}

geometry_options!(Curves);
filter_options!(Curves);
vertex_options!(Curves, [f32; 4]);

impl Curves {
    /// Curves without further data.
    pub fn new(
        basis: CurveBasis,
        shape: CurveShape,
        points: impl Into<SharedBuffer<[f32; 4]>>,
        indices: impl Into<SharedBuffer<u32>>,
    ) -> Self {
        Self::with_kind(Kind::Plain(basis, shape), points.into(), indices.into())
    }

    /// Hermite curves: two points each, with tangents (of position and radius).
    pub fn hermite(
        shape: CurveShape,
        points: impl Into<SharedBuffer<[f32; 4]>>,
        tangents: impl Into<SharedBuffer<[f32; 4]>>,
        indices: impl Into<SharedBuffer<u32>>,
    ) -> Self {
        Self::with_kind(Kind::Hermite(shape, vec![tangents.into()]), points.into(), indices.into())
    }

    /// Ribbons that turn with a normal given at every control point. There are no linear ones.
    pub fn normal_oriented(
        basis: CurveBasis,
        points: impl Into<SharedBuffer<[f32; 4]>>,
        normals: impl Into<SharedBuffer<[f32; 3]>>,
        indices: impl Into<SharedBuffer<u32>>,
    ) -> Self {
        Self::with_kind(Kind::Oriented(basis, vec![normals.into()]), points.into(), indices.into())
    }

    /// Tangents of Hermite curves at further time steps.
    pub fn tangent_steps<B: Into<SharedBuffer<[f32; 4]>>>(
        mut self,
        later: impl IntoIterator<Item = B>,
    ) -> Self {
        if let Kind::Hermite(_, tangents) = &mut self.kind {
            tangents.extend(later.into_iter().map(Into::into));
        }
        self
    }

    /// Normals of normal-oriented curves at further time steps.
    pub fn normal_steps<B: Into<SharedBuffer<[f32; 3]>>>(
        mut self,
        later: impl IntoIterator<Item = B>,
    ) -> Self {
        if let Kind::Oriented(_, normals) = &mut self.kind {
            normals.extend(later.into_iter().map(Into::into));
        }
        self
    }

    fn with_kind(kind: Kind, points: SharedBuffer<[f32; 4]>, indices: SharedBuffer<u32>) -> Self {
        Self { vertices: Steps::new(points), indices, kind, options: Options::default() }
    }
}

impl Kind {
    fn raw(&self) -> Result<sys::RTCGeometryType, Error> {
        use CurveBasis as B;
        use CurveShape as S;
        use sys::RTCGeometryType as G;
        Ok(match self {
            Self::Plain(B::Linear, S::Round) => G::RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE,
            Self::Plain(B::Linear, S::Flat) => G::RTC_GEOMETRY_TYPE_FLAT_LINEAR_CURVE,
            Self::Plain(B::Bezier, S::Round) => G::RTC_GEOMETRY_TYPE_ROUND_BEZIER_CURVE,
            Self::Plain(B::Bezier, S::Flat) => G::RTC_GEOMETRY_TYPE_FLAT_BEZIER_CURVE,
            Self::Plain(B::BSpline, S::Round) => G::RTC_GEOMETRY_TYPE_ROUND_BSPLINE_CURVE,
            Self::Plain(B::BSpline, S::Flat) => G::RTC_GEOMETRY_TYPE_FLAT_BSPLINE_CURVE,
            Self::Plain(B::CatmullRom, S::Round) => G::RTC_GEOMETRY_TYPE_ROUND_CATMULL_ROM_CURVE,
            Self::Plain(B::CatmullRom, S::Flat) => G::RTC_GEOMETRY_TYPE_FLAT_CATMULL_ROM_CURVE,
            Self::Hermite(S::Round, _) => G::RTC_GEOMETRY_TYPE_ROUND_HERMITE_CURVE,
            Self::Hermite(S::Flat, _) => G::RTC_GEOMETRY_TYPE_FLAT_HERMITE_CURVE,
            Self::Oriented(B::Bezier, _) => G::RTC_GEOMETRY_TYPE_NORMAL_ORIENTED_BEZIER_CURVE,
            Self::Oriented(B::BSpline, _) => G::RTC_GEOMETRY_TYPE_NORMAL_ORIENTED_BSPLINE_CURVE,
            Self::Oriented(B::CatmullRom, _) => G::RTC_GEOMETRY_TYPE_NORMAL_ORIENTED_CATMULL_ROM_CURVE,
            Self::Oriented(B::Linear, _) => {
                return Err(Error::Unsupported("there are no normal-oriented linear curves"));
            }
        })
    }

    /// Control points of a segment.
    fn points(&self) -> usize {
        match self {
            Self::Plain(CurveBasis::Linear, _) | Self::Hermite(..) => 2,
            Self::Plain(..) | Self::Oriented(..) => 4,
        }
    }
}

impl Sealed for Curves {
    #[allow(private_interfaces, reason = "nobody outside can name this trait")]
    fn create(self, context: &CreateContext<'_>) -> Result<RawGeometry, Error> {
        use sys::RTCBufferType as B;
        let points = self.vertices.first.len();
        let starts = (points + 1).saturating_sub(self.kind.points());
        super::check_indices("first control point", &self.indices, starts)?;
        let steps = 1 + self.vertices.later.len();
        let raw = self.kind.raw()?;
        let mut geometry = RawGeometry::new(context, raw, FeatureMask::CURVES, self.indices.len())?;
        self.vertices.bind(&mut geometry)?;
        match self.kind {
            Kind::Plain(..) => {}
            Kind::Hermite(_, tangents) => {
                check_length("time steps of tangents", tangents.len(), steps)?;
                for (step, tangents) in (0..).zip(tangents) {
                    check_length("tangents", tangents.len(), points)?;
                    geometry.set_buffer(Slot(B::RTC_BUFFER_TYPE_TANGENT.0, step), tangents);
                }
            }
            Kind::Oriented(_, normals) => {
                check_length("time steps of normals", normals.len(), steps)?;
                for (step, normals) in (0..).zip(normals) {
                    check_length("normals", normals.len(), points)?;
                    geometry.set_buffer(Slot(B::RTC_BUFFER_TYPE_NORMAL.0, step), normals);
                }
            }
        }
        geometry.set_buffer(Slot::INDEX, self.indices);
        geometry.set_options(self.options, context.panics)?;
        geometry.commit()
    }
}
