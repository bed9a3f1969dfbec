//! The pooled rule with other units, neighbourhoods and steps than `threshold` has: what was tried (docs/adaptive.md).

use sparing_adaptive::goal::Goal;
use sparing_adaptive::policy::{Barrier, Decisions, PERCEIVED_PER_RELATIVE, Policy, own_spread};
use sparing_adaptive::pooling::Plane;
use sparing_adaptive::view::DARK;
use sparing_image::color::{WHITE, rgb_to_xyz};
use sparing_image::film::{Film, FilmOptions, Pixel};

/// What a pixel's error is measured in.
#[derive(Clone, Copy, PartialEq)]
pub enum Unit {
    /// The larger of luminance and CIEDE2000, as `threshold` has it.
    Both,
    /// Relative error of the luminance.
    Luminance,
    /// CIEDE2000.
    Perceived,
    /// X, Y and Z, each relative to white, over the luminance.
    Xyz,
}

/// Whose errors count besides the own one.
#[derive(Clone, Copy, PartialEq)]
pub enum Pool {
    /// Root mean square of the square of this radius.
    Square(usize),
    /// The largest of 3 by 3.
    Largest,
    /// Root mean square of those in the square of this radius that show some of the same shapes.
    SameShapes(usize),
    /// Of those that are also alike in albedo, normal and depth.
    Alike(usize),
}

/// Samples of the next layer over those of this one.
#[derive(Clone, Copy, PartialEq)]
pub enum Step {
    /// 3/2 and 4/3 in turn.
    Half,
    Double,
    Quadruple,
}

/// What the own spread counts for against that of the neighbourhood, as in `threshold`.
const OWN: f32 = std::f32::consts::SQRT_2;

/// The rule, for one render.
pub struct Rule {
    pub goal: Goal,
    pub unit: Unit,
    pub pool: Pool,
    pub step: Step,
    /// A pixel goes on while spread / n to this power exceeds the threshold: 1 takes off most of the squared error, 1/2 evens
    /// errors out.
    pub power: f32,
    /// Whether a pixel gets at least what its neighbours asked for in the first layer, and what is taken from it goes to them.
    pub plan: bool,
    /// What the own spread counts for by itself, beside that of the neighbourhood; 0 if it counts as one of them.
    pub own: f32,
    alike: Option<Vec<Vec<usize>>>,
}

impl Rule {
    pub fn new(goal: Goal) -> Self {
        Self {
            goal,
            unit: Unit::Both,
            pool: Pool::Square(1),
            step: Step::Double,
            power: 1.0,
            plan: true,
            own: OWN,
            alike: None,
        }
    }

    fn spread(&self, barrier: &Barrier<'_>) -> Plane {
        let view = barrier.view();
        match self.unit {
            Unit::Both => view.plane(own_spread),
            Unit::Luminance => {
                view.plane(|p| PERCEIVED_PER_RELATIVE * p.relative_error * (p.count as f32).sqrt())
            }
            Unit::Perceived => view.plane(|p| p.perceived_error * (p.count as f32).sqrt()),
            Unit::Xyz => {
                let exposure = f64::from(view.exposure);
                let values = barrier.film.map(|t, i| xyz_spread(&t.pixels[i], exposure));
                Plane { width: view.width, height: view.height, values }
            }
        }
    }

    /// The root mean square of the others of each pixel's neighbours.
    fn others(&self, own: &Plane) -> Plane {
        match (&self.alike, self.pool) {
            (Some(alike), _) => Plane { values: mean_squares(alike, &own.values), ..*own },
            (None, Pool::Square(radius)) => own.others(radius),
            (None, _) => own.others(1),
        }
    }
}

/// The error of X, Y and Z from block means, as [`own_spread`] has that of the luminance.
fn xyz_spread(pixel: &Pixel, exposure: f64) -> f32 {
    let size = pixel.blocks().next().map_or(0, |(_, n)| n);
    let whole = pixel.blocks().filter(|(_, n)| *n == size);
    let blocks: Vec<[f64; 3]> =
        whole.map(|(sum, n)| rgb_to_xyz((sum * (exposure / f64::from(n))).to_array())).collect();
    let n = blocks.len() as f64;
    if blocks.len() < 2 {
        return 0.0;
    }
    let mean: [f64; 3] = std::array::from_fn(|c| blocks.iter().map(|b| b[c]).sum::<f64>() / n);
    let square = |c: usize| {
        let deviation = |b: &[f64; 3]| ((b[c] - mean[c]) / WHITE[c]).powi(2);
        blocks.iter().map(deviation).sum::<f64>() / (n * (n - 1.0))
    };
    let error = ((square(0) + square(1) + square(2)) / 3.0).sqrt() / (mean[1] + f64::from(DARK as f32));
    (f64::from(PERCEIVED_PER_RELATIVE) * error * f64::from(pixel.count()).sqrt()).min(1e30) as f32
}

/// The root mean square of the others and the own value, as if no square were cut at the border.
fn with_own(own: &Plane, others: &Plane, radius: usize) -> Plane {
    let share = 1.0 / ((2 * radius + 1) * (2 * radius + 1)) as f32;
    let both = |(own, others): (&f32, &f32)| (share * own * own + (1.0 - share) * others * others).sqrt();
    Plane { values: own.values.iter().zip(&others.values).map(both).collect(), ..*own }
}

fn mean_squares(groups: &[Vec<usize>], values: &[f32]) -> Vec<f32> {
    let mean = |group: &Vec<usize>| {
        let squares: f64 = group.iter().map(|&i| f64::from(values[i]).powi(2)).sum();
        (squares / group.len().max(1) as f64).sqrt() as f32
    };
    groups.iter().map(mean).collect()
}

/// What the first layer shows of a pixel besides its radiance.
#[derive(Clone, Default)]
struct Surface {
    shapes: Vec<u32>,
    albedo: glam::Vec3,
    normal: glam::Vec3,
    depth: f32,
}

fn surfaces(film: &Film) -> Vec<Surface> {
    film.map(|t, i| {
        let (sums, n) = (&t.auxiliary[i], t.auxiliary[i].hits.max(1) as f32);
        Surface {
            shapes: t.shapes[i].ids().collect(),
            albedo: sums.albedo / n,
            normal: sums.normal.normalize_or_zero(),
            depth: sums.depth / n,
        }
    })
}

impl Surface {
    fn shares_shapes(&self, other: &Self) -> bool {
        self.shapes.iter().any(|id| other.shapes.contains(id))
    }

    fn is_alike(&self, other: &Self) -> bool {
        self.shares_shapes(other)
            && (self.albedo - other.albedo).abs().max_element() < 0.1
            && (self.normal.dot(other.normal) > 0.9 || self.normal == other.normal)
            && (self.depth - other.depth).abs() <= 0.1 * self.depth.max(other.depth)
    }
}

/// For each pixel the others within the radius that are alike.
fn groups(film: &Film, radius: usize, alike: impl Fn(&Surface, &Surface) -> bool) -> Vec<Vec<usize>> {
    let (width, height) = (film.width() as usize, film.height() as usize);
    let all = surfaces(film);
    let group = |pixel: usize| {
        let (x, y) = (pixel % width, pixel / width);
        let rows = y.saturating_sub(radius)..(y + radius + 1).min(height);
        let columns = x.saturating_sub(radius)..(x + radius + 1).min(width);
        rows.flat_map(|v| columns.clone().map(move |u| v * width + u))
            .filter(|&other| other != pixel && alike(&all[pixel], &all[other]))
            .collect()
    };
    (0..all.len()).map(group).collect()
}

impl Policy for Rule {
    fn name(&self) -> &'static str {
        "rule"
    }

    fn film_options(&self) -> FilmOptions {
        FilmOptions { auxiliary: true, shapes: true, ..FilmOptions::default() }
    }

    fn decide(&mut self, barrier: &Barrier<'_>) -> Decisions {
        if self.alike.is_none() {
            self.alike = match self.pool {
                Pool::SameShapes(radius) => Some(groups(barrier.film, radius, Surface::shares_shapes)),
                Pool::Alike(radius) => Some(groups(barrier.film, radius, Surface::is_alike)),
                Pool::Square(_) | Pool::Largest => None,
            };
        }
        let (view, bounds) = (barrier.view(), barrier.bounds);
        let own = self.spread(barrier);
        let others = self.others(&own);
        let nothing = vec![0.0; own.values.len()];
        let plan = if self.plan { &barrier.plan_by(|| others.clone()).values } else { &nothing };
        let around = match self.pool {
            Pool::Largest => own.dilated(),
            Pool::Square(radius) if self.own == 0.0 => with_own(&own, &others, radius),
            _ => others,
        };
        let pooled = own.values.iter().zip(&around.values).zip(&view.pixels).map(|((own, around), p)| {
            (self.own * own).max(*around) * (p.count as f32 / bounds.min_spp as f32).powf(1.0 - self.power)
        });
        let values = pooled.zip(plan).map(|(spread, plan)| spread.max(*plan)).collect();
        let spread = Plane { values, ..own };
        let [lambda, _] = self.goal.thresholds(view, &spread, bounds);
        let next = |count: u32| match self.step {
            Step::Half if count.is_power_of_two() => count / 2 * 3,
            Step::Half => count / 3 * 4,
            Step::Double => 2 * count,
            Step::Quadruple => 4 * count,
        };
        let decide = |(p, &spread): (&sparing_adaptive::view::Statistics, &f32)| {
            let go_on = f64::from(spread) > lambda * f64::from(p.count.max(1)) && spread > 0.0;
            if go_on { next(p.count).min(bounds.max_spp) } else { p.count }
        };
        let targets = view.pixels.iter().zip(&spread.values).map(decide).collect();
        Decisions { targets, values: Vec::new(), lambda: Some(lambda) }
    }
}
