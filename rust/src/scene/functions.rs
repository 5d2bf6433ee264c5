//! Reads functions of time and of the motion from JSON.

use crate::error::Problem;
use crate::expression::curve::{Beyond, Curve, Interpolation};
use crate::scene::json::{Fields, Node, Problems};
use crate::scene::loads::{Expression, Load};
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
