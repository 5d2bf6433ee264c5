//! Forces and torques as functions of time or of the motion.

use crate::contact::formula::{Formula, MOST_SWITCHES};
use crate::error::{Problem, meant_or_known};
use crate::expression::curve::Curve;
use crate::expression::dimension::{Dimension, PLAIN, dimension, unit};
use crate::expression::grammar::{Syntax, parse};
use crate::expression::tape::{MOST_VARIABLES, Ranges, Tape};
use crate::scene::parts::Scene;
use crate::scene::quantities::{Quantity, TIME};
use crate::scene::time_function::TimeFunction;

/// A component of a force, or a torque.
#[derive(Clone, Debug, PartialEq)]
pub enum Load {
    /// A function of time.
    Time(TimeFunction),
    /// A function of the motion.
    Motion(Box<Expression>),
}

impl Load {
    /// No force or torque.
    pub const NONE: Load = Load::Time(TimeFunction::Polynomial(Vec::new()));

    /// Whether it is zero for good.
    pub fn is_none(&self) -> bool {
        matches!(self, Load::Time(TimeFunction::Polynomial(coefficients)) if coefficients.iter().all(|c| *c == 0.0))
    }
}

impl From<TimeFunction> for Load {
    fn from(function: TimeFunction) -> Load {
        Load::Time(function)
    }
}

/// A function of the motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    /// What the user wrote.
    pub text: String,
    /// The same, read.
    syntax: Syntax,
    /// The names in it that stand for numbers.
    constants: Vec<(String, f64)>,
    /// A table over the expression.
    table: Option<Curve>,
}

impl Expression {
    /// Reads an expression whose names are `constants`, or quantities of the motion.
    ///
    /// # Errors
    /// What is wrong with the text, and where.
    pub fn read(text: String, constants: Vec<(String, f64)>) -> Result<Expression, String> {
        let syntax = parse(&text)
            .map_err(|mistake| format!("{} ({})", mistake.message, place_in(&text, mistake.place)))?;
        Ok(Expression { text, syntax, constants, table: None })
    }

    /// A table over the expression.
    #[must_use]
    pub fn tabulated(self, table: Curve) -> Expression {
        Expression { table: Some(table), ..self }
    }

    /// The quantities of the motion in it, each once.
    pub fn quantities(&self, scene: &Scene) -> Vec<(String, Quantity)> {
        let mut found = Vec::new();
        for (name, _) in self.syntax.names() {
            let is_known = self.value_of(name).is_some() || found.iter().any(|(other, _)| other == name);
            if let (false, Ok(quantity)) = (is_known, scene.quantity(name)) {
                found.push((name.to_owned(), quantity));
            }
        }
        found
    }

    /// The expression as a function of time for a prescribed motion.
    ///
    /// # Errors
    /// Why it is none, or has too few derivatives.
    pub(crate) fn of_time(&self) -> Result<TimeFunction, String> {
        self.smooth_in(TIME, "a prescribed motion").map(TimeFunction::Formula)
    }

    /// The expression as a function of one variable with three derivatives, for `what`.
    ///
    /// # Errors
    /// Why it is none.
    pub(crate) fn smooth_in(&self, variable: &str, what: &str) -> Result<Tape, String> {
        let others = || self.syntax.names().into_iter().filter(|(name, _)| self.value_of(name).is_none());
        if let Some((name, place)) = others().find(|(name, _)| *name != variable) {
            let place = place_in(&self.text, place);
            return Err(format!(
                "{what} may depend on {variable:?} and constants alone, not on {name:?} ({place})"
            ));
        }
        if let Some((name, value)) = self.constants.iter().find(|(_, value)| !value.is_finite()) {
            return Err(format!("the constant {name:?} must be a finite number, got {value}"));
        }
        let tape = self.compiled(&[variable], None)?;
        if !tape.switches.is_empty() {
            return Err(format!(
                "{what} must have three derivatives: if, sign, abs, min, max and tables but the cubic one over the time \
                 have not"
            ));
        }
        Ok(tape)
    }

    /// What is wrong with the units in it, where its names have the dimensions `of_name` and it must have `wanted`.
    pub(crate) fn wrong_dimension(
        &self,
        of_name: &dyn Fn(&str) -> Option<Dimension>,
        wanted: Dimension,
    ) -> Option<String> {
        match dimension(&self.syntax, of_name) {
            Err(message) => Some(format!("{:?} {message}", self.text)),
            // A number that stands alone, such as the factor 1 before an angle, may have any unit.
            Ok(Some(known)) if known != wanted && known != PLAIN && self.table.is_none() => {
                Some(format!("{:?} has the unit [{}], must have [{}]", self.text, unit(known), unit(wanted)))
            }
            Ok(_) => None,
        }
    }

    /// The expression compiled, where its variables have these names.
    ///
    /// # Errors
    /// If it cannot be evaluated in the memory of a tape.
    pub fn tape(&self, names: &[&str]) -> Result<Tape, String> {
        self.compiled(names, Some(&range_of_quantity))
    }

    /// The same, with the range of a variable where the ends of domains are watched.
    fn compiled(&self, names: &[&str], range: Option<Ranges<'_>>) -> Result<Tape, String> {
        let index = |name: &str| names.iter().position(|other| *other == name).unwrap_or_default();
        let tape = Tape::new(&self.syntax, &self.constants, &mut { index }, range)?;
        Ok(match &self.table {
            Some(table) => tape.of_curve(table.clone()),
            None => tape,
        })
    }

    /// The expression as a law of a contact, of quantities with these names.
    ///
    /// # Errors
    /// What is wrong with it, where it stands at `path` and must have the dimension `wanted`.
    pub(crate) fn law(
        &self,
        of: &[(&'static str, Dimension)],
        path: &str,
        wanted: Dimension,
    ) -> Result<Formula, Vec<Problem>> {
        let find = |name: &str| {
            let found = of.iter().find(|(other, _)| *other == name).map(|(_, dimension)| *dimension);
            let hint = || meant_or_known(name, of.iter().map(|(name, _)| *name));
            found.ok_or_else(|| format!("unknown quantity {name:?}{}", hint()))
        };
        let problems = self.problems_among(&find, path, wanted);
        if !problems.is_empty() {
            return Err(problems);
        }
        let names: Vec<&str> = of.iter().map(|(name, _)| *name).collect();
        let tape = self.tape(&names).map_err(|message| vec![Problem::new(path, message)])?;
        if tape.switches.len() > MOST_SWITCHES {
            let count = tape.switches.len();
            let message = format!("changes its form at {count} places; at most {MOST_SWITCHES} are accepted");
            return Err(vec![Problem::new(path, message)]);
        }
        let depends = [0, 1, 2].map(|index| {
            let used = |name: &&str| self.syntax.names().iter().any(|(other, _)| other == name);
            names.get(index).is_some_and(used)
        });
        Ok(Formula { text: self.text.clone(), tape, depends })
    }

    /// What is wrong with the names, units and numbers in it, where a load of the dimension `wanted` stands at `path`.
    pub(crate) fn problems(&self, scene: &Scene, path: &str, wanted: Dimension) -> Vec<Problem> {
        self.problems_among(&|name| scene.quantity(name).map(Quantity::dimension), path, wanted)
    }

    /// The same where `find` gives the dimension of a quantity, or says what is wrong with its name.
    fn problems_among(
        &self,
        find: &dyn Fn(&str) -> Result<Dimension, String>,
        path: &str,
        wanted: Dimension,
    ) -> Vec<Problem> {
        let mut problems = Vec::new();
        for (name, value) in &self.constants {
            let place = format!("{path}.constants.{name}");
            if !value.is_finite() {
                problems.push(Problem::new(&place, format!("must be a finite number, got {value}")));
            }
            if find(name).is_ok() {
                let taken = format!("{name:?} is a quantity of the motion: give the constant another name");
                problems.push(Problem::new(&place, taken));
            }
            if !self.syntax.names().iter().any(|(used, _)| used == name) {
                problems.push(Problem::new(&place, format!("{name:?} does not occur in {:?}", self.text)));
            }
        }
        let mut names: Vec<&str> = Vec::new();
        for (name, place) in self.syntax.names() {
            if self.value_of(name).is_some() || names.contains(&name) {
                continue;
            }
            names.push(name);
            if let Err(message) = find(name) {
                let advice =
                    if name.contains('.') { "" } else { "; a number with a name stands in constants" };
                let place = place_in(&self.text, place);
                problems.push(Problem::new(path, format!("{message}{advice} ({place})")));
            }
        }
        if !problems.is_empty() {
            return problems;
        }
        if names.len() > MOST_VARIABLES {
            let count = names.len();
            let message =
                format!("depends on {count} quantities of the motion; at most {MOST_VARIABLES} are accepted");
            problems.push(Problem::new(path, message));
        } else if let Err(message) = self.tape(&names) {
            problems.push(Problem::new(path, message));
        }
        let of_name = |name: &str| if self.value_of(name).is_some() { None } else { find(name).ok() };
        problems.extend(self.wrong_dimension(&of_name, wanted).map(|message| Problem::new(path, message)));
        problems
    }

    fn value_of(&self, name: &str) -> Option<f64> {
        self.constants.iter().find(|(known, _)| known == name).map(|&(_, value)| value)
    }
}

/// Least and largest value of a quantity, by its name.
fn range_of_quantity(name: &str) -> [f64; 2] {
    let (_, last) = name.rsplit_once('.').unwrap_or(("", name));
    let is_size =
        matches!(last, TIME | "length" | "deflection" | "penetration" | "impact_velocity" | "normal_force");
    [if is_size { 0.0 } else { f64::NEG_INFINITY }, f64::INFINITY]
}

/// A place in a text, in words.
fn place_in(text: &str, place: usize) -> String {
    /// Only messages depend on it.
    const SHOWN: usize = 30;
    let start = place.saturating_sub(SHOWN);
    let shown: String = text.chars().skip(start).take(2 * SHOWN).collect();
    let before = if start > 0 { "..." } else { "" };
    let after = if text.chars().count() > start + 2 * SHOWN { "..." } else { "" };
    format!("character {} of \"{before}{shown}{after}\"", place + 1)
}
