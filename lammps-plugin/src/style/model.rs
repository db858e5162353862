//! The model of a style: a file, or the coefficients of `pair_coeff`.

use super::{Style, guard};
use crate::error::StyleError;
use crate::units::Scale;
use psidpd_core::model::{
    ForceLaw, Model, PresetError, SplinePair, WarrenPair, lucy_mdpd, spline_dpd, warren_ab,
};

/// Coefficients of those types that have any, in the form that presets take.
struct Members<T> {
    /// The types, from 0; other types belong to another style of a hybrid.
    types: Vec<usize>,
    /// Species names of the types.
    species: Vec<String>,
    /// A row-major table over the types; only the upper triangle is read.
    pairs: Vec<Option<T>>,
}

impl<T: Copy> Members<T> {
    fn new(pairs: &[Option<T>], types: usize) -> Result<Members<T>, StyleError> {
        if types.checked_mul(types) != Some(pairs.len()) {
            return Err(PresetError::Shape.into());
        }
        let given = |a: usize, b: usize| pairs[a.min(b) * types + a.max(b)].is_some();
        let members: Vec<usize> = (0..types).filter(|a| (0..types).any(|b| given(*a, b))).collect();
        let row = |a: &usize| a * types;
        Ok(Members {
            species: members.iter().copied().map(name_of_type).collect(),
            pairs: members.iter().flat_map(|a| members.iter().map(|b| pairs[row(a) + b])).collect(),
            types: members,
        })
    }

    /// Converts an error of a preset, which counts species, to one that counts types.
    fn error(&self, error: PresetError) -> StyleError {
        let PresetError::Missing(i, j) = error else { return error.into() };
        PresetError::Missing(self.types[i - 1] + 1, self.types[j - 1] + 1).into()
    }
}

fn name_of_type(index: usize) -> String {
    format!("T{}", index + 1)
}

impl Style {
    /// Reads the text of a model file for a simulation in LAMMPS's units `units`, in which kT is given; `source` is its path.
    /// `names` has the species of each LAMMPS type, in order, or `NULL` for types that another style of a hybrid computes.
    pub fn from_text(
        source: &str,
        text: &str,
        units: &str,
        kt: f64,
        names: &[String],
        dimensions: usize,
    ) -> Result<Style, StyleError> {
        guard(|| {
            let model = Model::parse(source, text)?;
            let scale = Scale::new(units, model.units)
                .map_err(|text| StyleError(format!("{}: {text}", model.source().name())))?;
            Ok(Style { scale, ..Style::new(model, kt / scale.energy, names, dimensions)? })
        })
    }

    /// Warren's A/B model with the coefficients of LAMMPS's `mdpd`; `pairs` is a row-major table over
    /// types, of which the upper triangle is read.
    ///
    /// With `masses`, one for each type, the force law is that of LAMMPS's `mdpd`, whose densities are weighed
    /// by them and which has no potential.
    pub fn from_coefficients(
        kt: f64,
        pairs: &[Option<WarrenPair>],
        types: usize,
        dimensions: usize,
        masses: Option<&[f64]>,
    ) -> Result<Style, StyleError> {
        guard(|| {
            let members = Members::new(pairs, types)?;
            let Members { species, pairs, .. } = &members;
            let (model, letters) = match masses {
                None => (
                    warren_ab(species, pairs, dimensions, ForceLaw::Conservative),
                    "as in mdpd: the force is A (1 - r/rc) + B (n_i + n_j)(1 - r/rd), which is psi = c B n^2 with \
                     c = pi/30 rd^4 in 3-D (Warren eq. 13)",
                ),
                Some(masses) => {
                    let masses: Option<Vec<f64>> =
                        members.types.iter().map(|t| masses.get(*t).copied()).collect();
                    (
                        lucy_mdpd(species, pairs, &masses.unwrap_or_default(), dimensions),
                        "those of mdpd: the force is A (1 - r/rc) + B (rho_i + rho_j)(1 - r/rd), rho the sum of \
                         Lucy's kernel over neighbours times their masses",
                    )
                }
            };
            let model = model.map_err(|e| members.error(e))?;
            Style::of_members(model, kt, &members, types, dimensions, letters)
        })
    }

    /// Spline DPD; `pairs` is a table as for [`Style::from_coefficients`], in which pairs of types may be missing.
    pub fn from_spline_coefficients(
        kt: f64,
        pairs: &[Option<SplinePair>],
        types: usize,
        thermostat_range: f64,
        dimensions: usize,
    ) -> Result<Style, StyleError> {
        guard(|| {
            let members = Members::new(pairs, types)?;
            let model = spline_dpd(&members.species, &members.pairs, thermostat_range, dimensions)
                .map_err(|e| members.error(e))?;
            let letters =
                "phi = a [A W(r, rc1) - B W(r, rc2)], W the cubic spline with W(0) = 1, not normalised";
            Style::of_members(model, kt, &members, types, dimensions, letters)
        })
    }

    fn of_members<T>(
        model: Model,
        kt: f64,
        members: &Members<T>,
        types: usize,
        dimensions: usize,
        letters: &'static str,
    ) -> Result<Style, StyleError> {
        let name = |t| if members.types.contains(&t) { name_of_type(t) } else { "NULL".to_owned() };
        let names: Vec<String> = (0..types).map(name).collect();
        Ok(Style { letters: Some(letters), ..Style::new(model, kt, &names, dimensions)? })
    }
}
