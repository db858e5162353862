//! Engines that are wrong on purpose.

/// A term of the sweep that is 5 % too strong: for tests that the checks of a validation can fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Forces of soft pair potentials.
    PairForce,
    /// Forces by ψ.
    ManyBodyForce,
    /// γ in the forces.
    Drag,
    /// σ in the forces.
    Noise,
    /// The virial of all forces.
    Virial,
}

impl Fault {
    /// All of them.
    pub const ALL: [Fault; 5] =
        [Fault::PairForce, Fault::ManyBodyForce, Fault::Drag, Fault::Noise, Fault::Virial];

    /// What to multiply `term` by in an engine that has the fault `in_it`.
    pub(super) fn factor(term: Fault, in_it: Option<Fault>) -> f64 {
        if in_it == Some(term) { 1.05 } else { 1.0 }
    }
}
