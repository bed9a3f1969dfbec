//! A city: a few houses and trees, placed many times along a grid of streets.

use super::Random;
use std::fmt::Write;

/// Blocks each way, and houses each way in a block.
const BLOCKS: i32 = 26;
const HOUSES: i32 = 3;
/// From block to block, streets included.
const BLOCK: f32 = 5.0;
const HOUSE: f32 = 1.3;

/// The instances of the city as pbrt text; the objects `tower`, `house`, `slab` and `steps` are unit cubes' worth.
pub fn blocks(seed: u64) -> String {
    let mut random = Random(seed);
    let mut text = String::new();
    for bx in -BLOCKS..BLOCKS {
        for bz in 0..2 * BLOCKS {
            for hx in 0..HOUSES {
                for hz in 0..HOUSES {
                    let (x, z) =
                        (bx as f32 * BLOCK + hx as f32 * HOUSE, bz as f32 * BLOCK + hz as f32 * HOUSE);
                    // Two centres of high houses.
                    let near =
                        |cx: f32, cz: f32, r: f32| (-((x - cx).powi(2) + (z - cz).powi(2)) / (r * r)).exp();
                    let high = 13.0 * near(-12.0, 55.0, 18.0) + 18.0 * near(30.0, 85.0, 20.0);
                    let height = 0.5 + random.within(0.2, 0.9) + high * random.next().powi(2);
                    if random.next() < 0.06 {
                        continue; // a yard
                    }
                    let name = match random.next() {
                        _ if height > 4.5 => ["tower", "steps"][usize::from(random.next() < 0.4)],
                        r if r < 0.45 => "house",
                        r if r < 0.8 => "slab",
                        _ => "tower",
                    };
                    let side = HOUSE * random.within(0.72, 0.98);
                    let quarter = (random.next() * 4.0) as u32 * 90;
                    let _ = writeln!(
                        text,
                        "AttributeBegin Translate {x:.2} 0 {z:.2} Scale {side:.2} {height:.2} {side:.2} \
                         Rotate {quarter} 0 1 0 ObjectInstance \"{name}\" AttributeEnd"
                    );
                }
            }
        }
    }
    text
}
