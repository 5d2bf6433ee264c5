//! Functions of time against differences, the polynomials a spline must reproduce, and the steps of
//! runs that use them.

use chebclear::expression::curve::Curve;
use chebclear::numerics::instant::{Instant, exact_product, exact_sum};
use chebclear::numerics::turns::wrap;
use chebclear::run::settings::Method;
use chebclear::run::trajectory::{Settings, simulate};
use chebclear::scene::parts::{Force, JointKind, Scene};
use chebclear::scene::time_function::TimeFunction;
use std::cell::RefCell;

use crate::support::{Random, body, compile, derivative, ideal};

fn table(times: &[f64], values: &[f64]) -> TimeFunction {
    TimeFunction::Table(Curve::spline(times, values).expect("the points are good"))
}

/// Uneven increasing times from `start` on.
fn uneven(random: &mut Random, start: f64, count: usize) -> Vec<f64> {
    let mut t = start;
    (0..count)
        .map(|_| {
            t += random.within(0.1, 1.0);
            t
        })
        .collect()
}

#[test]
fn derivatives_are_those_of_the_value() {
    let mut random = Random(1);
    let times = uneven(&mut random, -2.0, 9);
    let values: Vec<f64> = times.iter().map(|_| random.within(-1.0, 1.0)).collect();
    let harmonic = TimeFunction::Harmonic { mean: 0.3, amplitude: 1.2, angular_frequency: 2.5, phase: 0.7 };
    let polynomial = TimeFunction::Polynomial(vec![0.3, -1.0, 0.5, 0.7, -0.2]);
    for function in [harmonic, polynomial, table(&times, &values)] {
        for k in 0..8 {
            // In the middle of a piece of the table, where no difference reaches a knot.
            let t = 0.5 * (times[k] + times[k + 1]);
            let exact = function.at(t);
            for order in 0..3 {
                let by_difference = derivative(|s| vec![function.at(t + s)[order]])[0];
                let scale = 1.0 + exact[order + 1].abs();
                assert!(
                    (by_difference - exact[order + 1]).abs() < 1e-8 * scale,
                    "{function:?}: derivative {} at {t}: {by_difference} {}",
                    order + 1,
                    exact[order + 1]
                );
            }
        }
    }
}

#[test]
fn breaks_are_the_inner_knots_to_the_last_digit() {
    let times = [0.0, 0.1, 0.7, 1.0 / 3.0 + 1.0, 2.0];
    let function = table(&times, &[0.0, 1.0, 0.0, 2.0, 1.0]);
    assert_eq!(function.domain(), [0.0, 2.0]);
    let mut t = -1.0;
    let mut met = Vec::new();
    while function.next_break(t).is_finite() {
        assert_eq!(function.next_break(function.next_break(t).next_down()), function.next_break(t));
        t = function.next_break(t);
        met.push(t);
    }
    assert_eq!(met, times[1..4]);
    // The jump of the third derivative shows from there on, not less than a rounding before.
    let third = |t: Instant| function.at(t)[3];
    let [before, after] = [0.7 - 1e-6, 0.7 + 1e-6].map(|t| third(t.into()));
    assert!(before != after);
    assert_eq!(third(0.7.into()), after);
    assert_eq!([third(0.7_f64.next_down().into()), third(Instant { time: 0.7, rest: -1e-20 })], [before; 2]);
}

#[test]
fn bad_points_are_refused() {
    for (times, values) in [
        (vec![], vec![]),
        (vec![0.0], vec![1.0]),
        (vec![0.0, 1.0], vec![1.0]),
        (vec![0.0, f64::NAN], vec![1.0, 2.0]),
        (vec![0.0, 1.0], vec![f64::INFINITY, 2.0]),
        (vec![0.0, 1.0, 1.0], vec![0.0; 3]),
        // Too close for a slope.
        (vec![0.0, 1e-320, 1.0, 2.0], vec![0.0, 1.0, 2.0, 0.0]),
        (vec![0.0, 1.0, 0.5], vec![0.0; 3]),
    ] {
        assert!(Curve::spline(&times, &values).is_err(), "{times:?} {values:?}");
    }
}

const TIMES: [f64; 6] = [0.0, 0.13, 0.4, 0.45, 0.9, 1.0];
const VALUES: [f64; 6] = [0.0, 1.0, -2.0, 1.5, 0.5, -1.0];

/// A wheel that a table turns by its torque.
fn wheel(inertia: f64, torque: TimeFunction) -> Scene {
    Scene {
        bodies: vec![body("wheel", 1.0, inertia, [0.0, 0.0], Vec::new())],
        joints: vec![ideal("axle", "ground", "wheel", JointKind::Revolute)],
        forces: vec![Force::Torque {
            name: "motor".into(),
            body: "wheel".into(),
            reaction: "ground".into(),
            torque: torque.into(),
        }],
        ..Scene::default()
    }
}

/// Angle and angular velocity of the wheel at the end of the table, from rest: the cubic pieces,
/// found from the spline's own derivatives, integrated twice.
fn turned_by_pieces(inertia: f64, function: &TimeFunction) -> [f64; 2] {
    let (mut angle, mut rate) = (0.0, 0.0);
    for pair in TIMES.windows(2) {
        let h = pair[1] - pair[0];
        let [p, v, a, j] = function.at(pair[0]).map(|value| value / inertia);
        angle += rate * h + h * h * (p / 2.0 + h * (v / 6.0 + h * (a / 24.0 + h * j / 120.0)));
        rate += h * (p + h * (v / 2.0 + h * (a / 6.0 + h * j / 24.0)));
    }
    [angle, rate]
}

#[test]
fn steps_end_at_knots_so_polynomial_pieces_cost_no_accuracy() {
    let function = table(&TIMES, &VALUES);
    let mechanism = compile(&wheel(0.7, function.clone()));
    let exact = turned_by_pieces(0.7, &function);
    // Angles are polynomials of degree 5 between the knots: both methods integrate them exactly, but
    // only if no step goes over a knot.
    for method in [Method::Rodas5P, Method::Dop853] {
        let ends = RefCell::new(Vec::new());
        let settings = Settings { rtol: 1e-3, method, ..Settings::new(1.0, 2) };
        let run = simulate(&mechanism, &settings, &|t| {
            ends.borrow_mut().push(t);
            true
        })
        .unwrap();
        assert_eq!(run.status.word(), "done");
        for knot in &TIMES[1..] {
            let nearest = ends.borrow().iter().map(|t| (t - knot).abs()).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1e-12, "{method:?}: the nearest step ends {nearest:e} s from {knot}");
        }
        let error = (run.end.q[0] - exact[0]).abs().max((run.end.v[0] - exact[1]).abs());
        assert!(error < 1e-13, "{method:?}: off by {error:e} at rtol 1e-3");
    }
}

/// A random integer of 53 bits, as exact as a double can be long.
fn digits(random: &mut Random) -> i64 {
    (random.within(-1.0, 1.0) * 9.0e15) as i64
}

#[test]
fn sums_and_products_lose_nothing() {
    let mut random = Random(4);
    let integer = |value: f64| value as i128;
    for _ in 0..10_000 {
        let (a, b) = (digits(&mut random), digits(&mut random));
        let (sum, rest) = exact_sum(a as f64, 16.0 * b as f64);
        assert_eq!(integer(sum) + integer(rest), i128::from(a) + 16 * i128::from(b));
        let (product, rest) = exact_product(a as f64, b as f64);
        assert_eq!(integer(product) + integer(rest), i128::from(a) * i128::from(b));
    }
    // Numbers too large for halves have a product, and nothing is known of its rest.
    assert_eq!(exact_product(1e305, 2.0), (2e305, 0.0));
    assert_eq!(exact_product(1e200, 1e200).0, f64::INFINITY);
}

#[test]
fn late_in_a_run_functions_are_as_smooth_as_at_its_start() {
    let mut random = Random(5);
    let speed = 209.439_510_239_319_54;
    let late = table(&[0.0, 1e4, 1.1e4, 1.2e4, 2e4], &[0.0, 1.0, 2.0, 3.0, 2.0]);
    for _ in 0..1000 {
        let start = random.within(0.0, 2e4);
        let h = random.within(0.0, 1e-3);
        let instants = [Instant::from(start), Instant::after(start, h)];
        assert!(instants[1].rest != 0.0);

        // The angle of a drive that turns 1000 or 600 000 times, by Taylor's series.
        for coefficients in [vec![0.3, speed], vec![0.3, -speed, 0.01], vec![1.0, 2.0, 0.1, -1e-6]] {
            let function = TimeFunction::Polynomial(coefficients);
            let [([angle, rate, second, third], _), ([later, ..], _)] =
                instants.map(|t| function.angle_at(t));
            let turned = h * (rate + h * (0.5 * second + h * third / 6.0));
            // Rates of 1e3 rad/s are rounded themselves; the angles have half a turn at most.
            let difference = wrap(later - angle - turned).0.abs();
            assert!(difference < 4e-16 * (4.0 + h * rate.abs()), "{function:?} at {start}: {difference:e}");
        }

        // The addition theorem.
        let function =
            TimeFunction::Harmonic { mean: 0.5, amplitude: 2.0, angular_frequency: speed, phase: 0.7 };
        let [[value, rate, ..], [later, ..]] = instants.map(|t| function.at(t));
        let (sine, cosine) = (speed * h).sin_cos();
        let expected = 0.5 + (value - 0.5) * cosine + rate / speed * sine;
        assert!((later - expected).abs() < 4e-15, "at {start}: {:e}", later - expected);

        // Within one piece of a table, again by Taylor's series; each number has its own rounding.
        let [[value, rate, second, third], [later, ..]] = instants.map(|t| late.at(t));
        let expected = value + h * (rate + h * (0.5 * second + h * third / 6.0));
        assert!((later - expected).abs() < 1e-15 * (1.0 + value.abs()), "at {start}: {:e}", later - expected);
    }
}

#[test]
fn a_table_with_long_pieces_is_as_smooth_late_in_a_piece_as_at_its_start() {
    // A straight line, which the spline keeps; the rests below would fill the digits of a rate of 512 ten
    // thousand times over, were they left out.
    let knots = [-0.1, 5e3, 1e4, 1.5e4];
    let line = table(&knots, &knots.map(|t| 512.0 * t));
    let mut random = Random(6);
    for _ in 0..1000 {
        let start = random.within(0.0, 1.5e4);
        let h = random.within(0.0, 1e-3);
        let [(early, _), (late, _)] =
            [Instant::from(start), Instant::after(start, h)].map(|t| line.angle_at(t));
        let difference = wrap(late[0] - early[0] - 512.0 * h).0.abs();
        assert!(difference < 2e-15, "at {start}: {difference:e}");
    }
}
