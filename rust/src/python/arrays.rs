//! Arrays between NumPy and the core; too little memory is a `MemoryError`.

use std::borrow::Cow;

use numpy::{IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;

use crate::run::settings::Settings;

/// Memory that must remain besides the samples [numbers]. A run with its thread and report needs far less,
/// but running out of memory there would end the process. With a quarter of it one of 27 studies under a limit
/// of address space did: a thread gets 64 MiB of addresses from glibc at a time. Half and twice change nothing.
const SPARE: usize = 8 << 20;

pub(super) fn memory_error(count: usize) -> PyErr {
    PyMemoryError::new_err(format!("{count} numbers do not fit into the memory"))
}

pub(super) fn require_spare_memory() -> PyResult<()> {
    let mut spare: Vec<f64> = Vec::new();
    spare
        .try_reserve_exact(SPARE)
        .map_err(|_| PyMemoryError::new_err(format!("less than {} MiB of memory are left", SPARE >> 17)))?;
    // Keeps the compiler from removing the unused allocation.
    std::hint::black_box(spare);
    Ok(())
}

/// An uninitialized NumPy array; a `MemoryError` if it does not fit into the memory.
pub(super) fn new_array(py: Python<'_>, count: usize) -> PyResult<Bound<'_, PyArray1<f64>>> {
    let array = py.import("numpy")?.call_method1("empty", (count,))?;
    require_spare_memory()?;
    Ok(array.cast_into()?)
}

/// The instants of the samples of a run that begins at an instant [s].
pub(super) fn sample_times<'py>(
    py: Python<'py>,
    settings: &Settings,
    begin: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let t = new_array(py, settings.samples)?;
    t.readwrite()
        .as_slice_mut()?
        .iter_mut()
        .zip(settings.sample_times(begin))
        .for_each(|(t, time)| *t = time);
    Ok(t)
}

/// An array as flat row-major numbers, and its shape; copied only if it is not so already.
pub(super) fn flat<'a>(array: &'a PyReadonlyArray2<'_, f64>) -> PyResult<(Cow<'a, [f64]>, [usize; 2])> {
    let view = array.as_array();
    let shape = [view.nrows(), view.ncols()];
    // Of a view: the array itself would also return a slice in column-major order.
    if let Some(slice) = view.to_slice() {
        return Ok((Cow::Borrowed(slice), shape));
    }
    let mut copy = Vec::new();
    copy.try_reserve_exact(view.len()).map_err(|_| memory_error(view.len()))?;
    copy.extend(view.iter());
    Ok((Cow::Owned(copy), shape))
}

pub(super) fn matrix<'py>(py: Python<'py>, flat: Vec<f64>, columns: usize) -> PyResult<Bound<'py, PyAny>> {
    let rows = flat.len().checked_div(columns).unwrap_or(0);
    Ok(flat.into_pyarray(py).reshape([rows, columns])?.into_any())
}
