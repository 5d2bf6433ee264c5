//! Points of studies, and bands from their runs.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::{flat, matrix};
use super::ranges::interruptible;
use crate::study::band::{self, Method, OutputBand, regression};
use crate::study::points::{self, MOST_PARAMETERS, MOST_POINTS};
use crate::study::sweep::Monitor;

/// Points of a scrambled Sobol' sequence in [-1, 1]^parameters; without a seed it is not scrambled.
#[pyfunction]
pub fn sobol_points<'py>(
    py: Python<'py>,
    parameters: usize,
    first: u64,
    count: usize,
    seed: Option<u64>,
) -> PyResult<Bound<'py, PyAny>> {
    if !(1..=MOST_PARAMETERS).contains(&parameters) {
        return Err(PyValueError::new_err(format!(
            "parameters must be >= 1 and <= {MOST_PARAMETERS} for Sobol' points, got {parameters}"
        )));
    }
    if first.checked_add(count as u64).is_none_or(|end| end > MOST_POINTS) {
        return Err(PyValueError::new_err(format!("a sequence has at most {MOST_POINTS} points")));
    }
    matrix(py, points::sobol_points(parameters, first, count, seed), parameters)
}

/// Independent uniform points of [-1, 1]^parameters.
#[pyfunction]
pub fn random_points<'py>(
    py: Python<'py>,
    parameters: usize,
    first: u64,
    count: usize,
    seed: u64,
) -> PyResult<Bound<'py, PyAny>> {
    matrix(py, points::random_points(parameters, first, count, seed), parameters)
}

/// Exponents of the terms of a polynomial of total degree, terms x parameters.
#[pyfunction]
pub fn total_degree_exponents(parameters: usize, degree: usize) -> Vec<Vec<usize>> {
    let all = regression::exponents(parameters, degree);
    all.chunks(parameters.max(1)).map(<[usize]>::to_vec).collect()
}

/// Values of the terms of a polynomial of total degree at points of [-1, 1]^parameters, points x terms.
#[pyfunction]
pub fn total_degree_basis<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    degree: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let (points, [_, parameters]) = flat(&points)?;
    matrix(py, regression::basis(&points, parameters, degree), regression::term_count(parameters, degree))
}

/// Terms of the largest polynomial that bands of so many runs try.
#[pyfunction]
pub fn band_terms(runs: usize, parameters: usize) -> usize {
    band::tried_terms(runs, parameters)
}

/// Points of runs, prepared for the bands of one output after the other; with revolutions
/// each run has that many rows. Where the runs leave out a part of the box no polynomial is extrapolated into it.
#[pyclass(frozen, module = "chebclear._core")]
pub struct Design(band::Design);

#[pymethods]
impl Design {
    #[new]
    #[pyo3(signature = (points, scored, coverage, independent=false, revolutions=None, filled=true))]
    fn new(
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        scored: usize,
        coverage: f64,
        independent: bool,
        revolutions: Option<usize>,
        filled: bool,
    ) -> PyResult<Self> {
        let (points, [_, parameters]) = flat(&points)?;
        let method = match (independent, filled) {
            (_, false) => Method::OfRuns,
            (true, true) => Method::Independent,
            (false, true) => Method::Calibrated,
        };
        let design = interruptible(py, |monitor| {
            band::Design::new(&points, parameters, revolutions, scored, coverage, method, monitor)
        })?;
        Ok(Self(design))
    }

    /// The band of one output, from its values rows x samples.
    #[pyo3(signature = (values, limits, threads=None))]
    fn band<'py>(
        &self,
        py: Python<'py>,
        values: PyReadonlyArray2<'py, f64>,
        limits: [f64; 2],
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (values, [_, samples]) = flat(&values)?;
        let work = |monitor: Monitor| self.0.band(&values, samples, limits, threads, monitor);
        as_dict(py, interruptible(py, work)?, samples)
    }
}

fn as_dict<'py>(py: Python<'py>, band: OutputBand, samples: usize) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    let array = |values: Vec<f64>| -> Bound<'py, PyArray1<f64>> { values.into_pyarray(py) };
    result.set_item("lower", array(band.lower))?;
    result.set_item("upper", array(band.upper))?;
    result.set_item("window", band.window)?;
    result.set_item("inflation", band.inflation)?;
    result.set_item("coverage", band.held_out.coverage)?;
    result.set_item("whole_run", band.held_out.whole_run)?;
    result.set_item("persistence", band.persistence)?;
    let (degree, error, coefficients) = match band.polynomial {
        Some(polynomial) => (
            Some(polynomial.degree),
            Some(polynomial.error),
            Some(matrix(py, polynomial.coefficients, samples)?),
        ),
        None => (None, None, None),
    };
    result.set_item("degree", degree)?;
    result.set_item("error", error)?;
    result.set_item("coefficients", coefficients)?;
    Ok(result)
}
