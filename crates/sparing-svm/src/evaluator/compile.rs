//! From a model to the levels of a machine.

use super::bound::rbf_error;
use super::exp::ExpMethod;
use super::machine::{Levels, Linear, Machine, Single};
use super::packed::{Item, Packed};
use super::run::{EXP_ERROR_F64, InstructionSet, TileError, exp_error, tile_errors};
use super::simd::Real;
use crate::model::{Kernel, Model};
use std::f64::consts::LOG2_E;

/// RBF vectors farther than this from their centre (in units of the kernel's width) are only evaluated in f64: in f32,
/// inner products of that size have no digits left.
pub(crate) const MAX_NORM: f64 = 512.0;

impl Machine {
    /// Compiles machine number `machine` of the model.
    pub(crate) fn compile(model: &Model, machine: usize, set: InstructionSet, exp: ExpMethod) -> Self {
        let terms: Vec<(usize, f64)> = model.terms(machine).filter(|&(_, c)| c != 0.0).collect();
        let weight = terms.iter().map(|t| t.1.abs()).fold(0.0, f64::max);
        let mut compiled = Self {
            levels: Levels::Linear(Linear::default()),
            kernel: model.kernel,
            set,
            rho: model.rho[machine],
            weight: if weight > 0.0 { weight } else { 1.0 },
            weights: 0.0,
            len: terms.len(),
            features: model.features,
        };
        compiled.weights = terms.iter().map(|t| t.1.abs() / compiled.weight).sum();
        compiled.levels = if model.kernel == Kernel::Linear {
            Levels::Linear(linear(model, &terms))
        } else {
            compiled.compile_levels(model, &terms, exp)
        };
        compiled
    }

    fn compile_levels(&self, model: &Model, terms: &[(usize, f64)], exp: ExpMethod) -> Levels {
        let frame = Frame::of(model, terms);
        let item = |term: &(usize, f64)| frame.item(model, *term, self.weight);
        let packed = self.pack::<f32>(terms, frame.features.len(), item);
        let norm = packed.tiles.iter().map(|t| t.norm).fold(0.0, f64::max);
        // With gamma 0 the definition is NaN for queries whose squared distance overflows; centred features hide that.
        if !norm.is_finite() || (frame.rbf && (norm > MAX_NORM || frame.scale == 0.0)) {
            return self.compile_raw(model, terms);
        }
        let double = self.pack::<f64>(terms, frame.features.len(), item);
        let errors = self.errors(&double, true, EXP_ERROR_F64);
        let exp_error = exp_error(self.set, exp);
        let single = Single {
            near: self.errors(&packed, false, exp_error),
            far: self.errors(&packed, true, exp_error),
            allowance: self.allowance(&packed),
            exp,
            lowest: packed.tiles.iter().map(|t| -t.start).fold(0.0, f64::min),
            norm,
            packed,
            features: frame.features,
            center: frame.center,
            scale: frame.scale,
        };
        let allowance = self.allowance(&double);
        Levels::Kernel { single: Some(Box::new(single)), double, errors, allowance }
    }

    /// Vectors as they are, in f64 only.
    fn compile_raw(&self, model: &Model, terms: &[(usize, f64)]) -> Levels {
        let rbf = matches!(self.kernel, Kernel::Rbf { .. });
        let double = self.pack::<f64>(terms, model.features, |&(i, coefficient)| {
            let weight = coefficient / self.weight;
            let start = if rbf { weight.abs().log2() } else { weight };
            Item { start, weight: weight.abs(), vector: model.support_vector(i).to_vec() }
        });
        let errors = if rbf { self.difference_errors(&double) } else { self.errors(&double, false, 0.0) };
        let allowance = self.allowance(&double);
        Levels::Kernel { single: None, double, errors, allowance }
    }

    /// RBF: positive coefficients, then negative ones, the rest of a group's lanes too low to count; others: all at once.
    fn pack<R: Real>(
        &self,
        terms: &[(usize, f64)],
        features: usize,
        item: impl Fn(&(usize, f64)) -> Item,
    ) -> Packed<R> {
        let mut packed = Packed::new(features);
        if matches!(self.kernel, Kernel::Rbf { .. }) {
            for sign in [1.0, -1.0] {
                let items = terms.iter().filter(|t| t.1 * sign > 0.0).map(&item).collect();
                packed.append(items, sign, R::MIN_EXPONENT, true);
            }
        } else {
            packed.append(terms.iter().map(item).collect(), 1.0, 0.0, false);
        }
        packed
    }

    /// Errors of tiles: RBF by inner products; for other kernels they do not depend on the tile
    /// ([`Machine::finish_product`]).
    fn errors<R: Real>(&self, packed: &Packed<R>, far: bool, exp_error: f64) -> Vec<TileError> {
        let steps = self.steps(packed.features);
        let rbf = matches!(self.kernel, Kernel::Rbf { .. });
        tile_errors(&packed.tiles, |t| {
            if rbf { rbf_error::<R>(t, steps, packed.features, far, exp_error) } else { [0.0; 3] }
        })
    }
}

/// How features are brought into the kernel's own units.
struct Frame {
    rbf: bool,
    /// RBF: those that the vectors differ in; others: all.
    features: Vec<usize>,
    /// RBF: the middle of the vectors' box; others: 0.
    center: Vec<f64>,
    /// RBF: `sqrt(2 gamma log2 e)`, for vectors and queries; others: gamma, for queries.
    scale: f64,
}

impl Frame {
    fn of(model: &Model, terms: &[(usize, f64)]) -> Self {
        let n = model.features;
        match model.kernel {
            Kernel::Rbf { gamma } => {
                let spread = Spread::of(model, terms);
                let features = (0..n).filter(|&j| spread.differs[j]).collect();
                Self { rbf: true, features, center: spread.center, scale: (2.0 * gamma * LOG2_E).sqrt() }
            }
            Kernel::Polynomial { gamma, .. } | Kernel::Sigmoid { gamma, .. } => {
                Self { rbf: false, features: (0..n).collect(), center: vec![0.0; n], scale: gamma }
            }
            Kernel::Linear => {
                Self { rbf: false, features: (0..n).collect(), center: vec![0.0; n], scale: 1.0 }
            }
        }
    }

    fn item(&self, model: &Model, (i, coefficient): (usize, f64), largest: f64) -> Item {
        let s = model.support_vector(i);
        let scale = if self.rbf { self.scale } else { 1.0 };
        let vector: Vec<f64> = self.features.iter().map(|&j| (s[j] - self.center[j]) * scale).collect();
        let weight = coefficient / largest;
        let norm2: f64 = vector.iter().map(|x| x * x).sum();
        let start = if self.rbf { weight.abs().log2() - norm2 / 2.0 } else { weight };
        Item { start, weight: weight.abs(), vector }
    }
}

fn linear(model: &Model, terms: &[(usize, f64)]) -> Linear {
    let mut weights = vec![0.0; model.features];
    let mut magnitudes = vec![0.0; model.features];
    let mut reach = vec![0.0; model.features];
    for &(i, c) in terms {
        for (j, &x) in model.support_vector(i).iter().enumerate() {
            weights[j] += c * x;
            magnitudes[j] += (c * x).abs();
            reach[j] = x.abs().max(reach[j]);
        }
    }
    Linear { weights, magnitudes, reach }
}

/// Range of each feature over the support vectors.
struct Spread {
    center: Vec<f64>,
    differs: Vec<bool>,
}

impl Spread {
    fn of(model: &Model, terms: &[(usize, f64)]) -> Self {
        let n = model.features;
        let (mut low, mut high) = (vec![f64::INFINITY; n], vec![f64::NEG_INFINITY; n]);
        for &(i, _) in terms {
            for ((low, high), &x) in low.iter_mut().zip(&mut high).zip(model.support_vector(i)) {
                *low = low.min(x);
                *high = high.max(x);
            }
        }
        let center = low.iter().zip(&high).map(|(l, h)| {
            if l < h {
                l / 2.0 + h / 2.0
            } else if l == h {
                *l
            } else {
                0.0
            }
        });
        Self { center: center.collect(), differs: low.iter().zip(&high).map(|(l, h)| l < h).collect() }
    }
}
