//! A shape that Embree does not have: a torus, found by sphere tracing its distance function.

use embree4::{Bounds, Device, Ray, RayHit, SceneBuilder, UserGeometry, UserHit, UserPrimitive};

struct Torus {
    major: f32,
    minor: f32,
}

impl Torus {
    /// Distance from a point to the surface, negative inside.
    fn distance(&self, p: [f32; 3]) -> f32 {
        (p[0].hypot(p[1]) - self.major).hypot(p[2]) - self.minor
    }

    fn normal(&self, p: [f32; 3]) -> [f32; 3] {
        let ring = p[0].hypot(p[1]);
        let inwards = 1.0 - self.major / ring;
        [p[0] * inwards, p[1] * inwards, p[2]]
    }
}

impl UserPrimitive for Torus {
    fn bounds(&self, _prim_id: u32, _time_step: u32) -> Bounds {
        let r = self.major + self.minor;
        Bounds { lower: [-r, -r, -self.minor], upper: [r, r, self.minor] }
    }

    fn intersect(&self, _prim_id: u32, ray: &Ray) -> Option<UserHit> {
        let at = |t: f32| std::array::from_fn(|i| ray.org[i] + t * ray.dir[i]);
        let speed = ray.dir[0].hypot(ray.dir[1]).hypot(ray.dir[2]);
        let mut t = ray.tnear;
        for _ in 0..200 {
            let distance = self.distance(at(t)).abs();
            if distance < 1e-5 {
                return Some(UserHit { t, ng: self.normal(at(t)), u: 0.0, v: 0.0 });
            }
            t += distance / speed;
            if t > ray.tfar {
                return None;
            }
        }
        None
    }
}

fn main() -> Result<(), embree4::Error> {
    let device = Device::new()?;
    let mut builder = SceneBuilder::new(&device)?;
    builder.attach(UserGeometry::new(1, Torus { major: 1.0, minor: 0.4 }))?;
    let scene = builder.commit()?;
    for row in 0..24 {
        let line: String = (0..60)
            .map(|column| {
                let (x, y) = (column as f32 / 20.0 - 1.5, 1.5 - row as f32 / 8.0);
                let mut query = RayHit::new(Ray::segment([x, y, -5.0], [0.0, 0.0, 1.0], 0.0, 10.0));
                scene.intersect(&mut query);
                let [nx, ny, nz] = query.hit.ng;
                let light = (-nz + 0.5 * ny - 0.3 * nx) / (nx.hypot(ny).hypot(nz) * 1.16);
                if query.hit.is_hit() {
                    b" .:-=+*#%@"[(light.max(0.1) * 9.0) as usize % 10].into()
                } else {
                    ' '
                }
            })
            .collect::<String>();
        println!("{line}");
    }
    if let Some(panic) = scene.take_panic() {
        std::panic::resume_unwind(panic);
    }
    Ok(())
}
