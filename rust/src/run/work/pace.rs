//! How far drives may move in one piece of a run: of the continuation of a kinematic solution, and of the work.

use crate::mechanism::compiled::Mechanism;
use crate::scene::time_function::TimeFunction;
use crate::tree::elements::DrivenCoordinate;

/// Rotation of a drive [rad] over which Gauss's quadrature with four points integrates its power to rounding.
/// Half changes one of 97 runs, in its last digits, twice none.
const WORK_ROTATION: f64 = 0.5;

/// Length [s] of the next step after one of length `last` (NaN for none): until a drive
/// has rotated by `largest_rotation` [rad], or slid by the same fraction of the size of the mechanism.
pub(crate) fn continued(mechanism: &Mechanism, t: f64, last: f64, largest_rotation: f64) -> f64 {
    let mut step = if last.is_nan() {
        first_rotation(mechanism, largest_rotation)
    } else {
        // Limited growth: a step over a whole oscillation would show no displacement.
        shortest_drive_time(mechanism).min(2.0 * last)
    };
    for driven in &mechanism.driven {
        let largest = largest_motion(mechanism, driven, largest_rotation);
        let start = driven.motion.at(t)[0];
        while step.is_finite() && t + step > t {
            let ahead = [0.25, 0.5, 0.75, 1.0].map(|part| driven.motion.at(t + part * step)[0]);
            let moved = ahead.iter().map(|position| (position - start).abs()).fold(0.0, f64::max);
            if moved <= largest {
                break;
            }
            step *= (0.9 * largest / moved).max(0.1);
        }
    }
    resolved(t, step)
}

/// Length [s] of the piece of a step from `t` on, at most `most` [s], over which Gauss's quadrature integrates the powers of
/// the drives to rounding; `uniform` is [`uniform_piece`].
pub(crate) fn piece_of_work(mechanism: &Mechanism, uniform: Option<f64>, t: f64, most: f64) -> f64 {
    match uniform {
        Some(piece) => resolved(t, piece),
        None => resolved(t, continued(mechanism, t, f64::NAN, WORK_ROTATION).min(within(mechanism, t, most))),
    }
}

/// Length [s] of the piece from `t` on, at most `most` [s], in which no drive by a formula moves too far.
fn within(mechanism: &Mechanism, t: f64, most: f64) -> f64 {
    let mut step = most;
    for driven in mechanism.driven.iter().filter(|driven| is_formula(driven)) {
        let largest = largest_motion(mechanism, driven, WORK_ROTATION);
        let moves_too_far = |step: f64| {
            let ranges = driven.motion.ranges::<2>(t, t + step);
            ranges.is_some_and(|[_, rate]| rate.magnitude() * step > largest)
        };
        while t + step > t && moves_too_far(step) {
            step *= 0.5;
        }
    }
    step
}

fn is_formula(driven: &DrivenCoordinate) -> bool {
    matches!(driven.motion, TimeFunction::Formula(_))
}

/// Length [s] of the pieces in which drives at constant speed are resolved, the same at all times; `None` if a
/// drive changes its speed.
pub(crate) fn uniform_piece(mechanism: &Mechanism) -> Option<f64> {
    let is_uniform = mechanism.driven.iter().all(|driven| driven.motion.is_linear());
    is_uniform.then(|| first_rotation(mechanism, WORK_ROTATION))
}

/// Time [s] from zero until a drive has rotated by `largest_rotation` [rad], or slid likewise.
fn first_rotation(mechanism: &Mechanism, largest_rotation: f64) -> f64 {
    let time = |driven: &DrivenCoordinate| {
        driven.motion.time_to_move(largest_motion(mechanism, driven, largest_rotation))
    };
    // How fast formulas are at their fastest is not known; what they do ahead is looked at.
    let known = mechanism.driven.iter().filter(|driven| !is_formula(driven));
    known.map(time).fold(shortest_drive_time(mechanism), f64::min)
}

/// Largest motion of a drive in one step: an angle [rad], or the same fraction of the size of its component [m].
fn largest_motion(mechanism: &Mechanism, driven: &DrivenCoordinate, largest_rotation: f64) -> f64 {
    let component = mechanism.components.of(mechanism.ideal_joints[driven.joint].bodies).unwrap_or_default();
    largest_rotation * if driven.is_angle { 1.0 } else { mechanism.scales.components[component].length }
}

/// Longest step [s] for which no function of time in the scene is too fast.
fn shortest_drive_time(mechanism: &Mechanism) -> f64 {
    mechanism.time_functions().map(|(_, function)| function.pace()).fold(f64::INFINITY, f64::min)
}

/// The step [s]; one unit in the last place of the time where the motion is too fast for its resolution.
fn resolved(t: f64, step: f64) -> f64 {
    if t + step > t { step } else { t.next_up() - t }
}
