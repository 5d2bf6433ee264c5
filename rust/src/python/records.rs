//! Scenes as Python keeps them, taken apart into their structure and their numbers.

use pyo3::exceptions::PyRecursionError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyFloat, PyString, PyTuple, PyType};

use crate::expression::grammar::parse;

/// Records, pairs and lists within each other; a scene has five of them.
const MOST_DEPTH: usize = 50;

/// Everything of a record that is no number, with a mark where each number stands, and the numbers as bytes. Records
/// with the same shape have the same structure: what is no number is there as it is, and every list comes with its
/// length.
///
/// `part` is the class of all records, dataclasses with positional fields, and `named` are those of named values.
/// Studies do this for every scene: in Python it took a third of the time of building one.
#[pyfunction]
pub(super) fn flatten<'py>(
    record: &Bound<'py, PyAny>,
    part: &Bound<'py, PyType>,
    named: [Bound<'py, PyType>; 2],
) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyBytes>)> {
    let py = record.py();
    let mut walk = Walk {
        part,
        named: &named,
        float: py.get_type::<PyFloat>().into_any(),
        tuple: py.get_type::<PyTuple>().into_any(),
        shape: Vec::with_capacity(128),
        numbers: Vec::with_capacity(1024),
    };
    walk.take(record.clone(), 0)?;
    Ok((PyTuple::new(py, walk.shape)?, PyBytes::new(py, &walk.numbers)))
}

/// The names in an expression of the motion, in their order; `None` for a text that is no such expression.
#[pyfunction]
pub(super) fn expression_names(text: &str) -> Option<Vec<String>> {
    let syntax = parse(text).ok()?;
    Some(syntax.names().into_iter().map(|(name, _)| name.to_owned()).collect())
}

struct Walk<'a, 'py> {
    part: &'a Bound<'py, PyType>,
    named: &'a [Bound<'py, PyType>; 2],
    float: Bound<'py, PyAny>,
    tuple: Bound<'py, PyAny>,
    shape: Vec<Bound<'py, PyAny>>,
    numbers: Vec<u8>,
}

impl<'py> Walk<'_, 'py> {
    fn take(&mut self, value: Bound<'py, PyAny>, depth: usize) -> PyResult<()> {
        if let Ok(number) = value.cast_exact::<PyFloat>() {
            self.numbers.extend_from_slice(&number.value().to_ne_bytes());
            self.shape.push(self.float.clone());
        } else if value.is_none() || value.is_exact_instance_of::<PyString>() {
            self.shape.push(value);
        } else if depth > MOST_DEPTH {
            return Err(PyRecursionError::new_err("the scene is nested too deeply"));
        } else if let Ok(items) = value.cast_exact::<PyTuple>() {
            self.begin(self.tuple.clone(), items.len())?;
            for item in items.iter() {
                self.take(item, depth + 1)?;
            }
        } else if let Some(kind) = self.named.iter().find(|kind| value.get_type().is(*kind)) {
            let named = value.getattr("_items")?.cast_into::<PyDict>()?;
            self.begin(kind.clone().into_any(), named.len())?;
            for (name, item) in named.iter() {
                self.shape.push(name);
                self.take(item, depth + 1)?;
            }
        } else if value.is_instance(self.part)? {
            let kind = value.get_type();
            let names = kind.getattr("__match_args__")?.cast_into::<PyTuple>()?;
            self.shape.push(kind.into_any());
            for name in names.iter() {
                self.take(value.getattr(name.cast_into::<PyString>()?)?, depth + 1)?;
            }
        } else {
            self.shape.push(value);
        }
        Ok(())
    }

    fn begin(&mut self, kind: Bound<'py, PyAny>, count: usize) -> PyResult<()> {
        self.shape.push(kind);
        self.shape.push(count.into_pyobject(self.float.py())?.into_any());
        Ok(())
    }
}
