//! Instants that lose nothing where a step is added to a long time.
//!
//! After 16 s a number can tell instants 3.6e-15 s apart. A drive at 200 rad/s turns by 7e-13 rad
//! meanwhile, and stages whose instants are rounded one by one feel it as noise in the position of a contact
//! that answers 1e-14 m: at tight tolerances steps were refused more and more often the longer a run went on.

/// An instant: the nearest number, and what lies between.
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

/// A sum and what rounding takes from it `[Knuth1998]`.
#[inline]
pub fn exact_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

/// A product and what rounding takes from it `[Dekker1971]`. Without a fused multiplication, which not
/// every processor has and whose substitute costs a call.
#[inline]
pub fn exact_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let ((a_head, a_tail), (b_head, b_tail)) = (halves(a), halves(b));
    let rest = ((a_head * b_head - product) + a_head * b_tail + a_tail * b_head) + a_tail * b_tail;
    // Numbers near the largest have no halves: then nothing is known of the rest.
    (product, if rest.is_finite() { rest } else { 0.0 })
}

/// A number as a sum of two with half the digits each.
#[inline]
fn halves(value: f64) -> (f64, f64) {
    let scaled = 134_217_729.0 * value;
    let head = scaled - (scaled - value);
    (head, value - head)
}
