//! Two runs compared: every number with an error that both have.

use super::{Observation, SeriesTable, headline, read_json_if_there};
use crate::ReportError;
use crate::quantity::with_error;
use crate::table::Table;
use crate::text::typeset;
use psidpd_observe::observation::Column;
use psidpd_observe::statistics::threshold;
use serde::Serialize;
use std::path::Path;

/// How often two runs of one scene from different seeds are said to differ, at most.
pub const FALSE_ALARM: f64 = 0.01;

/// What errors may be too small by: those of all observables are within it (`errors_are_the_spread_of_means`).
const ERRORS: f64 = 1.15;

/// A quantity of both runs; of a curve the point where they differ most.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The observable and its column, or a column of `thermo.csv`.
    pub name: String,
    pub stage: String,
    pub unit: String,
    /// Where on a curve: the name of its axis, and the position there.
    pub at: Option<(String, f64)>,
    /// The number of points of a curve that are compared; 1 of a single number.
    pub points: usize,
    pub first: [f64; 2],
    pub second: [f64; 2],
    /// The difference, second less first, over its error.
    pub deviation: f64,
}

/// Two runs, the largest differences first.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Against {
    pub rows: Vec<Row>,
    /// The numbers that are compared.
    pub numbers: usize,
    /// The deviation that one of so many normal numbers exceeds with the probability [`FALSE_ALARM`], if errors may be 15 % too small.
    pub limit: f64,
    /// Quantities that cannot be compared, and why.
    pub left_out: Vec<String>,
}

impl Against {
    /// Reads the results of two runs.
    ///
    /// # Errors
    /// Fails if a folder is not that of a run, or its observables cannot be read.
    pub fn read(folders: [&Path; 2]) -> Result<Against, ReportError> {
        let mut all = Vec::new();
        for folder in folders {
            all.push(numbers(folder)?);
        }
        let [second, first] = [all.pop(), all.pop()].map(Option::unwrap_or_default);
        Ok(Against::of(&first, &second))
    }

    fn of(first: &[Observation], second: &[Observation]) -> Against {
        let mut found = Against::default();
        for a in first {
            let Some(b) = second.iter().find(|b| b.name == a.name && b.stage == a.stage) else {
                found.left_out.push(format!("{}: only the first run has it", label(a)));
                continue;
            };
            found.add(a, b);
        }
        let missing = second.iter().filter(|b| !first.iter().any(|a| b.name == a.name && b.stage == a.stage));
        found.left_out.extend(missing.map(|b| format!("{}: only the second run has it", label(b))));
        found.limit = ERRORS * threshold(found.numbers, FALSE_ALARM);
        found.rows.sort_by(|a, b| b.deviation.abs().total_cmp(&a.deviation.abs()));
        found
    }

    /// Compares the columns of an observable.
    fn add(&mut self, a: &Observation, b: &Observation) {
        let axes = [a, b].map(|o| o.x.as_ref().map_or(&[][..], |x| &x.values));
        if !same_points(axes) {
            self.left_out.push(format!("{}: the runs have it at other points", label(a)));
            return;
        }
        for column in &a.columns {
            let several = a.columns.len() > 1;
            let name = if several { format!("{}: {}", a.name, column.name) } else { a.name.clone() };
            let Some(other) = b.get(&column.name).filter(|other| other.unit == column.unit) else {
                self.left_out.push(format!("{name}: the second run has it not, or in another unit"));
                continue;
            };
            if [column, other].iter().any(|c| c.errors.iter().all(|error| error.is_nan())) {
                self.left_out.push(format!("{name}: a run does not know its error"));
            }
            let mut points = 0;
            let mut worst: Option<(usize, f64)> = None;
            for (k, deviation) in deviations(column, other) {
                points += 1;
                if worst.is_none_or(|(_, most)| deviation.abs() > most.abs()) {
                    worst = Some((k, deviation));
                }
            }
            self.numbers += points;
            let Some((k, deviation)) = worst else { continue };
            self.rows.push(Row {
                name,
                stage: a.stage.clone(),
                unit: column.unit.clone(),
                at: a.x.as_ref().and_then(|x| Some((x.name.clone(), *x.values.get(k)?))),
                points,
                first: [column.values[k], column.errors[k]],
                second: [other.values[k], other.errors[k]],
                deviation,
            });
        }
    }

    /// What differs by more than chance.
    pub fn differing(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| row.deviation.abs() > self.limit)
    }

    /// A table with a row for each quantity.
    pub fn table(&self) -> Table {
        let mut table =
            Table::new(["quantity", "stage", "first", "second", "unit", "difference / error", "verdict"]);
        for row in &self.rows {
            let name = match &row.at {
                Some((axis, x)) => format!("{} at {axis} = {x:.4}, of {} points", row.name, row.points),
                None => row.name.clone(),
            };
            let [first, second] =
                [row.first, row.second].map(|[value, error]| with_error(value, Some(error)));
            let verdict = if row.deviation.abs() > self.limit { "differs" } else { "equal within errors" };
            let deviation = format!("{:.1}", row.deviation);
            table.push([
                name,
                row.stage.clone(),
                first,
                second,
                typeset(&row.unit),
                deviation,
                verdict.into(),
            ]);
        }
        table
    }
}

fn label(o: &Observation) -> String {
    if o.stage.is_empty() { o.name.clone() } else { format!("{} in {}", o.name, o.stage) }
}

/// The observables of a run, and the means of the rows of its last stage.
fn numbers(folder: &Path) -> Result<Vec<Observation>, ReportError> {
    let observables = read_json_if_there::<Vec<Observation>>(&folder.join("observables.json"))?;
    let table = SeriesTable::read(&folder.join("thermo.csv"))?;
    if observables.is_none() && table.is_none() {
        let files = "observables.json, thermo.csv".to_owned();
        return Err(ReportError::NoRun { folder: folder.to_owned(), files });
    }
    let mut all = observables.unwrap_or_default();
    let means = headline(folder).values.into_iter().filter(|v| v.source.contains("thermo.csv"));
    all.extend(means.map(|v| Observation {
        name: format!("thermo: {}", v.name),
        columns: vec![Column {
            name: v.name,
            unit: v.unit,
            values: vec![v.value],
            errors: vec![v.error.unwrap_or(f64::NAN)],
        }],
        ..Observation::default()
    }));
    Ok(all)
}

/// Whether two axes are the same to rounding.
fn same_points([a, b]: [&[f64]; 2]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-9 * a.abs().max(b.abs()))
}

/// The points of a column where both have a value and one an error, with the difference over its error.
fn deviations(a: &Column, b: &Column) -> impl Iterator<Item = (usize, f64)> {
    let numbers = |c: &Column| c.values.iter().copied().zip(c.errors.iter().copied()).collect::<Vec<_>>();
    let pairs = numbers(a).into_iter().zip(numbers(b)).enumerate();
    pairs.filter_map(|(k, ((a, from_a), (b, from_b)))| {
        let error = from_a.hypot(from_b);
        (error > 0.0 && (b - a).is_finite()).then(|| (k, (b - a) / error)).filter(|(_, z)| z.is_finite())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_observe::observation::Abscissa;

    fn curve(name: &str, x: &[f64], values: &[f64], errors: &[f64]) -> Observation {
        let column = |name: &str, k: f64| Column {
            name: name.into(),
            unit: "1".into(),
            values: values.iter().map(|v| k * v).collect(),
            errors: errors.iter().map(|e| k * e).collect(),
        };
        let axis = Abscissa { name: "r".into(), unit: "length".into(), values: x.into() };
        Observation {
            name: name.into(),
            stage: "a".into(),
            x: (!x.is_empty()).then_some(axis),
            columns: if x.is_empty() {
                vec![column("mean", 1.0)]
            } else {
                vec![column("g", 1.0), column("n", 2.0)]
            },
            ..Observation::default()
        }
    }

    /// By hand: 1.3 less 1.0 over the root of 0.06² + 0.08²; of a curve its farthest point; what has no error, or is at other points, or in one
    /// run only, is left out. The limit of nine numbers is 1.15 times 3.261, which a normal number exceeds in 1 of 900 cases.
    #[test]
    fn differences_are_over_both_errors() {
        let x = [0.5, 1.5, 2.5, 3.5, 4.5];
        let first = [
            curve("u", &[], &[1.0], &[0.06]),
            curve("g", &x, &[0.0, 1.0, 2.0, f64::NAN, 1.0], &[0.0, 0.3, 0.3, 0.1, 0.1]),
            curve("moved", &[1.0, 2.0], &[1.0, 1.0], &[0.1, 0.1]),
            curve("alone", &[], &[1.0], &[0.1]),
            curve("exact", &[], &[1.0], &[0.0]),
            curve("unknown", &[], &[1.0], &[f64::NAN]),
            curve("infinite", &[], &[f64::INFINITY], &[1.0]),
            curve("one error", &[], &[2.0], &[0.0]),
            curve("same", &[], &[2.0], &[0.5]),
            curve("other unit", &[], &[2.0], &[0.5]),
        ];
        let second = [
            curve("u", &[], &[1.3], &[0.08]),
            curve("g", &x, &[0.0, 1.5, -1.0, 1.0, 1.0], &[0.0, 0.4, 0.4, 0.1, 0.1]),
            curve("moved", &[1.0, 2.1], &[5.0, 5.0], &[0.1, 0.1]),
            curve("exact", &[], &[2.0], &[0.0]),
            curve("unknown", &[], &[9.0], &[0.1]),
            curve("infinite", &[], &[9.0], &[0.1]),
            curve("one error", &[], &[1.0], &[0.5]),
            curve("same", &[], &[2.0], &[0.5]),
            curve("new", &[], &[1.0], &[0.1]),
        ];
        let mut second = second.to_vec();
        second.push(curve("other unit", &[], &[2.0], &[0.5]));
        second[9].columns[0].unit = "length".into();
        let found = Against::of(&first, &second);
        let rows: Vec<_> = found.rows.iter().map(|r| (r.name.as_str(), r.points, r.deviation)).collect();
        let expected =
            [("g: g", 3, -6.0), ("g: n", 3, -6.0), ("u", 1, 3.0), ("one error", 1, -2.0), ("same", 1, 0.0)];
        assert_eq!(rows.len(), expected.len(), "{rows:?}");
        for (row, expected) in rows.iter().zip(expected) {
            assert_eq!((row.0, row.1), (expected.0, expected.1));
            assert!((row.2 - expected.2).abs() < 1e-12, "{rows:?}");
        }
        assert_eq!(found.rows[0].at, Some(("r".into(), 2.5)));
        assert_eq!((found.rows[1].first, found.rows[1].second), ([4.0, 0.6], [-2.0, 0.8]));
        assert_eq!(found.numbers, 9);
        assert!((found.limit - 1.15 * 3.2611).abs() < 1e-3, "{}", found.limit);
        assert_eq!(found.differing().map(|row| row.name.as_str()).collect::<Vec<_>>(), ["g: g", "g: n"]);
        assert_eq!(
            found.left_out,
            [
                "moved in a: the runs have it at other points",
                "alone in a: only the first run has it",
                "unknown: a run does not know its error",
                "other unit: the second run has it not, or in another unit",
                "new in a: only the second run has it"
            ]
        );
        let text = found.table().to_text_with(false);
        assert!(text.contains("g: g at r = 2.5000, of 3 points") && text.contains("differs"), "{text}");
    }

    /// Runs that differ by chance alone, by normal numbers whose errors are 15 % too small, are said to differ in 1 % of cases: in 40 of
    /// 4000, with a standard error of 6.3. Bounds are 4.5 of these: a false alarm in 150 000. A difference of eight errors is always seen.
    #[test]
    fn chance_is_no_difference() {
        let mut counter = 0;
        let mut normal = || {
            counter += 1;
            let words = psidpd_core::engine::noise::threefry2x32::<20>([counter, 7], [5, 9]);
            f64::from(psidpd_core::engine::noise::normal(words))
        };
        let x: Vec<f64> = (0..10).map(f64::from).collect();
        let errors = [0.1 / 1.15; 10];
        let mut differ = 0;
        for _ in 0..4000 {
            let [a, b] = [(); 2].map(|()| {
                let values: Vec<f64> = (0..10).map(|_| 1.0 + 0.1 * normal()).collect();
                let mut o = curve("g", &x, &values, &errors);
                o.columns.pop();
                [o]
            });
            differ += usize::from(Against::of(&a, &b).differing().count() > 0);
            let mut far = b.clone();
            far[0].columns[0].values[3] = a[0].columns[0].values[3] + 8.0 * 0.1 * 2f64.sqrt();
            assert_eq!(Against::of(&a, &far).differing().count(), 1);
        }
        assert!((12..=68).contains(&differ), "{differ}");
    }
}
