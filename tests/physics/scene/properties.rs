//! Whatever a scene says, reading and compiling it ends with a mechanism or with problems: no panic, no hang, no
//! number that is not finite.

use crate::scene::{bad_elements, scenes};
use chebclear::mechanism::compiled::Mechanism;
use chebclear::scene::reader::read_scene;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};
use serde_json::{Map, Value, json};

/// Cases of each property; more by the environment variable of this name.
const CASES: &str = "CHEBCLEAR_CASES";
const FEW: u32 = 400;

/// Holds a property against cases that are the same every time.
fn check<S: Strategy>(strategy: S, property: impl Fn(S::Value) -> Result<(), TestCaseError>) {
    let cases = std::env::var(CASES).ok().and_then(|text| text.parse().ok()).unwrap_or(FEW);
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    if let Err(error) = TestRunner::new_with_rng(config, rng).run(&strategy, property) {
        panic!("{error}");
    }
}

fn good() -> Vec<&'static str> {
    vec![scenes::GOOD, bad_elements::GOOD]
}

/// A number of any size and sign, near to what mechanisms have or at the ends of the range.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -2.0..2.0,
        2 => (-12.0..12.0_f64, any::<bool>()).prop_map(|(power, minus)| 10_f64.powf(power) * if minus { -1.0 } else { 1.0 }),
        1 => select(vec![0.0, -0.0, 1.0, -1.0, f64::MIN_POSITIVE, 5e-324, 1e308, -1e308, f64::MAX, 1e154, 3.2]),
    ]
}

/// A JSON value of any kind, nested up to four times.
fn any_value() -> impl Strategy<Value = Value> {
    let words = [
        "ground", "ground.O", "crank.A", "type", "revolute", "clearance_revolute", "", ".", "a.b.c",
        "\u{202e}",
    ];
    let leaf = prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        any::<i64>().prop_map(Value::from),
        number().prop_map(Value::from),
        ".{0,12}".prop_map(Value::from),
        select(words.to_vec()).prop_map(Value::from),
    ];
    leaf.prop_recursive(4, 24, 5, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..5).prop_map(Value::from),
            prop::collection::vec((".{0,8}", inner), 0..5)
                .prop_map(|pairs| Value::from(pairs.into_iter().collect::<Map<String, Value>>())),
        ]
    })
}

/// Places of everything inside a value, as JSON pointers.
pub(crate) fn places(value: &Value, at: &str, found: &mut Vec<String>) {
    found.push(at.to_owned());
    match value {
        Value::Object(fields) => {
            for (name, inner) in fields {
                places(inner, &format!("{at}/{}", name.replace('~', "~0").replace('/', "~1")), found);
            }
        }
        Value::Array(items) => {
            for (index, inner) in items.iter().enumerate() {
                places(inner, &format!("{at}/{index}"), found);
            }
        }
        _ => {}
    }
}

/// The problems of a text or its mechanism; both must be sound.
fn judge(text: &str) -> Result<(), TestCaseError> {
    match read_scene(text) {
        Ok(scene) => {
            prop_assert!(scene.check().is_ok(), "a scene that was read has problems");
            if let Ok(mechanism) = Mechanism::compile(&scene) {
                let start = &mechanism.start;
                let numbers = start.q.iter().chain(&start.v);
                prop_assert!(numbers.copied().all(f64::is_finite), "the start is not finite");
            }
        }
        Err(error) => prop_assert!(!error.problems.is_empty(), "refused without a problem"),
    }
    Ok(())
}

#[test]
fn any_value_in_any_place_is_read_or_refused() {
    let changes = prop::collection::vec((any::<Index>(), any_value()), 1..4);
    check((select(good()), changes), |(text, changes)| {
        let mut scene: Value = serde_json::from_str(text).unwrap();
        for (place, value) in changes {
            let mut found = Vec::new();
            places(&scene, "", &mut found);
            *scene.pointer_mut(place.get::<String>(&found)).unwrap() = value;
        }
        judge(&scene.to_string())
    });
}

#[test]
fn any_numbers_are_read_or_refused() {
    check((select(good()), prop::collection::vec((any::<Index>(), number()), 1..12)), |(text, changes)| {
        let mut scene: Value = serde_json::from_str(text).unwrap();
        let mut found = Vec::new();
        places(&scene, "", &mut found);
        found.retain(|place| scene.pointer(place).is_some_and(Value::is_number));
        for (place, value) in changes {
            *scene.pointer_mut(place.get::<String>(&found)).unwrap() = json!(value);
        }
        judge(&scene.to_string())
    });
}

#[test]
fn any_text_is_read_or_refused() {
    let cut = (any::<Index>(), 0..40_usize, prop_oneof![".{0,10}", "[\\[{]{0,300}", "[0-9eE.+-]{0,20}"]);
    check((select(good()), cut), |(text, (place, length, put))| {
        let characters: Vec<char> = text.chars().collect();
        let start = place.index(characters.len());
        let end = (start + length).min(characters.len());
        let mut torn: String = characters[..start].iter().collect();
        torn.push_str(&put);
        torn.extend(&characters[end..]);
        judge(&torn)
    });
}
