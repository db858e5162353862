//! Defaults and factors against the tables of the manual.

use super::*;
use std::path::Path;

/// Cells of the rows of a table in `docs/integrators.md`, from behind its `head` to its end.
fn table(head: &str) -> Vec<Vec<String>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/integrators.md");
    let text = std::fs::read_to_string(path).unwrap();
    let rows = text.lines().skip_while(|line| !line.starts_with(head)).skip(2);
    let cells = |row: &str| row.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect();
    rows.take_while(|line| line.starts_with('|')).map(cells).collect()
}

fn number(text: &str) -> f64 {
    match text {
        "¼" => 0.25,
        "½" => 0.5,
        "¾" => 0.75,
        other => match other.split_once('/') {
            Some((over, under)) => number(over) / number(under),
            None => other.parse().unwrap_or_else(|_| panic!("{other} is no number")),
        },
    }
}

/// The first cell of a row has a name, and of each key with a default its name and that.
#[test]
fn defaults_are_those_of_the_manual() {
    let rows = table("| `integrator` | one step");
    assert_eq!(rows.len(), Integrator::NAMED.len());
    for (row, (name, mut integrator)) in rows.iter().zip(Integrator::ALL) {
        let [named, keys @ ..] = &row[0].split(", ").collect::<Vec<_>>()[..] else { panic!("{row:?}") };
        assert_eq!(*named, format!("`{name}`"));
        let stated = |key: &str| {
            let key = format!("`{key}` ");
            keys.iter().find_map(|text| text.strip_prefix(&key)).map(number)
        };
        assert_eq!(integrator.settings().lambda.map(|(lambda, _)| *lambda), stated("lambda"), "{name}");
        assert_eq!(integrator.settings().gradient.map(|gradient| *gradient), stated("gradient"), "{name}");
    }
}

/// Errors at ωΔt = 2 and κΔt = 3 have every factor in them.
#[test]
fn errors_are_those_of_the_manual() {
    let rows = table("| `integrator` | a | b |");
    for (name, integrator) in Integrator::ALL {
        let named = |row: &&Vec<String>| row[0].split(", ").any(|cell| cell == format!("`{name}`"));
        let row = rows.iter().find(named).or(rows.iter().find(|row| row[0] == "others")).unwrap();
        let factors: Vec<f64> = row[1..].iter().map(|cell| number(cell)).collect();
        let [a, b, of_square, of_drag, of_fourth] = factors[..] else { panic!("{row:?}") };
        let expected = [16.0 * a + 3.0 * b, 4.0 * of_square + 3.0 * of_drag + 16.0 * of_fourth];
        let found = integrator.properties().accuracy.errors(0.5, 4.0, 6.0);
        assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-12), "{name}: {found:?} {expected:?}");
    }
}
