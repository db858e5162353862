//! Replacement values for keys of a scene or model, as `--set KEY=VALUE` gives them.

use super::keys::TABLES;
use super::{Arc, FileError, Source};
use psidpd_core::document::Place;
use psidpd_core::model::keys as model_keys;
use std::collections::BTreeSet;
use std::str::FromStr;
use toml_edit::{DocumentMut, Item, TableLike, Value, value};

/// A key and its new value.
///
/// Examples are `kT`, `density`, `stage.produce.dt`, `part.1.radius` and `model.parameters.A`. A table of an
/// array is addressed by its `name` or by its number, from 1. A key without a path is a key of the top level,
/// or of the one table that has it, or of all stages that have it, or a parameter of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Edit {
    text: String,
    path: Vec<String>,
    value: String,
}

impl FromStr for Edit {
    type Err = String;

    fn from_str(text: &str) -> Result<Edit, String> {
        let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE")?;
        let edit = Edit::new(key.trim(), value.trim());
        if edit.path.iter().any(String::is_empty) || edit.value.is_empty() {
            return Err("expected KEY=VALUE, as kT=0.9 or stage.produce.dt=0.02".into());
        }
        Ok(edit)
    }
}

impl std::fmt::Display for Edit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text)
    }
}

impl Edit {
    pub fn new(key: &str, value: impl ToString) -> Edit {
        let path = key.replace('[', ".").replace(']', "");
        let path = path.split('.').map(|part| part.trim().to_owned()).collect();
        let value = value.to_string();
        Edit { text: format!("{key}={value}"), path, value }
    }

    pub fn key(&self) -> &str {
        self.text.split('=').next().unwrap_or_default()
    }

    pub fn value(&self) -> &str {
        &self.value
    }

    pub fn number(&self) -> Option<f64> {
        self.value.parse().ok()
    }

    /// Parses the value; a value that is not TOML is a string.
    fn item(&self) -> Item {
        Value::from_str(&self.value).map_or_else(|_| value(self.value.as_str()), Item::Value)
    }

    fn place(&self, key: &str) -> Place {
        let source = Arc::new(Source::new("--set", &self.text));
        Place { source, span: 0..self.key().len(), key: key.to_owned() }
    }

    fn error(&self, message: String) -> FileError {
        self.place("").error(message)
    }
}

/// Splits off the edits of the model, and applies the others to the text of the scene.
pub fn edit_scene(
    text: &str,
    edits: &[Edit],
    parameters: &dyn Fn(&str) -> bool,
) -> Result<(String, Vec<Edit>), FileError> {
    let mut document = parse(text);
    let (own, model) = (roots(TABLES, &["observe"]), roots(model_keys::TABLES, &[]));
    let mut of_model = Vec::new();
    for edit in edits {
        let first = edit.path[0].as_str();
        let for_model = |path: &[String]| Edit { path: path.to_vec(), ..edit.clone() };
        let several = edit.path.len() > 1;
        if first == "model" && several {
            of_model.push(for_model(&edit.path[1..]));
        } else if several && !own.contains(first) && model.contains(first) {
            of_model.push(for_model(&edit.path));
        } else if !several && places(&document, first).is_empty() && parameters(first) {
            of_model.push(for_model(&["parameters".to_owned(), first.to_owned()]));
        } else {
            set(&mut document, edit)?;
        }
    }
    Ok((document.to_string(), of_model))
}

/// Applies edits to the text of a model. A key without a path may be a parameter; the prefix `model.` is
/// allowed, as in a scene. A parameter that the model does not have would change nothing and is refused.
pub fn edit_model(text: &str, edits: &[Edit]) -> Result<String, FileError> {
    let mut document = parse(text);
    for edit in edits {
        let mut edit = edit.clone();
        if edit.path[0] == "model" && edit.path.len() > 1 {
            edit.path.remove(0);
        }
        if let [table, name] = edit.path.as_slice()
            && table == "parameters"
        {
            let table = document.get("parameters").and_then(Item::as_table_like);
            let known: Vec<&str> = table.map_or_else(Vec::new, |t| t.iter().map(|(key, _)| key).collect());
            if !known.contains(&name.as_str()) {
                let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
                return Err(edit.error(format!("the model has no parameter {name}; its parameters: {known}")));
            }
        }
        set(&mut document, &edit)?;
    }
    Ok(document.to_string())
}

/// Puts an error at the edit that caused it, if it is in a line that the file itself does not have.
pub fn blamed(error: FileError, original: &str, edits: &[Edit]) -> FileError {
    let line = error.place.source.text().lines().nth(error.line() - 1).unwrap_or_default();
    let is_in = |edit: &&Edit| {
        let key = edit.path.last().map_or("", String::as_str);
        line.trim_start().trim_start_matches('"').starts_with(key) || line.contains(&format!("{key} ="))
    };
    match edits.iter().rev().find(is_in).filter(|_| original.lines().all(|own| own != line)) {
        Some(edit) => FileError { place: edit.place(&error.place.key), ..error },
        None => error,
    }
}

/// Parses the text. Invalid TOML stays unedited, so that the reader reports its error.
fn parse(text: &str) -> DocumentMut {
    text.parse().unwrap_or_default()
}

/// The keys that the top level of a file may have.
fn roots(tables: &[psidpd_core::document::keys::Table], more: &[&'static str]) -> BTreeSet<&'static str> {
    let first = |path: &'static str| path.split('.').next().unwrap_or_default();
    let top = tables.iter().filter(|t| t.path.is_empty()).flat_map(|t| t.keys.iter().map(|k| k.name));
    top.chain(tables.iter().map(|t| first(t.path))).chain(more.iter().copied()).collect()
}

/// The paths of the tables that have a key, the top level first.
fn places(document: &DocumentMut, key: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    collect(document.as_table(), key, &mut Vec::new(), &mut found);
    found
}

fn collect(table: &dyn TableLike, key: &str, at: &mut Vec<String>, found: &mut Vec<Vec<String>>) {
    if table.contains_key(key) {
        found.push(at.iter().cloned().chain([key.to_owned()]).collect());
    }
    for (name, item) in table.iter() {
        at.push(name.to_owned());
        if let Some(inner) = item.as_table_like() {
            collect(inner, key, at, found);
        } else if let Some(array) = item.as_array_of_tables() {
            for (k, inner) in array.iter().enumerate() {
                at.push((k + 1).to_string());
                collect(inner, key, at, found);
                at.pop();
            }
        }
        at.pop();
    }
}

fn set(document: &mut DocumentMut, edit: &Edit) -> Result<(), FileError> {
    let [key] = edit.path.as_slice() else { return set_at(document, &edit.path, edit) };
    let mut places = places(document, key);
    if document.contains_key(key) || places.is_empty() {
        return set_at(document, &edit.path, edit);
    }
    if places.len() > 1 && !places.iter().all(|path| path[0] == "stage") {
        let known: Vec<String> = places.iter().map(|path| path.join(".")).collect();
        return Err(edit.error(format!("{key} is in several tables: say which, {}", known.join(" or "))));
    }
    places.drain(..).try_for_each(|path| set_at(document, &path, edit))
}

fn set_at(document: &mut DocumentMut, path: &[String], edit: &Edit) -> Result<(), FileError> {
    let (last, tables) = path.split_last().unwrap_or((&path[0], &[]));
    let mut table: &mut dyn TableLike = document.as_table_mut();
    let mut parts = tables.iter();
    while let Some(part) = parts.next() {
        table = match table.entry(part).or_insert(Item::Table(toml_edit::Table::new())) {
            Item::ArrayOfTables(array) => {
                let name = |t: &toml_edit::Table| t.get("name").and_then(Item::as_str).map(str::to_owned);
                let names: Vec<String> = array.iter().map(|t| name(t).unwrap_or_default()).collect();
                let which = parts.next().map_or("", String::as_str);
                let by_name = names.iter().position(|n| n == which && !n.is_empty());
                let by_number = || which.parse::<usize>().ok()?.checked_sub(1);
                array.get_mut(by_name.or_else(by_number).unwrap_or(names.len())).ok_or_else(|| {
                    let named = names.iter().enumerate().map(|(k, n)| match n.as_str() {
                        "" => format!("{part}.{}", k + 1),
                        name => format!("{part}.{name}"),
                    });
                    let named = named.collect::<Vec<_>>().join(", ");
                    edit.error(format!("there are several [[{part}]]: {named}"))
                })?
            }
            other => other.as_table_like_mut().ok_or_else(|| edit.error(format!("{part} is no table")))?,
        };
    }
    table.insert(last, edit.item());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "# a comment\nmodel = \"m.toml\"\nkT = 1.0\n[initial]\ndensity = 6.0\n\
                         [[stage]]\nname = \"a\"\nsteps = 10\ndt = 0.01\n[[stage]]\nname = \"b\"\nsteps = 20\n";

    fn edited(edits: &[&str]) -> Result<(String, Vec<Edit>), String> {
        let edits: Vec<Edit> = edits.iter().map(|e| e.parse().unwrap()).collect();
        edit_scene(SCENE, &edits, &|name| name == "A").map_err(|e| e.to_string())
    }

    #[test]
    fn values_are_set_where_they_belong() {
        let all = ["kT=0.5", "density=3", "stage.b.steps=7", "stage[1].dt=0.02", "seed=5", "output.thermo=1"];
        let (text, model) = edited(&all).unwrap();
        let table: toml::Table = text.parse().unwrap();
        assert!(text.contains("# a comment") && model.is_empty());
        assert_eq!(table["kT"].as_float(), Some(0.5));
        assert_eq!(table["initial"]["density"].as_integer(), Some(3));
        assert_eq!(table["stage"][1]["steps"].as_integer(), Some(7));
        assert_eq!(table["stage"][0]["dt"].as_float(), Some(0.02));
        assert_eq!(table["seed"].as_integer(), Some(5));
        assert_eq!(table["output"]["thermo"].as_integer(), Some(1));
        // The edits set a key of all stages, and a string without quotes.
        let table: toml::Table = edited(&["steps=3", "integrator=aboba"]).unwrap().0.parse().unwrap();
        assert_eq!(table["stage"][0]["steps"].as_integer(), Some(3));
        assert_eq!(table["stage"][1]["steps"].as_integer(), Some(3));
        assert_eq!(table["integrator"].as_str(), Some("aboba"));
    }

    #[test]
    fn the_model_gets_what_is_its_own() {
        let (text, model) =
            edited(&["A=-50", "model.density.n.range=0.8", "parameters.B=2", "model=other.toml"]).unwrap();
        let paths: Vec<String> = model.iter().map(|e| e.path.join(".")).collect();
        assert_eq!(paths, ["parameters.A", "density.n.range", "parameters.B"]);
        assert!(text.contains("model = \"other.toml\""));
        let text = edit_model("species = [\"F\"]\n[parameters]\nA = -40.0\n", &model[..1]).unwrap();
        assert_eq!(text.parse::<toml::Table>().unwrap()["parameters"]["A"].as_integer(), Some(-50));
    }

    #[test]
    fn parameters_of_a_model_must_be_there() {
        let model = "species = [\"F\"]\n[parameters]\nA = -40.0\n";
        let edit = |text: &str| edit_model(model, &[text.parse().unwrap()]).map_err(|e| e.to_string());
        let table: toml::Table = edit("model.parameters.A=-50").unwrap().parse().unwrap();
        assert_eq!(table["parameters"]["A"].as_integer(), Some(-50));
        assert!(edit("parameters.AA=-50").unwrap_err().contains("its parameters: A"));
    }

    #[test]
    fn ambiguous_and_impossible_keys_are_refused() {
        let twice = SCENE.replace("[initial]", "[[part]]\ndensity = 1.0\n[[part]]");
        let edit: Edit = "density=3".parse().unwrap();
        let error = edit_scene(&twice, &[edit], &|_| false).unwrap_err().to_string();
        assert!(error.contains("part.1.density or part.2.density"), "{error}");
        assert!(edited(&["stage.c.steps=3"]).unwrap_err().contains("stage.a, stage.b"));
        assert!(edited(&["kT.x=3"]).unwrap_err().contains("kT is no table"));
        for bad in ["kT", "=3", "a..b=3", "kT="] {
            assert!(bad.parse::<Edit>().is_err(), "{bad}");
        }
    }
}
