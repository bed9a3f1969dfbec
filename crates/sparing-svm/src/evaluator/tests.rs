//! The vector code against plain arithmetic: exponentials over all mantissas, operations lane by lane.

use super::exp::{ExactExp, Exp, ExpMethod, PolynomialExp, TableExp};
use super::kernel::{Head, KernelParameters, RbfHead};
use super::run::{EXP_ERROR_F64, InstructionSet, exp_error};
use super::simd::{Job, Real, Row, Simd, portable};
#[cfg(target_arch = "x86_64")]
use super::simd::{avx2, avx512};
use std::marker::PhantomData;

/// `2^t` of many numbers, sixteen at a time.
struct Powers<'a, R, E> {
    inputs: &'a [R],
    outputs: &'a mut [R],
    exp: PhantomData<E>,
}

impl<S: Simd, E: Exp<S>> Job<S> for Powers<'_, S::Real, E> {
    #[inline(always)]
    fn run(self, simd: S) {
        let exp = E::new(simd);
        let lanes = S::Real::LANES;
        let zero = simd.set(S::Real::from_f64(0.0));
        for (input, output) in self.inputs.chunks_exact(lanes).zip(self.outputs.chunks_exact_mut(lanes)) {
            let t = simd.load(&S::Real::row(input));
            simd.store(exp.add_power(simd, t, zero), output);
        }
    }
}

fn powers<S: Simd, E: Exp<S>>(simd: S, inputs: &[S::Real]) -> Vec<S::Real> {
    let mut outputs = vec![S::Real::from_f64(0.0); inputs.len()];
    simd.run(Powers { inputs, outputs: &mut outputs, exp: PhantomData::<E> });
    outputs
}

fn powers_f32(set: InstructionSet, method: ExpMethod, inputs: &[f32]) -> Vec<f32> {
    fn of<S: Simd<Real = f32>, const DEGREE: usize, const COARSE: usize>(
        simd: S,
        method: ExpMethod,
        inputs: &[f32],
    ) -> Vec<f32> {
        match method {
            ExpMethod::Table => powers::<S, TableExp<S, DEGREE>>(simd, inputs),
            ExpMethod::CoarseTable => powers::<S, TableExp<S, COARSE>>(simd, inputs),
            ExpMethod::Polynomial3 => powers::<S, PolynomialExp<S, 3>>(simd, inputs),
            ExpMethod::Polynomial4 => powers::<S, PolynomialExp<S, 4>>(simd, inputs),
            ExpMethod::Polynomial5 => powers::<S, PolynomialExp<S, 5>>(simd, inputs),
            ExpMethod::Polynomial6 => powers::<S, PolynomialExp<S, 6>>(simd, inputs),
            ExpMethod::Exact => powers::<S, ExactExp>(simd, inputs),
        }
    }
    match set {
        // SAFETY: callers ask available() first.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => of::<_, 2, 1>(unsafe { avx512::Avx512F32::new() }, method, inputs),
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => of::<_, 3, 2>(unsafe { avx2::Avx2F32::new() }, method, inputs),
        _ => of::<_, 2, 1>(portable::PortableF32, method, inputs),
    }
}

fn powers_f64(set: InstructionSet, inputs: &[f64]) -> Vec<f64> {
    fn of<S: Simd<Real = f64>>(simd: S, inputs: &[f64]) -> Vec<f64> {
        powers::<S, TableExp<S, 5>>(simd, inputs)
    }
    match set {
        // SAFETY: callers ask available() first.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => of(unsafe { avx512::Avx512F64::new() }, inputs),
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => of(unsafe { avx2::Avx2F64::new() }, inputs),
        _ => of(portable::PortableF64, inputs),
    }
}

fn available() -> impl Iterator<Item = InstructionSet> {
    InstructionSet::ALL.into_iter().filter(|s| s.is_available())
}

/// All numbers of [-1, -1/2): every mantissa, so every remainder and table entry. Then steps over the whole range.
fn inputs_f32() -> Vec<f32> {
    let mut inputs: Vec<f32> = (0..1_u32 << 23).map(|m| -f32::from_bits(0x3f00_0000 | m)).collect();
    let steps = 1 << 20;
    inputs.extend((0..steps).map(|i| -125.0 + 251.0 * i as f32 / steps as f32));
    inputs
}

#[test]
fn powers_of_two_in_f32_are_within_their_bounds_and_not_far_below() {
    let inputs = inputs_f32();
    let exact: Vec<f64> = inputs.iter().map(|&t| f64::from(t).exp2()).collect();
    for set in available() {
        for method in ExpMethod::ALL {
            let worst = powers_f32(set, method, &inputs)
                .iter()
                .zip(&exact)
                .map(|(&p, e)| (f64::from(p) / e - 1.0).abs())
                .fold(0.0, f64::max);
            let bound = exp_error(set, method);
            println!("{} {}: {worst:.3e}, bound {bound:.3e}", set.name(), method.name());
            assert!(worst <= bound, "{} {}: {worst:e} > {bound:e}", set.name(), method.name());
            assert!(worst >= bound / 8.0, "{} {}: the bound {bound:e} is loose", set.name(), method.name());
        }
    }
}

#[test]
fn powers_of_two_in_f64_are_within_their_bound() {
    let n = 1 << 20;
    let mut inputs: Vec<f64> = (0..n).map(|i| -1.0 + f64::from(i) / f64::from(n)).collect();
    inputs.extend((0..n).map(|i| -1020.0 + 1020.0 * f64::from(i) / f64::from(n)));
    for set in available() {
        let worst = powers_f64(set, &inputs)
            .iter()
            .zip(&inputs)
            .map(|(p, t)| (p / t.exp2() - 1.0).abs())
            .fold(0.0, f64::max);
        println!("{} f64: {worst:.3e}, bound {EXP_ERROR_F64:.3e}", set.name());
        assert!(worst <= EXP_ERROR_F64, "{}: {worst:e}", set.name());
    }
}

#[test]
fn powers_of_nan_are_nan() {
    for set in available() {
        for method in ExpMethod::ALL {
            assert!(
                powers_f32(set, method, &[f32::NAN; 16]).iter().all(|p| p.is_nan()),
                "{set:?} {method:?}"
            );
        }
        assert!(powers_f64(set, &[f64::NAN; 8]).iter().all(|p| p.is_nan()), "{set:?}");
    }
}

/// Clamped kernel values of exponents.
struct Clamped<'a> {
    input: &'a Row<f32, 16>,
    output: &'a mut [f32],
}

impl<S: Simd<Real = f32>> Job<S> for Clamped<'_> {
    #[inline(always)]
    fn run(self, simd: S) {
        let head = RbfHead::<S, PolynomialExp<S, 5>, true, false>::new(simd, KernelParameters::default());
        let (t, zero) = (simd.load(self.input), simd.set(0.0));
        simd.store(head.add(simd, t, zero, zero), self.output);
    }
}

#[test]
fn exponents_below_the_range_give_the_smallest_normal_powers_and_nan_stays() {
    let mut lanes = [0.0_f32; 16];
    lanes[..8].copy_from_slice(&[f32::NEG_INFINITY, f32::MIN, -1e30, -126.0, -125.5, -125.0, 0.0, f32::NAN]);
    for set in available() {
        let mut out = [0.0_f32; 16];
        let job = Clamped { input: &Row(lanes), output: &mut out };
        match set {
            // SAFETY: the set is available.
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => unsafe { avx512::Avx512F32::new() }.run(job),
            // SAFETY: the set is available.
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => unsafe { avx2::Avx2F32::new() }.run(job),
            _ => portable::PortableF32.run(job),
        }
        for (t, p) in lanes[..6].iter().zip(out) {
            assert!(p.is_normal() && p <= 2.4e-38, "{set:?}: 2^{t} = {p:e}");
        }
        assert!((out[6] - 1.0).abs() < 1e-6, "{set:?}");
        assert!(out[7].is_nan(), "{set:?}");
    }
}

/// Operations on rows of hostile numbers.
struct Operations<'a, R: Real> {
    rows: [&'a R::Row; 3],
    outputs: &'a mut Vec<Vec<R>>,
    sum: &'a mut f64,
}

impl<S: Simd> Job<S> for Operations<'_, S::Real> {
    #[inline(always)]
    fn run(self, simd: S) {
        let [a, b, c] = self.rows.map(|r| simd.load(r));
        let whole = S::Real::from_f64(1.5 * 2_f64.powi(S::Real::MANTISSA_BITS as i32) - 7.0);
        let results = [
            simd.add(a, b),
            simd.sub(a, b),
            simd.mul(a, b),
            simd.div(a, b),
            simd.max(a, b),
            simd.min(a, b),
            simd.scale(c, simd.set(whole)),
            simd.map(a, |x| x + 1.0),
        ];
        for v in results {
            let mut out = vec![S::Real::from_f64(0.0); S::Real::LANES];
            simd.store(v, &mut out);
            self.outputs.push(out);
        }
        *self.sum = simd.sum(c);
    }
}

const HOSTILE: [f64; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.5,
    3e38,
    f64::NAN,
    1e-42,
    f64::INFINITY,
    f64::NEG_INFINITY,
    1.2e-38,
    3.7e8,
    -2.5e-9,
    0.1,
    7.0,
    -1e20,
    1.000_000_1,
];

/// Bits of all results, in f64, NaN as one value.
fn operations<S: Simd>(simd: S) -> (Vec<u64>, u64) {
    let lanes = S::Real::LANES;
    let row = |f: &dyn Fn(usize) -> f64| {
        S::Real::row(&(0..lanes).map(|i| S::Real::from_f64(f(i))).collect::<Vec<_>>())
    };
    let rows = [row(&|i| HOSTILE[i]), row(&|i| HOSTILE[(i + 5) % 16]), row(&|i| 0.51 + 0.09 * i as f64)];
    let (mut outputs, mut sum) = (Vec::new(), 0.0);
    simd.run(Operations { rows: [&rows[0], &rows[1], &rows[2]], outputs: &mut outputs, sum: &mut sum });
    let bits = |x: f64| if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() };
    (outputs.into_iter().flatten().map(|x| bits(x.to_f64())).collect(), sum.to_bits())
}

#[test]
fn every_instruction_set_computes_as_the_portable_one() {
    let (single, double) = (operations(portable::PortableF32), operations(portable::PortableF64));
    #[cfg(target_arch = "x86_64")]
    for set in available() {
        let (a, b) = match set {
            // SAFETY: the set is available.
            InstructionSet::Avx512 => unsafe {
                (operations(avx512::Avx512F32::new()), operations(avx512::Avx512F64::new()))
            },
            // SAFETY: the set is available.
            InstructionSet::Avx2 => unsafe {
                (operations(avx2::Avx2F32::new()), operations(avx2::Avx2F64::new()))
            },
            InstructionSet::Portable => continue,
        };
        assert_eq!(a, single, "{set:?} f32");
        assert_eq!(b, double, "{set:?} f64");
    }
}
