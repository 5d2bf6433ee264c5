//! Errors: what is wrong with a scene (all problems at once, each with its path).

use std::fmt;

/// One thing that is wrong with a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Where: the path of the field in the scene, such as `joints[2].clearance`.
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

/// A scene that cannot be simulated, with every problem found in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// All problems, in the order of the scene; never empty.
    pub problems: Vec<Problem>,
}

impl SceneError {
    /// A scene error with a single problem.
    pub fn single(path: impl Into<String>, message: impl Into<String>) -> Self {
        Self { problems: vec![Problem::new(path, message)] }
    }
}

impl fmt::Display for SceneError {
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

impl std::error::Error for SceneError {}

/// `"; did you mean ...?"` with the known name nearest to a wrong one, or nothing.
pub fn did_you_mean<'a>(wrong: &str, known: impl Iterator<Item = &'a str>) -> String {
    // A wrong case is the smallest of mistakes: "c" means "C" rather than "B".
    let by_case = |name: &str| edit_distance(&wrong.to_lowercase(), &name.to_lowercase());
    let nearest = known.map(|name| (by_case(name), edit_distance(wrong, name), name)).min();
    match nearest {
        // Up to half of the letters wrong is still recognisable; more is a different word.
        Some((distance, _, name)) if 2 * distance <= name.chars().count().max(wrong.chars().count()) => {
            format!("; did you mean {name:?}?")
        }
        _ => String::new(),
    }
}

/// Levenshtein distance: letters to insert, delete or replace.
fn edit_distance(first: &str, second: &str) -> usize {
    let second: Vec<char> = second.chars().collect();
    let mut row: Vec<usize> = (0..=second.len()).collect();
    for (i, a) in first.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, b) in second.iter().enumerate() {
            let replaced = diagonal + usize::from(a != *b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[second.len()]
}
