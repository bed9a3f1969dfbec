//! From a model to the levels of a machine.

use super::bound::rbf_error;
use super::exp::ExpMethod;
use super::machine::{Levels, Linear, Machine, Single};
use super::packed::{Item, Packed};
use super::run::{InstructionSet, exp_error, tile_errors};
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
            let double = compiled.pack_double(model, &terms);
            let errors = compiled.double_errors(&double);
            Levels::Kernel { single: compiled.compile_single(model, &terms, exp), double, errors }
        };
        compiled
    }

    fn compile_single(&self, model: &Model, terms: &[(usize, f64)], exp: ExpMethod) -> Option<Single> {
        let spread = Spread::of(model, terms);
        let (scale, rbf) = match self.kernel {
            Kernel::Rbf { gamma } => ((2.0 * gamma * LOG2_E).sqrt(), true),
            Kernel::Polynomial { gamma, .. } | Kernel::Sigmoid { gamma, .. } => (gamma, false),
            Kernel::Linear => return None,
        };
        let features: Vec<usize> = (0..model.features).filter(|&j| !rbf || spread.differs[j]).collect();
        let center = if rbf { spread.center } else { vec![0.0; model.features] };
        let mut packed = Packed::new(features.len());
        let item = |&(i, coefficient): &(usize, f64)| {
            let s = model.support_vector(i);
            let scale = if rbf { scale } else { 1.0 };
            let vector: Vec<f64> = features.iter().map(|&j| (s[j] - center[j]) * scale).collect();
            let weight = coefficient / self.weight;
            let norm2: f64 = vector.iter().map(|x| x * x).sum();
            Item { start: if rbf { weight.abs().log2() - norm2 / 2.0 } else { weight }, vector }
        };
        let norm2 = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
        if rbf {
            for sign in [1.0, -1.0] {
                let items: Vec<Item> = terms.iter().filter(|t| t.1 * sign > 0.0).map(item).collect();
                packed.append(items, sign, f32::MIN_EXPONENT, |i| (i.start + norm2(&i.vector) / 2.0).exp2());
            }
        } else {
            packed.append(terms.iter().map(item).collect(), 1.0, 0.0, |i| i.start.abs());
        }
        let norm = packed.tiles.iter().map(|t| t.norm).fold(0.0, f64::max);
        let lowest = packed.tiles.iter().map(|t| -t.start).fold(0.0, f64::min);
        // With gamma 0 the definition is NaN for queries whose squared distance overflows: f64 sees that, f32 does not.
        if !norm.is_finite() || (rbf && (norm > MAX_NORM || scale == 0.0)) {
            return None;
        }
        let (near, far) = if rbf {
            let error = |far: bool| {
                let steps = self.steps(packed.features);
                tile_errors(&packed.tiles, |t| rbf_error(t, steps, far, exp_error(self.set, exp)))
            };
            (error(false), error(true))
        } else {
            (tile_errors(&packed.tiles, |_| [0.0; 3]), Vec::new())
        };
        Some(Single { packed, near, far, exp, features, center, scale, lowest, norm })
    }

    /// RBF: raw vectors, compared by differences; others: raw vectors, weights.
    fn pack_double(&self, model: &Model, terms: &[(usize, f64)]) -> Packed<f64> {
        let mut packed = Packed::new(model.features);
        let rbf = matches!(self.kernel, Kernel::Rbf { .. });
        let item = |&(i, coefficient): &(usize, f64)| {
            let weight = coefficient / self.weight;
            let start = if rbf { weight.abs().log2() } else { weight };
            Item { start, vector: model.support_vector(i).to_vec() }
        };
        if rbf {
            for sign in [1.0, -1.0] {
                let items: Vec<Item> = terms.iter().filter(|t| t.1 * sign > 0.0).map(item).collect();
                packed.append(items, sign, f64::MIN_EXPONENT, |i| i.start.exp2());
            }
        } else {
            packed.append(terms.iter().map(item).collect(), 1.0, 0.0, |i| i.start.abs());
        }
        packed
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
