//! Scales of a mechanism for error control; all follow from the scene, none is absolute. Each component has its own.

use crate::contact::pair::Surfaces;
use crate::dynamics::{Dynamics, Linearization};
use crate::error::Notice;
use crate::numerics::accuracy::EQUAL;
use crate::scene::time_function::TimeFunction;
use crate::tree::elements::{ContactScales, ContactSlot, FrameInertia, State, Tree};
use crate::tree::forces::{Ends, ForceElement, ForceLaw};
use crate::tree::kinematics::{FrameKind, Vec2};
use crate::tree::loads::Load;

/// The component of every frame that carries a body.
fn components_of_frames(tree: &Tree) -> Vec<Option<usize>> {
    let mut components = vec![None; tree.frames.len()];
    for (body, &component) in tree.bodies.iter().zip(&tree.components.of_body) {
        components[body.frame] = Some(component);
    }
    components
}

/// The forces and torques that act on a component at the start, each with the size [m] of the lever arm at which it acts as
/// a force.
struct Loads<'a> {
    forces: Vec<&'a ForceElement>,
    torques: Vec<&'a ForceElement>,
}

impl<'a> Loads<'a> {
    fn on(tree: &'a Tree, component: usize) -> Self {
        // Those of elastic elements are stiffnesses and dampings.
        let own = tree.forces.iter().filter(|element| {
            !matches!(element.law, ForceLaw::Elastic(_))
                && tree.components.of(element.bodies) == Some(component)
        });
        let (forces, torques) = own.partition(|element| matches!(element.ends, Ends::Points(_)));
        Self { forces, torques }
    }

    fn all(&self) -> impl Iterator<Item = &'a Load> {
        self.forces.iter().chain(&self.torques).flat_map(|element| element.loads.iter().flatten())
    }
}

/// Size of a force or torque at the start, or its bound.
fn size(tree: &Tree, dynamics: &Dynamics, load: &Load) -> f64 {
    match load {
        Load::Time(function) => function.scales()[0],
        Load::Motion(index) => {
            let load = &tree.motion_loads[*index];
            // A formula that has a bound may be near it later, whatever it is at the start.
            let bound = load.tape.bound();
            if bound.is_finite() { bound } else { dynamics.motion_load(load).abs().max(load.tape.largest()) }
        }
    }
}

/// Speed scale of a component [m/s], the largest of: the speed of points at the start, that of the drives at its size, that
/// of a free fall over this size, and those that applied forces and torques give its mass over it. It may be zero, as in a
/// mechanism that springs set in motion: see [`speed_from_rest`].
pub(crate) fn speed_scale(tree: &Tree, dynamics: &Dynamics, component: usize) -> f64 {
    let own = |bodies| tree.components.of(bodies) == Some(component);
    let length = tree.components.lengths[component];
    let mut speed = (tree.gravity.norm() * length).sqrt();
    for driven in tree.driven.iter().filter(|driven| own(tree.ideal_joints[driven.joint].bodies)) {
        let fastest = driven.motion.fastest(if driven.is_angle { 1.0 } else { length });
        speed = speed.max(fastest * if driven.is_angle { length } else { 1.0 });
    }
    let of_frames = components_of_frames(tree);
    for body in tree.inertias.iter().chain(&tree.driven_inertias) {
        if of_frames[body.frame] == Some(component) {
            speed = speed.max(dynamics.frame(body.frame).point(body.center).velocity.norm());
        }
    }
    for slot in tree.slots.iter().filter(|slot| own(slot.bodies)) {
        speed = speed.max(dynamics.point(slot.points[1]).velocity.norm());
    }
    let mass = tree.total_mass(component);
    let in_growing = |load: &Load, mass: f64| match load {
        Load::Time(function) => function.speed_in_growing(mass, length),
        Load::Motion(_) => 0.0,
    };
    let Loads { forces, torques } = Loads::on(tree, component);
    for element in forces {
        let loads = || element.loads.iter().flatten();
        let force: f64 = loads().map(|load| size(tree, dynamics, load)).sum();
        let growing = loads().map(|load| in_growing(load, mass));
        speed = growing.fold(speed.max((force * length / mass).sqrt()), f64::max);
    }
    for torque in torques.iter().flat_map(|element| element.loads.iter().flatten()) {
        speed = speed.max((size(tree, dynamics, torque) / mass).sqrt());
        // Like a force at a lever arm of the size of the component.
        speed = speed.max(in_growing(torque, mass * length));
    }
    speed
}

/// Speed scale [m/s] of a component without any of these: the speed after a distance of its size with the accelerations of
/// the start, after [`Dynamics::accelerate`].
pub(crate) fn speed_from_rest(tree: &Tree, dynamics: &Dynamics, component: usize) -> f64 {
    let length = tree.components.lengths[component];
    let of_frames = components_of_frames(tree);
    let own = |body: &&FrameInertia| of_frames[body.frame] == Some(component);
    let acceleration = |body: &FrameInertia| {
        let frame = dynamics.frame(body.frame);
        frame.point(body.center).acceleration.norm().max(length * frame.angular_acceleration.abs())
    };
    (tree.inertias.iter().filter(own).map(acceleration).fold(0.0, f64::max) * length).sqrt()
}

/// Levers: the largest displacement per unit of each degree of freedom [m/rad or 1] of the centers of mass
/// (or of points at the radius of gyration), of the contacts and of their surfaces; the size of its component where
/// none of them moves, as by a rod without mass.
pub(crate) fn levers(tree: &Tree, dynamics: &Dynamics, of_freedoms: &[usize]) -> Vec<f64> {
    let lengths = &tree.components.lengths;
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
    let of_frames = components_of_frames(tree);
    for body in &tree.inertias {
        let length = of_frames[body.frame].map_or(0.0, |component| lengths[component]);
        let gyration = if body.mass > 0.0 { (body.inertia / body.mass).sqrt() } else { length };
        raise(body.frame, dynamics.frame(body.frame).point(body.center).position, gyration);
    }
    for slot in &tree.slots {
        for (point, radius) in dynamics.touching_points(slot).into_iter().zip(slot.law.radii()) {
            raise(point.frame, dynamics.point(point).position, radius);
        }
    }
    for (lever, &component) in levers.iter_mut().zip(of_freedoms) {
        let length = lengths[component];
        if *lever <= f64::EPSILON * length {
            *lever = length;
        }
    }
    levers
}

/// Resting penetration relative to the clearance that is assumed if the scene has no load: nothing
/// is driven, moves or falls at the start. Half, twice: work +7, -6 % (3 of 150 runs).
const UNLOADED_PENETRATION: f64 = 1e-6;

/// Scales of the contacts of all slots, each resting under a load [N]: the larger of the force
/// that keeps the joint concentric with the accelerations of the start, after [`Dynamics::accelerate`], and
/// of the centripetal force of its mass at the speed of its component on a circle of the size of that.
///
/// The direction of the load is not known in advance. The mass is therefore the harmonic mean over all
/// directions, which hardly depends on the configuration: 0.09 kg in the paper's mechanism over a turn of the
/// crank (0.06 to 0.15 kg in the direction in which the joint opens), 0.110 to 0.112 (0.07 to 0.34) at the
/// coupler of the ready-made six-bar, 0.27 to 0.28 (0.14 to 5.1) in the quick return.
pub(crate) fn contact_scales(dynamics: &mut Dynamics, speeds: &[f64]) -> Vec<ContactScales> {
    let tree = dynamics.tree;
    let of_slot = |slot: &ContactSlot| {
        let component = tree.components.of(slot.bodies).unwrap_or_default();
        let (speed, length) = (speeds[component], tree.components.lengths[component]);
        let mut law = slot.law.normal.clone();
        let unloaded = UNLOADED_PENETRATION * slot.law.clearance;
        law.fit(unloaded);
        let (opening, mass) = opening(dynamics, slot);
        // No degree of freedom moves the two bodies relative to each other: the joint never acts, any mass
        // will do.
        let mass = if mass.is_finite() { mass } else { tree.total_mass(component).max(f64::MIN_POSITIVE) };
        let load = mass * opening.max(speed * speed / length);
        let weightless = law.stiffness * unloaded.powf(law.exponent);
        let load = if load > 0.0 { load } else { weightless };
        law.fit_to_load(load, slot.law.size());
        let resting_penetration = law.resting_penetration(load);
        ContactScales {
            component,
            mass,
            resting_penetration,
            resting_speed: resting_penetration * law.contact_frequency(load, mass),
            resting_velocity: law.resting_velocity(load, mass),
        }
    };
    tree.slots.iter().map(of_slot).collect()
}

/// Relative acceleration [m/s²] with which a contact opens, after [`Dynamics::accelerate`], and its mass [kg].
fn opening(dynamics: &mut Dynamics, slot: &ContactSlot) -> (f64, f64) {
    let acceleration = dynamics.slot_motion(slot).acceleration;
    let accelerance = dynamics.accelerance(dynamics.touching_points(slot));
    match slot.law.surfaces {
        Surfaces::Bearing { .. } | Surfaces::Worn(_) => (acceleration.norm(), accelerance.mean_mass()),
        // A face has one direction.
        Surfaces::Face(face) => {
            let along = acceleration.dot(&Vec2::from(face.normal)).abs();
            (along, accelerance.mass_along(dynamics.slot_normal(slot)))
        }
    }
}

/// Size [m] of a component of which the scene gives no length, from its motion at the start. Where that says nothing, an
/// error: a notice if forces depend on the motion or on time, none if no error depends on the size.
// Long because every way to a length stands beside the others.
pub(crate) fn length_of_motion(tree: &Tree, start: &State, component: usize) -> Result<f64, Option<Notice>> {
    let State { q, v } = start;
    let d = tree.free.len();
    let mut dynamics = Dynamics::new(tree);
    dynamics.move_to(0.0, q, v);
    dynamics.settle_switches();
    let mut linear = Linearization::new(d);
    let is_known = dynamics.linearize(0.0, q, v, &mut linear);
    dynamics.accelerate(&linear.a);
    let mass = tree.total_mass(component);
    let loads = Loads::on(tree, component);
    let force = loads.forces.iter().flat_map(|element| element.loads.iter().flatten());
    // What a force that varies with time reaches, and how fast.
    let varying = force.filter_map(|load| match load {
        Load::Time(
            function @ (TimeFunction::Harmonic { .. } | TimeFunction::Formula(_) | TimeFunction::Table(_)),
        ) => {
            let [value, rate] = function.scales();
            Some([value / mass, rate / mass])
        }
        _ => None,
    });
    let [applied, growth] = varying.fold([0.0_f64; 2], |[a, b], [c, d]| [a.max(c), b.max(d)]);
    let of_columns = tree.components_of_columns();
    let slides = |&k: &usize| {
        let column = tree.free[k];
        of_columns[column] == component && matches!(tree.frames[column + 1].kind, FrameKind::Prismatic { .. })
    };
    let fastest = (0..d).filter(slides).map(|k| v[k].abs()).fold(0.0, f64::max);
    let mut length = 0.0_f64;
    for k in (0..d).filter(slides).filter(|_| is_known) {
        // A body that is at rest but for rounding errors has no speed.
        let speed = if v[k].abs() > EQUAL * fastest { v[k].abs() } else { 0.0 };
        let acceleration = linear.a[k].abs().max(applied);
        let [stiff, damped] = [linear.a_q[k * d + k].abs(), linear.a_v[k * d + k].abs()];
        // How far a spring lets it move, or a damper; or how high it flies.
        let [from_force, from_speed] = if stiff > 0.0 {
            [acceleration / stiff, speed / stiff.sqrt()]
        } else if damped > 0.0 {
            [acceleration / (damped * damped), speed / damped]
        } else {
            [applied * (applied / growth).powi(2), speed * speed / acceleration]
        };
        let lengths = [from_force, from_speed].into_iter().filter(|length| length.is_finite());
        length = lengths.fold(length, f64::max);
    }
    for slot in tree.slots.iter().filter(|slot| tree.components.of(slot.bodies) == Some(component)) {
        let (opening, mass) = opening(&mut dynamics, slot);
        let law = &slot.law.normal;
        if law.formula().is_none() && mass.is_finite() {
            let rate = dynamics.slot_motion(slot).rate.norm();
            length = length.max(law.resting_penetration(mass * opening.max(applied)));
            length = length.max(law.impact_penetration(mass, rate));
        }
    }
    if length > 0.0 {
        return Ok(length);
    }
    let is_constant = |load: &Load| match load {
        Load::Time(TimeFunction::Polynomial(coefficients)) => {
            coefficients.iter().skip(1).all(|coefficient| *coefficient == 0.0)
        }
        Load::Time(_) | Load::Motion(_) => false,
    };
    if !(0..d).any(|k| slides(&k)) || loads.all().all(is_constant) {
        // Angles have no length; or nothing moves, or all goes on as at the start.
        return Err(None);
    }
    let index = tree.components.of_body.iter().position(|of| *of == component).unwrap_or_default();
    let text = format!(
        "{:?} has no size: its points all lie in one place, and neither springs nor its motion at the start give a length. \
         Tolerances are those of a body of 1 m; name a point at its edge, or give position_tolerance",
        tree.bodies[index].name
    );
    Err(Some(Notice::of_field("no_size", format!("bodies[{index}].points"), Vec::new(), text)))
}
