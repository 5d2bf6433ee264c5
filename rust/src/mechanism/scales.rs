//! Scales of a mechanism for error control; all follow from the scene, none is absolute.

use crate::contact::pair::Surfaces;
use crate::dynamics::Dynamics;
use crate::tree::elements::{ContactScales, ContactSlot, FrameInertia, Tree};
use crate::tree::kinematics::{FrameKind, Vec2};
use crate::tree::loads::Load;

/// Speed scale [m/s], the largest of: the speed of points at the start, that of the drives at the size of the
/// mechanism, that of a free fall over this size, and those that applied forces and torques give the total
/// mass over it. It may be zero, as in a mechanism that springs set in motion: see [`speed_from_rest`].
pub(crate) fn speed_scale(tree: &Tree, dynamics: &Dynamics, length: f64) -> f64 {
    let mut speed = (tree.gravity.norm() * length).sqrt();
    for driven in &tree.driven {
        let fastest = driven.motion.fastest(if driven.is_angle { 1.0 } else { length });
        speed = speed.max(fastest * if driven.is_angle { length } else { 1.0 });
    }
    for body in tree.inertias.iter().chain(&tree.driven_inertias) {
        speed = speed.max(dynamics.frame(body.frame).point(body.center).velocity.norm());
    }
    for slot in &tree.slots {
        speed = speed.max(dynamics.point(slot.points[1]).velocity.norm());
    }
    let mass = tree.total_mass(length);
    let size = |load: &Load| match load {
        Load::Time(function) => function.scales()[0],
        Load::Motion(index) => {
            let load = &tree.motion_loads[*index];
            // A formula that has a bound may be near it later, whatever it is at the start.
            let bound = load.tape.bound();
            if bound.is_finite() { bound } else { dynamics.motion_load(load).abs().max(load.tape.largest()) }
        }
    };
    let in_growing = |load: &Load, mass: f64| match load {
        Load::Time(function) => function.speed_in_growing(mass, length),
        Load::Motion(_) => 0.0,
    };
    for applied in &tree.applied_forces {
        let force: f64 = applied.components.iter().map(size).sum();
        let growing = applied.components.iter().map(|component| in_growing(component, mass));
        speed = growing.fold(speed.max((force * length / mass).sqrt()), f64::max);
    }
    for pull in &tree.pulls {
        speed = speed.max((size(&pull.tension) * length / mass).sqrt()).max(in_growing(&pull.tension, mass));
    }
    for applied in &tree.applied_torques {
        speed = speed.max((size(&applied.torque) / mass).sqrt());
        // Like a force at a lever arm of the size of the mechanism.
        speed = speed.max(in_growing(&applied.torque, mass * length));
    }
    speed
}

/// Speed scale [m/s] of a mechanism without any of these: the speed after a distance of its size with the
/// accelerations of the start, after [`Dynamics::accelerate`].
pub(crate) fn speed_from_rest(tree: &Tree, dynamics: &Dynamics, length: f64) -> f64 {
    let acceleration = |body: &FrameInertia| {
        let frame = dynamics.frame(body.frame);
        frame.point(body.center).acceleration.norm().max(length * frame.angular_acceleration.abs())
    };
    (tree.inertias.iter().map(acceleration).fold(0.0, f64::max) * length).sqrt()
}

/// Levers: the largest displacement per unit of each degree of freedom [m/rad or 1] of the centers of mass
/// (or of points at the radius of gyration), of the contacts and of their surfaces; the size of the mechanism where
/// none of them moves, as by a rod without mass.
pub(crate) fn levers(tree: &Tree, dynamics: &Dynamics, length: f64) -> Vec<f64> {
    let mut levers = vec![0.0_f64; tree.free.len()];
    let mut raise = |frame: usize, point: Vec2, radius: f64| {
        for &(column, freedom) in &tree.paths[frame].free {
            let lever = match tree.frames[column + 1].kind {
                FrameKind::Revolute => (point - dynamics.frame(column + 1).position).norm().max(radius),
                FrameKind::Prismatic { .. } => 1.0,
            };
            levers[freedom] = levers[freedom].max(lever);
        }
    };
    for body in &tree.inertias {
        let gyration = if body.mass > 0.0 { (body.inertia / body.mass).sqrt() } else { length };
        raise(body.frame, dynamics.frame(body.frame).point(body.center).position, gyration);
    }
    for slot in &tree.slots {
        for (point, radius) in dynamics.touching_points(slot).into_iter().zip(slot.law.radii()) {
            raise(point.frame, dynamics.point(point).position, radius);
        }
    }
    levers.iter_mut().filter(|lever| **lever <= f64::EPSILON * length).for_each(|lever| *lever = length);
    levers
}

/// Resting penetration relative to the clearance that is assumed if the scene has no load: nothing
/// is driven, moves or falls at the start. Half, twice: work +7, -6 % (3 of 150 runs).
const UNLOADED_PENETRATION: f64 = 1e-6;

/// Scales of the contacts of all slots, each resting under a load [N]: the larger of the force
/// that keeps the joint concentric with the accelerations of the start, after [`Dynamics::accelerate`], and
/// of the centripetal force of its mass at the speed of the mechanism on a circle of its size.
///
/// The direction of the load is not known in advance. The mass is therefore the harmonic mean over all
/// directions, which hardly depends on the configuration: 0.09 kg in the paper's mechanism over a turn of the
/// crank (0.06 to 0.15 kg in the direction in which the joint opens), 0.110 to 0.112 (0.07 to 0.34) at the
/// coupler of the ready-made six-bar, 0.27 to 0.28 (0.14 to 5.1) in the quick return.
pub(crate) fn contact_scales(dynamics: &mut Dynamics, speed: f64, length: f64) -> Vec<ContactScales> {
    let tree = dynamics.tree;
    let total = tree.total_mass(length);
    let of_slot = |slot: &ContactSlot| {
        let mut law = slot.law.normal.clone();
        let unloaded = UNLOADED_PENETRATION * slot.law.clearance;
        law.fit(unloaded);
        let acceleration = dynamics.slot_motion(slot).acceleration;
        let accelerance = dynamics.accelerance(dynamics.touching_points(slot));
        let (opening, mass) = match slot.law.surfaces {
            Surfaces::Bearing { .. } | Surfaces::Worn(_) => (acceleration.norm(), accelerance.mean_mass()),
            // A face has one direction.
            Surfaces::Face(face) => {
                let along = acceleration.dot(&Vec2::from(face.normal)).abs();
                (along, accelerance.mass_along(dynamics.slot_normal(slot)))
            }
        };
        // No degree of freedom moves the two bodies relative to each other: the joint never acts, any mass
        // will do.
        let mass = if mass.is_finite() { mass } else { total.max(f64::MIN_POSITIVE) };
        let load = mass * opening.max(speed * speed / length);
        let weightless = law.stiffness * unloaded.powf(law.exponent);
        let load = if load > 0.0 { load } else { weightless };
        law.fit_to_load(load, slot.law.size());
        let resting_penetration = law.resting_penetration(load);
        ContactScales {
            mass,
            resting_penetration,
            resting_speed: resting_penetration * law.contact_frequency(load, mass),
            resting_velocity: law.resting_velocity(load, mass),
        }
    };
    tree.slots.iter().map(of_slot).collect()
}
