//! A thousand spheres placed a thousand times: a million for the memory of two thousand.

use embree4::{Device, InstanceArray, Ray, RayHit, SceneBuilder, Spheres};

fn main() -> Result<(), embree4::Error> {
    let device = Device::new()?;

    let cluster = {
        let sphere = |i: u32| {
            let turn = i as f32 * 2.399_963; // the golden angle spreads them evenly over a ball
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 1000.0;
            let r = (1.0 - z * z).sqrt();
            [r * turn.cos(), r * turn.sin(), z, 0.05]
        };
        let mut builder = SceneBuilder::new(&device)?;
        builder.attach(Spheres::new((0..1000).map(sphere).collect::<Vec<_>>()))?;
        builder.commit()?
    };

    let place = |i: u32| {
        let (x, y, z) = (i % 10, i / 10 % 10, i / 100);
        let scale = 0.4;
        [scale, 0.0, 0.0, 0.0, scale, 0.0, 0.0, 0.0, scale, x as f32, y as f32, z as f32]
    };
    let mut builder = SceneBuilder::new(&device)?;
    builder.attach(InstanceArray::new(&cluster, (0..1000).map(place).collect::<Vec<_>>()))?;
    let scene = builder.commit()?;

    let mut query = RayHit::new(Ray::new([3.0, 4.0, -10.0], [0.0, 0.0, 1.0]));
    scene.intersect(&mut query);
    println!("bounds {:?}", scene.bounds());
    println!("sphere {} of place {} at {}", query.hit.prim_id, query.hit.inst_prim_id[0], query.ray.tfar);
    println!("{} KiB in use for a million spheres", device.memory_bytes() / 1024);
    Ok(())
}
