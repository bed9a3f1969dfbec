//! Hand-computed checks of conventions: transformations, orientation, photometry.

use crate::description::{
    Emission, Geometry, Light, PixelFilter, Projection, SamplerKind, SceneDescription, Shape, TriangleMesh,
};
use crate::{LoadOptions, load_pbrt_text};
use glam::{Vec3, vec3};
use std::f32::consts::PI;
use std::path::Path;

fn load(text: &str) -> SceneDescription {
    load_pbrt_text(text.as_bytes(), Path::new("tests/fixtures"), &LoadOptions::default()).unwrap()
}

fn world(text: &str) -> SceneDescription {
    load(&format!("Camera \"perspective\"\nWorldBegin\n{text}"))
}

fn radiance(shape: &Shape) -> Vec3 {
    match shape.emission {
        Some(Emission { radiance: crate::description::ColorInput::Constant(value), .. }) => value,
        _ => panic!("no constant emission"),
    }
}

fn mesh(shape: &Shape) -> &TriangleMesh {
    match &shape.geometry {
        Geometry::Triangles(mesh) => mesh,
        other => panic!("not triangles: {other:?}"),
    }
}

/// The outside of a triangle as the renderer sees it.
fn outside(shape: &Shape, triangle: usize) -> Vec3 {
    let mesh = mesh(shape);
    let [a, b, c] = mesh.indices[triangle].map(|i| Vec3::from(mesh.positions[i as usize]));
    (b - a).cross(c - a).normalize() * if shape.reverse_orientation { -1.0 } else { 1.0 }
}

#[test]
fn the_camera_sits_at_the_eye_and_looks_forward() {
    let scene = load(
        "LookAt 1 2 3  1 2 10  0 1 0\nCamera \"perspective\" \"float fov\" 30\nWorldBegin Shape \"sphere\"",
    );
    let m = scene.camera.camera_to_world;
    assert!(m.transform_point3(Vec3::ZERO).abs_diff_eq(vec3(1.0, 2.0, 3.0), 1e-5));
    assert!(m.transform_vector3(Vec3::Z).abs_diff_eq(Vec3::Z, 1e-6));
    assert!(m.transform_vector3(Vec3::X).abs_diff_eq(Vec3::X, 1e-6));
    assert_eq!(scene.camera.projection, Projection::Perspective { fov: 30.0 });
    // Scale -1 1 1 before LookAt mirrors the picture: right in the picture is now -x.
    let scene =
        load("Scale -1 1 1 LookAt 0 0 0 0 0 1 0 1 0\nCamera \"perspective\"\nWorldBegin Shape \"sphere\"");
    assert!(scene.camera.camera_to_world.transform_vector3(Vec3::X).abs_diff_eq(-Vec3::X, 1e-6));
}

#[test]
fn cameras_that_see_all_around_and_stand_ins() {
    let of = |camera: &str| load(&format!("Camera {camera}\nWorldBegin Shape \"sphere\""));
    for (camera, projection) in [
        ("\"spherical\"", Projection::EqualArea),
        ("\"spherical\" \"string mapping\" \"equirectangular\"", Projection::Equirectangular),
        ("\"environment\"", Projection::Equirectangular),
    ] {
        let scene = of(camera);
        assert_eq!(scene.camera.projection, projection);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("spherical.pbrt");
        crate::save_pbrt(&scene, &path).unwrap();
        assert_eq!(crate::load(&path).unwrap().camera.projection, projection);
    }
    // 35 mm across are 17.16 mm on the shorter side of 16:9.
    let scene = of("\"realistic\" \"string lensfile\" \"wide.22mm.dat\" \"float focusdistance\" 3");
    let Projection::Perspective { fov } = scene.camera.projection else { panic!("a pinhole") };
    assert!((fov - 2.0 * (8.58f32 / 22.0).atan().to_degrees()).abs() < 0.01, "{fov}");
    assert_eq!(scene.warnings.len(), 1);
}

#[test]
fn matrices_are_written_column_by_column() {
    let scene = load(
        "Transform [ 1 0 0 0  0 1 0 0  0 0 1 0  0 0 -5 1 ]\nCamera \"perspective\"\nWorldBegin Shape \"sphere\"",
    );
    // World to camera moves by -5 along z: the camera is at z = 5.
    assert!(scene.camera.camera_to_world.transform_point3(Vec3::ZERO).abs_diff_eq(vec3(0.0, 0.0, 5.0), 1e-6));
}

#[test]
fn world_begin_resets_and_the_camera_space_can_be_recalled() {
    let scene = load(
        "Translate 0 0 -5\nCamera \"perspective\"\nWorldBegin\nLightSource \"point\"\n\
         CoordSysTransform \"camera\"\nLightSource \"point\"",
    );
    let Light::Point { position, .. } = scene.lights[0] else { panic!() };
    assert_eq!(position, Vec3::ZERO);
    let Light::Point { position, .. } = scene.lights[1] else { panic!() };
    assert!(position.abs_diff_eq(vec3(0.0, 0.0, 5.0), 1e-6));
}

#[test]
fn the_last_transformation_acts_first() {
    let scene =
        world("Translate 1 0 0 Rotate 90 0 0 1 Scale 2 2 2 LightSource \"point\" \"point3 from\" [ 1 0 0 ]");
    let Light::Point { position, .. } = scene.lights[0] else { panic!() };
    assert!(position.abs_diff_eq(vec3(1.0, 2.0, 0.0), 1e-6), "{position}");
}

#[test]
fn blocks_restore_what_they_should() {
    let scene = world(
        "AttributeBegin Translate 9 0 0 ReverseOrientation Material \"interface\" AttributeEnd\n\
         TransformBegin Translate 5 0 0 ReverseOrientation TransformEnd Shape \"sphere\"",
    );
    let shape = &scene.shapes[0];
    assert!(shape.reverse_orientation, "TransformEnd keeps the orientation");
    assert!(matches!(shape.geometry, Geometry::Sphere { center: Vec3::ZERO, radius: 1.0, .. }));
    assert_eq!(scene.materials[shape.material.0 as usize].name, "default");
}

#[test]
fn patches_are_put_in_order_around() {
    let scene = world("Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0  1 0 0  0 1 0  1 1 0 ]");
    let Geometry::Quads(quads) = &scene.shapes[0].geometry else { panic!() };
    let corner = |i: usize| quads.positions[quads.indices[0][i] as usize];
    assert_eq!(
        [0, 1, 2, 3].map(corner),
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
    );
    assert_eq!(quads.uvs.as_deref(), Some(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][..]));
}

#[test]
fn spheres_keep_their_poles_or_become_meshes() {
    let scene = world("Translate 1 2 3 Rotate 90 1 0 0 Scale 2 2 2 Shape \"sphere\" \"float radius\" 1.5");
    let Geometry::Sphere { center, radius, axes } = scene.shapes[0].geometry else { panic!() };
    assert_eq!(center, vec3(1.0, 2.0, 3.0));
    assert!((radius - 3.0).abs() < 1e-6);
    // Turning by 90 degrees about x takes the pole z to -y.
    assert!(axes[2].abs_diff_eq(-Vec3::Y, 1e-6) && axes[0].abs_diff_eq(Vec3::X, 1e-6));
    let scene = world("Scale 1 2 1 Shape \"sphere\"");
    let ellipsoid = mesh(&scene.shapes[0]);
    assert!(ellipsoid.positions.iter().all(|p| {
        let [x, y, z] = *p;
        (x * x + y * y / 4.0 + z * z - 1.0).abs() < 1e-5
    }));
    assert!((0..ellipsoid.indices.len()).all(|i| {
        outside(&scene.shapes[0], i).dot(Vec3::from(ellipsoid.positions[ellipsoid.indices[i][0] as usize]))
            > 0.0
    }));
}

#[test]
fn disks_face_along_z() {
    let scene = world("Rotate 90 1 0 0 Scale 2 2 2 Shape \"disk\" \"float height\" 1");
    let Geometry::Disk { center, normal, tangent, radius } = scene.shapes[0].geometry else { panic!() };
    assert!(center.abs_diff_eq(vec3(0.0, -2.0, 0.0), 1e-6) && normal.abs_diff_eq(-Vec3::Y, 1e-6));
    assert!(tangent.abs_diff_eq(Vec3::X, 1e-6) && (radius - 2.0).abs() < 1e-6);
}

const TRIANGLE: &str = "\"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]";

#[test]
fn the_outside_follows_winding_mirroring_and_reversal() {
    let side = |before: &str, normals: &str| {
        let scene = world(&format!("{before} Shape \"trianglemesh\" {TRIANGLE} {normals}"));
        outside(&scene.shapes[0], 0).z
    };
    assert_eq!(side("", ""), 1.0);
    assert_eq!(side("ReverseOrientation", ""), -1.0);
    // Mirroring x leaves z alone: the outside stays at +z.
    assert_eq!(side("Scale -1 1 1", ""), 1.0);
    assert_eq!(side("Scale 1 1 -1", ""), -1.0);
    let down = "\"normal N\" [ 0 0 -1 0 0 -1 0 0 -1 ]";
    assert_eq!(side("", down), -1.0);
    assert_eq!(side("ReverseOrientation", down), 1.0);
    assert_eq!(side("Scale -1 1 1", down), -1.0);
}

#[test]
fn triangles_without_area_are_dropped_with_a_count() {
    let scene = world(
        "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 2 0 0 ] \"integer indices\" [ 0 1 2 0 1 3 0 0 1 ]",
    );
    assert_eq!(mesh(&scene.shapes[0]).indices, [[0, 1, 2]]);
    assert_eq!(scene.warnings, ["text:3:7: 2 of 3 triangles have no area and are dropped"]);
}

#[test]
fn area_lights_scale_and_spread_their_power() {
    let light = |parameters: &str, shape: &str| {
        let scene = world(&format!("AreaLightSource \"diffuse\" {parameters} {shape}"));
        radiance(&scene.shapes[0])
    };
    assert_eq!(light("\"rgb L\" [ 1 2 3 ] \"float scale\" 2", "Shape \"sphere\""), vec3(2.0, 4.0, 6.0));
    // Power = pi A L: a triangle of area 1/2.
    let triangle = format!("Shape \"trianglemesh\" {TRIANGLE}");
    let l = light("\"float power\" 10", &triangle);
    assert!((l.x * PI * 0.5 - 10.0).abs() < 1e-5);
    // Two sides, sphere of radius 2 after scaling: 2 pi 4 pi 4 L.
    let l = light("\"float power\" 10 \"bool twosided\" true", "Scale 2 2 2 Shape \"sphere\"");
    assert!((l.x * 2.0 * PI * 16.0 * PI - 10.0).abs() < 1e-5);
    // A colour stays a factor.
    let l = light("\"float power\" 10 \"rgb L\" [ 0 0.5 0 ]", &triangle);
    assert!((l.y * PI * 0.5 - 5.0).abs() < 1e-5 && l.x == 0.0);
}

#[test]
fn point_spot_distant_and_infinite_photometry() {
    let light = |text: &str| world(&format!("LightSource {text}")).lights[0].clone();
    let Light::Point { intensity, .. } = light("\"point\" \"float power\" 100") else { panic!() };
    assert!((intensity.x * 4.0 * PI - 100.0).abs() < 1e-4);
    // Blackbody colours have luminance 1 before the scale.
    let Light::Point { intensity, .. } = light("\"point\" \"blackbody I\" 3000 \"float scale\" 5") else {
        panic!()
    };
    assert!((intensity.dot(vec3(0.2126, 0.7152, 0.0722)) - 5.0).abs() < 0.01);
    assert!(intensity.x > intensity.y && intensity.y > intensity.z);
    // A cone without fall-off of half-angle 60 degrees covers 2 pi (1 - 1/2) = pi.
    let text = "\"spot\" \"float power\" 10 \"float coneangle\" 60 \"float conedeltaangle\" 0 \"point3 to\" [ 0 -2 0 ]";
    let Light::Spot { intensity, direction, .. } = light(text) else { panic!() };
    assert!((intensity.x * PI - 10.0).abs() < 1e-4);
    assert_eq!(direction, -Vec3::Y);
    let text = "\"distant\" \"point3 from\" [ 0 5 0 ] \"point3 to\" [ 0 0 0 ] \"float illuminance\" 3 \"float scale\" 2";
    let Light::Distant { direction, irradiance } = light(text) else { panic!() };
    assert_eq!((direction, irradiance), (-Vec3::Y, Vec3::splat(6.0)));
    let Light::Environment { radiance, .. } = light("\"infinite\" \"float illuminance\" 3") else { panic!() };
    assert!((radiance.x * PI - 3.0).abs() < 1e-5);
}

#[test]
fn environments_keep_rotation_and_mirroring() {
    let scene = world("Rotate -90 1 0 0 Scale 3 3 3 LightSource \"infinite\"");
    let Light::Environment { light_to_world, .. } = scene.lights[0] else { panic!() };
    assert!((light_to_world * Vec3::Z).abs_diff_eq(Vec3::Y, 1e-6));
    let scene = world("Scale -1 1 1 LightSource \"infinite\"");
    let Light::Environment { light_to_world, .. } = scene.lights[0] else { panic!() };
    assert_eq!(light_to_world.determinant(), -1.0);
}

#[test]
fn settings() {
    let scene = load(
        "Integrator \"path\"\nSampler \"independent\" \"integer pixelsamples\" 4\nPixelFilter \"sinc\"\n\
         Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 50 \"integer pixelbounds\" [ 10 20 5 15 ]\n\
         \"float iso\" 50 \"float exposuretime\" 4\n\
         Camera \"orthographic\" \"float screenwindow\" [ -2 2 -1 1 ]\nWorldBegin Shape \"sphere\"",
    );
    assert_eq!(scene.integrator.max_depth, 5);
    assert_eq!((scene.sampler.kind, scene.sampler.spp), (SamplerKind::Independent, Some(4)));
    assert_eq!(scene.filter, PixelFilter::BlackmanHarris { radius: [4.0; 2] });
    assert_eq!((scene.film.crop, scene.film.scale), (Some([10, 5, 20, 15]), 2.0));
    assert_eq!(scene.camera.screen_window, Some([-2.0, 2.0, -1.0, 1.0]));
    assert_eq!(scene.warnings.len(), 1);
}

#[test]
fn instances_place_definitions_with_their_own_transformation() {
    let scene = world(
        "ObjectBegin \"a\" Translate 1 0 0 Shape \"sphere\" ObjectEnd\n\
         Scale 2 2 2 ObjectInstance \"a\"",
    );
    assert!(scene.shapes.is_empty());
    let Geometry::Sphere { center, .. } = scene.objects[0].shapes[0].geometry else { panic!() };
    assert_eq!(center, Vec3::X);
    assert_eq!(scene.instances[0].object_to_world.transform_point3(center), vec3(2.0, 0.0, 0.0));
    assert_eq!(scene.bounds(), Some((vec3(0.0, -2.0, -2.0), vec3(4.0, 2.0, 2.0))));
}

#[test]
fn included_files_share_attributes_and_imported_ones_keep_them() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.pbrt"), "Translate 1 0 0\n").unwrap();
    let text = "WorldBegin Import \"a.pbrt\" LightSource \"point\" Include \"a.pbrt\" LightSource \"point\"";
    let scene = load_pbrt_text(text.as_bytes(), folder.path(), &LoadOptions::default()).unwrap();
    let x = |i: usize| match scene.lights[i] {
        Light::Point { position, .. } => position.x,
        _ => panic!(),
    };
    assert_eq!((x(0), x(1)), (0.0, 1.0));
}

#[test]
fn attributes_are_defaults_and_unknown_parameters_warn() {
    let scene = world(
        "Attribute \"shape\" \"float radius\" 3 Shape \"sphere\" Shape \"sphere\" \"float radius\" 2 \"float raduis\" 1",
    );
    let radius = |i: usize| match scene.shapes[i].geometry {
        Geometry::Sphere { radius, .. } => radius,
        _ => panic!(),
    };
    assert_eq!((radius(0), radius(1)), (3.0, 2.0));
    assert_eq!(scene.warnings, ["text:3:83: parameter `raduis` of shape `sphere` is not known and ignored"]);
}

fn base(text: &str) -> SceneDescription {
    load(&format!("Camera \"perspective\"\n{text}"))
}

fn material(text: &str) -> crate::description::MaterialKind {
    base(&format!("{text}\nShape \"sphere\"")).materials.last().unwrap().kind.clone()
}

/// Roughness 0.1: alpha by version 4 sqrt(0.1), by version 3 the polynomial at ln 0.1, by version 2 Blinn's exponent 10.
#[test]
fn each_version_has_its_roughness() {
    use crate::description::{FloatInput, MaterialKind};
    let alpha = |text: &str| match material(text) {
        MaterialKind::Conductor { roughness, .. } => {
            let FloatInput::Constant(v) = roughness.u else { panic!() };
            assert_eq!(roughness.u, roughness.v);
            if roughness.remap { v.sqrt() } else { v }
        }
        other => panic!("{other:?}"),
    };
    let metal = "WorldBegin Material \"metal\" \"float roughness\" 0.1";
    let v4 = alpha("WorldBegin Material \"conductor\" \"float roughness\" 0.1");
    assert!((v4 - 0.1f32.sqrt()).abs() < 1e-6);
    let v3 = alpha(&format!("Film \"image\" {metal}"));
    assert!((v3 - 0.461_76).abs() < 1e-4, "{v3}");
    assert_eq!(alpha(&format!("Film \"image\" {metal} \"bool remaproughness\" false")), 0.1);
    let v2 = alpha(&format!("Film \"image\" SurfaceIntegrator \"path\" {metal}"));
    assert!((v2 - (2f32 / 12.0).sqrt()).abs() < 1e-6, "{v2}");
}

#[test]
fn old_materials_have_their_defaults() {
    use crate::description::{ColorInput, FloatInput, MaterialKind};
    let grey = |v: f32| ColorInput::Constant(Vec3::splat(v));
    assert_eq!(material("WorldBegin Material \"matte\""), MaterialKind::Diffuse { reflectance: grey(0.5) });
    let rough = MaterialKind::OrenNayar { reflectance: grey(0.5), sigma: FloatInput::Constant(20.0) };
    assert_eq!(material("WorldBegin Material \"matte\" \"float sigma\" 20"), rough);
    assert_eq!(material("WorldBegin Material \"mirror\""), MaterialKind::Mirror { reflectance: grey(0.9) });
    let MaterialKind::Uber { diffuse, specular, mirror, eta, .. } =
        material("WorldBegin Material \"plastic\"")
    else {
        panic!()
    };
    assert_eq!((diffuse, specular, mirror, eta), (grey(0.25), grey(0.25), grey(0.0), 1.0 / 1.5));
    let MaterialKind::Dielectric { eta, tint, .. } =
        material("WorldBegin Material \"glass\" \"float index\" 1.3")
    else {
        panic!()
    };
    assert_eq!((eta, tint), (1.3, grey(1.0)));
    // Half of the light goes straight through an `uber` of opacity 0.5; translucent multiplies its factors.
    let MaterialKind::Mix { amount, .. } =
        material("WorldBegin Material \"uber\" \"rgb opacity\" [ 0.25 0.25 0.25 ]")
    else {
        panic!()
    };
    assert_eq!(amount, FloatInput::Constant(0.75));
    let leaf =
        material("WorldBegin Material \"translucent\" \"rgb Kd\" [ 0.6 0.6 0.6 ] \"rgb Ks\" [ 0 0 0 ]");
    assert_eq!(leaf, MaterialKind::DiffuseTransmission { reflectance: grey(0.3), transmittance: grey(0.3) });
}

/// Lambert of 0.25 on both sides is 0.25 * 0.5 each, gloss of 0.25 reflects 0.25 * 0.5 of what a dielectric does: that is
/// its share of the mix, and the rest is divided by 1 - 0.125. What passes has the same factor, so no tint.
#[test]
fn translucent_adds_gloss_on_both_sides() {
    use crate::description::{ColorInput, FloatInput, MaterialKind};
    let parts = |parameters: &str| {
        let scene = base(&format!(
            "Film \"image\" WorldBegin Texture \"h\" \"float\" \"fbm\" Material \"translucent\" {parameters}\nShape \"sphere\""
        ));
        let all = &scene.materials;
        let MaterialKind::Mix { materials, amount: FloatInput::Constant(amount) } = all.last().unwrap().kind
        else {
            panic!("{:?}", scene.warnings)
        };
        let [matte, glossy] = materials.map(|id| all[id.0 as usize].clone());
        assert_eq!((matte.bump, glossy.bump), (all.last().unwrap().bump, all.last().unwrap().bump));
        let constant = |input| if let ColorInput::Constant(v) = input { v } else { panic!() };
        let MaterialKind::DiffuseTransmission { reflectance, transmittance } = matte.kind else { panic!() };
        let MaterialKind::Dielectric { eta, roughness, tint } = glossy.kind else { panic!() };
        assert!(eta == 1.5 && !roughness.remap && roughness.u != FloatInput::Constant(0.0));
        (amount, constant(reflectance), constant(transmittance), constant(tint))
    };
    let even = Vec3::splat(0.125 / 0.875);
    assert_eq!(parts("\"texture bumpmap\" \"h\""), (0.125, even, even, Vec3::ONE));
    // Less passes than is reflected, in one channel: 0.8 * 0.5 against 0.8 * (0.5, 0.25, 0).
    let (amount, reflectance, transmittance, tint) =
        parts("\"rgb Kd\" [ 0.3 0.3 0.3 ] \"rgb Ks\" [ 0.8 0.8 0.8 ] \"rgb transmit\" [ 0.5 0.25 0 ]");
    assert!((amount - 0.4).abs() < 1e-6 && reflectance.abs_diff_eq(Vec3::splat(0.25), 1e-6));
    assert!(
        transmittance.abs_diff_eq(vec3(0.25, 0.125, 0.0), 1e-6)
            && tint.abs_diff_eq(vec3(1.0, 0.5, 0.0), 1e-6)
    );
    // Gloss that cannot be had is a warning.
    let scene = base("WorldBegin Material \"translucent\" \"rgb Ks\" [ 0.3 0.1 0.1 ]\nShape \"sphere\"");
    assert!(
        scene.warnings.iter().any(|w| w.contains("left out: it needs a grey `Ks`")),
        "{:?}",
        scene.warnings
    );
}

/// `amount` is the share of the second material in version 4, of the first before.
#[test]
fn mixes_changed_their_direction() {
    use crate::description::{FloatInput, MaterialKind};
    let two = "WorldBegin MakeNamedMaterial \"a\" \"string type\" \"matte\" MakeNamedMaterial \"b\" \"string type\" \"mirror\"";
    let old =
        "\"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" \"rgb amount\" [ 0.2 0.2 0.2 ]";
    let MaterialKind::Mix { amount, .. } = material(&format!("{two} Material \"mix\" {old}")) else {
        panic!()
    };
    assert_eq!(amount, FloatInput::Constant(0.8));
    let new = "\"string materials\" [ \"a\" \"b\" ] \"float amount\" 0.2";
    let MaterialKind::Mix { amount, .. } = material(&format!("{two} Material \"mix\" {new}")) else {
        panic!()
    };
    assert_eq!(amount, FloatInput::Constant(0.2));
}

#[test]
fn settings_of_older_versions() {
    let scene = base("Film \"image\" WorldBegin Shape \"sphere\"");
    assert_eq!((scene.film.width, scene.film.height), (640, 480));
    assert_eq!(scene.filter, PixelFilter::Box { radius: [0.5; 2] });
    let scene = base(
        "Film \"image\" \"float scale\" 3\nPixelFilter \"gaussian\" \"float xwidth\" 3 \"float alpha\" 8\n\
         SurfaceIntegrator \"path\" \"integer maxdepth\" 4\nRenderer \"sampler\"\nVolumeIntegrator \"single\"\n\
         WorldBegin Shape \"sphere\"",
    );
    assert_eq!(scene.filter, PixelFilter::Gaussian { radius: [3.0, 2.0], sigma: 0.25 });
    assert_eq!((scene.integrator.max_depth, scene.film.scale), (5, 3.0));
    assert_eq!(scene.warnings, Vec::<String>::new());
    let scene =
        load("Film \"image\"\nCamera \"perspective\" \"float halffov\" 20\nWorldBegin Shape \"sphere\"");
    assert_eq!(scene.camera.projection, Projection::Perspective { fov: 40.0 });
}

/// Before version 4 spectra keep their brightness and `scale` is a colour.
#[test]
fn old_lights_have_no_units() {
    let light = |text: &str| base(&format!("Film \"image\" WorldBegin LightSource {text}")).lights[0].clone();
    let Light::Point { intensity, .. } = light("\"point\" \"color I\" [ 1 2 3 ] \"color scale\" [ 2 2 0.5 ]")
    else {
        panic!()
    };
    assert_eq!(intensity, vec3(2.0, 4.0, 1.5));
    let luminance = |v: Vec3| v.dot(vec3(0.2126, 0.7152, 0.0722));
    let Light::Point { intensity, .. } = light("\"point\" \"spectrum I\" [ 400 7 700 7 ]") else { panic!() };
    assert!((luminance(intensity) - 7.0).abs() < 0.05);
    let Light::Point { intensity, .. } = light("\"point\" \"blackbody I\" [ 2700 1 ]") else { panic!() };
    assert!(luminance(intensity) < 0.3, "the peak is infrared");
    // Version 4 has luminance 1 for all of them.
    let Light::Point { intensity, .. } = world("LightSource \"point\" \"blackbody I\" 2700").lights[0] else {
        panic!()
    };
    assert!((luminance(intensity) - 1.0).abs() < 1e-3);
}

#[test]
fn pictures_of_version_2_are_upside_down() {
    use crate::description::{Texture, TextureEncoding};
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.png"), b"").unwrap();
    let texture = |settings: &str, more: &str| {
        let text = format!(
            "{settings} WorldBegin Texture \"a\" \"color\" \"imagemap\" \"string filename\" \"a.png\" \
             \"float vscale\" 2 \"float vdelta\" 0.25 {more} Shape \"sphere\""
        );
        let scene = load_pbrt_text(text.as_bytes(), folder.path(), &LoadOptions::default()).unwrap();
        let Texture::Image { mapping, .. } = scene.textures[0] else { panic!() };
        (mapping.scale[1], mapping.offset[1], scene.images[0].encoding)
    };
    assert_eq!(texture("Film \"image\"", ""), (2.0, 0.25, TextureEncoding::Auto));
    assert_eq!(texture("Film \"image\"", "\"bool gamma\" false"), (2.0, 0.25, TextureEncoding::Linear));
    let v2 = "Film \"image\" SurfaceIntegrator \"path\"";
    assert_eq!(texture(v2, ""), (-2.0, 0.75, TextureEncoding::Linear));
    assert_eq!(texture(v2, "\"float gamma\" 2.2"), (-2.0, 0.75, TextureEncoding::Gamma(2.2)));
}

#[test]
fn textures_of_every_class() {
    use crate::description::{Noise, Texture, TextureProjection};
    let textures = |settings: &str, text: &str| {
        let scene = load(&format!(
            "{settings} WorldBegin Translate 1 2 3 Scale 2 2 2\nTexture \"a\" \"spectrum\" {text} Shape \"sphere\""
        ));
        scene.textures
    };
    let [Texture::Noise { from_world, noise }] = textures("", "\"fbm\" \"integer octaves\" 3")[..] else {
        panic!()
    };
    assert_eq!(noise, Noise::Fbm { octaves: 3, roughness: 0.5 });
    assert_eq!(from_world.transform_point3(vec3(1.0, 2.0, 5.0)), vec3(0.0, 0.0, 1.0));
    // Older versions apply the matrix itself.
    let [Texture::Noise { from_world, .. }] = textures("Film \"image\"", "\"windy\"")[..] else { panic!() };
    assert_eq!(from_world.transform_point3(vec3(1.0, 0.0, 0.0)), vec3(3.0, 2.0, 3.0));
    let marble = textures("", "\"marble\" \"float variation\" 0.7");
    assert!(matches!(
        marble[..],
        [Texture::Noise { noise: Noise::Marble { octaves: 8, variation: 0.7, .. }, .. }]
    ));
    let cubes = textures("", "\"checkerboard\" \"integer dimension\" 3");
    assert!(matches!(cubes[..], [Texture::Cubes { .. }]));
    let planar =
        textures("", "\"uv\" \"string mapping\" \"planar\" \"vector3 v1\" [ 0 0 2 ] \"float vdelta\" 4");
    let [Texture::Coordinates { .. }, Texture::Projected { projection, .. }] = planar[..] else { panic!() };
    let expected = TextureProjection::Planar { u: Vec3::Z * 2.0, v: Vec3::Y, offset: [0.0, 4.0] };
    assert_eq!(projection, expected);
    // Only the pattern of a projected checkerboard is projected, not what its squares show.
    let checks = textures("", "\"checkerboard\" \"string mapping\" \"spherical\"");
    assert!(matches!(
        checks[..],
        [Texture::Checkerboard { .. }, Texture::Projected { .. }, Texture::Mix { .. }]
    ));
    let [Texture::DirectionMix { direction, .. }] =
        textures("", "\"directionmix\" \"vector3 dir\" [ 0 0 3 ]")[..]
    else {
        panic!()
    };
    assert_eq!(direction, Vec3::Z);
    assert!(matches!(textures("", "\"dots\"")[..], [Texture::Dots { .. }]));
    assert!(matches!(textures("", "\"bilerp\"")[..], [Texture::Bilinear { .. }]));
}

#[test]
fn colour_spaces_are_part_of_the_state() {
    let scene = world(
        "AttributeBegin ColorSpace \"rec2020\" LightSource \"point\" \"rgb I\" [ 1 0 0 ] AttributeEnd\n\
         LightSource \"point\" \"rgb I\" [ 1 0 0 ]",
    );
    let red = |i: usize| match scene.lights[i] {
        Light::Point { intensity, .. } => intensity.x,
        _ => panic!(),
    };
    assert!((red(0) - 1.6605).abs() < 2e-3);
    assert_eq!(red(1), 1.0);
}

#[test]
fn files_outside_of_the_folder_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("scene");
    std::fs::create_dir(&inside).unwrap();
    std::fs::write(folder.path().join("a.pbrt"), "LightSource \"point\"\n").unwrap();
    let absolute = format!("Include \"{}\"", folder.path().join("a.pbrt").display());
    #[cfg(unix)]
    std::os::unix::fs::symlink(folder.path().join("a.pbrt"), inside.join("link.pbrt")).unwrap();
    let load = |text: &str, options: &LoadOptions| {
        load_pbrt_text(format!("WorldBegin {text}").as_bytes(), &inside, options)
    };
    for text in ["Include \"../a.pbrt\"", "Include \"link.pbrt\"", absolute.as_str()] {
        if !cfg!(unix) && text.contains("link") {
            continue;
        }
        let own = LoadOptions { folders: Some(Vec::new()), ..LoadOptions::default() };
        let error = load(text, &own).unwrap_err();
        assert_eq!(error.kind(), crate::ErrorKind::Refused, "{error}");
        assert!(error.position().is_some());
        assert_eq!(load(text, &LoadOptions::default()).unwrap().lights.len(), 1);
        let opened = LoadOptions { folders: Some(vec![folder.path().to_owned()]), ..LoadOptions::default() };
        assert_eq!(load(text, &opened).unwrap().lights.len(), 1);
    }
}

#[test]
fn loading_counts_files_and_triangles() {
    let progress = std::sync::Arc::new(crate::LoadProgress::default());
    let options = LoadOptions { progress: Some(progress.clone()), ..LoadOptions::default() };
    let text = "Camera \"perspective\" WorldBegin Shape \"plymesh\" \"string filename\" \"one.ply\"
        Shape \"objmesh\" \"string filename\" \"one.obj\"
        Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] Shape \"sphere\"";
    let scene = load_pbrt_text(text.as_bytes(), Path::new("tests/fixtures"), &options).unwrap();
    let [files, bytes, triangles] = progress.counts();
    assert_eq!(files, 2);
    let size = |name: &str| std::fs::metadata(Path::new("tests/fixtures").join(name)).unwrap().len();
    assert_eq!(bytes, size("one.ply") + size("one.obj"));
    assert_eq!(triangles, scene.triangle_count());
}

#[test]
fn compressed_files_are_expanded_within_limits() {
    use std::io::Write;
    let folder = tempfile::tempdir().unwrap();
    let compress = |name: &str, text: &[u8]| {
        let file = std::fs::File::create(folder.path().join(name)).unwrap();
        let mut out = flate2::write::GzEncoder::new(file, flate2::Compression::best());
        out.write_all(text).unwrap();
        out.finish().unwrap();
    };
    compress("a.pbrt.gz", b"WorldBegin LightSource \"point\"\n");
    compress("bomb.pbrt.gz", &vec![b' '; 1 << 20]);
    let load = |name: &str, options: &LoadOptions| crate::load_with(&folder.path().join(name), options);
    assert_eq!(load("a.pbrt.gz", &LoadOptions::default()).unwrap().lights.len(), 1);
    let error = load("bomb.pbrt.gz", &LoadOptions::default()).unwrap_err();
    assert_eq!(error.kind(), crate::ErrorKind::Limit);
    assert!(error.message().contains("max_expansion"), "{error}");
}

/// Versions 2 and 3 go on without a picture that is missing, version 4 does not.
#[test]
fn missing_pictures_of_older_scenes_are_warnings() {
    let text =
        "LightSource \"infinite\" \"string mapname\" \"no.exr\" \"color L\" [ 2 2 2 ] Shape \"sphere\"";
    let scene = base(&format!("Film \"image\" WorldBegin {text}"));
    assert!(matches!(scene.lights[0], Light::Environment { image: None, radiance, .. } if radiance.x == 2.0));
    assert_eq!(scene.warnings, ["text:2:65: there is no file `no.exr`: even instead"]);
    let text =
        format!("WorldBegin {}", text.replace("mapname", "filename").replace("color L", "float scale"));
    let text = text.replace("[ 2 2 2 ]", "2");
    assert!(load_pbrt_text(text.as_bytes(), Path::new("."), &LoadOptions::default()).is_err());
}
