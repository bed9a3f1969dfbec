//! Which transforms instances may have.
//!
//! Any finite one is fine for triangles. Scenes that need finite rays (see `guard`) need them inside instances too, so
//! the inverse that Embree computes in single precision must exist at all times, and must not be huge.

use super::check_finite;
use crate::Error;
use crate::guard::is_fragile;
use crate::{FeatureMask, Scene};

type Matrix = [[f64; 3]; 3];

/// Smallest volume of the unit cube's image, relative to the product of its edges. Single precision is far finer.
const SHEAR: f64 = 1e-3;
/// Largest scale, and inverse of the smallest.
const SCALE: f64 = 1e9;
/// How far a transform may change from one time step to the next, relative to itself. Below 1 all transforms
/// between can be inverted; a turn by 20 degrees is 0.5.
const CHANGE: f64 = 0.5;

pub(crate) fn check(scenes: &[Scene], steps: &[&[[f32; 12]]]) -> Result<(), Error> {
    for step in steps {
        check_finite("instance transform", step.as_flattened())?;
    }
    let features = scenes.iter().map(Scene::features).fold(FeatureMask::empty(), |a, b| a | b);
    if is_fragile(features) { check_inverses(steps) } else { Ok(()) }
}

fn check_inverses(steps: &[&[[f32; 12]]]) -> Result<(), Error> {
    let refuse = |reason| Err(Error::InvalidOption { what: "instance transform", reason });
    for (number, step) in steps.iter().enumerate() {
        for (place, transform) in step.iter().enumerate() {
            let matrix = linear_part(transform);
            let Some(inverse) = inverse(&matrix) else {
                return refuse("curves, points and subdivision surfaces need one that can be inverted");
            };
            let Some(next) = steps.get(number + 1) else { continue };
            let next = linear_part(&next[place]);
            let change: Matrix = std::array::from_fn(|c| std::array::from_fn(|r| next[c][r] - matrix[c][r]));
            if size(&product(&inverse, &change)) > CHANGE {
                return refuse(
                    "it changes too much in one time step for curves, points or subdivision surfaces",
                );
            }
        }
    }
    Ok(())
}

/// Columns of the linear part.
fn linear_part(transform: &[f32; 12]) -> Matrix {
    std::array::from_fn(|c| std::array::from_fn(|r| f64::from(transform[3 * c + r])))
}

/// The inverse, if single precision finds a sensible one as well.
fn inverse(m: &Matrix) -> Option<Matrix> {
    let cofactors = [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])];
    let determinant = dot(m[0], cofactors[0]);
    let lengths = m.map(|column| dot(column, column).sqrt());
    let sane = lengths.iter().all(|length| (1.0 / SCALE..SCALE).contains(length));
    if !sane || determinant.abs() < SHEAR * lengths.iter().product::<f64>() {
        return None;
    }
    Some(std::array::from_fn(|c| std::array::from_fn(|r| cofactors[r][c] / determinant)))
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|c| std::array::from_fn(|r| (0..3).map(|k| a[k][r] * b[c][k]).sum()))
}

fn size(m: &Matrix) -> f64 {
    m.iter().map(|&column| dot(column, column)).sum::<f64>().sqrt()
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverses_are_inverse_and_singular_matrices_have_none() {
        let m = [[1.0, 2.0, 0.0], [0.0, 3.0, -1.0], [0.5, 0.0, 4.0]];
        let one = product(&inverse(&m).unwrap(), &m);
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for (a, b) in one.as_flattened().iter().zip(identity.as_flattened()) {
            assert!((a - b).abs() < 1e-12);
        }
        assert!(inverse(&[[0.0; 3]; 3]).is_none());
        assert!(inverse(&[[1.0, 1.0, 1.0], [1.0, 1.0, 1.000_01], [0.0, 0.0, 1.0]]).is_none());
        assert!(inverse(&[[1e-20, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).is_none());
        assert!(inverse(&[[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-6]]).is_some());
    }

    #[test]
    fn a_half_turn_in_one_step_is_refused_and_a_small_turn_is_not() {
        let turn = |degrees: f32| {
            let (s, c) = degrees.to_radians().sin_cos();
            [c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0, 5.0, 6.0, 7.0]
        };
        assert!(check_inverses(&[&[turn(0.0)], &[turn(180.0)]]).is_err());
        assert!(check_inverses(&[&[turn(0.0)], &[turn(15.0)], &[turn(30.0)]]).is_ok());
    }
}
