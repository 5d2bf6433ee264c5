//! Couplings at the start: driven coordinates follow their drivers in the initial guess, and what cannot move is refused.

use crate::numerics::accuracy::SINGULAR;
use nalgebra::{DMatrix, RowDVector};

use crate::dynamics::Dynamics;
use crate::error::{InputError, Subject};
use crate::mechanism::assembly::free_directions;
use crate::mechanism::conditions::{Conditions, Level};
use crate::numerics::turns::wrap;
use crate::tree::elements::Coupling;
use crate::tree::kinematics::FrameKind;

/// Lets driven coordinates follow their drivers in an initial guess, where couplings say how.
pub(super) fn follow_drivers(dynamics: &mut Dynamics, conditions: &Conditions, guess: &mut [f64]) {
    let at_rest = vec![0.0; guess.len()];
    for coupling in conditions.couplings(dynamics.tree, Level::Position) {
        dynamics.move_to(0.0, guess, &at_rest);
        let drives = |freedom: usize| coupling.driver.free.iter().any(|&(other, _)| other == freedom);
        let Some(&(freedom, factor)) = coupling.driven.free.iter().rfind(|(freedom, _)| !drives(*freedom))
        else {
            continue;
        };
        guess[freedom] -= dynamics.coupling_motion(coupling).gap / factor;
    }
}

/// What is added in every coupling as the pose last moved to has it [rad or m]. With backlash it is what is given, but for
/// full turns; if nothing is, the start is in the middle of the play.
pub(super) fn offsets(dynamics: &Dynamics) -> Vec<f64> {
    let offset = |(index, (coupling, _)): (usize, (&Coupling, _))| {
        let gap = dynamics.coupling_motion(coupling).gap;
        let from_middle = match coupling.offset {
            Some(_) if index < dynamics.tree.couplings.len() => 0.0,
            Some(_) if coupling.driven.slide.is_some() => gap,
            Some(_) => wrap(gap).0,
            None => 0.0,
        };
        gap - from_middle + coupling.offset.unwrap_or(0.0)
    };
    dynamics.tree.all_couplings().enumerate().map(offset).collect()
}

/// Checks that the law of every coupling has a finite value and slope in the pose last moved to.
pub(super) fn check_laws(dynamics: &Dynamics) -> Result<(), InputError> {
    for coupling in &dynamics.tree.couplings {
        let slopes = dynamics.coupling_columns(coupling);
        if !slopes.iter().chain(&[dynamics.coupling_motion(coupling).gap]).all(|number| number.is_finite()) {
            let message = format!("coupling {:?} has no finite value and slope at the start", coupling.name);
            return Err(Subject::Scene.error(format!("couplings[{}].law", coupling.index), message));
        }
    }
    Ok(())
}

// Long because every way to be wrong has its words.
/// Checks that every coupling ties two coordinates that can move, adds an independent equation and locks nothing, in the
/// pose last moved to.
pub(super) fn check_couplings(dynamics: &Dynamics, length: f64) -> Result<(), InputError> {
    check_laws(dynamics)?;
    let tree = dynamics.tree;
    let count = tree.frames.len() - 1;
    let unit = length.log2().ceil().exp2();
    let row = |columns: &[f64], unit_of_row: f64| {
        let scaled = columns.iter().zip(&tree.frames[1..]).map(|(by, frame)| match frame.kind {
            FrameKind::Revolute => by / unit_of_row,
            FrameKind::Prismatic { .. } => by * unit / unit_of_row,
        });
        RowDVector::from_iterator(count, scaled)
    };
    let mut rows = Vec::new();
    for closure in &tree.closures {
        let columns = dynamics.gap_columns([closure.a, closure.b]);
        rows.extend([0, 1].map(|axis| row(&columns.iter().map(|by| by[axis]).collect::<Vec<f64>>(), unit)));
    }
    for (place, (coupling, _)) in tree.all_couplings().enumerate() {
        let refuse = |field: &str, message: &str| {
            let about = format!("coupling {:?} {message}", coupling.name);
            Err(Subject::Scene.error(format!("couplings[{}]{field}", coupling.index), about))
        };
        let ends = [&coupling.driven, &coupling.driver];
        for (field, end) in [".driven", ".driver"].into_iter().zip(ends) {
            if end.columns.is_empty() {
                return refuse(
                    field,
                    "has a coordinate that never changes: joints hold the two bodies together",
                );
            }
        }
        if place >= tree.couplings.len() {
            // With backlash it ties nothing.
            continue;
        }
        let own = dynamics.coupling_columns(coupling);
        // What drives prescribe counts as movable here: they may move a coupling from either side.
        let can_move = |rows: &[RowDVector<f64>]| {
            let free = match rows {
                [] => DMatrix::identity(count, count),
                _ => free_directions(DMatrix::from_rows(rows)),
            };
            ends.map(|end| {
                let mut columns = vec![0.0; count];
                end.columns.iter().for_each(|&(column, by)| columns[column] = by);
                let direction = row(&columns, 1.0);
                (&direction * &free).norm() > SINGULAR * direction.norm()
            })
        };
        let rank = |rows: &[RowDVector<f64>]| match rows {
            [] => 0,
            _ if tree.free.is_empty() => 0,
            _ => {
                let part = DMatrix::from_rows(rows).select_columns(&tree.free);
                let cutoff = SINGULAR * part.amax();
                part.rank(cutoff)
            }
        };
        let (before, rank_before) = (can_move(&rows), rank(&rows));
        rows.push(row(&own, if coupling.driven.slide.is_some() { unit } else { 1.0 }));
        if before == [true, true] && can_move(&rows) == [false, false] {
            return refuse("", "locks what it ties: joints and other couplings tie it in another ratio");
        }
        if rank(&rows) == rank_before {
            return refuse(
                "",
                "ties what joints, drives and other couplings tie already, in the assembled configuration: it is \
                 redundant (remove it), or drives act against it, or it drives a cam from a dwell",
            );
        }
    }
    Ok(())
}
