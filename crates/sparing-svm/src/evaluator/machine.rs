//! One decision function of a model, compiled; and its levels: f32, f64, the definition.
//!
//! Each level gives a value and a proven bound of its distance to what [`Model::decision_values`] computes.
//! A value larger than its bound has the right sign.

use super::exp::ExpMethod;
use super::packed::{Item, Packed, Tile, flushed};
use super::run::{
    Batch, EXP_ERROR_F64, HeadKind, InstructionSet, Plan, Sum, TileError, exp_error, sums_f32, sums_f64,
    tile_errors,
};
use super::simd::Real;
use crate::model::{Kernel, Model};
use std::f64::consts::{LN_2, LOG2_E};

/// RBF vectors farther than this from their centre (in units of the kernel's width) are only evaluated in f64: in f32,
/// inner products of that size have no digits left.
const MAX_NORM: f64 = 512.0;
/// Kernel values below `2^-60` count in bounds by their number only.
const NEGLIGIBLE: f64 = 60.0;

/// A value and the bound of its distance to the definition.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Value {
    pub(crate) value: f64,
    pub(crate) bound: f64,
}

impl Value {
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
    weights: Vec<f64>,
    /// Sum of the magnitudes of what was added up to each weight.
    magnitudes: Vec<f64>,
    /// Largest magnitude of each feature of the support vectors.
    reach: Vec<f64>,
}

/// The f32 level of a machine.
#[derive(Clone, Debug)]
struct Single {
    packed: Packed<f32>,
    near: Vec<TileError>,
    far: Vec<TileError>,
    exp: ExpMethod,
    /// Features that the vectors differ in.
    features: Vec<usize>,
    center: Vec<f64>,
    /// RBF: `sqrt(2 gamma log2 e)`; others: gamma.
    scale: f64,
    /// Smallest start value.
    lowest: f64,
    /// Largest norm of a vector.
    norm: f64,
}

#[derive(Clone, Debug)]
enum Levels {
    Linear(Linear),
    Kernel { single: Option<Single>, double: Packed<f64>, errors: Vec<TileError> },
}

/// A compiled decision function.
#[derive(Clone, Debug)]
pub(crate) struct Machine {
    levels: Levels,
    kernel: Kernel,
    set: InstructionSet,
    rho: f64,
    /// Largest magnitude of a coefficient; the vectors' weights are relative to it.
    weight: f64,
    /// Sum of the magnitudes of the coefficients, relative to `weight`.
    weights: f64,
    /// Number of support vectors, and of features of the model.
    len: usize,
    features: usize,
}

/// What the f32 level needs of a query beside its features.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prepared {
    pub(crate) reach: Reach,
    /// RBF: half the squared norm, negative.
    pub(crate) bias: f64,
    pub(crate) norm: f64,
}

impl Prepared {
    /// Not for f32.
    pub(crate) const BEYOND: Self = Self { reach: Reach::Beyond, bias: 0.0, norm: f64::INFINITY };
}

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
        if !norm.is_finite() || (rbf && norm > MAX_NORM) {
            return None;
        }
        let (near, far) = if rbf {
            let error = |far: bool| {
                tile_errors(&packed.tiles, |t| rbf_error(t, packed.features, far, exp_error(self.set, exp)))
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

    // t = start - factor * d2: d is rounded once, its square and the chains features / 4 + 3 times, the factor,
    // the product and the difference once each; the start is off by 2 units. Exponents below -60 are negligible.
    fn double_errors(&self, packed: &Packed<f64>) -> Vec<TileError> {
        if !matches!(self.kernel, Kernel::Rbf { .. }) {
            return tile_errors(&packed.tiles, |_| [0.0; 3]);
        }
        let steps = (packed.features / 4 + 8) as f64;
        tile_errors(&packed.tiles, |t| {
            let exponent = steps * (NEGLIGIBLE + 2.0 * t.start);
            [EXP_ERROR_F64 + f64::UNIT * (LN_2 * exponent + t.depth), 0.0, 0.0]
        })
    }

    /// Writes the query as the f32 level wants it.
    pub(crate) fn prepare(&self, query: &[f64], out: &mut [f32]) -> Prepared {
        let Levels::Kernel { single: Some(s), .. } = &self.levels else {
            return Prepared::BEYOND;
        };
        let mut norm2 = 0.0;
        let rbf = matches!(self.kernel, Kernel::Rbf { .. });
        for (out, &j) in out.iter_mut().zip(&s.features) {
            let x = (query[j] - s.center[j]) * s.scale;
            norm2 += x * x;
            *out = flushed(x);
        }
        for out in &mut out[s.features.len()..] {
            *out = 0.0;
        }
        if rbf && s.features.len() < query.len() {
            let mut kept = s.features.iter().peekable();
            for (j, &x) in query.iter().enumerate() {
                if kept.next_if_eq(&&j).is_none() {
                    norm2 += ((x - s.center[j]) * s.scale).powi(2);
                }
            }
        }
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
    pub(crate) fn prepare_double(&self, query: &[f64], out: &mut [f64]) {
        let scale = match self.kernel {
            Kernel::Polynomial { gamma, .. } | Kernel::Sigmoid { gamma, .. } => gamma,
            Kernel::Rbf { .. } | Kernel::Linear => 1.0,
        };
        out.fill(0.0);
        for (out, x) in out.iter_mut().zip(query) {
            *out = x * scale;
        }
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
                Kernel::Rbf { .. } => self.finish_rbf::<f32>(sum, &s.packed, if far { 0.0 } else { p.bias }),
                _ => self.finish_product::<f32>(sum, &s.packed, p.norm, exp_error(self.set, s.exp)),
            };
        }
    }

    /// The f64 level: `queries` is `n * double_features()`.
    pub(crate) fn double(&self, queries: &[f64], scratch: &mut Scratch, out: &mut [Value]) {
        let Levels::Kernel { double, errors, .. } = &self.levels else { return };
        let n = out.len();
        let (head, start) = match self.kernel {
            Kernel::Rbf { gamma } => (HeadKind::RbfDifferences(gamma * LOG2_E), 0.0),
            Kernel::Polynomial { degree, coef0, .. } => (HeadKind::Polynomial(degree), coef0),
            Kernel::Sigmoid { coef0, .. } => (HeadKind::Sigmoid, coef0),
            Kernel::Linear => return,
        };
        let starts = [start; CHUNK];
        let norms = [0.0; CHUNK];
        let plan = Plan { packed: double, errors, head, exp: ExpMethod::Table };
        let sums = &mut scratch.sums[..n];
        sums_f64(self.set, &plan, Batch { queries, starts: &starts[..n], norms: &norms[..n], sums });
        for ((out, sum), query) in out.iter_mut().zip(sums).zip(queries.chunks_exact(double.features)) {
            *out = match self.kernel {
                Kernel::Rbf { .. } => self.finish_rbf::<f64>(sum, double, 0.0),
                _ => {
                    let norm = query.iter().map(|x| x * x).sum::<f64>().sqrt() * (1.0 + 1e-6);
                    self.finish_product::<f64>(sum, double, norm, EXP_ERROR_F64)
                }
            };
        }
    }

    /// The linear kernel's level.
    pub(crate) fn linear(&self, query: &[f64]) -> Option<Value> {
        let Levels::Linear(l) = &self.levels else { return None };
        let value: f64 = l.weights.iter().zip(query).map(|(w, x)| w * x).sum::<f64>() - self.rho;
        let magnitude: f64 = l.magnitudes.iter().zip(query).map(|(w, x)| w * x.abs()).sum();
        let steps = (self.len + 2 * self.features + 4) as f64;
        Some(Value { value, bound: 2.0 * steps * f64::UNIT * (magnitude + self.rho.abs()) })
    }

    fn finish_rbf<R: Real>(&self, sum: &Sum, packed: &Packed<R>, bias: f64) -> Value {
        let lanes = packed.tiles.iter().map(|t| t.groups * R::LANES).sum::<usize>() as f64;
        let factor = self.weight * bias.exp2();
        // Clamped and padded lanes each add at most 2^MIN_EXPONENT.
        let tail = lanes * (R::MIN_EXPONENT + 1.0).exp2();
        let bound = factor * (sum.error + tail) + self.definition_error(factor * sum.magnitude);
        Value { value: factor * sum.value - self.rho, bound }
    }

    /// How far the definition, and this level's own sums in f64, can be from the exact value. The definition adds up `len`
    /// terms one by one, each off by the rounding of its exponent, at most 60 ln 2 unless it is negligible.
    fn definition_error(&self, magnitude: f64) -> f64 {
        let per_exponent = NEGLIGIBLE * LN_2 * (self.features + 4) as f64;
        let steps = self.len as f64 + per_exponent + 64.0;
        let negligible =
            self.len as f64 * self.weight * (-NEGLIGIBLE).exp2() * 1e-12 * (self.features + 4) as f64;
        1.1 * f64::UNIT * (steps * magnitude + 2.0 * self.rho.abs()) + negligible
    }

    // With B = |q| |s| + |coef0| the largest magnitude of an inner product, e its error: the power is off by
    // degree (B + e)^(degree - 1) e and its roundings, tanh (slope at most 1) by e and its roundings.
    fn finish_product<R: Real>(&self, sum: &Sum, packed: &Packed<R>, norm: f64, exp_error: f64) -> Value {
        let coef0 = match self.kernel {
            Kernel::Polynomial { coef0, .. } | Kernel::Sigmoid { coef0, .. } => coef0,
            Kernel::Rbf { .. } | Kernel::Linear => 0.0,
        };
        let vectors = packed.tiles.iter().map(|t| t.norm).fold(0.0, f64::max);
        let depth = packed.tiles.iter().map(|t| t.depth).fold(0.0, f64::max) + packed.tiles.len() as f64;
        let b = norm * vectors * (1.0 + 1e-6) + coef0.abs();
        let steps = (packed.features / 4 + 8) as f64 + 2.0 * (self.features + 4) as f64 * f64::UNIT / R::UNIT;
        let e = steps * R::UNIT * b;
        let (error, largest) = match self.kernel {
            Kernel::Polynomial { degree, .. } => {
                let p = f64::from(degree);
                (p * (b + e).powf((p - 1.0).max(0.0)) * e + (2.0 * p + 4.0) * R::UNIT * b.powf(p), b.powf(p))
            }
            _ => (e + 8.0 * R::UNIT + exp_error, 1.0),
        };
        let sums = (depth + 2.0) * R::UNIT + (self.len as f64 + 8.0) * f64::UNIT;
        let bound =
            1.1 * (self.weight * self.weights * (error + sums * largest) + 2.0 * f64::UNIT * self.rho.abs());
        Value { value: self.weight * sum.value - self.rho, bound }
    }

    /// The largest [`Value::bound`] of the first level over all queries (RBF), or over the queries no longer than the
    /// longest support vector (other kernels).
    pub(crate) fn error_bound(&self) -> f64 {
        match &self.levels {
            Levels::Linear(l) => self.linear(&l.reach).map_or(f64::INFINITY, |v| v.bound),
            Levels::Kernel { single: Some(s), .. } => match self.kernel {
                Kernel::Rbf { .. } => self.rbf_error_bound(&s.packed, &s.far),
                _ => {
                    let longest = s.norm * s.scale.abs();
                    self.finish_product::<f32>(
                        &Sum::default(),
                        &s.packed,
                        longest,
                        exp_error(self.set, s.exp),
                    )
                    .bound
                }
            },
            Levels::Kernel { errors, double, .. } => match self.kernel {
                Kernel::Rbf { .. } => self.rbf_error_bound(double, errors),
                _ => f64::INFINITY,
            },
        }
    }

    // A kernel value of a query at distance d outside the ball of a tile's vectors is below 2^(-d^2 / 2), and
    // d 2^(-d^2 / 2) <= 0.73, d^2 2^(-d^2 / 2) <= 1.07.
    fn rbf_error_bound<R: Real>(&self, packed: &Packed<R>, errors: &[TileError]) -> f64 {
        let mut sum = Sum::default();
        for (tile, error) in packed.tiles.iter().zip(errors) {
            let [constant, linear, quadratic] = error.coefficients;
            let n = tile.norm;
            let relative = constant + linear * (n + 0.73) + quadratic * (n * n + 1.46 * n + 1.07);
            sum.error += tile.weight * if relative < 0.01 { 1.05 * relative } else { f64::INFINITY };
            sum.magnitude += tile.weight;
        }
        self.finish_rbf(&sum, packed, 0.0).bound
    }
}

// Exponent t = start + bias + <q, s> in four chains: the intermediate sums of each step are together at most
// |start| + |bias| + |q||s| (Cauchy-Schwarz over the chains), each rounded once (products too where not fused): features / 4
// steps, two to join the chains, one for rounding the start, two for q and s, one for the products.
fn rbf_error(tile: &Tile, features: usize, far: bool, exp: f64) -> [f64; 3] {
    let steps = (features / 4) as f64;
    let unit = f32::UNIT * LN_2 * 1.01;
    let constant = exp + f32::UNIT * tile.depth + unit * (steps + 4.0) * tile.start;
    // |bias| = |q|^2 / 2
    let quadratic = if far { unit * (steps + 4.0) / 2.0 } else { 0.0 };
    [constant, unit * (steps + 6.0) * tile.norm, quadratic]
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
