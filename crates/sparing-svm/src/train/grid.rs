//! The search for C and gamma.

use rayon::prelude::*;

use super::control::Counter;
use super::cross_validation::{check, combine, run_fold};
use super::{Control, Folds, Parameters, Scores};
use crate::data::Data;
use crate::error::{Result, SvmError};
use crate::model::Kernel;

/// Values to be tried, each C with each gamma.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Penalties.
    pub c: Vec<f64>,
    /// Kernel parameters; ignored by the linear kernel, which wants exactly one value here.
    pub gamma: Vec<f64>,
}

/// One pair of values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridPoint {
    /// Penalty.
    pub c: f64,
    /// Kernel parameter.
    pub gamma: f64,
    /// Figures of the cross-validation; `None` if the time did not suffice for all its folds.
    pub scores: Option<Scores>,
    /// Support vectors, the mean over the folds; 0 without scores.
    pub support_vectors: f64,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct GridSearch {
    /// All points, C by C.
    pub points: Vec<GridPoint>,
    /// The parameters with the best merit ([`Scores::merit`]) among the finished points; of equals the
    /// smallest C, then the smallest gamma.
    pub best: Parameters,
    /// The point of `best`.
    pub best_point: GridPoint,
    /// Points that the time limit left out.
    pub missing: usize,
}

impl Grid {
    /// C from 2^-1 to 2^7 and gamma from 2^-5 to 2^3 in factors of 4: the middle of the grid that libSVM's authors
    /// recommend (Hsu, Chang and Lin 2003, section 3.2), for features scaled to one range.
    #[must_use]
    pub fn coarse() -> Self {
        let powers = |from: i32, to: i32| (from..=to).step_by(2).map(|e| 2_f64.powi(e)).collect();
        Self { c: powers(-1, 7), gamma: powers(-5, 3) }
    }
}

/// Cross-validates every point of the grid, all fits in parallel: at most as many as threads run at a time,
/// with one kernel cache each. The result does not depend on the number of threads, unless the time limit
/// cuts it short.
///
/// # Errors
/// As [`super::cross_validate`]; an empty grid; [`SvmError::TimeLimit`] when not one point was finished.
pub fn grid_search(
    parameters: &Parameters,
    grid: &Grid,
    data: &Data,
    folds: &Folds,
    control: &Control<'_>,
) -> Result<GridSearch> {
    let candidates = candidates(parameters, grid)?;
    for (parameters, _) in &candidates {
        check(parameters, data, folds)?;
    }
    let total = candidates.len() * folds.count();
    let counter = Counter::new(control, total);
    // Fold by fold within a point, so that a time limit leaves finished points.
    let fits: Vec<_> = (0..total)
        .into_par_iter()
        .map(|fit| {
            let (point, fold) = (fit / folds.count(), fit % folds.count());
            counter.run(|| run_fold(&candidates[point].0, data, folds, fold))
        })
        .collect();
    let done = fits.iter().filter(|fit| fit.is_some()).count();
    let mut fits = fits.into_iter();
    let (mut points, mut best): (Vec<GridPoint>, Option<(usize, f64)>) = (Vec::new(), None);
    for (parameters, point) in &candidates {
        let mut point = *point;
        let results: Option<Vec<_>> =
            fits.by_ref().take(folds.count()).collect::<Vec<_>>().into_iter().collect();
        if let Some(results) = results {
            let result = combine(parameters, data, results.into_iter().collect::<Result<_>>()?)?;
            point.scores = Some(result.scores);
            point.support_vectors = result.support_vectors;
            let merit = result.scores.merit();
            let better = best.is_none_or(|(i, best_merit)| {
                let other: &GridPoint = &points[i];
                merit > best_merit || (merit == best_merit && (point.c, point.gamma) < (other.c, other.gamma))
            });
            if better {
                best = Some((points.len(), merit));
            }
        }
        points.push(point);
    }
    let missing: Vec<&GridPoint> = points.iter().filter(|point| point.scores.is_none()).collect();
    let Some((i, _)) = best else {
        let list: Vec<String> =
            missing.iter().take(4).map(|point| format!("C = {}, gamma = {}", point.c, point.gamma)).collect();
        let more = if missing.len() > 4 { format!(" and {} more", missing.len() - 4) } else { String::new() };
        return Err(SvmError::TimeLimit { done, total, missing: format!("{}{more}", list.join("; ")) });
    };
    let missing = missing.len();
    Ok(GridSearch { best: candidates[i].0.clone(), best_point: points[i], points, missing })
}

fn candidates(parameters: &Parameters, grid: &Grid) -> Result<Vec<(Parameters, GridPoint)>> {
    if grid.c.is_empty() || grid.gamma.is_empty() {
        return Err(SvmError::Parameters("the grid is empty".to_owned()));
    }
    if parameters.kernel == Kernel::Linear && grid.gamma.len() != 1 {
        return Err(SvmError::Parameters(
            "the linear kernel has no gamma: give the grid one value".to_owned(),
        ));
    }
    let point = |c: f64, gamma: f64| {
        let kernel = match parameters.kernel {
            Kernel::Linear => Kernel::Linear,
            Kernel::Polynomial { degree, coef0, .. } => Kernel::Polynomial { degree, gamma, coef0 },
            Kernel::Rbf { .. } => Kernel::Rbf { gamma },
            Kernel::Sigmoid { coef0, .. } => Kernel::Sigmoid { gamma, coef0 },
        };
        let point = GridPoint { c, gamma, scores: None, support_vectors: 0.0 };
        (Parameters { c, kernel, ..parameters.clone() }, point)
    };
    Ok(grid.c.iter().flat_map(|&c| grid.gamma.iter().map(move |&gamma| point(c, gamma))).collect())
}
