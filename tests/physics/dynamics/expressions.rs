//! Forces that depend on the motion, on random mechanisms: values by the Cartesian motion of the bodies, derivatives by
//! differences.

use chebclear::contact::pair::Phase;
use chebclear::dynamics::Dynamics;
use chebclear::expression::curve::{Beyond, Curve, Interpolation};
use chebclear::mechanism::compiled::Mechanism;
use chebclear::scene::loads::{Expression, Load};
use chebclear::scene::parts::{Force, ForceFrame, GROUND};

use crate::dynamics::cartesian::{cartesian, moving_cases};
use crate::dynamics::guides::assert_linearization;
use crate::dynamics::random_trees::Case;

fn expression(text: &str) -> Load {
    let constants = [("a", 0.7), ("b", -1.3)].map(|(name, value)| (name.to_owned(), value));
    let used = constants.into_iter().filter(|(name, _)| text.contains(&format!("{name}*")));
    Load::Motion(Box::new(Expression::read(text.to_owned(), used.collect()).unwrap()))
}

fn formula(text: &str) -> Option<Box<Expression>> {
    Some(Box::new(Expression::read(text.to_owned(), Vec::new()).unwrap()))
}

/// The case with forces that depend on everything, and torques by a table.
fn loaded(case: &Case) -> Option<Mechanism> {
    let mut scene = case.scene.clone();
    let last = scene.bodies.len() - 1;
    let springs = scene.forces.iter().find_map(|force| match force {
        Force::Spring { name, length, .. } if *length > 0.0 => {
            Some(format!(" + 0.4*{name}.length*{name}.lengthening"))
        }
        _ => None,
    });
    let springs = springs.unwrap_or_default();
    scene.forces.push(Force::Applied {
        name: "first".to_owned(),
        point: format!("body{last}.p0"),
        x: expression(&format!(
            "a*body0.x*body{last}.p0.vy + sin(body{last}.angle) - b*body0.vx**2{springs}"
        )),
        y: expression(&format!(
            "if(body0.vy < body{last}.vx, 2*body{last}.y, -body0.angular_velocity*3) + 0.1*time*body0.x"
        )),
        frame: if last.is_multiple_of(2) { ForceFrame::Body } else { ForceFrame::Ground },
    });
    scene.forces.push(Force::Spring {
        name: "third".to_owned(),
        a: GROUND.to_owned(),
        b: format!("body{last}.p0"),
        stiffness: 0.0,
        length: 0.0,
        damping: 0.0,
        tension: expression("3*third.length**2 - 0.4*third.lengthening*body0.x + a*time"),
    });
    scene.forces.push(Force::Bushing {
        name: "rubber".to_owned(),
        a: "body0.p0".to_owned(),
        b: GROUND.to_owned(),
        coefficients: [0.0, 2.5, 0.0, 0.0],
        formulas: [
            formula("13 + 4*rubber.deflection**2 + 2*body0.vx"),
            None,
            formula("0.7*cos(rubber.angle) + 0.1*body0.y*time"),
            formula("0.3 + 0.1*rubber.angle**2"),
        ],
    });
    scene.forces.push(Force::Bushing {
        name: "damper".to_owned(),
        a: GROUND.to_owned(),
        b: format!("body{last}.p0"),
        coefficients: [1.0, 0.0, 0.0, 0.0],
        formulas: [None, formula("2.5 + 0.4*damper.deflection*body0.vy"), None, None],
    });
    let points = [-50.0, -1.0, 0.3, 2.0, 50.0];
    let table = Curve::new(&points, &[3.0, -2.0, 5.0, 1.0, 2.0], Interpolation::Monotone, Beyond::Hold);
    let over = Expression::read(format!("body{last}.angular_velocity"), Vec::new()).unwrap();
    scene.forces.push(Force::Torque {
        name: "second".to_owned(),
        body: "body0".to_owned(),
        reaction: GROUND.to_owned(),
        torque: Load::Motion(Box::new(over.tabulated(table.unwrap()))),
    });
    let mut mechanism = Mechanism::compile(&scene).ok()?;
    // The regimes of friction are those that were drawn with the case.
    mechanism.tree.slots.clone_from(&case.mechanism.slots);
    Some(mechanism)
}

fn placed<'m>(mechanism: &'m Mechanism, case: &Case) -> Dynamics<'m> {
    let mut dynamics = Dynamics::new(mechanism);
    dynamics.phases.clone_from(&case.phases);
    dynamics.move_to(case.t, &case.q, &case.v);
    dynamics.settle_switches();
    dynamics
}

#[test]
fn values_are_those_of_the_formula_of_the_cartesian_motion() {
    let mut seen = 0;
    for case in &moving_cases() {
        let Some(mechanism) = loaded(case) else { continue };
        let dynamics = placed(&mechanism, case);
        let states = cartesian(&dynamics);
        let (first, last) = (&states[0], &states[states.len() - 1]);
        let turning = if first.velocity.y < last.velocity.x {
            2.0 * last.position.y
        } else {
            -first.angular_velocity * 3.0
        };
        let expected = turning + 0.1 * case.t * first.position.x;
        let found = dynamics.motion_load(&mechanism.motion_loads[1]);
        assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1.0), "{found} and {expected}");
        seen += 1;
    }
    assert!(seen > 100, "{seen}");
}

#[test]
fn linearization_agrees_with_differences() {
    let mut seen = 0;
    for (index, case) in moving_cases().iter().enumerate() {
        // The derivatives of contacts are tested elsewhere.
        if case.phases.iter().any(|phase| *phase != Phase::Free) {
            continue;
        }
        let Some(mechanism) = loaded(case) else { continue };
        assert_linearization(&mut placed(&mechanism, case), case, index, 1.0);
        seen += 1;
    }
    assert!(seen > 30, "{seen}");
}
