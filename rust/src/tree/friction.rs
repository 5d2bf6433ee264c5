//! Ideal joints with friction, and the tree that finds their reactions.
//!
//! A tree has no reactions: its coordinates satisfy the joints. Where friction needs them, another tree of the same scene
//! gives every such joint two more coordinates, by which it would come apart, and multipliers that hold them at zero: these
//! are the reaction, with its exact derivatives. The multipliers of a cut joint are those of its closure.

use crate::contact::friction::JointFriction;
use crate::error::InputError;
use crate::scene::parts::{Joint, Scene};
use crate::tree::elements::{CLOSURE_ROWS, IdealJoint, IdealKind, Realization, Tree};

/// An ideal joint with friction.
#[derive(Clone, Debug, PartialEq)]
pub struct DryJoint {
    /// Index among the ideal joints.
    pub joint: usize,
    /// Its friction.
    pub law: JointFriction,
    /// Columns whose coordinates, times these factors, add up to the angle or displacement of the second body relative to
    /// the first, on which friction acts.
    pub columns: Vec<(usize, f64)>,
    /// Those of them that drives move.
    pub driven: Vec<(usize, f64)>,
    /// The same for the degrees of freedom, and for those of the tree with reactions.
    pub free: Vec<(usize, f64)>,
    /// See there.
    pub reacting: Vec<(usize, f64)>,
    /// The multipliers that are its reaction.
    pub rows: [usize; 2],
}

/// The tree with reactions.
#[derive(Clone, Debug)]
pub struct Reacting {
    /// It, without friction.
    pub tree: Tree,
    /// Its degree of freedom of every degree of freedom, and its column of every column.
    pub freedoms: Vec<usize>,
    /// See there.
    pub columns: Vec<usize>,
}

impl Tree {
    /// Adds the friction in the ideal joints of a checked scene to its complete tree.
    pub(crate) fn add_friction(&mut self, scene: &Scene) -> Result<(), InputError> {
        let has_friction = |joint: &Joint| matches!(joint, Joint::Ideal { friction: Some(_), .. });
        if !scene.joints.iter().any(has_friction) {
            return Ok(());
        }
        let mut tree = Tree::span_with(scene, &self.components, Some(Vec::new()))?;
        let with_play = tree.backlashes.iter_mut().map(|backlash| &mut backlash.coupling);
        for (coupling, (known, _)) in tree.couplings.iter_mut().chain(with_play).zip(self.all_couplings()) {
            coupling.offset = known.offset;
        }
        // The locks in the order of their joints in the tree.
        let mut locks = (tree.closed_rows().sum::<usize>() - tree.locks.len()..).step_by(2);
        let mut rows = vec![[0; 2]; self.ideal_joints.len()];
        let laws: Vec<(usize, JointFriction)> = scene
            .joints
            .iter()
            .filter_map(|joint| {
                let Joint::Ideal { name, friction: Some(law), .. } = joint else { return None };
                Some((self.ideal_joints.iter().position(|other| other.name == *name)?, *law))
            })
            .collect();
        for &joint in self.tree_joints.iter().filter(|&joint| laws.iter().any(|(other, _)| other == joint)) {
            let first = locks.next().unwrap_or_default();
            let IdealJoint { kind, realization, .. } = &self.ideal_joints[joint];
            // A guide that the tree passes backwards turns before it comes apart.
            let turns_first = *kind == IdealKind::Prismatic
                && matches!(realization, Realization::Tree { sign, .. } if *sign < 0.0);
            rows[joint] = if turns_first { [first + 1, first] } else { [first, first + 1] };
        }
        for &(joint, law) in &laws {
            if let Realization::Cut(closure) = self.ideal_joints[joint].realization {
                rows[joint] = [CLOSURE_ROWS * closure, CLOSURE_ROWS * closure + 1];
            }
            let of = |tree: &Tree| nonzero(tree.slide_of(&tree.ideal_joints[joint]));
            let (columns, in_other) = (of(self), of(&tree));
            let (free, reacting) = (freedoms(&self.free, &columns), freedoms(&tree.free, &in_other));
            let driven = columns.iter().copied().filter(|(column, _)| !self.free.contains(column)).collect();
            let rows = rows[joint];
            self.dry_joints.push(DryJoint { joint, law, columns, driven, free, reacting, rows });
        }
        let columns: Vec<usize> =
            (0..tree.frames.len() - 1).filter(|column| !tree.locks.contains(column)).collect();
        let freedom = |column: &usize| tree.free.binary_search(&columns[*column]).unwrap_or_default();
        let freedoms = self.free.iter().map(freedom).collect();
        self.reacting = Some(Box::new(Reacting { tree, freedoms, columns }));
        Ok(())
    }

    /// Name of a joint with friction.
    pub fn dry_joint_name(&self, index: usize) -> &str {
        &self.ideal_joints[self.dry_joints[index].joint].name
    }

    /// Factors of all columns in the angle or displacement of the second body of a joint relative to the first.
    fn slide_of(&self, joint: &IdealJoint) -> Vec<f64> {
        match joint.realization {
            Realization::Tree { column: Some(column), .. } if joint.kind == IdealKind::Prismatic => {
                let mut columns = vec![0.0; self.frames.len() - 1];
                columns[column] = 1.0;
                columns
            }
            _ => self.relative_angle(joint.bodies).0,
        }
    }
}

fn nonzero(factors: Vec<f64>) -> Vec<(usize, f64)> {
    factors.into_iter().enumerate().filter(|(_, factor)| *factor != 0.0).collect()
}

/// Degrees of freedom in place of columns, of which the others are driven.
fn freedoms(free: &[usize], columns: &[(usize, f64)]) -> Vec<(usize, f64)> {
    let freedom = |&(column, factor): &(usize, f64)| Some((free.binary_search(&column).ok()?, factor));
    columns.iter().filter_map(freedom).collect()
}
