//! The scenes to learn from: valid, reproducible, and disjoint from those to validate with.

use sparing_scene::SceneDescription;
use sparing_scene::description::{
    FloatInput, Geometry, ImageSource, Material, MaterialKind, Roughness, Shape, Texture,
};
use sparing_scene::generate::training::{Split, scene};
use std::collections::HashSet;

fn all(split: Split, seed: u64) -> impl Iterator<Item = SceneDescription> {
    (0..split.scenes()).map(move |index| scene(index, seed, split))
}

/// What came into descriptions after the model was trained, and is not in these scenes.
const LATER: [(&str, &str); 8] = [
    (", colors: None", ""),
    (", second_uvs: None", ""),
    (", tangents: None", ""),
    (", edge: Smooth", ""),
    (", cross: [0.0, 0.0]", ""),
    (", alpha_cutoff: None", ""),
    ("wrap: [Repeat, Repeat]", "wrap: Repeat"),
    ("wrap: [Clamp, Clamp]", "wrap: Clamp"),
];

/// 64-bit FNV-1a over everything that a scene says.
fn fingerprint(scene: &SceneDescription) -> u64 {
    LATER
        .iter()
        .fold(format!("{scene:?}"), |text, (new, old)| text.replace(new, old))
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3))
}

#[test]
fn there_are_enough_and_all_are_valid() {
    assert!(Split::Training.scenes() >= 40 && Split::Validation.scenes() >= 16);
    for split in [Split::Training, Split::Validation] {
        let mut names = HashSet::new();
        for scene in all(split, 1) {
            scene.validate().unwrap_or_else(|error| panic!("{}: {error}", scene.name));
            assert!(scene.film.width * scene.film.height <= 128 * 96);
            assert!((1..=10).contains(&scene.integrator.max_depth));
            assert!(scene.triangle_count() < 100_000, "{}: {}", scene.name, scene.triangle_count());
            assert!(names.insert(scene.name));
        }
    }
}

#[test]
fn the_seed_decides_everything() {
    for split in [Split::Training, Split::Validation] {
        let prints = |seed| all(split, seed).map(|s| fingerprint(&s)).collect::<Vec<_>>();
        let (first, again, other) = (prints(5), prints(5), prints(6));
        assert_eq!(first, again);
        assert!(first.iter().zip(&other).all(|(a, b)| a != b));
        assert_eq!(first.iter().collect::<HashSet<_>>().len(), first.len());
    }
    // Far beyond the usual number there are still scenes.
    assert!(scene(u32::MAX, u64::MAX, Split::Training).validate().is_ok());
}

/// What the materials of a scene are made of, apart from colours.
fn substances(scene: &SceneDescription) -> Vec<String> {
    let alpha = |roughness: &Roughness| match roughness.u {
        FloatInput::Constant(alpha) if alpha > 0.0 => {
            // Borders between the ranges that alternate between the splits.
            let range = [0.095, 0.19, 0.34].iter().filter(|border| alpha > **border).count();
            format!("roughness of range {range}")
        }
        _ => String::new(),
    };
    let of = |material: &Material| match &material.kind {
        MaterialKind::Conductor { conductor, roughness } => [format!("{conductor:?}"), alpha(roughness)],
        MaterialKind::Dielectric { eta, roughness, .. } => [format!("glass of {eta}"), alpha(roughness)],
        MaterialKind::CoatedDiffuse { eta, roughness, .. } => [format!("coat of {eta}"), alpha(roughness)],
        _ => Default::default(),
    };
    scene.materials.iter().flat_map(of).filter(|text| !text.is_empty()).collect()
}

/// The kinds of textures and their pictures.
fn patterns(scene: &SceneDescription) -> Vec<String> {
    let of = |texture: &Texture| match texture {
        Texture::Image { image, .. } => match &scene.images[image.0 as usize].source {
            ImageSource::Bytes { name, .. } => name.clone(),
            ImageSource::File(path) => panic!("a file is needed: {}", path.display()),
        },
        other => format!("{other:?}").split_whitespace().next().unwrap_or_default().to_owned(),
    };
    scene.textures.iter().map(of).collect()
}

/// Meshes of more than twelve triangles; fewer are walls, boxes and small prisms.
fn meshes(scene: &SceneDescription) -> Vec<String> {
    let objects = scene.objects.iter().flat_map(|object| &object.shapes);
    let of = |shape: &Shape| match &shape.geometry {
        Geometry::Triangles(mesh) if mesh.indices.len() > 12 => {
            Some(format!("{:?} {:?}", mesh.positions, mesh.indices))
        }
        Geometry::Sphere { .. } => Some("sphere".to_owned()),
        Geometry::Disk { .. } => Some("disk".to_owned()),
        _ => None,
    };
    scene.shapes.iter().chain(objects).filter_map(of).collect()
}

/// The same scenes on every machine and in every version: if this changes on purpose, the shipped model must be
/// trained again.
#[test]
fn the_scenes_of_seed_1_stay_what_they_are() {
    let prints = [Split::Training, Split::Validation]
        .map(|split| all(split, 1).fold(0, |print: u64, s| print.rotate_left(5) ^ fingerprint(&s)));
    assert_eq!(prints, [12_847_547_707_913_535_929, 13_158_866_509_242_338_964], "{prints:#x?}");
}

#[test]
fn the_splits_have_nothing_in_common() {
    let kinds = |split: Split| split.kinds().map(str::to_owned).collect::<Vec<_>>();
    let parts = |split: Split| -> HashSet<String> {
        let scenes = all(split, 1).chain(all(split, 2));
        let of = |scene: SceneDescription| [substances(&scene), patterns(&scene), meshes(&scene)].concat();
        scenes.flat_map(of).chain(kinds(split)).collect()
    };
    let (training, validation) = (parts(Split::Training), parts(Split::Validation));
    assert!(training.len() > 40 && validation.len() > 40, "{} {}", training.len(), validation.len());
    let both: Vec<_> = training.intersection(&validation).map(|s| &s[..s.len().min(120)]).collect();
    assert!(both.is_empty(), "{both:?}");
}
