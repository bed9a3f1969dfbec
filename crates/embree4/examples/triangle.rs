//! The smallest scene: one triangle, drawn with letters. Run it with `cargo run -p embree4 --example triangle`.

use embree4::{Device, Ray, RayHit, SceneBuilder, TriangleMesh};

fn main() -> Result<(), embree4::Error> {
    let device = Device::new()?;
    println!("{device:?}");
    let mut builder = SceneBuilder::new(&device)?;
    let corners = vec![[-0.9, -0.8, 1.0], [0.9, -0.8, 1.0], [0.0, 0.9, 1.0]];
    builder.attach(TriangleMesh::new(corners, vec![[0, 1, 2]]))?;
    let scene = builder.commit()?;

    for row in 0..20 {
        let line: String = (0..50)
            .map(|column| {
                let (x, y) = (column as f32 / 25.0 - 0.98, 0.95 - row as f32 / 10.0);
                let mut query = RayHit::new(Ray::new([x, y, 0.0], [0.0, 0.0, 1.0]));
                scene.intersect(&mut query);
                match query.hit {
                    hit if !hit.is_hit() => '.',
                    hit if hit.u > 0.5 => 'u',
                    hit if hit.v > 0.5 => 'v',
                    _ => 'o',
                }
            })
            .collect();
        println!("{line}");
    }
    Ok(())
}
