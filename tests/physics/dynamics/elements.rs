//! Identities of all force laws in random states: where their power goes, and that their wrenches add up to zero.

use chebclear::contact::film::{FilmLaw, Lubricant};
use chebclear::numerics::dual::{Dual, Scalar};
use chebclear::tree::forces::{Applied, Elastic, ForceLaw, Law, Link, Motion};

use crate::support::Random;

/// A law with what it depends on.
struct Case {
    law: ForceLaw,
    loads: [bool; 2],
    /// Whether it acts between frames.
    is_couple: bool,
    /// Size of the vector between the ends.
    size: f64,
}

fn cases() -> Vec<Case> {
    let link = |stiffness, length, damping| {
        let indistinct = if length == 0.0 && damping == 0.0 { 0.0 } else { 1e-15 };
        ForceLaw::Link(Link { stiffness, length, damping, indistinct })
    };
    let elastic = |stiffness, damping| ForceLaw::Elastic(Elastic { stiffness, damping });
    let film = |has_finite_width| {
        let lubricant = Lubricant { viscosity: 0.02, length: 0.02, roughness: 1e-6, has_finite_width };
        ForceLaw::Film(FilmLaw::new(&lubricant, 0.02, 4e-5))
    };
    let (angle, none) = (0.7_f64, [false; 2]);
    let applied =
        |turns: bool| ForceLaw::Applied(Applied { body_axes: turns.then(|| [angle.cos(), angle.sin()]) });
    let points = |law, loads| Case { law, loads, is_couple: false, size: 0.3 };
    let frames = |law, loads| Case { law, loads, is_couple: true, size: 2.0 };
    vec![
        points(link(200.0, 0.2, 0.0), none),
        points(link(200.0, 0.0, 0.0), none),
        points(link(0.0, 0.0, 3.0), none),
        points(link(200.0, 0.2, 3.0), [true, false]),
        points(elastic(30.0, 0.4), none),
        points(elastic(30.0, 0.0), [false, true]),
        points(elastic(0.0, 0.4), [true, false]),
        points(elastic(0.0, 0.0), [true; 2]),
        Case { size: 3e-5, ..points(film(false), none) },
        Case { size: 5e-5, ..points(film(true), none) },
        frames(elastic(3.0, 0.05), none),
        frames(elastic(0.0, 0.0), [true; 2]),
        points(applied(false), [true; 2]),
        points(applied(true), [true; 2]),
        frames(applied(false), [true, false]),
    ]
}

/// A number with its rate.
fn in_time(value: f64, rate: f64) -> Dual<1> {
    Dual { value, gradient: [rate] }
}

fn drawn(case: &Case, random: &mut Random) -> (Motion<Dual<1>>, [Option<Dual<1>>; 2]) {
    let mut within = |size: f64| random.within(-size, size);
    // Between frames there is one component, and the turning of bodies is its rate.
    let across = if case.is_couple { 0.0 } else { 1.0 };
    let apart = [within(case.size), across * within(case.size)];
    let rate = [within(5.0 * case.size), across * within(5.0 * case.size)];
    let turning = [across * within(9.0), across * within(9.0)];
    let (sine, cosine) = within(3.0).sin_cos();
    let loads = case.loads.map(|has| has.then(|| Dual::constant(within(20.0))));
    // What is stored depends on positions alone: accelerations may be anything.
    let unknown = |value| in_time(value, f64::NAN);
    let motion = Motion {
        apart: [0, 1].map(|k| in_time(apart[k], rate[k])),
        rate: rate.map(unknown),
        turning: turning.map(unknown),
        axes: [in_time(cosine, -sine * turning[1]), in_time(sine, cosine * turning[1])],
    };
    (motion, loads)
}

#[test]
fn power_is_input_less_loss_less_what_is_stored() {
    let mut random = Random(45);
    for case in cases() {
        for _ in 0..100 {
            let (motion, loads) = drawn(&case, &mut random);
            let power = case.law.exerted(&motion, loads).power(&motion).value;
            let work = case.law.work(&motion, loads);
            let (stored, lost, input) = (work.stored.gradient[0], work.lost.value, work.input.value);
            let size = power.abs() + stored.abs() + lost.abs() + input.abs();
            let rest = power + stored - input + lost;
            assert!(rest.abs() <= 1e-13 * size, "{:?}: {rest:e} of {size:e} W", case.law);
            assert!(lost >= 0.0 || case.loads[1], "{:?}: loses {lost:e} W", case.law);
        }
    }
}

#[test]
fn wrenches_of_a_pair_add_up_to_zero() {
    let mut random = Random(46);
    // The reaction to an applied force acts on ground.
    let is_pair = |case: &Case| !case.is_couple && !matches!(case.law, ForceLaw::Applied(_));
    for case in cases().into_iter().filter(is_pair) {
        for _ in 0..100 {
            let (motion, loads) = drawn(&case, &mut random);
            let exerted = case.law.exerted(&motion, loads);
            let ([x, y], [on_first, on_second]) = (exerted.force, exerted.moments);
            let [of_x, of_y] = [motion.apart[1] * x, motion.apart[0] * y];
            let terms = [of_y, -of_x, on_second, -on_first].map(Dual::value);
            let size: f64 = terms.iter().map(|term| term.abs()).sum();
            let sum: f64 = terms.iter().sum();
            assert!(sum.abs() <= 1e-13 * size, "{:?}: {sum:e} of {size:e} N m", case.law);
        }
    }
}
