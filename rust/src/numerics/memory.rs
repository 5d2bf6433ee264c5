//! Large arrays: memory that is not there is an error, not the end of the process.

use std::collections::TryReserveError;

/// So many numbers, all the same.
///
/// # Errors
/// If there is no memory for them.
pub fn filled(count: usize, value: f64) -> Result<Vec<f64>, TryReserveError> {
    let mut numbers = Vec::new();
    numbers.try_reserve_exact(count)?;
    numbers.resize(count, value);
    Ok(numbers)
}
