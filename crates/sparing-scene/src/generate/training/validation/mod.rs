//! The recipes of the validation scenes.

mod objects;
mod outdoors;
mod rooms;

use super::Recipe;

pub(super) const RECIPES: &[Recipe] = &[
    ("rotunda", rooms::rotunda),
    ("vases", objects::vases),
    ("blinds", rooms::blinds),
    ("coils", outdoors::coils),
    ("vault", rooms::vault),
    ("goblets", objects::goblets),
    ("rocks", outdoors::rocks),
    ("lantern", objects::lantern),
    ("steps", rooms::steps),
    ("grass", outdoors::grass),
    ("heap", objects::heap),
];
