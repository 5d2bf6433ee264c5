//! Springs that cannot do what they are for at the start, mostly because of N/mm for N/m or of an unloaded length that is too
//! short.

use crate::contact::pair::Surfaces;
use crate::dynamics::Dynamics;
use crate::error::Notice;
use crate::numerics::accuracy::EQUAL;
use crate::scene::parts::{Drive, GuideShape, Joint, Scene};
use crate::scene::plausibility::short;
use crate::tree::elements::{ContactSlot, FramePoint, State, Tree};
use crate::tree::forces::{ForceElement, Link};
use crate::tree::kinematics::Vec2;

/// Part of the weight of a body below which a spring carries none of it, stretched by the whole of its length: one
/// that carries the body stretches by a part of its length, and a stiffness in N/mm is a thousand times too small.
const FEEBLE: f64 = 0.1;

/// Warnings of springs at the start: those too weak for a weight or for a follower, and those that pull apart what
/// they should press together.
pub(super) fn warnings_of_springs(tree: &Tree, start: &State, scene: &Scene) -> Vec<Notice> {
    if tree.links().next().is_none() {
        return Vec::new();
    }
    let mut dynamics = Dynamics::new(tree);
    dynamics.move_to(0.0, &start.q, &start.v);
    let springs = tree.links().filter(|(_, _, link)| link.stiffness > 0.0);
    // A further tension may carry what the spring does not.
    let springs = springs.filter(|(element, ..)| element.loads[0].is_none());
    springs.filter_map(|spring| warning(tree, scene, &dynamics, &spring)).collect()
}

fn warning(tree: &Tree, scene: &Scene, dynamics: &Dynamics, spring: &Spring) -> Option<Notice> {
    let (element, points, _) = spring;
    let place = scene.forces.iter().position(|force| force.name() == Some(&element.name))?;
    let [a, b] = points.map(|point| dynamics.point(point).position);
    let span = b - a;
    let of_stops = tree.slots.iter().filter(|slot| is_stop(scene, slot)).find_map(|slot| {
        let body = *element.bodies.iter().flatten().find(|body| slot.bodies.contains(&Some(**body)))?;
        let stopped = Stopped { slot, body, name: &scene.bodies[body].name, mass: scene.bodies[body].mass };
        too_slow(scene, spring, &stopped).or_else(|| pulling(dynamics, spring, &stopped, span))
    });
    let (field, notice) = too_weak(tree, scene, spring, span.norm()).or(of_stops)?;
    let (code, numbers, message) = notice;
    Some(Notice::of_field(code, format!("forces[{place}].{field}"), numbers, message))
}

/// A field of a spring, and code, numbers and words of its warning.
type Warning = (&'static str, (&'static str, Vec<(&'static str, f64)>, String));

/// A spring with its ends and its law.
type Spring<'t> = (&'t ForceElement, [FramePoint; 2], &'t Link);

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
fn too_weak(tree: &Tree, scene: &Scene, (element, _, link): &Spring, length: f64) -> Option<Warning> {
    let bodies = element.bodies.iter().flatten().map(|&body| &scene.bodies[body]);
    let lightest = bodies.filter(|body| body.mass > 0.0).min_by(|a, b| a.mass.total_cmp(&b.mass))?;
    let most = link.stiffness * length.max(link.length);
    let weight = lightest.mass * tree.gravity.norm();
    if most >= FEEBLE * weight {
        return None;
    }
    let message = format!(
        "{:?} of {} N/m carries nothing: stretched by its whole length it pulls with {} N, and {:?} weighs {} N; {}",
        element.name,
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
fn too_slow(scene: &Scene, (element, _, link): &Spring, stopped: &Stopped) -> Option<Warning> {
    let speed = fastest(scene)?;
    let own = (link.stiffness / stopped.mass).sqrt();
    if own >= speed || stopped.slot.bodies.contains(&None) {
        return None;
    }
    let message = format!(
        "{:?} of {} N/m cannot keep {:?} at {:?}: with {} kg on it, it swings with {} rad/s, slower than the drive turns, \
         {} rad/s; {}",
        element.name,
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
fn pulling(
    dynamics: &Dynamics,
    (element, _, link): &Spring,
    stopped: &Stopped,
    span: Vec2,
) -> Option<Warning> {
    let length = span.norm();
    let toward = if element.bodies[0] == Some(stopped.body) { span } else { -span };
    if length - link.length <= EQUAL * length || !parts(dynamics, stopped, toward) {
        return None;
    }
    let message = format!(
        "{:?} pulls {:?} off {:?}, which it touches at the start: the spring is {} m long there, longer than unloaded, \
         {} m; one that presses is longer unloaded",
        element.name,
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
