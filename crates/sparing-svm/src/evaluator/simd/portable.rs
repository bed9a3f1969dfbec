//! Plain Rust over arrays, which the compiler vectorises for whatever the target has (SSE2, NEON ..): the twin that
//! the instruction sets are tested against.

use super::{Job, Real, Row, Simd, sum_lanes, table_f32, table_f64};
use std::sync::LazyLock;

/// f32 lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PortableF32;

/// f64 lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PortableF64;

static TABLE_F32: LazyLock<[i32; 32]> = LazyLock::new(table_f32::<32>);
/// The table in f64.
pub(crate) static TABLE_F64: LazyLock<[i64; 16]> = LazyLock::new(table_f64::<16>);

macro_rules! portable {
    ($token:ident, $real:ident, $bits:ident, $lanes:literal, $table:ident, $entries:literal) => {
        impl Simd for $token {
            type Real = $real;
            type V = [$real; $lanes];
            type Table = &'static [$bits; $entries];
            const TABLE_BITS: u32 = ($entries as u32).ilog2();
            const CHAINS: usize = 2;

            #[inline(always)]
            fn set(self, x: $real) -> Self::V {
                [x; $lanes]
            }
            #[inline(always)]
            fn load(self, row: &Row<$real, $lanes>) -> Self::V {
                row.0
            }
            #[cfg(test)]
            #[inline(always)]
            fn store(self, a: Self::V, out: &mut [$real]) {
                out.copy_from_slice(&a);
            }
            #[inline(always)]
            fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V {
                let mut out = c;
                for i in 0..$lanes {
                    out[i] = a[i] * b[i] + c[i];
                }
                out
            }
            #[inline(always)]
            fn neg_mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V {
                let mut out = c;
                for i in 0..$lanes {
                    out[i] = c[i] - a[i] * b[i];
                }
                out
            }
            #[inline(always)]
            fn add(self, a: Self::V, b: Self::V) -> Self::V {
                let mut out = a;
                for i in 0..$lanes {
                    out[i] = a[i] + b[i];
                }
                out
            }
            #[inline(always)]
            fn sub(self, a: Self::V, b: Self::V) -> Self::V {
                let mut out = a;
                for i in 0..$lanes {
                    out[i] = a[i] - b[i];
                }
                out
            }
            #[inline(always)]
            fn mul(self, a: Self::V, b: Self::V) -> Self::V {
                let mut out = a;
                for i in 0..$lanes {
                    out[i] = a[i] * b[i];
                }
                out
            }
            #[inline(always)]
            fn div(self, a: Self::V, b: Self::V) -> Self::V {
                let mut out = a;
                for i in 0..$lanes {
                    out[i] = a[i] / b[i];
                }
                out
            }
            #[inline(always)]
            fn max(self, a: Self::V, b: Self::V) -> Self::V {
                let mut out = b;
                for i in 0..$lanes {
                    out[i] = if a[i] > b[i] { a[i] } else { b[i] };
                }
                out
            }
            #[inline(always)]
            fn min(self, a: Self::V, b: Self::V) -> Self::V {
                let mut out = b;
                for i in 0..$lanes {
                    out[i] = if a[i] < b[i] { a[i] } else { b[i] };
                }
                out
            }
            #[inline(always)]
            fn table(self) -> Self::Table {
                &$table
            }
            #[inline(always)]
            fn table_power(self, table: Self::Table, u: Self::V) -> Self::V {
                let mut out = u;
                for i in 0..$lanes {
                    let n = u[i].to_bits() as $bits;
                    let entry = table[(n & ($entries - 1)) as usize];
                    let shift = <$real as Real>::MANTISSA_BITS - Self::TABLE_BITS;
                    out[i] = $real::from_bits(entry.wrapping_add(n << shift) as _);
                }
                out
            }
            #[inline(always)]
            fn scale(self, p: Self::V, u: Self::V) -> Self::V {
                let mut out = p;
                for i in 0..$lanes {
                    let n = u[i].to_bits() << <$real as Real>::MANTISSA_BITS;
                    out[i] = $real::from_bits(p[i].to_bits().wrapping_add(n));
                }
                out
            }
            #[inline(always)]
            fn map(self, a: Self::V, f: impl Fn(f64) -> f64) -> Self::V {
                let mut out = a;
                for x in &mut out {
                    *x = f(f64::from(*x)) as $real;
                }
                out
            }
            #[inline(always)]
            fn sum(self, a: Self::V) -> f64 {
                sum_lanes(a.map(f64::from))
            }
            #[inline(always)]
            fn run<J: Job<Self>>(self, job: J) {
                job.run(self);
            }
        }
    };
}

portable!(PortableF32, f32, i32, 16, TABLE_F32, 32);
portable!(PortableF64, f64, i64, 8, TABLE_F64, 16);
