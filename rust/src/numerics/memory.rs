//! Large arrays: too little memory is an error, not the end of the process.

use std::collections::TryReserveError;

/// A vector of equal numbers.
///
/// # Errors
/// If there is too little memory.
pub fn filled(count: usize, value: f64) -> Result<Vec<f64>, TryReserveError> {
    let mut numbers = Vec::new();
    numbers.try_reserve_exact(count)?;
    numbers.resize(count, value);
    Ok(numbers)
}
