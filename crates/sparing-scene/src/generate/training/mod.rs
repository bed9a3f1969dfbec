//! Scenes that the sampler learns from, made by formulas from a seed.
//!
//! A recipe (a kind of scene, such as "window room") fixes what makes its scenes hard or easy: what is lit how and
//! seen from where. Everything else is drawn: sizes, places, materials, lights, camera, lens, exposure. Scene `index`
//! uses recipe `index` modulo the number of recipes, so any run of scenes is varied, and there is no last scene.
//!
//! The two splits have no recipe in common, and differ in
//!
//! | | training | validation |
//! | --- | --- | --- |
//! | bodies | boxes, spheres, tori and torus knots, columns, terrain, straight wires, cards | prisms, pyramids, icosahedra, rocks, gears, turned vases and goblets, vaults, steps, ripples, coils, blades |
//! | lamps | spheres and rectangles, point lights | disks, spot lights |
//! | openings | rectangular windows | slats, a perforated shade, gaps below a vault |
//! | textures | checkerboards, noise, leaf cut-outs | stripes, bricks, dots |
//! | metals, glass, coats | copper, gold, aluminium; 1.5, 1.7; 1.5 | silver, brass, iron; 1.33, 1.6; 1.42 |
//! | roughness (GGX alpha) | 0.03 to 0.09, 0.2 to 0.32 | 0.1 to 0.18, 0.35 to 0.5 |
//! | hues | the first half of each sixth of the circle | the second half |
//!
//! In both are what there is only one way to be: flat ground and walls, smooth metal and glass, an even sky, a sun.
//!
//! Choices and coordinates come from integers and exactly rounded operations, so a scene is the same on every machine.

mod learning;
mod palette;
mod pictures;
mod random;
mod shapes;
mod stage;
mod validation;

use crate::SceneDescription;
use random::{Random, power_of_two};
use stage::Stage;

/// What a scene is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Split {
    /// To learn from.
    Training,
    /// To choose between models, never to learn from.
    Validation,
}

/// A kind of scene: its name and what builds it.
type Recipe = (&'static str, fn(&mut Stage));

impl Split {
    fn recipes(self) -> &'static [Recipe] {
        match self {
            Self::Training => learning::RECIPES,
            Self::Validation => validation::RECIPES,
        }
    }

    /// The number of scenes that covers every recipe several times: a good number to use.
    #[must_use]
    pub fn scenes(self) -> u32 {
        let times = match self {
            Self::Training => 4,
            Self::Validation => 2,
        };
        times * self.recipes().len() as u32
    }

    /// The names of the kinds of scenes.
    pub fn kinds(self) -> impl Iterator<Item = &'static str> {
        self.recipes().iter().map(|recipe| recipe.0)
    }
}

/// Scene `index` of a split, of a picture of about 10,000 pixels (a hint: the size may be changed) and with
/// the depth that it needs. The name says what it is; it is fit for a file name.
///
/// Every fifth scene or so is very bright or very dim, by `film.scale`.
#[must_use]
pub fn scene(index: u32, seed: u64, split: Split) -> SceneDescription {
    let recipes = split.recipes();
    let (name, build) = recipes[index as usize % recipes.len()];
    let word = match split {
        Split::Training => "training",
        Split::Validation => "validation",
    };
    let mut stage = Stage::new(split, Random::new(&[seed, split as u64, u64::from(index)]));
    build(&mut stage);
    let mut scene = stage.scene;
    if stage.random.chance(0.2) {
        scene.film.scale = power_of_two(stage.random.pick([-9, -6, 6, 9]));
    }
    scene.name = format!("{word}-{index:02}-{}", name.replace(' ', "-"));
    scene
}
