//! Couplings on random mechanisms: motion, drives and reactions against the Cartesian equations, with the force of teeth
//! at the pitch point; derivatives by differences, powers by their balance.

use std::f64::consts::TAU;

use chebclear::contact::normal::{Damping, Latch, NormalLaw};
use chebclear::contact::pair::Phase;
use chebclear::expression::curve::{Beyond, Curve, Interpolation};
use chebclear::mechanism::compiled::Mechanism;
use chebclear::numerics::jet::Jet;
use chebclear::scene::couplings::{Backlash, Coupling, CouplingLaw};
use chebclear::scene::loads::Expression;
use chebclear::scene::parts::{Joint, JointKind};
use chebclear::scene::time_function::TimeFunction;
use chebclear::tree::kinematics::{direction, perp};

use crate::dynamics::cartesian::{
    Row, Vec2, assert_motion, contacts, cross, dynamics_of, equations, largest, moving_cases, rate_of, rows,
    state_of, states_at, turned,
};
use crate::dynamics::constraints::{
    CartesianConstraint, CartesianState, ConstraintKind, Equation, cartesian_constraints,
};
use crate::dynamics::guides::assert_linearization;
use crate::dynamics::random_trees::Case;
use crate::support::Random;

/// A law with its value and first two derivatives, written apart from the core.
enum Law {
    Ratio(f64),
    /// a sin(b x) + c x
    Wave(f64, f64, f64),
    /// A periodic table, and the ratio with which it advances.
    Table(Curve, f64),
}

impl Law {
    fn at(&self, x: f64) -> [f64; 3] {
        match self {
            Law::Ratio(ratio) => [ratio * x, *ratio, 0.0],
            &Law::Wave(a, b, c) => {
                let (sine, cosine) = (b * x).sin_cos();
                [a * sine + c * x, a * b * cosine + c, -a * b * b * sine]
            }
            Law::Table(curve, ratio) => {
                let Jet([value, first, second, _]) = curve.value(Jet::variable(x), 0);
                [value + ratio * x, first + ratio, second]
            }
        }
    }
}

/// A coupling in Cartesian coordinates: the constraints whose φ are its two coordinates, and its law.
struct Cartesian {
    ends: [CartesianConstraint; 2],
    law: Law,
    teeth: Option<Teeth>,
    has_play: bool,
}

const PRESSURE_ANGLE: f64 = 0.35;
const STIFFNESS: f64 = 3e4;
const PLAY: f64 = 0.01;

/// What turns on a body: the joint that holds it there, the body itself, and the center as a point of the first.
#[derive(Clone)]
struct Wheel {
    joint: String,
    body: Option<usize>,
    carrier: Option<usize>,
    center: Vec2,
}

/// Wheels, or a pinion and a rack that slides along an axis of the body that holds the pinion.
enum Teeth {
    /// Driver, driven.
    Wheels([Wheel; 2]),
    /// The pinion, the rack, the direction in which it moves against the body, and whether it is driven.
    Rack(Wheel, Option<usize>, Vec2, bool),
}

/// The force on the driven teeth per unit of its part along the pitch line, where it acts, and the lever of that part.
struct ToothForce {
    place: Vec2,
    bodies: [Option<usize>; 2],
    along: Vec2,
    radial: Vec2,
    lever: f64,
}

impl ToothForce {
    /// Forces and moments on all bodies per unit of the force along the pitch line, which has a sign.
    fn on_bodies(&self, sign: f64, states: &[CartesianState]) -> Vec<f64> {
        let vector = self.along + sign * PRESSURE_ANGLE.tan() * self.radial;
        let mut forces = vec![0.0; 3 * states.len()];
        for (body, side) in self.bodies.iter().zip([-1.0, 1.0]) {
            let Some(body) = *body else { continue };
            let moment = cross(self.place - states[body].position, vector);
            for (k, value) in [vector.x, vector.y, moment].into_iter().enumerate() {
                forces[3 * body + k] += side * value;
            }
        }
        forces
    }
}

impl Teeth {
    fn force(&self, ratio: f64, states: &[CartesianState]) -> ToothForce {
        let place_of = |wheel: &Wheel| {
            let carrier = state_of(states, wheel.carrier);
            carrier.position + turned(carrier.angle, wheel.center)
        };
        match self {
            Teeth::Wheels([driver, driven]) => {
                let (a, b) = (place_of(driver), place_of(driven));
                let (distance, way) = ((b - a).norm(), (b - a).normalize());
                // Pitch radius of the driven wheel, and the vectors from its center to the pitch point and of the radial force.
                let (radius, to_point, radial) = match ratio {
                    ..0.0 => (distance / (1.0 - ratio), -way, way),
                    // It is a ring: its teeth are pushed outwards.
                    ..1.0 => (distance / (1.0 - ratio), -way, -way),
                    _ => (distance / (ratio - 1.0), way, -way),
                };
                ToothForce {
                    place: b + radius * to_point,
                    bodies: [driver.body, driven.body],
                    along: perp(to_point),
                    radial,
                    lever: radius,
                }
            }
            Teeth::Rack(pinion, rack, axis, is_driven) => {
                let axis = turned(state_of(states, pinion.carrier).angle, *axis);
                let radius = if *is_driven { ratio } else { 1.0 / ratio };
                let place = place_of(pinion) - radius * perp(axis);
                let inwards = radius.signum() * perp(axis);
                let (bodies, radial) = ([pinion.body, *rack], -inwards);
                if *is_driven {
                    ToothForce { place, bodies, along: axis, radial, lever: 1.0 }
                } else {
                    let along = radius.signum() * axis;
                    let bodies = [*rack, pinion.body];
                    ToothForce { place, bodies, along, radial: inwards, lever: radius.abs() }
                }
            }
        }
    }
}

/// Everything that turns on something.
fn wheels(case: &Case) -> Vec<Wheel> {
    let revolutes = cartesian_constraints(&case.scene).unwrap().into_iter();
    let revolutes = revolutes.filter(|one| one.kind == ConstraintKind::Revolute);
    let both = |one: CartesianConstraint| {
        let CartesianConstraint { name: joint, body_a, body_b, point_a, point_b, .. } = one;
        let first = Wheel { joint: joint.clone(), body: body_b, carrier: body_a, center: point_a };
        [first, Wheel { joint, body: body_a, carrier: body_b, center: point_b }]
    };
    revolutes.flat_map(both).collect()
}

/// Teeth, with the names of driven and driver and of the body against which they count, and their coordinates.
type MeshedWheels = (Teeth, [String; 2], Option<usize>, [CartesianConstraint; 2]);

/// Those that can be.
fn teeth(case: &Case, random: &mut Random) -> Option<MeshedWheels> {
    let wheels = wheels(case);
    let first = wheels[random.index(wheels.len().max(1)).min(wheels.len().checked_sub(1)?)].clone();
    let angle_of = |wheel: &Wheel| CartesianConstraint {
        name: String::new(),
        body_a: wheel.carrier,
        body_b: wheel.body,
        point_a: Vec2::zeros(),
        point_b: Vec2::zeros(),
        kind: ConstraintKind::Angle { motion: TimeFunction::constant(0.0) },
    };
    let mut slides = cartesian_constraints(&case.scene).unwrap().into_iter().filter_map(|mut one| {
        let ConstraintKind::Prismatic { axis, angle } = one.kind else { return None };
        // The axis in the body of the pinion, and the way of the other body along it.
        let (rack, along) = match first.carrier {
            carrier if carrier == one.body_a => (one.body_b, axis),
            carrier if carrier == one.body_b => (one.body_a, -turned(-angle, axis)),
            _ => return None,
        };
        one.kind = ConstraintKind::Displacement { axis, motion: TimeFunction::constant(0.0) };
        (rack != first.body).then_some((one, rack, along))
    });
    if let Some((slide, rack, along)) = slides.next() {
        let names = [format!("{}.displacement", slide.name), format!("{}.angle", first.joint)];
        let (ends, is_driven) = ([slide, angle_of(&first)], random.unit() < 0.5);
        let (mut names, mut ends) = (names, ends);
        if !is_driven {
            names.reverse();
            ends.reverse();
        }
        return Some((Teeth::Rack(first, rack, along, is_driven), names, None, ends));
    }
    let second = wheels.iter().find(|other| {
        other.carrier == first.carrier && other.body != first.body && other.center != first.center
    })?;
    let name_of = |wheel: &Wheel| match wheel.body {
        Some(body) => format!("body{body}.angle"),
        None => "ground.angle".to_owned(),
    };
    let ends = [second, &first].map(angle_of);
    let names = [second, &first].map(name_of);
    Some((Teeth::Wheels([first.clone(), second.clone()]), names, first.carrier, ends))
}

/// A coordinate that can be coupled: its name, and φ of which it is the value.
fn coordinate(case: &Case, random: &mut Random, carrier: Option<usize>) -> (String, CartesianConstraint) {
    let constant = || TimeFunction::constant(0.0);
    let count = case.scene.bodies.len();
    let slides: Vec<&Joint> = (case.scene.joints.iter())
        .filter(|joint| matches!(joint, Joint::Ideal { kind: JointKind::Prismatic { .. }, .. }))
        .collect();
    if carrier.is_none() && !slides.is_empty() && random.unit() < 0.5 {
        let slide = slides[random.index(slides.len())];
        let constraints = cartesian_constraints(&case.scene).unwrap();
        let mut own = constraints.into_iter().find(|one| one.name == slide.name()).unwrap();
        if let Joint::Ideal { kind: JointKind::Prismatic { axis, .. }, .. } = slide {
            let axis = direction(Vec2::from(*axis));
            own.kind = ConstraintKind::Displacement { axis, motion: constant() };
        }
        return (format!("{}.displacement", slide.name()), own);
    }
    let body = random.index(count);
    let angle = CartesianConstraint {
        name: String::new(),
        body_a: carrier,
        body_b: Some(body),
        point_a: Vec2::zeros(),
        point_b: Vec2::zeros(),
        kind: ConstraintKind::Angle { motion: constant() },
    };
    (format!("body{body}.angle"), angle)
}

fn value(end: &CartesianConstraint, states: &[CartesianState]) -> Equation {
    equations(end, 0.0, states).into_iter().next().unwrap()
}

/// Random mechanisms with one or two couplings, in motion. Many couplings lock or tie what cannot move.
fn coupled_cases() -> Vec<(Case, Vec<Cartesian>)> {
    let mut random = Random(77);
    let mut coupled = Vec::new();
    for case in moving_cases().into_iter().chain(moving_cases()) {
        let mut scene = case.scene.clone();
        let mut known = Vec::new();
        for number in 0..1 + random.index(2) {
            let toothed = if random.unit() < 0.5 { teeth(&case, &mut random) } else { None };
            if let Some((teeth, [driven, driver], carrier, ends)) = toothed {
                let ratio = random.within(0.2, 2.0) * if random.unit() < 0.5 { -1.0 } else { 1.0 };
                let has_play = random.unit() < 0.5;
                let contact = NormalLaw { stiffness: STIFFNESS, exponent: 1.5, damping: Damping::Elastic };
                scene.couplings.push(Coupling {
                    name: format!("coupling{number}"),
                    driven,
                    driver,
                    law: CouplingLaw::Ratio(ratio),
                    carrier: carrier.map(|body| format!("body{body}")),
                    offset: None,
                    pressure_angle: Some(PRESSURE_ANGLE),
                    backlash: has_play.then_some(Backlash { play: PLAY, contact }),
                });
                known.push(Cartesian { ends, law: Law::Ratio(ratio), teeth: Some(teeth), has_play });
                continue;
            }
            let carrier = (random.unit() < 0.3).then(|| random.index(scene.bodies.len()));
            let [driven, driver] = [(); 2].map(|()| coordinate(&case, &mut random, carrier));
            let (a, b, c) = (random.within(0.1, 0.4), random.within(0.5, 2.0), random.within(-1.0, 1.0));
            let turns = !driver.0.ends_with("displacement");
            let (law, own) = match random.index(3) {
                0 => (CouplingLaw::Ratio(c), Law::Ratio(c)),
                1 if turns => {
                    let points: Vec<f64> =
                        (0..9).map(|k| f64::from(k) * std::f64::consts::TAU / 8.0).collect();
                    let mut values: Vec<f64> =
                        points.iter().map(|x| a * (3.0 * x).sin() + b * x.cos()).collect();
                    values[8] = values[0];
                    let curve = Curve::new(&points, &values, Interpolation::Cubic, Beyond::Repeat).unwrap();
                    (CouplingLaw::Table { points, values, periodic: true }, Law::Table(curve, 0.0))
                }
                _ => {
                    let text = format!("a*sin(b*{name}) + c*{name}", name = driver.0);
                    let constants = [("a", a), ("b", b), ("c", c)].map(|(name, x)| (name.to_owned(), x));
                    let formula = Expression::read(text, constants.into()).unwrap();
                    (CouplingLaw::Formula(Box::new(formula)), Law::Wave(a, b, c))
                }
            };
            let carrier = carrier.map(|body| format!("body{body}"));
            let name = format!("coupling{number}");
            scene.couplings.push(Coupling {
                name,
                driven: driven.0,
                driver: driver.0,
                law,
                carrier,
                offset: None,
                pressure_angle: None,
                backlash: None,
            });
            known.push(Cartesian { ends: [driven.1, driver.1], law: own, teeth: None, has_play: false });
        }
        let Ok(mut mechanism) = Mechanism::compile(&scene) else { continue };
        let joints = case.mechanism.slots.len();
        mechanism.tree.slots[..joints].clone_from_slice(&case.mechanism.tree.slots);
        let mut phases = case.phases.clone();
        phases.resize(mechanism.slots.len(), Phase::Free);
        let (mut q, mut v) = (mechanism.start.q.clone(), case.v.clone());
        q.iter_mut().for_each(|q| *q += random.within(-0.05, 0.05));
        let mut case = Case { scene, mechanism, t: 0.01, phases, ..case };
        let mut dynamics = dynamics_of(&case);
        let closed = dynamics.project(case.t, &mut q, &mut v, &case.mechanism.scales).is_some();
        let is_regular = closed && !dynamics.is_near_change_point();
        dynamics.move_to(case.t, &q, &v);
        let touching: Vec<bool> =
            (joints..case.phases.len()).map(|slot| dynamics.contact_state(slot).penetration > 0.0).collect();
        for (phase, touches) in case.phases[joints..].iter_mut().zip(touching) {
            if touches {
                *phase = Phase::Contact { latch: Latch::default(), clipped: false, traction: None };
            }
        }
        (case.q, case.v) = (q, v);
        // Away from the kinks of friction.
        let states = states_at(&case, case.t, &case.q, &case.v);
        for (joint, contact) in contacts(&case, &states).iter().enumerate() {
            case.set_friction(joint, contact.sliding);
        }
        if is_regular && largest(&case.v) < 10.0 {
            coupled.push((case, known));
        }
    }
    assert!(coupled.len() > 100, "{}", coupled.len());
    coupled
}

#[test]
fn motion_and_efforts_are_those_of_the_cartesian_system() {
    let (mut kinds, mut toothed) = ([0; 3], [0; 4]);
    for (index, (case, couplings)) in coupled_cases().iter().enumerate() {
        let states = states_at(case, case.t, &case.q, &case.v);
        let mut rows = rows(case, &states);
        let mut dynamics = dynamics_of(case);
        assert!(dynamics.acceleration_and_contacts(case.t, &case.q, &case.v, &mut vec![0.0; case.q.len()]));
        let effort_of = |name: &str| {
            let place = case.mechanism.all_couplings().position(|(own, _)| own.name == name).unwrap();
            dynamics.coupling_efforts(place)
        };
        // Forces and moments of the flanks, which are known.
        let mut flanks = vec![0.0; 3 * states.len()];
        let mut expected: Vec<(String, Option<f64>, f64)> = Vec::new();
        for (number, coupling) in couplings.iter().enumerate() {
            let [driven, driver] = coupling.ends.each_ref().map(|end| {
                let equation = value(end, &states);
                let [a, b] = [end.body_a, end.body_b].map(|body| state_of(&states, body));
                let rate = rate_of(&equation, &a, &b);
                (Row::jacobian(end, &equation, states.len()), equation, rate)
            });
            let [_, slope, bend] = coupling.law.at(driver.1.phi);
            let name = format!("coupling{number}");
            let force = coupling.teeth.as_ref().map(|teeth| teeth.force(slope, &states));
            if let Some(teeth) = &coupling.teeth {
                toothed[match teeth {
                    Teeth::Rack(..) => 2,
                    Teeth::Wheels(_) => usize::from(slope > 0.0),
                }] += 1;
            }
            if let (Some(force), true) = (&force, coupling.has_play) {
                let own = case.mechanism.backlashes.iter().find(|own| own.coupling.name == name).unwrap();
                let gap = driven.1.phi - slope * driver.1.phi - own.coupling.offset.unwrap();
                let turns = if force.lever == 1.0 { 0.0 } else { TAU * (gap / TAU).round() };
                let ahead = force.lever * (gap - turns);
                let size = STIFFNESS * (ahead.abs() - 0.5 * PLAY).max(0.0).powf(1.5);
                let along = -ahead.signum() * size;
                let on_bodies = force.on_bodies(along.signum(), &states);
                flanks.iter_mut().zip(on_bodies).for_each(|(sum, part)| *sum += along * part);
                expected.push((name, Some(force.lever * along), slope));
                toothed[3] += usize::from(size > 0.0);
                continue;
            }
            let jacobian: Vec<f64> = driven.0.iter().zip(&driver.0).map(|(d, r)| d - slope * r).collect();
            let rate = driven.2 - slope * driver.2;
            assert!(rate.abs() <= 1e-11 * (1.0 + largest(&case.v)), "case {index}: rate {rate:e}");
            let gamma = driven.1.gamma - slope * driver.1.gamma + bend * driver.2 * driver.2;
            let column = force.map_or_else(
                || jacobian.clone(),
                |force| {
                    // The part across the pitch line separates the wheels, whatever the sign of the force.
                    let on_bodies = force.on_bodies(effort_of(&name)[0].signum(), &states);
                    on_bodies.into_iter().map(|part| part / force.lever).collect()
                },
            );
            rows.push(Row { name: name.clone(), jacobian, column, gamma });
            expected.push((name, None, slope));
            kinds[match coupling.law {
                Law::Ratio(_) => 0,
                Law::Wave(..) => 1,
                Law::Table(..) => 2,
            }] += 1;
        }
        let efforts: Vec<[f64; 2]> = expected.iter().map(|(name, ..)| effort_of(name)).collect();
        let (multipliers, forces) = assert_motion(case, index, &mut dynamics, &rows, &flanks, 1e-8);
        for ((name, effort, slope), found) in expected.into_iter().zip(efforts) {
            let multiplier = || multipliers[rows.iter().position(|row| row.name == name).unwrap()];
            let effort = effort.unwrap_or_else(|| -multiplier());
            for (found, expected) in found.into_iter().zip([effort, -slope * effort]) {
                assert!((found - expected).abs() <= 1e-8 * forces, "case {index}: {found} for {expected}");
            }
        }
        let powers = [dynamics.input_power(), dynamics.balanced_power()];
        assert!(
            (powers[0] - powers[1]).abs() <= 1e-7 * powers[0].abs().max(forces),
            "case {index}: {powers:?}"
        );
    }
    assert!(kinds.into_iter().all(|count| count > 20), "{kinds:?}");
    assert!(toothed.into_iter().all(|count| count > 10), "{toothed:?}");
}

#[test]
fn linearization_agrees_with_differences() {
    for (index, (case, _)) in coupled_cases().iter().enumerate() {
        let states = states_at(case, case.t, &case.q, &case.v);
        let mut dynamics = dynamics_of(case);
        dynamics.move_to(case.t, &case.q, &case.v);
        let of_joints = contacts(case, &states);
        let flanks = of_joints.len()..case.phases.len();
        let of_flanks = flanks.map(|slot| dynamics.contact_state(slot).penetration);
        let depths = of_joints.iter().map(|contact| contact.penetration);
        // Differences must not cross an onset.
        if depths.chain(of_flanks).all(|depth| depth.abs() >= 2e-3) {
            assert_linearization(&mut dynamics_of(case), case, index, 1.0);
        }
    }
}
