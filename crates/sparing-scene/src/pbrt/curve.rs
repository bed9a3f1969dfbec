//! `curve`: Bezier and uniform B-spline curves of degree 2 or 3 with a width, as meshes.
//!
//! `flat` and `cylinder` curves become tubes with eight sides whose mean width seen from all sides is that of the curve:
//! a flat curve faces the viewer wherever it is seen from, and so does a tube. `ribbon` curves become strips across the
//! normals at the ends of their segments. The shading of a tube is that of a cylinder; pbrt shades `flat` curves as if
//! they were flat. Ends are open.

use super::Builder;
use super::params::{ParamList, ParamType};
use crate::description::TriangleMesh;
use crate::error::SceneError;
use crate::source::Span;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Sides of a tube.
const SIDES: usize = 8;

/// A curve in its own space.
struct Curve {
    points: Vec<DVec3>,
    degree: usize,
    bspline: bool,
    segments: usize,
    /// At the start and at the end.
    width: [f64; 2],
    /// At the ends of the segments of a ribbon.
    normals: Option<Vec<DVec3>>,
    /// Pieces that each segment becomes.
    pieces: usize,
}

impl Builder<'_> {
    pub(super) fn curve(&mut self, at: &Span, params: &ParamList) -> Result<(), SceneError> {
        let curve = curve(at, params)?;
        let samples = (curve.segments * curve.pieces + 1) as u64;
        let vertices = samples * (SIDES as u64 + 1);
        if vertices > self.options.max_vertices {
            return Err(self.options.exceeded("max_vertices", self.options.max_vertices, vertices).at(at));
        }
        let mesh = if curve.normals.is_some() { curve.ribbon() } else { curve.tube() };
        self.add_mesh(mesh, at)
    }
}

fn curve(at: &Span, params: &ParamList) -> Result<Curve, SceneError> {
    let Some((param, values)) = params.groups("P", &[ParamType::Point3], 3)? else {
        return Err(super::missing("P", "point3", at));
    };
    let points: Vec<DVec3> =
        values.as_chunks::<3>().0.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
    let degree = params.integer_in("degree", 2..=3)?.map_or(3, |d| d.unsigned_abs() as usize);
    let bspline = match params.string("basis")? {
        None | Some(("bezier", _)) => false,
        Some(("bspline", _)) => true,
        Some((name, basis)) => {
            let error = basis.value_error(0, format!("there is no basis `{name}`"));
            return Err(error.help("known are bezier and bspline"));
        }
    };
    let count = points.len();
    let fits = if bspline { count > degree } else { count > degree && (count - 1).is_multiple_of(degree) };
    if !fits {
        let what = if bspline { "a B-spline" } else { "Bezier segments" };
        return Err(param.error(format!("{count} points do not make {what} of degree {degree}")));
    }
    let segments = if bspline { count - degree } else { (count - 1) / degree };
    let width = params.float_where("width", 1.0, "positive", |w| w > 0.0)?;
    let end = |name: &str| params.float_where(name, width, "not negative", |w| w >= 0.0);
    let width = [f64::from(end("width0")?), f64::from(end("width1")?)];
    let ribbon = match params.string("type")? {
        None | Some(("flat" | "cylinder", _)) => false,
        Some(("ribbon", _)) => true,
        Some((name, ty)) => {
            let error = ty.value_error(0, format!("there is no curve type `{name}`"));
            return Err(error.help("known are flat, cylinder and ribbon"));
        }
    };
    let mut normals = None;
    if ribbon {
        let Some((param, values)) = params.groups("N", &[ParamType::Normal, ParamType::Point3], 3)? else {
            return Err(super::missing("N", "normal", at));
        };
        let given: Vec<DVec3> =
            values.as_chunks::<3>().0.iter().map(|n| DVec3::from_array(n.map(f64::from))).collect();
        if given.len() != segments + 1 {
            let message =
                format!("{segments} segments of a ribbon need {} normals, not {}", segments + 1, given.len());
            return Err(param.error(message));
        }
        normals = Some(given);
    } else {
        params.ignore(&["N"]);
    }
    let pieces = 1 << params.integer_in("splitdepth", 0..=100)?.map_or(3, |depth| depth.clamp(2, 4));
    Ok(Curve { points, degree, bspline, segments, width, normals, pieces })
}

impl Curve {
    /// Point and derivative at `t` in 0..=1 of a segment (W. Boehm et al. 1984).
    fn at(&self, segment: usize, t: f64) -> (DVec3, DVec3) {
        let first = if self.bspline { segment } else { segment * self.degree };
        let c = &self.points[first..=first + self.degree];
        let s = 1.0 - t;
        let sum = |weights: &[f64]| c.iter().zip(weights).map(|(c, w)| *c * *w).sum::<DVec3>();
        match (self.bspline, self.degree) {
            (false, 2) => (sum(&[s * s, 2.0 * s * t, t * t]), sum(&[-2.0 * s, 2.0 * (s - t), 2.0 * t])),
            (false, _) => (
                sum(&[s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t]),
                sum(&[-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t]),
            ),
            (true, 2) => (sum(&[s * s / 2.0, 0.5 + s * t, t * t / 2.0]), sum(&[-s, s - t, t])),
            (true, _) => (
                sum(&[
                    s * s * s / 6.0,
                    (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
                    (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
                    t * t * t / 6.0,
                ]),
                sum(&[
                    -s * s / 2.0,
                    (-4.0 * t + 3.0 * t * t) / 2.0,
                    (4.0 * s - 3.0 * s * s) / 2.0,
                    t * t / 2.0,
                ]),
            ),
        }
    }

    /// Position along the curve in 0..=1, point and unit tangent of every sample.
    fn samples(&self) -> Vec<(f64, DVec3, DVec3)> {
        let count = self.segments * self.pieces;
        let mut tangent = DVec3::Z;
        let sample = |i: usize| {
            let segment = (i / self.pieces).min(self.segments - 1);
            let t = (i - segment * self.pieces) as f64 / self.pieces as f64;
            let (p, d) = self.at(segment, t);
            // Where points coincide the tangent is that of before.
            tangent = d.try_normalize().unwrap_or(tangent);
            (i as f64 / count as f64, p, tangent)
        };
        (0..=count).map(sample).collect()
    }

    fn width_at(&self, u: f64) -> f64 {
        self.width[0] + (self.width[1] - self.width[0]) * u
    }

    fn tube(&self) -> TriangleMesh {
        // A regular polygon of radius 1 is n sin(pi / n) 2 / pi wide on average, a circle 2 (Cauchy).
        let wider = PI / (SIDES as f64 * (PI / SIDES as f64).sin());
        let samples = self.samples();
        let mut side = samples[0].2.any_orthonormal_vector();
        let (mut mesh, mut normals, mut uvs) = (TriangleMesh::default(), Vec::new(), Vec::new());
        for (u, p, tangent) in &samples {
            // The frame turns as little as it can along the curve.
            side = (side - *tangent * tangent.dot(side))
                .try_normalize()
                .unwrap_or(tangent.any_orthonormal_vector());
            let across = tangent.cross(side);
            let radius = 0.5 * self.width_at(*u) * wider;
            for k in 0..=SIDES {
                let v = k as f64 / SIDES as f64;
                let (sin, cos) = (TAU * v).sin_cos();
                let n = side * cos + across * sin;
                mesh.positions.push((*p + n * radius).as_vec3().to_array());
                normals.push(n.as_vec3().to_array());
                uvs.push([*u as f32, v as f32]);
            }
        }
        mesh.indices = strips(samples.len(), SIDES);
        TriangleMesh { normals: Some(normals), uvs: Some(uvs), ..mesh }
    }

    fn ribbon(&self) -> TriangleMesh {
        let ends = self.normals.as_deref().unwrap_or_default();
        let samples = self.samples();
        let (mut mesh, mut normals, mut uvs) = (TriangleMesh::default(), Vec::new(), Vec::new());
        for (i, (u, p, tangent)) in samples.iter().enumerate() {
            let segment = (i / self.pieces).min(self.segments - 1);
            let t = (i - segment * self.pieces) as f64 / self.pieces as f64;
            let normal = slerp(ends[segment], ends[segment + 1], t);
            let across = normal.cross(*tangent).normalize_or_zero() * (0.5 * self.width_at(*u));
            for (v, q) in [(0.0, *p - across), (1.0, *p + across)] {
                mesh.positions.push(q.as_vec3().to_array());
                normals.push(normal.as_vec3().to_array());
                uvs.push([*u as f32, v]);
            }
        }
        mesh.indices = strips(samples.len(), 1);
        TriangleMesh { normals: Some(normals), uvs: Some(uvs), ..mesh }
    }
}

/// Between two directions along the great circle (K. Shoemake 1985).
fn slerp(a: DVec3, b: DVec3, t: f64) -> DVec3 {
    let (a, b) = (a.normalize_or(DVec3::Z), b.normalize_or(DVec3::Z));
    let angle = a.angle_between(b);
    if angle < 1e-6 {
        return a;
    }
    ((a * ((1.0 - t) * angle).sin() + b * (t * angle).sin()) / angle.sin()).normalize_or(a)
}

/// Triangles between rows of `columns` + 1 vertices.
fn strips(rows: usize, columns: usize) -> Vec<[u32; 3]> {
    let width = columns as u32 + 1;
    let mut indices = Vec::with_capacity(2 * (rows - 1) * columns);
    for row in 0..rows as u32 - 1 {
        for column in 0..columns as u32 {
            let a = row * width + column;
            indices.extend([[a, a + 1, a + width + 1], [a, a + width + 1, a + width]]);
        }
    }
    indices
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn straight(bspline: bool, degree: usize, segments: usize) -> Curve {
        let count = if bspline { segments + degree } else { segments * degree + 1 };
        let points = (0..count).map(|i| DVec3::X * i as f64).collect();
        Curve { points, degree, bspline, segments, width: [0.5, 0.5], normals: None, pieces: 8 }
    }

    #[test]
    fn all_bases_are_continuous_and_their_derivatives_are_right() {
        let mut curves = Vec::new();
        for (bspline, degree) in [(false, 2), (false, 3), (true, 2), (true, 3)] {
            let mut c = straight(bspline, degree, 2);
            for (i, p) in c.points.iter_mut().enumerate() {
                *p += DVec3::new(0.0, (i as f64 * 1.7).sin(), (i as f64 * 0.9).cos());
            }
            curves.push(c);
        }
        for c in &curves {
            assert!(c.at(0, 1.0).0.abs_diff_eq(c.at(1, 0.0).0, 1e-12));
            let h = 1e-6;
            let difference = (c.at(1, 0.3 + h).0 - c.at(1, 0.3 - h).0) / (2.0 * h);
            assert!(difference.abs_diff_eq(c.at(1, 0.3).1, 1e-6));
        }
        // A cubic B-spline begins at (p0 + 4 p1 + p2) / 6.
        let c = &curves[3];
        let start = (c.points[0] + c.points[1] * 4.0 + c.points[2]) / 6.0;
        assert!(c.at(0, 0.0).0.abs_diff_eq(start, 1e-12));
    }

    /// A straight tube of width 0.5 and length 6: its area is close to pi times width times length, and it looks as wide
    /// as it should: its mean projected area is a quarter of its surface (Cauchy), that of a cylinder.
    #[test]
    fn tubes_have_their_area_and_face_outwards() {
        let curve = straight(false, 3, 2);
        let mesh = curve.tube();
        let corner = |t: [u32; 3]| t.map(|i| Vec3::from(mesh.positions[i as usize]));
        let area: f64 =
            mesh.indices.iter().map(|&t| super::super::mesh::cross(corner(t)).length() / 2.0).sum();
        assert!((area / (PI * 0.5 * 6.0) - 1.0).abs() < 1e-6, "{area}");
        for t in &mesh.indices {
            let normal = Vec3::from(mesh.normals.as_ref().unwrap()[t[0] as usize]).as_dvec3();
            assert!(super::super::mesh::cross(corner(*t)).dot(normal) > 0.0);
        }
    }

    #[test]
    fn ribbons_lie_across_their_normals() {
        let curve = Curve { normals: Some(vec![DVec3::Y; 3]), width: [1.0, 0.0], ..straight(true, 2, 2) };
        let mesh = curve.ribbon();
        let (a, b) = (Vec3::from(mesh.positions[0]), Vec3::from(mesh.positions[1]));
        assert!((b - a).abs_diff_eq(Vec3::NEG_Z, 1e-6), "{}", b - a);
        assert!(mesh.normals.unwrap().iter().all(|n| Vec3::from(*n).abs_diff_eq(Vec3::Y, 1e-6)));
        let n = mesh.positions.len();
        assert_eq!(mesh.positions[n - 1], mesh.positions[n - 2]);
        let half = slerp(DVec3::X, DVec3::Y, 0.5);
        assert!(half.abs_diff_eq(DVec3::new(0.5f64.sqrt(), 0.5f64.sqrt(), 0.0), 1e-12));
    }
}
