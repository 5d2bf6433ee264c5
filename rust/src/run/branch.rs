//! The branch of closed loops that drives prescribe, while other bodies are integrated: no step ends on another one.
//!
//! Where a loop settles as many coordinates as it has conditions, the determinant of these vanishes only where two ways to
//! close it meet. A step that ends where it has another sign has left the way of the motion: its error, within the
//! tolerance of the step, was larger than the two ways are apart.

use crate::dynamics::Dynamics;
use crate::mechanism::branch::{Group, settling};
use crate::mechanism::compiled::Mechanism;
use crate::tree::elements::{CLOSURE_ROWS, Tree};

/// The determinants of the loops, at the end of a step and where it began.
#[derive(Clone, Debug, Default)]
pub(crate) struct Branch {
    groups: Vec<Group>,
    start: Vec<f64>,
    end: Vec<f64>,
    /// Whether these states are within the reach of a change point over which the motion passes: there the loops do not act.
    passes: [bool; 2],
    /// Memory of the elimination.
    matrix: Vec<f64>,
}

impl Branch {
    /// That of a mechanism; without such loops it is empty.
    pub(crate) fn of(mechanism: &Mechanism) -> Self {
        let groups = settling(conditions(&mechanism.tree));
        let most = groups.iter().map(|group| group.rows.len()).max().unwrap_or(0);
        let unknown = vec![f64::NAN; groups.len()];
        Self {
            start: unknown.clone(),
            end: unknown,
            matrix: vec![0.0; most * most],
            groups,
            passes: [false; 2],
        }
    }

    /// Begins a run in the state last evaluated.
    pub(crate) fn begin(&mut self, dynamics: &Dynamics, mechanism: &Mechanism, v: &[f64]) {
        if self.start.first().is_some_and(|start| start.is_nan()) {
            self.holds(dynamics, mechanism, v);
            self.go_on();
        }
    }

    /// Whether the state last projected is on the branch on which the step began.
    pub(crate) fn holds(&mut self, dynamics: &Dynamics, mechanism: &Mechanism, v: &[f64]) -> bool {
        let Self { groups, start, end, passes, matrix } = self;
        if groups.is_empty() {
            return true;
        }
        passes[1] = dynamics.passes_change_point(v, &mechanism.scales);
        for (group, determinant) in groups.iter().zip(&mut *end) {
            *determinant = determinant_of(group, dynamics.closure_rows(), v.len(), matrix);
        }
        passes.contains(&true) || start.iter().zip(end).all(|(start, end)| *start * *end > 0.0)
    }

    /// Begins the next step where the last one ended.
    pub(crate) fn go_on(&mut self) {
        std::mem::swap(&mut self.start, &mut self.end);
        self.passes[0] = self.passes[1];
    }
}

/// The conditions of the loops and couplings of a tree, with the coordinates that they depend on.
fn conditions(tree: &Tree) -> Vec<Group> {
    let closures = tree.closures.iter().enumerate().map(|(index, closure)| {
        let moves =
            |frame: usize, freedom: usize| tree.paths[frame].free.iter().any(|&(_, other)| other == freedom);
        let [a, b] = [closure.a, closure.b].map(|point| point.frame);
        let columns = (0..tree.free.len()).filter(|&k| moves(a, k) != moves(b, k)).collect();
        Group { rows: (CLOSURE_ROWS * index..CLOSURE_ROWS * (index + 1)).collect(), columns }
    });
    let first = CLOSURE_ROWS * tree.closures.len();
    let couplings = (first..).zip(&tree.couplings).map(|(row, coupling)| {
        let ends = coupling.driven.free.iter().chain(&coupling.driver.free);
        let mut columns: Vec<usize> = ends.map(|&(freedom, _)| freedom).collect();
        columns.sort_unstable();
        columns.dedup();
        Group { rows: vec![row], columns }
    });
    closures.chain(couplings).collect()
}

/// The determinant of some rows and columns of a matrix of `width` columns.
fn determinant_of(group: &Group, rows: &[f64], width: usize, matrix: &mut [f64]) -> f64 {
    let n = group.rows.len();
    for (place, row) in group.rows.iter().enumerate() {
        for (k, column) in group.columns.iter().enumerate() {
            matrix[place * n + k] = rows[row * width + column];
        }
    }
    let mut determinant = 1.0;
    for k in 0..n {
        let largest = |best: usize, row: usize| {
            if matrix[row * n + k].abs() > matrix[best * n + k].abs() { row } else { best }
        };
        let pivot_row = (k + 1..n).fold(k, largest);
        if pivot_row != k {
            (k..n).for_each(|column| matrix.swap(pivot_row * n + column, k * n + column));
            determinant = -determinant;
        }
        let pivot = matrix[k * n + k];
        determinant *= pivot;
        if pivot == 0.0 {
            break;
        }
        for row in k + 1..n {
            let factor = matrix[row * n + k] / pivot;
            (k..n).for_each(|column| matrix[row * n + column] -= factor * matrix[k * n + column]);
        }
    }
    determinant
}
