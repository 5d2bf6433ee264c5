//! What counts as rounding, as equal or as singular, and how long iterations may take: one number for each meaning.

/// Rounding error of a few operations, relative to the size of their terms.
pub const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Rounding error of some operations along a chain of frames, relative to the size of their terms.
pub const ROUNDING_OF_CHAIN: f64 = 16.0 * f64::EPSILON;
/// Rounding error of the solution of linear equations, relative to its size.
pub const ROUNDING_OF_SOLUTION: f64 = 1e-12;
/// Half of the digits of a double, 2⁻²⁶: what remains of a double root, of the place of an extremum, and of a difference
/// of squares.
pub const HALF_DIGITS: f64 = 1.490_116_119_384_765_6e-8;
/// Relative difference of numbers that are meant to be equal: they are typed with ten digits.
pub const EQUAL: f64 = 1e-9;
/// Part of the largest below which a singular value, a pivot or a determinant of a matrix counts as zero.
pub const SINGULAR: f64 = 1e-6;
/// Error of an integral relative to its size, above which its pieces are halved.
pub const INTEGRAL_ERROR: f64 = 1e-9;
/// Most halvings of a piece: next to a singularity the integrand has no bound.
pub const HALVINGS: u32 = 20;
/// Most steps of Newton's method, which doubles the digits with each once it is near.
pub const NEWTON_STEPS: usize = 100;
/// Most evaluations of a search in a bracket: 53 halvings reach the rounding of a double.
pub const SEARCH_STEPS: usize = 60;
