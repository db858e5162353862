use super::number::read_formula;
use super::species_index;
use crate::document::{FileError, FileErrorKind, Located, Section};
use crate::model::expression::Ast;

/// What the file says of one species' `ψ`.
#[derive(Debug, Clone)]
pub enum ExcessEntry {
    /// No `[excess_free_energy]` at all: ψ = 0.
    None,
    /// A formula of the densities.
    Formula(Located<Ast>),
}

/// Reads `[excess_free_energy]`: every species, or none.
pub fn read(root: &Section, species: &Located<Vec<String>>) -> Result<Vec<ExcessEntry>, FileError> {
    let mut all = vec![ExcessEntry::None; species.value.len()];
    let Some(value) = root.get("excess_free_energy") else {
        return Ok(all);
    };
    let section = value.section()?;
    for (name, value) in section.entries() {
        let index = species_index(&species.value, &name, section.source())?;
        all[index] = ExcessEntry::Formula(read_formula(&value, section.source())?);
    }
    match all.iter().position(|e| matches!(e, ExcessEntry::None)) {
        None => Ok(all),
        Some(missing) => Err(section
            .error(FileErrorKind::Value(format!("species {} has no entry", species.value[missing])))
            .with_help(format!("write {} = \"0\" if it has none", species.value[missing]))),
    }
}
