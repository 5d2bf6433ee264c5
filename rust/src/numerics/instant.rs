//! Instants without rounding errors, where a step is added to a long time.
//!
//! At 16 s the spacing of floating-point numbers is 3.6e-15 s, in which a drive at 200 rad/s turns by 7e-13
//! rad. Rounding the instant of every stage would add noise of this size to the positions of contacts, whose
//! forces respond to 1e-14 m: at tight tolerances steps were rejected more and more often as a run went on.

/// An instant as an unevaluated sum: the nearest number, and the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// The nearest number [s].
    pub time: f64,
    /// The instant less that number [s].
    pub rest: f64,
}

impl Instant {
    /// The instant `passed` [s] after a number [s].
    #[inline]
    pub fn after(start: f64, passed: f64) -> Self {
        let (time, rest) = exact_sum(start, passed);
        Self { time, rest }
    }
}

impl From<f64> for Instant {
    #[inline]
    fn from(time: f64) -> Self {
        Self { time, rest: 0.0 }
    }
}

/// A sum and its rounding error `[Knuth1998]`.
#[inline]
pub fn exact_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

/// A product and its rounding error `[Dekker1971]`. It avoids fused multiply-add, which not
/// every processor has and whose emulation costs a call.
#[inline]
pub fn exact_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let ((a_head, a_tail), (b_head, b_tail)) = (halves(a), halves(b));
    let rest = ((a_head * b_head - product) + a_head * b_tail + a_tail * b_head) + a_tail * b_tail;
    // The splitting overflows for numbers near the largest; the rest is then unknown.
    (product, if rest.is_finite() { rest } else { 0.0 })
}

/// A number as a sum of two numbers with half of the digits each.
#[inline]
fn halves(value: f64) -> (f64, f64) {
    let scaled = 134_217_729.0 * value;
    let head = scaled - (scaled - value);
    (head, value - head)
}
