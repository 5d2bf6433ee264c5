//! What counts as rounding, as equal or as singular, and how long iterations may take: one number for each meaning.

/// Rounding error of a few operations, relative to the size of their terms.
/// Half, twice: work 0, -1 % (198 of 400 runs).
pub const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Rounding error of some operations along a chain of frames, relative to the size of their terms.
/// Half, twice: work -3, -3 % (46 of 400 runs).
pub const ROUNDING_OF_CHAIN: f64 = 16.0 * f64::EPSILON;
/// Rounding error of the solution of linear equations, relative to its size.
/// Half, twice: the same work (2 of 400 runs).
pub const ROUNDING_OF_SOLUTION: f64 = 1e-12;
/// Half of the digits of a double, 2⁻²⁶: what remains of a double root, of the place of an extremum, and of a difference
/// of squares. Half, twice: work +2, -10 % (9 of 400 runs), two of which end at a dead center with another status.
pub const HALF_DIGITS: f64 = 1.490_116_119_384_765_6e-8;
/// Relative difference of numbers that are meant to be equal: they are typed with ten digits.
/// Half and twice change nothing.
pub const EQUAL: f64 = 1e-9;
/// Part of the largest below which a singular value, a pivot or a determinant of a matrix counts as zero.
/// Half and twice change nothing.
pub const SINGULAR: f64 = 1e-6;
/// Error of an integral relative to its size, above which its pieces are halved.
/// Half, twice: the same work (5 of 400 runs).
pub const INTEGRAL_ERROR: f64 = 1e-9;
/// Most halvings of a piece: next to a singularity the integrand has no bound.
/// Half, twice: the same work (1 of 400 runs).
pub const HALVINGS: u32 = 20;
/// Most steps of Newton's method, which doubles the digits with each once it is near. Half and twice change nothing.
pub const NEWTON_STEPS: usize = 100;
/// Most evaluations of a search in a bracket: 53 halvings reach the rounding of a double.
/// Half: errors times 1.4 (56 of 400 runs); twice: the same work (9).
pub const SEARCH_STEPS: usize = 60;
