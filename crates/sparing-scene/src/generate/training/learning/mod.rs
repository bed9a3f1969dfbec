//! The recipes of the training scenes.

mod objects;
mod outdoors;
mod rooms;

use super::Recipe;

pub(super) const RECIPES: &[Recipe] = &[
    ("box room", rooms::box_room),
    ("table", objects::table),
    ("window room", rooms::window_room),
    ("knot", objects::knot),
    ("fence", outdoors::fence),
    ("hidden lamp", rooms::hidden_lamp),
    ("foliage", outdoors::foliage),
    ("plates", objects::plates),
    ("behind a pane", rooms::behind_a_pane),
    ("caustic", objects::caustic),
    ("hills", outdoors::hills),
    ("dark frame", objects::dark_frame),
    ("columns", outdoors::columns),
    ("stacks", objects::stacks),
];
