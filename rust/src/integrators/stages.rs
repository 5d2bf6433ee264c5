//! Stage vectors of a step, laid out in memory for fast weighted sums.

/// Components of a row that are summed together, unless said otherwise: two vector registers, whose sums do not wait
/// for each other.
const BLOCK: usize = 4;

/// Weights of the first stages.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights<'a> {
    /// `None` where there are no stages yet: their memory may hold anything.
    first: Option<f64>,
    /// Number of zeros behind the first one.
    gap: usize,
    /// Those behind the zeros.
    others: &'a [f64],
}

impl<'a> Weights<'a> {
    /// Weights of which many behind the first may be zero: their stages are left out.
    pub(super) const fn sparse(weights: &'a [f64]) -> Self {
        let Self { first, mut gap, mut others } = Self::dense(weights);
        while let [weight, rest @ ..] = others
            && *weight == 0.0
        {
            (gap, others) = (gap + 1, rest);
        }
        Self { first, gap, others }
    }

    /// Weights as they are.
    #[inline(always)]
    pub(super) const fn dense(weights: &'a [f64]) -> Self {
        match weights {
            [first, others @ ..] => Self { first: Some(*first), gap: 0, others },
            [] => Self { first: None, gap: 0, others: &[] },
        }
    }
}

/// One row for each stage, padded to whole blocks.
#[derive(Clone, Debug)]
pub(super) struct Stages<const LANES: usize = BLOCK> {
    n: usize,
    /// Blocks of a row, at least one.
    width: usize,
    rows: Vec<[f64; LANES]>,
}

impl<const LANES: usize> Stages<LANES> {
    /// Zeros for `stages` stages of `n` components.
    pub(super) fn new(stages: usize, n: usize) -> Self {
        let width = n.div_ceil(LANES).max(1);
        Self { n, width, rows: vec![[0.0; LANES]; stages * width] }
    }

    /// The row of a stage.
    #[inline]
    pub(super) fn row_mut(&mut self, stage: usize) -> &mut [f64] {
        &mut self.rows[stage * self.width..].as_flattened_mut()[..self.n]
    }

    /// The same to read.
    #[inline]
    pub(super) fn row(&self, stage: usize) -> &[f64] {
        &self.rows[stage * self.width..].as_flattened()[..self.n]
    }

    pub(super) fn copy_row(&mut self, from: usize, to: usize) {
        self.rows.copy_within(from * self.width..(from + 1) * self.width, to * self.width);
    }

    /// A component of a stage.
    #[inline]
    pub(super) fn at(&self, stage: usize, component: usize) -> f64 {
        self.rows[stage * self.width + component / LANES][component % LANES]
    }

    /// Replaces every row up to the one behind the last weight: the first by `first`, each other one by the row
    /// before it less the weighted old row in that place.
    #[inline(always)]
    pub(super) fn renew(&mut self, weights: &[f64], first: &[f64]) {
        // Two degrees of freedom, as in the paper: without strides.
        if first.len() <= LANES {
            return renew_blocks(self.rows.iter_mut(), weights, read(first, 0));
        }
        for block in 0..self.width {
            renew_blocks(self.rows[block..].iter_mut().step_by(self.width), weights, read(first, block));
        }
    }

    /// `start + h Σ w_j k_j` over the first stages, one for each weight.
    pub(super) fn advance(&self, start: &[f64], h: f64, weights: &[f64], out: &mut [f64]) {
        self.advance_by(start, h, Weights::dense(weights), out);
    }

    /// The same with sparse weights.
    #[inline(always)]
    pub(super) fn advance_by(&self, start: &[f64], h: f64, weights: Weights, out: &mut [f64]) {
        if self.width > 1 {
            return self.advance_wide(start, h, weights, out);
        }
        // Two degrees of freedom, as in the paper: without a call and without loops over blocks.
        let (rows, _) = self.rows.as_chunks();
        let [sum] = weighted_sum(rows, [[0.0; LANES]], weights);
        let start: [f64; LANES] = read(start, 0);
        write::<LANES>(out, std::array::from_fn(|k| start[k] + h * sum[k]));
    }

    #[inline(never)]
    fn advance_wide(&self, start: &[f64], h: f64, weights: Weights, out: &mut [f64]) {
        let nothing = |_: usize| [0.0; LANES];
        self.each_block([weights], nothing, out, |block, [sum]| {
            let start: [f64; LANES] = read(start, block);
            std::array::from_fn(|k| start[k] + h * sum[k])
        });
    }

    /// `start + Σ w_j k_j` over the first stages, one for each weight, added in their order.
    #[inline]
    pub(super) fn add(&self, start: &[f64], weights: &[f64], out: &mut [f64]) {
        self.each_block([Weights::dense(weights)], |block| read(start, block), out, |_, [sum]| sum);
    }

    /// Several sums Σ w_j k_j over the first stages, of `n` components: those of a block.
    #[inline(always)]
    pub(super) fn sums<const SUMS: usize>(
        &self,
        n: usize,
        block: usize,
        weights: &[[f64; SUMS]],
    ) -> [[f64; LANES]; SUMS] {
        // Two degrees of freedom, as in the paper: without strides.
        if n <= LANES {
            sums(self.rows.iter(), weights)
        } else {
            sums(self.rows[block..].iter().step_by(self.width), weights)
        }
    }

    /// Writes `finish` of several sums Σ w_j k_j over the first stages to `out`.
    #[inline]
    pub(super) fn combine_all<const SUMS: usize>(
        &self,
        weights: [Weights; SUMS],
        out: &mut [f64],
        finish: impl Fn([f64; SUMS]) -> f64,
    ) {
        let nothing = |_: usize| [0.0; LANES];
        self.each_block(weights, nothing, out, |_, sums| {
            std::array::from_fn(|k| finish(sums.map(|sum| sum[k])))
        });
    }

    /// Writes `finish(block, sums)` to every block of `out`, of sums Σ w_j k_j that begin with `begin(block)`.
    #[inline(always)]
    fn each_block<const SUMS: usize>(
        &self,
        weights: [Weights; SUMS],
        begin: impl Fn(usize) -> [f64; LANES],
        out: &mut [f64],
        finish: impl Fn(usize, [[f64; LANES]; SUMS]) -> [f64; LANES],
    ) {
        // The compiler keeps the sums in registers where it knows their number.
        match self.width {
            1 => self.each_block_of::<1, SUMS>(weights, begin, out, finish),
            2 => self.each_block_of::<2, SUMS>(weights, begin, out, finish),
            3 => self.each_block_of::<3, SUMS>(weights, begin, out, finish),
            4 => self.each_block_of::<4, SUMS>(weights, begin, out, finish),
            width => {
                for (block, out) in out.chunks_mut(LANES).enumerate() {
                    let rows = || self.rows.chunks_exact(width).map(|row| &row[block]);
                    let sums = weights.map(|Weights { first, gap, others }| {
                        let first = first.iter().zip(rows());
                        let others = others.iter().zip(rows().skip(1 + gap));
                        first.chain(others).fold(begin(block), |sum, (weight, row)| plus(sum, *weight, row))
                    });
                    write(out, finish(block, sums));
                }
            }
        }
    }

    #[inline(always)]
    fn each_block_of<const WIDTH: usize, const SUMS: usize>(
        &self,
        weights: [Weights; SUMS],
        begin: impl Fn(usize) -> [f64; LANES],
        out: &mut [f64],
        finish: impl Fn(usize, [[f64; LANES]; SUMS]) -> [f64; LANES],
    ) {
        let (rows, _) = self.rows.as_chunks::<WIDTH>();
        let sums = weights.map(|weights| weighted_sum(rows, std::array::from_fn(&begin), weights));
        for (block, out) in (0..WIDTH).zip(out.chunks_mut(LANES)) {
            write(out, finish(block, sums.map(|sum| sum[block])));
        }
    }
}

/// Several sums of the same weighted blocks.
#[inline(always)]
fn sums<'a, const SUMS: usize, const LANES: usize>(
    blocks: impl Iterator<Item = &'a [f64; LANES]>,
    weights: &[[f64; SUMS]],
) -> [[f64; LANES]; SUMS] {
    blocks.zip(weights).fold([[0.0; LANES]; SUMS], |sums, (block, weights)| {
        std::array::from_fn(|k| plus(sums[k], weights[k], block))
    })
}

/// Replaces blocks as [`Stages::renew`] does, the first by `carry`.
#[inline(always)]
fn renew_blocks<'a, const LANES: usize>(
    mut blocks: impl Iterator<Item = &'a mut [f64; LANES]>,
    weights: &[f64],
    mut carry: [f64; LANES],
) {
    // The weights first: no block is taken behind the last one.
    for (weight, block) in weights.iter().zip(blocks.by_ref()) {
        let old = std::mem::replace(block, carry);
        carry = std::array::from_fn(|k| carry[k] - weight * old[k]);
    }
    if let Some(block) = blocks.next() {
        *block = carry;
    }
}

/// The sum of weighted rows.
#[inline(always)]
fn weighted_sum<const WIDTH: usize, const LANES: usize>(
    rows: &[[[f64; LANES]; WIDTH]],
    begin: [[f64; LANES]; WIDTH],
    weights: Weights,
) -> [[f64; LANES]; WIDTH] {
    let plus = |sum: [[f64; LANES]; WIDTH], weight: f64, row: &[[f64; LANES]; WIDTH]| {
        std::array::from_fn(|block| plus(sum[block], weight, &row[block]))
    };
    let (Some(first), Some((row, rows))) = (weights.first, rows.split_first()) else { return begin };
    let sum = plus(begin, first, row);
    weights.others.iter().zip(&rows[weights.gap..]).fold(sum, |sum, (weight, row)| plus(sum, *weight, row))
}

/// `sum + weight block`.
#[inline(always)]
fn plus<const LANES: usize>(sum: [f64; LANES], weight: f64, block: &[f64; LANES]) -> [f64; LANES] {
    std::array::from_fn(|k| sum[k] + weight * block[k])
}

/// A block of components, filled up with zeros.
#[inline(always)]
fn read<const LANES: usize>(components: &[f64], block: usize) -> [f64; LANES] {
    let rest = components.get(block * LANES..).unwrap_or_default();
    match rest.first_chunk() {
        Some(block) => *block,
        None => std::array::from_fn(|k| rest.get(k).copied().unwrap_or(0.0)),
    }
}

/// Writes as many components of a block as there are.
#[inline(always)]
fn write<const LANES: usize>(out: &mut [f64], block: [f64; LANES]) {
    match out.first_chunk_mut() {
        Some(out) => *out = block,
        None => out.iter_mut().zip(block).for_each(|(out, component)| *out = component),
    }
}
