use super::cost::Cost;
use super::timestep::{StepEstimate, UnknownStep};
use super::viscosity::Flow;
use psidpd_core::theory::Stability;
use serde::Serialize;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Findings {
    pub title: String,
    pub reference: Option<String>,
    pub plan: String,
    pub kt: f64,
    pub densities: Option<Vec<f64>>,
    pub pressure: Option<f64>,
    /// Mean-field `∂p/∂ρ` at fixed composition.
    pub pressure_slope: Option<f64>,
    pub stability: Option<Waves>,
    /// Time steps of a scene and their errors; estimates, and none for a model alone.
    pub steps: Vec<StepEstimate>,
    /// Time steps of which nothing can be said.
    pub unknown_steps: Vec<UnknownStep>,
    /// What phases are expected, and where mean field fails.
    pub theory: Vec<String>,
    /// What a scene takes on this machine; none for a model alone.
    pub cost: Option<Cost>,
    /// Viscosity and diffusion, if they are those of a measured fluid.
    pub flow: Option<Flow>,
    /// What cannot work, or may surprise.
    pub warnings: Vec<Warning>,
}

/// Stability against waves of density and composition.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Waves {
    /// Stable at every wave number.
    pub stable: bool,
    pub spinodal: bool,
    /// Where `S(k)⁻¹` is smallest, if not at 0.
    pub k_star: Option<f64>,
    pub min_inverse_s: f64,
}

impl From<Stability> for Waves {
    fn from(s: Stability) -> Waves {
        Waves { stable: s.stable, spinodal: s.spinodal, k_star: s.k_star, min_inverse_s: s.min_inverse_s }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    Note,
    Warning,
    Error,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Warning {
    /// A short name that does not change.
    pub id: &'static str,
    pub severity: Severity,
    pub message: String,
}

impl Findings {
    /// Adds warnings at other densities of the species, unless they are known.
    pub fn add_at(&mut self, names: &[String], densities: &[f64], other: Vec<Warning>) {
        let place: Vec<String> =
            names.iter().zip(densities).map(|(name, rho)| format!("{name} {rho:.4}")).collect();
        for warning in other.into_iter().filter(|w| w.severity >= Severity::Warning) {
            if !self.warnings.iter().any(|w| w.id == warning.id && w.message.ends_with(&warning.message)) {
                let message = format!("at densities {}: {}", place.join(", "), warning.message);
                self.warnings.push(Warning { message, ..warning });
            }
        }
        self.warnings.sort_by_key(|w| std::cmp::Reverse(w.severity));
    }

    /// Whether the model can work at all.
    pub fn works(&self) -> bool {
        self.warnings.iter().all(|w| w.severity < Severity::Error)
    }
}
