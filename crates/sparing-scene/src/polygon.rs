//! Polygons into triangles: fans where they are convex, else ears that are clipped (Meisters 1975).

use glam::{DVec2, DVec3, Vec3};

/// Corners of a polygon that is clipped; clipping takes the square of their number.
const MAX_CLIPPED: usize = 4096;

/// Splits polygons; keeps its memory from one to the next.
#[derive(Debug, Default)]
pub(crate) struct Triangulator {
    points: Vec<DVec2>,
    /// Corner after and before each that is left.
    next: Vec<usize>,
    previous: Vec<usize>,
    given_up: u64,
}

impl Triangulator {
    /// Polygons that became fans though they are not convex, as they have too many corners.
    pub fn given_up(&self) -> u64 {
        self.given_up
    }

    /// The `count - 2` triangles of a polygon, as numbers of its corners, wound as the polygon is.
    pub fn split(
        &mut self,
        count: usize,
        position: impl Fn(usize) -> Vec3,
        mut emit: impl FnMut([usize; 3]),
    ) {
        self.flatten(count, position);
        let convex = (0..count).all(|i| self.turn((i + count - 1) % count, i, (i + 1) % count) >= 0.0);
        if convex || count > MAX_CLIPPED {
            self.given_up += u64::from(!convex);
            (2..count).for_each(|i| emit([0, i - 1, i]));
            return;
        }
        self.clip(count, emit);
    }

    /// Projects along the axis that the normal (Newell's, Sutherland et al. 1974) is closest to, so that the polygon
    /// runs counter-clockwise.
    fn flatten(&mut self, count: usize, position: impl Fn(usize) -> Vec3) {
        let at = |i: usize| position(i).as_dvec3();
        let origin = at(0);
        let mut normal = DVec3::ZERO;
        for i in 0..count {
            normal += (at(i) - origin).cross(at((i + 1) % count) - origin);
        }
        let axis = normal.abs().max_position();
        let flip = normal[axis] < 0.0;
        self.points.clear();
        self.points.extend((0..count).map(|i| {
            let p = at(i) - origin;
            let (x, y) = (p[(axis + 1) % 3], p[(axis + 2) % 3]);
            if flip { DVec2::new(y, x) } else { DVec2::new(x, y) }
        }));
    }

    /// Twice the signed area: positive for a left turn.
    fn turn(&self, a: usize, b: usize, c: usize) -> f64 {
        let [a, b, c] = [a, b, c].map(|i| self.points[i]);
        (b - a).perp_dot(c - b)
    }

    /// Whether no other corner lies within the triangle at `i`.
    fn is_ear(&self, i: usize) -> bool {
        let (a, c) = (self.previous[i], self.next[i]);
        if self.turn(a, i, c) <= 0.0 {
            return false;
        }
        let mut other = self.next[c];
        while other != a {
            let inside = self.turn(a, i, other) >= 0.0
                && self.turn(i, c, other) >= 0.0
                && self.turn(c, a, other) >= 0.0;
            // Corners that touch a corner of the ear are seams, as in polygons with holes.
            if inside && [a, i, c].iter().all(|&k| self.points[k] != self.points[other]) {
                return false;
            }
            other = self.next[other];
        }
        true
    }

    fn clip(&mut self, count: usize, mut emit: impl FnMut([usize; 3])) {
        self.next.clear();
        self.next.extend((0..count).map(|i| (i + 1) % count));
        self.previous.clear();
        self.previous.extend((0..count).map(|i| (i + count - 1) % count));
        let (mut i, mut left, mut misses) = (0, count, 0);
        while left > 3 {
            // Where there is no ear (the polygon crosses itself), any corner will do.
            if misses <= left && !self.is_ear(i) {
                misses += 1;
                i = self.next[i];
                continue;
            }
            let (a, c) = (self.previous[i], self.next[i]);
            emit([a, i, c]);
            (self.next[a], self.previous[c]) = (c, a);
            left -= 1;
            misses = 0;
            i = c;
        }
        emit([self.previous[i], i, self.next[i]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(points: &[[f32; 2]]) -> Vec<[usize; 3]> {
        let mut all = Vec::new();
        // In a slanted plane.
        let position = |i: usize| Vec3::new(points[i][0], points[i][1] + 3.0, points[i][1] * 2.0);
        Triangulator::default().split(points.len(), position, |t| all.push(t));
        all
    }

    fn areas(points: &[[f32; 2]], triangles: &[[usize; 3]]) -> Vec<f32> {
        let area = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|i| glam::Vec2::from(points[i]));
            (b - a).perp_dot(c - a) / 2.0
        };
        triangles.iter().map(area).collect()
    }

    #[test]
    fn convex_polygons_are_fans() {
        assert_eq!(split(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), [[0, 1, 2], [0, 2, 3]]);
        // A corner on an edge.
        assert_eq!(split(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0]]).len(), 2);
    }

    #[test]
    fn concave_polygons_keep_their_area_and_winding() {
        let arrow = [[2.0, -1.0], [0.5, 0.0], [2.0, 1.0], [0.0, 0.0]];
        let comb = [[0.0, 0.0], [5.0, 0.0], [5.0, 3.0], [4.0, 1.0], [3.0, 3.0], [2.0, 1.0], [1.0, 3.0]];
        for (points, total) in [(&arrow[..], 0.5), (&comb[..], 9.5)] {
            for mirrored in [false, true] {
                let sign = if mirrored { -1.0 } else { 1.0 };
                let points: Vec<[f32; 2]> = points.iter().map(|p| [p[0] * sign, p[1]]).collect();
                let triangles = split(&points);
                let areas = areas(&points, &triangles);
                assert_eq!(triangles.len(), points.len() - 2);
                assert!(areas.iter().all(|a| a * sign >= 0.0), "{areas:?}");
                assert!((areas.iter().sum::<f32>() * sign - total).abs() < 1e-5, "{areas:?}");
            }
        }
    }

    #[test]
    fn polygons_that_cross_themselves_or_have_no_area_end() {
        assert_eq!(split(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]).len(), 2);
        assert_eq!(split(&[[0.0; 2]; 9]).len(), 7);
        let star: Vec<[f32; 2]> =
            (0..7).map(|i| (i as f32 * 3.0 / 7.0 * std::f32::consts::TAU).sin_cos().into()).collect();
        assert_eq!(split(&star).len(), 5);
        assert_eq!(
            split(&[[f32::MAX, 0.0], [0.0, f32::MAX], [-f32::MAX, 0.0], [0.0, 1.0], [1.0, 1.0]]).len(),
            3
        );
    }
}
