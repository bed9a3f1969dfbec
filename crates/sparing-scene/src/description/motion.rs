//! How placements and cameras move between their ends.

use glam::{Affine3A, DAffine3, DMat3, DQuat, DVec3};

/// Most segments of straight motion: Embree's limit.
const MAX_SEGMENTS: usize = 128;
/// Largest turn in one segment: a point at distance r leaves its arc by r (1 - cos(0.75 degrees)) = 9e-5 r.
const SEGMENT_ANGLE: f64 = 1.5 * std::f64::consts::PI / 180.0;
/// Largest change of the linear part in one segment, relative to itself: matrices between stay invertible.
const SEGMENT_CHANGE: f64 = 0.4;

/// A transformation that moves from time 0 to time 1 and is at rest before and after.
///
/// It is split into translation, rotation and stretch by polar decomposition (K. Shoemake and T. Duff, "Matrix Animation
/// and Polar Decomposition", 1992), and each is interpolated: linearly, on the shorter arc, linearly. So does pbrt.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    start: Parts,
    end: Parts,
}

#[derive(Clone, Copy, Debug)]
struct Parts {
    translation: DVec3,
    rotation: DQuat,
    /// Symmetric up to rounding; mirrors if the whole does.
    stretch: DMat3,
}

impl Motion {
    /// Between two transformations; `None` if one of them cannot be inverted.
    #[must_use]
    pub fn new(start: Affine3A, end: Affine3A) -> Option<Self> {
        let [start, mut end] = [Parts::new(start)?, Parts::new(end)?];
        if start.rotation.dot(end.rotation) < 0.0 {
            end.rotation = -end.rotation;
        }
        Some(Self { start, end })
    }

    /// The transformation at a time.
    #[must_use]
    pub fn at(&self, time: f64) -> DAffine3 {
        let t = time.clamp(0.0, 1.0);
        let rotation = self.start.rotation.slerp(self.end.rotation, t);
        let stretch = self.start.stretch * (1.0 - t) + self.end.stretch * t;
        let translation = self.start.translation.lerp(self.end.translation, t);
        DAffine3 { matrix3: DMat3::from_quat(rotation) * stretch, translation }
    }

    /// Angle of the whole turn in radians.
    #[must_use]
    pub fn angle(&self) -> f64 {
        // asin of half the chord: acos of the product has no digits left for small angles.
        let chord = self.start.rotation - self.end.rotation;
        4.0 * (0.5 * chord.length()).min(1.0).asin()
    }

    /// Transformations at even steps while the shutter is open, dense enough to go straight from each to the next; one if
    /// nothing moves then.
    #[must_use]
    pub fn steps(&self, shutter: [f32; 2]) -> Vec<Affine3A> {
        let [open, close] = shutter.map(f64::from);
        let single = |m: DAffine3| Affine3A::from_mat4(glam::DMat4::from(m).as_mat4());
        let sample = |n: usize| -> Vec<DAffine3> {
            (0..=n).map(|i| self.at(open + (close - open) * i as f64 / n as f64)).collect()
        };
        let seen = close.min(1.0) - open.max(0.0);
        let ends = [self.at(open), self.at(close)].map(single);
        if seen <= 0.0 || self.angle() < 1e-9 && ends[0] == ends[1] {
            return vec![ends[0]];
        }
        let mut n = ((self.angle() * seen / SEGMENT_ANGLE).ceil() as usize).clamp(1, MAX_SEGMENTS);
        // Where the motion begins or ends while the shutter is open must be a step.
        let bends: Vec<f64> = [0.0, 1.0]
            .map(|t| (t - open) / (close - open))
            .into_iter()
            .filter(|b| *b > 0.0 && *b < 1.0)
            .collect();
        let on_step = |n: usize| bends.iter().all(|b| (b * n as f64 - (b * n as f64).round()).abs() < 1e-3);
        n = (n..=MAX_SEGMENTS).find(|n| on_step(*n)).unwrap_or(MAX_SEGMENTS);
        while n < MAX_SEGMENTS && sample(n).windows(2).any(|pair| change(pair) > SEGMENT_CHANGE) {
            n = (2 * n).min(MAX_SEGMENTS);
        }
        sample(n).into_iter().map(single).collect()
    }
}

/// How much the linear part changes, relative to itself (Frobenius norm).
fn change(pair: &[DAffine3]) -> f64 {
    let m = pair[0].matrix3.inverse() * pair[1].matrix3 - DMat3::IDENTITY;
    let columns = [m.x_axis, m.y_axis, m.z_axis];
    columns.iter().map(|c| c.length_squared()).sum::<f64>().sqrt()
}

impl Parts {
    fn new(m: Affine3A) -> Option<Self> {
        let linear = glam::Mat3::from(m.matrix3).as_dmat3();
        let determinant = linear.determinant();
        if !(m.is_finite() && determinant != 0.0 && linear.inverse().is_finite()) {
            return None;
        }
        // Newton's iteration for the nearest rotation; of a matrix that mirrors, of its negative.
        let sign = determinant.signum();
        let mut rotation = linear * sign;
        for _ in 0..100 {
            let next = (rotation + rotation.transpose().inverse()) * 0.5;
            let done = next.abs_diff_eq(rotation, 1e-15);
            rotation = next;
            if done {
                break;
            }
        }
        let stretch = rotation.transpose() * linear;
        let rotation = DQuat::from_mat3(&rotation).normalize();
        let finite = rotation.is_finite() && stretch.is_finite();
        finite.then_some(Self { translation: m.translation.as_dvec3(), rotation, stretch })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Mat3, Quat, Vec3};

    fn turn(degrees: f32) -> Affine3A {
        Affine3A::from_quat(Quat::from_rotation_z(degrees.to_radians()))
    }

    #[test]
    fn half_way_of_a_turn_with_stretch_is_half_of_each() {
        let start = Affine3A::from_scale_rotation_translation(Vec3::ONE, Quat::IDENTITY, Vec3::X);
        let end = Affine3A::from_scale_rotation_translation(
            Vec3::new(3.0, 1.0, 1.0),
            Quat::from_rotation_z(std::f32::consts::FRAC_PI_2),
            Vec3::new(1.0, 4.0, 0.0),
        );
        let m = Motion::new(start, end).expect("both can be inverted");
        assert!((m.angle() - std::f64::consts::FRAC_PI_2).abs() < 1e-6);
        let half = m.at(0.5);
        // x is stretched by 2, then turned by 45 degrees.
        let expected = DVec3::new(2.0, 2.0, 0.0) * 0.5f64.sqrt();
        assert!(half.matrix3.x_axis.abs_diff_eq(expected, 1e-6), "{half}");
        assert!(half.translation.abs_diff_eq(DVec3::new(1.0, 2.0, 0.0), 1e-6));
        // A shear and a mirror come back as they were at the ends.
        let sheared =
            Affine3A::from_mat3(Mat3::from_cols_array(&[-1.0, 0.2, 0.0, 0.7, 2.0, 0.0, 0.1, 0.0, 3.0]));
        let m = Motion::new(sheared, turn(30.0) * sheared).expect("both can be inverted");
        assert!(m.at(0.0).matrix3.abs_diff_eq(Mat3::from(sheared.matrix3).as_dmat3(), 1e-6));
        assert!(m.at(7.0).matrix3.abs_diff_eq(Mat3::from((turn(30.0) * sheared).matrix3).as_dmat3(), 1e-6));
        assert!(Motion::new(turn(0.0), Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0))).is_none());
    }

    #[test]
    fn turns_take_the_shorter_arc_in_steps_that_leave_it_by_little() {
        let m = Motion::new(turn(10.0), turn(-170.0)).expect("both can be inverted");
        let steps = m.steps([0.0, 1.0]);
        assert_eq!(steps.len(), 121);
        for pair in steps.windows(2) {
            let middle = (pair[0].transform_vector3(Vec3::X) + pair[1].transform_vector3(Vec3::X)) * 0.5;
            assert!((middle.length() - 1.0).abs() < 1e-4);
        }
        assert!(Motion::new(turn(0.0), turn(90.0)).expect("fine").at(0.5).matrix3.x_axis.y > 0.7);
    }

    #[test]
    fn straight_motion_is_one_segment_and_bends_are_steps() {
        let far = Affine3A::from_translation(Vec3::new(8.0, 0.0, 0.0));
        let m = Motion::new(Affine3A::IDENTITY, far).expect("both can be inverted");
        let at = |steps: &[Affine3A]| steps.iter().map(|s| s.translation.x).collect::<Vec<_>>();
        assert_eq!(at(&m.steps([0.0, 1.0])), [0.0, 8.0]);
        assert_eq!(at(&m.steps([0.25, 0.5])), [2.0, 4.0]);
        assert_eq!(at(&m.steps([0.5, 0.5])), [4.0]);
        assert_eq!(at(&m.steps([1.0, 2.0])), [8.0], "over before the shutter opens");
        assert_eq!(at(&m.steps([-1.0, 3.0])), [0.0, 0.0, 8.0, 8.0, 8.0]);
        let same = Motion::new(far, far).expect("both can be inverted");
        assert_eq!(same.steps([0.0, 1.0]).len(), 1);
    }
}
