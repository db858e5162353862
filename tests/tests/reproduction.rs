//! The tables of `docs/reproduction.md`: rows agree with their own verdicts, and with what `psidpd reproduce` prints.

use psidpd_tests::{json, psidpd, root, said};
use serde_json::Value;
use std::collections::BTreeSet;

/// Cases of theory, which give the same numbers everywhere, and measurements of seconds.
const SHORT: [&str; 5] =
    ["pagonabarraga-fig1", "pagonabarraga-fig4", "trofimov-fig1", "wang-limit", "berendsen-water"];

/// A case whose equal rows are one row of the page.
const SHORTENED: &str = "pagonabarraga-fig2";

/// A number with an error in its last digits, which is 0 where there is none.
#[derive(Debug, Clone, Copy)]
struct Number {
    value: f64,
    error: f64,
    /// A unit in the last digit.
    unit: f64,
}

#[derive(Debug)]
struct Row {
    case: String,
    value: String,
    measured: Number,
    rule: &'static str,
    /// "own" if it is compared with another value of the program, "read" if the error of the published side is ours.
    source: &'static str,
    published: Number,
    /// In combined errors; `None` for a trend that holds.
    deviation: Option<f64>,
    verdict: String,
}

fn number(text: &str) -> Number {
    let text = text.replace('−', "-");
    let (digits, error) = text.split_once('(').map_or((text.as_str(), None), |(d, e)| (d, Some(e)));
    let places = digits.split_once('.').map_or(0, |(_, places)| places.len());
    let unit = 10f64.powi(-(places as i32));
    let error = error.map_or(0.0, |e| e.trim_end_matches(')').parse::<f64>().unwrap() * unit);
    Number { value: digits.parse().unwrap_or_else(|_| panic!("{text} is no number")), error, unit }
}

/// The rows of the tables with six columns, one list for each table.
fn tables() -> Vec<Vec<Row>> {
    let page = std::fs::read_to_string(root().join("docs/reproduction.md")).unwrap();
    let mut tables: Vec<Vec<Row>> = Vec::new();
    let mut inside = false;
    for line in page.lines() {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        if line.starts_with("| case | value | measured | published |") {
            inside = true;
            tables.push(Vec::new());
            continue;
        }
        inside &= line.starts_with('|');
        let shortened = line.contains(&format!("`{SHORTENED}`"));
        if !inside || line.starts_with("|---") || shortened {
            continue;
        }
        let [_, case, value, measured, published, deviation, verdict, _] = cells[..] else {
            panic!("{line}")
        };
        let rows = tables.last_mut().unwrap();
        let case = match case.trim_matches('`') {
            "" => rows.last().map(|row: &Row| row.case.clone()).unwrap_or_default(),
            case => case.to_owned(),
        };
        let rules = [("≤ ", "at-most"), ("≥ ", "at-least"), ("", "equal")];
        let (sign, rule) = rules.into_iter().find(|(sign, _)| published.starts_with(sign)).unwrap();
        let published = &published[sign.len()..];
        let source = ["own", "read", ""].into_iter().find(|s| published.ends_with(&format!(" ({s})")));
        let source = source.unwrap_or_default();
        rows.push(Row {
            case,
            value: value.to_owned(),
            measured: number(measured),
            rule,
            source,
            published: number(published.split(" (").next().unwrap()),
            deviation: (!deviation.is_empty()).then(|| number(deviation.trim_start_matches('+')).value),
            verdict: verdict.replace("**", ""),
        });
    }
    tables
}

/// Each row's deviation follows from its numbers, and its verdict from the rule of the page.
#[test]
fn every_row_has_the_verdict_of_its_numbers() {
    let tables = tables();
    assert_eq!(tables.len(), 2);
    for row in tables.iter().flatten() {
        let Row { measured, published, rule, verdict, .. } = row;
        let difference = measured.value - published.value;
        let error = measured.error.hypot(published.error);
        // A last digit of 1 may be half or one and a half.
        let slack = 0.5 * (measured.unit + published.unit);
        let [least, most] =
            [-slack, slack].map(|s| (difference.abs() + s).max(0.0) / (error - s).max(0.4 * error));
        let deviation = row.deviation.unwrap_or(0.0);
        if *rule == "equal" || verdict.as_str() != "pass" {
            let fits = error == 0.0 && deviation == 0.0 && difference.abs() <= slack
                || (least - 0.06..=most + 0.06).contains(&deviation.abs());
            assert!(fits, "{row:?}: from {least} to {most}");
            assert!(difference.abs() <= slack || deviation * difference >= 0.0, "{row:?}");
        }
        let vague = measured.error > (0.1 * published.value.abs()).max(published.error) + measured.unit;
        let wrong = match *rule {
            "at-most" => difference > slack,
            "at-least" => difference < -slack,
            _ => true,
        };
        let expected = match (wrong && deviation.abs() > 3.05, wrong && deviation.abs() < 2.95 && !vague) {
            (true, _) => "fail",
            (_, true) => "pass",
            // On the limit of one of both.
            _ if wrong && vague && *rule == "equal" => "fail: too vague",
            _ => continue,
        };
        if expected != "pass" || verdict != AT_FULL_SIZE {
            assert_eq!(verdict, expected, "{row:?}");
        }
    }
}

/// What a value that agrees is called if it disagrees in the longer run of the second table.
const AT_FULL_SIZE: &str = "fail: at full size";

/// No value passes in the first table that fails in the second.
#[test]
fn what_fails_at_full_size_does_not_pass_at_quick_size() {
    let tables = tables();
    let [quick, full] = &tables[..] else { panic!("two tables") };
    let in_full =
        |row: &Row| full.iter().find(|other| (&other.case, &other.value) == (&row.case, &row.value));
    for row in quick {
        let fails = in_full(row).is_some_and(|long| long.verdict != "pass");
        assert!(!(fails && row.verdict == "pass"), "{row:?}");
        assert!(row.verdict != AT_FULL_SIZE || fails, "{row:?}: the second table does not say so");
    }
    assert!(full.iter().all(|row| row.verdict != AT_FULL_SIZE));
}

/// The table has all cases, and the sentence above it counts them.
#[test]
fn every_case_is_in_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let list = json(folder.path(), &["reproduce", "--list"], 0);
    let cases: BTreeSet<String> =
        list["cases"].as_array().unwrap().iter().map(|c| c["id"].as_str().unwrap().to_owned()).collect();
    let rows = tables().remove(0);
    let mut found: BTreeSet<String> = rows.iter().map(|row| row.case.clone()).collect();
    found.insert(SHORTENED.to_owned());
    assert_eq!(found, cases);
    let failing: BTreeSet<&str> =
        rows.iter().filter(|row| row.verdict != "pass").map(|row| row.case.as_str()).collect();
    let page = std::fs::read_to_string(root().join("docs/reproduction.md")).unwrap();
    let words = page.split_whitespace().collect::<Vec<_>>().join(" ");
    for sentence in [
        format!("one run of all {} cases", cases.len()),
        format!("All values agree in {} cases", cases.len() - failing.len()),
    ] {
        assert!(words.contains(&sentence), "{sentence}: {failing:?}");
    }
}

/// Compares the rows of a case with the values that the program found.
fn hold(rows: &[Row], found: &Value) {
    let id = found["id"].as_str().unwrap();
    let values = found["values"].as_array().unwrap();
    if id == SHORTENED {
        return assert!(values.len() == 12 && values.iter().all(|v| v["pass"] == true), "{found}");
    }
    let rows: Vec<&Row> = rows.iter().filter(|row| row.case == id).collect();
    let names: Vec<&str> = rows.iter().map(|row| row.value.as_str()).collect();
    let found_names: Vec<&str> = values.iter().map(|v| v["name"].as_str().unwrap()).collect();
    assert_eq!(names, found_names, "{id}");
    for (row, value) in rows.into_iter().zip(values) {
        let pair = |key: &str| ["value", "error"].map(|part| value[key][part].as_f64().unwrap());
        let Row { measured, published, .. } = row;
        let source = match (value["own"] == true, value["error_is_printed"] == true) {
            (true, _) => "own",
            (_, true) => "",
            _ => "read",
        };
        // A bound from words has no error that could be printed.
        let same = row.rule != "equal" || row.source == source;
        assert!(row.rule == value["rule"].as_str().unwrap() && same, "{row:?}: {value}");
        assert_eq!(row.verdict == AT_FULL_SIZE, value["at_full_size"].is_object(), "{row:?}: {value}");
        let [of_paper, its_error] = pair("published");
        let near = |a: f64, b: f64, unit: f64| (a - b).abs() <= 0.51 * unit + 1e-12 * b.abs();
        // Another run of the program scatters as the measured value does.
        let same = if row.source == "own" {
            (of_paper - published.value).abs() <= 4.0 * its_error.hypot(published.error)
        } else {
            near(published.value, of_paper, published.unit)
                && near(published.error, its_error, published.unit)
        };
        assert!(same, "{row:?}: {value}");
        let [now, error] = pair("measured");
        let agrees = match measured.error {
            0.0 => near(measured.value, now, measured.unit.max(1e-4 * now.abs())) && error < measured.unit,
            e => (measured.value - now).abs() <= 4.0 * e.hypot(error) && e < 3.0 * error && error < 3.0 * e,
        };
        assert!(agrees, "{row:?}: {value}");
    }
}

#[test]
fn short_cases_are_as_printed() {
    let folder = tempfile::tempdir().unwrap();
    let rows = tables().remove(0);
    for id in SHORT.into_iter().chain([SHORTENED]) {
        psidpd(folder.path(), &["reproduce", id, "--out", "out", "--json", "out.json"]);
        let text = std::fs::read_to_string(folder.path().join("out.json")).unwrap();
        hold(&rows, &serde_json::from_str(&text).unwrap());
    }
}

/// All cases at their small size.
#[test]
#[ignore = "minutes: cargo test --release -p psidpd-tests --test reproduction -- --ignored"]
fn all_cases_are_as_printed() {
    let folder = tempfile::tempdir().unwrap();
    let rows = tables().remove(0);
    let output = psidpd(folder.path(), &["reproduce", "--out", "out", "--json", "out.json"]);
    let text = std::fs::read_to_string(folder.path().join("out.json"))
        .unwrap_or_else(|_| panic!("{}", said(&output)));
    let found: Value = serde_json::from_str(&text).unwrap();
    found["cases"].as_array().unwrap().iter().for_each(|case| hold(&rows, case));
}
