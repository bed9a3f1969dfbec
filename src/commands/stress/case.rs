//! One case: what it does, what it must keep, what was found.

pub(super) use sparing_adaptive::training::Random;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// How much is done.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    pub(super) quick: bool,
}

impl Effort {
    /// One number or the other.
    pub(super) fn of<T>(self, quick: T, full: T) -> T {
        if self.quick { quick } else { full }
    }
}

/// A case of the suite.
#[derive(Clone, Copy)]
pub(super) struct Case {
    pub(super) area: &'static str,
    pub(super) name: &'static str,
    /// What it does, one sentence for the table.
    pub(super) does: &'static str,
    /// What the measured number is.
    pub(super) unit: &'static str,
    /// It must not be larger. 0 for counts of what must not happen.
    pub(super) bound: f64,
    /// Measures.
    pub(super) measure: fn(Effort) -> anyhow::Result<f64>,
}

/// A case, afterwards.
pub(super) struct Outcome {
    pub(super) case: Case,
    result: Result<f64, String>,
}

impl Case {
    /// Runs it; panics are failures.
    pub(super) fn run(&self, effort: Effort) -> Outcome {
        let result = catch_unwind(AssertUnwindSafe(|| (self.measure)(effort)));
        let result = match result {
            Ok(Ok(value)) => Ok(value),
            Ok(Err(error)) => Err(format!("{error:#}")),
            Err(_) => Err("it panicked".to_owned()),
        };
        Outcome { case: *self, result }
    }
}

impl Outcome {
    /// Whether the bound holds; NaN does not.
    pub(super) fn holds(&self) -> bool {
        self.result.as_ref().is_ok_and(|v| *v <= self.case.bound)
    }

    /// What was measured, with its bound.
    pub(super) fn measured(&self) -> String {
        match &self.result {
            Ok(value) => {
                format!("{}, at most {} ({})", number(*value), number(self.case.bound), self.case.unit)
            }
            Err(error) => error.clone(),
        }
    }

    /// What was measured, for a table.
    pub(super) fn value(&self) -> String {
        self.result.as_ref().map_or_else(Clone::clone, |v| number(*v))
    }
}

/// Short, and 0 as 0.
pub(super) fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        a if (1e-3..1e4).contains(&a) => {
            let text = format!("{value:.4}");
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        _ => format!("{value:.1e}"),
    }
}
