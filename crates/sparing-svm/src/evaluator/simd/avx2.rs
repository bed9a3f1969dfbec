//! AVX2 with FMA: a row in two registers, a table of 8 entries of f32 in one, one of 16 entries of f64 gathered.

use super::{Job, Row, Simd, table_f32, table_f64};
use std::arch::x86_64::*;
use std::sync::LazyLock;

/// Proof that this machine has AVX2 and FMA; f32 lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2F32(());

/// Proof that this machine has AVX2 and FMA; f64 lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2F64(());

/// Whether this machine has AVX2 and FMA.
pub(crate) fn is_available() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

impl Avx2F32 {
    /// # Safety
    /// [`is_available`] must have said true.
    pub(crate) unsafe fn new() -> Self {
        Self(())
    }
}

impl Avx2F64 {
    /// # Safety
    /// [`is_available`] must have said true.
    pub(crate) unsafe fn new() -> Self {
        Self(())
    }
}

static TABLE_F64: LazyLock<[i64; 16]> = LazyLock::new(table_f64::<16>);

/// An intrinsic of AVX2 or FMA.
macro_rules! avx2 {
    ($e:expr) => {
        // SAFETY: the token `self` exists, so the machine has AVX2 and FMA; pointers come from references to as many
        // aligned bytes as are read or written.
        unsafe { $e }
    };
}

/// One intrinsic for both halves of a row.
macro_rules! halves {
    ($intrinsic:ident, $($a:expr),+) => {
        avx2!(($intrinsic($($a.0),+), $intrinsic($($a.1),+)))
    };
}

/// The sum of eight lanes by halves.
///
/// # Safety
/// The machine must have AVX2.
#[inline(always)]
unsafe fn quarters(low: __m256d, high: __m256d) -> f64 {
    // SAFETY: as promised by the caller.
    unsafe {
        let a = _mm256_add_pd(low, high);
        let a = _mm_add_pd(_mm256_castpd256_pd128(a), _mm256_extractf128_pd::<1>(a));
        _mm_cvtsd_f64(_mm_add_sd(a, _mm_unpackhi_pd(a, a)))
    }
}

impl Simd for Avx2F32 {
    type Real = f32;
    type V = (__m256, __m256);
    type Table = __m256i;
    const TABLE_BITS: u32 = 3;
    const CHAINS: usize = 2;

    #[inline(always)]
    fn set(self, x: f32) -> Self::V {
        let x = avx2!(_mm256_set1_ps(x));
        (x, x)
    }
    #[inline(always)]
    fn load(self, row: &Row<f32, 16>) -> Self::V {
        avx2!((_mm256_load_ps(row.0.as_ptr()), _mm256_load_ps(row.0[8..].as_ptr())))
    }
    #[cfg(test)]
    #[inline(always)]
    fn store(self, a: Self::V, out: &mut [f32]) {
        out.copy_from_slice(&lanes_f32(self, a).0);
    }
    #[inline(always)]
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V {
        halves!(_mm256_fmadd_ps, a, b, c)
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V {
        halves!(_mm256_fnmadd_ps, a, b, c)
    }
    #[inline(always)]
    fn add(self, a: Self::V, b: Self::V) -> Self::V {
        halves!(_mm256_add_ps, a, b)
    }
    #[inline(always)]
    fn sub(self, a: Self::V, b: Self::V) -> Self::V {
        halves!(_mm256_sub_ps, a, b)
    }
    #[inline(always)]
    fn mul(self, a: Self::V, b: Self::V) -> Self::V {
        halves!(_mm256_mul_ps, a, b)
    }
    #[inline(always)]
    fn div(self, a: Self::V, b: Self::V) -> Self::V {
        halves!(_mm256_div_ps, a, b)
    }
    #[inline(always)]
    fn max(self, a: Self::V, b: Self::V) -> Self::V {
        halves!(_mm256_max_ps, a, b)
    }
    #[inline(always)]
    fn min(self, a: Self::V, b: Self::V) -> Self::V {
        halves!(_mm256_min_ps, a, b)
    }
    #[inline(always)]
    fn table(self) -> Self::Table {
        let table = table_f32::<8>();
        avx2!(_mm256_loadu_si256(table.as_ptr().cast()))
    }
    #[inline(always)]
    fn table_power(self, table: Self::Table, u: Self::V) -> Self::V {
        let power = |u: __m256| {
            avx2!({
                let n = _mm256_castps_si256(u);
                let entry = _mm256_permutevar8x32_epi32(table, n);
                _mm256_castsi256_ps(_mm256_add_epi32(entry, _mm256_slli_epi32::<20>(n)))
            })
        };
        (power(u.0), power(u.1))
    }
    #[inline(always)]
    fn scale(self, p: Self::V, u: Self::V) -> Self::V {
        let scale = |p: __m256, u: __m256| {
            avx2!({
                let n = _mm256_slli_epi32::<23>(_mm256_castps_si256(u));
                _mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(p), n))
            })
        };
        (scale(p.0, u.0), scale(p.1, u.1))
    }
    #[inline(always)]
    fn map(self, a: Self::V, f: impl Fn(f64) -> f64) -> Self::V {
        let mut lanes = lanes_f32(self, a);
        for x in &mut lanes.0 {
            *x = f(f64::from(*x)) as f32;
        }
        self.load(&lanes)
    }
    #[inline(always)]
    fn sum(self, a: Self::V) -> f64 {
        avx2!({
            let low = |x: __m256| _mm256_cvtps_pd(_mm256_castps256_ps128(x));
            let high = |x: __m256| _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(x));
            quarters(_mm256_add_pd(low(a.0), low(a.1)), _mm256_add_pd(high(a.0), high(a.1)))
        })
    }
    #[inline(always)]
    fn run<J: Job<Self>>(self, job: J) {
        #[target_feature(enable = "avx2,fma")]
        fn compiled<J: Job<Avx2F32>>(simd: Avx2F32, job: J) {
            job.run(simd);
        }
        avx2!(compiled(self, job));
    }
}

#[inline(always)]
fn lanes_f32(_has_avx2: Avx2F32, a: (__m256, __m256)) -> Row<f32, 16> {
    let mut lanes = Row([0.0_f32; 16]);
    avx2!({
        _mm256_store_ps(lanes.0.as_mut_ptr(), a.0);
        _mm256_store_ps(lanes.0[8..].as_mut_ptr(), a.1);
    });
    lanes
}

impl Simd for Avx2F64 {
    type Real = f64;
    type V = (__m256d, __m256d);
    type Table = &'static [i64; 16];
    const TABLE_BITS: u32 = 4;
    const CHAINS: usize = 2;

    #[inline(always)]
    fn set(self, x: f64) -> Self::V {
        let x = avx2!(_mm256_set1_pd(x));
        (x, x)
    }
    #[inline(always)]
    fn load(self, row: &Row<f64, 8>) -> Self::V {
        avx2!((_mm256_load_pd(row.0.as_ptr()), _mm256_load_pd(row.0[4..].as_ptr())))
    }
    #[cfg(test)]
    #[inline(always)]
    fn store(self, a: Self::V, out: &mut [f64]) {
        out.copy_from_slice(&lanes_f64(self, a).0);
    }
    #[inline(always)]
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V {
        halves!(_mm256_fmadd_pd, a, b, c)
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V {
        halves!(_mm256_fnmadd_pd, a, b, c)
    }
    #[inline(always)]
    fn add(self, a: Self::V, b: Self::V) -> Self::V {
        halves!(_mm256_add_pd, a, b)
    }
    #[inline(always)]
    fn sub(self, a: Self::V, b: Self::V) -> Self::V {
        halves!(_mm256_sub_pd, a, b)
    }
    #[inline(always)]
    fn mul(self, a: Self::V, b: Self::V) -> Self::V {
        halves!(_mm256_mul_pd, a, b)
    }
    #[inline(always)]
    fn div(self, a: Self::V, b: Self::V) -> Self::V {
        halves!(_mm256_div_pd, a, b)
    }
    #[inline(always)]
    fn max(self, a: Self::V, b: Self::V) -> Self::V {
        halves!(_mm256_max_pd, a, b)
    }
    #[inline(always)]
    fn min(self, a: Self::V, b: Self::V) -> Self::V {
        halves!(_mm256_min_pd, a, b)
    }
    #[inline(always)]
    fn table(self) -> Self::Table {
        &TABLE_F64
    }
    #[inline(always)]
    fn table_power(self, table: Self::Table, u: Self::V) -> Self::V {
        let power = |u: __m256d| {
            avx2!({
                let n = _mm256_castpd_si256(u);
                let index = _mm256_and_si256(n, _mm256_set1_epi64x(15));
                // The mask keeps all indices within the 16 entries.
                let entry = _mm256_i64gather_epi64::<8>(table.as_ptr(), index);
                _mm256_castsi256_pd(_mm256_add_epi64(entry, _mm256_slli_epi64::<48>(n)))
            })
        };
        (power(u.0), power(u.1))
    }
    #[inline(always)]
    fn scale(self, p: Self::V, u: Self::V) -> Self::V {
        let scale = |p: __m256d, u: __m256d| {
            avx2!({
                let n = _mm256_slli_epi64::<52>(_mm256_castpd_si256(u));
                _mm256_castsi256_pd(_mm256_add_epi64(_mm256_castpd_si256(p), n))
            })
        };
        (scale(p.0, u.0), scale(p.1, u.1))
    }
    #[inline(always)]
    fn map(self, a: Self::V, f: impl Fn(f64) -> f64) -> Self::V {
        let mut lanes = lanes_f64(self, a);
        for x in &mut lanes.0 {
            *x = f(*x);
        }
        self.load(&lanes)
    }
    #[inline(always)]
    fn sum(self, a: Self::V) -> f64 {
        avx2!(quarters(a.0, a.1))
    }
    #[inline(always)]
    fn run<J: Job<Self>>(self, job: J) {
        #[target_feature(enable = "avx2,fma")]
        fn compiled<J: Job<Avx2F64>>(simd: Avx2F64, job: J) {
            job.run(simd);
        }
        avx2!(compiled(self, job));
    }
}

#[inline(always)]
fn lanes_f64(_has_avx2: Avx2F64, a: (__m256d, __m256d)) -> Row<f64, 8> {
    let mut lanes = Row([0.0_f64; 8]);
    avx2!({
        _mm256_store_pd(lanes.0.as_mut_ptr(), a.0);
        _mm256_store_pd(lanes.0[4..].as_mut_ptr(), a.1);
    });
    lanes
}
