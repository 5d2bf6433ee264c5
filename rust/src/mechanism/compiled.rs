//! The compiled mechanism: a tree of frames, its assembled start, and the scales for error control.

use std::ops::Deref;

use crate::error::{InputError, Notice};
use crate::mechanism::assembly::{Assembled, assembled_tree};
use crate::mechanism::balance::warning_of_equilibrium;
use crate::mechanism::springs::warnings_of_springs;
use crate::scene::parts::Scene;
use crate::tree::elements::{Scales, State, Tree};

/// A compiled scene.
#[derive(Clone, Debug)]
pub struct Mechanism {
    /// Bodies, joints and forces.
    pub tree: Tree,
    /// Assembled start: every clearance joint concentric in position and velocity.
    pub start: State,
    /// Scales for error control.
    pub scales: Scales,
    /// Signs that tell on which branch it is assembled.
    pub branch: Vec<i8>,
    /// Numbers and units of the scene that look wrong, and what of its start may not be meant.
    pub warnings: Vec<Notice>,
}

impl Mechanism {
    /// Compiles a scene: checks it, spans the tree, assembles the start.
    ///
    /// # Errors
    /// Every problem of [`Scene::check`]; otherwise bodies that are not connected, a structure, loops
    /// that prescribe more than can move, or a mechanism that cannot be assembled.
    pub fn compile(scene: &Scene) -> Result<Mechanism, InputError> {
        Self::compile_on(scene, &[])
    }

    /// The same, on a branch that is preferred where two are about equally near to the given angles.
    ///
    /// # Errors
    /// Those of [`Mechanism::compile`].
    pub fn compile_on(scene: &Scene, preferred: &[i8]) -> Result<Mechanism, InputError> {
        scene.check()?;
        let (mut tree, assembled) = assembled_tree(scene, preferred)?;
        let Assembled { start, scales, branch, offsets, warnings: told } = assembled;
        let with_play = tree.backlashes.iter_mut().map(|backlash| &mut backlash.coupling);
        for (coupling, offset) in tree.couplings.iter_mut().chain(with_play).zip(offsets) {
            coupling.offset = Some(offset);
        }
        for (slot, scales) in tree.slots.iter_mut().zip(&scales.contacts) {
            slot.law.normal.fit(scales.resting_penetration);
        }
        let mut warnings = scene.implausible();
        warnings.extend(told);
        warnings.extend(warnings_of_springs(&tree, &start, scene));
        warnings.extend(warning_of_equilibrium(&tree, &start, &scales, scene));
        tree.add_friction(scene)?;
        Ok(Mechanism { tree, start, scales, branch, warnings })
    }

    /// The mechanism for runs of a relative tolerance, which step over the points of tables that are smooth enough; `None`
    /// if that is this one.
    pub(crate) fn for_tolerance(&self, rtol: f64) -> Option<Mechanism> {
        let mut other = None;
        for (index, load) in self.motion_loads.iter().enumerate() {
            if let Some(tape) = load.tape.for_tolerance(rtol) {
                other.get_or_insert_with(|| self.clone()).tree.motion_loads[index].tape = tape;
            }
        }
        other
    }

    /// Kinetic energy at the speeds of the components [J]. Energies are differences of terms of this size, whatever of it
    /// is exchanged.
    pub(crate) fn energy_scale(&self) -> f64 {
        let components = self.scales.components.iter().enumerate();
        components.map(|(index, of)| 0.5 * self.tree.total_mass(index) * of.speed * of.speed).sum()
    }
}

/// Bodies, joints and forces of a mechanism are those of its tree.
impl Deref for Mechanism {
    type Target = Tree;

    fn deref(&self) -> &Tree {
        &self.tree
    }
}
