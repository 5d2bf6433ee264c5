//! Stage vectors of a step, laid out in memory for fast weighted sums.

/// Components that are summed together in one vector register.
const BLOCK: usize = 4;

/// One row for each stage, padded to whole blocks.
#[derive(Clone, Debug)]
pub(super) struct Stages {
    n: usize,
    /// Blocks of a row, at least one.
    width: usize,
    rows: Vec<[f64; BLOCK]>,
}

impl Stages {
    /// Zeros for `stages` stages of `n` components.
    pub(super) fn new(stages: usize, n: usize) -> Self {
        let width = n.div_ceil(BLOCK).max(1);
        Self { n, width, rows: vec![[0.0; BLOCK]; stages * width] }
    }

    /// The row of a stage.
    #[inline]
    pub(super) fn row_mut(&mut self, stage: usize) -> &mut [f64] {
        &mut self.rows[stage * self.width..].as_flattened_mut()[..self.n]
    }

    /// Copies the row of a stage to another.
    pub(super) fn copy_row(&mut self, from: usize, to: usize) {
        self.rows.copy_within(from * self.width..(from + 1) * self.width, to * self.width);
    }

    /// A component of a stage.
    #[inline]
    pub(super) fn at(&self, stage: usize, component: usize) -> f64 {
        self.rows[stage * self.width + component / BLOCK][component % BLOCK]
    }

    /// Replaces every row up to the one behind the last weight: the first by the row `from`, each other one by
    /// the row before it less the weighted old row in that place.
    pub(super) fn renew(&mut self, weights: &[f64], from: usize) {
        for block in 0..self.width {
            let mut carry = self.rows[from * self.width + block];
            for (stage, weight) in weights.iter().enumerate() {
                let row = &mut self.rows[stage * self.width + block];
                let old = std::mem::replace(row, carry);
                for (carry, old) in carry.iter_mut().zip(old) {
                    *carry -= weight * old;
                }
            }
            self.rows[weights.len() * self.width + block] = carry;
        }
    }

    /// `start + h Σ w_j k_j` over the first stages, one for each weight.
    #[inline]
    pub(super) fn advance(&self, start: &[f64], h: f64, weights: &[f64], out: &mut [f64]) {
        let (starts, start_of_rest) = start.as_chunks::<BLOCK>();
        let (blocks, rest) = out.as_chunks_mut::<BLOCK>();
        for (block, (out, start)) in blocks.iter_mut().zip(starts).enumerate() {
            let sum = self.sum_of_block(block, weights, [0.0; BLOCK]);
            *out = std::array::from_fn(|k| start[k] + h * sum[k]);
        }
        if !rest.is_empty() {
            let sum = self.sum_of_block(starts.len(), weights, [0.0; BLOCK]);
            for ((out, start), sum) in rest.iter_mut().zip(start_of_rest).zip(sum) {
                *out = start + h * sum;
            }
        }
    }

    /// Adds Σ w_j k_j over the first stages, one for each weight, in their order.
    #[inline]
    pub(super) fn add(&self, weights: &[f64], out: &mut [f64]) {
        self.sums(weights, out, |out| out, |_, sum| sum);
    }

    /// Writes `finish(component, Σ w_j k_j)` for all components to `out`.
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
        let first_of_rest = blocks.len() * BLOCK;
        for (block, out) in blocks.iter_mut().enumerate() {
            let sum = self.sum_of_block(block, weights, out.map(&begin));
            *out = std::array::from_fn(|k| finish(block * BLOCK + k, sum[k]));
        }
        if !rest.is_empty() {
            let begun = std::array::from_fn(|k| rest.get(k).map_or(0.0, |&out| begin(out)));
            let sum = self.sum_of_block(first_of_rest / BLOCK, weights, begun);
            for (k, out) in rest.iter_mut().enumerate() {
                *out = finish(first_of_rest + k, sum[k]);
            }
        }
    }

    #[inline(always)]
    fn sum_of_block(&self, block: usize, weights: &[f64], sum: [f64; BLOCK]) -> [f64; BLOCK] {
        match self.width {
            // One block holds positions and velocities of two degrees of freedom; few mechanisms have more.
            1 => weighted_sum(weights, self.rows.iter(), sum),
            width => weighted_sum(weights, self.rows.chunks_exact(width).map(|row| &row[block]), sum),
        }
    }
}

#[inline(always)]
fn weighted_sum<'a>(
    weights: &[f64],
    rows: impl Iterator<Item = &'a [f64; BLOCK]>,
    mut sum: [f64; BLOCK],
) -> [f64; BLOCK] {
    for (weight, row) in weights.iter().zip(rows) {
        for (sum, k) in sum.iter_mut().zip(row) {
            *sum += weight * k;
        }
    }
    sum
}
