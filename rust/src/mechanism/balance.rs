//! What of a start may not be meant: rest in an unstable equilibrium, which only rounding errors set in motion; springs
//! that cannot do what they are for, mostly because of N/mm for N/m or of an unloaded length that is too short.

use crate::numerics::accuracy::{EQUAL, NEWTON_STEPS};
use nalgebra::{DMatrix, Schur};

use crate::contact::pair::Surfaces;
use crate::dynamics::{Dynamics, Linearization};
use crate::error::Notice;
use crate::mechanism::assembly::{Assembled, assembled_tree};
use crate::scene::parts::{Drive, GuideShape, Joint, JointKind, Scene, Start};
use crate::scene::plausibility::short;
use crate::tree::elements::{ContactSlot, Scales, State, Tree};
use crate::tree::forces::Link;
use crate::tree::kinematics::Vec2;

/// Growth rate of a deviation that counts as unstable, times the time in which the mechanism moves by its own
/// size. A slider pushed along its dead center has 0.3 to 3; in neutral equilibrium rounding gives 1e-8.
/// Half and twice change nothing.
const UNSTABLE: f64 = 1e-3;
/// Warning of a start at rest in an unstable equilibrium. It is judged without clearances: a journal in free
/// flight carries no load, but later carries that of the ideal joint.
pub(crate) fn warning_of_equilibrium(
    tree: &Tree,
    start: &State,
    scales: &Scales,
    scene: &Scene,
) -> Option<Notice> {
    let rests = |scales: &Scales, start: &State, index: usize| {
        let speed = scales.components[index].speed;
        speed > 0.0 && scales.largest(index, &start.v) <= EQUAL * speed
    };
    if !(0..scales.components.len()).any(|index| rests(scales, start, index)) {
        return None;
    }
    let ideal =
        if tree.slots.is_empty() { None } else { Some(assembled_tree(&without_play(scene), &[]).ok()?) };
    let (tree, start, scales) = match &ideal {
        None => (tree, start, scales),
        Some((tree, Assembled { start, scales, .. })) => (tree, start, scales),
    };
    let linear = linearized(tree, start)?;
    let resting = (0..scales.components.len()).filter(|&index| rests(scales, start, index));
    let growth = resting.filter_map(|index| growth(&linear, scales, index)).reduce(f64::max)?;
    let tenfold = std::f64::consts::LN_10 / growth;
    Some(Notice::of_field(
        "unstable_start",
        "start",
        vec![("tenfold", tenfold)],
        format!(
            "the mechanism starts at rest in an unstable equilibrium, such as an upright pendulum or a crank at \
             a dead center: a deviation grows tenfold in {tenfold:.2e} s, and rounding errors alone decide when and in \
             which direction it leaves; start it a little beside"
        ),
    ))
}

/// The motion of a tree linearized about its start, if that has accelerations.
fn linearized(tree: &Tree, State { q, v }: &State) -> Option<Linearization> {
    let mut dynamics = Dynamics::new(tree);
    dynamics.move_to(0.0, q, v);
    dynamics.settle_switches();
    let mut linear = Linearization::new(tree.degrees_of_freedom());
    dynamics.linearize(0.0, q, v, &mut linear).then_some(linear)
}

/// Rate [1/s] at which a deviation of a component from the start grows, if that is an unstable equilibrium.
fn growth(linear: &Linearization, scales: &Scales, component: usize) -> Option<f64> {
    let freedoms: Vec<usize> =
        (0..scales.levers.len()).filter(|&k| scales.of_freedoms[k] == component).collect();
    let (d, all) = (freedoms.len(), scales.levers.len());
    let of = &scales.components[component];
    let crossing = of.crossing();
    let acceleration = of.length / (crossing * crossing);
    if d == 0 || scales.largest(component, &linear.a) > EQUAL * acceleration {
        return None;
    }
    // (q, v)' = (v, a_q q + a_v v), in units of the crossing time.
    let matrix =
        DMatrix::from_fn(2 * d, 2 * d, |row, column| match (row.checked_sub(d), column.checked_sub(d)) {
            (None, Some(column)) => f64::from(u8::from(row == column)),
            (None, None) => 0.0,
            (Some(row), None) => linear.a_q[freedoms[row] * all + freedoms[column]] * crossing * crossing,
            (Some(row), Some(column)) => linear.a_v[freedoms[row] * all + freedoms[column]] * crossing,
        });
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let eigenvalues = Schur::try_new(matrix, f64::EPSILON, NEWTON_STEPS * d)?.complex_eigenvalues();
    let growth = eigenvalues.iter().map(|value| value.re).fold(0.0, f64::max);
    (growth > UNSTABLE).then_some(growth / crossing)
}

/// The scene with ideal joints in place of clearance joints.
fn without_play(scene: &Scene) -> Scene {
    let joints = scene.joints.iter().map(|joint| match joint {
        Joint::Clearance { name, bearing, journal, .. } => Joint::Ideal {
            name: name.clone(),
            a: bearing.clone(),
            b: journal.clone(),
            kind: JointKind::Revolute,
            friction: None,
        },
        // Without its faces a pin in a slot would be free, and a stop never acts in an equilibrium.
        Joint::Guide { name, a, b, axis, shape: GuideShape::Block { angle, .. }, .. } => Joint::Ideal {
            name: name.clone(),
            a: a.clone(),
            b: b.clone(),
            kind: JointKind::Prismatic { axis: *axis, angle: *angle },
            friction: None,
        },
        Joint::Ideal { .. } | Joint::Guide { .. } => joint.clone(),
    });
    let with_play = |start: &&Start| matches!(start, Start::Clearance { .. } | Start::Guide { .. });
    let start = scene.start.iter().filter(|start| !with_play(start)).cloned();
    Scene { joints: joints.collect(), start: start.collect(), ..scene.clone() }
}

/// Part of the weight of a body below which a spring carries none of it, stretched by the whole of its length: one
/// that carries the body stretches by a part of its length, and a stiffness in N/mm is a thousand times too small.
const FEEBLE: f64 = 0.1;

/// Warnings of springs at the start: those too weak for a weight or for a follower, and those that pull apart what
/// they should press together.
pub(super) fn warnings_of_springs(tree: &Tree, start: &State, scene: &Scene) -> Vec<Notice> {
    if tree.links.is_empty() {
        return Vec::new();
    }
    let mut dynamics = Dynamics::new(tree);
    dynamics.move_to(0.0, &start.q, &start.v);
    let springs = tree.links.iter().enumerate().filter(|(_, link)| link.stiffness > 0.0);
    springs.filter_map(|(index, link)| warning(tree, scene, &dynamics, index, link)).collect()
}

fn warning(tree: &Tree, scene: &Scene, dynamics: &Dynamics, index: usize, link: &Link) -> Option<Notice> {
    let place = scene.forces.iter().position(|force| force.name() == Some(&link.name))?;
    // A further tension may carry what the spring does not.
    if tree.pulls.iter().any(|pull| pull.link == index) {
        return None;
    }
    let [a, b] = link.points.map(|point| dynamics.point(point).position);
    let span = b - a;
    let of_stops = tree.slots.iter().filter(|slot| is_stop(scene, slot)).find_map(|slot| {
        let body = *link.bodies.iter().flatten().find(|body| slot.bodies.contains(&Some(**body)))?;
        let stopped = Stopped { slot, body, name: &scene.bodies[body].name, mass: scene.bodies[body].mass };
        too_slow(scene, link, &stopped).or_else(|| pulling(dynamics, link, &stopped, span))
    });
    let (field, notice) = too_weak(tree, scene, link, span.norm()).or(of_stops)?;
    let (code, numbers, message) = notice;
    Some(Notice::of_field(code, format!("forces[{place}].{field}"), numbers, message))
}

/// A field of a spring, and code, numbers and words of its warning.
type Warning = (&'static str, (&'static str, Vec<(&'static str, f64)>, String));

/// A body at a stop.
struct Stopped<'s> {
    slot: &'s ContactSlot,
    body: usize,
    name: &'s str,
    mass: f64,
}

/// What stiffnesses are in, to follow a warning.
fn in_newton_per_meter(stiffness: f64) -> String {
    let right = short(1e3 * stiffness);
    format!("stiffnesses are in N/m, {} N/mm are {right}", short(stiffness))
}

/// Of a spring that carries none of the weight of a body.
fn too_weak(tree: &Tree, scene: &Scene, link: &Link, length: f64) -> Option<Warning> {
    let bodies = link.bodies.iter().flatten().map(|&body| &scene.bodies[body]);
    let lightest = bodies.filter(|body| body.mass > 0.0).min_by(|a, b| a.mass.total_cmp(&b.mass))?;
    let most = link.stiffness * length.max(link.length);
    let weight = lightest.mass * tree.gravity.norm();
    if most >= FEEBLE * weight {
        return None;
    }
    let message = format!(
        "{:?} of {} N/m carries nothing: stretched by its whole length it pulls with {} N, and {:?} weighs {} N; {}",
        link.name,
        short(link.stiffness),
        short(most),
        lightest.name,
        short(weight),
        in_newton_per_meter(link.stiffness)
    );
    let numbers = vec![("stiffness", link.stiffness), ("force", most), ("weight", weight)];
    Some(("stiffness", ("feeble_spring", numbers, message)))
}

/// Of a spring on which a follower swings more slowly than the drive turns, so that it cannot follow.
fn too_slow(scene: &Scene, link: &Link, stopped: &Stopped) -> Option<Warning> {
    let speed = fastest(scene)?;
    let own = (link.stiffness / stopped.mass).sqrt();
    if own >= speed || stopped.slot.bodies.contains(&None) {
        return None;
    }
    let message = format!(
        "{:?} of {} N/m cannot keep {:?} at {:?}: with {} kg on it, it swings with {} rad/s, slower than the drive turns, \
         {} rad/s; {}",
        link.name,
        short(link.stiffness),
        stopped.name,
        stopped.slot.name,
        short(stopped.mass),
        short(own),
        short(speed),
        in_newton_per_meter(link.stiffness)
    );
    let numbers = vec![("stiffness", link.stiffness), ("frequency", own), ("speed", speed)];
    Some(("stiffness", ("feeble_spring", numbers, message)))
}

/// Of a spring that pulls a body off a stop that it touches at the start.
fn pulling(dynamics: &Dynamics, link: &Link, stopped: &Stopped, span: Vec2) -> Option<Warning> {
    let length = span.norm();
    let toward = if link.bodies[0] == Some(stopped.body) { span } else { -span };
    if length - link.length <= EQUAL * length || !parts(dynamics, stopped, toward) {
        return None;
    }
    let message = format!(
        "{:?} pulls {:?} off {:?}, which it touches at the start: the spring is {} m long there, longer than unloaded, \
         {} m; one that presses is longer unloaded",
        link.name,
        stopped.name,
        stopped.slot.name,
        short(length),
        short(link.length)
    );
    let numbers = vec![("length", length), ("unloaded", link.length)];
    Some(("length", ("pulling_spring", numbers, message)))
}

/// Whether a force in a direction on a body at a stop parts the contact, if it is closed.
fn parts(dynamics: &Dynamics, Stopped { slot, body, .. }: &Stopped, toward: Vec2) -> bool {
    let Surfaces::Face(face) = &slot.law.surfaces else { return false };
    let [first, second] = slot.points.map(|point| dynamics.point(point).position);
    let (sin, cos) = dynamics.angle(slot.points[0].frame).sin_cos();
    let [x, y] = face.normal;
    let normal = Vec2::new(cos * x - sin * y, sin * x + cos * y);
    let depth = normal.dot(&(second - first)) - face.limit;
    let pressed = normal.dot(&toward) * if slot.bodies[1] == Some(*body) { 1.0 } else { -1.0 };
    depth >= -EQUAL * (toward.norm() + face.radius) && pressed < -EQUAL * toward.norm()
}

fn is_stop(scene: &Scene, slot: &ContactSlot) -> bool {
    scene.joints.iter().any(|joint| {
        matches!(joint, Joint::Guide { name, shape: GuideShape::Stop { .. }, .. } if *name == slot.name)
    })
}

/// Largest constant speed of the drives [rad/s].
fn fastest(scene: &Scene) -> Option<f64> {
    let speeds = scene.drives.iter().filter_map(|drive| match drive {
        Drive::Speed { speed, .. } => Some(speed.abs()),
        Drive::Motion { .. } => None,
    });
    speeds.max_by(f64::total_cmp)
}
