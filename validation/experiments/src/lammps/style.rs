//! Pair styles of LAMMPS, of the plugin and its own, with their coefficients.

use psidpd_core::model::{ForceLaw, WarrenPair};
use psidpd_lammps_host::export::eam::Grid;

#[derive(Debug, Clone, PartialEq)]
pub enum PairStyle {
    /// The plugin's `dpd/psi` with a model file and words behind the seed.
    Psi { model: String, species: String, words: String },
    /// The plugin's `mdpd/psi` with the coefficients of `mdpd`.
    MdpdPsi { pair: WarrenPair, law: ForceLaw },
    /// LAMMPS's `mdpd/rhosum` and `mdpd`, whose law is [`ForceLaw::LucyLammps`].
    Mdpd(WarrenPair),
    /// LAMMPS's `eam/alloy` with tables, and `dpd/tstat` with a friction and a range.
    Eam { tables: String, species: String, thermostat: Option<[f64; 2]> },
    /// LAMMPS's `dpd`: repulsion, friction and range.
    Dpd { a: f64, gamma: f64, rc: f64 },
}

/// Tables for runs: small enough to sit in a cache.
pub const GRID: Grid = Grid { spacing: 5e-5, largest_density: 60.0, densities: 6001 };

impl PairStyle {
    pub fn atom_style(&self) -> &'static str {
        if let PairStyle::Mdpd(_) = self { "mdpd" } else { "atomic" }
    }

    pub fn is_of_the_plugin(&self) -> bool {
        matches!(self, PairStyle::Psi { .. } | PairStyle::MdpdPsi { .. })
    }

    pub fn commands(&self, kt: f64, seed: u64) -> String {
        let warren = |p: &WarrenPair| format!("{:?} {:?} {:?} {:?} {:?}", p.a, p.b, p.gamma, p.rc, p.rd);
        match self {
            PairStyle::Psi { model, species, words } => {
                format!("pair_style dpd/psi {kt:?} {seed} {words}\npair_coeff * * \"{model}\" {species}\n")
            }
            PairStyle::MdpdPsi { pair, law } => {
                let law = if *law == ForceLaw::LucyLammps { " law lucy" } else { "" };
                format!(
                    "pair_style mdpd/psi {kt:?} {:?} {seed}{law}\npair_coeff 1 1 {}\n",
                    pair.rc,
                    warren(pair)
                )
            }
            PairStyle::Mdpd(pair) => format!(
                "pair_style hybrid/overlay mdpd/rhosum mdpd {kt:?} {:?} {seed}\n\
                 pair_coeff 1 1 mdpd/rhosum {:?}\npair_coeff 1 1 mdpd {}\n",
                pair.rc,
                pair.rd,
                warren(pair)
            ),
            PairStyle::Eam { tables, species, thermostat: Some([gamma, range]) } => format!(
                "pair_style hybrid/overlay eam/alloy dpd/tstat {kt:?} {kt:?} {range:?} {seed}\n\
                 pair_coeff * * eam/alloy \"{tables}\" {species}\npair_coeff 1 1 dpd/tstat {gamma:?}\n"
            ),
            PairStyle::Eam { tables, species, thermostat: None } => {
                format!("pair_style eam/alloy\npair_coeff * * \"{tables}\" {species}\n")
            }
            PairStyle::Dpd { a, gamma, rc } => {
                format!("pair_style dpd {kt:?} {rc:?} {seed}\npair_coeff 1 1 {a:?} {gamma:?}\n")
            }
        }
    }
}
