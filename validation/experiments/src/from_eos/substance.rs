use crate::ExperimentError;
use serde::Deserialize;

/// PC-SAFT parameters of a pure substance.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Substance {
    pub name: String,
    pub source: String,
    /// kg/mol.
    pub molar_mass: f64,
    pub m: f64,
    /// Diameter of a segment, in 10⁻¹⁰ m.
    pub sigma: f64,
    /// Depth of its potential over the Boltzmann constant, in K.
    pub epsilon_k: f64,
    /// Volume and energy (K) of association between one donor and one acceptor.
    #[serde(default)]
    pub association: Option<[f64; 2]>,
}

#[derive(Deserialize)]
struct List {
    substance: Vec<Substance>,
}

fn all() -> Vec<Substance> {
    let list: Result<List, _> = toml::from_str(include_str!("../../../substances/pc-saft.toml"));
    // The file is part of the program, and tested.
    list.map(|list| list.substance).unwrap_or_default()
}

pub fn names() -> String {
    all().iter().map(|s| s.name.clone()).collect::<Vec<_>>().join(", ")
}

impl Substance {
    pub fn find(name: &str) -> Result<Substance, ExperimentError> {
        all()
            .into_iter()
            .find(|s| s.name == name)
            .ok_or_else(|| ExperimentError::Substance(name.to_owned(), names()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn substances_ship_with_their_source() {
        let all = all();
        assert!(all.len() >= 2 && all.iter().all(|s| s.source.contains("Ind. Eng. Chem. Res.")), "{all:?}");
        assert!(Substance::find("water").unwrap().association.is_some());
        let why = Substance::find("phlogiston").unwrap_err().to_string();
        assert!(why.contains("decane"), "{why}");
    }
}
