//! The results of an observable, and the files that hold them.

use super::series::{Measured, Series};
use serde::{Deserialize, Serialize};
use std::io::Write;

/// The form of an observation on a plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    #[default]
    /// Single numbers: every column has one value, and there is no `x`.
    Scalar,
    Profile,
    Curve,
    Series,
    /// Values at points of space: the first columns are the coordinates, and there is no `x`.
    Field,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Abscissa {
    pub name: String,
    /// The unit in r_c, m, kT of the model; "1" for pure numbers.
    #[serde(default)]
    pub unit: String,
    /// The values increase.
    #[serde(with = "nullable")]
    pub values: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Column {
    pub name: String,
    /// The unit in r_c, m, kT of the model; "1" for pure numbers.
    #[serde(default)]
    pub unit: String,
    /// Unknown values are NaN, written as null.
    #[serde(with = "nullable")]
    pub values: Vec<f64>,
    /// One standard deviation of each value; NaN, written as null, if unknown.
    #[serde(default, with = "nullable")]
    pub errors: Vec<f64>,
}

/// The result of an observable in one stage. A file may lack everything but the name: other programs write such files too.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Observation {
    /// The name, unique within a stage; letters, digits and underscores.
    pub name: String,
    /// The name for people.
    #[serde(default)]
    pub title: String,
    #[serde(default)]
    pub stage: String,
    #[serde(default)]
    pub kind: Kind,
    pub x: Option<Abscissa>,
    #[serde(default)]
    pub columns: Vec<Column>,
    /// The number of configurations in the mean.
    #[serde(default)]
    pub samples: u64,
    /// Remarks for readers.
    #[serde(default, deserialize_with = "text_or_null")]
    pub note: String,
}

impl Observation {
    /// An observation without columns of the samples of `series`.
    pub fn new(name: &str, title: &str, kind: Kind, series: &Series) -> Observation {
        let (name, title, samples) = (name.into(), title.into(), series.samples());
        Observation { name, title, kind, samples, ..Observation::default() }
    }

    pub fn against(mut self, name: &str, unit: &str, values: Vec<f64>) -> Observation {
        self.x = Some(Abscissa { name: name.into(), unit: unit.into(), values });
        self
    }

    pub fn column(
        mut self,
        name: &str,
        unit: &str,
        values: impl IntoIterator<Item = Measured>,
    ) -> Observation {
        let (values, errors) = values.into_iter().map(|m| (m.value, m.error)).unzip();
        self.columns.push(Column { name: name.into(), unit: unit.into(), values, errors });
        self
    }

    pub fn exact(self, name: &str, unit: &str, values: impl IntoIterator<Item = f64>) -> Observation {
        self.column(name, unit, values.into_iter().map(|value| Measured { value, error: 0.0 }))
    }

    pub fn note(mut self, text: impl AsRef<str>) -> Observation {
        if !self.note.is_empty() && !text.as_ref().is_empty() {
            self.note.push(' ');
        }
        self.note.push_str(text.as_ref());
        self
    }

    pub fn get(&self, column: &str) -> Option<&Column> {
        self.columns.iter().find(|c| c.name == column)
    }

    /// The value and error of a column with one value.
    pub fn scalar(&self, column: &str) -> Option<Measured> {
        let c = self.get(column)?;
        Some(Measured { value: *c.values.first()?, error: c.errors.first().copied().unwrap_or(f64::NAN) })
    }

    /// The name of the CSV file in the folder `observables`: `NAME.csv`, or `NAME-STAGE.csv` if other stages have the
    /// observable too.
    pub fn file_name(&self, all: &[Observation]) -> String {
        if all.iter().all(|o| o.name != self.name || o.stage == self.stage) {
            return format!("{}.csv", self.name);
        }
        // Stages whose names differ only in characters that a file name cannot have are told apart by their index.
        let place = all.iter().filter(|o| o.name == self.name).position(|o| o.stage == self.stage);
        let plain = |c: char| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '_' };
        let stage: String = self.stage.chars().map(plain).collect();
        let same = |o: &&Observation| o.name == self.name && o.stage.chars().map(plain).eq(stage.chars());
        match all.iter().filter(same).count() {
            1 => format!("{}-{stage}.csv", self.name),
            _ => format!("{}-{stage}-{}.csv", self.name, place.unwrap_or(0) + 1),
        }
    }

    /// Writes the table: the abscissa, then each column with its error. Unknown values are empty fields.
    pub fn csv(&self, to: &mut impl Write) -> std::io::Result<()> {
        let mut header: Vec<String> = self.x.iter().map(|x| x.name.clone()).collect();
        for c in &self.columns {
            header.extend([c.name.clone(), format!("{}_error", c.name)]);
        }
        writeln!(to, "{}", header.join(","))?;
        let rows = self.columns.iter().map(|c| c.values.len()).max().unwrap_or(0);
        let shown = |x: Option<&f64>| x.filter(|x| x.is_finite()).map_or(String::new(), |x| format!("{x:?}"));
        for k in 0..rows {
            let mut row: Vec<String> = self.x.iter().map(|x| shown(x.values.get(k))).collect();
            for c in &self.columns {
                row.extend([shown(c.values.get(k)), shown(c.errors.get(k))]);
            }
            writeln!(to, "{}", row.join(","))?;
        }
        Ok(())
    }
}

fn text_or_null<'de, D: serde::Deserializer<'de>>(from: D) -> Result<String, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or_default())
}

/// Numbers that are not finite become null. A null in place of the list is an empty list.
mod nullable {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(values: &[f64], to: S) -> Result<S::Ok, S::Error> {
        let options: Vec<Option<f64>> = values.iter().map(|x| x.is_finite().then_some(*x)).collect();
        options.serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
        let options = Option::<Vec<Option<f64>>>::deserialize(from)?.unwrap_or_default();
        Ok(options.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example(stage: &str) -> Observation {
        let mut o = Observation::new("rdf", "g(r)", Kind::Curve, &Series::new(1))
            .against("r", "length", vec![0.5, 1.5])
            .column("g", "1", [Measured { value: 1.0, error: 0.25 }, Measured::NONE])
            .note("one.")
            .note("two.");
        o.samples = 3;
        o.stage = stage.into();
        o
    }

    #[test]
    fn json_has_the_promised_keys_and_comes_back() {
        let text = serde_json::to_string_pretty(&[example("a")]).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(
            json[0],
            serde_json::json!({
                "name": "rdf", "title": "g(r)", "stage": "a", "kind": "curve",
                "x": { "name": "r", "unit": "length", "values": [0.5, 1.5] },
                "columns": [{ "name": "g", "unit": "1", "values": [1.0, null], "errors": [0.25, null] }],
                "samples": 3, "note": "one. two."
            })
        );
        let back: Vec<Observation> = serde_json::from_str(&text).unwrap();
        assert!(back[0].columns[0].values[1].is_nan() && back[0].x == example("a").x);
    }

    #[test]
    fn csv_files_are_named_by_stage_only_if_need_be() {
        let mut text = Vec::new();
        example("a").csv(&mut text).unwrap();
        assert_eq!(String::from_utf8(text).unwrap(), "r,g,g_error\n0.5,1.0,0.25\n1.5,,\n");
        assert_eq!(example("a").file_name(&[example("a")]), "rdf.csv");
        let all = [example("cold"), example("hot/1"), example("hot 1")];
        for (observation, name) in all.iter().zip(["rdf-cold.csv", "rdf-hot_1-2.csv", "rdf-hot_1-3.csv"]) {
            assert_eq!(observation.file_name(&all), name);
        }
    }
}
