//! The range of a polynomial of total degree over the box, by search: for polynomials of so many parameters that
//! their tensor of coefficients would not fit a certified search.

use super::regression::exponents;

/// Parameters up to which all corners of the box are looked at.
const MOST_CORNERS: usize = 8;

/// Sweeps over all parameters from the best corner.
const SWEEPS: usize = 2;

/// Finds extremes of polynomials of one total degree.
///
/// From the best corner and the middle of the box one parameter after the other goes to where the
/// polynomial is largest along it. That is exact where the polynomial is monotone in every parameter, or of
/// degree 1; else the result is an inner bound.
pub struct Search {
    parameters: usize,
    exponents: Vec<usize>,
    /// Places on one axis, and the values of the polynomials T_0, T_1, ... there.
    places: Vec<Vec<f64>>,
    /// Starts, as numbers of places.
    starts: Vec<Vec<usize>>,
    /// Values of the terms at the starts.
    values: Vec<f64>,
}

impl Search {
    /// Prepares the search.
    pub fn new(parameters: usize, degree: usize) -> Self {
        let exponents = exponents(parameters, degree);
        let count = 4 * degree.max(1);
        let places: Vec<Vec<f64>> = (0..=count)
            .map(|place| {
                let angle = std::f64::consts::PI * place as f64 / count as f64;
                (0..=degree).map(|n| (n as f64 * angle).cos()).collect()
            })
            .collect();
        let mut starts = vec![vec![count / 2; parameters]];
        if parameters <= MOST_CORNERS {
            starts.extend((0..1usize << parameters).map(|corner| {
                (0..parameters).map(|axis| if corner >> axis & 1 == 1 { count } else { 0 }).collect()
            }));
        }
        let mut search = Self { parameters, exponents, places, starts, values: Vec::new() };
        search.values = search.starts.iter().flat_map(|start| search.terms(start)).collect();
        search
    }

    fn terms(&self, at: &[usize]) -> Vec<f64> {
        let value = |term: &[usize]| term.iter().zip(at).map(|(&e, &place)| self.places[place][e]).product();
        self.exponents.chunks_exact(self.parameters).map(value).collect()
    }

    /// Largest value found of the polynomial with these coefficients.
    pub fn largest(&self, coefficients: &[f64]) -> f64 {
        let terms = coefficients.len();
        let (mut best, mut start) = (f64::NEG_INFINITY, 0);
        for (index, values) in self.values.chunks_exact(terms).enumerate() {
            let value: f64 = values.iter().zip(coefficients).map(|(v, c)| v * c).sum();
            if value > best {
                (best, start) = (value, index);
            }
        }
        let mut at = self.starts[start].clone();
        let mut along = vec![0.0; self.places[0].len()];
        for _ in 0..SWEEPS {
            for axis in 0..self.parameters {
                along.fill(0.0);
                for (term, c) in self.exponents.chunks_exact(self.parameters).zip(coefficients) {
                    let others = (0..self.parameters).filter(|&other| other != axis && term[other] > 0);
                    along[term[axis]] +=
                        c * others.map(|other| self.places[at[other]][term[other]]).product::<f64>();
                }
                for (place, values) in self.places.iter().enumerate() {
                    let value: f64 = values.iter().zip(&along).map(|(v, c)| v * c).sum();
                    if value > best {
                        (best, at[axis]) = (value, place);
                    }
                }
            }
        }
        best
    }
}
