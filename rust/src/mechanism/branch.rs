//! The branch on which a mechanism is assembled: which of the ways to close its loops.

use crate::numerics::accuracy::SINGULAR;
use nalgebra::DMatrix;

/// Conditions of the assembly and the coordinates that they depend on.
#[derive(Clone, Debug)]
pub(crate) struct Group {
    /// Rows of the Jacobian.
    pub(crate) rows: Vec<usize>,
    /// Its columns, whether their entries vanish in this pose or not.
    pub(crate) columns: Vec<usize>,
}

/// The sign of the Jacobian's determinant of every group of conditions that settles as many coordinates as it has
/// rows, 0 where it nearly vanishes.
///
/// Such a determinant vanishes only where two ways to close the loops meet, so that mechanisms that can be turned into
/// each other without passing there have the same signs. Pairs of links (dyads) are split off one after the other;
/// what then remains is one group. Dyads have two ways to close, which their sign tells apart; larger groups can have
/// more than two. Conditions that leave coordinates free have no sign.
pub(crate) fn branch(jacobian: &DMatrix<f64>, groups: Vec<Group>) -> Vec<i8> {
    settling(groups).iter().map(|group| sign(jacobian, group)).collect()
}

/// The groups that settle as many coordinates as they have rows, once those before them have settled theirs.
pub(crate) fn settling(mut groups: Vec<Group>) -> Vec<Group> {
    let mut settled: Vec<Group> = Vec::new();
    while let Some(index) = groups.iter().position(|group| group.columns.len() == group.rows.len()) {
        let group = groups.remove(index);
        for other in &mut groups {
            other.columns.retain(|column| !group.columns.contains(column));
        }
        settled.push(group);
    }
    let rows: Vec<usize> = groups.iter().flat_map(|group| group.rows.iter().copied()).collect();
    let mut columns: Vec<usize> = groups.iter().flat_map(|group| group.columns.iter().copied()).collect();
    columns.sort_unstable();
    columns.dedup();
    if !rows.is_empty() && rows.len() == columns.len() {
        settled.push(Group { rows, columns });
    }
    settled
}

fn sign(jacobian: &DMatrix<f64>, group: &Group) -> i8 {
    let part = DMatrix::from_fn(group.rows.len(), group.columns.len(), |row, column| {
        jacobian[(group.rows[row], group.columns[column])]
    });
    let largest: f64 = part.row_iter().map(|row| row.norm()).product();
    let relative = part.determinant() / largest;
    if relative > SINGULAR {
        1
    } else if relative < -SINGULAR {
        -1
    } else {
        0
    }
}

/// Whether two mechanisms with the same conditions are known to be assembled on different branches.
pub fn differs(one: &[i8], other: &[i8]) -> bool {
    one.len() == other.len() && one.iter().zip(other).any(|(one, other)| one * other < 0)
}
