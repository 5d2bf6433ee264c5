//! The coefficients of the Rosenbrock methods against the theory: order conditions from rooted
//! trees, stability function, consistency of the non-autonomous terms.

use chebclear::integrators::tableaus::{RODAS4, RODAS5P, Tableau};
use nalgebra::{Complex, DMatrix, DVector};

use crate::integrators::rodas6p::RODAS6P;

/// A rooted tree: indices of the subtrees at its root, its order, and its density γ(t).
struct Tree {
    children: Vec<usize>,
    order: usize,
    density: f64,
}

/// All rooted trees up to an order, subtrees before the trees that contain them.
fn rooted_trees(order: usize) -> Vec<Tree> {
    let mut trees = vec![Tree { children: Vec::new(), order: 1, density: 1.0 }];
    for n in 2..=order {
        let mut forests = Vec::new();
        collect_forests(&trees, n - 1, 0, &mut Vec::new(), &mut forests);
        for children in forests {
            let density = n as f64 * children.iter().map(|&child| trees[child].density).product::<f64>();
            trees.push(Tree { children, order: n, density });
        }
    }
    trees
}

/// Every multiset of trees with `left` vertices in all, as ascending indices from `least` on.
fn collect_forests(
    trees: &[Tree],
    left: usize,
    least: usize,
    chosen: &mut Vec<usize>,
    forests: &mut Vec<Vec<usize>>,
) {
    if left == 0 {
        forests.push(chosen.clone());
        return;
    }
    for index in least..trees.len() {
        if trees[index].order <= left {
            chosen.push(index);
            collect_forests(trees, left - trees[index].order, index, chosen, forests);
            chosen.pop();
        }
    }
}

/// A method in its classical form: α_ij, Γ with its diagonal, and their sum β.
struct Classical {
    alpha: DMatrix<f64>,
    gamma: DMatrix<f64>,
    beta: DMatrix<f64>,
}

impl Classical {
    fn new(tableau: &Tableau) -> Self {
        let s = tableau.stages;
        let lower = |rows: &[&[f64]]| DMatrix::from_fn(s, s, |i, j| if j < i { rows[i][j] } else { 0.0 });
        let (a, c) = (lower(tableau.a), lower(tableau.c));
        let gamma = (DMatrix::identity(s, s) / tableau.gamma - c).try_inverse().expect("triangular");
        let alpha = a * &gamma;
        let beta = &alpha + &gamma;
        Self { alpha, gamma, beta }
    }

    /// Weights b of the classical form from weights of the u_i.
    fn weights(&self, transformed: &[f64]) -> DVector<f64> {
        self.gamma.tr_mul(&DVector::from_row_slice(transformed))
    }

    /// Elementary weights Φ_i(t) of every tree: a vertex with one branch is reached through β,
    /// one with several through α.
    fn elementary_weights(&self, trees: &[Tree]) -> Vec<DVector<f64>> {
        let mut weights: Vec<DVector<f64>> = Vec::with_capacity(trees.len());
        for tree in trees {
            let matrix = if tree.children.len() == 1 { &self.beta } else { &self.alpha };
            let mut product = DVector::from_element(self.alpha.nrows(), 1.0);
            for &child in &tree.children {
                product.component_mul_assign(&(matrix * &weights[child]));
            }
            weights.push(product);
        }
        weights
    }

    /// Largest residual `|Σ b_i Φ_i(t) - θ^|t| / γ(t)|` of the order conditions of every order.
    fn residuals(&self, b: &DVector<f64>, theta: f64) -> [f64; 7] {
        let trees = rooted_trees(6);
        let weights = self.elementary_weights(&trees);
        let mut largest = [0.0_f64; 7];
        for (tree, weight) in trees.iter().zip(&weights) {
            let residual = b.dot(weight) - theta.powi(tree.order as i32) / tree.density;
            largest[tree.order] = largest[tree.order].max(residual.abs());
        }
        largest
    }
}

/// Largest residual up to an order.
fn worst(residuals: &[f64; 7], order: usize) -> f64 {
    residuals[1..=order].iter().fold(0.0, |a, b| a.max(*b))
}

fn embedded_weights(tableau: &Tableau) -> Vec<f64> {
    tableau.m.iter().zip(tableau.e).map(|(m, e)| m - e).collect()
}

/// The methods with the orders that their authors claim: solution, embedded, dense output.
fn methods() -> [(Tableau, usize, usize, usize); 3] {
    [(RODAS4, 4, 3, 3), (RODAS5P, 5, 4, 4), (RODAS6P, 6, 5, 5)]
}

/// Stages of the step itself; Rodas6P has three more for its dense output alone.
fn step_stages(tableau: &Tableau) -> usize {
    tableau.m.iter().rposition(|m| *m != 0.0).expect("weights") + 1
}

#[test]
fn there_are_37_rooted_trees_up_to_order_6() {
    let trees = rooted_trees(6);
    let count = |order| trees.iter().filter(|tree| tree.order == order).count();
    assert_eq!([1, 2, 3, 4, 5, 6].map(count), [1, 1, 2, 4, 9, 20]);
    // Of order 5: the bushy tree has density 5, the tall one 5!.
    let densities = trees.iter().filter(|tree| tree.order == 5).map(|tree| tree.density);
    assert_eq!(densities.clone().fold(f64::INFINITY, f64::min), 5.0);
    assert_eq!(densities.fold(0.0, f64::max), 120.0);
}

#[test]
fn gate_01_the_order_conditions_hold_up_to_the_claimed_order_and_not_beyond() {
    for (tableau, order, ..) in methods() {
        assert_eq!(tableau.order, order);
        let classical = Classical::new(&tableau);
        let residuals = classical.residuals(&classical.weights(tableau.m), 1.0);
        println!("{} solution {residuals:?}", tableau.name);
        assert!(worst(&residuals, order) < 1e-13, "{}: {residuals:?}", tableau.name);
        if order < 6 {
            assert!(residuals[order + 1] > 1e-3, "{}: {residuals:?}", tableau.name);
        }
    }
}

#[test]
fn gate_01_the_embedded_solution_is_of_the_claimed_order_and_not_of_the_next() {
    for (tableau, _, embedded, _) in methods() {
        assert_eq!(tableau.embedded_order, embedded);
        let classical = Classical::new(&tableau);
        let b = classical.weights(&embedded_weights(&tableau));
        let residuals = classical.residuals(&b, 1.0);
        println!("{} embedded {residuals:?}", tableau.name);
        assert!(worst(&residuals, embedded) < 1e-13, "{}: {residuals:?}", tableau.name);
        // Otherwise the error estimate would be blind to the leading error.
        assert!(residuals[embedded + 1] > 1e-4, "{}: {residuals:?}", tableau.name);
    }
}

#[test]
fn gate_01_the_dense_output_is_of_the_claimed_order_everywhere_in_the_step() {
    for (tableau, _, _, dense) in methods() {
        let classical = Classical::new(&tableau);
        let mut largest = 0.0_f64;
        let mut next = 0.0_f64;
        for k in 1..20 {
            let theta = f64::from(k) / 20.0;
            let mut weights: Vec<f64> = tableau.m.iter().map(|m| theta * m).collect();
            for (r, row) in tableau.h.iter().enumerate() {
                let factor = theta * (1.0 - theta) * theta.powi(r as i32);
                weights.iter_mut().zip(*row).for_each(|(weight, h)| *weight += factor * h);
            }
            let residuals = classical.residuals(&classical.weights(&weights), theta);
            largest = largest.max(worst(&residuals, dense));
            next = next.max(residuals[dense + 1]);
        }
        println!("{} dense {largest:.1e}, next order {next:.1e}", tableau.name);
        assert!(largest < 1e-12, "{}: {largest:e}", tableau.name);
        assert!(next > 1e-4, "{}: {next:e}", tableau.name);
    }
}

#[test]
fn the_rows_add_up_to_the_instants_of_the_stages_and_the_weights_of_the_time_derivative() {
    for (tableau, ..) in methods() {
        let classical = Classical::new(&tableau);
        for i in 0..tableau.stages {
            let alpha = (classical.alpha.row(i).sum() - tableau.alpha[i]).abs();
            let d = (classical.gamma.row(i).sum() - tableau.d[i]).abs();
            assert!(alpha < 1e-13 && d < 1e-13, "{} stage {i}: {alpha:e}, {d:e}", tableau.name);
            let diagonal = (classical.gamma[(i, i)] - tableau.gamma).abs();
            assert!(diagonal < 1e-14, "{} stage {i}: {diagonal:e}", tableau.name);
        }
    }
}

#[test]
fn the_methods_are_stiffly_accurate() {
    for (tableau, ..) in methods() {
        let classical = Classical::new(&tableau);
        let last = step_stages(&tableau) - 1;
        let b = classical.weights(tableau.m);
        assert!((tableau.alpha[last] - 1.0).abs() < 1e-15);
        for j in 0..tableau.stages {
            let difference = (classical.beta[(last, j)] - b[j]).abs();
            assert!(difference < 1e-13, "{} weight {j}: {difference:e}", tableau.name);
        }
    }
}

#[test]
fn the_stability_functions_vanish_at_infinity_and_stay_within_one_on_the_imaginary_axis() {
    for (tableau, ..) in methods() {
        let classical = Classical::new(&tableau);
        let s = step_stages(&tableau);
        let beta = classical.beta.view((0, 0), (s, s)).into_owned();
        let one = DVector::from_element(s, 1.0);
        for weights in [tableau.m.to_vec(), embedded_weights(&tableau)] {
            let b = classical.weights(&weights).rows(0, s).into_owned();
            // R(∞) = 1 - bᵀ B⁻¹ 1.
            let at_infinity = 1.0 - b.dot(&beta.clone().lu().solve(&one).expect("regular"));
            assert!(at_infinity.abs() < 1e-12, "{}: {at_infinity:e}", tableau.name);
        }
        let b = classical.weights(tableau.m).rows(0, s).map(|b| Complex::new(b, 0.0));
        for k in -20..=40 {
            // R(z) = 1 + z bᵀ (I - zB)⁻¹ 1 at z = iy.
            let z = Complex::new(0.0, 10_f64.powf(f64::from(k) / 10.0));
            let matrix = DMatrix::identity(s, s) - beta.map(|b| z * b);
            let stages = matrix.lu().solve(&one.map(|x| Complex::new(x, 0.0))).expect("regular");
            let r = Complex::new(1.0, 0.0) + z * b.dot(&stages);
            assert!(r.norm() < 1.0 + 1e-12, "{}: |R({z})| = {}", tableau.name, r.norm());
        }
    }
}
