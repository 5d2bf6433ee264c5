//! Piecewise cubics through points.

/// The pieces of the cubic spline through points with the not-a-knot end condition, as powers of the distance from the
/// start of each.
///
/// Its unknowns are the second derivatives at the inner knots that are knots. Slopes would do as well but for points
/// at very unequal distances: the second derivatives are then small differences of slopes, divided by the distance.
pub(crate) fn not_a_knot(times: &[f64], values: &[f64]) -> Vec<[f64; 4]> {
    let n = times.len();
    let (h, secant) = secants(times, values);
    if n == 2 {
        return vec![[values[0], secant[0], 0.0, 0.0]];
    }
    let quadratic = |k: usize| (secant[k + 1] - secant[k]) / (h[k] + h[k + 1]);
    if n == 3 {
        return cubic(values, &h, &secant, quadratic(0), 0.0).to_vec();
    }
    if n == 4 {
        let third = (quadratic(1) - quadratic(0)) / (h[0] + h[1] + h[2]);
        let [first, second] = cubic(values, &h, &secant, quadratic(0), third);
        let [_, last] = cubic(&values[1..], &h[1..], &secant[1..], quadratic(1), third);
        return vec![first, second, last];
    }
    // At the inner end of the cubic through three points its slope is that of the parabola through them and `lever`
    // times the difference of their second derivatives.
    let lever = |outer: f64, inner: f64| (outer + inner) * inner / (2.0 * (outer + 2.0 * inner));
    let (left, right) = (lever(h[0], h[1]), lever(h[n - 2], h[n - 3]));
    let (first, last) = (quadratic(0), quadratic(n - 3));
    // The slopes of both sides of a knot agree.
    let (mut diagonal, mut second) = (vec![0.0; n], vec![0.0; n]);
    for k in 2..n - 2 {
        let (before, of_before) = match k {
            2 => (secant[1] + first * h[1] - 2.0 * first * left, left),
            _ => (secant[k - 1], h[k - 1] / 3.0),
        };
        let (after, of_after) = if k == n - 3 {
            (secant[k] - last * h[k] + 2.0 * last * right, right)
        } else {
            (secant[k], h[k] / 3.0)
        };
        (diagonal[k], second[k]) = (of_before + of_after, after - before);
        if k > 2 {
            let factor = h[k - 1] / 6.0 / diagonal[k - 1];
            diagonal[k] -= factor * h[k - 1] / 6.0;
            second[k] -= factor * second[k - 1];
        }
    }
    second[n - 3] /= diagonal[n - 3];
    for k in (2..n - 3).rev() {
        second[k] = (second[k] - h[k] / 6.0 * second[k + 1]) / diagonal[k];
    }
    let third = |second: f64, of_parabola: f64, outer: f64, inner: f64| {
        (second - 2.0 * of_parabola) / (2.0 * (outer + 2.0 * inner))
    };
    let start = cubic(values, &h, &secant, first, third(second[2], first, h[0], h[1]));
    let end = n - 3;
    let third = -third(second[end], last, h[n - 2], h[n - 3]);
    let end = cubic(&values[end..], &h[end..], &secant[end..], last, third);
    let inner = (2..n - 3).map(|k| between(values[k], secant[k], h[k], [second[k], second[k + 1]]));
    start.into_iter().chain(inner).chain(end).collect()
}

/// Distances of the points, and the slopes of straight lines between them.
fn secants(points: &[f64], values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let h: Vec<f64> = points.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let secants = values.windows(2).zip(&h).map(|(pair, h)| (pair[1] - pair[0]) / h).collect();
    (h, secants)
}

/// The cubic between two points with these second derivatives.
fn between(value: f64, secant: f64, h: f64, [a, b]: [f64; 2]) -> [f64; 4] {
    [value, secant - h * (2.0 * a + b) / 6.0, 0.5 * a, (b - a) / (6.0 * h)]
}

/// Both pieces of the cubic through three points, from the quadratic and the cubic coefficient of its Newton form.
fn cubic(values: &[f64], h: &[f64], secant: &[f64], quadratic: f64, third: f64) -> [[f64; 4]; 2] {
    let both = h[0] + h[1];
    [
        [
            values[0],
            secant[0] - h[0] * quadratic + third * h[0] * both,
            quadratic - third * (h[0] + both),
            third,
        ],
        [
            values[1],
            secant[0] + h[0] * quadratic - third * h[0] * h[1],
            quadratic + third * (h[0] - h[1]),
            third,
        ],
    ]
}

/// The pieces of the cubic spline through points that repeat themselves: value, slope and second derivative are the same
/// at both ends.
pub(crate) fn periodic_cubic(points: &[f64], values: &[f64]) -> Vec<[f64; 4]> {
    let n = points.len() - 1;
    let (h, secant) = secants(points, values);
    // Second derivatives: h[k-1]/6 s[k-1] + (h[k-1] + h[k])/3 s[k] + h[k]/6 s[k+1] = secant[k] - secant[k-1], where
    // indices go round.
    let before = |k: usize| (k + n - 1) % n;
    let right: Vec<f64> = (0..n).map(|k| secant[k] - secant[before(k)]).collect();
    let second = match n {
        1 => vec![0.0],
        2 => {
            // Both neighbors are the other point.
            let (own, other) = ((h[0] + h[1]) / 3.0, (h[0] + h[1]) / 6.0);
            let determinant = own * own - other * other;
            vec![
                (own * right[0] - other * right[1]) / determinant,
                (own * right[1] - other * right[0]) / determinant,
            ]
        }
        _ => {
            // The corners of the matrix are a change of rank one: Sherman and Morrison.
            let corner = h[n - 1] / 6.0;
            let shift = -(h[n - 1] + h[0]) / 3.0;
            let mut diagonal: Vec<f64> = (0..n).map(|k| (h[before(k)] + h[k]) / 3.0).collect();
            diagonal[0] -= shift;
            diagonal[n - 1] -= corner * corner / shift;
            let off: Vec<f64> = h[..n - 1].iter().map(|h| h / 6.0).collect();
            let mut corners = vec![0.0; n];
            (corners[0], corners[n - 1]) = (shift, corner);
            let (plain, change) =
                (tridiagonal(&diagonal, &off, right), tridiagonal(&diagonal, &off, corners));
            let part = |of: &[f64]| of[0] + of[n - 1] * corner / shift;
            let factor = part(&plain) / (1.0 + part(&change));
            plain.iter().zip(&change).map(|(plain, change)| plain - factor * change).collect()
        }
    };
    (0..n).map(|k| between(values[k], secant[k], h[k], [second[k], second[(k + 1) % n]])).collect()
}

/// Solves a symmetric tridiagonal system.
fn tridiagonal(diagonal: &[f64], off: &[f64], mut right: Vec<f64>) -> Vec<f64> {
    let mut pivots = diagonal.to_vec();
    for k in 1..pivots.len() {
        let factor = off[k - 1] / pivots[k - 1];
        pivots[k] -= factor * off[k - 1];
        right[k] -= factor * right[k - 1];
    }
    let last = pivots.len() - 1;
    right[last] /= pivots[last];
    for k in (0..last).rev() {
        right[k] = (right[k] - off[k] * right[k + 1]) / pivots[k];
    }
    right
}

/// The pieces of the monotone cubic through points `[FritschButland1984]`, with the end slopes of SciPy's
/// `PchipInterpolator`, or, where the points repeat themselves, those of neighbors across the ends.
pub(crate) fn monotone(points: &[f64], values: &[f64], periodic: bool) -> Vec<[f64; 4]> {
    let n = points.len() - 1;
    let (h, secant) = secants(points, values);
    if n == 1 {
        return vec![[values[0], secant[0], 0.0, 0.0]];
    }
    // The weighted harmonic mean of the secants on both sides; zero where they have different signs.
    let inner = |left: usize, right: usize| {
        if secant[left] * secant[right] <= 0.0 {
            return 0.0;
        }
        let (first, second) = (2.0 * h[right] + h[left], h[right] + 2.0 * h[left]);
        (first + second) / (first / secant[left] + second / secant[right])
    };
    let end = |near: usize, next: usize| {
        let slope = ((2.0 * h[near] + h[next]) * secant[near] - h[near] * secant[next]) / (h[near] + h[next]);
        if slope * secant[near] <= 0.0 {
            0.0
        } else if secant[near] * secant[next] <= 0.0 && slope.abs() > 3.0 * secant[near].abs() {
            3.0 * secant[near]
        } else {
            slope
        }
    };
    let slope = |k: usize| match k {
        _ if periodic && (k == 0 || k == n) => inner(n - 1, 0),
        0 => end(0, 1),
        _ if k == n => end(n - 1, n - 2),
        _ => inner(k - 1, k),
    };
    let piece = |k: usize| {
        let (left, right) = (slope(k), slope(k + 1));
        let quadratic = (3.0 * secant[k] - 2.0 * left - right) / h[k];
        [values[k], left, quadratic, (left + right - 2.0 * secant[k]) / (h[k] * h[k])]
    };
    (0..n).map(piece).collect()
}
