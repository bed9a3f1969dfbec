//! AVX-512 (F): 16 lanes of f32 or 8 of f64 in one register, tables of 32 and 16 entries in two registers.

use super::{Job, Row, Simd, table_f32, table_f64};
use std::arch::x86_64::*;

/// Proof that this machine has AVX-512 F; f32 lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx512F32(());

/// Proof that this machine has AVX-512 F; f64 lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx512F64(());

/// Whether this machine has AVX-512 F.
pub(crate) fn is_available() -> bool {
    is_x86_feature_detected!("avx512f")
}

impl Avx512F32 {
    /// # Safety
    /// [`is_available`] must have said true.
    pub(crate) unsafe fn new() -> Self {
        Self(())
    }
}

impl Avx512F64 {
    /// # Safety
    /// [`is_available`] must have said true.
    pub(crate) unsafe fn new() -> Self {
        Self(())
    }
}

/// An intrinsic of AVX-512 F.
macro_rules! avx512 {
    ($e:expr) => {
        // SAFETY: the token `self` exists, so the machine has AVX-512 F; pointers come from references to 64 aligned bytes.
        unsafe { $e }
    };
}

/// The lanes' sum by halves.
///
/// # Safety
/// The machine must have AVX-512 F.
#[inline(always)]
unsafe fn halves(a: __m512d) -> f64 {
    // SAFETY: as promised by the caller.
    unsafe {
        let a = _mm256_add_pd(_mm512_castpd512_pd256(a), _mm512_extractf64x4_pd::<1>(a));
        let a = _mm_add_pd(_mm256_castpd256_pd128(a), _mm256_extractf128_pd::<1>(a));
        _mm_cvtsd_f64(_mm_add_sd(a, _mm_unpackhi_pd(a, a)))
    }
}

impl Simd for Avx512F32 {
    type Real = f32;
    type V = __m512;
    type Table = (__m512i, __m512i);
    const TABLE_BITS: u32 = 5;
    const CHAINS: usize = 4;

    #[inline(always)]
    fn set(self, x: f32) -> __m512 {
        avx512!(_mm512_set1_ps(x))
    }
    #[inline(always)]
    fn load(self, row: &Row<f32, 16>) -> __m512 {
        avx512!(_mm512_load_ps(row.0.as_ptr()))
    }
    #[cfg(test)]
    #[inline(always)]
    fn store(self, a: __m512, out: &mut [f32]) {
        assert_eq!(out.len(), 16);
        avx512!(_mm512_storeu_ps(out.as_mut_ptr(), a));
    }
    #[inline(always)]
    fn mul_add(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        avx512!(_mm512_fmadd_ps(a, b, c))
    }
    #[inline(always)]
    fn neg_mul_add(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        avx512!(_mm512_fnmadd_ps(a, b, c))
    }
    #[inline(always)]
    fn add(self, a: __m512, b: __m512) -> __m512 {
        avx512!(_mm512_add_ps(a, b))
    }
    #[inline(always)]
    fn sub(self, a: __m512, b: __m512) -> __m512 {
        avx512!(_mm512_sub_ps(a, b))
    }
    #[inline(always)]
    fn mul(self, a: __m512, b: __m512) -> __m512 {
        avx512!(_mm512_mul_ps(a, b))
    }
    #[inline(always)]
    fn div(self, a: __m512, b: __m512) -> __m512 {
        avx512!(_mm512_div_ps(a, b))
    }
    #[inline(always)]
    fn max(self, a: __m512, b: __m512) -> __m512 {
        avx512!(_mm512_max_ps(a, b))
    }
    #[inline(always)]
    fn min(self, a: __m512, b: __m512) -> __m512 {
        avx512!(_mm512_min_ps(a, b))
    }
    #[inline(always)]
    fn table(self) -> Self::Table {
        let table = table_f32::<32>();
        avx512!((_mm512_loadu_si512(table.as_ptr().cast()), _mm512_loadu_si512(table[16..].as_ptr().cast())))
    }
    #[inline(always)]
    fn table_power(self, table: Self::Table, u: __m512) -> __m512 {
        avx512!({
            let n = _mm512_castps_si512(u);
            let entry = _mm512_permutex2var_epi32(table.0, n, table.1);
            _mm512_castsi512_ps(_mm512_add_epi32(entry, _mm512_slli_epi32::<18>(n)))
        })
    }
    #[inline(always)]
    fn scale(self, p: __m512, u: __m512) -> __m512 {
        avx512!({
            let n = _mm512_slli_epi32::<23>(_mm512_castps_si512(u));
            _mm512_castsi512_ps(_mm512_add_epi32(_mm512_castps_si512(p), n))
        })
    }
    #[inline(always)]
    fn map(self, a: __m512, f: impl Fn(f64) -> f64) -> __m512 {
        let mut lanes = Row([0.0_f32; 16]);
        avx512!(_mm512_store_ps(lanes.0.as_mut_ptr(), a));
        for x in &mut lanes.0 {
            *x = f(f64::from(*x)) as f32;
        }
        self.load(&lanes)
    }
    #[inline(always)]
    fn sum(self, a: __m512) -> f64 {
        avx512!({
            let high = _mm256_castpd_ps(_mm512_extractf64x4_pd::<1>(_mm512_castps_pd(a)));
            halves(_mm512_add_pd(_mm512_cvtps_pd(_mm512_castps512_ps256(a)), _mm512_cvtps_pd(high)))
        })
    }
    #[inline(always)]
    fn run<J: Job<Self>>(self, job: J) {
        #[target_feature(enable = "avx512f")]
        fn compiled<J: Job<Avx512F32>>(simd: Avx512F32, job: J) {
            job.run(simd);
        }
        avx512!(compiled(self, job));
    }
}

impl Simd for Avx512F64 {
    type Real = f64;
    type V = __m512d;
    type Table = (__m512i, __m512i);
    const TABLE_BITS: u32 = 4;
    const CHAINS: usize = 4;

    #[inline(always)]
    fn set(self, x: f64) -> __m512d {
        avx512!(_mm512_set1_pd(x))
    }
    #[inline(always)]
    fn load(self, row: &Row<f64, 8>) -> __m512d {
        avx512!(_mm512_load_pd(row.0.as_ptr()))
    }
    #[cfg(test)]
    #[inline(always)]
    fn store(self, a: __m512d, out: &mut [f64]) {
        assert_eq!(out.len(), 8);
        avx512!(_mm512_storeu_pd(out.as_mut_ptr(), a));
    }
    #[inline(always)]
    fn mul_add(self, a: __m512d, b: __m512d, c: __m512d) -> __m512d {
        avx512!(_mm512_fmadd_pd(a, b, c))
    }
    #[inline(always)]
    fn neg_mul_add(self, a: __m512d, b: __m512d, c: __m512d) -> __m512d {
        avx512!(_mm512_fnmadd_pd(a, b, c))
    }
    #[inline(always)]
    fn add(self, a: __m512d, b: __m512d) -> __m512d {
        avx512!(_mm512_add_pd(a, b))
    }
    #[inline(always)]
    fn sub(self, a: __m512d, b: __m512d) -> __m512d {
        avx512!(_mm512_sub_pd(a, b))
    }
    #[inline(always)]
    fn mul(self, a: __m512d, b: __m512d) -> __m512d {
        avx512!(_mm512_mul_pd(a, b))
    }
    #[inline(always)]
    fn div(self, a: __m512d, b: __m512d) -> __m512d {
        avx512!(_mm512_div_pd(a, b))
    }
    #[inline(always)]
    fn max(self, a: __m512d, b: __m512d) -> __m512d {
        avx512!(_mm512_max_pd(a, b))
    }
    #[inline(always)]
    fn min(self, a: __m512d, b: __m512d) -> __m512d {
        avx512!(_mm512_min_pd(a, b))
    }
    #[inline(always)]
    fn table(self) -> Self::Table {
        let table = table_f64::<16>();
        avx512!((_mm512_loadu_si512(table.as_ptr().cast()), _mm512_loadu_si512(table[8..].as_ptr().cast())))
    }
    #[inline(always)]
    fn table_power(self, table: Self::Table, u: __m512d) -> __m512d {
        avx512!({
            let n = _mm512_castpd_si512(u);
            let entry = _mm512_permutex2var_epi64(table.0, n, table.1);
            _mm512_castsi512_pd(_mm512_add_epi64(entry, _mm512_slli_epi64::<48>(n)))
        })
    }
    #[inline(always)]
    fn scale(self, p: __m512d, u: __m512d) -> __m512d {
        avx512!({
            let n = _mm512_slli_epi64::<52>(_mm512_castpd_si512(u));
            _mm512_castsi512_pd(_mm512_add_epi64(_mm512_castpd_si512(p), n))
        })
    }
    #[inline(always)]
    fn map(self, a: __m512d, f: impl Fn(f64) -> f64) -> __m512d {
        let mut lanes = Row([0.0_f64; 8]);
        avx512!(_mm512_store_pd(lanes.0.as_mut_ptr(), a));
        for x in &mut lanes.0 {
            *x = f(*x);
        }
        self.load(&lanes)
    }
    #[inline(always)]
    fn sum(self, a: __m512d) -> f64 {
        avx512!(halves(a))
    }
    #[inline(always)]
    fn run<J: Job<Self>>(self, job: J) {
        #[target_feature(enable = "avx512f")]
        fn compiled<J: Job<Avx512F64>>(simd: Avx512F64, job: J) {
            job.run(simd);
        }
        avx512!(compiled(self, job));
    }
}
