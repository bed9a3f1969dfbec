//! The Pareto front: what cannot be had faster without being worse.

use super::Point;

/// Marks the machines that no other one beats in time without a lower score.
pub(super) fn mark(full: &mut Point, points: &mut [Point]) {
    let mut all: Vec<&mut Point> = std::iter::once(full).chain(points.iter_mut()).collect();
    // Fastest first; of equally fast ones the best.
    all.sort_by(|a, b| a.ns_per_query.total_cmp(&b.ns_per_query).then(b.score().total_cmp(&a.score())));
    let mut best = f64::NEG_INFINITY;
    for point in all {
        point.pareto = point.score() > best;
        best = best.max(point.score());
    }
}
