//! Reads functions of time and of the motion from JSON.

use crate::contact::formula::Formula;
use crate::error::Problem;
use crate::expression::curve::{Beyond, Curve, Interpolation};
use crate::expression::dimension::Dimension;
use crate::scene::json::{Fields, Node, Problems};
use crate::scene::loads::{Expression, Load};
use crate::scene::parts::Force;
use crate::scene::quantities::TIME;
use crate::scene::time_function::{Spline, TimeFunction};

#[derive(Clone, Copy)]
enum FunctionName {
    Polynomial,
    Harmonic,
    Table,
    Expression,
}

/// Placeholder of a function that could not be read, for which a problem was added.
const UNREADABLE: Load = Load::Time(TimeFunction::Polynomial(Vec::new()));

/// A function of time: a number, or an object.
pub(super) fn time_function(
    fields: &mut Fields,
    name: &'static str,
    problems: &mut Problems,
) -> TimeFunction {
    match load(fields, name, problems) {
        Load::Time(function) => function,
        Load::Motion(expression) => expression.of_time().unwrap_or_else(|message| {
            problems.push(Problem::new(fields.path_of(name), message));
            TimeFunction::Polynomial(Vec::new())
        }),
    }
}

/// A function of time or of the motion: a number, or an object.
pub(super) fn load(fields: &mut Fields, name: &'static str, problems: &mut Problems) -> Load {
    match fields.required(name, problems) {
        Some(node) => load_at(&node, problems),
        None => Load::Time(TimeFunction::constant(f64::NAN)),
    }
}

/// The same, zero if it is left out.
pub(super) fn load_or_none(fields: &mut Fields, name: &'static str, problems: &mut Problems) -> Load {
    fields.optional(name).map_or(Load::NONE, |node| load_at(&node, problems))
}

fn load_at(node: &Node, problems: &mut Problems) -> Load {
    if !node.value.is_object() {
        return Load::Time(TimeFunction::constant(node.number(problems)));
    }
    let mut fields = node.fields(problems);
    let names = [
        ("polynomial", FunctionName::Polynomial),
        ("harmonic", FunctionName::Harmonic),
        ("table", FunctionName::Table),
        ("expression", FunctionName::Expression),
    ];
    let function = match fields.tag("function", &names, problems) {
        FunctionName::Polynomial => Load::Time(polynomial(&mut fields, problems)),
        FunctionName::Harmonic => Load::Time(TimeFunction::Harmonic {
            mean: fields.number_or("mean", 0.0, problems),
            amplitude: fields.number("amplitude", problems),
            angular_frequency: fields.number("angular_frequency", problems),
            phase: fields.number_or("phase", 0.0, problems),
        }),
        FunctionName::Table => table(&mut fields, problems),
        FunctionName::Expression => expression_in(&mut fields, problems)
            .map_or(UNREADABLE, |expression| Load::Motion(Box::new(expression))),
    };
    fields.finish(problems);
    function
}

fn polynomial(fields: &mut Fields, problems: &mut Problems) -> TimeFunction {
    let before = problems.len();
    let mut coefficients = fields.numbers("coefficients", problems);
    if coefficients.is_empty() && problems.len() == before {
        problems.push(Problem::new(fields.path_of("coefficients"), "must not be empty"));
    }
    if coefficients.len() == 1 {
        // A single coefficient would count as a plain number, and problems would have the path of
        // one.
        coefficients.push(0.0);
    }
    TimeFunction::Polynomial(coefficients)
}

fn table(fields: &mut Fields, problems: &mut Problems) -> Load {
    let before = problems.len();
    let points = fields.numbers("points", problems);
    let values = fields.numbers("values", problems);
    let over = fields.optional("over").map_or_else(|| TIME.to_owned(), |node| node.text(problems));
    let ways = [
        ("linear", Interpolation::Linear),
        ("monotone", Interpolation::Monotone),
        ("cubic", Interpolation::Cubic),
    ];
    let is_of_time = over.trim() == TIME;
    let interpolation = match fields.optional("interpolation") {
        Some(_) => fields.word("interpolation", &ways, problems),
        None if is_of_time => Interpolation::Cubic,
        None => Interpolation::Linear,
    };
    let periodic = fields.optional("periodic").is_some_and(|node| node.truth(problems));
    let beyond = match fields.optional("beyond") {
        Some(_) => fields.word("beyond", &[("end", Beyond::End), ("hold", Beyond::Hold)], problems),
        None => Beyond::End,
    };
    if periodic && beyond == Beyond::Hold {
        let message = "must be \"end\" in a periodic table, which has no ends";
        problems.push(Problem::new(fields.path_of("beyond"), message));
    }
    if problems.len() > before {
        return UNREADABLE;
    }
    let beyond = if periodic { Beyond::Repeat } else { beyond };
    let read = if is_of_time && interpolation == Interpolation::Cubic && beyond == Beyond::End {
        Spline::new(&points, &values).map(|spline| Load::Time(TimeFunction::Table(spline)))
    } else {
        Curve::new(&points, &values, interpolation, beyond).and_then(|curve| {
            let expression = Expression::read(over, Vec::new())?;
            Ok(Load::Motion(Box::new(expression.tabulated(curve))))
        })
    };
    read.unwrap_or_else(|message| {
        problems.push(Problem::new(fields.path_of("points"), message));
        UNREADABLE
    })
}

/// The numbers of a bushing, with their dimensions: stiffness and damping, radial and torsional.
pub(super) const BUSHING: [(&str, Dimension); 4] = [
    ("stiffness", [1, 0, -2]),
    ("damping", [1, 0, -1]),
    ("torsional_stiffness", [1, 2, -2]),
    ("torsional_damping", [1, 2, -1]),
];

/// A number, or a formula of the motion in its place; zero if it is left out.
fn number_or_formula(
    fields: &mut Fields,
    name: &'static str,
    problems: &mut Problems,
) -> (f64, Option<Box<Expression>>) {
    let Some(node) = fields.optional(name) else { return (0.0, None) };
    if !node.value.is_object() {
        return (node.number(problems), None);
    }
    let mut inner = node.fields(problems);
    inner.tag("function", &[("expression", ())], problems);
    let expression = expression_in(&mut inner, problems);
    inner.finish(problems);
    (0.0, expression.map(Box::new))
}

/// A bushing.
pub(super) fn bushing(fields: &mut Fields, problems: &mut Problems) -> Force {
    let [name, a, b] = ["name", "a", "b"].map(|field| fields.text(field, problems));
    let [stiffness, damping, torsional_stiffness, torsional_damping] =
        BUSHING.map(|(field, _)| number_or_formula(fields, field, problems));
    fields.required("stiffness", problems);
    Force::Bushing {
        name,
        a,
        b,
        stiffness: stiffness.0,
        damping: damping.0,
        torsional_stiffness: torsional_stiffness.0,
        torsional_damping: torsional_damping.0,
        formulas: [stiffness.1, damping.1, torsional_stiffness.1, torsional_damping.1],
    }
}

/// A law of a contact as a formula of quantities with these names; none after a problem was noted.
pub(super) fn law(
    fields: &mut Fields,
    name: &'static str,
    of: &[(&'static str, Dimension)],
    wanted: Dimension,
    problems: &mut Problems,
) -> Option<Formula> {
    let mut inner = fields.required(name, problems)?.fields(problems);
    inner.tag("function", &[("expression", ())], problems);
    let expression = expression_in(&mut inner, problems);
    inner.finish(problems);
    let law = expression?.law(of, &fields.path_of(name), wanted);
    law.map_err(|found| problems.extend(found)).ok()
}

/// The fields of a formula; none after a problem was noted.
pub(super) fn expression_in(fields: &mut Fields, problems: &mut Problems) -> Option<Expression> {
    let before = problems.len();
    let text = fields.text("text", problems);
    let constants = fields.named_numbers("constants", problems);
    if problems.len() > before {
        return None;
    }
    let read = Expression::read(text, constants);
    read.map_err(|message| problems.push(Problem::new(fields.path_of("text"), message))).ok()
}
