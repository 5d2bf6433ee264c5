//! The Python module `chebclear._core`: converts arguments, releases the interpreter, calls the core,
//! converts results. In: text and arrays of Python; out: dicts and arrays. Uses all rooms, and no room uses
//! it.
//!
//! Nothing here computes. Exceptions are those of
//! `chebclear.errors`, so that they can be pickled.

mod arrays;
mod bands;
mod mechanism;
mod ranges;
mod records;

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, mpsc};
use std::time::Duration;

use numpy::{IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::{PyMemoryError, PyRuntimeError, PyValueError};
use pyo3::ffi::PyObject;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyString};

use self::arrays::{flat, matrix, new_array, require_spare_memory, sample_times};
use self::mechanism::notices;
use crate::error::{InputError, Subject};
use crate::integrators::Status;
use crate::run::settings::{METHOD_WORDS, RTOL_RANGE, SAMPLES_RANGE, read_settings};
use crate::run::trajectory::Trajectory;
use crate::scene::reader::Structure;
use crate::study::chebyshev::{MOST_NODES, Polynomials};
use crate::study::sweep::{FlatScene, Sweep};
use crate::study::{bounds, chebyshev};

/// Interval at which the waiting thread checks for signals and reports progress.
const WAKE: Duration = Duration::from_millis(50);

fn input_error(py: Python<'_>, error: InputError) -> PyErr {
    let class = match error.subject {
        Subject::Scene => "SceneError",
        Subject::Settings => "SettingsError",
        Subject::Start => "StartError",
    };
    let problems: Vec<(String, String)> =
        error.problems.into_iter().map(|problem| (problem.path, problem.message)).collect();
    let raised = py
        .import("chebclear.errors")
        .and_then(|errors| errors.getattr(class))
        .and_then(|class| class.call1((problems,)));
    match raised {
        Ok(instance) => PyErr::from_value(instance),
        Err(failure) => failure,
    }
}

fn grid_error(error: chebyshev::GridError) -> PyErr {
    if error.out_of_memory {
        PyMemoryError::new_err(error.message)
    } else {
        PyValueError::new_err(error.message)
    }
}

/// Runs `work` on a new thread while this one, without the interpreter, wakes at intervals to
/// call `report` and check for signals. On a signal or an exception of `report` it sets `cancel`,
/// waits for the work to end, and raises.
fn wait_for<T: Send>(
    py: Python<'_>,
    cancel: &AtomicBool,
    work: impl FnOnce() -> T + Send,
    report: impl Fn(Python<'_>) -> PyResult<()>,
) -> PyResult<T> {
    let finished = Mutex::new(false);
    let bell = Condvar::new();
    std::thread::scope(|scope| {
        let worker = std::thread::Builder::new()
            .spawn_scoped(scope, || {
                // Dropped when the work ends or panics.
                let _ring = Ring { finished: &finished, bell: &bell };
                work()
            })
            .map_err(|error| PyMemoryError::new_err(format!("no thread can be started: {error}")))?;
        let mut raised = None;
        loop {
            let done = py.detach(|| {
                let guard = finished.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
                let (guard, _) = bell
                    .wait_timeout_while(guard, WAKE, |done| !*done)
                    .unwrap_or_else(|poisoned| poisoned.into_inner());
                *guard
            });
            if raised.is_none()
                && let Err(error) = py.check_signals().and_then(|()| report(py))
            {
                cancel.store(true, Ordering::Relaxed);
                raised = Some(error);
            }
            if done {
                break;
            }
        }
        let result = worker.join();
        match (raised, result) {
            (Some(error), _) => Err(error),
            (None, Ok(value)) => Ok(value),
            (None, Err(_)) => Err(PyRuntimeError::new_err("internal error in the numerical core")),
        }
    })
}

/// Runs `work` on a new thread; a signal raises at once, and the work, which knows no cancel, ends on its own.
fn abandoned_on_signal<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (sender, receiver) = mpsc::channel();
    std::thread::Builder::new()
        .spawn(move || {
            // Nobody may be left to hear of it.
            let _ = sender.send(work());
        })
        .map_err(|error| PyMemoryError::new_err(format!("no thread can be started: {error}")))?;
    // The receiver is moved in and out: it may not be shared with the threads that could run meanwhile.
    let mut receiver = receiver;
    loop {
        let (back, found) = py.detach(move || {
            let found = receiver.recv_timeout(WAKE);
            (receiver, found)
        });
        receiver = back;
        match found {
            Ok(value) => return Ok(value),
            Err(mpsc::RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(mpsc::RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("internal error in the numerical core"));
            }
        }
    }
}

/// Never seen by users: where work was cancelled, a signal or the report has already raised.
fn cancelled() -> PyErr {
    PyRuntimeError::new_err("the runs were cancelled")
}

struct Ring<'a> {
    finished: &'a Mutex<bool>,
    bell: &'a Condvar,
}

impl Drop for Ring<'_> {
    fn drop(&mut self) {
        *self.finished.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = true;
        self.bell.notify_all();
    }
}

/// What a run cost, by name.
fn stats(run: &Trajectory) -> impl IntoIterator<Item = (&'static str, f64)> {
    let counts = run.stats.counts().into_iter().chain([("impacts_at_floor", run.impacts_at_floor)]);
    let sizes = run.stats.sizes().into_iter().chain([("largest_projection", run.largest_projection)]);
    counts.map(|(name, count)| (name, count as f64)).chain(sizes)
}

/// Structure (JSON with the index of each number in its place), bytes of the numbers, and signs of the branch, of a
/// scene.
type SceneParts<'py> = (Bound<'py, PyString>, Bound<'py, PyBytes>, Vec<i8>);

/// Simulates many scenes in parallel with the same settings (JSON). The samples are written to a flat array if one is
/// given. A run is cancelled after `run_seconds` [s].
#[pyfunction]
#[pyo3(signature = (scenes, settings, threads=None, progress=None, into=None, run_seconds=None))]
fn sweep<'py>(
    py: Python<'py>,
    scenes: Vec<SceneParts<'py>>,
    settings: &str,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
    into: Option<Bound<'py, PyArray1<f64>>>,
    run_seconds: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let settings = read_settings(settings).map_err(|error| input_error(py, error))?;
    let limit = match run_seconds.map(Duration::try_from_secs_f64).transpose() {
        Ok(limit) => limit,
        Err(error) => return Err(PyValueError::new_err(format!("run_seconds: {error}"))),
    };
    if threads == Some(0) {
        return Err(PyValueError::new_err("threads must be >= 1, got 0"));
    }
    let cancel = AtomicBool::new(false);
    let finished = AtomicUsize::new(0);
    let monitor = || !cancel.load(Ordering::Relaxed);
    let scenes = flat_scenes(&scenes).map_err(|error| input_error(py, error))?;
    let total = scenes.len();
    let tell = |py: Python<'_>, count: usize| match &progress {
        Some(callback) => callback.call1(py, (count, total)).map(|_| ()),
        None => Ok(()),
    };
    require_spare_memory()?;
    let prepare = || Sweep::prepare(&scenes, &settings, threads, &monitor);
    let sweep = wait_for(py, &cancel, prepare, |py| tell(py, 0))?.map_err(|error| input_error(py, error))?;
    let sweep = sweep.ok_or_else(cancelled)?;
    let shape = [total, settings.samples, sweep.columns.len()];
    let count = shape.iter().fold(1, |product: usize, &n| product.saturating_mul(n));
    let values = match into {
        Some(place) => place,
        None => new_array(py, count)?,
    };
    let mut memory = values.try_readwrite()?;
    let samples = memory.as_slice_mut()?;
    let report = |py: Python<'_>| tell(py, finished.load(Ordering::Relaxed));
    let runs = wait_for(py, &cancel, || sweep.run(samples, &finished, limit, &monitor), report)?
        .map_err(|error| input_error(py, error))?
        .ok_or_else(cancelled)?;
    drop(memory);
    tell(py, total)?;
    let result = PyDict::new(py);
    tell_ends(&result, &runs)?;
    let features: Vec<f64> = runs.iter().flat_map(|run| run.features.iter().copied()).collect();
    let features_shape = [runs.len(), settings.cycles, settings.features.len()];
    result.set_item("features", features.into_pyarray(py).reshape(features_shape)?)?;
    result.set_item("t", sample_times(py, &settings, 0.0)?)?;
    result.set_item("values", values.reshape(shape)?)?;
    result.set_item("columns", &sweep.columns)?;
    Ok(result)
}

/// Scenes with their numbers; a structure that some share, as the same object, is parsed once.
fn flat_scenes(scenes: &[SceneParts<'_>]) -> Result<Vec<FlatScene>, InputError> {
    let mut structures: HashMap<*mut PyObject, Arc<Structure>> = HashMap::new();
    let flat = |(text, bytes, branch): &SceneParts<'_>| {
        let structure = match structures.entry(text.as_ptr()) {
            Entry::Occupied(known) => known.get().clone(),
            Entry::Vacant(place) => place.insert(Arc::new(Structure::read(&text.to_string_lossy())?)).clone(),
        };
        let (numbers, _) = bytes.as_bytes().as_chunks();
        Ok(FlatScene {
            structure,
            numbers: numbers.iter().map(|bytes| f64::from_ne_bytes(*bytes)).collect(),
            branch: branch.clone(),
        })
    };
    scenes.iter().map(flat).collect()
}

/// Work of each run of a sweep; status and notices, by its row, of those that are not done or have some.
fn tell_ends(result: &Bound<'_, PyDict>, runs: &[Trajectory]) -> PyResult<()> {
    let py = result.py();
    let mut counts: Vec<(&str, Vec<f64>)> = Vec::new();
    let (ends, told) = (PyDict::new(py), PyDict::new(py));
    for (row, run) in runs.iter().enumerate() {
        for (index, (name, count)) in stats(run).into_iter().enumerate() {
            if row == 0 {
                counts.push((name, Vec::with_capacity(runs.len())));
            }
            counts[index].1.push(count);
        }
        if run.status != Status::Done {
            ends.set_item(row, (run.status.word(), run.message(), run.time, &run.joint))?;
        }
        if !run.warnings.is_empty() {
            told.set_item(row, notices(&run.warnings))?;
        }
    }
    let stats = PyDict::new(py);
    for (name, column) in counts {
        stats.set_item(name, column.into_pyarray(py))?;
    }
    result.set_item("stats", stats)?;
    result.set_item("ends", ends)?;
    result.set_item("notices", told)
}

/// Raises the problems of settings (JSON) that do not depend on a scene.
#[pyfunction]
fn check_settings(py: Python<'_>, settings: &str) -> PyResult<()> {
    read_settings(settings).map(|_| ()).map_err(|error| input_error(py, error))
}

/// Chebyshev roots, Eq. (26), from +1 to -1.
#[pyfunction]
fn chebyshev_nodes(py: Python<'_>, count: usize) -> PyResult<Bound<'_, PyArray1<f64>>> {
    if !(1..=MOST_NODES).contains(&count) {
        return Err(PyValueError::new_err(format!("count must be >= 1 and <= {MOST_NODES}, got {count}")));
    }
    Ok(chebyshev::root_nodes(count).into_pyarray(py))
}

/// Values on a tensor grid of roots to coefficients.
#[pyfunction]
fn chebyshev_fit<'py>(
    py: Python<'py>,
    values: PyReadonlyArray2<'py, f64>,
    nodes: Vec<usize>,
    degrees: Vec<usize>,
) -> PyResult<Bound<'py, PyAny>> {
    let (values, [_, columns]) = flat(&values)?;
    let coefficients =
        py.detach(|| chebyshev::fit(&values, columns, &nodes, &degrees)).map_err(grid_error)?;
    matrix(py, coefficients, columns)
}

/// The polynomials at points of [-1, 1]^k.
#[pyfunction]
fn chebyshev_evaluate<'py>(
    py: Python<'py>,
    coefficients: PyReadonlyArray2<'py, f64>,
    degrees: Vec<usize>,
    points: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let (coefficients, [_, columns]) = flat(&coefficients)?;
    let (points, _) = flat(&points)?;
    let polynomials = Polynomials::new(&coefficients, columns, &degrees).map_err(grid_error)?;
    let values = py.detach(|| chebyshev::evaluate(&polynomials, &points)).map_err(grid_error)?;
    matrix(py, values, columns)
}

/// Coefficients of the derivative with respect to the normalized variable of an axis.
#[pyfunction]
fn chebyshev_derivative<'py>(
    py: Python<'py>,
    coefficients: PyReadonlyArray2<'py, f64>,
    degrees: Vec<usize>,
    axis: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let (coefficients, [_, columns]) = flat(&coefficients)?;
    let polynomials = Polynomials::new(&coefficients, columns, &degrees).map_err(grid_error)?;
    let derivative = py.detach(|| chebyshev::derivative(&polynomials, axis)).map_err(grid_error)?;
    matrix(py, derivative, columns)
}

/// Bounds of the polynomials by Eq. (31).
#[pyfunction]
#[allow(clippy::type_complexity)]
fn interval_bounds<'py>(
    py: Python<'py>,
    coefficients: PyReadonlyArray2<'py, f64>,
    degrees: Vec<usize>,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
    let (coefficients, [_, columns]) = flat(&coefficients)?;
    let polynomials = Polynomials::new(&coefficients, columns, &degrees).map_err(grid_error)?;
    let (lower, upper) = py.detach(|| bounds::interval_bounds(&polynomials)).map_err(grid_error)?;
    Ok((lower.into_pyarray(py), upper.into_pyarray(py)))
}

/// Numerical core of chebclear; use the package, not this module.
#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    // The first array makes the binding import NumPy's interface, and it panics if that is interrupted: not in a run.
    numpy::PyArray1::<f64>::zeros(module.py(), 0, false);
    module.add_class::<mechanism::CompiledMechanism>()?;
    module.add_function(wrap_pyfunction!(records::flatten, module)?)?;
    module.add_function(wrap_pyfunction!(records::expression_names, module)?)?;
    module.add_function(wrap_pyfunction!(sweep, module)?)?;
    module.add_function(wrap_pyfunction!(check_settings, module)?)?;
    module.add("METHODS", METHOD_WORDS.map(|(word, _)| word))?;
    module.add("RTOL_RANGE", (RTOL_RANGE[0], RTOL_RANGE[1]))?;
    module.add("MOST_SAMPLES", SAMPLES_RANGE[1])?;
    module.add_function(wrap_pyfunction!(chebyshev_nodes, module)?)?;
    module.add_function(wrap_pyfunction!(chebyshev_fit, module)?)?;
    module.add_function(wrap_pyfunction!(chebyshev_evaluate, module)?)?;
    module.add_function(wrap_pyfunction!(chebyshev_derivative, module)?)?;
    module.add_function(wrap_pyfunction!(interval_bounds, module)?)?;
    module.add_function(wrap_pyfunction!(ranges::polynomial_ranges, module)?)?;
    module.add_function(wrap_pyfunction!(ranges::total_degree_ranges, module)?)?;
    module.add_function(wrap_pyfunction!(bands::sobol_points, module)?)?;
    module.add_function(wrap_pyfunction!(bands::random_points, module)?)?;
    module.add_function(wrap_pyfunction!(bands::total_degree_exponents, module)?)?;
    module.add_function(wrap_pyfunction!(bands::total_degree_basis, module)?)?;
    module.add_function(wrap_pyfunction!(bands::band_terms, module)?)?;
    module.add_class::<bands::Design>()?;
    Ok(())
}
