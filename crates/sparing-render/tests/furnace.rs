//! Energy: a closed emitting box or sphere of albedo a shines with 1 / (1 - a) times its emission, whatever
//! the estimator: L = Le + a L.

mod common;

use common::{diffuse, emitter, film_mean, render, scene_with};
use glam::Vec3;
use sparing_render::RenderSettings;
use sparing_render::integrator::Estimator;
use sparing_scene::description::{Geometry, Shape};

fn furnace(geometry: Geometry, albedo: f32, reverse: bool) -> sparing_scene::SceneDescription {
    let mut d = scene_with(vec![diffuse(albedo)]);
    d.shapes.push(Shape { reverse_orientation: reverse, ..emitter(geometry, 1.0) });
    d
}

#[test]
fn closed_emitters_shine_with_one_over_one_minus_albedo() {
    let sphere = Geometry::Sphere { center: Vec3::ZERO, radius: 2.0, axes: [Vec3::X, Vec3::Y, Vec3::Z] };
    let mut crooked = common::quad_box(1.5);
    if let Geometry::Quads(m) = &mut crooked {
        m.positions[7] = [0.9, 1.2, 1.3]; // three quads are no parallelograms any more, nor planar
    }
    let shapes = [
        ("sphere", sphere),
        ("box", common::closed_box(1.5)),
        ("quads", common::quad_box(1.5)),
        ("crooked quads", crooked),
    ];
    for (name, geometry) in shapes {
        for albedo in [0.0, 0.5, 0.8] {
            for estimator in [Estimator::Mis, Estimator::LightOnly, Estimator::BsdfOnly] {
                let settings = RenderSettings { max_depth: 1000, estimator, ..RenderSettings::default() };
                let description = furnace(geometry.clone(), albedo, true);
                let (mean, error) = film_mean(&render(description, settings, 1024));
                let expected = f64::from(1.0 / (1.0 - albedo));
                // Five standard errors of independent samples: far more than Sobol points need.
                let tolerance = 5.0 * error + 1e-3 * expected;
                assert!(
                    (mean - expected).abs() < tolerance,
                    "{name} albedo {albedo} {estimator:?}: {mean} +- {error}, expected {expected}"
                );
            }
        }
    }
}
