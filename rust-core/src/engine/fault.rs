//! Engines with deliberate faults, for tests.

/// A term of the sweep that is 5 % too strong: for tests that the checks of a validation can fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Forces of soft pair potentials.
    PairForce,
    /// Many-body forces, which derive from ψ.
    ManyBodyForce,
    /// Drag coefficient γ of the forces.
    Drag,
    /// Noise amplitude σ of the forces.
    Noise,
    /// The virial of all forces.
    Virial,
}

impl Fault {
    /// The list of all faults.
    pub const ALL: [Fault; 5] =
        [Fault::PairForce, Fault::ManyBodyForce, Fault::Drag, Fault::Noise, Fault::Virial];

    /// The factor of `term` in an engine with the fault `in_it`.
    pub(super) fn factor(term: Fault, in_it: Option<Fault>) -> f64 {
        if in_it == Some(term) { 1.05 } else { 1.0 }
    }
}
