//! Methods: a selection of vectors and a refit of their coefficients, by name.

use super::refit::{Fitted, Points, logistic, project, ridge};
use super::select::{GreedyRule, gather, k_means, largest_coefficients, order, random};
use super::{Machine, PruneError, check, check_positive_definite, with_vectors};
use crate::model::Model;
use std::collections::HashMap;
use std::fmt;
use std::str::FromStr;

/// How vectors are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Select {
    /// The largest |coefficients|: dropping the smallest, the classical way.
    Drop,
    /// At random.
    Random,
    /// Centres of k-means over the support vectors, weighted by |coefficient|.
    KMeans,
    /// Greedy pivoted Cholesky of the kernel matrix: [`GreedyRule::Power`].
    Cholesky,
    /// Greedy by the rest of w: [`GreedyRule::Residual`].
    Greedy,
    /// Trained again on a part of the labelled data: [`super::retrain`].
    Retrain,
}

/// How coefficients are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Refit {
    /// Kept; of a random choice times the share that was kept.
    Keep,
    /// Projection of w in the kernel's Hilbert space.
    Rkhs,
    /// Ridge fit to the clipped decision values.
    Decision,
    /// Ridge fit to labels.
    Labels,
    /// Logistic regression on labels.
    Logistic,
}

const SELECTIONS: [(Select, &str); 6] = [
    (Select::Drop, "drop"),
    (Select::Random, "random"),
    (Select::KMeans, "kmeans"),
    (Select::Cholesky, "cholesky"),
    (Select::Greedy, "greedy"),
    (Select::Retrain, "retrain"),
];

const REFITS: [(Refit, &str); 5] = [
    (Refit::Keep, "keep"),
    (Refit::Rkhs, "rkhs"),
    (Refit::Decision, "fit"),
    (Refit::Labels, "labels"),
    (Refit::Logistic, "logistic"),
];

/// A way to prune: `SELECTION` or `SELECTION-REFIT`, such as `drop`, `kmeans-fit`, `greedy-rkhs`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Method {
    /// How vectors are chosen.
    pub select: Select,
    /// How coefficients are found.
    pub refit: Refit,
}

impl Method {
    /// Methods worth comparing: those that need no labels, then those that do.
    #[must_use]
    pub fn defaults(labels: bool) -> Vec<Self> {
        let names =
            ["drop", "random", "random-fit", "kmeans-fit", "cholesky-rkhs", "greedy-rkhs", "greedy-fit"];
        let with_labels = ["kmeans-labels", "kmeans-logistic", "retrain"];
        let with_labels = if labels { &with_labels[..] } else { &[] };
        names.iter().chain(with_labels).filter_map(|name| name.parse().ok()).collect()
    }

    /// Whether labelled examples are needed.
    #[must_use]
    pub fn needs_labels(self) -> bool {
        self.select == Select::Retrain || matches!(self.refit, Refit::Labels | Refit::Logistic)
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let select = SELECTIONS.iter().find(|(s, _)| *s == self.select).map_or("", |(_, name)| name);
        let refit = REFITS.iter().find(|(r, _)| *r == self.refit).map_or("", |(_, name)| name);
        if self.refit == Refit::Keep { write!(f, "{select}") } else { write!(f, "{select}-{refit}") }
    }
}

impl FromStr for Method {
    type Err = PruneError;

    fn from_str(text: &str) -> Result<Self, PruneError> {
        let (select, refit) = text.split_once('-').map_or((text, None), |(s, r)| (s, Some(r)));
        let unknown = || PruneError::UnknownMethod {
            name: text.to_owned(),
            selections: SELECTIONS.map(|(_, name)| name).join(", "),
            refits: REFITS.map(|(_, name)| name).join(", "),
        };
        let select = SELECTIONS.iter().find(|(_, name)| *name == select).ok_or_else(unknown)?.0;
        let refit = match refit {
            Some(refit) => REFITS.iter().find(|(_, name)| *name == refit).ok_or_else(unknown)?.0,
            None => match select {
                Select::Drop | Select::Random | Select::Retrain => Refit::Keep,
                Select::KMeans => Refit::Decision,
                Select::Cholesky | Select::Greedy => Refit::Rkhs,
            },
        };
        // Centres have no coefficients to keep; a trained machine has nothing to refit.
        if (select == Select::KMeans && refit == Refit::Keep)
            || (select == Select::Retrain && refit != Refit::Keep)
        {
            return Err(unknown());
        }
        Ok(Self { select, refit })
    }
}

/// Choices that are the same for all methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Seed of random choices.
    pub seed: u64,
}

/// Points to fit at.
#[derive(Clone, Copy, Debug)]
pub struct Examples<'a> {
    /// Row by row, scaled as the model wants it.
    pub rows: &'a [f64],
    /// For each row the sign that the decision value should have (above 0: the model's first class), if known.
    pub labels: Option<&'a [f64]>,
}

/// A model with `size` vectors or fewer.
///
/// # Errors
/// The model, the examples or the size do not fit the method, or nothing finite could be fitted.
pub fn reduce(
    model: &Model,
    method: Method,
    size: usize,
    examples: Examples<'_>,
    options: Options,
) -> Result<Model, PruneError> {
    Sweep::new(model, examples, size, options)?.reduce(method, size)
}

/// Several methods and sizes on one model: what they share is computed once.
#[derive(Debug)]
pub struct Sweep<'a> {
    model: &'a Model,
    examples: Examples<'a>,
    largest: usize,
    options: Options,
    orders: HashMap<GreedyRule, Vec<usize>>,
    /// The model's decision values at the examples.
    values: Option<Vec<f64>>,
}

/// Clips of the decision values that are tried; outside of +-1 they are what the machine never was trained to
/// keep.
const CLIPS: [f64; 4] = [0.5, 1.0, 1.5, f64::INFINITY];

impl<'a> Sweep<'a> {
    /// Sizes up to `largest` will be asked for.
    ///
    /// # Errors
    /// The model cannot be pruned, or the examples do not fit it.
    pub fn new(
        model: &'a Model,
        examples: Examples<'a>,
        largest: usize,
        options: Options,
    ) -> Result<Self, PruneError> {
        check(model)?;
        let rows = examples.rows.len() / model.features;
        let labels = examples.labels.map_or(rows, <[f64]>::len);
        if examples.rows.len() != rows * model.features || labels != rows {
            return Err(PruneError::Examples {
                found: examples.rows.len(),
                rows: labels,
                features: model.features,
            });
        }
        let finite = |row: usize| {
            examples.rows[row * model.features..(row + 1) * model.features].iter().all(|v| v.is_finite())
                && examples.labels.is_none_or(|l| l[row].is_finite())
        };
        if let Some(row) = (0..rows).find(|&row| !finite(row)) {
            return Err(PruneError::NotFinite(row));
        }
        Ok(Self { model, examples, largest, options, orders: HashMap::new(), values: None })
    }

    /// A model with `size` vectors or fewer.
    ///
    /// # Errors
    /// The method does not suit the model or the examples, or nothing finite could be fitted.
    pub fn reduce(&mut self, method: Method, size: usize) -> Result<Model, PruneError> {
        let model = self.model;
        if size == 0 {
            return Err(PruneError::Size);
        }
        if method.needs_labels() && self.examples.labels.is_none() {
            return Err(PruneError::NoLabels(method.to_string()));
        }
        if method.refit == Refit::Rkhs {
            check_positive_definite(model.kernel)?;
        }
        let seed = self.options.seed;
        let indices = match method.select {
            Select::Drop => largest_coefficients(model, size),
            Select::Random => random(model, size, seed),
            Select::Cholesky => self.order(GreedyRule::Power, size)?,
            Select::Greedy => self.order(GreedyRule::Residual, size)?,
            Select::Retrain => return super::retrain::retrain(model, self.examples, size, seed),
            Select::KMeans => {
                let weights: Vec<f64> = model.coefficients[0].iter().map(|c| c.abs()).collect();
                let centres = k_means(&model.support_vectors, model.features, &weights, size, seed);
                return self.refit(method.refit, &centres);
            }
        };
        if method.refit == Refit::Keep {
            let scale =
                if method.select == Select::Random { model.len() as f64 / indices.len() as f64 } else { 1.0 };
            let coefficients: Vec<f64> = indices.iter().map(|&i| scale * model.coefficients[0][i]).collect();
            return finished(model, &gather(model, &indices), &Fitted { coefficients, rho: model.rho[0] });
        }
        self.refit(method.refit, &gather(model, &indices))
    }

    fn order(&mut self, rule: GreedyRule, size: usize) -> Result<Vec<usize>, PruneError> {
        check_positive_definite(self.model.kernel)?;
        let largest = self.largest.max(size);
        let found = self.orders.get(&rule).filter(|found| found.len() >= size.min(self.model.len()));
        let all = match found {
            Some(all) => all,
            None => self.orders.entry(rule).insert_entry(order(self.model, rule, largest).indices).into_mut(),
        };
        if all.is_empty() {
            return Err(PruneError::Fit);
        }
        Ok(all[..size.min(all.len())].to_vec())
    }

    fn refit(&mut self, refit: Refit, centres: &[f64]) -> Result<Model, PruneError> {
        let (model, rows) = (self.model, self.examples.rows);
        let labels = self.examples.labels.unwrap_or(&[]);
        let fitted = match refit {
            Refit::Keep => return Err(PruneError::Fit),
            Refit::Rkhs => project(model, centres, 1e-12)?,
            Refit::Decision => {
                if self.values.is_none() {
                    self.values = Some(Machine::new(model)?.all_values(rows));
                }
                let targets = self.values.as_deref().unwrap_or(&[]);
                ridge(model.kernel, model.features, centres, Points { rows, targets }, &CLIPS)?
            }
            Refit::Labels => {
                let targets: Vec<f64> = labels.iter().map(|l| if *l > 0.0 { 1.0 } else { -1.0 }).collect();
                ridge(model.kernel, model.features, centres, Points { rows, targets: &targets }, &[1.0])?
            }
            Refit::Logistic => {
                logistic(model.kernel, model.features, centres, Points { rows, targets: labels })?
            }
        };
        finished(model, centres, &fitted)
    }
}

/// The reduced model; refused if no coefficient is left.
fn finished(model: &Model, centres: &[f64], fitted: &Fitted) -> Result<Model, PruneError> {
    let all_zero = fitted.coefficients.iter().all(|c| *c == 0.0);
    if all_zero || !fitted.rho.is_finite() || fitted.coefficients.iter().any(|c| !c.is_finite()) {
        return Err(PruneError::Fit);
    }
    Ok(with_vectors(model, centres, &fitted.coefficients, fitted.rho))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Kernel;
    use crate::prune::samples::queries;
    use crate::prune::testing::machine;

    #[test]
    fn names_round_trip() {
        for method in Method::defaults(true) {
            assert_eq!(method.to_string().parse::<Method>().unwrap(), method);
        }
        assert_eq!("greedy".parse::<Method>().unwrap().to_string(), "greedy-rkhs");
        for bad in ["", "kmeans-keep", "drop-", "nonsense", "greedy-fit-fit", "retrain-fit"] {
            assert!(bad.parse::<Method>().is_err(), "{bad}");
        }
    }

    #[test]
    fn every_method_gives_a_model_of_its_size_whatever_the_threads() {
        let model = machine(300, 3, 3.0, 10.0, 11);
        let rows = queries(&model, 1000, 1);
        let labels: Vec<f64> = rows.chunks(3).map(|x| x[0] - 0.5).collect();
        let examples = Examples { rows: &rows, labels: Some(&labels) };
        let run = |threads: usize| -> Vec<Model> {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut sweep = Sweep::new(&model, examples, 32, Options { seed: 3 }).unwrap();
                let methods = Method::defaults(true).into_iter();
                methods.flat_map(|m| [8, 32].map(|size| sweep.reduce(m, size).unwrap())).collect()
            })
        };
        let models = run(1);
        assert_eq!(models, run(3));
        for (i, reduced) in models.iter().enumerate() {
            check(reduced).unwrap();
            assert!((1..=[8, 32][i % 2]).contains(&reduced.len()), "{i}");
            assert_eq!(reduced.class_counts.iter().sum::<usize>(), reduced.len());
        }
    }

    #[test]
    fn what_does_not_fit_is_an_error() {
        let mut model = machine(30, 2, 1.0, 1.0, 1);
        let none = Examples { rows: &[], labels: None };
        let options = Options { seed: 0 };
        let reduce = |m: &Model, method: &str, e| reduce(m, method.parse().unwrap(), 8, e, options);
        assert!(matches!(reduce(&model, "kmeans-labels", none), Err(PruneError::NoLabels(_))));
        assert_eq!(reduce(&model, "kmeans-fit", none), Err(PruneError::Fit));
        let odd = Examples { rows: &[1.0; 3], labels: None };
        assert!(matches!(reduce(&model, "greedy", odd), Err(PruneError::Examples { .. })));
        let nan = Examples { rows: &[0.0, 1.0, f64::NAN, 1.0], labels: None };
        assert_eq!(reduce(&model, "greedy", nan), Err(PruneError::NotFinite(1)));
        model.kernel = Kernel::Sigmoid { gamma: 1.0, coef0: 0.0 };
        assert_eq!(reduce(&model, "greedy", none), Err(PruneError::NotPositiveDefinite("sigmoid")));
        assert!(reduce(&model, "drop", none).is_ok());
    }
}
