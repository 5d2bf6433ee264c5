//! Reads functions of time and of the motion from JSON.

use crate::contact::formula::Formula;
use crate::expression::curve::{Beyond, Curve, Interpolation};
use crate::expression::dimension::{Dimension, unit};
use crate::scene::json::{Fields, Kind, Node, at_least, finite};
use crate::scene::loads::{Expression, Load};
use crate::scene::parts::Force;
use crate::scene::quantities::TIME;
use crate::scene::time_function::TimeFunction;

/// Placeholder of a function that could not be read, for which a problem was added.
const UNREADABLE: Load = Load::Time(TimeFunction::Polynomial(Vec::new()));

/// A function of time: a number, or an object.
pub(super) fn time_function(fields: &mut Fields, name: &'static str) -> TimeFunction {
    match load(fields, name, "rad or m") {
        Load::Time(function) => function,
        Load::Motion(expression) => expression.of_time().unwrap_or_else(|message| {
            fields.problem(name, message);
            TimeFunction::Polynomial(Vec::new())
        }),
    }
}

/// A function of time or of the motion: a number, or an object.
pub(super) fn load(fields: &mut Fields, name: &'static str, unit: &str) -> Load {
    fields.required(name).map_or(Load::NONE, |node| load_at(node, unit))
}

/// The same, zero if it is left out.
pub(super) fn load_or_none(fields: &mut Fields, name: &'static str, unit: &str) -> Load {
    fields.optional(name).map_or(Load::NONE, |node| load_at(node, unit))
}

fn load_at(node: Node, unit: &str) -> Load {
    if !node.value.is_object() {
        return Load::Time(TimeFunction::constant(node.quantity(finite(unit))));
    }
    let kinds: [Kind<Load>; 4] = [
        ("polynomial", &|fields| Load::Time(polynomial(fields, unit))),
        ("harmonic", &|fields| {
            Load::Time(TimeFunction::Harmonic {
                mean: fields.quantity_or("mean", finite(unit), 0.0),
                amplitude: fields.quantity("amplitude", finite(unit)),
                angular_frequency: fields.quantity("angular_frequency", finite("rad/s")),
                phase: fields.quantity_or("phase", finite("rad"), 0.0),
            })
        }),
        ("table", &table),
        ("expression", &|fields| {
            expression_in(fields).map_or(UNREADABLE, |expression| Load::Motion(Box::new(expression)))
        }),
    ];
    node.read(|fields| fields.one_of("function", &kinds))
}

fn polynomial(fields: &mut Fields, unit: &str) -> TimeFunction {
    let coefficients = fields.required("coefficients").map_or_else(Vec::new, |node| {
        let coefficients = node.quantities(finite(&format!("{unit} s^-k")));
        if coefficients.is_empty() && node.value.is_array() {
            node.problem("must not be empty");
        }
        coefficients
    });
    TimeFunction::Polynomial(coefficients)
}

fn table(fields: &mut Fields) -> Load {
    let read = fields.sound(|fields| {
        let [points, values] = ["points", "values"].map(|field| fields.numbers(field));
        let over = fields.text_or("over", TIME);
        let ways = [
            ("linear", Interpolation::Linear),
            ("monotone", Interpolation::Monotone),
            ("cubic", Interpolation::Cubic),
        ];
        let is_of_time = over.trim() == TIME;
        let interpolation = match fields.optional("interpolation") {
            Some(_) => fields.word("interpolation", &ways),
            None if is_of_time => Interpolation::Cubic,
            None => Interpolation::Linear,
        };
        let periodic = fields.optional("periodic").is_some_and(|node| node.truth());
        let beyond = match fields.optional("beyond") {
            Some(_) => fields.word("beyond", &[("end", Beyond::End), ("hold", Beyond::Hold)]),
            None => Beyond::End,
        };
        if periodic && beyond == Beyond::Hold {
            fields.problem("beyond", "must be \"end\" in a periodic table, which has no ends");
        }
        let beyond = if periodic { Beyond::Repeat } else { beyond };
        let curve = Curve::new(&points, &values, interpolation, beyond)?;
        if is_of_time && interpolation == Interpolation::Cubic && beyond == Beyond::End {
            return Ok(Load::Time(TimeFunction::Table(curve)));
        }
        Ok(Load::Motion(Box::new(Expression::read(over, Vec::new())?.tabulated(curve))))
    });
    read.unwrap_or(Ok(UNREADABLE)).unwrap_or_else(|message: String| {
        fields.problem("points", message);
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
fn number_or_formula(fields: &mut Fields, name: &'static str, unit: &str) -> (f64, Option<Box<Expression>>) {
    match fields.optional(name) {
        None => (0.0, None),
        Some(node) if !node.value.is_object() => (node.quantity(at_least(0.0, unit)), None),
        Some(node) => (0.0, node.read(formula).map(Box::new)),
    }
}

pub(super) fn bushing(fields: &mut Fields) -> Force {
    let [name, a, b] = ["name", "a", "b"].map(|field| fields.text(field));
    let read = BUSHING.map(|(field, dimension)| number_or_formula(fields, field, &unit(dimension)));
    fields.required("stiffness");
    let coefficients = read.each_ref().map(|(number, _)| *number);
    Force::Bushing { name, a, b, coefficients, formulas: read.map(|(_, formula)| formula) }
}

/// A law of a contact as a formula of quantities with these names; none after a problem was noted.
pub(super) fn law(
    fields: &mut Fields,
    name: &'static str,
    of: &[(&'static str, Dimension)],
    wanted: Dimension,
) -> Option<Formula> {
    let expression = fields.required(name)?.read(formula)?;
    expression.law(of, &fields.path_of(name), wanted).map_err(|found| fields.add_all(found)).ok()
}

/// An object that can only be a formula.
fn formula(fields: &mut Fields) -> Option<Expression> {
    fields.tag("function", &[("expression", ())]);
    expression_in(fields)
}

/// The fields of a formula; none after a problem was noted.
pub(super) fn expression_in(fields: &mut Fields) -> Option<Expression> {
    let (text, constants) =
        fields.sound(|fields| (fields.text("text"), fields.named_numbers("constants")))?;
    Expression::read(text, constants).map_err(|message| fields.problem("text", message)).ok()
}
