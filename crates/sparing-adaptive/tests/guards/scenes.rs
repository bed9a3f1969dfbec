//! The guards, and where in the picture is what must not be lost.

/// What is around a feature, and taken off its light.
#[derive(Clone, Copy, Debug)]
pub enum Around {
    /// Nothing: all light is the feature's.
    Black,
    /// The picture's median, for features darker or brighter than an even wall.
    Median,
}

/// A feature.
pub struct Feature {
    pub scene: &'static str,
    pub name: &'static str,
    /// x0, y0, x1, y1 as shares of width and height; pixels whose middle is inside.
    pub region: [f64; 4],
    pub around: Around,
}

const fn feature(scene: &'static str, name: &'static str, region: [f64; 4], around: Around) -> Feature {
    Feature { scene, name, region, around }
}

/// In the order of their scenes.
pub const FEATURES: [Feature; 13] = [
    feature("black-and-bright", "dim strip", [0.15, 0.0, 0.25, 1.0], Around::Black),
    feature("black-and-bright", "edge", [0.46, 0.0, 0.56, 1.0], Around::Black),
    feature("caustic", "behind the ball", [0.03, 0.56, 0.22, 0.72], Around::Black),
    feature("caustic", "below the knot", [0.4, 0.45, 1.0, 0.95], Around::Black),
    feature("fine-checkerboard", "far squares", [0.0, 0.35, 1.0, 0.65], Around::Black),
    feature("fireflies", "behind the pane", [0.6, 0.2, 1.0, 0.8], Around::Black),
    feature("light-through-hole", "light", [0.44, 0.24, 0.56, 0.37], Around::Black),
    feature("light-through-hole", "spot", [0.4, 0.78, 0.6, 0.88], Around::Black),
    feature("lit-block", "block", [0.67, 0.22, 0.77, 0.36], Around::Black),
    feature("motion-blur", "dark ball", [0.36, 0.7, 0.64, 0.8], Around::Median),
    feature("motion-blur", "spark", [0.0, 0.25, 1.0, 0.33], Around::Median),
    feature("thin-wire", "dark wire", [0.0, 0.27, 1.0, 0.35], Around::Median),
    feature("thin-wire", "glowing wire", [0.0, 0.68, 1.0, 0.78], Around::Median),
];

impl Feature {
    /// Indices of its pixels in a picture of this size, in rows.
    pub fn pixels(&self, [width, height]: [u32; 2]) -> Vec<usize> {
        let [x0, y0, x1, y1] = self.region;
        let inside = |i: &usize| {
            let (x, y) = (*i as u32 % width, *i as u32 / width);
            let [u, v] = [[x, width], [y, height]].map(|[a, b]| (f64::from(a) + 0.5) / f64::from(b));
            (x0..x1).contains(&u) && (y0..y1).contains(&v)
        };
        (0..(width * height) as usize).filter(inside).collect()
    }
}
