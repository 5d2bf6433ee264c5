//! Maximum of a function within a bracket.

/// Accuracy of the position of the maximum relative to the bracket: that of the value is its square.
const PLACE: f64 = 1e-7;
/// Most evaluations: sections alone would need 34.
const EVALUATIONS: usize = 40;
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
    let tolerance = PLACE * (high - low);
    let (mut best, mut second, mut third) = (inside, inside, inside);
    let (mut step, mut before_last) = (0.0_f64, 0.0_f64);
    for _ in 0..EVALUATIONS {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tops_of_known_functions_are_found() {
        for k in 0..100 {
            let top = 0.01 + 0.0098 * f64::from(k);
            let functions: [&dyn Fn(f64) -> f64; 4] = [
                &|x| 3.0 - (x - top).powi(2),
                &|x| (2.5 * (x - top)).cos(),
                &|x| -(x - top).abs().powf(1.5),
                &|x| -(x - top).abs(),
            ];
            for (index, function) in functions.iter().enumerate() {
                let middle = 0.5;
                let mut count = 0;
                let (place, value) = highest_within([0.0, 1.0], (middle, function(middle)), |x| {
                    count += 1;
                    function(x)
                });
                assert!((place - top).abs() < 2e-6, "{index}: {place} instead of {top}");
                assert!(
                    function(top) - value < 2e-6_f64.powf([2.0, 2.0, 1.5, 1.0][index]),
                    "{index} {value}"
                );
                assert!(count <= EVALUATIONS);
            }
        }
    }

    #[test]
    fn a_top_at_an_end_is_met_to_the_tolerance() {
        let (place, _) = highest_within([1.0, 3.0], (2.0, 2.0), |x| x);
        assert!(place > 3.0 - 1e-5, "{place}");
    }
}
