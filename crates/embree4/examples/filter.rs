//! Filters: a sheet with round holes, and light that fades as it passes panes of glass.

use embree4::{Device, FilterHit, QuadMesh, QueryOptions, Ray, RayHit, SceneBuilder, SceneFlags};

fn sheet(z: f32) -> QuadMesh {
    QuadMesh::new(vec![[0.0, 0.0, z], [8.0, 0.0, z], [8.0, 4.0, z], [0.0, 4.0, z]], vec![[0, 1, 2, 3]])
}

/// Rejects hits within the holes.
fn is_solid(hit: &FilterHit<'_>) -> bool {
    let (x, y) = ((hit.u() * 8.0).fract() - 0.5, (hit.v() * 4.0).fract() - 0.5);
    x.hypot(y) > 0.3
}

fn main() -> Result<(), embree4::Error> {
    let device = Device::new()?;

    let mut builder = SceneBuilder::new(&device)?;
    builder.attach(sheet(1.0).filter(is_solid).occlusion_filter(is_solid))?;
    let holes = builder.commit()?;
    for row in 0..16 {
        let line: String = (0..64)
            .map(|column| {
                let (x, y) = ((column as f32 + 0.5) / 8.0, (row as f32 + 0.5) / 4.0);
                let mut query = RayHit::new(Ray::new([x, y, 0.0], [0.0, 0.0, 1.0]));
                holes.intersect(&mut query);
                if query.hit.is_hit() { '#' } else { ' ' }
            })
            .collect();
        println!("{line}");
    }

    // A filter of a single query may change what it borrows: each pane lets 80 percent pass.
    let mut builder = SceneBuilder::new(&device)?.flags(SceneFlags::QUERY_FILTER);
    for z in 1..=4 {
        builder.attach(sheet(z as f32))?;
    }
    let panes = builder.commit()?;
    let mut light = 1.0;
    let mut ray = Ray::new([1.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let blocked = panes.occluded_filtered(&QueryOptions::default(), &mut ray, |_| {
        light *= 0.8;
        light < 0.1
    });
    println!("blocked: {blocked}, light left: {light:.3}");
    Ok(())
}
