use crate::document::{FileError, Located, Section};

/// The functions of formulas; no parameter, density or species may take such a name.
pub const KNOWN_FUNCTIONS: &[&str] =
    &["ln", "log", "log10", "exp", "sqrt", "sin", "cos", "tanh", "abs", "min", "max"];

/// Most species a model may have: every pair of them is stored.
const MOST_SPECIES: usize = 64;

/// The species of a model: at least one, names like `A`, `W2`, `oil`.
pub fn read_species(root: &Section) -> Result<Located<Vec<String>>, FileError> {
    let value = root.require("species")?;
    let items = value.array()?;
    if items.is_empty() || items.len() > MOST_SPECIES {
        return Err(value.error(format!("must name 1 to {MOST_SPECIES} species")));
    }
    let mut names: Vec<String> = Vec::new();
    for item in items {
        let name = item.string()?.value;
        let fits = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !fits {
            return Err(
                item.error(format!("\"{name}\" is not a species name: letters, digits and underscores only"))
            );
        }
        if name == "NULL" {
            return Err(item.error("NULL is reserved: pair_coeff uses it for a type without species"));
        }
        if names.contains(&name) {
            return Err(item.error(format!("\"{name}\" is named twice")));
        }
        names.push(name);
    }
    Ok(Located { value: names, place: value.place.clone() })
}

/// Checks that a parameter or density has a name that formulas can use.
pub fn check_identifier(name: &Located<String>) -> Result<(), FileError> {
    let mut chars = name.value.chars();
    let starts = chars.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_');
    let goes_on = chars.all(|c| c.is_ascii_alphanumeric() || c == '_');
    let problem = if !starts || !goes_on {
        "is not a name: a letter or underscore, then letters, digits and underscores"
    } else if name.value == "kT" {
        "the scene or the host code sets kT, not the model file"
    } else if name.value == "pi" || KNOWN_FUNCTIONS.contains(&name.value.as_str()) {
        "is the name of a constant or function of formulas"
    } else {
        return Ok(());
    };
    Err(name.error(problem))
}
