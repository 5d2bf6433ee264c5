//! Points of the cube [-1, 1]^k at which a study simulates: scrambled Sobol' points, which fill it evenly
//! for any number of points, and independent uniform ones. In: numbers of points and parameters, a seed; out:
//! points, the same on every machine.

/// Most parameters for which there are Sobol' points.
pub const MOST_PARAMETERS: usize = 32;

/// Most points of one sequence: the points have 32 binary digits.
pub const MOST_POINTS: u64 = 1 << 32;

const DIGITS: usize = 32;

/// Primitive polynomial, its leading and last coefficients included, and first direction numbers of
/// dimensions 2 to 32: file new-joe-kuo-6.21201 of `[JoeKuo2008]`.
#[rustfmt::skip]
const DIRECTIONS: [(u32, &[u32]); MOST_PARAMETERS - 1] = [
    (3, &[1]), (7, &[1, 3]), (11, &[1, 3, 1]), (13, &[1, 1, 1]), (19, &[1, 1, 3, 3]), (25, &[1, 3, 5, 13]),
    (37, &[1, 1, 5, 5, 17]), (41, &[1, 1, 5, 5, 5]), (47, &[1, 1, 7, 11, 19]), (55, &[1, 1, 5, 1, 1]),
    (59, &[1, 1, 1, 3, 11]), (61, &[1, 3, 5, 5, 31]), (67, &[1, 3, 3, 9, 7, 49]),
    (91, &[1, 1, 1, 15, 21, 21]), (97, &[1, 3, 1, 13, 27, 49]), (103, &[1, 1, 1, 15, 7, 5]),
    (109, &[1, 3, 1, 15, 13, 25]), (115, &[1, 1, 5, 5, 19, 61]), (131, &[1, 3, 7, 11, 23, 15, 103]),
    (137, &[1, 3, 7, 13, 13, 15, 69]), (143, &[1, 1, 3, 13, 7, 35, 63]), (145, &[1, 3, 5, 9, 1, 25, 53]),
    (157, &[1, 3, 1, 13, 9, 35, 107]), (167, &[1, 3, 1, 5, 27, 61, 31]), (171, &[1, 1, 5, 11, 19, 41, 61]),
    (185, &[1, 3, 5, 3, 3, 13, 69]), (191, &[1, 1, 7, 13, 1, 19, 1]), (193, &[1, 3, 7, 5, 13, 19, 59]),
    (203, &[1, 1, 3, 9, 25, 29, 41]), (211, &[1, 3, 5, 13, 23, 1, 55]), (213, &[1, 3, 7, 3, 13, 59, 17]),
];

/// Random number generator SplitMix64 of `[SteeleLeaFlood2014]`: three lines, the same numbers on every
/// machine.
#[derive(Clone, Debug)]
pub struct SplitMix64(u64);

impl SplitMix64 {
    /// The generator that starts from a seed; nearby seeds give unrelated numbers.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// The next uniform number between 0 and 1, neither of them [-].
    pub fn uniform(&mut self) -> f64 {
        ((self.bits() >> 12) as f64 + 0.5) / (1u64 << 52) as f64
    }
}

/// Points `first` to `first + count - 1` of a scrambled Sobol' sequence in [-1, 1]^`parameters`, row-major.
///
/// Every direction number is multiplied by a random lower triangular binary matrix and the digits are
/// shifted `[Matousek1998]`: each point is then uniformly distributed, and the sequence keeps its uniformity.
/// The same seed continues the same sequence. Without a seed the sequence is not scrambled, for tests.
///
/// The numbers of points must end below [`MOST_POINTS`] and those of parameters be 1 to
/// [`MOST_PARAMETERS`]; otherwise there are no points.
pub fn sobol_points(parameters: usize, first: u64, count: usize, seed: Option<u64>) -> Vec<f64> {
    let fits = first.checked_add(count as u64).is_some_and(|end| end <= MOST_POINTS);
    if !fits || !(1..=MOST_PARAMETERS).contains(&parameters) {
        return Vec::new();
    }
    let mut random = seed.map(SplitMix64::new);
    let mut points = vec![0.0; count * parameters];
    for axis in 0..parameters {
        let mut directions = direction_numbers(axis);
        let mut shift = 0;
        if let Some(random) = &mut random {
            let matrix = lower_triangular(random);
            directions = directions.map(|direction| product(&matrix, direction));
            shift = (random.bits() >> 32) as u32;
        }
        for (row, number) in (first..first + count as u64).enumerate() {
            let gray = number ^ (number >> 1);
            let digits = (0..DIGITS)
                .filter(|&bit| gray >> bit & 1 == 1)
                .fold(shift, |digits, bit| digits ^ directions[bit]);
            // The middle of the interval of the last digit, so that no point is on the surface of the cube.
            let unit = (f64::from(digits) + if seed.is_some() { 0.5 } else { 0.0 }) / MOST_POINTS as f64;
            points[row * parameters + axis] = 2.0 * unit - 1.0;
        }
    }
    points
}

/// `count` independent uniform points of [-1, 1]^`parameters`, row-major, after the first `first` ones of
/// the same seed.
pub fn random_points(parameters: usize, first: u64, count: usize, seed: u64) -> Vec<f64> {
    let mut random = SplitMix64::new(seed);
    for _ in 0..first * parameters as u64 {
        random.bits();
    }
    (0..count * parameters).map(|_| 2.0 * random.uniform() - 1.0).collect()
}

/// Direction numbers of a dimension, the leading digit first.
fn direction_numbers(axis: usize) -> [u32; DIGITS] {
    let mut numbers = [0; DIGITS];
    if axis == 0 {
        for (bit, number) in numbers.iter_mut().enumerate() {
            *number = 1 << (DIGITS - 1 - bit);
        }
        return numbers;
    }
    let (polynomial, first) = DIRECTIONS[axis - 1];
    let degree = first.len();
    for bit in 0..DIGITS {
        numbers[bit] = if bit < degree {
            first[bit] << (DIGITS - 1 - bit)
        } else {
            (1..degree)
                .filter(|&step| polynomial >> (degree - step) & 1 == 1)
                .fold(numbers[bit - degree] ^ (numbers[bit - degree] >> degree), |number, step| {
                    number ^ numbers[bit - step]
                })
        };
    }
    numbers
}

/// Rows of a random lower triangular matrix over the field of two elements, ones on its diagonal; the leading
/// digit is the leading bit.
fn lower_triangular(random: &mut SplitMix64) -> [u32; DIGITS] {
    std::array::from_fn(|row| {
        let diagonal = 1u32 << (DIGITS - 1 - row);
        let left = !(diagonal | (diagonal - 1));
        ((random.bits() >> 32) as u32 & left) | diagonal
    })
}

/// A binary matrix times the digits of a number.
fn product(matrix: &[u32; DIGITS], digits: u32) -> u32 {
    (0..DIGITS)
        .fold(0, |result, row| result | ((matrix[row] & digits).count_ones() & 1) << (DIGITS - 1 - row))
}
