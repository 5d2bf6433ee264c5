//! The sizes of a mechanism by which errors are judged; all come from the scene, none is absolute.

use crate::dynamics::Dynamics;
use crate::mechanism::compiled::{FrameInertia, Mechanism};
use crate::mechanism::kinematics::{FrameKind, Vec2};
use crate::numerics::linear::symmetric_solve;
use crate::scene::parts::{Joint, Scene, extent};

/// Largest distance between two points of a body, or of ground; a joint's radius if all points
/// coincide; 1 m in a scene without any length.
pub(crate) fn length_scale(scene: &Scene) -> f64 {
    let mut length = extent(scene.ground.iter().map(|point| point.position));
    for body in &scene.bodies {
        length = length.max(body.extent());
    }
    for joint in &scene.joints {
        if let Joint::Clearance { journal_radius, .. } = joint {
            length = length.max(*journal_radius);
        }
    }
    if length > 0.0 { length } else { 1.0 }
}

/// Fastest of: the points at the start, the drives over the size of the mechanism, a free fall over
/// it, what the given forces and torques can do in it. A mechanism that nothing of this moves, as
/// one that springs set off, has the speed its start accelerations give it over its size.
pub(crate) fn speed_scale(mechanism: &Mechanism, dynamics: &Dynamics, length: f64) -> f64 {
    let mut speed = (mechanism.gravity.norm() * length).sqrt();
    for driven in &mechanism.driven {
        let [_, rate] = driven.motion.scales();
        speed = speed.max(rate * if driven.turns { length } else { 1.0 });
    }
    for body in mechanism.inertias.iter().chain(&mechanism.driven_inertias) {
        speed = speed.max(dynamics.frame(body.frame).point(body.center).velocity.norm());
    }
    for joint in &mechanism.clearance_joints {
        speed = speed.max(dynamics.point(joint.journal).velocity.norm());
    }
    let mass = total_mass(mechanism);
    for applied in &mechanism.applied_forces {
        let force: f64 = applied.components.iter().map(|component| component.scales()[0]).sum();
        speed = speed.max((force * length / mass).sqrt());
    }
    for applied in &mechanism.applied_torques {
        speed = speed.max((applied.torque.scales()[0] / mass).sqrt());
    }
    speed
}

/// The same from the accelerations that [`Dynamics::accelerate`] gave the bodies.
pub(crate) fn speed_from_rest(mechanism: &Mechanism, dynamics: &Dynamics, length: f64) -> f64 {
    let acceleration = |body: &FrameInertia| {
        let frame = dynamics.frame(body.frame);
        frame.point(body.center).acceleration.norm().max(length * frame.angular_acceleration.abs())
    };
    (mechanism.inertias.iter().map(acceleration).fold(0.0, f64::max) * length).sqrt()
}

fn total_mass(mechanism: &Mechanism) -> f64 {
    mechanism.bodies.iter().map(|body| body.mass).sum()
}

/// How far [m] a unit of each degree of freedom moves the points that matter: centres of mass,
/// clearance joints and their surfaces.
pub(crate) fn levers(mechanism: &Mechanism, dynamics: &Dynamics) -> Vec<f64> {
    let mut levers = vec![0.0_f64; mechanism.free.len()];
    let mut raise = |frame: usize, point: Vec2, radius: f64| {
        for &(column, freedom) in &mechanism.paths[frame].free {
            let lever = match mechanism.frames[column + 1].kind {
                FrameKind::Revolute => (point - dynamics.frame(column + 1).position).norm().max(radius),
                FrameKind::Prismatic { .. } => 1.0,
            };
            levers[freedom] = levers[freedom].max(lever);
        }
    };
    for body in &mechanism.inertias {
        let gyration = (body.inertia / body.mass).sqrt();
        raise(body.frame, dynamics.frame(body.frame).point(body.center).position, gyration);
    }
    for joint in &mechanism.clearance_joints {
        raise(joint.bearing.frame, dynamics.point(joint.bearing).position, joint.law.bearing_radius);
        raise(joint.journal.frame, dynamics.point(joint.journal).position, joint.law.journal_radius);
    }
    levers
}

/// For every clearance joint the mass its contact accelerates [kg] and the load [N] that would
/// keep it concentric, in the direction in which it starts to open.
pub(crate) fn effective_masses(
    mechanism: &Mechanism,
    dynamics: &mut Dynamics,
    q: &[f64],
    v: &[f64],
    a: &[f64],
) -> Vec<(f64, f64)> {
    let d = a.len();
    let factor = dynamics.mass_factor().to_vec();
    dynamics.move_to(0.0, q, v);
    dynamics.accelerate(a);
    let mass_along = |columns: &[Vec2], direction: Vec2| {
        let row: Vec<f64> = mechanism.free.iter().map(|&column| columns[column].dot(&direction)).collect();
        let mut solved = row.clone();
        symmetric_solve(&factor, d, &mut solved);
        let compliance: f64 = row.iter().zip(&solved).map(|(a, b)| a * b).sum();
        1.0 / compliance
    };
    let total = total_mass(mechanism);
    mechanism
        .clearance_joints
        .iter()
        .map(|joint| {
            let columns = dynamics.gap_columns([joint.bearing, joint.journal]);
            let opening = dynamics.joint_motion(joint).acceleration;
            let opens = opening.norm() > 0.0;
            let direction = if opens { opening.normalize() } else { Vec2::x() };
            let mut mass = mass_along(&columns, direction);
            if !opens || !mass.is_finite() {
                let other = mass_along(&columns, Vec2::y());
                mass = if mass.is_finite() { mass.min(other) } else { other };
            }
            // Two bodies that nothing free moves: the joint never acts, any mass will do.
            let mass = if mass.is_finite() { mass } else { total.max(f64::MIN_POSITIVE) };
            (mass, mass * opening.norm())
        })
        .collect()
}

/// Penetration relative to the clearance that stands for the load of a scene in which nothing
/// is driven, moves or falls at the start.
const UNLOADED_PENETRATION: f64 = 1e-6;

/// Sets the constants of the clearance joints that depend on their `masses` and loads.
pub(crate) fn set_contact_scales(
    mechanism: &mut Mechanism,
    masses: Vec<(f64, f64)>,
    speed: f64,
    length: f64,
) {
    for (joint, (mass, load)) in mechanism.clearance_joints.iter_mut().zip(masses) {
        joint.effective_mass = mass;
        let weightless = joint.law.normal.stiffness
            * (UNLOADED_PENETRATION * joint.law.clearance).powf(joint.law.normal.exponent);
        let load = load.max(mass * speed * speed / length);
        let load = if load > 0.0 { load } else { weightless };
        joint.resting_penetration = joint.law.normal.resting_penetration(load);
        joint.resting_speed = joint.resting_penetration * joint.law.normal.contact_frequency(load, mass);
        if joint.impact_velocity_floor.is_nan() {
            joint.impact_velocity_floor = joint.law.normal.resting_velocity(load, mass);
        }
    }
}
