//! Roots and maxima of functions of one variable, vertices of parabolas, relative differences, and
//! sorting by values.

/// A difference of two numbers with the sizes `a` and `b`, relative to the larger size.
pub(crate) fn relative(difference: f64, a: f64, b: f64) -> f64 {
    difference / a.max(b).max(f64::MIN_POSITIVE)
}

/// Finds a sign change of a function between two points with known values, low before high.
///
/// The method is regula falsi in the variant Illinois (Dowell and Jarratt 1971). The bracket is
/// halved when two evaluations have not made it four times shorter. The iteration ends at a zero,
/// or when the bracket is shorter than `accuracy` or than rounding. Returns the ends of the last
/// bracket, which coincide at a zero; the function has the sign of the given high end at the
/// second.
///
/// # Errors
/// The first error of the function.
pub(crate) fn bracketed_root<E>(
    [mut low, mut high]: [(f64, f64); 2],
    accuracy: f64,
    mut f: impl FnMut(f64) -> Result<f64, E>,
) -> Result<[f64; 2], E> {
    let shortest = accuracy.max(16.0 * f64::EPSILON * low.0.abs().max(high.0.abs()));
    // Lengths of the bracket before the last two evaluations; infinite after a bisection.
    let mut lengths = [f64::INFINITY; 2];
    let mut last = None;
    while high.0 - low.0 > shortest {
        let length = high.0 - low.0;
        let (secant, middle) = (
            low.0 - low.1 * length / (high.1 - low.1),
            0.5 * (low.0 + high.0),
        );
        let guess = if secant.is_finite() && length < 0.25 * lengths[0] {
            secant
        } else {
            middle
        };
        lengths = if guess == middle {
            [f64::INFINITY; 2]
        } else {
            [lengths[1], length]
        };
        // If the guess is at an end, a point beside this end is evaluated. If the function has the
        // other sign there, the bracket becomes shorter than `shortest`.
        let x = guess.clamp(low.0 + 0.5 * shortest, high.0 - 0.5 * shortest);
        let value = f(x)?;
        if value == 0.0 {
            return Ok([x, x]);
        }
        // The value at an end that is kept twice is halved.
        let is_high = (value > 0.0) == (high.1 > 0.0);
        let kept = if last == Some(is_high) { 0.5 } else { 1.0 };
        if is_high {
            (high, low.1) = ((x, value), kept * low.1);
        } else {
            (low, high.1) = ((x, value), kept * high.1);
        }
        last = Some(is_high);
    }
    Ok([low.0, high.0])
}

/// Finds the root of an increasing function in an interval by Newton's method, to an `accuracy`.
/// The function returns its value and its derivative. A step that leaves the bracket of the root,
/// or that is longer than half of the last one, is replaced by a bisection (Press et al. 2007,
/// *Numerical Recipes*, section 9.4).
pub(crate) fn newton(
    [mut low, mut high]: [f64; 2],
    start: f64,
    accuracy: f64,
    f: impl Fn(f64) -> (f64, f64),
) -> f64 {
    let (mut x, mut last) = (start.clamp(low, high), f64::INFINITY);
    // At least every other step halves the last step or the bracket, so that 120 iterations reach
    // rounding.
    for _ in 0..120 {
        let (value, derivative) = f(x);
        (low, high) = if value < 0.0 { (x, high) } else { (low, x) };
        let step = value / derivative;
        if step.abs() <= accuracy || high - low <= accuracy {
            return (x - step).clamp(low, high);
        }
        let next = x - step;
        let good = next >= low && next <= high && step.abs() <= 0.5 * last;
        let next = if good { next } else { 0.5 * (low + high) };
        last = (next - x).abs();
        x = next;
    }
    x
}

/// Largest of numbers that are not negative, zero without any; NaN if one of them is NaN.
pub(crate) fn largest(numbers: impl Iterator<Item = f64>) -> f64 {
    numbers.fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
}

/// Sorts a list by a value of its elements, smallest first. Elements with equal values keep their
/// order. The function is generic over the element alone: a sort with a closure in a function that
/// is generic over a model would be compiled for each model.
pub(crate) fn sort_by_value<T>(list: &mut [T], value: fn(&T) -> f64) {
    list.sort_by(|a, b| value(a).total_cmp(&value(b)));
}

/// The abscissa of the vertex of the parabola through three values at −1, 0 and 1; not finite for
/// values on a line.
pub(crate) fn vertex([before, middle, after]: [f64; 3]) -> f64 {
    0.5 * (before - after) / (before - 2.0 * middle + after)
}

/// Finds a maximum near `start` by parabolas through three points. Their distance is `width` at
/// first, and is divided by five unless the estimated vertex is two distances away or more. The
/// iteration ends when it is below `last`: the vertex has an error of the order of the square of
/// the distance.
pub(crate) fn maximum<E>(
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
        let shift = if curvature < 0.0 {
            vertex(values)
        } else {
            (after - before).signum()
        };
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
    use std::cell::Cell;
    use std::convert::Infallible;

    use approx::assert_abs_diff_eq;

    use super::*;

    /// The ends of the last bracket in [0, 2], and the number of evaluations.
    fn bracket(f: impl Fn(f64) -> f64) -> ([f64; 2], usize) {
        let count = Cell::new(0);
        let counted = |x: f64| {
            count.set(count.get() + 1);
            Ok::<_, Infallible>(f(x))
        };
        let Ok(found) = bracketed_root([(0.0, f(0.0)), (2.0, f(2.0))], 1e-12, counted);
        (found, count.get())
    }

    #[test]
    fn a_bracket_closes_on_the_sign_change() {
        let cube = |x: f64| x.powi(3) - 2.0;
        let step = |x: f64| if x < 0.7 { -1.0 } else { 3.0 };
        let flat = |x: f64| (x - 1.3).powi(9);
        let falling = |x: f64| 1.0 - x.exp() / 3.0;
        let cases: [(&dyn Fn(f64) -> f64, f64); 4] = [
            (&cube, 2f64.cbrt()),
            (&step, 0.7),
            (&flat, 1.3),
            (&falling, 3f64.ln()),
        ];
        for (f, root) in cases {
            let ([low, high], evaluations) = bracket(f);
            assert!(
                high - low <= 1e-12 && low <= root + 1e-12 && high >= root - 1e-12,
                "{low} {high} for {root}"
            );
            // Bisection needs 41 evaluations. At most two others lie between bisections.
            assert!(evaluations <= 123, "{evaluations}");
        }
        // At a simple root of a smooth function regula falsi takes less than half of the
        // evaluations of bisection.
        assert!(bracket(cube).1 <= 20, "{}", bracket(cube).1);
    }

    #[test]
    fn an_exact_zero_ends_the_search() {
        let (found, evaluations) = bracket(|x| x - 1.0);
        assert_eq!((found, evaluations), ([1.0; 2], 1));
    }

    #[test]
    fn an_error_of_the_function_is_passed_on() {
        assert_eq!(
            bracketed_root([(0.0, -1.0), (1.0, 1.0)], 1e-3, |_| Err("no value")),
            Err("no value")
        );
    }

    #[test]
    fn newton_finds_roots_at_ends_and_where_steps_leave_the_interval() {
        let line = |x: f64| (3.0 * (x - 1.0), 3.0);
        assert_eq!(newton([0.0, 1.0], 0.4, 1e-15, line), 1.0);
        // From 3 the steps of Newton's method for an arctangent diverge.
        let arctangent = |x: f64| (x.atan(), 1.0 / (1.0 + x * x));
        assert_abs_diff_eq!(
            newton([-5.0, 4.0], 3.0, 1e-14, arctangent),
            0.0,
            epsilon = 1e-14
        );
        // At the start the derivative is zero.
        let cube = |x: f64| (x.powi(3) - 1.0, 3.0 * x * x);
        assert_abs_diff_eq!(newton([-2.0, 3.0], 0.0, 1e-14, cube), 1.0, epsilon = 1e-14);
    }

    #[test]
    fn the_vertex_of_a_parabola_is_exact() {
        let parabola = |x: f64| 2.0 - 4.0 * (x - 0.25).powi(2);
        assert_eq!(vertex([-1.0, 0.0, 1.0].map(parabola)), 0.25);
        assert!(!vertex([1.0, 1.0, 1.0]).is_finite());
    }

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
