//! Errors of an input, all problems at once, each with its path; and notices of what should be checked but stops
//! nothing. Uses no other room.

use std::fmt;

use strsim::levenshtein;

/// One problem of an input.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Path of the field, such as `joints[2].clearance`.
    pub path: String,
    /// What is wrong and what would be accepted.
    pub message: String,
}

impl Problem {
    /// A problem at `path`.
    pub fn new(path: impl Into<String>, message: impl Into<String>) -> Self {
        Self { path: path.into(), message: message.into() }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.path, self.message)
    }
}

/// Something that should be checked but did not stop the computation.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// What it is: programs tell notices apart by it. `chebclear/notices.py` lists all codes.
    pub code: &'static str,
    /// The contact joint or the fields of the scene that it is about.
    pub about: Vec<String>,
    /// Its numbers by name, in SI units.
    pub numbers: Vec<(&'static str, f64)>,
    /// The same in words.
    pub text: String,
}

impl Notice {
    /// A notice of a contact joint.
    pub(crate) fn of_joint(
        code: &'static str,
        joint: &str,
        numbers: Vec<(&'static str, f64)>,
        what: impl fmt::Display,
    ) -> Self {
        Self { code, about: vec![joint.to_owned()], numbers, text: format!("joint {joint:?}: {what}") }
    }

    /// A notice of fields of the scene, by their paths.
    pub(crate) fn of_fields(
        code: &'static str,
        paths: Vec<String>,
        numbers: Vec<(&'static str, f64)>,
        what: impl fmt::Display,
    ) -> Self {
        Self { code, text: format!("{}: {what}", paths.join(", ")), about: paths, numbers }
    }

    /// A notice of one field.
    pub(crate) fn of_field(
        code: &'static str,
        path: impl Into<String>,
        numbers: Vec<(&'static str, f64)>,
        what: impl fmt::Display,
    ) -> Self {
        Self::of_fields(code, vec![path.into()], numbers, what)
    }
}

/// The input that has a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// The scene.
    Scene,
    /// The settings of a run, such as an output that the scene does not have.
    Settings,
    /// The end of an earlier run from which to continue.
    Start,
}

impl Subject {
    /// An error with a single problem.
    pub fn error(self, path: impl Into<String>, message: impl Into<String>) -> InputError {
        InputError { subject: self, problems: vec![Problem::new(path, message)] }
    }

    /// `good` unless there are problems.
    ///
    /// # Errors
    /// All of them.
    pub fn judge<T>(self, good: T, problems: Vec<Problem>) -> Result<T, InputError> {
        if problems.is_empty() { Ok(good) } else { Err(InputError { subject: self, problems }) }
    }
}

/// An input that cannot be simulated, with every problem found in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputError {
    /// What is wrong.
    pub subject: Subject,
    /// All problems, in the order of the input; never empty.
    pub problems: Vec<Problem>,
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            write!(f, "{problem}")?;
        }
        Ok(())
    }
}

impl std::error::Error for InputError {}

/// `"; did you mean ...?"` with the known name nearest to a wrong one, or nothing.
pub fn did_you_mean<'a>(wrong: &str, known: impl Iterator<Item = &'a str>) -> String {
    // The time grows with the product of the lengths, and nobody mistypes what is longer than a line.
    const LONGEST: usize = 100;
    if wrong.len() > LONGEST {
        return String::new();
    }
    // Upper and lower case count least: "c" is closer to "C" than to "B".
    let by_case = |name: &str| levenshtein(&wrong.to_lowercase(), &name.to_lowercase());
    let nearest = known
        .filter(|name| name.len() <= LONGEST)
        .map(|name| (by_case(name), levenshtein(wrong, name), name))
        .min();
    match nearest {
        // With up to half of the letters wrong a name is still recognizable.
        Some((distance, _, name)) if 2 * distance <= name.chars().count().max(wrong.chars().count()) => {
            format!("; did you mean {name:?}?")
        }
        _ => String::new(),
    }
}

/// A refused number for a message: without the rounding of its last digits, unless only these cross the limit.
pub fn refused(value: f64, limit: f64) -> String {
    let rounded: f64 = format!("{value:.11e}").parse().unwrap_or(value);
    let shown = if rounded == limit { value } else { rounded };
    let plain = shown == 0.0 || !shown.is_finite() || (1e-4..1e16).contains(&shown.abs());
    if plain { format!("{shown}") } else { format!("{shown:e}") }
}

/// What [`did_you_mean`] says, or the known names if none is near.
pub fn meant_or_known<'a>(wrong: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    const MOST: usize = 12;
    let hint = did_you_mean(wrong, known.clone());
    if !hint.is_empty() {
        return hint;
    }
    let names: Vec<&str> = known.collect();
    match names.len() {
        0 => "; there is none".to_owned(),
        count if count > MOST => {
            format!("; known are {} and {} more", names[..MOST].join(", "), count - MOST)
        }
        _ => format!("; known are {}", names.join(", ")),
    }
}
