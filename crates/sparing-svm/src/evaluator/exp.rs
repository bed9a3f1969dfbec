//! Powers of two, three ways: a table with interpolation, a polynomial with exponent arithmetic, the library's.
//!
//! All split `t = N / 2^b + r` with N an integer and `|r| <= 2^-(b+1)` by adding and subtracting `1.5 * 2^(m - b)`
//! (m the mantissa's bits): the sum's low bits are N, and both subtractions are exact (Sterbenz). A minimax
//! polynomial of `2^r` (Remez, relative error) then meets `2^(N / 2^b)`, which comes from a table in registers and an
//! integer addition to the exponent, or from the exponent alone (b = 0).

use super::simd::portable::TABLE_F64;
use super::simd::{Real, Simd};

/// How the evaluator computes exponentials in f32.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ExpMethod {
    /// A table in registers (32 entries and a quadratic; with AVX2, 8 entries and a cubic): the fastest here, and
    /// as accurate as f32 allows.
    #[default]
    Table,
    /// The same tables, one degree less.
    CoarseTable,
    /// A polynomial of degree 3.
    Polynomial3,
    /// A polynomial of degree 4.
    Polynomial4,
    /// A polynomial of degree 5.
    Polynomial5,
    /// A polynomial of degree 6.
    Polynomial6,
    /// The standard library's, in f64, one by one: slow, for comparisons.
    Exact,
}

impl ExpMethod {
    /// All methods.
    pub const ALL: [Self; 7] = [
        Self::Table,
        Self::CoarseTable,
        Self::Polynomial3,
        Self::Polynomial4,
        Self::Polynomial5,
        Self::Polynomial6,
        Self::Exact,
    ];

    /// A name for tables and options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Table => "table",
            Self::CoarseTable => "coarse-table",
            Self::Polynomial3 => "polynomial-3",
            Self::Polynomial4 => "polynomial-4",
            Self::Polynomial5 => "polynomial-5",
            Self::Polynomial6 => "polynomial-6",
            Self::Exact => "exact",
        }
    }
}

/// A minimax polynomial of `2^r` for `|r| <= 2^-(table_bits + 1)`.
struct Minimax {
    table_bits: u32,
    /// Constant first.
    coefficients: &'static [f64],
    /// Largest relative error of the polynomial itself.
    error: f64,
}

/// By the Remez algorithm in 40 digits; the tests measure the errors again.
const MINIMAX: [Minimax; 9] = [
    Minimax {
        table_bits: 0,
        coefficients: &[
            0.999_928_073_535_159_7,
            0.693_260_985_454_245_7,
            0.242_611_122_223_753_24,
            0.055_171_669_092_611_66,
        ],
        error: 7.479e-5,
    },
    Minimax {
        table_bits: 0,
        coefficients: &[
            0.999_999_261_446_931_2,
            0.693_121_814_742_988_7,
            0.240_247_448_249_916_9,
            0.055_917_860_306_325_65,
            0.009_570_102_014_629_326,
        ],
        error: 2.594e-6,
    },
    Minimax {
        table_bits: 0,
        coefficients: &[
            1.000_000_071_654_641_6,
            0.693_146_967_065_264_9,
            0.240_221_197_239_691_8,
            0.055_507_132_728_753_91,
            0.009_675_541_331_021_39,
            0.001_327_647_216_781_994_3,
        ],
        error: 7.495e-8,
    },
    Minimax {
        table_bits: 0,
        coefficients: &[
            1.000_000_000_554_166_3,
            0.693_147_205_737_252_7,
            0.240_226_468_906_395_7,
            0.055_503_287_769_976_64,
            0.009_618_488_956_522_792,
            0.001_339_993_120_947_414,
            0.000_153_458_121_587_401_82,
        ],
        error: 1.857e-9,
    },
    Minimax {
        table_bits: 3,
        coefficients: &[1.000_000_110_041_533_6, 0.693_309_764_504_939_7, 0.240_198_330_232_845_3],
        error: 3.388e-6,
    },
    Minimax {
        table_bits: 3,
        coefficients: &[
            0.999_999_981_667_269_2,
            0.693_147_208_532_190_4,
            0.240_264_072_900_063_78,
            0.055_498_900_387_904_02,
        ],
        error: 1.835e-8,
    },
    Minimax {
        table_bits: 5,
        coefficients: &[1.000_029_323_569_658_6, 0.693_140_404_970_867_1],
        error: 2.933e-5,
    },
    Minimax {
        table_bits: 5,
        coefficients: &[1.000_000_000_429_956_7, 0.693_157_343_565_207_7, 0.240_224_745_832_476_9],
        error: 5.294e-8,
    },
    Minimax {
        table_bits: 4,
        coefficients: &[
            1.000_000_000_000_004_5,
            0.693_147_180_559_932_4,
            0.240_226_506_876_476_1,
            0.055_504_108_711_187_64,
            0.009_618_354_739_877_932,
            0.001_333_333_471_015_927_2,
        ],
        error: 4.5e-15,
    },
];

fn minimax(table_bits: u32, degree: usize) -> &'static Minimax {
    let found = MINIMAX.iter().find(|m| m.table_bits == table_bits && m.coefficients.len() == degree + 1);
    found.unwrap_or(&MINIMAX[3])
}

/// A way to add `2^t` to a sum; a value of it holds the constants in registers.
pub(crate) trait Exp<S: Simd>: Copy {
    /// Loads the constants.
    fn new(simd: S) -> Self;
    /// `sum + 2^t` for `t` from [`Real::MIN_EXPONENT`] to 126; NaN for NaN.
    fn add_power(self, simd: S, t: S::V, sum: S::V) -> S::V;
    /// Largest relative error of the power, the rounding of the sum not counted.
    fn relative_error() -> f64;
}

/// Adding it leaves the integer part of `2^bits t` in the low bits of the mantissa.
fn magic<S: Simd>(bits: u32) -> S::Real {
    S::Real::from_f64(1.5 * 2_f64.powi((S::Real::MANTISSA_BITS - bits) as i32))
}

const MAX_DEGREE: usize = 6;

#[inline(always)]
fn horner<S: Simd, const DEGREE: usize>(simd: S, c: &[S::V; MAX_DEGREE + 1], r: S::V) -> S::V {
    let mut p = c[DEGREE];
    let mut i = DEGREE;
    while i > 0 {
        i -= 1;
        p = simd.mul_add(p, r, c[i]);
    }
    p
}

#[inline(always)]
fn load_coefficients<S: Simd>(simd: S, m: &Minimax) -> [S::V; MAX_DEGREE + 1] {
    let mut c = [simd.set(S::Real::from_f64(0.0)); MAX_DEGREE + 1];
    for (c, &value) in c.iter_mut().zip(m.coefficients) {
        *c = simd.set(S::Real::from_f64(value));
    }
    c
}

/// Table of the instruction set, and a polynomial.
#[derive(Clone, Copy)]
pub(crate) struct TableExp<S: Simd, const DEGREE: usize> {
    magic: S::V,
    coefficients: [S::V; MAX_DEGREE + 1],
    table: S::Table,
}

impl<S: Simd, const DEGREE: usize> Exp<S> for TableExp<S, DEGREE> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        let coefficients = load_coefficients(simd, minimax(S::TABLE_BITS, DEGREE));
        Self { magic: simd.set(magic::<S>(S::TABLE_BITS)), coefficients, table: simd.table() }
    }

    #[inline(always)]
    fn add_power(self, simd: S, t: S::V, sum: S::V) -> S::V {
        let u = simd.add(t, self.magic);
        let r = simd.sub(t, simd.sub(u, self.magic));
        let p = horner::<S, DEGREE>(simd, &self.coefficients, r);
        simd.mul_add(p, simd.table_power(self.table, u), sum)
    }

    // Roundings: of the table's entry and of the polynomial's last operation, 1 unit each; all before act on
    // terms below 0.05; the product is rounded once more where it is not fused. 4 units cover them.
    fn relative_error() -> f64 {
        minimax(S::TABLE_BITS, DEGREE).error + 4.0 * S::Real::UNIT
    }
}

/// A polynomial, the integer part added to the exponent.
#[derive(Clone, Copy)]
pub(crate) struct PolynomialExp<S: Simd, const DEGREE: usize> {
    magic: S::V,
    coefficients: [S::V; MAX_DEGREE + 1],
}

impl<S: Simd, const DEGREE: usize> Exp<S> for PolynomialExp<S, DEGREE> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        Self { magic: simd.set(magic::<S>(0)), coefficients: load_coefficients(simd, minimax(0, DEGREE)) }
    }

    #[inline(always)]
    fn add_power(self, simd: S, t: S::V, sum: S::V) -> S::V {
        let u = simd.add(t, self.magic);
        let r = simd.sub(t, simd.sub(u, self.magic));
        let p = horner::<S, DEGREE>(simd, &self.coefficients, r);
        simd.add(sum, simd.scale(p, u))
    }

    // Horner's rule with |r| <= 1/2: 1 unit of the last operation, less than half of it from each one before, as
    // much again where products are not fused, and as much from rounded coefficients: below 5 units of 1, and the
    // power is at least 0.707.
    fn relative_error() -> f64 {
        minimax(0, DEGREE).error + 7.0 * S::Real::UNIT
    }
}

/// The standard library's exponential in f64, lane by lane.
#[derive(Clone, Copy)]
pub(crate) struct ExactExp;

impl<S: Simd> Exp<S> for ExactExp {
    #[inline(always)]
    fn new(_simd: S) -> Self {
        Self
    }

    #[inline(always)]
    fn add_power(self, simd: S, t: S::V, sum: S::V) -> S::V {
        simd.add(sum, simd.map(t, f64::exp2))
    }

    fn relative_error() -> f64 {
        2.0 * S::Real::UNIT
    }
}

/// `2^t` in f64 for `t` from -1000 to 0, within [`super::run::EXP_ERROR_F64`]; a few operations, for a number a query.
#[inline(always)]
pub(crate) fn power_of_two(t: f64) -> f64 {
    let c = MINIMAX[8].coefficients;
    let magic = 1.5 * (1_u64 << 48) as f64;
    let u = t + magic;
    let r = t - (u - magic);
    let p = c[0] + r * (c[1] + r * (c[2] + r * (c[3] + r * (c[4] + r * c[5]))));
    let n = u.to_bits();
    let entry = TABLE_F64[(n & 15) as usize] as u64;
    p * f64::from_bits(entry.wrapping_add(n << 48))
}
