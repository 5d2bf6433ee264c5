//! Couplings on random mechanisms: motion, drives and reactions against the Cartesian equations, derivatives by
//! differences, powers by their balance.

use chebclear::dynamics::Linearization;
use chebclear::expression::curve::{Beyond, Curve, Interpolation};
use chebclear::mechanism::compiled::Mechanism;
use chebclear::numerics::jet::Jet;
use chebclear::scene::couplings::{Coupling, CouplingLaw};
use chebclear::scene::loads::Expression;
use chebclear::scene::parts::{Joint, JointKind};
use chebclear::scene::time_function::TimeFunction;
use chebclear::tree::kinematics::direction;
use nalgebra::{DMatrix, DVector};

use crate::dynamics::cartesian::{
    Vec2, acceleration, added, cross, dynamics_of, equations, gravity, largest, loads, moving_cases, rate_of,
    state_of, states_at, turned,
};
use crate::dynamics::constraints::{
    CartesianConstraint, CartesianState, ConstraintKind, Equation, cartesian_constraints,
};
use crate::dynamics::random_trees::Case;
use crate::support::{Random, derivative};

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
            });
            known.push(Cartesian { ends: [driven.1, driver.1], law: own });
        }
        let Ok(mut mechanism) = Mechanism::compile(&scene) else { continue };
        mechanism.tree.slots.clone_from(&case.mechanism.tree.slots);
        let (mut q, mut v) = (mechanism.start.q.clone(), case.v.clone());
        q.iter_mut().for_each(|q| *q += random.within(-0.05, 0.05));
        let mut case = Case { scene, mechanism, t: 0.01, ..case };
        let mut dynamics = dynamics_of(&case);
        let closed = dynamics.project(case.t, &mut q, &mut v, &case.mechanism.scales).is_some();
        let is_regular = closed && !dynamics.is_near_change_point();
        (case.q, case.v) = (q, v);
        if is_regular && largest(&case.v) < 10.0 {
            coupled.push((case, known));
        }
    }
    assert!(coupled.len() > 100, "{}", coupled.len());
    coupled
}

#[test]
fn motion_and_efforts_are_those_of_the_cartesian_system() {
    let mut kinds = [0; 3];
    for (index, (case, couplings)) in coupled_cases().iter().enumerate() {
        let states = states_at(case, case.t, &case.q, &case.v);
        let n = 3 * states.len();
        // Row, right side, and whose row it is.
        let mut rows: Vec<(Vec<f64>, f64, String)> = Vec::new();
        let row_of = |constraint: &CartesianConstraint, equation: &Equation| {
            let mut row = vec![0.0; n];
            let ends = [(constraint.body_a, equation.phi_q_a), (constraint.body_b, equation.phi_q_b)];
            for (body, part) in ends.into_iter().filter_map(|(body, part)| Some((body?, part))) {
                (0..3).for_each(|k| row[3 * body + k] += part[k]);
            }
            row
        };
        for constraint in &cartesian_constraints(&case.scene).unwrap() {
            for equation in equations(constraint, case.t, &states) {
                rows.push((row_of(constraint, &equation), equation.gamma, constraint.name.clone()));
            }
        }
        let mut slopes = Vec::new();
        for (number, coupling) in couplings.iter().enumerate() {
            let [driven, driver] = coupling.ends.each_ref().map(|end| {
                let equation = value(end, &states);
                let [a, b] = [end.body_a, end.body_b].map(|body| state_of(&states, body));
                let rate = rate_of(&equation, &a, &b);
                (row_of(end, &equation), equation, rate)
            });
            let [_, slope, bend] = coupling.law.at(driver.1.phi);
            let row: Vec<f64> = driven.0.iter().zip(&driver.0).map(|(d, r)| d - slope * r).collect();
            let rate = driven.2 - slope * driver.2;
            assert!(rate.abs() <= 1e-11 * (1.0 + largest(&case.v)), "case {index}: rate {rate:e}");
            rows.push((
                row,
                driven.1.gamma - slope * driver.1.gamma + bend * driver.2 * driver.2,
                format!("{number}"),
            ));
            slopes.push(slope);
            kinds[match coupling.law {
                Law::Ratio(_) => 0,
                Law::Wave(..) => 1,
                Law::Table(..) => 2,
            }] += 1;
        }
        let mut matrix = DMatrix::zeros(n + rows.len(), n + rows.len());
        let mut right = DVector::zeros(n + rows.len());
        for (body, inertia) in case.inertias.iter().enumerate() {
            let mass = case.scene.bodies[body].mass;
            for (k, value) in [mass, mass, *inertia].into_iter().enumerate() {
                matrix[(3 * body + k, 3 * body + k)] = value;
            }
            (right[3 * body], right[3 * body + 1]) = (mass * gravity(case).x, mass * gravity(case).y);
        }
        for load in loads(case, case.t, &states) {
            let Some(body) = load.body else { continue };
            for (k, value) in [load.force.x, load.force.y, load.moment].into_iter().enumerate() {
                right[3 * body + k] += value;
            }
        }
        for (place, (row, gamma, _)) in rows.iter().enumerate() {
            for (k, &value) in row.iter().enumerate() {
                (matrix[(n + place, k)], matrix[(k, n + place)]) = (value, value);
            }
            right[n + place] = *gamma;
        }
        let solution = matrix.lu().solve(&right).unwrap();
        let scale = largest(solution.rows(0, n).iter()).max(1.0);
        let forces = largest(solution.rows(n, rows.len()).iter()).max(1.0);
        let a = acceleration(case, case.t, &case.q, &case.v);
        let mut dynamics = dynamics_of(case);
        assert!(dynamics.acceleration_and_contacts(case.t, &case.q, &case.v, &mut a.clone()));
        dynamics.accelerate(&a);
        dynamics.find_reactions();
        for (body, placement) in case.mechanism.bodies.iter().enumerate() {
            let frame = dynamics.frame(placement.frame);
            let linear = frame.point(placement.center).acceleration + gravity(case);
            for (k, found) in [linear.x, linear.y, frame.angular_acceleration].into_iter().enumerate() {
                let error = (found - solution[3 * body + k]).abs();
                assert!(error <= 1e-8 * scale, "case {index}, body {body}, {k}: {error:e} of {scale:e}");
            }
        }
        let multiplier =
            |name: &str| solution[n + rows.iter().position(|(.., other)| other == name).unwrap()];
        for (number, slope) in slopes.into_iter().enumerate() {
            let lambda = multiplier(&number.to_string());
            for (found, expected) in
                dynamics.coupling_efforts(number).into_iter().zip([-lambda, slope * lambda])
            {
                assert!((found - expected).abs() <= 1e-8 * forces, "case {index}: {found} for {expected}");
            }
        }
        for (number, driven) in case.mechanism.driven.iter().enumerate() {
            let error = (dynamics.drive_effort(number) + multiplier(&driven.name)).abs();
            assert!(error <= 1e-8 * forces, "case {index}, {}: effort off by {error:e}", driven.name);
        }
        for (number, joint) in case.mechanism.ideal_joints.iter().enumerate() {
            let drive = case.scene.drives.iter().find(|drive| drive.joint() == joint.name);
            let (mut force, mut moment) = (Vec2::zeros(), 0.0);
            let [body, sign] = match joint.bodies {
                [_, Some(body)] => [body, 0],
                [first, None] => [first.unwrap(), 1],
            };
            for (place, (row, _, name)) in rows.iter().enumerate() {
                if *name == joint.name || drive.is_some_and(|drive| drive.name() == name) {
                    let lambda = if sign == 0 { -1.0 } else { 1.0 } * solution[n + place];
                    let part = Vec2::new(row[3 * body], row[3 * body + 1]);
                    force += lambda * part;
                    moment += lambda * (row[3 * body + 2] + cross(states[body].position, part));
                }
            }
            let end = case.scene.attachment(case_end(case, &joint.name)).unwrap();
            let state = state_of(&states, end.body);
            let center = end.body.map_or([0.0; 2], |body| case.scene.bodies[body].center_of_mass);
            let point = state.position + turned(state.angle, Vec2::from(end.position) - Vec2::from(center));
            let reaction = dynamics.reaction(number);
            let error =
                (reaction.force - force).norm() + (reaction.moment - moment + cross(point, force)).abs();
            assert!(error <= 1e-7 * forces, "case {index}, {}: reaction off by {error:e}", joint.name);
        }
        let powers = [dynamics.input_power(), dynamics.balanced_power()];
        assert!(
            (powers[0] - powers[1]).abs() <= 1e-7 * powers[0].abs().max(forces),
            "case {index}: {powers:?}"
        );
    }
    assert!(kinds.into_iter().all(|count| count > 20), "{kinds:?}");
}

/// The second end of a joint.
fn case_end<'c>(case: &'c Case, name: &str) -> &'c str {
    let joint = case.scene.joints.iter().find(|joint| joint.name() == name).unwrap();
    let Joint::Ideal { b, .. } = joint else { unreachable!("an ideal joint") };
    b
}

#[test]
fn linearization_agrees_with_differences() {
    for (index, (case, _)) in coupled_cases().iter().enumerate() {
        let (t, q, v) = (case.t, &case.q, &case.v);
        let states = states_at(case, t, q, v);
        let contacts = crate::dynamics::cartesian::contacts(case, &states);
        if contacts.iter().any(|contact| contact.penetration.abs() < 2e-3) {
            continue;
        }
        let d = q.len();
        let mut exact = Linearization::new(d);
        assert!(dynamics_of(case).linearize(t, q, v, &mut exact));
        let (mut worst, mut size) = (0.0_f64, largest(&exact.a).max(1.0));
        let mut compare = |exact: &dyn Fn(usize) -> f64, difference: Vec<f64>| {
            for (row, value) in difference.into_iter().enumerate() {
                size = size.max(value.abs());
                worst = worst.max((exact(row) - value).abs());
            }
        };
        for k in 0..d {
            let mut unit = vec![0.0; d];
            unit[k] = 1.0;
            let by_q = derivative(|h| acceleration(case, t, &added(q, h, &unit), v));
            let by_v = derivative(|h| acceleration(case, t, q, &added(v, h, &unit)));
            compare(&|row| exact.a_q[row * d + k], by_q);
            compare(&|row| exact.a_v[row * d + k], by_v);
        }
        compare(&|row| exact.a_t[row], derivative(|h| acceleration(case, t + h, q, v)));
        assert!(worst <= 1e-6 * size, "case {index}: {worst:e} of {size:e}");
    }
}
