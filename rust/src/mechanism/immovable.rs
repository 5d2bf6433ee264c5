//! Why an assembled mechanism has no start accelerations.

use crate::dynamics::Dynamics;
use crate::error::{InputError, Problem, Subject};
use crate::tree::elements::Tree;

/// The reason, in the present configuration and with the velocities `v` of the free coordinates.
pub(crate) fn no_acceleration(tree: &Tree, dynamics: &mut Dynamics, v: &[f64]) -> InputError {
    if !dynamics.is_regular() {
        let problem = |index: usize| {
            let body = &tree.bodies[index];
            let field = if body.mass == 0.0 { "mass" } else { "inertia" };
            let message = format!(
                "{:?} moves where no mass moves with it, so that its acceleration is not determined: it needs a mass (and \
                 a moment of inertia if it can turn alone), or ideal joints and couplings that tie its motion to bodies \
                 that have them",
                body.name
            );
            Problem::new(format!("bodies[{index}].{field}"), message)
        };
        let problems: Vec<Problem> = dynamics.bodies_without_inertia().into_iter().map(problem).collect();
        if let Err(error) = Subject::Scene.judge((), problems) {
            return error;
        }
        return Subject::Scene.error("bodies", "the mass matrix is singular in the assembled configuration");
    }
    // Accelerations contain squares of velocities.
    let overflows = |rate: f64| !(rate * rate).is_finite();
    for driven in &tree.driven {
        let [_, rate, ..] = driven.motion.at(0.0);
        if overflows(rate) {
            let unit = if driven.is_angle { "rad/s" } else { "m/s" };
            let message = format!(
                "{:?} starts at {rate:.3e} [{unit}]: its accelerations are not finite numbers",
                driven.name
            );
            return Subject::Scene.error("drives", message);
        }
    }
    if let Some(rate) = v.iter().find(|rate| overflows(**rate)) {
        let message = format!(
            "starts a coordinate at {rate:.3e} [rad/s or m/s]: its accelerations are not finite numbers"
        );
        return Subject::Scene.error("start", message);
    }
    Subject::Scene.error(
        "bodies",
        "the start accelerations are not finite numbers: masses and lengths are too small for the forces, or these \
         are too large",
    )
}
