//! Integrals of powers over a run: input of drives and forces, losses in dampers and contacts, and the error
//! of the energy balance; and loads that change unseen in a step. In: steps and the motion; out: work, losses, a warning. Uses `dynamics`,
//! `contact`, `integrators`.

pub(crate) mod balance;
pub(crate) mod inputs;
pub(crate) mod pace;

use serde::{Deserialize, Serialize};

use crate::dynamics::{ContactLoss, Dynamics};

/// Nodes and weights of Gauss's quadrature with four points on [0, 1], of order 8: higher than the order of
/// any dense output.
pub(crate) const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// The same with two points, of order 4.
pub(crate) const GAUSS_OF_SHORT: [(f64, f64); 2] =
    [(0.211_324_865_405_187_1, 0.5), (0.788_675_134_594_812_9, 0.5)];

/// Work and losses since the start of the run.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Work {
    /// Energy at the start [J].
    pub start_energy: f64,
    /// Work of the drives and of the applied forces and torques [J].
    pub input: f64,
    /// Energy dissipated in the dampers [J].
    pub damping: f64,
    /// Losses of every clearance joint, that of friction with the energy that a contact carries along; wear is ∫ F_N |v_T| dt [N m], which Archard's law multiplies
    /// by its coefficient.
    pub contacts: Vec<ContactLoss>,
    /// The wear of every slot by the sectors of its bearing [N m], empty for those that no output asks for; of no slot where
    /// none does. Counts from the start of this run, also where it continues another.
    #[serde(skip)]
    pub sectors: Vec<Vec<f64>>,
    /// Energy dissipated by the friction of every ideal joint that has one [J].
    pub dry_joints: Vec<f64>,
}

impl Work {
    /// Zero work and losses, for `joints` clearance joints and some ideal joints with friction.
    pub fn new(joints: usize, dry_joints: usize) -> Self {
        let contacts = vec![ContactLoss::default(); joints];
        Self { contacts, dry_joints: vec![0.0; dry_joints], ..Self::default() }
    }

    /// Whether it is unknown.
    pub fn is_unknown(&self) -> bool {
        [self.start_energy, self.input, self.damping].iter().all(|of| of.is_nan())
    }

    /// The same, unknown (NaN).
    pub fn unknown(joints: usize, dry_joints: usize) -> Self {
        let loss = ContactLoss { impact: f64::NAN, friction: f64::NAN, wear: f64::NAN };
        Self {
            start_energy: f64::NAN,
            input: f64::NAN,
            damping: f64::NAN,
            contacts: vec![loss; joints],
            sectors: Vec::new(),
            dry_joints: vec![f64::NAN; dry_joints],
        }
    }

    /// Records the energy of the present state as that of the start.
    pub fn begin(&mut self, dynamics: &mut Dynamics) {
        dynamics.find_contacts();
        self.start_energy = dynamics.total_energy();
        for (index, sum) in self.contacts.iter_mut().enumerate() {
            sum.friction = dynamics.carried_energy(index);
        }
    }

    /// Energy dissipated by friction in contacts and joints [J].
    pub fn friction(&self) -> f64 {
        let of_contacts = self.contacts.iter().map(|loss| loss.friction).sum::<f64>();
        of_contacts + self.dry_joints.iter().sum::<f64>()
    }

    /// Energy dissipated in contacts, joints and dampers [J].
    pub fn losses(&self) -> f64 {
        self.contacts.iter().map(|loss| loss.impact + loss.friction).sum::<f64>()
            + self.dry_joints.iter().sum::<f64>()
            + self.damping
    }

    /// Adds the powers of the present state over a time `dt` [s], of which `input` is that of drives and applied
    /// forces [W]; after [`Dynamics::acceleration_and_contacts`].
    pub fn add(&mut self, dynamics: &Dynamics, input: f64, dt: f64) {
        self.input += input * dt;
        self.damping += dynamics.damping_loss() * dt;
        for (index, sum) in self.contacts.iter_mut().enumerate() {
            let loss = dynamics.contact_loss(index);
            sum.impact += loss.impact * dt;
            sum.friction += loss.friction * dt;
            sum.wear += loss.wear * dt;
            if let Some(sectors) = self.sectors.get_mut(index) {
                dynamics.add_wear_by_sector(index, loss.wear * dt, sectors);
            }
        }
        for (index, sum) in self.dry_joints.iter_mut().enumerate() {
            *sum += dynamics.dry_loss(index) * dt;
        }
    }
}
