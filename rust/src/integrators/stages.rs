//! What the stages of a step computed, laid out for their weighted sums.

/// Components that are summed together, in vector registers.
const BLOCK: usize = 4;

/// One row of components a stage.
#[derive(Clone, Debug)]
pub(super) struct Stages {
    n: usize,
    rows: Vec<f64>,
}

impl Stages {
    /// Zeros for `stages` stages of `n` components.
    pub(super) fn new(stages: usize, n: usize) -> Self {
        Self { n, rows: vec![0.0; stages * n] }
    }

    /// The row of a stage.
    #[inline]
    pub(super) fn row_mut(&mut self, stage: usize) -> &mut [f64] {
        &mut self.rows[stage * self.n..(stage + 1) * self.n]
    }

    /// Copies the row of a stage to another.
    pub(super) fn copy_row(&mut self, from: usize, to: usize) {
        self.rows.copy_within(from * self.n..(from + 1) * self.n, to * self.n);
    }

    /// A component of a stage.
    #[inline]
    pub(super) fn at(&self, stage: usize, component: usize) -> f64 {
        self.rows[stage * self.n + component]
    }

    /// Adds Σ w_j k_j over the first stages, one for each weight, in their order.
    #[inline]
    pub(super) fn add(&self, weights: &[f64], out: &mut [f64]) {
        self.sums(weights, out, |out| out, |_, sum| sum);
    }

    /// `finish(component, Σ w_j k_j)` for all components.
    #[inline]
    pub(super) fn combine(&self, weights: &[f64], out: &mut [f64], finish: impl Fn(usize, f64) -> f64) {
        self.sums(weights, out, |_| 0.0, finish);
    }

    #[inline]
    fn sums(
        &self,
        weights: &[f64],
        out: &mut [f64],
        begin: impl Fn(f64) -> f64,
        finish: impl Fn(usize, f64) -> f64,
    ) {
        let (blocks, rest) = out.as_chunks_mut::<BLOCK>();
        let whole = blocks.len() * BLOCK;
        for (block, out) in blocks.iter_mut().enumerate() {
            let first = block * BLOCK;
            let mut sum = std::array::from_fn::<f64, BLOCK, _>(|k| begin(out[k]));
            let mut rows = &self.rows[first..];
            for weight in weights {
                for (sum, k) in sum.iter_mut().zip(&rows[..BLOCK]) {
                    *sum += weight * k;
                }
                rows = rows.get(self.n..).unwrap_or_default();
            }
            *out = std::array::from_fn(|k| finish(first + k, sum[k]));
        }
        for (k, out) in (whole..).zip(rest) {
            let products = weights.iter().enumerate().map(|(stage, weight)| weight * self.at(stage, k));
            *out = finish(k, products.fold(begin(*out), |sum, product| sum + product));
        }
    }
}
