//! Model files with another correction or another ψ: everything else, comments too, stays as it is.

use crate::ExperimentError;
use psidpd_core::model::Polynomial;
use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, Value};

/// The file with the correction of one density; `note` becomes a comment above it.
pub fn with_correction(
    text: &str,
    density: &str,
    species: &[String],
    polynomials: &[Polynomial],
    note: &str,
) -> Result<String, ExperimentError> {
    let mut document: DocumentMut = text.parse()?;
    let coefficients = |p: &Polynomial| p.0.iter().copied().collect::<Array>();
    let value = match polynomials {
        [one] => Value::Array(coefficients(one)),
        several => {
            let mut table = InlineTable::new();
            for (k, p) in several.iter().enumerate() {
                let (at, of) = (&species[k / species.len()], &species[k % species.len()]);
                table.insert(format!("{of}|{at}"), Value::Array(coefficients(p)));
            }
            Value::InlineTable(table)
        }
    };
    let entry = document.get_mut("density").and_then(|densities| densities.get_mut(density));
    let lines = entry.as_ref().is_some_and(|entry| entry.is_table());
    let entry = entry
        .and_then(Item::as_table_like_mut)
        .ok_or_else(|| ExperimentError::NoSuchDensity(density.to_owned()))?;
    entry.insert("correction", Item::Value(value));
    // Within braces there are no comments.
    if lines && let Some(mut key) = entry.key_mut("correction") {
        let comment: String = note.lines().map(|line| format!("# {line}\n")).collect();
        key.leaf_decor_mut().set_prefix(comment);
    }
    Ok(document.to_string())
}

/// The file with ψ linear in every density: `ψ_α = Σ_v slopes[α][v] · variable v`.
pub fn with_slopes(
    text: &str,
    species: &[String],
    variables: &[String],
    slopes: &[Vec<f64>],
) -> Result<String, ExperimentError> {
    let mut document: DocumentMut = text.parse()?;
    let mut excess = Table::new();
    for (name, slopes) in species.iter().zip(slopes) {
        let terms: Vec<String> =
            slopes.iter().zip(variables).map(|(slope, variable)| format!("({slope:?})*{variable}")).collect();
        excess.insert(name, Item::Value(terms.join(" + ").into()));
    }
    document.insert("excess_free_energy", Item::Table(excess));
    Ok(document.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::model::Model;

    const MODEL: &str = "# A fluid.\ntitle = \"f\" # its name\nspecies = [\"F\"]\n\n[density.n]\nkernel = \"quadratic\"\n\
                         range = 1.0 # r_c\n\n[excess_free_energy.F]\npressure = \"rho*kT + 5*rho^3\"\n";

    #[test]
    fn a_correction_is_one_more_line_and_nothing_else() {
        let fitted = Polynomial(vec![1.54, 1.047, -0.001]);
        let text =
            with_correction(MODEL, "n", &["F".into()], std::slice::from_ref(&fitted), "found by\nrunning")
                .unwrap();
        let expected = MODEL.replace(
            "range = 1.0 # r_c\n",
            "range = 1.0 # r_c\n# found by\n# running\ncorrection = [1.54, 1.047, -0.001]\n",
        );
        assert_eq!(text, expected);
        let model = Model::parse("m.toml", &text).unwrap();
        assert_eq!(model.at(1.0).unwrap().densities[0].correction, std::slice::from_ref(&fitted));
        // Once more: the old one goes.
        let again = with_correction(&text, "n", &["F".into()], &[Polynomial(vec![2.0, 1.0])], "").unwrap();
        assert_eq!(again.matches("correction").count(), 1, "{again}");
        assert!(matches!(
            with_correction(MODEL, "m", &["F".into()], &[fitted], ""),
            Err(ExperimentError::NoSuchDensity(_))
        ));
    }

    #[test]
    fn pairs_of_species_keep_who_feels_whom() {
        let text = MODEL.replace("[\"F\"]", "[\"A\", \"B\"]").replace(
            "[excess_free_energy.F]\npressure = \"rho*kT + 5*rho^3\"",
            "[excess_free_energy]\nA = \"n^2\"\nB = \"n_A*n_B\"",
        );
        let species = ["A".to_owned(), "B".to_owned()];
        let all: Vec<Polynomial> = (0..4).map(|k| Polynomial(vec![f64::from(k), 1.0])).collect();
        let text = with_correction(&text, "n", &species, &all, "").unwrap();
        // The density of B felt by A is the second of the first row.
        assert!(text.contains("\"B|A\" = [1.0, 1.0]"), "{text}");
        let fluid = Model::parse("m.toml", &text).unwrap().at(1.0).unwrap();
        assert_eq!(fluid.densities[0].correction, all);
        let flat =
            with_slopes(&text, &species, &["n_A".into(), "n_B".into()], &[vec![1e-7, -2.0], vec![3.0, 4.0]]);
        let fluid = Model::parse("m.toml", &flat.unwrap()).unwrap().at(1.0).unwrap();
        let theory = psidpd_core::theory::MeanField::new(&fluid).unwrap();
        assert_eq!(theory.excess_slopes(0, &[1.0, 2.0]), [1e-7, -2.0]);
        assert_eq!(theory.excess_slopes(1, &[1.0, 2.0]), [3.0, 4.0]);
    }
}
