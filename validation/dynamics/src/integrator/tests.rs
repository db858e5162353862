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

/// The row of an integrator in the table of factors: a, b, c, a′, b′.
fn factors(name: &str) -> [f64; 5] {
    let rows = table("| `integrator` | a | b |");
    let named = |row: &&Vec<String>| row[0].split(", ").any(|cell| cell == format!("`{name}`"));
    let row = rows.iter().find(named).or(rows.iter().find(|row| row[0] == "others")).unwrap();
    std::array::from_fn(|k| number(&row[1 + k]))
}

/// Errors at ΩΔt = 2, κΔt = 3 and νΔt = 5 have every factor in them, the largest of three among them.
#[test]
fn errors_are_those_of_the_manual() {
    for (name, integrator) in Integrator::ALL {
        let [a, b, c, of_square, of_drag] = factors(name);
        let rates = Rates { frequency: 4.0, drag: 6.0, crossing: 10.0 };
        let largest = (4.0 * a).max(3.0 * b).max(5.0 * c);
        let expected = [largest, 4.0 * of_square + 3.0 * of_drag];
        let found = integrator.properties().accuracy.errors(0.5, rates);
        assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-12), "{name}: {found:?} {expected:?}");
    }
}

/// The rule is within a factor of 1.6 of the larger error of the temperatures in each run of the manual where that is above 0.8 %, and
/// what the manual says of the rule is what it is.
#[test]
fn the_rule_has_the_errors_of_the_runs_in_the_manual() {
    let rows = table("| fluid | Ω, κ, ν |");
    assert!(rows.len() > 25);
    for row in rows {
        let rates: Vec<f64> = row[1].split(", ").map(number).collect();
        let [frequency, drag, crossing] = rates[..] else { panic!("{row:?}") };
        let (_, integrator) =
            Integrator::ALL.into_iter().find(|(name, _)| row[2] == format!("`{name}`")).unwrap();
        let rates = Rates { frequency, drag, crossing };
        let percent = 100.0 * integrator.properties().accuracy.errors(number(&row[3]), rates)[0];
        assert!((percent - number(&row[6])).abs() <= 0.0501, "{percent}: {row:?}");
        let measured =
            |cell: &str| number(cell.split('(').next().unwrap().trim_start_matches(['+', '−'])).abs();
        let worst = measured(&row[4]).max(measured(&row[5]));
        assert!(worst < 0.8 || (0.625..1.6).contains(&(percent / worst)), "{percent}: {row:?}");
    }
}
