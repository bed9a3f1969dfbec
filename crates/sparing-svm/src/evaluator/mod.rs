//! Decision values at the speed of the hardware, with signs that are always right.
//!
//! [`Evaluator::compile`] lays a [`Model`] out for vector instructions; batches of queries are then evaluated in f32 with
//! a proven bound of the error. [`Evaluator::decide`] evaluates those whose sign the bound leaves open again, in f64 and,
//! rarer still, by the model's own definition, so that every sign is that of [`Model::decision_values`].
//!
//! Results are the same bit for bit however queries are split into batches; between instruction sets they agree
//! within the bounds, and their signs always.

mod bound;
mod compile;
mod exp;
mod kernel;
mod machine;
mod packed;
mod run;
mod simd;
#[cfg(test)]
mod tests;

pub use exp::ExpMethod;
pub use run::InstructionSet;

use crate::{Model, Result, SvmError};
use machine::{CHUNK, Machine, Prepared, Reach, Scratch, Value};
use std::sync::Arc;

/// How to compile an [`Evaluator`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// How exponentials are computed.
    pub exp: ExpMethod,
    /// The vector instructions; the best that the machine has, if `None`.
    pub instruction_set: Option<InstructionSet>,
}

/// How many decision values of a call were settled by which level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// By f32 (or, for linear kernels, by the one weight vector).
    pub single: usize,
    /// Again in f64.
    pub double: usize,
    /// By the model's definition, term by term.
    pub definition: usize,
    /// Of those, the values that are NaN: the query, or the model's arithmetic, is not finite.
    pub not_a_number: usize,
}

impl Effort {
    /// All decision values.
    #[must_use]
    pub fn total(&self) -> usize {
        self.single + self.double + self.definition
    }
}

impl std::ops::AddAssign for Effort {
    fn add_assign(&mut self, other: Self) {
        self.single += other.single;
        self.double += other.double;
        self.definition += other.definition;
        self.not_a_number += other.not_a_number;
    }
}

/// A model compiled for speed. Shared by threads as it is: a call changes nothing in it and allocates nothing.
#[derive(Clone, Debug)]
pub struct Evaluator {
    model: Arc<Model>,
    machines: Vec<Machine>,
    instruction_set: InstructionSet,
}

/// Most features, padded, of a query that fits the scratch on the stack.
const MAX_FEATURES: usize = 2048;

impl Evaluator {
    /// Compiles a model for this machine with the default options.
    ///
    /// # Errors
    /// As [`Evaluator::compile`].
    pub fn new(model: &Model) -> Result<Self> {
        Self::compile(model, &Options::default())
    }

    /// Compiles a model.
    ///
    /// # Errors
    /// When the model's parts contradict each other, or this machine does not have the instruction set.
    pub fn compile(model: &Model, options: &Options) -> Result<Self> {
        model.validate()?;
        let set = options.instruction_set.unwrap_or_else(InstructionSet::best);
        if !set.is_available() {
            return Err(SvmError::Parameters(format!("this machine does not have {}", set.name())));
        }
        let machines = (0..model.machines()).map(|m| Machine::compile(model, m, set, options.exp)).collect();
        Ok(Self { model: Arc::new(model.clone()), machines, instruction_set: set })
    }

    /// Features of a query.
    #[must_use]
    pub fn features(&self) -> usize {
        self.model.features
    }

    /// Decision values of a query: one for each pair of classes, one for one-class and regression models.
    #[must_use]
    pub fn machines(&self) -> usize {
        self.machines.len()
    }

    /// The model that was compiled.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The vector instructions in use.
    #[must_use]
    pub fn instruction_set(&self) -> InstructionSet {
        self.instruction_set
    }

    /// Bytes that a batch reads when no value needs a second look.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.machines.iter().map(|m| m.bytes().0).sum()
    }

    /// Bytes of all levels.
    #[must_use]
    pub fn total_bytes(&self) -> usize {
        self.machines.iter().map(|m| m.bytes().1).sum()
    }

    /// No value of [`Evaluator::decision_values`] is farther than this from the model's: for any query if the kernel is RBF,
    /// else for queries that are no longer than the longest support vector (linear: in no feature larger than the largest).
    ///
    /// It is a worst case over queries; [`Evaluator::decision_values_with_bounds`] bounds each value by itself.
    #[must_use]
    pub fn error_bound(&self) -> f64 {
        self.machines.iter().map(Machine::error_bound).fold(0.0, f64::max)
    }

    /// Decision values by the first level that can take the query, `machines()` for each query.
    ///
    /// `queries` is row-major, `n * features()`. A query with NaN gives NaN.
    ///
    /// # Panics
    /// When the lengths of `queries` and `out` do not fit.
    pub fn decision_values(&self, queries: &[f64], out: &mut [f64]) -> Effort {
        self.evaluate(queries, out, None, false)
    }

    /// [`Evaluator::decision_values`], and for each value a bound of its distance to the model's.
    ///
    /// # Panics
    /// When the lengths of `queries`, `out` and `bounds` do not fit.
    pub fn decision_values_with_bounds(
        &self,
        queries: &[f64],
        out: &mut [f64],
        bounds: &mut [f64],
    ) -> Effort {
        assert_eq!(bounds.len(), out.len(), "one bound for each value");
        self.evaluate(queries, out, Some(bounds), false)
    }

    /// Decision values whose signs are those of [`Model::decision_values`], bit for bit where the value is zero or NaN.
    ///
    /// # Panics
    /// When the lengths of `queries` and `out` do not fit.
    pub fn decide(&self, queries: &[f64], out: &mut [f64]) -> Effort {
        self.evaluate(queries, out, None, true)
    }

    fn evaluate(
        &self,
        queries: &[f64],
        out: &mut [f64],
        mut bounds: Option<&mut [f64]>,
        exact: bool,
    ) -> Effort {
        let features = self.features();
        let machines = self.machines();
        let count = out.len().checked_div(machines).unwrap_or(0);
        assert_eq!(out.len(), count * machines, "as many values for each query as there are machines");
        assert_eq!(queries.len(), count * features, "as many features for each query as the model has");
        let mut effort = Effort::default();
        for (number, machine) in self.machines.iter().enumerate() {
            let chunk = chunk_length(machine);
            let mut values = [Value { value: 0.0, bound: f64::INFINITY }; CHUNK];
            for first in (0..count).step_by(chunk) {
                let n = chunk.min(count - first);
                let queries = &queries[first * features..(first + n) * features];
                effort += self.evaluate_chunk(number, queries, exact, &mut values[..n]);
                for (i, v) in values[..n].iter().enumerate() {
                    let at = (first + i) * machines + number;
                    out[at] = v.value;
                    if let Some(bounds) = &mut bounds {
                        bounds[at] = v.bound;
                    }
                }
            }
        }
        effort
    }

    /// One machine, at most a chunk of queries.
    fn evaluate_chunk(&self, number: usize, queries: &[f64], exact: bool, values: &mut [Value]) -> Effort {
        let machine = &self.machines[number];
        let query = |i: usize| &queries[i * self.features()..(i + 1) * self.features()];
        let mut effort = Effort::default();
        let mut scratch = Scratch::new();
        let mut open = Indices::new();
        if self.single(machine, query, values, &mut scratch) {
            for (i, v) in values.iter().enumerate() {
                // Without exact signs only what f32 could not take goes on: its bound is infinite.
                let done = if exact { v.is_certain() } else { v.bound < f64::INFINITY };
                if done { effort.single += 1 } else { open.push(i) }
            }
        } else {
            open = Indices::all(values.len());
        }
        effort.double += double(machine, query, exact, values, &mut open, &mut scratch);
        for i in open.as_slice().iter().map(|&i| usize::from(i)) {
            let value = self.model.machine_value(number, query(i));
            values[i] = Value { value, bound: 0.0 };
            effort.definition += 1;
            effort.not_a_number += usize::from(value.is_nan());
        }
        effort
    }

    /// The first level. Says false where there is none.
    fn single<'q>(
        &self,
        machine: &Machine,
        query: impl Fn(usize) -> &'q [f64],
        values: &mut [Value],
        scratch: &mut Scratch,
    ) -> bool {
        for (i, v) in values.iter_mut().enumerate() {
            let Some(value) = machine.linear(query(i)) else { break };
            *v = value;
        }
        let features = machine.single_features();
        if features == 0 || features > MAX_FEATURES {
            return machine.is_linear();
        }
        let mut prepared_queries = [0.0_f32; MAX_FEATURES];
        let mut prepared = [Prepared::BEYOND; CHUNK];
        let mut order = [0_usize; CHUNK];
        // Queries that are near come first, far ones last, so that each kind is one batch.
        let (mut near, mut far) = (0, values.len());
        for (i, v) in values.iter_mut().enumerate() {
            let slot = near * features..(near + 1) * features;
            let p = machine.prepare(query(i), &mut prepared_queries[slot.clone()]);
            let at = match p.reach {
                Reach::Near => {
                    near += 1;
                    near - 1
                }
                Reach::Far => {
                    far -= 1;
                    prepared_queries.copy_within(slot, far * features);
                    far
                }
                Reach::Beyond => {
                    *v = Value { value: f64::NAN, bound: f64::INFINITY };
                    continue;
                }
            };
            prepared[at] = p;
            order[at] = i;
        }
        if near == values.len() {
            let batch = &prepared_queries[..near * features];
            machine.single(batch, &prepared[..near], scratch, values);
            return true;
        }
        let mut results = [Value { value: 0.0, bound: 0.0 }; CHUNK];
        for range in [0..near, far..values.len()] {
            if !range.is_empty() {
                let batch = &prepared_queries[range.start * features..range.end * features];
                machine.single(batch, &prepared[range.clone()], scratch, &mut results[range.clone()]);
            }
            for at in range {
                values[order[at]] = results[at];
            }
        }
        true
    }
}

/// The second level, for the values that are still open; those that it settles are taken off the list.
fn double<'q>(
    machine: &Machine,
    query: impl Fn(usize) -> &'q [f64],
    exact: bool,
    values: &mut [Value],
    open: &mut Indices,
    scratch: &mut Scratch,
) -> usize {
    let features = machine.double_features();
    if features == 0 || features > MAX_FEATURES || open.as_slice().is_empty() {
        return 0;
    }
    let mut queries = [0.0_f64; MAX_FEATURES];
    let mut prepared = [Prepared::BEYOND; CHUNK];
    let mut results = [Value { value: 0.0, bound: 0.0 }; CHUNK];
    let mut still_open = Indices::new();
    let mut settled = 0;
    for batch in open.as_slice().chunks((MAX_FEATURES / features).min(CHUNK)) {
        for ((&i, out), p) in batch.iter().zip(queries.chunks_exact_mut(features)).zip(&mut prepared) {
            *p = machine.prepare_double(query(usize::from(i)), out);
        }
        let results = &mut results[..batch.len()];
        machine.double(&queries[..batch.len() * features], &prepared[..batch.len()], scratch, results);
        for (&i, &result) in batch.iter().zip(&*results) {
            let done = if exact {
                result.is_certain()
            } else {
                result.bound < f64::INFINITY && !result.value.is_nan()
            };
            if done {
                values[usize::from(i)] = result;
                settled += 1;
            } else {
                still_open.push(usize::from(i));
            }
        }
    }
    *open = still_open;
    settled
}

/// Queries of a chunk: as many as the scratch holds.
fn chunk_length(machine: &Machine) -> usize {
    let widest = machine.single_features().max(1);
    (MAX_FEATURES / widest).clamp(1, CHUNK)
}

/// Numbers of queries within a chunk.
struct Indices {
    indices: [u16; CHUNK],
    len: usize,
}

impl Indices {
    fn new() -> Self {
        Self { indices: [0; CHUNK], len: 0 }
    }

    fn all(n: usize) -> Self {
        let mut all = Self::new();
        for i in 0..n {
            all.push(i);
        }
        all
    }

    fn push(&mut self, i: usize) {
        self.indices[self.len] = i as u16;
        self.len += 1;
    }

    fn as_slice(&self) -> &[u16] {
        &self.indices[..self.len]
    }
}
