//! Sine and cosine that are the same bit for bit on every machine: only additions and multiplications in f64.

use std::f64::consts::TAU;

/// Sine and cosine of an angle in full turns.
pub(crate) fn turn(turns: f32) -> (f32, f32) {
    let turns = f64::from(turns);
    // The nearest quarter turn, and what is left: at most an eighth of a turn.
    let quarter = (turns * 4.0).round();
    let x = (turns - quarter * 0.25) * TAU;
    let y = x * x;
    // Taylor series; the first term left out is below 1e-15 at an eighth of a turn.
    let series = |first: f64, from: u32| {
        let (mut term, mut sum) = (first, first);
        for k in 0..7 {
            let n = f64::from(from + 2 * k);
            term *= -y / ((n + 1.0) * (n + 2.0));
            sum += term;
        }
        sum
    };
    let (sin, cos) = (series(x, 1), series(1.0, 0));
    let (sin, cos) = match quarter.rem_euclid(4.0) as u32 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    };
    (sin as f32, cos as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_library_all_the_way_round() {
        for i in -300..300 {
            let turns = i as f32 / 97.0;
            let (sin, cos) = (f64::from(turns) * TAU).sin_cos();
            let ours = turn(turns);
            assert!(
                (f64::from(ours.0) - sin).abs() < 1e-7 && (f64::from(ours.1) - cos).abs() < 1e-7,
                "{turns}"
            );
        }
        assert_eq!(turn(0.25), (1.0, 0.0));
    }
}
