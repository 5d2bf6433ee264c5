//! Couplings on random mechanisms: motion, drives and reactions against the Cartesian equations, derivatives by
//! differences, powers by their balance.

use chebclear::expression::curve::{Beyond, Curve, Interpolation};
use chebclear::mechanism::compiled::Mechanism;
use chebclear::numerics::jet::Jet;
use chebclear::scene::couplings::{Coupling, CouplingLaw};
use chebclear::scene::loads::Expression;
use chebclear::scene::parts::{Joint, JointKind};
use chebclear::scene::time_function::TimeFunction;
use chebclear::tree::kinematics::direction;

use crate::dynamics::cartesian::{
    Row, Vec2, assert_motion, contacts, dynamics_of, equations, largest, moving_cases, rate_of, rows,
    state_of, states_at,
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
        let mut rows = rows(case, &states);
        let mut slopes = Vec::new();
        for (number, coupling) in couplings.iter().enumerate() {
            let [driven, driver] = coupling.ends.each_ref().map(|end| {
                let equation = value(end, &states);
                let [a, b] = [end.body_a, end.body_b].map(|body| state_of(&states, body));
                let rate = rate_of(&equation, &a, &b);
                (Row::jacobian(end, &equation, states.len()), equation, rate)
            });
            let [_, slope, bend] = coupling.law.at(driver.1.phi);
            let jacobian = driven.0.iter().zip(&driver.0).map(|(d, r)| d - slope * r).collect();
            let rate = driven.2 - slope * driver.2;
            assert!(rate.abs() <= 1e-11 * (1.0 + largest(&case.v)), "case {index}: rate {rate:e}");
            let gamma = driven.1.gamma - slope * driver.1.gamma + bend * driver.2 * driver.2;
            rows.push(Row { name: number.to_string(), jacobian, gamma });
            slopes.push(slope);
            kinds[match coupling.law {
                Law::Ratio(_) => 0,
                Law::Wave(..) => 1,
                Law::Table(..) => 2,
            }] += 1;
        }
        let mut dynamics = dynamics_of(case);
        let (multipliers, forces) = assert_motion(case, index, &mut dynamics, &rows, 1e-8);
        for (number, slope) in slopes.into_iter().enumerate() {
            let lambda = multipliers[rows.iter().position(|row| row.name == number.to_string()).unwrap()];
            for (found, expected) in
                dynamics.coupling_efforts(number).into_iter().zip([-lambda, slope * lambda])
            {
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
}

#[test]
fn linearization_agrees_with_differences() {
    for (index, (case, _)) in coupled_cases().iter().enumerate() {
        let states = states_at(case, case.t, &case.q, &case.v);
        if contacts(case, &states).iter().all(|contact| contact.penetration.abs() >= 2e-3) {
            assert_linearization(&mut dynamics_of(case), case, index, 1.0);
        }
    }
}
