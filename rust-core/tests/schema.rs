//! Checks that the JSON schema and the reference of the model file are current with the table of
//! keys, and that the reader reads every key.

mod tables_of_keys;

use psidpd_core::document::FileError;
use psidpd_core::model::Model;
use psidpd_core::model::keys::TABLES;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tables_of_keys::{Tables, assert_current, examples};

const INTRODUCTION: &str = "# The model file\n\n\
    This page lists the keys of the model file. A model file is TOML; it describes the particles and their\n\
    interactions. Unknown keys are errors. Numbers may be formulas of the parameters and `kT` where the key\n\
    says so. Editors that know JSON schemas (taplo, Even Better TOML) complete and check model files with\n\
    `#:schema model.schema.json` in the first line; the schema is `rust-core/schema/model.schema.json`.\n\n\
    The examples leave out what every model needs: a title, the species (one, `A`), and the density `n` if\n\
    psi uses it.\n\n\
    This page is written from the table of keys in `rust-core/model/src/keys.rs`.\n";

fn schema() -> Value {
    let mut schema = Tables(TABLES).schema("psidpd model file");
    schema["definitions"] =
        json!({ "number": { "anyOf": [{ "type": "number" }, { "type": "string", "minLength": 1 }] } });
    schema
}

fn reference() -> String {
    Tables(TABLES).page(INTRODUCTION)
}

/// Completes an example to a whole model.
fn completed(example: &str) -> String {
    let has = |start: &str| example.lines().any(|l| l.starts_with(start));
    let mut text = String::new();
    for (key, line) in [("title", "title = \"example\"\n"), ("species", "species = [\"A\"]\n")] {
        if !has(key) {
            text += line;
        }
    }
    text += example;
    if has("[excess_free_energy]") && !has("[density") {
        text += "\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n";
    }
    text
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn schema_and_reference_are_current() {
    let schema = serde_json::to_string_pretty(&schema()).unwrap() + "\n";
    assert_current(&root().join("schema/model.schema.json"), &schema);
    assert_current(&root().join("../docs/model-file.md"), &reference());
}

/// The page of the theory has each kernel once, with its factor in three dimensions: a number over another times π, of a kernel
/// that is 1 in the middle.
#[test]
fn the_page_of_the_theory_has_the_kernels() {
    use psidpd_core::model::kernel::{Kernel, KernelKind};
    let page = std::fs::read_to_string(root().join("../docs/theory.md")).unwrap();
    for kind in KernelKind::ALL.iter().copied() {
        let mut rows = page.lines().filter(|line| line.starts_with(&format!("| `{}` |", kind.name())));
        let row = rows.next().unwrap_or_else(|| panic!("{}", kind.name()));
        assert!(rows.next().is_none());
        let factor = row.rsplit("$`").next().unwrap().split("R^3)").next().unwrap();
        let (top, bottom) = factor.split_once("/(").unwrap_or_else(|| panic!("{row}"));
        let count = bottom.replace("\\pi", "").trim().parse().unwrap_or(1.0);
        let told = top.parse::<f64>().unwrap() / (count * std::f64::consts::PI);
        let kernel = Kernel::new(kind, 2.0, 3);
        assert!((8.0 * kernel.value(0.0) / told - 1.0).abs() < 1e-12, "{row}");
    }
}

/// Checks a value by the part of JSON Schema (draft 7) that the schema uses; panics at an unknown keyword.
fn validate(value: &Value, schema: &Value, root: &Value) -> Result<(), String> {
    let rules = match schema {
        Value::Bool(true) => return Ok(()),
        Value::Bool(false) => return Err(format!("{value} may not stand here")),
        other => other.as_object().unwrap(),
    };
    let count = |rule: &Value| rule.as_u64().unwrap() as usize;
    let list = |rule: &Value| rule.as_array().unwrap().clone();
    let matching = |rule: &Value| list(rule).iter().filter(|s| validate(value, s, root).is_ok()).count();
    for (keyword, rule) in rules {
        let holds = match keyword.as_str() {
            "$schema" | "title" | "description" | "default" | "definitions" => true,
            "$ref" => {
                let pointer = rule.as_str().unwrap().trim_start_matches('#');
                return validate(value, root.pointer(pointer).unwrap(), root);
            }
            "type" => match rule.as_str().unwrap() {
                "string" => value.is_string(),
                "number" => value.is_number(),
                "boolean" => value.is_boolean(),
                "array" => value.is_array(),
                "object" => value.is_object(),
                other => panic!("{other}"),
            },
            "const" => value == rule,
            "enum" => list(rule).contains(value),
            "exclusiveMinimum" => value.as_f64().is_none_or(|x| x > rule.as_f64().unwrap()),
            "minLength" => value.as_str().is_none_or(|s| s.chars().count() >= count(rule)),
            "minItems" => value.as_array().is_none_or(|a| a.len() >= count(rule)),
            "maxItems" => value.as_array().is_none_or(|a| a.len() <= count(rule)),
            "uniqueItems" => value.as_array().is_none_or(|a| (1..a.len()).all(|k| !a[..k].contains(&a[k]))),
            "items" => {
                for item in value.as_array().into_iter().flatten() {
                    validate(item, rule, root)?;
                }
                true
            }
            "required" => value
                .as_object()
                .is_none_or(|o| list(rule).iter().all(|k| o.contains_key(k.as_str().unwrap()))),
            "properties" => true,
            "additionalProperties" => {
                let empty = json!({});
                let properties = rules.get("properties").unwrap_or(&empty);
                for (key, value) in value.as_object().into_iter().flatten() {
                    let schema = properties.get(key).unwrap_or(rule);
                    validate(value, schema, root).map_err(|e| format!("{key}: {e}"))?;
                }
                true
            }
            "allOf" => matching(rule) == list(rule).len(),
            "anyOf" => matching(rule) > 0,
            "oneOf" => matching(rule) == 1,
            other => panic!("unknown keyword {other}"),
        };
        if !holds {
            return Err(format!("{value} does not fit {keyword} {rule}"));
        }
    }
    Ok(())
}

/// All valid model files of the project.
fn models() -> Vec<PathBuf> {
    let folders = [root().join("tests/models/good"), root().join("../validation/models")];
    let mut found: Vec<PathBuf> = folders
        .iter()
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flatten()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    found.sort();
    assert!(found.len() > 8);
    found
}

#[test]
fn every_model_is_valid_by_the_schema() {
    let schema = schema();
    for path in models() {
        let model: Value = toml::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        if let Err(error) = validate(&model, &schema, &schema) {
            panic!("{}: {error}", path.display());
        }
    }
}

/// The schema refuses unknown, missing and mistyped keys.
#[test]
fn the_schema_refuses_unknown_and_missing_keys() {
    let schema = schema();
    let folder = root().join("tests/models/bad");
    let mut refused = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).unwrap();
        let known = ["unknown_", "missing_"].iter().any(|start| name.starts_with(start))
            || name.ends_with("_unknown") && !name.starts_with("curve_density");
        if path.extension().is_some_and(|e| e == "toml") && known {
            let model: Value = toml::from_str(&text).unwrap();
            assert!(validate(&model, &schema, &schema).is_err(), "{name}");
            refused += 1;
        }
    }
    assert!(refused > 12, "{refused}");
}

fn parse_example(text: &str) -> Result<Model, FileError> {
    Model::parse(&root().join("tests/models/good/example.toml").display().to_string(), text)
}

#[test]
fn every_example_of_the_reference_loads() {
    let page = reference();
    let examples = examples(&page);
    for example in &examples {
        let text = completed(example);
        let model = parse_example(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        model.at(1.0).unwrap_or_else(|e| panic!("{e}\n{text}"));
    }
    assert_eq!(examples.len(), TABLES.iter().map(|t| t.keys.len()).sum::<usize>());
}

#[test]
fn every_key_is_read() {
    Tables(TABLES).assert_all_are_read(completed, parse_example);
}

/// A key of another form is unknown, and the error lists the keys of this form.
#[test]
fn each_form_has_its_own_keys() {
    let text = "title = \"t\"\nspecies = [\"A\"]\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = 1\nphi = \"1 - r\"\nrange = 1\n";
    let error = Model::parse("m.toml", text).unwrap_err().to_string();
    assert!(
        error.contains("phi") && error.ends_with("known here: between, form, range, strength"),
        "{error}"
    );
}
