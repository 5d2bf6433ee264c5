//! The fastest rate of a motion, from two states that belong to the same instant and differ mainly by its fastest component.

/// Relative difference of two states that may be a rounding error. Half, twice: the same work (23 of 138 runs).
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Sum of the squares of weighted values.
#[inline(always)]
pub(super) fn squares(weights: &[f64], values: impl Iterator<Item = f64>) -> f64 {
    weights.iter().zip(values).map(|(weight, value)| (weight * value).powi(2)).sum()
}

/// The square root of |Δa|/|Δq|, of sums of weighted squares of the differences of accelerations, positions and velocities:
/// the frequency of an oscillation or the rate of a damping, independent of the units [1/s]. Where the positions differ by
/// rounding alone it is |Δa|/|Δv|; zero where the velocities do as well.
#[inline(always)]
pub(super) fn fastest_rate(
    [accelerations, positions, velocities]: [f64; 3],
    weights: &[f64],
    (q, v): (&[f64], &[f64]),
) -> f64 {
    let rounding_of = |values: &[f64]| squares(weights, values.iter().map(|value| ROUNDING * value));
    // The sums are squares of norms, so each rate takes one more square root.
    if positions > rounding_of(q) {
        (accelerations / positions).sqrt().sqrt()
    } else if velocities > rounding_of(v) {
        (accelerations / velocities).sqrt()
    } else {
        0.0
    }
}
