//! Runs of one output with what is asked of their band.

use chebclear::study::band::{Design, Method, OutputBand};
use chebclear::study::chebyshev::GridError;

/// No physical limits.
pub(crate) const NONE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// The runs, in the terms of [`Design::new`] and [`Design::band`].
#[derive(Clone, Copy)]
pub(crate) struct Table<'a> {
    pub(crate) points: &'a [f64],
    pub(crate) parameters: usize,
    pub(crate) values: &'a [f64],
    pub(crate) samples: usize,
    pub(crate) revolutions: Option<usize>,
    pub(crate) scored: usize,
}

impl<'a> Table<'a> {
    /// Runs of which all are scored.
    pub(crate) fn new(points: &'a [f64], parameters: usize, values: &'a [f64], samples: usize) -> Self {
        Self { points, parameters, values, samples, revolutions: None, scored: points.len() / parameters }
    }

    pub(crate) fn band(
        &self,
        limits: [f64; 2],
        coverage: f64,
        method: Method,
        threads: Option<usize>,
    ) -> Result<OutputBand, GridError> {
        let Self { points, parameters, values, samples, revolutions, scored } = *self;
        let design = Design::new(points, parameters, revolutions, scored, coverage, method, &|| true)?;
        Ok(design.unwrap().band(values, samples, limits, threads, &|| true)?.unwrap())
    }
}
