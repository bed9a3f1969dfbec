//! Hits against a brute-force intersector in double precision, on random scenes.
//!
//! Single-precision traversal may decide either way about a ray that passes within `EDGE` of an edge, silhouette or
//! segment end, or nearly within the plane. Such rays are left out, and the tests demand that they are few.

mod common;

use common::device;
use embree4::{
    Device, Hit, INVALID_ID, Instance, QuadMesh, QueryOptions, Ray, Ray4, Ray8, Ray16, RayHit, RayHit4,
    RayHit8, RayHit16, Scene, SceneBuilder, SceneFlags, Spheres, TriangleMesh, Valid4, Valid8, Valid16,
};
use proptest::prelude::*;

/// Distance (in surface coordinates, or radii, or along the ray) within which a decision may differ.
const EDGE: f64 = 2e-3;
/// Largest difference of distances, relative to 1 + t, and of surface coordinates.
const TOLERANCE: f64 = 1e-3;
const RAYS: usize = 48;

type P = [f64; 3];

fn wide(p: [f32; 3]) -> P {
    p.map(f64::from)
}
fn sub(a: P, b: P) -> P {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
fn dot(a: P, b: P) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn cross(a: P, b: P) -> P {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
fn length(a: P) -> f64 {
    dot(a, a).sqrt()
}

/// Where a ray meets the surface of a primitive, extended somewhat beyond its edges.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    t: f64,
    u: f64,
    v: f64,
    prim: u32,
    geom: u32,
    inst: u32,
    /// Inside by this much, outside if negative.
    margin: f64,
}

struct Segment {
    org: P,
    dir: P,
    tnear: f64,
    tfar: f64,
}

impl Segment {
    fn new(ray: &Ray) -> Self {
        let (tnear, tfar) = (ray.tnear.into(), ray.tfar.into());
        Self { org: wide(ray.org), dir: wide(ray.dir), tnear, tfar }
    }

    fn triangle(&self, [a, b, c]: [P; 3]) -> Option<Crossing> {
        let (e1, e2) = (sub(b, a), sub(c, a));
        let p = cross(self.dir, e2);
        let det = dot(e1, p);
        let s = sub(self.org, a);
        let q = cross(s, e1);
        let (u, v, t) = (dot(s, p) / det, dot(self.dir, q) / det, dot(e2, q) / det);
        let normal = cross(e1, e2);
        // The sine between ray and plane, and flat triangles, spoil the precision of everything else.
        let quality = det.abs() / (length(self.dir) * length(normal).max(1e-300));
        let thin = length(normal) / (length(e1) * length(e2)).max(1e-300);
        let margin = if quality < 0.02 || thin < 0.02 { 0.0 } else { u.min(v).min(1.0 - u - v) };
        t.is_finite().then_some(Crossing { t, u, v, prim: 0, geom: 0, inst: INVALID_ID, margin })
    }

    fn quad(&self, [a, b, c, d]: [P; 4]) -> [Option<Crossing>; 2] {
        let second = self.triangle([c, d, b]).map(|x| Crossing { u: 1.0 - x.u, v: 1.0 - x.v, ..x });
        [self.triangle([a, b, d]), second]
    }

    fn sphere(&self, centre: P, radius: f64) -> Vec<Crossing> {
        let s = sub(self.org, centre);
        let (a, b) = (dot(self.dir, self.dir), dot(s, self.dir));
        let nearest = length(sub(s, self.dir.map(|d| d * b / a)));
        let margin = 1.0 - nearest / radius;
        let half = (radius * radius - nearest * nearest).max(0.0).sqrt() / a.sqrt();
        [-half, half]
            .map(|h| Crossing { t: h - b / a, u: 0.0, v: 0.0, prim: 0, geom: 0, inst: INVALID_ID, margin })
            .to_vec()
    }
}

/// A random scene: geometry 0 triangles, 1 quads, 2 spheres, 3 an instance of the triangles.
#[derive(Clone, Debug)]
struct Soup {
    points: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    quads: Vec<[u32; 4]>,
    spheres: Vec<[f32; 4]>,
    transform: [f32; 12],
    flags: SceneFlags,
    rays: Vec<Ray>,
}

impl Soup {
    fn build(&self, device: &Device) -> Scene {
        let mut inner = SceneBuilder::new(device).unwrap().flags(self.flags);
        inner.attach(TriangleMesh::new(self.points.clone(), self.triangles.clone())).unwrap();
        let inner = inner.commit().unwrap();
        let mut scene = SceneBuilder::new(device).unwrap().flags(self.flags);
        scene.attach(TriangleMesh::new(self.points.clone(), self.triangles.clone())).unwrap();
        scene.attach(QuadMesh::new(self.points.clone(), self.quads.clone())).unwrap();
        scene.attach(Spheres::new(self.spheres.clone())).unwrap();
        scene.attach(Instance::new(&inner, self.transform)).unwrap();
        scene.commit().unwrap()
    }

    fn crossings(&self, ray: &Segment) -> Vec<Crossing> {
        let point = |i: u32| wide(self.points[i as usize]);
        let m = self.transform.map(f64::from);
        let moved = |p: P| -> P {
            std::array::from_fn(|r| m[r] * p[0] + m[3 + r] * p[1] + m[6 + r] * p[2] + m[9 + r])
        };
        let mut found = Vec::new();
        for (prim, corners) in (0..).zip(&self.triangles) {
            found.extend(ray.triangle(corners.map(point)).map(|c| Crossing { prim, ..c }));
            let placed = ray.triangle(corners.map(point).map(moved));
            found.extend(placed.map(|c| Crossing { prim, inst: 3, ..c }));
        }
        for (prim, corners) in (0..).zip(&self.quads) {
            let halves = ray.quad(corners.map(point));
            found.extend(halves.into_iter().flatten().map(|c| Crossing { prim, geom: 1, ..c }));
        }
        for (prim, s) in (0..).zip(&self.spheres) {
            let sphere = ray.sphere(wide([s[0], s[1], s[2]]), s[3].into());
            found.extend(sphere.into_iter().map(|c| Crossing { prim, geom: 2, ..c }));
        }
        found
    }

    /// The nearest crossing (if any), or nothing at all if the ray is too close to call.
    fn oracle(&self, ray: &Ray) -> Option<Option<Crossing>> {
        let segment = Segment::new(ray);
        let crossings = self.crossings(&segment);
        let near = |t: f64, end: f64| (t - end).abs() < EDGE * (1.0 + end.abs());
        let nearest = crossings
            .iter()
            .filter(|c| c.margin >= EDGE && segment.tnear <= c.t && c.t <= segment.tfar)
            .min_by(|a, b| a.t.total_cmp(&b.t));
        let limit = nearest.map_or(segment.tfar, |c| c.t) * (1.0 + EDGE) + EDGE;
        let close =
            crossings.iter().filter(|c| c.margin > -EDGE && c.t < limit && c.t > segment.tnear - EDGE);
        for c in close {
            let tie = nearest.is_some_and(|n| near(c.t, n.t) && !same_place(c, n));
            if c.margin < EDGE || near(c.t, segment.tnear) || near(c.t, segment.tfar) || tie {
                return None;
            }
        }
        Some(nearest.copied())
    }
}

fn same_place(a: &Crossing, b: &Crossing) -> bool {
    (a.prim, a.geom, a.inst) == (b.prim, b.geom, b.inst) && (a.t - b.t).abs() < 1e-12
}

fn soup() -> impl Strategy<Value = Soup> {
    let coordinate = || -1.0_f32..1.0;
    let point = prop::array::uniform3(coordinate());
    let sphere = (point.clone(), 0.05_f32..0.5).prop_map(|([x, y, z], r)| [x, y, z, r]);
    let ray = (prop::array::uniform3(-2.0_f32..2.0), point.clone(), 0.3_f32..4.0, 0.0_f32..0.3)
        .prop_map(|(org, to, length, tnear)| {
            let dir = std::array::from_fn(|i| to[i] - org[i]);
            Ray::segment(org, dir, tnear, tnear + length)
        })
        .prop_filter("a direction", |ray| length(wide(ray.dir)) > 0.1);
    let transform = prop::array::uniform12(-1.2_f32..1.2).prop_filter("an invertible transform", |t| {
        let column = |i: usize| wide([t[i], t[i + 1], t[i + 2]]);
        dot(column(0), cross(column(3), column(6))).abs() > 0.1
    });
    let flags = prop::sample::select(vec![
        SceneFlags::empty(),
        SceneFlags::ROBUST,
        SceneFlags::COMPACT,
        SceneFlags::ROBUST | SceneFlags::COMPACT,
        SceneFlags::DYNAMIC,
    ]);
    (8_usize..30).prop_flat_map(move |count| {
        let index = 0..count as u32;
        (
            prop::collection::vec(point.clone(), count),
            prop::collection::vec(prop::array::uniform3(index.clone()), 0..12),
            prop::collection::vec(prop::array::uniform4(index), 0..6),
            prop::collection::vec(sphere.clone(), 0..5),
            transform.clone(),
            flags.clone(),
            prop::collection::vec(ray.clone(), RAYS),
        )
            .prop_map(|(points, triangles, quads, spheres, transform, flags, rays)| Soup {
                points,
                triangles: triangles.into_iter().filter(|[a, b, c]| a != b && b != c && a != c).collect(),
                quads: quads.into_iter().filter(distinct).collect(),
                spheres,
                transform,
                flags,
                rays,
            })
    })
}

fn distinct(q: &[u32; 4]) -> bool {
    (0..4).all(|i| (0..i).all(|j| q[i] != q[j]))
}

fn agrees(
    soup: &Soup,
    number: usize,
    ray: &Ray,
    hit: &Hit,
    expected: Option<Crossing>,
) -> Result<(), TestCaseError> {
    let Some(e) = expected else {
        prop_assert!(!hit.is_hit(), "ray {} hit {:?} at {}, nothing is there", number, hit, ray.tfar);
        prop_assert_eq!(ray.tfar, soup.rays[number].tfar);
        return Ok(());
    };
    let ids = (hit.prim_id, hit.geom_id, hit.inst_id[0]);
    prop_assert_eq!(ids, (e.prim, e.geom, e.inst), "ray {} expected {:?}", number, e);
    prop_assert!((f64::from(ray.tfar) - e.t).abs() < TOLERANCE * (1.0 + e.t), "{} {:?}", ray.tfar, e);
    let (du, dv) = (f64::from(hit.u) - e.u, f64::from(hit.v) - e.v);
    prop_assert!(du.abs() < TOLERANCE * 10.0 && dv.abs() < TOLERANCE * 10.0, "{:?} {:?}", hit, e);
    Ok(())
}

macro_rules! check_packets {
    ($soup:ident, $scene:ident, $oracle:ident, $n:literal, $Ray:ident, $RayHit:ident, $Valid:ident,
     $intersect:ident, $intersect_with:ident, $occluded:ident) => {
        for (chunk, rays) in $soup.rays.chunks($n).enumerate() {
            let packet = $Ray::from_fn(|lane| *rays.get(lane).unwrap_or(&rays[0]));
            let valid = $Valid::first(rays.len());
            let (mut plain, mut coherent, mut shadow) = ($RayHit::new(packet), $RayHit::new(packet), packet);
            $scene.$intersect(&valid, &mut plain);
            $scene.$intersect_with(&QueryOptions::COHERENT, &valid, &mut coherent);
            $scene.$occluded(&valid, &mut shadow);
            for lane in 0..rays.len() {
                let number = chunk * $n + lane;
                let Some(expected) = $oracle[number] else { continue };
                agrees(&$soup, number, &plain.ray.get(lane), &plain.hit.get(lane), expected)?;
                agrees(&$soup, number, &coherent.ray.get(lane), &coherent.hit.get(lane), expected)?;
                prop_assert_eq!(shadow.get(lane).is_occluded(), expected.is_some());
            }
        }
    };
}

fn check(device: &Device, soup: &Soup) -> Result<(usize, usize), TestCaseError> {
    let scene = soup.build(device);
    let oracle: Vec<_> = soup.rays.iter().map(|ray| soup.oracle(ray)).collect();
    for (number, (ray, expected)) in soup.rays.iter().zip(&oracle).enumerate() {
        let Some(expected) = *expected else { continue };
        let mut found = RayHit::new(*ray);
        scene.intersect(&mut found);
        agrees(soup, number, &found.ray, &found.hit, expected)?;
        let mut shadow = *ray;
        prop_assert_eq!(scene.occluded(&mut shadow), expected.is_some());
    }
    check_packets!(soup, scene, oracle, 4, Ray4, RayHit4, Valid4, intersect4, intersect4_with, occluded4);
    check_packets!(soup, scene, oracle, 8, Ray8, RayHit8, Valid8, intersect8, intersect8_with, occluded8);
    check_packets!(
        soup,
        scene,
        oracle,
        16,
        Ray16,
        RayHit16,
        Valid16,
        intersect16,
        intersect16_with,
        occluded16
    );
    let hits = oracle.iter().filter(|o| matches!(o, Some(Some(_)))).count();
    Ok((oracle.iter().filter(|o| o.is_none()).count(), hits))
}

#[test]
fn hits_agree_with_brute_force() {
    let device = device();
    let mut config = ProptestConfig { failure_persistence: None, ..ProptestConfig::default() };
    if std::env::var_os("PROPTEST_CASES").is_none() {
        config.cases = 4000;
    }
    let (mut rays, mut skipped, mut hits) = (0, 0, 0);
    let totals = std::cell::RefCell::new((&mut rays, &mut skipped, &mut hits));
    let mut runner = proptest::test_runner::TestRunner::new(config);
    runner
        .run(&soup(), |soup| {
            let (close, hit) = check(&device, &soup)?;
            let mut totals = totals.borrow_mut();
            *totals.0 += soup.rays.len();
            *totals.1 += close;
            *totals.2 += hit;
            Ok(())
        })
        .unwrap_or_else(|failure| panic!("{failure}"));
    println!("{rays} rays, {hits} hits, {skipped} too close to call");
    assert!(rays > 0 && hits * 5 > rays, "only {hits} hits of {rays} rays");
    assert!(skipped * 12 < rays, "{skipped} of {rays} rays were too close to call");
}
