//! The codes, and how each is told about the fluid.

use super::Context;
use crate::ExperimentError;
use crate::fluids::{RC, WarrenSet};
use crate::lammps::deck::Deck;
use crate::lammps::style::{GRID, PairStyle};
use psidpd_core::model::ForceLaw;
use psidpd_dynamics::run::State;
use psidpd_lammps_host::export::eam::{self, Grid};
use std::path::Path;

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
    pub code: Code,
    pub set: &'a WarrenSet,
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

/// Spacing of tables for comparing forces. A spline is exact but near the kink of w′ at r_d, where its
/// error is proportional to the spacing.
pub const FINE: f64 = 1e-6;

impl<'a> Setup<'a> {
    /// No drag, no noise, `newton on`.
    pub fn new(code: Code, set: &'a WarrenSet, law: ForceLaw) -> Setup<'a> {
        Setup { code, set, law, gamma: 0.0, seed: 1, newton: true, spacing: GRID.spacing }
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
        let gamma = self.gamma;
        let pair = self.set.pair(gamma);
        let species = "F".to_owned();
        let style = match self.code {
            Code::Native | Code::NativeMixed => return Ok(String::new()),
            Code::Psi | Code::PsiMixed => {
                let precision = if self.code == Code::Psi { "double" } else { "mixed" };
                let text = self.set.model_text(self.law, gamma)?;
                let path = folder.join("model.toml");
                std::fs::write(&path, text).map_err(ExperimentError::io(&path))?;
                PairStyle::Psi {
                    model: place("model.toml"),
                    species,
                    words: format!("precision {precision}"),
                }
            }
            Code::MdpdPsi => PairStyle::MdpdPsi { pair, law: self.law },
            Code::BuiltIn => PairStyle::Mdpd(pair),
            Code::Eam => {
                // ψ as embedding function, w as density and φ as pair potential: LAMMPS's own route to the same
                // conservative forces.
                let fluid = self.set.model(ForceLaw::Conservative, 0.0)?.at(1.0)?;
                let grid = Grid { spacing: self.spacing, ..GRID };
                eam::write(&fluid, &[1.0], grid, &folder.join("fluid.eam.alloy"))?;
                let thermostat = (gamma > 0.0).then_some([gamma, RC]);
                PairStyle::Eam { tables: place("fluid.eam.alloy"), species, thermostat }
            }
        };
        let (data, path) = (state.to_data("psidpd"), folder.join("start.data"));
        if self.code == Code::BuiltIn {
            data.write_mdpd(&path)?
        } else {
            data.write(&path)?
        }
        let (plugin, newton) = (context.lammps.plugin.as_deref(), self.newton);
        Ok(Deck { plugin, newton, ..Deck::new(&style, self.seed, place("start.data")) }.text())
    }
}
