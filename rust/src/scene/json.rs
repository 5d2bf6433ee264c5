//! Reading JSON field by field: every unknown field, missing field and wrong type is collected with
//! its path. A derived reader would stop at the first error.

use std::cell::RefCell;

use serde_json::{Map, Value};

use crate::error::{InputError, Problem, Subject, did_you_mean, refused};
use crate::scene::parts::Point;

/// Problems found so far, to which all nodes of a text add.
#[derive(Default)]
pub(crate) struct Problems(RefCell<Vec<Problem>>);

impl Problems {
    fn add(&self, path: impl Into<String>, message: impl Into<String>) {
        self.0.borrow_mut().push(Problem::new(path, message));
    }

    fn count(&self) -> usize {
        self.0.borrow().len()
    }
}

/// A JSON value and its path.
#[derive(Clone)]
pub(crate) struct Node<'a> {
    pub(crate) value: &'a Value,
    path: String,
    /// Where the value has indices in the place of numbers: the numbers.
    numbers: Option<&'a [f64]>,
    problems: &'a Problems,
}

/// An object whose fields are taken one by one; those that remain are unknown.
pub(crate) struct Fields<'a> {
    node: Node<'a>,
    object: Option<&'a Map<String, Value>>,
    taken: Vec<&'static str>,
    /// Whether the tag that determines the fields was unreadable: no field is then called missing or unknown.
    unknown_kind: bool,
}

/// A word that determines the kind of an object, and what reads the fields of that kind.
pub(crate) type Kind<'f, 'a, T> = (&'static str, &'f dyn Fn(&mut Fields<'a>) -> T);

/// A number that is accepted: finite, and perhaps within bounds.
#[derive(Clone, Copy)]
pub(crate) struct Accepted<'u> {
    unit: &'u str,
    /// The least one, and whether it is accepted itself.
    least: Option<(f64, bool)>,
    most: f64,
}

pub(crate) fn finite(unit: &str) -> Accepted<'_> {
    Accepted { unit, least: None, most: f64::INFINITY }
}

pub(crate) fn positive(unit: &str) -> Accepted<'_> {
    Accepted { least: Some((0.0, false)), ..finite(unit) }
}

pub(crate) fn at_least(least: f64, unit: &str) -> Accepted<'_> {
    within([least, f64::INFINITY], unit)
}

pub(crate) fn within([least, most]: [f64; 2], unit: &str) -> Accepted<'_> {
    Accepted { unit, least: Some((least, true)), most }
}

/// Above 0 and up to 1.
pub(crate) const FRACTION: Accepted = Accepted { unit: "-", least: Some((0.0, false)), most: 1.0 };

impl Accepted<'_> {
    /// What a number must be, if it is not.
    fn fault(self, value: f64) -> Option<String> {
        let Self { unit, least, most } = self;
        if !value.is_finite() {
            return Some(format!("must be a finite number [{unit}], got {value}"));
        }
        let (least, is_accepted) = least?;
        let (above, is_above) = if is_accepted { (">=", value >= least) } else { (">", value > least) };
        if is_above && value <= most {
            return None;
        }
        let bound = |bound: f64| refused(bound, f64::NAN);
        let below = if most.is_finite() { format!(" and <= {}", bound(most)) } else { String::new() };
        let got = refused(value, if is_above { most } else { least });
        Some(format!("must be {above} {}{below} [{unit}], got {got}", bound(least)))
    }
}

/// The value written in `text`.
///
/// # Errors
/// Text that is no JSON.
pub(crate) fn parse(subject: Subject, name: &str, text: &str) -> Result<Value, InputError> {
    serde_json::from_str(text).map_err(|error| subject.error(name, format!("is not valid JSON: {error}")))
}

/// What `read` makes of an object at `path`, with the problems found, perhaps one that has the index of each of some
/// `numbers` in its place.
pub(crate) fn read_object<T>(
    value: &Value,
    path: &str,
    numbers: Option<&[f64]>,
    read: impl FnOnce(&mut Fields) -> T,
) -> (T, Vec<Problem>) {
    let problems = Problems::default();
    let found = Node { value, path: path.to_owned(), numbers, problems: &problems }.read(read);
    (found, problems.0.into_inner())
}

impl<'a> Node<'a> {
    fn item(&self, index: usize, value: &'a Value) -> Self {
        Node { value, path: format!("{}[{index}]", self.path), ..*self }
    }

    pub(crate) fn problem(&self, message: impl Into<String>) {
        self.problems.add(&self.path, message);
    }

    /// What `read` makes of the fields of an object; those that it does not take are unknown.
    pub(crate) fn read<T>(self, read: impl FnOnce(&mut Fields<'a>) -> T) -> T {
        let object = self.value.as_object();
        if object.is_none() {
            self.problem(format!("must be an object, got {}", self.value));
        }
        let mut fields = Fields { node: self, object, taken: Vec::new(), unknown_kind: false };
        let found = read(&mut fields);
        fields.finish();
        found
    }

    /// A number. NaN and the infinities arrive as words, since JSON has no numbers for them.
    pub(crate) fn number(&self) -> f64 {
        if let Some(numbers) = self.numbers {
            let index = self.value.as_u64().and_then(|index| usize::try_from(index).ok());
            return index.and_then(|index| numbers.get(index)).copied().unwrap_or_else(|| {
                let count = numbers.len();
                self.problem(format!("must be the index of one of {count} numbers, got {}", self.value));
                f64::NAN
            });
        }
        if let Some(number) = self.value.as_f64() {
            return number;
        }
        match self.value.as_str() {
            Some("NaN") => f64::NAN,
            Some("Infinity") => f64::INFINITY,
            Some("-Infinity") => f64::NEG_INFINITY,
            _ => {
                self.problem(format!("must be a number, got {}", self.value));
                f64::NAN
            }
        }
    }

    /// A number that is accepted. One that is not is NaN after a problem was noted, so that no other is said to contradict it.
    pub(crate) fn quantity(&self, accepted: Accepted) -> f64 {
        let before = self.problems.count();
        let value = self.number();
        let fault = accepted.fault(value).filter(|_| self.problems.count() == before);
        fault.map_or(value, |message| {
            self.problem(message);
            f64::NAN
        })
    }

    /// A whole number within a range, or its least one after a problem was noted.
    pub(crate) fn count(&self, [least, most]: [usize; 2]) -> usize {
        let count = self.value.as_u64().and_then(|count| usize::try_from(count).ok());
        count.filter(|count| (least..=most).contains(count)).unwrap_or_else(|| {
            self.problem(format!("must be a whole number >= {least} and <= {most}, got {}", self.value));
            least
        })
    }

    pub(crate) fn pair(&self, unit: &str) -> [f64; 2] {
        match self.value.as_array().map(Vec::as_slice) {
            Some([first, second]) => {
                [(0, first), (1, second)].map(|(index, value)| self.item(index, value).quantity(finite(unit)))
            }
            _ => {
                self.problem(format!("must be a pair of numbers [x, y], got {}", self.value));
                [f64::NAN; 2]
            }
        }
    }

    pub(crate) fn truth(&self) -> bool {
        self.value.as_bool().unwrap_or_else(|| {
            self.problem(format!("must be true or false, got {}", self.value));
            false
        })
    }

    pub(crate) fn texts(&self) -> Vec<String> {
        self.items(" of texts", |node| node.text())
    }

    pub(crate) fn numbers(&self) -> Vec<f64> {
        self.items(" of numbers", |node| node.number())
    }

    pub(crate) fn quantities(&self, accepted: Accepted) -> Vec<f64> {
        self.items(" of numbers", |node| node.quantity(accepted))
    }

    fn items<T>(&self, of_what: &str, read: impl Fn(Node<'a>) -> T) -> Vec<T> {
        let Some(values) = self.value.as_array() else {
            self.problem(format!("must be a list{of_what}, got {}", self.value));
            return Vec::new();
        };
        values.iter().enumerate().map(|(index, value)| read(self.item(index, value))).collect()
    }

    pub(crate) fn text(&self) -> String {
        self.value.as_str().map_or_else(
            || {
                self.problem(format!("must be a text, got {}", self.value));
                String::new()
            },
            str::to_owned,
        )
    }
}

impl<'a> Fields<'a> {
    pub(crate) fn path_of(&self, name: &str) -> String {
        if self.node.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.node.path) }
    }

    /// Adds a problem with a field.
    pub(crate) fn problem(&self, name: &str, message: impl Into<String>) {
        self.node.problems.add(self.path_of(name), message);
    }

    pub(crate) fn add_all(&self, problems: Vec<Problem>) {
        self.node.problems.0.borrow_mut().extend(problems);
    }

    /// What `read` finds; none if it added problems.
    pub(crate) fn sound<T>(&mut self, read: impl FnOnce(&mut Self) -> T) -> Option<T> {
        let before = self.node.problems.count();
        let found = read(self);
        (self.node.problems.count() == before).then_some(found)
    }

    /// The field, unless it is absent or null.
    pub(crate) fn optional(&mut self, name: &'static str) -> Option<Node<'a>> {
        self.taken.push(name);
        let value = self.object?.get(name).filter(|value| !value.is_null())?;
        Some(Node { value, path: self.path_of(name), ..self.node })
    }

    pub(crate) fn required(&mut self, name: &'static str) -> Option<Node<'a>> {
        let node = self.optional(name);
        if node.is_none() && self.object.is_some() && !self.unknown_kind {
            self.problem(name, "is missing");
        }
        node
    }

    pub(crate) fn quantity(&mut self, name: &'static str, accepted: Accepted) -> f64 {
        self.required(name).map_or(f64::NAN, |node| node.quantity(accepted))
    }

    pub(crate) fn quantity_or(&mut self, name: &'static str, accepted: Accepted, default: f64) -> f64 {
        self.optional_quantity(name, accepted).unwrap_or(default)
    }

    pub(crate) fn optional_quantity(&mut self, name: &'static str, accepted: Accepted) -> Option<f64> {
        self.optional(name).map(|node| node.quantity(accepted))
    }

    pub(crate) fn numbers(&mut self, name: &'static str) -> Vec<f64> {
        self.required(name).map_or_else(Vec::new, |node| node.numbers())
    }

    pub(crate) fn count_or(&mut self, name: &'static str, default: usize, range: [usize; 2]) -> usize {
        self.optional(name).map_or(default, |node| node.count(range))
    }

    pub(crate) fn pair(&mut self, name: &'static str, unit: &str) -> [f64; 2] {
        self.required(name).map_or([f64::NAN; 2], |node| node.pair(unit))
    }

    /// A vector that is not zero.
    pub(crate) fn direction(&mut self, name: &'static str) -> [f64; 2] {
        let direction = self.pair(name, "-");
        if direction == [0.0; 2] {
            self.problem(name, "must not be the zero vector");
        }
        direction
    }

    pub(crate) fn text(&mut self, name: &'static str) -> String {
        self.required(name).map_or_else(String::new, |node| node.text())
    }

    pub(crate) fn text_or(&mut self, name: &'static str, default: &str) -> String {
        self.optional(name).map_or_else(|| default.to_owned(), |node| node.text())
    }

    /// One of the given words, or the first one after a problem was noted.
    pub(crate) fn word<T: Copy>(&mut self, name: &'static str, words: &[(&'static str, T)]) -> T {
        if let Some(node) = self.required(name) {
            let text = node.text();
            if let Some(&(_, value)) = words.iter().find(|(word, _)| *word == text) {
                return value;
            }
            if node.value.is_string() {
                let all: Vec<String> = words.iter().map(|(word, _)| format!("{word:?}")).collect();
                let hint = did_you_mean(&text, words.iter().map(|&(word, _)| word));
                node.problem(format!("must be one of {}, got {text:?}{hint}", all.join(", ")));
            }
        }
        words[0].1
    }

    /// The word that determines the kind of an object. After a problem with it the expected fields are not
    /// known, and none is called missing or unknown.
    pub(crate) fn tag<T: Copy>(&mut self, name: &'static str, words: &[(&'static str, T)]) -> T {
        let before = self.node.problems.count();
        let value = self.word(name, words);
        self.unknown_kind = self.node.problems.count() > before;
        value
    }

    /// An object of one of several kinds.
    pub(crate) fn one_of<T>(&mut self, name: &'static str, kinds: &[Kind<'_, 'a, T>]) -> T {
        self.tag(name, kinds)(self)
    }

    pub(crate) fn list<T>(&mut self, name: &'static str, read: impl Fn(Node<'a>) -> T) -> Vec<T> {
        self.optional(name).map_or_else(Vec::new, |node| node.items("", read))
    }

    pub(crate) fn objects<T>(&mut self, name: &'static str, read: impl Fn(&mut Fields<'a>) -> T) -> Vec<T> {
        self.list(name, |node| node.read(&read))
    }

    pub(crate) fn points(&mut self, name: &'static str) -> Vec<Point> {
        let points = self.named(name, "points {\"name\": [x, y]}");
        points.into_iter().map(|(name, node)| Point { name, position: node.pair("m") }).collect()
    }

    pub(crate) fn named_numbers(&mut self, name: &'static str) -> Vec<(String, f64)> {
        let numbers = self.named(name, "numbers {\"name\": number}");
        numbers.into_iter().map(|(name, node)| (name, node.number())).collect()
    }

    /// The values of an object with names of the user; `what` tells its form.
    fn named(&mut self, name: &'static str, what: &str) -> Vec<(String, Node<'a>)> {
        let Some(node) = self.optional(name) else { return Vec::new() };
        let Some(object) = node.value.as_object() else {
            node.problem(format!("must be an object of {what}, got {}", node.value));
            return Vec::new();
        };
        let value = |(name, value): (&String, &'a Value)| {
            (name.clone(), Node { value, path: format!("{}.{name}", node.path), ..node })
        };
        object.iter().map(value).collect()
    }

    /// Adds a problem for every field that was not taken.
    fn finish(self) {
        let Some(object) = self.object.filter(|_| !self.unknown_kind) else { return };
        for name in object.keys().filter(|name| !self.taken.contains(&name.as_str())) {
            let hint = did_you_mean(name, self.taken.iter().copied());
            self.problem(name, format!("unknown field{hint}"));
        }
    }
}
