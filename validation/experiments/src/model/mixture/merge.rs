//! One model file of two liquids: each keeps its formulas, parameters and pairs under its own name. A local density of the same kernel is
//! one density, which counts both species; others are two. Between the species acts half the sum of both pair potentials, times a
//! number `cross`, and the mean drag. So a liquid and itself are one liquid at `cross = 1`.

use super::conditions;
use crate::ExperimentError;
use psidpd_core::document::Document;
use psidpd_core::model::{Model, Units};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// A model of one species under the name that it has in the mixture.
#[derive(Debug, Clone)]
pub struct Liquid {
    pub name: String,
    pub file: PathBuf,
    pub model: Model,
    table: Table,
}

/// What a mixture can take from a model.
const KNOWN: [&str; 10] = [
    "title",
    "reference",
    "species",
    "dimensions",
    "units",
    "parameters",
    "density",
    "excess_free_energy",
    "pair",
    "thermostat",
];

/// The number that factors of pairs between the species have in the file.
const CROSS: &str = "cross";

impl Liquid {
    pub fn open(name: &str, file: &Path) -> Result<Liquid, ExperimentError> {
        let refused = |why: &str| Err(conditions(format!("{}: {why}", file.display())));
        let document = Document::open(file)?;
        let text = document.source.text();
        let model = Model::parse_in(file, text)?;
        let Ok(table) = text.parse::<Table>() else { return refused("it is no table of TOML") };
        if model.species().len() != 1 || model.dimensions() != 3 {
            return refused("a mixture is made of models of one species in three dimensions");
        }
        if let Some(key) = table.keys().find(|key| !KNOWN.contains(&key.as_str()) && *key != "literature") {
            return refused(&format!("a mixture cannot take [{key}]"));
        }
        if tables(&table, "pair").next().is_none() {
            return refused("it has no pair potentials, and the attraction between the liquids is one");
        }
        if tables(&table, "pair").any(|pair| factor(pair).is_none()) {
            return refused("a mixture cannot take a pair potential from a table");
        }
        let densities = table.get("density").and_then(Value::as_table);
        if densities.is_some_and(|all| all.values().any(|of| of.get("correction").is_some())) {
            return refused("a mixture cannot take a correction of a density");
        }
        let formulas = table.get("excess_free_energy").and_then(Value::as_table);
        if formulas.is_some_and(|all| all.values().any(|psi| !psi.is_str())) {
            return refused("a mixture can take formulas of [excess_free_energy] alone");
        }
        Ok(Liquid { name: name.to_owned(), file: file.to_owned(), model, table })
    }

    /// The densities of the file with their ranges as numbers.
    fn densities(&self, kt: f64) -> Result<Vec<(String, Table)>, ExperimentError> {
        let fluid = self.model.at(kt)?;
        let all = self.table.get("density").and_then(Value::as_table);
        let of = |density: &psidpd_core::model::WeightedDensity| {
            let mut table = all?.get(&density.name)?.as_table()?.clone();
            table.insert("range".into(), Value::Float(density.kernel.range()));
            Some((density.name.clone(), table))
        };
        Ok(fluid.densities.iter().filter_map(of).collect())
    }
}

/// The tables of an array of tables.
fn tables<'a>(root: &'a Table, key: &str) -> impl Iterator<Item = &'a Table> {
    root.get(key).and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_table)
}

/// The key that a pair potential is proportional to.
fn factor(pair: &Table) -> Option<&'static str> {
    match pair.get("form")?.as_str()? {
        "soft" | "spline" => Some("strength"),
        "expression" => Some("phi"),
        _ => None,
    }
}

/// A formula with other names.
fn renamed(formula: &str, names: &BTreeMap<String, String>) -> String {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
    let mut out = String::new();
    let mut rest = formula;
    while let Some(start) = rest.find(is_part) {
        let (before, word) = rest.split_at(start);
        let end = word.find(|c| !is_part(c)).unwrap_or(word.len());
        out += before;
        // A number, as 1e5, is not a name and stays.
        out += names.get(&word[..end]).map_or(&word[..end], |name| name);
        rest = &word[end..];
    }
    out + rest
}

fn is_name(formula: &str) -> bool {
    formula.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// A value with its formula in other names.
fn value(value: &Value, names: &BTreeMap<String, String>) -> Value {
    value.as_str().map_or_else(|| value.clone(), |formula| Value::String(renamed(formula, names)))
}

fn formula(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn lines(out: &mut String, header: &str, entries: &[(String, Value)]) {
    let width = entries.iter().map(|(key, _)| key.len()).max().unwrap_or(0);
    let _ = writeln!(out, "\n{header}");
    for (key, value) in entries {
        let _ = match value {
            // As 8.1e-10.
            Value::Float(x) => writeln!(out, "{key:width$} = {x:?}"),
            _ => writeln!(out, "{key:width$} = {value}"),
        };
    }
}

/// The units and the mass of a particle of the second liquid in those of the first.
pub fn units(liquids: [&Liquid; 2]) -> Result<(Option<Units>, f64), ExperimentError> {
    let [a, b] = liquids.map(|liquid| liquid.model.units);
    match (a, b) {
        (None, None) => Ok((None, 1.0)),
        (Some(first), Some(second)) => {
            for (what, x, y) in
                [("length", first.length, second.length), ("energy", first.energy, second.energy)]
            {
                if (x / y - 1.0).abs() > 1e-4 {
                    return Err(conditions(format!(
                        "the units of {what} differ, {x:e} and {y:e}: both liquids need the same; --rc {:e} of `psidpd model liquid` \
                         gives the second the length of the first, and --temperature its energy",
                        first.length
                    )));
                }
            }
            Ok((Some(first), second.mass / first.mass))
        }
        _ => Err(conditions("one model has [units] and the other has none".into())),
    }
}

/// The file of the mixture; `head` goes into its comment.
pub fn text(liquids: [&Liquid; 2], kt: f64, cross: f64, head: &str) -> Result<String, ExperimentError> {
    let names = liquids.map(|liquid| liquid.name.clone());
    let mut out: String =
        head.lines().map(|line| if line.is_empty() { "#\n".into() } else { format!("# {line}\n") }).collect();
    let title = Value::String(format!("{} and {}", liquids[0].model.title, liquids[1].model.title));
    let _ = writeln!(out, "title   = {title}\nspecies = [\"{}\", \"{}\"]", names[0], names[1]);
    if let (Some(units), _) = units(liquids)? {
        let of = [("length", units.length), ("mass", units.mass), ("energy", units.energy)];
        lines(&mut out, "[units]", &of.map(|(key, x)| (key.into(), Value::Float(x))));
    }

    // Densities of the same kernel are one.
    let mut densities: Vec<(String, Table)> = Vec::new();
    let mut of_names = [BTreeMap::new(), BTreeMap::new()];
    for (liquid, known) in liquids.iter().zip(&mut of_names) {
        for (name, table) in liquid.densities(kt)? {
            let same = densities.iter().find(|(_, other)| *other == table).map(|(name, _)| name.clone());
            let new = same.unwrap_or_else(|| {
                let taken = densities.iter().any(|(other, _)| *other == name);
                let new = if taken { format!("{name}_of_{}", liquid.name) } else { name.clone() };
                densities.push((new.clone(), table));
                new
            });
            known.insert(format!("{name}_{}", liquid.model.species()[0]), new.clone());
            known.insert(name, new);
        }
        for parameter in
            liquid.table.get("parameters").and_then(Value::as_table).into_iter().flat_map(Table::keys)
        {
            known.insert(parameter.clone(), format!("{parameter}_{}", liquid.name));
        }
    }

    let mut parameters = vec![(CROSS.to_owned(), Value::Float(cross))];
    let mut formulas = Vec::new();
    for (liquid, known) in liquids.iter().zip(&of_names) {
        let of = |key| liquid.table.get(key).and_then(Value::as_table).into_iter().flatten();
        parameters.extend(of("parameters").map(|(key, x)| (known[key].clone(), value(x, known))));
        formulas.extend(of("excess_free_energy").map(|(_, psi)| (liquid.name.clone(), value(psi, known))));
    }
    lines(&mut out, "[parameters]", &parameters);
    for (name, table) in &densities {
        let entries: Vec<_> = table.iter().map(|(key, x)| (key.clone(), x.clone())).collect();
        lines(&mut out, &format!("[density.{name}]"), &entries);
    }
    // Of a liquid without a formula ψ is zero; the other needs the table.
    if !formulas.is_empty() {
        for name in &names {
            if formulas.iter().all(|(key, _)| key != name) {
                formulas.push((name.clone(), Value::String("0".into())));
            }
        }
        lines(&mut out, "[excess_free_energy]", &formulas);
    }
    pairs(&mut out, liquids, &of_names);
    drag(&mut out, liquids, kt)?;
    Ok(out)
}

/// Pairs within each liquid, and those between them.
fn pairs(out: &mut String, liquids: [&Liquid; 2], of_names: &[BTreeMap<String, String>; 2]) {
    let between = |a: &str, b: &str| Value::Array(vec![a.into(), b.into()]);
    // Without the factor, with the formulas of the factor: terms that differ in it alone are one.
    let mut cross: Vec<(Table, &str, Vec<String>)> = Vec::new();
    for (liquid, known) in liquids.iter().zip(of_names) {
        for pair in tables(&liquid.table, "pair") {
            let Some(key) = factor(pair) else { continue };
            let of = |(name, x): (&String, &Value)| {
                let x = if name == "form" { x.clone() } else { value(x, known) };
                (name.clone(), x)
            };
            let mut rest: Table = pair.iter().filter(|(name, _)| *name != "between").map(of).collect();
            let mut entries = vec![("between".to_owned(), between(&liquid.name, &liquid.name))];
            entries.extend(rest.clone());
            lines(out, "[[pair]]", &entries);
            let strength = rest.remove(key).map_or(String::new(), |x| formula(&x));
            match cross.iter_mut().find(|(other, ..)| *other == rest) {
                Some((.., strengths)) => strengths.push(strength),
                None => cross.push((rest, key, vec![strength])),
            }
        }
    }
    for (rest, key, strengths) in cross {
        let sum = strengths
            .iter()
            .map(|s| if is_name(s) { s.clone() } else { format!("({s})") })
            .collect::<Vec<_>>()
            .join(" + ");
        let sum = if strengths.len() > 1 { format!("({sum})") } else { sum };
        let mut entries = vec![("between".to_owned(), between(&liquids[0].name, &liquids[1].name))];
        entries.extend(rest);
        entries.push((key.into(), Value::String(format!("0.5*{CROSS}*{sum}"))));
        lines(out, "[[pair]]", &entries);
    }
}

/// The drag within each liquid, and between them the mean with the weight of the first.
fn drag(out: &mut String, liquids: [&Liquid; 2], kt: f64) -> Result<(), ExperimentError> {
    let of = |liquid: &Liquid| -> Result<_, ExperimentError> { Ok(liquid.model.at(kt)?.thermostats[0]) };
    let (a, b) = match (of(liquids[0])?, of(liquids[1])?) {
        (None, None) => return Ok(()),
        (Some(a), Some(b)) => (a, b),
        _ => return Err(conditions("one model has a [[thermostat]] and the other has none".into())),
    };
    let [first, second] = liquids.map(|liquid| liquid.name.as_str());
    let mean = 0.5 * (a.gamma + b.gamma);
    for (pair, of, gamma) in [([first; 2], a, a.gamma), ([second; 2], b, b.gamma), ([first, second], a, mean)]
    {
        let entries = [
            ("between", Value::Array(pair.map(Value::from).into())),
            ("gamma", Value::Float(gamma)),
            ("range", Value::Float(of.range)),
            ("exponent", Value::Float(of.exponent)),
        ];
        lines(out, "[[thermostat]]", &entries.map(|(key, x)| (key.to_owned(), x)));
    }
    Ok(())
}
