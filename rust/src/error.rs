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
