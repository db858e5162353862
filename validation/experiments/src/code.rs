//! The codes that run a fluid, and what their pair styles are told of it.

use crate::fluids::DPD_PAIR;
use crate::lammps::style::PairStyle;
use psidpd_core::model::{ForceLaw, WarrenPair};
use serde::Serialize;

/// The program that makes the steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Host {
    Native,
    /// A pair style of the plugin in LAMMPS, which makes the native steps.
    Plugin,
    /// A pair style of LAMMPS's own.
    Lammps,
}

impl Host {
    pub fn name(self) -> &'static str {
        match self {
            Host::Native => "native",
            Host::Plugin => "plugin",
            Host::Lammps => "lammps",
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Code {
    Native,
    /// The native runner with the sums over pairs one by one.
    PairSums,
    /// The plugin's `dpd/psi` with a model file.
    Psi,
    /// The plugin's `mdpd/psi` with the coefficients of `mdpd`.
    MdpdPsi,
    /// LAMMPS's `mdpd/rhosum` and `mdpd`; its law is [`ForceLaw::LucyLammps`] whatever is asked.
    Mdpd,
    /// LAMMPS's `eam/alloy` with tables of ψ, w and φ, and `dpd/tstat`.
    Eam,
    /// LAMMPS's `dpd`, or an accelerated version of it.
    Dpd(Suffix),
}

/// Accelerated versions of LAMMPS's `dpd`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Suffix {
    None,
    /// `dpd/omp` on one thread.
    Omp,
    /// `dpd/intel` on one thread, in its mixed precision.
    Intel,
}

impl Suffix {
    pub const ALL: [Suffix; 3] = [Suffix::None, Suffix::Omp, Suffix::Intel];

    pub fn style(self) -> &'static str {
        match self {
            Suffix::None => "dpd",
            Suffix::Omp => "dpd/omp",
            Suffix::Intel => "dpd/intel",
        }
    }
}

/// What pair styles are told of a fluid; each takes what it needs.
#[derive(Debug, Clone)]
pub struct Told {
    pub model: String,
    pub tables: String,
    /// Names of the species, as `pair_coeff` wants them.
    pub species: String,
    /// The coefficients of `mdpd`. Without friction `eam/alloy` runs without `dpd/tstat`.
    pub pair: WarrenPair,
    pub law: ForceLaw,
    /// Words behind the seed of `dpd/psi`.
    pub words: String,
}

impl Code {
    pub fn host(self) -> Host {
        match self {
            Code::Native | Code::PairSums => Host::Native,
            Code::Psi | Code::MdpdPsi => Host::Plugin,
            Code::Mdpd | Code::Eam | Code::Dpd(_) => Host::Lammps,
        }
    }

    pub fn label(self) -> String {
        match self {
            Code::Native => "native".into(),
            Code::PairSums => "native plain".into(),
            Code::Psi => "plugin dpd/psi".into(),
            Code::MdpdPsi => "plugin mdpd/psi".into(),
            Code::Mdpd => "LAMMPS mdpd".into(),
            Code::Eam => "LAMMPS eam/alloy".into(),
            Code::Dpd(suffix) => format!("LAMMPS {}", suffix.style()),
        }
    }

    pub fn style(self, told: Told) -> Option<PairStyle> {
        let Told { model, tables, species, pair, law, words } = told;
        Some(match self {
            Code::Native | Code::PairSums => return None,
            Code::Psi => PairStyle::Psi { model, species, words },
            Code::MdpdPsi => PairStyle::MdpdPsi { pair, law },
            Code::Mdpd => PairStyle::Mdpd(pair),
            Code::Eam => {
                let thermostat = (pair.gamma > 0.0).then_some([pair.gamma, pair.rc]);
                PairStyle::Eam { tables, species, thermostat }
            }
            Code::Dpd(_) => DPD_PAIR,
        })
    }
}
