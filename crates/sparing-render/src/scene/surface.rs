//! From an Embree hit to a point on a surface.
//!
//! Points of meshes are interpolated from the vertices, which is accurate to a few ulp of the vertex
//! coordinates however far the ray came; points of spheres and disks are projected back onto them. Origins of
//! further rays are moved off the surface by [`OFFSET_ULPS`] ulp of the largest coordinate involved, so
//! offsets scale with the scene (compare "Physically Based Rendering", 4th ed., section 6.8).
//!
//! That keeps them off the triangle that was hit, but not off its neighbours, which would let light into closed
//! meshes: so points of meshes are kept off the edges too, by [`EDGE_OFFSETS`] offsets, and by more where the ray came at
//! a small angle. A point x off an edge and h along the normal is x sin a - h cos a inside of a neighbour at an angle of
//! a: at least h for x = h cot(a / 2), which is 4 h at 28 degrees. Sharper wedges need more, about 2 h / a. What comes
//! from within them, from far off the edge, comes at an angle of a at most, so its cosine, the sine of that angle, says
//! how sharp the wedge may be; from as near as 2 h / a it comes at twice that or more, but then meets the wedge half as
//! far off the edge, too. 4 h / 1.5 over the cosine leaves h / 3 in the worst case, and rounding takes less: the point's
//! own is below 6 units of 2^-24 of the largest coordinate, that of Embree's distances below 6 of the neighbour's, and h
//! is 32. `LEAST_COS` bounds how far points are moved, which still closes wedges of a degree. So rays from within a
//! closed mesh stay there if neighbours are at most four times as far from the world's origin, meet at a degree or more,
//! and have heights of 16 of those distances from the edges.

use super::{Placement, Scene};
use crate::counters::{Counter, count};
use crate::needs::Needs;
use crate::texture::TexturePoint;
use embree4::SharedBuffer;
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

/// Distance of ray origins from surfaces, in units of 2^-24 of the largest coordinate.
pub const OFFSET_ULPS: f32 = 32.0;
const OFFSET_SCALE: f32 = OFFSET_ULPS / 16_777_216.0;

/// Least distance of points from the edges of their triangle, in units of their distance from the surface.
pub const EDGE_OFFSETS: f32 = 4.0;

/// Times the cosine of the ray: the least distance over this, if it is below 1.
const COS_SCALE: f32 = 1.5;
/// Least value of that.
const LEAST_COS: f32 = 1.0 / 32.0;

/// The numbers of a shape that hits need.
#[derive(Clone, Debug)]
pub enum ShapeGeometry {
    /// Triangles.
    Triangles(Mesh<3>),
    /// Quads, each as Embree's two triangles (0,1,3) and (2,3,1).
    Quads(Mesh<4>),
    /// One sphere.
    Sphere {
        /// Centre.
        center: Vec3,
        /// Radius.
        radius: f32,
        /// Axes of the texture coordinates.
        axes: [Vec3; 3],
    },
    /// One disk.
    Disk {
        /// Centre.
        center: Vec3,
        /// Unit normal.
        normal: Vec3,
        /// Unit tangent.
        tangent: Vec3,
        /// Radius.
        radius: f32,
    },
}

/// An indexed mesh, shared with Embree.
#[derive(Clone, Debug)]
pub struct Mesh<const N: usize>
where
    [u32; N]: embree4::Element,
{
    /// Vertices.
    pub positions: SharedBuffer<[f32; 3]>,
    /// Corners of each face.
    pub indices: SharedBuffer<[u32; N]>,
    /// Vertex normals.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Vertex texture coordinates.
    pub uvs: Option<Arc<Vec<[f32; 2]>>>,
    /// Vertex colours and opacities.
    pub colors: Option<Arc<Vec<[f32; 4]>>>,
    /// Second texture coordinates.
    pub second_uvs: Option<Vec<[f32; 2]>>,
    /// Tangents of the vertices.
    pub tangents: Option<Vec<[f32; 3]>>,
}

/// A shape of the scene.
#[derive(Clone, Debug)]
pub struct ShapeRecord {
    /// Its numbers.
    pub geometry: ShapeGeometry,
    /// Index of its material.
    pub material: u32,
    /// Index of its emission.
    pub emission: Option<u32>,
    /// Whether its normal is turned round.
    pub flip: bool,
    /// Lights of its faces.
    pub lights: FaceLights,
}

/// Which light each face of an emitting shape is.
#[derive(Clone, Debug, Default)]
pub enum FaceLights {
    /// The shape does not emit.
    #[default]
    None,
    /// The shape emits, but moves: [`FaceLights::BY_CHANCE`].
    ByChance,
    /// Light of each face; [`FaceLights::DARK`] for a face without area.
    PerFace(Vec<u32>),
    /// Lights of the two halves of each quad: Embree's triangles (0,1,3) and (2,3,1).
    PerHalf(Vec<[u32; 2]>),
}

impl FaceLights {
    /// No light: a face without area.
    pub const DARK: u32 = u32::MAX;
    /// Emits, but is not in the table of lights: only rays that hit it by chance find it.
    pub const BY_CHANCE: u32 = u32::MAX - 1;

    /// Light at a hit.
    #[inline]
    #[must_use]
    pub fn get(&self, hit: &SurfaceHit) -> Option<u32> {
        let light = match self {
            Self::None => None,
            Self::ByChance => Some(Self::BY_CHANCE),
            Self::PerFace(lights) => lights.get(hit.face as usize).copied(),
            Self::PerHalf(lights) => {
                lights.get(hit.face as usize).map(|l| l[usize::from(hit.u + hit.v > 1.0)])
            }
        };
        light.filter(|l| *l != Self::DARK)
    }
}

/// A hit, by Embree's ids.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceHit {
    /// Shape among the scene's (top-level or of an object).
    pub shape: u32,
    /// Instance, if any.
    pub instance: Option<u32>,
    /// Face of the shape.
    pub face: u32,
    /// Embree's coordinates within the face.
    pub u: f32,
    /// Embree's coordinates within the face.
    pub v: f32,
}

/// A point on a surface in world space.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position.
    pub p: Vec3,
    /// Unit geometric normal on the outer side.
    pub ng: Vec3,
    /// Unit shading normal on the same side.
    pub ns: Vec3,
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Second texture coordinates; zero unless they are needed and there are some.
    pub second_uv: [f32; 2],
    /// Derivative of the position by u; zero unless tangents are needed.
    pub dpdu: Vec3,
    /// Derivative of the position by v; zero unless tangents are needed.
    pub dpdv: Vec3,
    /// How far off the surface rays start.
    pub offset: f32,
    /// Colour of the vertices around; white unless it is needed and there is one.
    pub color: Vec3,
}

impl SurfacePoint {
    /// A place holder.
    pub(crate) const NONE: Self = Self {
        p: Vec3::ZERO,
        ng: Vec3::Z,
        ns: Vec3::Z,
        uv: [0.0; 2],
        second_uv: [0.0; 2],
        dpdu: Vec3::ZERO,
        dpdv: Vec3::ZERO,
        offset: 0.0,
        color: Vec3::ONE,
    };

    /// Where textures are looked up.
    #[inline]
    #[must_use]
    pub fn texture_point(&self) -> TexturePoint {
        TexturePoint { uv: self.uv, second_uv: self.second_uv, p: self.p, n: self.ng }
    }

    /// Where a ray along `w` starts: on its side of the surface.
    #[inline]
    #[must_use]
    pub fn ray_origin(&self, w: Vec3) -> Vec3 {
        self.p + self.ng * self.offset.copysign(self.ng.dot(w))
    }
}

/// Texture coordinates of a sphere: longitude and, from the pole, latitude.
#[must_use]
pub fn sphere_uv(normal: Vec3, axes: &[Vec3; 3]) -> [f32; 2] {
    let (x, y, z) = (normal.dot(axes[0]), normal.dot(axes[1]), normal.dot(axes[2]));
    let phi = y.atan2(x);
    [(if phi < 0.0 { phi + 2.0 * PI } else { phi }) * 0.5 * FRAC_1_PI, x.hypot(y).atan2(-z) * FRAC_1_PI]
}

/// Texture coordinates of a unit disk: angle, and distance from the rim.
#[must_use]
pub fn disk_uv(x: f32, y: f32) -> [f32; 2] {
    let phi = y.atan2(x);
    [(if phi < 0.0 { phi + 2.0 * PI } else { phi }) * 0.5 * FRAC_1_PI, 1.0 - x.hypot(y).min(1.0)]
}

impl Scene {
    /// The point of a hit. `origin`, `direction` and `t` are the ray's; only round shapes use them. `time` is the ray's, too;
    /// only what moves uses it.
    #[inline]
    #[must_use]
    pub fn surface_point<const NEEDS: u32>(
        &self,
        hit: &SurfaceHit,
        origin: Vec3,
        direction: Vec3,
        t: f32,
        time: f32,
    ) -> SurfacePoint {
        let shape = &self.shapes[hit.shape as usize];
        let record = hit.instance.map(|i| &self.instances[i as usize]);
        let mut instance = record.map(|record| &record.place);
        let moved;
        if Needs::from_bits_retain(NEEDS).contains(Needs::MOTION)
            && let Some(way) = record.and_then(|record| record.way.as_ref())
        {
            count(Counter::Motion);
            moved = Placement::new(way.at(time));
            instance = Some(&moved);
        }
        let mut s = match &shape.geometry {
            ShapeGeometry::Triangles(mesh) => {
                let [a, b, c] = mesh.indices[hit.face as usize];
                mesh.triangle::<NEEDS>([a, b, c], TRIANGLE_UVS, hit.u, hit.v, direction, instance)
            }
            ShapeGeometry::Quads(mesh) => {
                let [a, b, c, d] = mesh.indices[hit.face as usize];
                if hit.u + hit.v <= 1.0 {
                    mesh.triangle::<NEEDS>(
                        [a, b, d],
                        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
                        hit.u,
                        hit.v,
                        direction,
                        instance,
                    )
                } else {
                    let uvs = [[1.0, 1.0], [0.0, 1.0], [1.0, 0.0]];
                    mesh.triangle::<NEEDS>([c, d, b], uvs, 1.0 - hit.u, 1.0 - hit.v, direction, instance)
                }
            }
            ShapeGeometry::Sphere { center, radius, axes } => {
                round_point(origin, direction, t, instance, |p| sphere_point(p, *center, *radius, axes))
            }
            ShapeGeometry::Disk { center, normal, tangent, radius } => {
                round_point(origin, direction, t, instance, |p| {
                    disk_point(p, *center, *normal, *tangent, *radius)
                })
            }
        };
        if shape.flip {
            s.ng = -s.ng;
            s.ns = -s.ns;
        }
        s
    }
}

const TRIANGLE_UVS: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];

impl<const N: usize> Mesh<N>
where
    [u32; N]: embree4::Element,
{
    #[inline]
    fn triangle<const NEEDS: u32>(
        &self,
        corners: [u32; 3],
        default_uvs: [[f32; 2]; 3],
        u: f32,
        v: f32,
        direction: Vec3,
        instance: Option<&Placement>,
    ) -> SurfacePoint {
        let needs = Needs::from_bits_retain(NEEDS);
        let mut p = corners.map(|i| Vec3::from(self.positions[i as usize]));
        let instance = instance.filter(|_| needs.contains(Needs::INSTANCES));
        if let Some(i) = instance {
            p = p.map(|p| i.object_to_world.transform_point3(p));
        }
        let w = 1.0 - u - v;
        let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
        let cross = e1.cross(e2);
        let mut ng = cross.normalize_or_zero();
        let largest = p[0].abs().max(p[1].abs()).max(p[2].abs()).max_element();
        let mut offset = largest * OFFSET_SCALE;
        if let Some(i) = instance {
            ng *= i.handedness;
            offset = offset.max(i.magnitude * OFFSET_SCALE);
        }
        let mut weights = [w, u, v];
        // No edge is longer than the root of twice the sum: a point that passes is far from all of them.
        let nearest = w.min(u).min(v).max(0.0);
        // The scaled cosine times the length of `cross`, squared: nothing here waits for the normal.
        let (square, along) = (cross.length_squared(), COS_SCALE * cross.dot(direction));
        let scaled = (along * along).max(LEAST_COS * LEAST_COS * square).min(square);
        let least = EDGE_OFFSETS * offset;
        if nearest * nearest * scaled < least * least * 2.0 * (e1.length_squared() + e2.length_squared()) {
            let margin = least * (square / scaled).sqrt();
            weights = off_edges(weights, cross.length(), [e2 - e1, e2, e1], least, margin);
        }
        let position = p[0] * weights[0] + p[1] * weights[1] + p[2] * weights[2];
        let mut ns = ng;
        if let Some(normals) = self.normals.as_ref().filter(|_| needs.contains(Needs::SHADING_NORMALS)) {
            count(Counter::ShadingNormal);
            let n = corners.map(|i| Vec3::from(normals[i as usize]));
            let mut n = n[0] * w + n[1] * u + n[2] * v;
            if let Some(i) = instance {
                n = Vec3::from(i.normal_to_world * glam::Vec3A::from(n));
            }
            let length = n.length();
            // Degenerate normals fall back to the face's.
            if length > 0.0 && length.is_finite() {
                ns = n / length;
                if ng.dot(ns) < 0.0 {
                    ng = -ng; // the vertex normals say which side is outside
                }
            }
        }
        let (mut uv, mut dpdu, mut dpdv) = ([0.0; 2], Vec3::ZERO, Vec3::ZERO);
        if needs.intersects(Needs::TEXTURE_COORDINATES.union(Needs::TANGENTS)) {
            count(Counter::TextureCoordinates);
            let uvs = match &self.uvs {
                Some(all) => corners.map(|i| all[i as usize]),
                None => default_uvs,
            };
            uv = [0, 1].map(|k| uvs[0][k] * w + uvs[1][k] * u + uvs[2][k] * v);
            if needs.contains(Needs::TANGENTS) {
                (dpdu, dpdv) = derivatives(e1, e2, uvs, ng);
                if let Some(tangents) = &self.tangents {
                    let t = corners.map(|i| Vec3::from(tangents[i as usize]));
                    let mut t = t[0] * w + t[1] * u + t[2] * v;
                    if let Some(i) = instance {
                        t = i.object_to_world.transform_vector3(t);
                    }
                    // The length stays, for bump maps.
                    dpdu = t.try_normalize().map_or(dpdu, |t| t * dpdu.length());
                }
            }
        }
        let mut second_uv = [0.0; 2];
        if let Some(all) = self.second_uvs.as_ref().filter(|_| needs.contains(Needs::SECOND_UVS)) {
            count(Counter::SecondUv);
            let uvs = corners.map(|i| all[i as usize]);
            second_uv = [0, 1].map(|k| uvs[0][k] * w + uvs[1][k] * u + uvs[2][k] * v);
        }
        let mut color = Vec3::ONE;
        if let Some(colors) = self.colors.as_ref().filter(|_| needs.contains(Needs::VERTEX_COLORS)) {
            count(Counter::VertexColor);
            let c = corners.map(|i| Vec3::from_slice(&colors[i as usize]));
            color = c[0] * w + c[1] * u + c[2] * v;
        }
        SurfacePoint { p: position, ng, ns, uv, second_uv, dpdu, dpdv, offset, color }
    }
}

/// Barycentric coordinates in the same triangle with its sides moved inwards by `least`, but by a quarter of its height
/// at most, and by `margin` as far as that is a sixteenth. `sides` are opposite to the corners, `area` is twice the
/// triangle's.
#[cold]
#[inline(never)]
fn off_edges(weights: [f32; 3], area: f32, sides: [Vec3; 3], least: f32, margin: f32) -> [f32; 3] {
    let least = sides.map(|side| {
        let of_height = side.length() / area;
        (least * of_height).min(0.25).max((margin * of_height).min(1.0 / 16.0))
    });
    let weights = weights.map(|w| w.max(0.0));
    let rest = (1.0 - least[0] - least[1] - least[2]) / (weights[0] + weights[1] + weights[2]);
    [0, 1, 2].map(|k| least[k] + weights[k] * rest)
}

/// Derivatives of the position by the texture coordinates; any tangents where those are degenerate.
fn derivatives(e1: Vec3, e2: Vec3, uvs: [[f32; 2]; 3], ng: Vec3) -> (Vec3, Vec3) {
    let d = |i: usize, k: usize| uvs[i][k] - uvs[0][k];
    let determinant = d(1, 0) * d(2, 1) - d(1, 1) * d(2, 0);
    let inv = 1.0 / determinant;
    let (dpdu, dpdv) = ((e1 * d(2, 1) - e2 * d(1, 1)) * inv, (e2 * d(1, 0) - e1 * d(2, 0)) * inv);
    if dpdu.is_finite() && dpdv.is_finite() && dpdu.cross(dpdv) != Vec3::ZERO {
        (dpdu, dpdv)
    } else {
        let frame = crate::sampling::Frame::from_z(ng);
        (frame.x, frame.y)
    }
}

#[inline]
fn round_point(
    origin: Vec3,
    direction: Vec3,
    t: f32,
    instance: Option<&Placement>,
    point: impl Fn(Vec3) -> SurfacePoint,
) -> SurfacePoint {
    let p = origin + direction * t;
    let Some(i) = instance else { return point(p) };
    let mut s = point(i.world_to_object.transform_point3(p));
    s.p = i.object_to_world.transform_point3(s.p);
    let normal = |n: Vec3| Vec3::from(i.normal_to_world * glam::Vec3A::from(n)).normalize_or_zero();
    s.ng = normal(s.ng);
    s.ns = normal(s.ns);
    s.dpdu = i.object_to_world.transform_vector3(s.dpdu);
    s.dpdv = i.object_to_world.transform_vector3(s.dpdv);
    let largest = s.p.abs().max_element().max(i.magnitude);
    s.offset = largest * 4.0 * OFFSET_SCALE;
    s
}

fn sphere_point(p: Vec3, center: Vec3, radius: f32, axes: &[Vec3; 3]) -> SurfacePoint {
    let n = (p - center).normalize_or_zero();
    let p = center + n * radius;
    let pole = axes[2];
    let r = (n - pole * n.dot(pole)) * radius; // from the axis to the point
    let dpdu = pole.cross(r) * (2.0 * PI);
    // v grows from the south pole.
    let dpdv = (pole - n * n.dot(pole)).normalize_or_zero() * (PI * radius);
    let offset = (center.abs().max_element() + radius) * 4.0 * OFFSET_SCALE;
    let uv = sphere_uv(n, axes);
    SurfacePoint { p, ng: n, ns: n, uv, dpdu, dpdv, offset, ..SurfacePoint::NONE }
}

fn disk_point(p: Vec3, center: Vec3, normal: Vec3, tangent: Vec3, radius: f32) -> SurfacePoint {
    let d = p - center;
    let d = d - normal * normal.dot(d);
    let bitangent = normal.cross(tangent);
    let (x, y) = (d.dot(tangent) / radius, d.dot(bitangent) / radius);
    let dpdu = normal.cross(d) * (2.0 * PI);
    let dpdv = -d.normalize_or_zero() * radius;
    let offset = (center.abs().max_element() + radius) * 4.0 * OFFSET_SCALE;
    SurfacePoint {
        p: center + d,
        ng: normal,
        ns: normal,
        uv: disk_uv(x, y),
        dpdu,
        dpdv,
        offset,
        ..SurfacePoint::NONE
    }
}
