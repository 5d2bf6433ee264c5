//! The language of expressions: values and derivatives against the same formulas in Rust, and what it refuses.

use chebclear::expression::dimension::{Dimension, FORCE, PLAIN, dimension};
use chebclear::expression::enclosure::Enclosure;
use chebclear::expression::grammar::parse;
use chebclear::expression::tape::Tape;
use chebclear::numerics::interval::Interval;
use chebclear::numerics::jet::Jet;

use crate::support::{Random, derivative};

/// Formulas of x, y and z with the same in Rust.
type Formula = (&'static str, fn(f64, f64, f64) -> f64);

const FORMULAS: [Formula; 25] = [
    ("x + y * z", |x, y, z| x + y * z),
    ("x - y - z", |x, y, z| x - y - z),
    ("x / y / z", |x, y, z| x / y / z),
    ("-x**2", |x, _, _| -(x * x)),
    ("x**-2 + 2**3**2", |x, _, _| x.powi(-2) + 512.0),
    ("(x + y) * (x - z)", |x, y, z| (x + y) * (x - z)),
    ("x**y * z", |x, y, z| x.powf(y) * z),
    ("x**0.5 * y**1.5 - z**3 - x/4", |x, y, z| x.powf(0.5) * y.powf(1.5) - z.powi(3) - x / 4.0),
    ("x**2.5 + 1e-3 * y", |x, y, _| x.powf(2.5) + 1e-3 * y),
    ("acos(x/9) + asin(y/9) + atan(z)", |x, y, z| (x / 9.0).acos() + (y / 9.0).asin() + z.atan()),
    ("cos(x) * sin(y) + tan(z/9)", |x, y, z| x.cos() * y.sin() + (z / 9.0).tan()),
    ("exp(-x) * log(y) + sqrt(z)", |x, y, z| (-x).exp() * y.ln() + z.sqrt()),
    ("tanh(x - y)", |x, y, _| (x - y).tanh()),
    ("atan2(y, -x) + hypot(x, z)", |x, y, z| y.atan2(-x) + x.hypot(z)),
    ("abs(x - y) + abs(y - x)", |x, y, _| 2.0 * (x - y).abs()),
    ("sign(x - y) * z", |x, y, z| if x < y { -z } else { z }),
    ("min(x, y, z)", |x, y, z| x.min(y).min(z)),
    ("max(x, y, z) * 2", |x, y, z| 2.0 * x.max(y).max(z)),
    ("if(x < y, z, -z)", |x, y, z| if x < y { z } else { -z }),
    ("if(x > y, x*x, y*y)", |x, y, _| if x > y { x * x } else { y * y }),
    ("if(x <= y, if(y < z, 1*x, 2*x), 3*x)", |x, y, z| {
        x * if x < y { if y < z { 1.0 } else { 2.0 } } else { 3.0 }
    }),
    ("k * (x - 2*k) + pi", |x, _, _| 3.0 * (x - 6.0) + std::f64::consts::PI),
    ("+x - -y", |x, y, _| x + y),
    ("x * (y * (z * (x + (y + (z + 1)))))", |x, y, z| x * (y * (z * (x + (y + (z + 1.0)))))),
    ("min(abs(x - 2), max(y, 3)) ** 2", |x, y, _| (x - 2.0).abs().min(y.max(3.0)).powi(2)),
];

fn index(name: &str) -> usize {
    ["x", "y", "z"].iter().position(|known| *known == name).unwrap()
}

fn compiled(text: &str) -> Tape {
    Tape::new(&parse(text).unwrap(), &[("k".to_owned(), 3.0)], &mut { index }, None).unwrap()
}

/// The states of all switches where they belong to the variables.
fn settled(tape: &Tape, at: &[f64; 3]) -> Vec<i64> {
    let mut states = vec![0; tape.switches.len()];
    for switch in 0..states.len() {
        states[switch] = tape.state(switch, at, &states);
    }
    states
}

#[test]
fn values_and_derivatives_are_those_of_the_formula() {
    let mut random = Random(3);
    for (text, formula) in FORMULAS {
        let tape = compiled(text);
        for _ in 0..50 {
            let at: [f64; 3] = std::array::from_fn(|_| random.within(0.5, 5.0));
            let states = settled(&tape, &at);
            let value = tape.value(&at, &states);
            let expected = formula(at[0], at[1], at[2]);
            assert!(
                (value - expected).abs() <= 1e-13 * expected.abs().max(1.0),
                "{text}: {value}, {expected}"
            );
            let gradient = tape.gradient(&at, &states);
            for k in 0..3 {
                let slope = derivative(|h| {
                    let mut near = at;
                    near[k] += h;
                    vec![tape.value(&near, &states)]
                })[0];
                let size = slope.abs().max(expected.abs()).max(1.0);
                assert!((gradient[k] - slope).abs() <= 1e-7 * size, "{text}: {} and {slope}", gradient[k]);
            }
        }
    }
}

/// Whether a range holds a number but for rounding.
fn holds(range: Interval, number: f64) -> bool {
    let rounding = 1e-9 * number.abs().max(1.0);
    range.lower - rounding <= number && number <= range.upper + rounding
}

#[test]
fn ranges_hold_all_values_and_derivatives_on_the_way() {
    let mut random = Random(5);
    for (text, _) in FORMULAS {
        let tape = compiled(text);
        for round in 0..100 {
            // On a straight way, short or long.
            let start: [f64; 3] = std::array::from_fn(|_| random.within(0.5, 5.0));
            let size = if round % 2 == 0 { 0.05 } else { 5.0 };
            let rates = start.map(|from| (random.within(0.5, 5.0) - from) * size / 5.0);
            let way = [0, 1, 2].map(|k| {
                Enclosure::<4>::quantity(
                    Interval::between(start[k], start[k] + rates[k]),
                    Interval::point(rates[k]),
                )
            });
            let Enclosure(ranges) = tape.enclose(&way);
            for _ in 0..10 {
                let part = random.unit();
                let at = [0, 1, 2].map(|k| start[k] + part * rates[k]);
                let jets = [0, 1, 2].map(|k| Jet([at[k], rates[k], 0.0, 0.0]));
                let Jet(exact) = tape.value(&jets, &settled(&tape, &at));
                for (order, (range, exact)) in ranges.iter().zip(exact).enumerate() {
                    assert!(holds(*range, exact), "{text}, order {order} at {at:?}: {exact} in {range:?}");
                }
            }
        }
    }
}

#[test]
fn ranges_close_in_on_the_value() {
    let mut random = Random(6);
    for (text, _) in FORMULAS {
        let tape = compiled(text);
        let at: [f64; 3] = std::array::from_fn(|_| random.within(0.5, 5.0));
        let near = at.map(|x| Enclosure::<1>::quantity(Interval::between(x, x + 1e-9), Interval::WHOLE));
        let Enclosure([range]) = tape.enclose(&near);
        let value = tape.value(&at, &settled(&tape, &at));
        assert!(range.holds(value) || holds(range, value), "{text}");
        assert!(range.upper - range.lower < 1e-4 * value.abs().max(1.0), "{text}: {range:?}");
    }
}

#[test]
fn a_formula_has_the_bound_that_it_has_everywhere() {
    for (text, bound) in [
        ("7*exp(-((x - 1)/0.01)**2)", 7.0),
        ("50*exp(200*(cos(x) - 1))", 50.0),
        ("3*sin(x*y) - 2", 5.0),
        ("if(x < y, 800, -20)", 800.0),
        ("4*tanh(x)/(1 + y**2)", 4.0),
        ("-k*x", f64::INFINITY),
    ] {
        assert_eq!(compiled(text).bound(), bound, "{text}");
    }
}

#[test]
fn a_power_that_starts_flat_has_no_slope_at_zero() {
    for text in ["x**1.5", "x**2", "x**3", "x**2.5"] {
        let tape = compiled(text);
        let at = [0.0; 3];
        assert_eq!((tape.value(&at, &[]), tape.gradient(&at, &[])[0]), (0.0, 0.0), "{text}");
    }
}

#[test]
fn derivatives_with_respect_to_time_are_those_of_differences() {
    let formulas = [
        "2 + 3*time - time**3",
        "sin(3*time) * exp(-time)",
        "cos(time)**2 / (1 + time)",
        "sqrt(1 + time**4)",
        "log(1 + time) * tan(time/3)",
        "tanh(2*time - 1)",
        "atan(time) + asin(time/4) - acos(time/5)",
        "atan2(time, 1 - time)",
        "hypot(time, 1 + time)",
        "2**time",
        "time**2.5",
        "(1 + time)**(0.5*time)",
        "k*(time/2 - sin(2*pi*time/2)/(2*pi))",
    ];
    for text in formulas {
        let tape =
            Tape::new(&parse(text).unwrap(), &[("k".to_owned(), 3.0)], &mut |_: &str| 0, None).unwrap();
        for t in [0.3, 0.8, 1.1, 1.9] {
            let exact = tape.of_time(t);
            assert!((exact[0] - tape.value(&[t], &[])).abs() <= 1e-15 * exact[0].abs(), "{text}");
            let differences = derivative(|h| tape.of_time(t + h)[..3].to_vec());
            for (order, (exact, difference)) in exact[1..].iter().zip(&differences).enumerate() {
                let size = exact.abs().max(1.0);
                assert!(
                    (exact - difference).abs() < 1e-7 * size,
                    "{text}, {order}: {exact} and {difference}"
                );
            }
        }
    }
}

#[test]
fn a_switch_tells_how_far_its_state_lasts() {
    let mut random = Random(4);
    for (text, formula) in FORMULAS {
        let tape = compiled(text);
        for _ in 0..20 {
            let at: [f64; 3] = std::array::from_fn(|_| random.within(0.5, 5.0));
            let mut states = settled(&tape, &at);
            for switch in 0..states.len() {
                let distance = tape.distance(switch, &at, &states).value;
                assert!(distance >= 0.0, "{text}: {distance}");
                let gradient = tape.distance_gradient(switch, &at, &states);
                let slope = derivative(|h| {
                    let near = [at[0] + h, at[1], at[2]];
                    vec![tape.distance(switch, &near, &states).value]
                })[0];
                assert!((gradient[0] - slope).abs() <= 1e-7, "{text}: {} and {slope}", gradient[0]);
                // In the other state it is as far behind.
                let last = states[switch];
                states[switch] = tape.next_state(switch, &at, &states);
                assert_eq!(tape.distance(switch, &at, &states).value, -distance);
                states[switch] = last;
            }
            assert!(formula(at[0], at[1], at[2]).is_finite());
        }
    }
}

#[test]
fn what_is_no_expression_is_refused_where_it_goes_wrong() {
    for (text, place, message) in [
        ("", 0, "ends too early"),
        ("x +", 3, "ends too early"),
        ("x y", 2, "goes on"),
        ("(x", 2, "must go on with ')'"),
        ("x)", 1, "goes on"),
        ("sinn(x)", 0, "unknown function \"sinn\"; did you mean"),
        ("sin(x, y)", 0, "takes 1 argument, got 2"),
        ("if(x, y, z)", 4, "needs a comparison"),
        ("if(x < y, z)", 0, "takes a comparison and 2 values"),
        ("x < y", 2, "compares outside"),
        ("x = y", 2, "'='"),
        ("x.", 1, "\".\""),
        ("import os; x", 9, "';'"),
        ("9**9**9**9**x$", 13, "'$'"),
        ("1e999", 0, "no finite number"),
    ] {
        let mistake = parse(text).unwrap_err();
        assert!(mistake.message.contains(message), "{text:?}: {}", mistake.message);
        assert_eq!(mistake.place, place, "{text:?}: {}", mistake.message);
    }
    for hostile in ["(".repeat(900), "-".repeat(900), "x+".repeat(600), "sin(".repeat(200)] {
        assert!(parse(&hostile).is_err());
    }
}

#[test]
fn units_are_checked_as_far_as_they_are_known() {
    let of_name = |name: &str| -> Option<Dimension> {
        match name {
            "x" => Some([0, 1, 0]),
            "v" => Some([0, 1, -1]),
            "angle" => Some(PLAIN),
            "f" => Some(FORCE),
            _ => None,
        }
    };
    let of = |text: &str| dimension(&parse(text).unwrap(), &of_name);
    for (text, expected) in [
        ("x", Some([0, 1, 0])),
        ("x * v", Some([0, 2, -1])),
        ("x / v", Some([0, 0, 1])),
        ("x + 3", Some([0, 1, 0])),
        ("k * x", None),
        ("sqrt(x * x)", Some([0, 1, 0])),
        ("(x / v)**2", Some([0, 0, 2])),
        ("sin(angle)", Some(PLAIN)),
        ("tanh(v / 0.1)", Some(PLAIN)),
        ("sign(v) * f", Some(FORCE)),
        ("if(x < 0.1, f, 0)", Some(FORCE)),
        ("atan2(x, x)", Some(PLAIN)),
        ("hypot(v, v)", Some([0, 1, -1])),
        ("max(x, 0.2)", Some([0, 1, 0])),
    ] {
        assert_eq!(of(text), Ok(expected), "{text}");
    }
    for text in ["x + v", "x < 0", "exp(x)", "if(x < v, 1, 2)", "min(x, v)", "2**x", "hypot(x, v)"] {
        assert!(parse(text).is_err() || of(text).is_err(), "{text}");
    }
}
