//! The wrapper of Embree: whatever is attached, changed and committed in whatever order, an error or a scene that can be traced.
#![no_main]

use embree4::{
    BuildQuality, CurveBasis, CurveShape, Curves, Device, Discs, GeometryId, Instance, InstanceArray,
    OrientedDiscs, QuadMesh, Ray, RayHit, Scene, SceneBuilder, SceneFlags, Spheres, Subdivision, TriangleMesh,
    VertexData,
};
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static DEVICE: LazyLock<Device> = LazyLock::new(|| Device::new().expect("Embree"));

/// Numbers from the input; zeros when it is at its end.
struct Input<'a>(&'a [u8]);

impl Input<'_> {
    fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    fn below(&mut self, n: usize) -> usize {
        usize::from(self.byte()) % n
    }

    /// Mostly small, sometimes any bits at all.
    fn float(&mut self) -> f32 {
        match self.byte() {
            255 => f32::from_bits(u32::from_le_bytes(std::array::from_fn(|_| self.byte()))),
            b => (f32::from(b) - 127.0) / 32.0,
        }
    }

    fn floats<const N: usize>(&mut self) -> [f32; N] {
        std::array::from_fn(|_| self.float())
    }

    fn many<const N: usize>(&mut self, count: usize) -> Vec<[f32; N]> {
        (0..count).map(|_| self.floats()).collect()
    }

    /// Mostly one that is there.
    fn index(&mut self, count: usize) -> u32 {
        match self.byte() {
            255 => u32::from_le_bytes(std::array::from_fn(|_| self.byte())),
            b => u32::from(b) % count.max(1) as u32,
        }
    }

    fn indices<const N: usize>(&mut self, faces: usize, count: usize) -> Vec<[u32; N]> {
        (0..faces).map(|_| std::array::from_fn(|_| self.index(count))).collect()
    }

    fn transform(&mut self) -> [f32; 12] {
        self.floats()
    }
}

fn attach(b: &mut SceneBuilder, i: &mut Input<'_>, scenes: &[Scene]) -> Result<GeometryId, embree4::Error> {
    let (n, faces) = (i.below(9), i.below(6));
    // As many vertices as the first step has, but for mistakes.
    let other = if i.byte() > 250 { i.below(9) } else { n };
    let moves = i.byte() & 3 == 3;
    macro_rules! steps {
        ($width:literal) => {
            moves.then(|| i.many::<$width>(other))
        };
    }
    match i.below(10) {
        0 => b.attach(
            TriangleMesh::new(i.many(n), i.indices(faces, n))
                .time_steps(steps!(3))
                .vertex_attribute(u32::from(i.byte() % 20), i.many::<2>(other)),
        ),
        1 => b.attach(QuadMesh::new(i.many(n), i.indices(faces, n)).time_steps(steps!(3))),
        2 => b.attach(Spheres::new(i.many(n)).time_steps(steps!(4)).mask(u32::from(i.byte()))),
        3 => b.attach(Discs::new(i.many(n)).time_steps(steps!(4)).time_range(i.float(), i.float())),
        4 => b.attach(OrientedDiscs::new(i.many(n), i.many(other))),
        5 => {
            let bases = [CurveBasis::Linear, CurveBasis::Bezier, CurveBasis::BSpline, CurveBasis::CatmullRom];
            let shape = [CurveShape::Round, CurveShape::Flat][i.below(2)];
            let basis = bases[i.below(4)];
            let starts: Vec<u32> = (0..faces).map(|_| i.index(n)).collect();
            match i.below(3) {
                0 => b.attach(Curves::new(basis, shape, i.many(n), starts).time_steps(steps!(4))),
                1 => b.attach(Curves::hermite(shape, i.many(n), i.many(other), starts)),
                _ => b.attach(Curves::normal_oriented(basis, i.many(n), i.many(other), starts)),
            }
        }
        6 => {
            let sizes: Vec<u32> = (0..faces).map(|_| 2 + u32::from(i.byte() % 5)).collect();
            let corners = sizes.iter().sum::<u32>() as usize + usize::from(i.byte() > 250);
            let corners: Vec<u32> = (0..corners).map(|_| i.index(n)).collect();
            let levels: Vec<f32> = (0..i.below(9)).map(|_| i.float().clamp(-8.0, 8.0)).collect();
            let mut mesh = Subdivision::new(i.many(n), sizes, corners).tessellation_rate(2.0);
            if i.byte() > 200 {
                mesh = mesh.edge_levels(levels.clone());
            }
            if i.byte() > 128 {
                let edges = i.indices::<2>(levels.len(), n);
                mesh = mesh.edge_creases(edges, levels).holes(vec![i.index(faces)]);
            }
            b.attach(mesh)
        }
        7 | 8 if scenes.is_empty() => b.attach(Spheres::new(vec![i.floats()])),
        7 => {
            let later = moves.then(|| i.transform());
            b.attach(Instance::new(&scenes[i.below(scenes.len())], i.transform()).time_steps(later))
        }
        8 => {
            let choice: Vec<u32> = (0..other).map(|_| i.index(scenes.len())).collect();
            b.attach(InstanceArray::of_many(scenes.to_vec(), choice, i.many::<12>(n)))
        }
        _ => b.attach(Spheres::new(i.many(n)).build_quality(BuildQuality::Refit)),
    }
}

fn change(b: &mut SceneBuilder, i: &mut Input<'_>, id: GeometryId) {
    // What does not fit is an error; nothing here may do harm.
    let _ = match i.below(7) {
        0 => b.detach(id),
        1 => b.set_enabled(id, i.byte() & 1 == 0),
        2 => b.set_mask(id, u32::from(i.byte())),
        3 => b.set_transform(id, i.transform()),
        4 => {
            let n = i.below(9);
            b.update_vertices(id, u32::from(i.byte() % 3), i.many::<3>(n))
        }
        5 => {
            let n = i.below(9);
            b.update_vertices(id, 0, i.many::<4>(n))
        }
        _ => b.attach_with_id(Spheres::new(i.many(2)), GeometryId(u32::from(i.byte()))),
    };
}

fn look(scene: &Scene, i: &mut Input<'_>) {
    for _ in 0..4 {
        let ray = Ray::segment(i.floats(), i.floats(), i.float(), i.float() + 3.0).at_time(i.float());
        let mut query = RayHit::new(ray);
        scene.intersect(&mut query);
        scene.occluded(&mut { ray });
    }
    for id in scene.geometry_ids() {
        if scene.primitive_count(id).is_ok_and(|n| n > 0) {
            let _ = scene.interpolate::<3>(id, i.index(4), i.float(), i.float(), VertexData::Position(0));
            let _ = scene.interpolate::<2>(id, 0, 0.3, 0.3, VertexData::Attribute(u32::from(i.byte() % 20)));
        }
    }
    let _ = scene.bounds();
    assert!(scene.take_panic().is_none());
}

fuzz_target!(|bytes: &[u8]| {
    let mut input = Input(bytes);
    let i = &mut input;
    let mut scenes: Vec<Scene> = Vec::new();
    for _ in 0..3 {
        let mut b = SceneBuilder::new(&DEVICE).expect("a builder").flags(SceneFlags::from_bits_truncate(i.byte().into()));
        let mut ids = Vec::new();
        for _ in 0..i.below(5) {
            ids.extend(attach(&mut b, i, &scenes));
        }
        for _ in 0..i.below(4) {
            let id = ids.get(i.below(ids.len().max(1))).copied().unwrap_or(GeometryId(i.index(4)));
            change(&mut b, i, id);
        }
        let Ok(scene) = b.commit() else { continue };
        look(&scene, i);
        if i.byte() & 1 == 0 {
            scenes.push(scene);
        } else if let Ok(mut b) = scene.try_into_builder() {
            // Changed, and committed again.
            for _ in 0..i.below(4) {
                let id = ids.get(i.below(ids.len().max(1))).copied().unwrap_or(GeometryId(0));
                change(&mut b, i, id);
            }
            if let Ok(scene) = b.commit() {
                look(&scene, i);
                scenes.push(scene);
            }
        }
    }
});
