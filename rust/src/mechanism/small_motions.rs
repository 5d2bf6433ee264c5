//! Small motions about a state: the exact derivatives of the accelerations, the closures, and how bodies move with the
//! coordinates. In: a mechanism and a state; out: matrices, from which modes follow.

use crate::contact::friction::JointPhase;
use crate::contact::pair::Phase;
use crate::dynamics::{Dynamics, Linearization};
use crate::error::{InputError, Subject};
use crate::mechanism::compiled::Mechanism;
use crate::numerics::turns::Turns;
use crate::tree::elements::State;

/// A mechanism linearized about a state.
#[derive(Clone, Debug, Default)]
pub struct SmallMotions {
    /// Accelerations and their derivatives with respect to the free coordinates and their velocities.
    pub linear: Linearization,
    /// Derivatives of the gaps of the loop closures, then of the couplings, with respect to the free coordinates, row-major.
    pub closures: Vec<f64>,
    /// Derivatives of position x, y [m] and angle [rad] of every body with respect to the free coordinates, row-major.
    pub bodies: Vec<f64>,
    /// Position x, y [m] and angle [rad] of every body.
    pub poses: Vec<[f64; 3]>,
}

/// Linearizes a mechanism in a state at an instant [s], with the contacts in these phases, the ideal joints with friction likewise, and the full turns that were
/// subtracted from its coordinates.
///
/// # Errors
/// A state without accelerations.
pub fn small_motions(
    mechanism: &Mechanism,
    t: f64,
    State { q, v }: &State,
    (phases, joint_phases, turns): (&[Phase], &[JointPhase], &[Turns]),
) -> Result<SmallMotions, InputError> {
    let d = mechanism.degrees_of_freedom();
    let mut dynamics = Dynamics::new(mechanism);
    dynamics.phases.copy_from_slice(phases);
    dynamics.turns.copy_from_slice(turns);
    dynamics.set_joint_phases(joint_phases);
    dynamics.move_to(t, q, v);
    dynamics.settle_switches();
    let mut linear = Linearization::new(d);
    if !dynamics.linearize(t, q, v, &mut linear) {
        return Err(Subject::Start.error("state", "has no accelerations: a loop passes a dead center"));
    }
    let mut closures = Vec::new();
    for closure in &mechanism.closures {
        let columns = dynamics.gap_columns([closure.a, closure.b]);
        for axis in 0..2 {
            closures.extend(mechanism.free.iter().map(|&column| columns[column][axis]));
        }
    }
    for coupling in &mechanism.couplings {
        let columns = dynamics.coupling_columns(coupling);
        closures.extend(mechanism.free.iter().map(|&column| columns[column]));
    }
    let places = |dynamics: &mut Dynamics, v: &[f64]| -> Vec<[f64; 3]> {
        dynamics.move_to(t, q, v);
        let bodies = mechanism.bodies.iter().map(|body| {
            let frame = dynamics.frame(body.frame);
            let velocity = frame.point(body.origin).velocity;
            [velocity.x, velocity.y, frame.angular_velocity]
        });
        bodies.collect()
    };
    let mut bodies = vec![0.0; 3 * mechanism.bodies.len() * d];
    let mut unit = vec![0.0; d];
    // Drives move bodies too.
    let still = places(&mut dynamics, &unit);
    for k in 0..d {
        unit.fill(0.0);
        unit[k] = 1.0;
        for (body, (moved, still)) in places(&mut dynamics, &unit).iter().zip(&still).enumerate() {
            for axis in 0..3 {
                bodies[(3 * body + axis) * d + k] = moved[axis] - still[axis];
            }
        }
    }
    let poses = mechanism.bodies.iter().map(|body| dynamics.body_pose(body)).collect();
    Ok(SmallMotions { linear, closures, bodies, poses })
}
