//! Reading JSON field by field: every unknown field, missing field and wrong type is collected with
//! its path. A derived reader would stop at the first error.

use serde_json::{Map, Value};

use crate::error::{Problem, did_you_mean};
use crate::scene::parts::Point;

/// Problems found so far.
pub(crate) type Problems = Vec<Problem>;

/// A JSON value and its path.
pub(crate) struct Node<'a> {
    pub(crate) value: &'a Value,
    pub(crate) path: String,
    /// Where the value has indices in the place of numbers: the numbers.
    numbers: Option<&'a [f64]>,
}

/// An object whose fields are taken one by one; those that remain are unknown.
pub(crate) struct Fields<'a> {
    object: Option<&'a Map<String, Value>>,
    path: String,
    numbers: Option<&'a [f64]>,
    taken: Vec<&'static str>,
    /// Whether the tag that determines the fields was unreadable: no field is then called missing or unknown.
    unknown_kind: bool,
}

impl<'a> Node<'a> {
    /// The outermost value.
    pub(crate) fn root(value: &'a Value, path: &str) -> Self {
        Node { value, path: path.to_owned(), numbers: None }
    }

    /// The same of a value that has the index of each number in its place.
    pub(crate) fn with_numbers(self, numbers: &'a [f64]) -> Self {
        Node { numbers: Some(numbers), ..self }
    }

    fn item(&self, index: usize, value: &'a Value) -> Self {
        Node { value, path: format!("{}[{index}]", self.path), numbers: self.numbers }
    }

    pub(crate) fn fields(&self, problems: &mut Problems) -> Fields<'a> {
        let object = self.value.as_object();
        if object.is_none() {
            problems.push(Problem::new(&self.path, format!("must be an object, got {}", self.value)));
        }
        Fields {
            object,
            path: self.path.clone(),
            numbers: self.numbers,
            taken: Vec::new(),
            unknown_kind: false,
        }
    }

    /// A number. NaN and the infinities arrive as words, since JSON has no numbers for them.
    pub(crate) fn number(&self, problems: &mut Problems) -> f64 {
        if let Some(numbers) = self.numbers {
            let index = self.value.as_u64().and_then(|index| usize::try_from(index).ok());
            return index.and_then(|index| numbers.get(index)).copied().unwrap_or_else(|| {
                let message =
                    format!("must be the index of one of {} numbers, got {}", numbers.len(), self.value);
                problems.push(Problem::new(&self.path, message));
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
                problems.push(Problem::new(&self.path, format!("must be a number, got {}", self.value)));
                f64::NAN
            }
        }
    }

    pub(crate) fn pair(&self, problems: &mut Problems) -> [f64; 2] {
        match self.value.as_array().map(Vec::as_slice) {
            Some([first, second]) => {
                [(0, first), (1, second)].map(|(index, value)| self.item(index, value).number(problems))
            }
            _ => {
                problems.push(Problem::new(
                    &self.path,
                    format!("must be a pair of numbers [x, y], got {}", self.value),
                ));
                [f64::NAN; 2]
            }
        }
    }

    pub(crate) fn truth(&self, problems: &mut Problems) -> bool {
        self.value.as_bool().unwrap_or_else(|| {
            problems.push(Problem::new(&self.path, format!("must be true or false, got {}", self.value)));
            false
        })
    }

    /// A list of texts.
    pub(crate) fn texts(&self, problems: &mut Problems) -> Vec<String> {
        self.items("texts", problems).iter().map(|node| node.text(problems)).collect()
    }

    /// A list of numbers.
    pub(crate) fn numbers(&self, problems: &mut Problems) -> Vec<f64> {
        self.items("numbers", problems).iter().map(|node| node.number(problems)).collect()
    }

    fn items(&self, what: &str, problems: &mut Problems) -> Vec<Node<'a>> {
        let Some(values) = self.value.as_array() else {
            problems.push(Problem::new(&self.path, format!("must be a list of {what}, got {}", self.value)));
            return Vec::new();
        };
        values.iter().enumerate().map(|(index, value)| self.item(index, value)).collect()
    }

    pub(crate) fn text(&self, problems: &mut Problems) -> String {
        match self.value.as_str() {
            Some(text) => text.to_owned(),
            None => {
                problems.push(Problem::new(&self.path, format!("must be a text, got {}", self.value)));
                String::new()
            }
        }
    }
}

impl<'a> Fields<'a> {
    pub(crate) fn path_of(&self, name: &str) -> String {
        if self.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.path) }
    }

    /// The field, unless it is absent or null.
    pub(crate) fn optional(&mut self, name: &'static str) -> Option<Node<'a>> {
        self.taken.push(name);
        let value = self.object?.get(name).filter(|value| !value.is_null())?;
        Some(Node { value, path: self.path_of(name), numbers: self.numbers })
    }

    pub(crate) fn required(&mut self, name: &'static str, problems: &mut Problems) -> Option<Node<'a>> {
        let node = self.optional(name);
        if node.is_none() && self.object.is_some() && !self.unknown_kind {
            problems.push(Problem::new(self.path_of(name), "is missing"));
        }
        node
    }

    pub(crate) fn number(&mut self, name: &'static str, problems: &mut Problems) -> f64 {
        self.required(name, problems).map_or(f64::NAN, |node| node.number(problems))
    }

    pub(crate) fn number_or(&mut self, name: &'static str, default: f64, problems: &mut Problems) -> f64 {
        self.optional(name).map_or(default, |node| node.number(problems))
    }

    pub(crate) fn optional_number(&mut self, name: &'static str, problems: &mut Problems) -> Option<f64> {
        self.optional(name).map(|node| node.number(problems))
    }

    /// A list of numbers.
    pub(crate) fn numbers(&mut self, name: &'static str, problems: &mut Problems) -> Vec<f64> {
        self.required(name, problems).map_or_else(Vec::new, |node| node.numbers(problems))
    }

    /// A whole number, which the caller compares with the range that is accepted.
    pub(crate) fn count_or(
        &mut self,
        name: &'static str,
        default: usize,
        [least, most]: [usize; 2],
        problems: &mut Problems,
    ) -> usize {
        let Some(node) = self.optional(name) else { return default };
        match node.value.as_u64().and_then(|count| usize::try_from(count).ok()) {
            Some(count) => count,
            None => {
                problems.push(Problem::new(
                    &node.path,
                    format!("must be a whole number >= {least} and <= {most}, got {}", node.value),
                ));
                default
            }
        }
    }

    pub(crate) fn pair(&mut self, name: &'static str, problems: &mut Problems) -> [f64; 2] {
        self.required(name, problems).map_or([f64::NAN; 2], |node| node.pair(problems))
    }

    pub(crate) fn text(&mut self, name: &'static str, problems: &mut Problems) -> String {
        self.required(name, problems).map_or_else(String::new, |node| node.text(problems))
    }

    /// One of the given words, or the first one after a problem was noted.
    pub(crate) fn word<T: Copy>(
        &mut self,
        name: &'static str,
        words: &[(&'static str, T)],
        problems: &mut Problems,
    ) -> T {
        if let Some(node) = self.required(name, problems) {
            let text = node.text(problems);
            if let Some(&(_, value)) = words.iter().find(|(word, _)| *word == text) {
                return value;
            }
            if node.value.is_string() {
                let all: Vec<String> = words.iter().map(|(word, _)| format!("{word:?}")).collect();
                let hint = did_you_mean(&text, words.iter().map(|&(word, _)| word));
                problems.push(Problem::new(
                    &node.path,
                    format!("must be one of {}, got {text:?}{hint}", all.join(", ")),
                ));
            }
        }
        words[0].1
    }

    /// The word that determines the kind of an object. After a problem with it the expected fields are not
    /// known, and none is called missing or unknown.
    pub(crate) fn tag<T: Copy>(
        &mut self,
        name: &'static str,
        words: &[(&'static str, T)],
        problems: &mut Problems,
    ) -> T {
        let before = problems.len();
        let value = self.word(name, words, problems);
        self.unknown_kind = problems.len() > before;
        value
    }

    pub(crate) fn list<T>(
        &mut self,
        name: &'static str,
        problems: &mut Problems,
        read: impl Fn(Node<'a>, &mut Problems) -> T,
    ) -> Vec<T> {
        let Some(node) = self.optional(name) else { return Vec::new() };
        let Some(values) = node.value.as_array() else {
            problems.push(Problem::new(&node.path, format!("must be a list, got {}", node.value)));
            return Vec::new();
        };
        values.iter().enumerate().map(|(index, value)| read(node.item(index, value), problems)).collect()
    }

    pub(crate) fn points(&mut self, name: &'static str, problems: &mut Problems) -> Vec<Point> {
        let points = self.named(name, "points {\"name\": [x, y]}", problems);
        points.into_iter().map(|(name, node)| Point { name, position: node.pair(problems) }).collect()
    }

    /// Numbers with names.
    pub(crate) fn named_numbers(
        &mut self,
        name: &'static str,
        problems: &mut Problems,
    ) -> Vec<(String, f64)> {
        let numbers = self.named(name, "numbers {\"name\": number}", problems);
        numbers.into_iter().map(|(name, node)| (name, node.number(problems))).collect()
    }

    /// The values of an object with names of the user; `what` tells its form.
    fn named(&mut self, name: &'static str, what: &str, problems: &mut Problems) -> Vec<(String, Node<'a>)> {
        let Some(node) = self.optional(name) else { return Vec::new() };
        let Some(object) = node.value.as_object() else {
            let message = format!("must be an object of {what}, got {}", node.value);
            problems.push(Problem::new(&node.path, message));
            return Vec::new();
        };
        let path = &node.path;
        let value = |(name, value): (&String, &'a Value)| {
            (name.clone(), Node { value, path: format!("{path}.{name}"), numbers: node.numbers })
        };
        object.iter().map(value).collect()
    }

    /// Adds a problem for every field that was not taken.
    pub(crate) fn finish(self, problems: &mut Problems) {
        let Some(object) = self.object.filter(|_| !self.unknown_kind) else { return };
        for name in object.keys() {
            if !self.taken.contains(&name.as_str()) {
                let hint = did_you_mean(name, self.taken.iter().copied());
                problems.push(Problem::new(self.path_of(name), format!("unknown field{hint}")));
            }
        }
    }
}
