//! The few vector operations that the evaluator needs, for each instruction set and precision.
//!
//! The kernels in [`super::kernel`] are written once, over [`Simd`]. An implementor is a token that only exists where
//! its instructions do, so the methods are safe to call; they are all inlined into a function compiled for
//! that instruction set ([`super::dispatch`]).

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2;
#[cfg(target_arch = "x86_64")]
pub(crate) mod avx512;
pub(crate) mod portable;

/// f32 or f64: the precision of a kernel.
pub(crate) trait Real: Copy + Send + Sync + 'static + PartialOrd {
    /// Bits of the mantissa that are stored.
    const MANTISSA_BITS: u32;
    /// Half the distance from 1 to the next number: the largest relative error of one rounding.
    const UNIT: f64;
    /// Smallest normal number: no operation that underflows is off by more.
    const TINY: f64;
    /// Smallest exponent that the exponentials are computed for, a few above the smallest normal number's; smaller
    /// ones give `2^MIN_EXPONENT`, so no denormal number ever comes up.
    const MIN_EXPONENT: f64;
    /// The row of one feature of [`Simd::LANES`] support vectors: 64 bytes, aligned to them.
    type Row: Copy + Send + Sync + 'static;
    /// The number nearest to `x`.
    fn from_f64(x: f64) -> Self;
    /// The same number in f64.
    #[cfg(test)]
    fn to_f64(self) -> f64;
    /// A row from as many numbers as there are lanes.
    fn row(lanes: &[Self]) -> Self::Row;
    /// Lanes of a row.
    const LANES: usize;
}

/// 64 bytes of numbers, aligned to a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Row<T, const N: usize>(pub(crate) [T; N]);

impl Real for f32 {
    const MANTISSA_BITS: u32 = 23;
    const UNIT: f64 = f32::EPSILON as f64 / 2.0;
    const TINY: f64 = f32::MIN_POSITIVE as f64;
    const MIN_EXPONENT: f64 = -125.0;
    const LANES: usize = 16;
    type Row = Row<f32, 16>;
    fn from_f64(x: f64) -> Self {
        x as f32
    }
    #[cfg(test)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    fn row(lanes: &[Self]) -> Self::Row {
        let mut row = [0.0; 16];
        row.copy_from_slice(lanes);
        Row(row)
    }
}

impl Real for f64 {
    const MANTISSA_BITS: u32 = 52;
    const UNIT: f64 = f64::EPSILON / 2.0;
    const TINY: f64 = f64::MIN_POSITIVE;
    const MIN_EXPONENT: f64 = -1020.0;
    const LANES: usize = 8;
    type Row = Row<f64, 8>;
    fn from_f64(x: f64) -> Self {
        x
    }
    #[cfg(test)]
    fn to_f64(self) -> f64 {
        self
    }
    fn row(lanes: &[Self]) -> Self::Row {
        let mut row = [0.0; 8];
        row.copy_from_slice(lanes);
        Row(row)
    }
}

/// A row of numbers in registers, and what can be done with it.
///
/// All operations act lane by lane and round to nearest, as IEEE 754 says.
pub(crate) trait Simd: Copy {
    /// The precision.
    type Real: Real;
    /// A row in registers.
    type V: Copy;
    /// The table of `2^(j / 2^TABLE_BITS)` in registers, or where it is.
    type Table: Copy;
    /// The table has `2^TABLE_BITS` entries.
    const TABLE_BITS: u32;
    /// Chains of multiply-adds within a group, 2 or 4: as many as hide the latency and fit the registers.
    const CHAINS: usize;

    /// All lanes the number `x`.
    fn set(self, x: Self::Real) -> Self::V;
    /// A row from memory.
    fn load(self, row: &<Self::Real as Real>::Row) -> Self::V;
    /// Writes the lanes; `out` has as many.
    #[cfg(test)]
    fn store(self, a: Self::V, out: &mut [Self::Real]);
    /// `a * b + c`, rounded once, or twice where the machine has no fused operation.
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    /// `c - a * b`, rounded as [`Simd::mul_add`].
    fn neg_mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    /// `a + b`
    fn add(self, a: Self::V, b: Self::V) -> Self::V;
    /// `a - b`
    fn sub(self, a: Self::V, b: Self::V) -> Self::V;
    /// `a * b`
    fn mul(self, a: Self::V, b: Self::V) -> Self::V;
    /// `a / b`
    fn div(self, a: Self::V, b: Self::V) -> Self::V;
    /// The larger of the two; `b` when either is NaN.
    fn max(self, a: Self::V, b: Self::V) -> Self::V;
    /// The smaller of the two; `b` when either is NaN.
    fn min(self, a: Self::V, b: Self::V) -> Self::V;
    /// The table, loaded.
    fn table(self) -> Self::Table;
    /// `2^(N / 2^TABLE_BITS)`, where N is the signed integer in the low bits of the mantissa of `u`.
    fn table_power(self, table: Self::Table, u: Self::V) -> Self::V;
    /// `p * 2^N` for `p` in `[0.5, 2)`, where N is the signed integer in the low bits of the mantissa of `u`.
    fn scale(self, p: Self::V, u: Self::V) -> Self::V;
    /// The numbers, changed one by one in f64: slow, for the exact exponential.
    fn map(self, a: Self::V, f: impl Fn(f64) -> f64) -> Self::V;
    /// The sum of all lanes in f64, in a fixed order that is the same for all instruction sets.
    fn sum(self, a: Self::V) -> f64;
    /// Runs `job` in a function compiled for this instruction set.
    fn run<J: Job<Self>>(self, job: J);
}

/// Work for [`Simd::run`]. Its body must be inlined.
pub(crate) trait Job<S: Simd> {
    /// Does the work.
    fn run(self, simd: S);
}

/// Sum in a fixed order, by halves.
#[inline(always)]
pub(crate) fn sum_lanes<const N: usize>(mut lanes: [f64; N]) -> f64 {
    let mut half = N / 2;
    while half > 0 {
        for i in 0..half {
            lanes[i] += lanes[i + half];
        }
        half /= 2;
    }
    lanes[0]
}

/// `bits(2^(j / 2^BITS)) - (j << (mantissa - BITS))`: adding `N << (mantissa - BITS)`, N = j modulo `2^BITS`, gives
/// the bits of `2^(N / 2^BITS)` without masks.
pub(crate) fn table_f32<const N: usize>() -> [i32; N] {
    std::array::from_fn(|j| {
        let value = (j as f64 / N as f64).exp2() as f32;
        (value.to_bits() as i32).wrapping_sub((j as i32) << (23 - N.ilog2()))
    })
}

/// [`table_f32`] in f64.
pub(crate) fn table_f64<const N: usize>() -> [i64; N] {
    std::array::from_fn(|j| {
        let value = (j as f64 / N as f64).exp2();
        (value.to_bits() as i64).wrapping_sub((j as i64) << (52 - N.ilog2()))
    })
}
