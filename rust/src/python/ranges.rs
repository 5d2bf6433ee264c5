//! Certified ranges of polynomials over the box.

use std::sync::atomic::{AtomicBool, Ordering};

use numpy::{IntoPyArray, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::{flat, matrix};
use super::{cancelled, grid_error, wait_for};
use crate::study::band::sparse_range;
use crate::study::chebyshev::{GridError, Polynomials};
use crate::study::range::{self, Ranges};
use crate::study::sweep::Monitor;

/// Certified ranges of polynomials, attained extreme values, and their points.
#[pyfunction]
#[pyo3(signature = (coefficients, degrees, threads=None))]
pub fn polynomial_ranges<'py>(
    py: Python<'py>,
    coefficients: PyReadonlyArray2<'py, f64>,
    degrees: Vec<usize>,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let (coefficients, [_, columns]) = flat(&coefficients)?;
    let polynomials = Polynomials::new(&coefficients, columns, &degrees).map_err(grid_error)?;
    let ranges = interruptible(py, |monitor| range::watched_ranges(&polynomials, threads, monitor))?;
    as_dict(py, ranges, degrees.len())
}

/// The same for polynomials of total degree, with coefficients in the order of `total_degree_exponents`.
#[pyfunction]
pub fn total_degree_ranges<'py>(
    py: Python<'py>,
    coefficients: PyReadonlyArray2<'py, f64>,
    parameters: usize,
    degree: usize,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let (coefficients, [_, columns]) = flat(&coefficients)?;
    let ranges = interruptible(py, |monitor| {
        sparse_range::total_degree_ranges(&coefficients, columns, parameters, degree, threads, monitor)
    })?;
    as_dict(py, ranges, parameters)
}

/// The result of `work`, unless a signal stops it.
pub fn interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(Monitor) -> Result<Option<T>, GridError> + Send,
) -> PyResult<T> {
    let cancel = AtomicBool::new(false);
    let monitor = || !cancel.load(Ordering::Relaxed);
    wait_for(py, &cancel, || work(&monitor), |_| Ok(()))?.map_err(grid_error)?.ok_or_else(cancelled)
}

fn as_dict<'py>(py: Python<'py>, ranges: Ranges, parameters: usize) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("lower", ranges.lower.into_pyarray(py))?;
    result.set_item("upper", ranges.upper.into_pyarray(py))?;
    result.set_item("attained_lower", ranges.attained_lower.into_pyarray(py))?;
    result.set_item("attained_upper", ranges.attained_upper.into_pyarray(py))?;
    result.set_item("lowest_at", matrix(py, ranges.lowest_at, parameters)?)?;
    result.set_item("highest_at", matrix(py, ranges.highest_at, parameters)?)?;
    Ok(result)
}
