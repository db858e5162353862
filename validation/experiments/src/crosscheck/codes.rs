//! The codes, and how each is told about the fluid.

use super::Context;
use crate::ExperimentError;
use crate::fluids::{A, RC, RD, WarrenSet};
use psidpd_core::model::ForceLaw;
use psidpd_dynamics::run::State;
use psidpd_lammps_host::export::eam::{self, Grid};
use std::fmt::Write;
use std::path::Path;

/// Who computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Code {
    /// The native runner, in double precision.
    Native,
    /// The native runner in mixed precision.
    NativeMixed,
    /// The plugin's `dpd/psi` with a model file, in double precision.
    Psi,
    /// The same in mixed precision.
    PsiMixed,
    /// The plugin's `mdpd/psi` with the built-in's coefficients.
    MdpdPsi,
    /// LAMMPS's `mdpd`; its law is [`ForceLaw::LucyLammps`] whatever is asked.
    BuiltIn,
    /// LAMMPS's `eam/alloy` with tables of ψ, w and φ, and `dpd/tstat`.
    Eam,
}

impl Code {
    /// For tables and plots.
    pub fn label(self) -> &'static str {
        match self {
            Code::Native => "native",
            Code::NativeMixed => "native, mixed precision",
            Code::Psi => "plugin dpd/psi",
            Code::PsiMixed => "plugin dpd/psi, mixed precision",
            Code::MdpdPsi => "plugin mdpd/psi",
            Code::BuiltIn => "LAMMPS mdpd",
            Code::Eam => "LAMMPS eam/alloy",
        }
    }

    /// For file names.
    pub fn slug(self) -> &'static str {
        match self {
            Code::Native => "native",
            Code::NativeMixed => "native-mixed",
            Code::Psi => "dpd-psi",
            Code::PsiMixed => "dpd-psi-mixed",
            Code::MdpdPsi => "mdpd-psi",
            Code::BuiltIn => "mdpd",
            Code::Eam => "eam",
        }
    }
}

/// What a LAMMPS code is to compute.
#[derive(Debug, Clone, Copy)]
pub struct Setup<'a> {
    /// Who computes.
    pub code: Code,
    /// Which fluid.
    pub set: &'a WarrenSet,
    /// Which force law.
    pub law: ForceLaw,
    /// Friction; 0 leaves drag and noise out.
    pub gamma: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// `newton on`?
    pub newton: bool,
    /// Spacing in r of the tables of [`Code::Eam`].
    pub spacing: f64,
}

/// Spacing of tables for runs: small enough to sit in a cache.
const COARSE: f64 = 5e-5;
/// Spacing of tables for comparing forces. A spline is exact but near the kink of w′ at r_d, where its
/// error is proportional to the spacing.
pub const FINE: f64 = 1e-6;

impl<'a> Setup<'a> {
    /// No drag, no noise, `newton on`.
    pub fn new(code: Code, set: &'a WarrenSet, law: ForceLaw) -> Setup<'a> {
        Setup { code, set, law, gamma: 0.0, seed: 1, newton: true, spacing: COARSE }
    }

    /// Writes data, model or tables into `folder` and returns the commands up to the pair style. Paths
    /// in them are relative to `folder` unless `absolute`.
    pub fn prepare(
        &self,
        context: &Context,
        state: &State,
        folder: &Path,
        absolute: bool,
    ) -> Result<String, ExperimentError> {
        std::fs::create_dir_all(folder).map_err(ExperimentError::io(folder))?;
        let place = |name: &str| {
            if absolute { folder.join(name).display().to_string() } else { name.to_owned() }
        };
        let data = state.to_data("psidpd");
        let atom_style = match self.code {
            Code::BuiltIn => {
                data.write_mdpd(&folder.join("start.data"))?;
                "mdpd"
            }
            _ => {
                data.write(&folder.join("start.data"))?;
                "atomic"
            }
        };
        let mut deck = preamble(atom_style, self.newton, &place("start.data"));
        let (b, gamma, seed) = (self.set.b, self.gamma, self.seed);
        if matches!(self.code, Code::Psi | Code::PsiMixed | Code::MdpdPsi) {
            // Writing to a String cannot fail.
            let _ = writeln!(deck, "plugin load \"{}\"", context.plugin.display());
        }
        let pair = match self.code {
            Code::Native | Code::NativeMixed => String::new(),
            Code::Psi | Code::PsiMixed => {
                let precision = if self.code == Code::Psi { "double" } else { "mixed" };
                let text = self.set.model_text(self.law, gamma)?;
                let path = folder.join("model.toml");
                std::fs::write(&path, text).map_err(ExperimentError::io(&path))?;
                format!(
                    "pair_style dpd/psi 1.0 {seed} precision {precision}\npair_coeff * * \"{}\" F\n",
                    place("model.toml")
                )
            }
            Code::MdpdPsi => {
                let law = if self.law == ForceLaw::LucyLammps { " law lucy" } else { "" };
                format!(
                    "pair_style mdpd/psi 1.0 {RC} {seed}{law}\npair_coeff 1 1 {A} {b} {gamma} {RC} {RD}\n"
                )
            }
            Code::BuiltIn => format!(
                "pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 {RC} {seed}\n\
                 pair_coeff 1 1 mdpd/rhosum {RD}\npair_coeff 1 1 mdpd {A} {b} {gamma} {RC} {RD}\n"
            ),
            Code::Eam => {
                write_tables(self.set, self.spacing, &folder.join("fluid.eam.alloy"))?;
                let table = place("fluid.eam.alloy");
                if gamma > 0.0 {
                    format!(
                        "pair_style hybrid/overlay eam/alloy dpd/tstat 1.0 1.0 {RC} {seed}\n\
                         pair_coeff * * eam/alloy \"{table}\" F\npair_coeff 1 1 dpd/tstat {gamma}\n"
                    )
                } else {
                    format!("pair_style eam/alloy\npair_coeff * * \"{table}\" F\n")
                }
            }
        };
        deck.push_str(&pair);
        Ok(deck)
    }
}

/// The commands up to the pair style.
pub(super) fn preamble(atom_style: &str, newton: bool, data: &str) -> String {
    let newton = if newton { "on" } else { "off" };
    format!(
        "units lj\natom_style {atom_style}\natom_modify map array\nnewton {newton}\ncomm_modify vel yes\n\
         read_data \"{data}\"\nneighbor 0.3 bin\nneigh_modify delay 0 every 1 check yes\n"
    )
}

/// ψ as embedding function, w as density and φ as pair potential of `eam/alloy`: LAMMPS's own route to
/// the same conservative forces.
fn write_tables(set: &WarrenSet, spacing: f64, path: &Path) -> Result<(), ExperimentError> {
    let fluid = set.model(ForceLaw::Conservative, 0.0)?.at(1.0)?;
    let grid = Grid { spacing, largest_density: 60.0, densities: 6001 };
    Ok(eam::write(&fluid, &[1.0], grid, path)?)
}
