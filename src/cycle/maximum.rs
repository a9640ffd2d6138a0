//! Maxima of functions that are expensive to evaluate, by successive parabolic interpolation.

use crate::numerics::scalar::vertex;

/// Finds a maximum near `start` by parabolas through three points. Their distance decreases fivefold from `width`,
/// and the iteration ends when it is below `last`: the vertex has an error of the order of the square of the
/// distance.
pub(super) fn maximum<E>(
    start: f64,
    mut width: f64,
    last: f64,
    mut f: impl FnMut(f64) -> Result<f64, E>,
) -> Result<f64, E> {
    let mut x = start;
    for _ in 0..40 {
        let values = [f(x - width)?, f(x)?, f(x + width)?];
        let [before, middle, after] = values;
        let curvature = before - 2.0 * middle + after;
        // A constant up to rounding, or NaN.
        if !(curvature.abs() > 1e-12 * middle.abs()) {
            break;
        }
        let shift = if curvature < 0.0 { vertex(values) } else { (after - before).signum() };
        x += shift.clamp(-2.0, 2.0) * width;
        if shift.abs() < 2.0 {
            width *= 0.2;
        }
        if width < last {
            break;
        }
    }
    Ok(x)
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use approx::assert_abs_diff_eq;

    use super::*;

    #[test]
    fn the_maximum_of_a_wave_is_found_from_either_side() {
        for start in [0.4, 1.0, 1.6] {
            let Ok(found) = maximum::<Infallible>(start, 0.2, 1e-3, |x| Ok(x.sin()));
            // The square of the last distance.
            assert_abs_diff_eq!(found, std::f64::consts::FRAC_PI_2, epsilon = 1e-6);
        }
        let Ok(found) = maximum::<Infallible>(0.3, 0.2, 1e-3, |_| Ok(1.0));
        assert_eq!(found, 0.3, "a constant has a maximum everywhere");
    }
}
