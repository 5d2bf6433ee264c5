//! Maximum of a function within a bracket.

use crate::numerics::accuracy::{HALF_DIGITS, SEARCH_STEPS};

/// The shorter part of a golden section.
const GOLDEN: f64 = 0.381_966_011_250_105_1;

/// Position and value of the maximum between `low` and `high`, from an inner point that is no lower than
/// either end: Brent's method of parabolas and golden sections.
///
/// Source: R. P. Brent, Algorithms for Minimization without Derivatives, 1973, chapter 5.
pub fn highest_within(
    [mut low, mut high]: [f64; 2],
    inside: (f64, f64),
    mut function: impl FnMut(f64) -> f64,
) -> (f64, f64) {
    let tolerance = HALF_DIGITS * (high - low);
    let (mut best, mut second, mut third) = (inside, inside, inside);
    let (mut step, mut before_last) = (0.0_f64, 0.0_f64);
    for _ in 0..SEARCH_STEPS {
        let middle = 0.5 * (low + high);
        if (best.0 - middle).abs() <= 2.0 * tolerance - 0.5 * (high - low) {
            break;
        }
        let parabola = vertex(best, second, third).map(|place| place - best.0);
        let allowed = before_last;
        before_last = step;
        step = match parabola {
            // Only inside the bracket and with shrinking steps: otherwise convergence may be slow.
            Some(step) if best.0 + step > low && best.0 + step < high && step.abs() < 0.5 * allowed.abs() => {
                let near_end =
                    best.0 + step - low < 2.0 * tolerance || high - best.0 - step < 2.0 * tolerance;
                if near_end { tolerance.copysign(middle - best.0) } else { step }
            }
            _ => {
                before_last = if best.0 < middle { high - best.0 } else { low - best.0 };
                GOLDEN * before_last
            }
        };
        let place = best.0 + if step.abs() >= tolerance { step } else { tolerance.copysign(step) };
        let trial = (place, function(place));
        if trial.1 >= best.1 {
            if place >= best.0 {
                low = best.0
            } else {
                high = best.0
            }
            (third, second, best) = (second, best, trial);
        } else {
            if place < best.0 {
                low = place
            } else {
                high = place
            }
            if trial.1 >= second.1 || second.0 == best.0 {
                (third, second) = (second, trial);
            } else if trial.1 >= third.1 || third.0 == best.0 || third.0 == second.0 {
                third = trial;
            }
        }
    }
    best
}

/// Position of the extremum of the parabola through three points; `None` if they lie on a line.
fn vertex(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> Option<f64> {
    let (to_b, to_c) = (b.0 - a.0, c.0 - a.0);
    let (p, q) = (to_b * (c.1 - a.1), to_c * (b.1 - a.1));
    let place = a.0 + 0.5 * (to_b * p - to_c * q) / (p - q);
    place.is_finite().then_some(place)
}
