//! Oil films on random mechanisms: derivatives by differences, reactions and powers by their balances.

use chebclear::contact::film::{FilmLaw, Lubricant};
use chebclear::contact::pair::Phase;
use chebclear::dynamics::Dynamics;
use chebclear::mechanism::compiled::Mechanism;
use chebclear::tree::elements::FramePoint;
use chebclear::tree::forces::{Ends, ForceLaw};
use nalgebra::Vector2;

use crate::dynamics::guides::{check_balances, compare_with_differences};
use crate::dynamics::random_trees::Case;
use crate::support::Random;

/// The case with a film between its first and its last body, or ground, from nearly concentric to touching.
fn with_film(case: &Case, random: &mut Random) -> (Mechanism, Vec<Phase>) {
    let mut mechanism = case.mechanism.clone();
    let last = mechanism.tree.bodies.len() - 1;
    let bodies = if random.unit() < 0.3 { [None, Some(last)] } else { [Some(last), Some(0)] };
    let points = bodies.map(|body| FramePoint {
        frame: body.map_or(0, |body| mechanism.tree.bodies[body].frame),
        offset: Vector2::new(random.within(-0.3, 0.3), random.within(-0.3, 0.3)),
    });
    let mut dynamics = Dynamics::new(&mechanism.tree);
    dynamics.move_to(case.t, &case.q, &case.v);
    let [a, b] = points.map(|point| dynamics.point(point).position);
    // Larger than any journal, so that one film lies within the size of the mechanism.
    let clearance = (b - a).norm() / random.within(0.05, 1.2);
    let radius = 2.0 * clearance;
    let lubricant = Lubricant {
        viscosity: 0.3,
        length: radius,
        roughness: 0.2 * clearance,
        has_finite_width: random.unit() < 0.5,
    };
    let law = FilmLaw::new(&lubricant, radius, clearance);
    mechanism.tree.add_force("film", Ends::Points(points), bodies, [None, None], ForceLaw::Film(law));
    (mechanism, case.phases.clone())
}

#[test]
fn linearization_agrees_with_differences() {
    compare_with_differences(with_film);
}

#[test]
fn reactions_balance_and_powers_agree() {
    check_balances(with_film);
}
