//! A batch of queries over all tiles of a machine, on the instruction set chosen at run time.

use super::exp::{ExactExp, Exp, ExpMethod, PolynomialExp, TableExp};
use super::kernel::{Head, KernelParameters, PolynomialHead, RbfHead, SigmoidHead, sum_rows};
use super::packed::{Packed, Tile};
use super::simd::{Job, Real, Simd, portable};
#[cfg(target_arch = "x86_64")]
use super::simd::{avx2, avx512};
use std::marker::PhantomData;

/// The vector instructions that an evaluator uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum InstructionSet {
    /// What the compiler makes of plain Rust for the target.
    Portable,
    /// AVX2 with FMA.
    Avx2,
    /// AVX-512 F.
    Avx512,
}

impl InstructionSet {
    /// All instruction sets, the fastest last.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// Whether this machine has it.
    #[must_use]
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::is_available(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => avx512::is_available(),
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// The fastest that this machine has.
    #[must_use]
    pub fn best() -> Self {
        Self::ALL.into_iter().rev().find(|i| i.is_available()).unwrap_or(Self::Portable)
    }

    /// Chains of multiply-adds that the kernels use on it.
    pub(crate) fn chains(self) -> usize {
        match self {
            Self::Avx512 => 4,
            Self::Avx2 | Self::Portable => 2,
        }
    }

    /// A name for tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        }
    }
}

/// The kernel function of a batch.
#[derive(Clone, Copy, Debug)]
pub(crate) enum HeadKind {
    /// RBF with inner products; exponents that can fall below the range are clamped.
    RbfClamped,
    /// RBF with inner products; the caller has made sure that exponents stay in the range.
    RbfNear,
    /// RBF with differences, clamped; the factor of the squared distance.
    RbfDifferences(f64),
    /// Polynomial of this degree.
    Polynomial(u32),
    /// Sigmoid.
    Sigmoid,
}

/// Sum over the vectors for one query, and the bound of its error.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sum {
    /// Positive minus negative tiles.
    pub(crate) value: f64,
    /// Sum of all tiles' magnitudes.
    pub(crate) magnitude: f64,
    /// Sum of the tiles' errors.
    pub(crate) error: f64,
}

/// Queries in the precision of the vectors, and where their sums go.
pub(crate) struct Batch<'a, R> {
    /// `n * features`
    pub(crate) queries: &'a [R],
    /// Start value of each query.
    pub(crate) starts: &'a [R],
    /// What [`TileError`] wants to know of each query.
    pub(crate) norms: &'a [f64],
    /// One a query; zeroed here.
    pub(crate) sums: &'a mut [Sum],
}

/// Relative error of a tile's sum, as a function of the query's norm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileError {
    /// Constant, linear and quadratic part, in units of the precision, of a tile.
    pub(crate) coefficients: [f64; 3],
}

impl TileError {
    /// The bound for a query of this norm; infinite where it would be useless.
    #[inline(always)]
    pub(crate) fn relative(&self, norm: f64) -> f64 {
        let [constant, linear, quadratic] = self.coefficients;
        let e = constant + norm * (linear + norm * quadratic);
        // The sum it multiplies has this error itself; second orders are below a hundredth of it.
        if e < 0.01 { e * 1.02 } else { f64::INFINITY }
    }
}

struct Tiles<'a, 'b, R: Real, H, const FEATURES: usize> {
    packed: &'a Packed<R>,
    errors: &'a [TileError],
    parameters: KernelParameters,
    batch: Batch<'b, R>,
    head: PhantomData<H>,
}

impl<S: Simd, H: Head<S>, const FEATURES: usize> Job<S> for Tiles<'_, '_, S::Real, H, FEATURES> {
    #[inline(always)]
    fn run(self, simd: S) {
        let head = H::new(simd, self.parameters);
        let features = self.packed.features;
        let Batch { queries, starts, norms, sums } = self.batch;
        sums.fill(Sum::default());
        for (tile, error) in self.packed.tiles.iter().zip(self.errors) {
            let rows = &self.packed.rows[tile.rows.clone()];
            let each = queries.chunks_exact(features).zip(starts).zip(norms).zip(&mut *sums);
            for (((query, &start), &norm), sum) in each {
                let value = sum_rows::<S, H, FEATURES>(simd, head, rows, query, start);
                let value = tile.factor * value;
                sum.value += value;
                sum.magnitude += value.abs();
                sum.error += value.abs() * error.relative(norm);
            }
        }
    }
}

/// A packed machine and everything that its sums depend on but the queries.
pub(crate) struct Plan<'a, R: Real> {
    pub(crate) packed: &'a Packed<R>,
    pub(crate) errors: &'a [TileError],
    pub(crate) head: HeadKind,
    pub(crate) exp: ExpMethod,
}

fn run<S: Simd, H: Head<S>>(simd: S, plan: &Plan<'_, S::Real>, batch: Batch<'_, S::Real>) {
    let mut parameters = KernelParameters::default();
    match plan.head {
        HeadKind::RbfDifferences(factor) => parameters.factor = factor,
        HeadKind::Polynomial(degree) => parameters.degree = degree,
        HeadKind::RbfClamped | HeadKind::RbfNear | HeadKind::Sigmoid => {}
    }
    let Plan { packed, errors, .. } = *plan;
    // 4 and 8 features are compiled on their own; others go by loops of four.
    match packed.features {
        4 => simd.run(Tiles::<_, H, 4> { packed, errors, parameters, batch, head: PhantomData }),
        8 => simd.run(Tiles::<_, H, 8> { packed, errors, parameters, batch, head: PhantomData }),
        _ => simd.run(Tiles::<_, H, 0> { packed, errors, parameters, batch, head: PhantomData }),
    }
}

fn with_exp<S: Simd, E: Exp<S>>(simd: S, plan: &Plan<'_, S::Real>, batch: Batch<'_, S::Real>) {
    match plan.head {
        HeadKind::RbfClamped => run::<S, RbfHead<S, E, true, false>>(simd, plan, batch),
        HeadKind::RbfNear => run::<S, RbfHead<S, E, false, false>>(simd, plan, batch),
        HeadKind::RbfDifferences(_) => run::<S, RbfHead<S, E, true, true>>(simd, plan, batch),
        HeadKind::Polynomial(_) => run::<S, PolynomialHead<S>>(simd, plan, batch),
        HeadKind::Sigmoid => run::<S, SigmoidHead<S, E>>(simd, plan, batch),
    }
}

/// `2^t`'s methods in f32: the table with 32 entries is for degree 2, that with 8 for degree 3.
fn run_f32<S: Simd<Real = f32>, const DEGREE: usize, const COARSE: usize>(
    simd: S,
    plan: &Plan<'_, f32>,
    batch: Batch<'_, f32>,
) {
    match plan.exp {
        ExpMethod::Table => with_exp::<S, TableExp<S, DEGREE>>(simd, plan, batch),
        ExpMethod::CoarseTable => with_exp::<S, TableExp<S, COARSE>>(simd, plan, batch),
        ExpMethod::Polynomial3 => with_exp::<S, PolynomialExp<S, 3>>(simd, plan, batch),
        ExpMethod::Polynomial4 => with_exp::<S, PolynomialExp<S, 4>>(simd, plan, batch),
        ExpMethod::Polynomial5 => with_exp::<S, PolynomialExp<S, 5>>(simd, plan, batch),
        ExpMethod::Polynomial6 => with_exp::<S, PolynomialExp<S, 6>>(simd, plan, batch),
        ExpMethod::Exact => with_exp::<S, ExactExp>(simd, plan, batch),
    }
}

/// Evaluates a batch in f32.
pub(crate) fn sums_f32(set: InstructionSet, plan: &Plan<'_, f32>, batch: Batch<'_, f32>) {
    match set {
        // SAFETY: InstructionSet values other than Portable are only used after is_available() (Evaluator::compile).
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => run_f32::<_, 2, 1>(unsafe { avx512::Avx512F32::new() }, plan, batch),
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => run_f32::<_, 3, 2>(unsafe { avx2::Avx2F32::new() }, plan, batch),
        _ => run_f32::<_, 2, 1>(portable::PortableF32, plan, batch),
    }
}

/// Evaluates a batch in f64; always by the table of 16 entries.
pub(crate) fn sums_f64(set: InstructionSet, plan: &Plan<'_, f64>, batch: Batch<'_, f64>) {
    fn table<S: Simd<Real = f64>>(simd: S, plan: &Plan<'_, f64>, batch: Batch<'_, f64>) {
        match plan.head {
            HeadKind::Polynomial(_) => run::<S, PolynomialHead<S>>(simd, plan, batch),
            HeadKind::Sigmoid => run::<S, SigmoidHead<S, TableExp<S, 5>>>(simd, plan, batch),
            HeadKind::RbfClamped | HeadKind::RbfNear => {
                run::<S, RbfHead<S, TableExp<S, 5>, true, false>>(simd, plan, batch);
            }
            HeadKind::RbfDifferences(_) => {
                run::<S, RbfHead<S, TableExp<S, 5>, true, true>>(simd, plan, batch);
            }
        }
    }
    match set {
        // SAFETY: InstructionSet values other than Portable are only used after is_available() (Evaluator::compile).
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => table(unsafe { avx512::Avx512F64::new() }, plan, batch),
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => table(unsafe { avx2::Avx2F64::new() }, plan, batch),
        _ => table(portable::PortableF64, plan, batch),
    }
}

/// Largest relative error of a power of two by this method on this instruction set, in f32.
pub(crate) fn exp_error(set: InstructionSet, method: ExpMethod) -> f64 {
    fn of<S: Simd<Real = f32>, const DEGREE: usize, const COARSE: usize>(method: ExpMethod) -> f64 {
        match method {
            ExpMethod::Table => <TableExp<S, DEGREE> as Exp<S>>::relative_error(),
            ExpMethod::CoarseTable => <TableExp<S, COARSE> as Exp<S>>::relative_error(),
            ExpMethod::Polynomial3 => <PolynomialExp<S, 3> as Exp<S>>::relative_error(),
            ExpMethod::Polynomial4 => <PolynomialExp<S, 4> as Exp<S>>::relative_error(),
            ExpMethod::Polynomial5 => <PolynomialExp<S, 5> as Exp<S>>::relative_error(),
            ExpMethod::Polynomial6 => <PolynomialExp<S, 6> as Exp<S>>::relative_error(),
            ExpMethod::Exact => <ExactExp as Exp<S>>::relative_error(),
        }
    }
    match set {
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => of::<avx512::Avx512F32, 2, 1>(method),
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => of::<avx2::Avx2F32, 3, 2>(method),
        _ => of::<portable::PortableF32, 2, 1>(method),
    }
}

/// The same in f64: of the polynomial, and 4 units for roundings.
pub(crate) const EXP_ERROR_F64: f64 = 4.5e-15 + 2.0 * f64::EPSILON;

/// Number of tiles' error terms, made by the caller.
pub(crate) fn tile_errors(tiles: &[Tile], error: impl Fn(&Tile) -> [f64; 3]) -> Vec<TileError> {
    tiles.iter().map(|tile| TileError { coefficients: error(tile) }).collect()
}
