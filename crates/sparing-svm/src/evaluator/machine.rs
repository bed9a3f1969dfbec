//! One decision function of a model, compiled; and its levels: f32, f64, the definition.
//!
//! Each level gives a value and a proven bound of its distance to what [`crate::Model::decision_values`] computes.
//! A value larger than its bound has the right sign.

use super::bound::Allowance;
use super::compile::MAX_NORM;
use super::exp::ExpMethod;
use super::exp::power_of_two;
use super::packed::{Packed, flushed};
use super::run::{
    Batch, EXP_ERROR_F64, HeadKind, InstructionSet, Plan, Sum, TileError, exp_error, sums_f32, sums_f64,
};
use super::simd::Real;
use crate::model::Kernel;
use std::f64::consts::LOG2_E;

/// A value and the bound of its distance to the definition.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Value {
    pub(crate) value: f64,
    pub(crate) bound: f64,
}

impl Value {
    /// A value that overflowed has no bound.
    pub(crate) fn new(value: f64, bound: f64) -> Self {
        Self { value, bound: if value.is_finite() && bound >= 0.0 { bound } else { f64::INFINITY } }
    }

    /// Whether the sign is certain. False for NaN.
    pub(crate) fn is_certain(self) -> bool {
        self.value.abs() > self.bound
    }
}

/// A query as the f32 level sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Reach {
    /// All exponents stay in the range of f32: no clamping.
    Near,
    /// Exponents are clamped.
    Far,
    /// Too far, or not finite: not for f32.
    Beyond,
}

/// The linear kernel: one vector.
#[derive(Clone, Debug, Default)]
pub(crate) struct Linear {
    pub(crate) weights: Vec<f64>,
    /// Sum of the magnitudes of what was added up to each weight.
    pub(crate) magnitudes: Vec<f64>,
    /// Largest magnitude of each feature of the support vectors.
    pub(crate) reach: Vec<f64>,
}

/// The f32 level of a machine.
#[derive(Clone, Debug)]
pub(crate) struct Single {
    pub(crate) packed: Packed<f32>,
    pub(crate) allowance: Allowance,
    pub(crate) near: Vec<TileError>,
    pub(crate) far: Vec<TileError>,
    pub(crate) exp: ExpMethod,
    /// Features that the vectors differ in.
    pub(crate) features: Vec<usize>,
    pub(crate) center: Vec<f64>,
    /// RBF: `sqrt(2 gamma log2 e)`; others: gamma.
    pub(crate) scale: f64,
    /// Smallest start value.
    pub(crate) lowest: f64,
    /// Largest norm of a vector.
    pub(crate) norm: f64,
}

/// The levels of a machine.
#[derive(Clone, Debug)]
pub(crate) enum Levels {
    Linear(Linear),
    /// `double` is centred and scaled as `single` is; where there is no `single`, it holds the vectors as they are, and
    /// RBF compares them by differences.
    Kernel {
        single: Option<Box<Single>>,
        double: Packed<f64>,
        errors: Vec<TileError>,
        allowance: Allowance,
    },
}

/// A compiled decision function.
#[derive(Clone, Debug)]
pub(crate) struct Machine {
    pub(crate) levels: Levels,
    pub(crate) kernel: Kernel,
    pub(crate) set: InstructionSet,
    pub(crate) rho: f64,
    /// Largest magnitude of a coefficient; the vectors' weights are relative to it.
    pub(crate) weight: f64,
    /// Sum of the magnitudes of the coefficients, relative to `weight`.
    pub(crate) weights: f64,
    /// Number of support vectors, and of features of the model.
    pub(crate) len: usize,
    pub(crate) features: usize,
}

/// What the f32 level needs of a query beside its features.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prepared {
    pub(crate) reach: Reach,
    /// RBF: half the squared norm, negative.
    pub(crate) bias: f64,
    pub(crate) norm: f64,
}

impl Single {
    /// Centres and scales a query of which all features are kept; gives its squared norm.
    #[inline(always)]
    fn prepare_all<R: Real>(&self, query: &[f64], out: &mut [R]) -> f64 {
        // Four sums, so that additions do not wait for each other.
        let mut squares = [0.0; 4];
        let (fours, rest) = query.as_chunks::<4>();
        let (centers, center_rest) = self.center.as_chunks::<4>();
        let (out_fours, out_rest) = out.as_chunks_mut::<4>();
        for ((x, c), out) in fours.iter().zip(centers).zip(&mut *out_fours) {
            for i in 0..4 {
                let v = (x[i] - c[i]) * self.scale;
                squares[i] += v * v;
                out[i] = flushed(v);
            }
        }
        // Fewer than four are left; the padding takes them.
        if !rest.is_empty() {
            let out = &mut out_fours[fours.len()];
            for (i, (x, c)) in rest.iter().zip(center_rest).enumerate() {
                let v = (x - c) * self.scale;
                squares[i] += v * v;
                out[i] = flushed(v);
            }
            out[rest.len()..].fill(R::from_f64(0.0));
        }
        out_rest.fill(R::from_f64(0.0));
        (squares[0] + squares[1]) + (squares[2] + squares[3])
    }

    /// The same for a query of which some features count in the norm only.
    #[cold]
    fn prepare_some<R: Real>(&self, query: &[f64], out: &mut [R]) -> f64 {
        let scaled = |j: usize| (query[j] - self.center[j]) * self.scale;
        out.fill(R::from_f64(0.0));
        for (out, &j) in out.iter_mut().zip(&self.features) {
            *out = flushed(scaled(j));
        }
        (0..query.len()).map(|j| scaled(j) * scaled(j)).sum()
    }
}

impl Prepared {
    /// Not for f32.
    pub(crate) const BEYOND: Self = Self { reach: Reach::Beyond, bias: 0.0, norm: f64::INFINITY };
}

impl Machine {
    /// Bytes of vectors that a batch touches: those of the first level, and of all levels.
    pub(crate) fn bytes(&self) -> (usize, usize) {
        match &self.levels {
            Levels::Linear(l) => (8 * l.weights.len(), 16 * l.weights.len()),
            Levels::Kernel { single, double, .. } => {
                let single = single.as_ref().map_or(0, |s| s.packed.bytes());
                (if single > 0 { single } else { double.bytes() }, single + double.bytes())
            }
        }
    }

    /// Whether one weight vector is all there is.
    pub(crate) fn is_linear(&self) -> bool {
        matches!(self.levels, Levels::Linear(_))
    }

    /// Features of a query of the f32 level, padded; 0 where there is none.
    pub(crate) fn single_features(&self) -> usize {
        match &self.levels {
            Levels::Kernel { single: Some(s), .. } => s.packed.features,
            _ => 0,
        }
    }

    /// Features of a query of the f64 level, padded.
    pub(crate) fn double_features(&self) -> usize {
        match &self.levels {
            Levels::Linear(_) => 0,
            Levels::Kernel { double, .. } => double.features,
        }
    }

    /// Writes the query as the f32 level and the f64 level beside it want it.
    #[inline(always)]
    pub(crate) fn prepare<R: Real>(&self, query: &[f64], out: &mut [R]) -> Prepared {
        let Levels::Kernel { single: Some(s), .. } = &self.levels else {
            return Prepared::BEYOND;
        };
        let rbf = matches!(self.kernel, Kernel::Rbf { .. });
        let norm2 = if s.features.len() == query.len() {
            s.prepare_all(query, out)
        } else {
            s.prepare_some(query, out)
        };
        let norm = norm2.sqrt() * (1.0 + 1e-6);
        // Comparisons are false for NaN.
        let within = norm2 <= 2.0 * MAX_NORM * MAX_NORM && s.norm * norm <= MAX_NORM * MAX_NORM;
        let product = s.norm * norm;
        let near = s.lowest - product > f32::MIN_EXPONENT && product < 100.0 && norm2 < 200.0;
        let reach = match rbf {
            true if near => Reach::Near,
            true if within => Reach::Far,
            false if norm.is_finite() => Reach::Near,
            _ => Reach::Beyond,
        };
        Prepared { reach, bias: if rbf { -norm2 / 2.0 } else { 0.0 }, norm }
    }

    /// Writes the query as the f64 level wants it.
    pub(crate) fn prepare_double(&self, query: &[f64], out: &mut [f64]) -> Prepared {
        if self.single_features() > 0 {
            return self.prepare(query, out);
        }
        let scale = match self.kernel {
            Kernel::Polynomial { gamma, .. } | Kernel::Sigmoid { gamma, .. } => gamma,
            Kernel::Rbf { .. } | Kernel::Linear => 1.0,
        };
        let mut norm2 = 0.0;
        out.fill(0.0);
        for (out, x) in out.iter_mut().zip(query) {
            *out = x * scale;
            norm2 += *out * *out;
        }
        Prepared { reach: Reach::Beyond, bias: 0.0, norm: norm2.sqrt() * (1.0 + 1e-6) }
    }

    /// The f32 level for queries that were prepared alike (all near or all far): `queries` is `n * single_features()`.
    pub(crate) fn single(
        &self,
        queries: &[f32],
        prepared: &[Prepared],
        scratch: &mut Scratch,
        out: &mut [Value],
    ) {
        let Levels::Kernel { single: Some(s), .. } = &self.levels else { return };
        let n = out.len();
        let far = prepared.first().is_some_and(|p| p.reach == Reach::Far);
        let (head, start) = match self.kernel {
            Kernel::Rbf { .. } if far => (HeadKind::RbfClamped, None),
            Kernel::Rbf { .. } | Kernel::Linear => (HeadKind::RbfNear, Some(0.0)),
            Kernel::Polynomial { degree, coef0, .. } => (HeadKind::Polynomial(degree), Some(coef0)),
            Kernel::Sigmoid { coef0, .. } => (HeadKind::Sigmoid, Some(coef0)),
        };
        for ((start_out, norm), p) in scratch.starts.iter_mut().zip(&mut scratch.norms).zip(prepared) {
            *start_out = start.unwrap_or(p.bias) as f32;
            *norm = p.norm;
        }
        let plan = Plan { packed: &s.packed, errors: if far { &s.far } else { &s.near }, head, exp: s.exp };
        let batch = Batch {
            queries,
            starts: &scratch.starts[..n],
            norms: &scratch.norms[..n],
            sums: &mut scratch.sums[..n],
        };
        sums_f32(self.set, &plan, batch);
        for ((out, sum), p) in out.iter_mut().zip(&scratch.sums).zip(prepared) {
            *out = match self.kernel {
                Kernel::Rbf { .. } => {
                    let left_out = if far { 1.0 } else { power_of_two(p.bias) };
                    self.finish_rbf(sum, &s.allowance, self.weight * left_out)
                }
                _ => self.finish_product::<f32>(sum, &s.packed, p.norm, exp_error(self.set, s.exp)),
            };
        }
    }

    /// The f64 level: `queries` is `n * double_features()`.
    pub(crate) fn double(
        &self,
        queries: &[f64],
        prepared: &[Prepared],
        scratch: &mut Scratch,
        out: &mut [Value],
    ) {
        let Levels::Kernel { single, double, errors, allowance } = &self.levels else { return };
        let n = out.len();
        let (head, start) = match self.kernel {
            Kernel::Rbf { .. } if single.is_some() => (HeadKind::RbfClamped, None),
            Kernel::Rbf { gamma } => (HeadKind::RbfDifferences(gamma * LOG2_E), None),
            Kernel::Polynomial { degree, coef0, .. } => (HeadKind::Polynomial(degree), Some(coef0)),
            Kernel::Sigmoid { coef0, .. } => (HeadKind::Sigmoid, Some(coef0)),
            Kernel::Linear => return,
        };
        let mut starts = [0.0; CHUNK];
        for ((start_out, norm), p) in starts.iter_mut().zip(&mut scratch.norms).zip(prepared) {
            *start_out = start.unwrap_or(p.bias);
            *norm = p.norm;
        }
        let plan = Plan { packed: double, errors, head, exp: ExpMethod::Table };
        let (norms, sums) = (&scratch.norms[..n], &mut scratch.sums[..n]);
        sums_f64(self.set, &plan, Batch { queries, starts: &starts[..n], norms, sums });
        for ((out, sum), p) in out.iter_mut().zip(&scratch.sums).zip(prepared) {
            *out = match self.kernel {
                Kernel::Rbf { .. } => self.finish_rbf(sum, allowance, self.weight),
                _ => self.finish_product::<f64>(sum, double, p.norm, EXP_ERROR_F64),
            };
        }
    }

    /// The linear kernel's level.
    pub(crate) fn linear(&self, query: &[f64]) -> Option<Value> {
        let Levels::Linear(l) = &self.levels else { return None };
        let value: f64 = l.weights.iter().zip(query).map(|(w, x)| w * x).sum::<f64>() - self.rho;
        let magnitude: f64 = l.magnitudes.iter().zip(query).map(|(w, x)| w * x.abs()).sum();
        let steps = (self.len + 2 * self.features + 4) as f64;
        Some(Value::new(value, 2.0 * steps * f64::UNIT * (magnitude + self.rho.abs())))
    }
}

/// Queries of a batch that are evaluated together.
pub(crate) const CHUNK: usize = 256;

/// Scratch of a batch, on the caller's stack.
pub(crate) struct Scratch {
    starts: [f32; CHUNK],
    norms: [f64; CHUNK],
    sums: [Sum; CHUNK],
}

impl Scratch {
    pub(crate) fn new() -> Self {
        Self { starts: [0.0; CHUNK], norms: [0.0; CHUNK], sums: [Sum::default(); CHUNK] }
    }
}
