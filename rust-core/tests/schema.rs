//! Checks that the JSON schema and the reference of the model file are current with the table of
//! keys, and that the reader reads every key.

use psidpd_core::model::Model;
use psidpd_core::model::keys::{FORMS, REQUIRED, TABLES, Table, ValueKind};
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The keys in the braces of an excess free energy.
fn curves() -> &'static Table {
    &TABLES[5]
}

fn schema_of_value(kind: &ValueKind) -> Value {
    let number = json!({ "$ref": "#/definitions/number" });
    let polynomial = json!({ "type": "array", "items": number, "minItems": 1, "maxItems": 16 });
    match kind {
        ValueKind::Text | ValueKind::Formula | ValueKind::TableFile => json!({ "type": "string" }),
        ValueKind::Dimensions => json!({ "enum": [2, 3], "default": 3 }),
        ValueKind::Flag => json!({ "type": "boolean" }),
        ValueKind::NumberOrFormula | ValueKind::Parameter => number,
        ValueKind::Bounds => json!({ "type": "array", "items": number, "minItems": 2, "maxItems": 2 }),
        ValueKind::Species => json!({
            "type": "array", "minItems": 1, "maxItems": 64, "uniqueItems": true,
            "items": { "type": "string", "minLength": 1 }
        }),
        ValueKind::Between => {
            json!({ "type": "array", "items": { "type": "string" }, "minItems": 2, "maxItems": 2 })
        }
        ValueKind::Choice(choices) => json!({ "enum": choices() }),
        ValueKind::Correction => json!({ "anyOf": [
            polynomial,
            { "type": "object", "additionalProperties": polynomial }
        ]}),
        ValueKind::Slopes => json!({ "type": "object", "additionalProperties": { "type": "string" } }),
        ValueKind::Excess => {
            let mut curve = object(curves(), None);
            curve["oneOf"] = ["table", "pressure", "slopes"].map(|key| json!({ "required": [key] })).into();
            json!({ "anyOf": [{ "type": "string" }, curve] })
        }
        ValueKind::Positive => json!({ "type": "number", "exclusiveMinimum": 0 }),
        ValueKind::Words(words) if words.starts_with("array") => {
            json!({ "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 })
        }
        ValueKind::Words(_) => json!({ "anyOf": [{ "type": "string" }, {
            "type": "object", "properties": { "table": { "type": "string" } }, "required": ["table"],
            "additionalProperties": false
        }]}),
        other => panic!("no value of a model: {other:?}"),
    }
}

fn object(table: &Table, form: Option<&str>) -> Value {
    let mut properties = Map::new();
    let mut required = Vec::new();
    let mut any_name = json!(false);
    for key in table.keys_of(form) {
        let mut schema = schema_of_value(&key.value);
        // Old readers of schemas ignore siblings of a reference.
        if schema.get("$ref").is_some() {
            schema = json!({ "allOf": [schema] });
        }
        schema["description"] = json!(key.about);
        if key.name == "form"
            && let Some(form) = form
        {
            schema = json!({ "const": form, "description": key.about });
        }
        if key.name.chars().all(|c| c.is_ascii_uppercase()) && key.name.len() > 1 {
            any_name = schema;
        } else {
            properties.insert(key.name.into(), schema);
        }
        if key.need == REQUIRED {
            required.push(key.name);
        }
    }
    json!({
        "type": "object", "description": table.about, "properties": properties, "required": required,
        "additionalProperties": any_name
    })
}

fn schema() -> String {
    let &[top, units, parameters, density, excess, _, pair, thermostat, literature] = TABLES else {
        panic!()
    };
    let mut root = object(&top, None);
    root["$schema"] = json!("http://json-schema.org/draft-07/schema#");
    root["title"] = json!("psidpd model file");
    root["definitions"] = json!({ "number": {
        "anyOf": [{ "type": "number" }, { "type": "string", "minLength": 1 }]
    }});
    let properties = &mut root["properties"];
    properties["units"] = object(&units, None);
    properties["parameters"] = object(&parameters, None);
    properties["density"] = json!({ "type": "object", "description": density.about, "additionalProperties": object(&density, None) });
    properties["excess_free_energy"] = object(&excess, None);
    let forms: Vec<Value> = FORMS.iter().map(|form| object(&pair, Some(form))).collect();
    properties["pair"] = json!({ "type": "array", "description": pair.about, "items": { "oneOf": forms } });
    properties["thermostat"] =
        json!({ "type": "array", "description": thermostat.about, "items": object(&thermostat, None) });
    properties["literature"] =
        json!({ "type": "array", "description": literature.about, "items": object(&literature, None) });
    serde_json::to_string_pretty(&root).unwrap() + "\n"
}

fn reference() -> String {
    let mut text = "# The model file\n\n\
        This page lists the keys of the model file. A model file is TOML; it describes the particles and their\n\
        interactions. Unknown keys are errors. Numbers may be formulas of the parameters and `kT` where the key\n\
        says so. Editors that know JSON schemas (taplo, Even Better TOML) complete and check model files with\n\
        `#:schema model.schema.json` in the first line; the schema is `rust-core/schema/model.schema.json`.\n\n\
        The examples leave out what every model needs: a title, the species (one, `A`), and the density `n` if\n\
        psi uses it.\n\n\
        This page is written from the table of keys in `rust-core/model/src/keys.rs`.\n"
        .to_owned();
    // Writing to a String cannot fail.
    for table in TABLES {
        let heading = match table.path {
            "" => "Top level".to_owned(),
            "pair" | "thermostat" | "literature" => format!("`[[{}]]`", table.path),
            path if path == curves().path => "`SPECIES = { … }` in `[excess_free_energy]`".to_owned(),
            path => format!("`[{path}]`"),
        };
        let _ = write!(text, "\n## {heading}\n\n{}", table.reference());
    }
    text
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

/// Compares a file with its expected text, or writes it if `PSIDPD_UPDATE_SCHEMA` is set.
fn assert_current(file: &str, expected: &str) {
    let path = root().join(file);
    if std::env::var_os("PSIDPD_UPDATE_SCHEMA").is_some() {
        std::fs::write(&path, expected).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found.replace("\r\n", "\n") == expected,
        "{file} is not current: run this test with PSIDPD_UPDATE_SCHEMA=1"
    );
}

#[test]
fn schema_and_reference_are_current() {
    assert_current("schema/model.schema.json", &schema());
    assert_current("../docs/model-file.md", &reference());
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
    let schema: Value = serde_json::from_str(&schema()).unwrap();
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
    let schema: Value = serde_json::from_str(&schema()).unwrap();
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

#[test]
fn every_example_of_the_reference_loads() {
    let page = reference();
    let name = root().join("tests/models/good/example.toml");
    let mut count = 0;
    for block in page.split("```toml\n").skip(1) {
        let example = block.split("\n```").next().unwrap();
        let text = completed(example);
        let model =
            Model::parse(&name.display().to_string(), &text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        model.at(1.0).unwrap_or_else(|e| panic!("{e}\n{text}"));
        count += 1;
    }
    assert_eq!(count, TABLES.iter().map(|t| t.keys.len()).sum::<usize>());
}

/// Puts a value of a type that no key has into the table at `path`; false if the table lacks the key.
fn spoil(value: &mut toml::Value, path: &str, key: &str) -> bool {
    let is_chosen = |name: &str| name.len() > 1 && name.chars().all(|c| c.is_ascii_uppercase());
    match value {
        toml::Value::Array(items) => items.iter_mut().any(|item| spoil(item, path, key)),
        toml::Value::Table(table) => {
            let (name, rest) = path.split_once('.').unwrap_or((path, ""));
            let (name, rest) = if path.is_empty() { (key, None) } else { (name, Some(rest)) };
            let mut found = table.iter_mut().filter(|(k, _)| *k == name || is_chosen(name));
            found.any(|(_, inner)| match rest {
                Some(rest) => spoil(inner, rest, key),
                None => {
                    *inner = toml::Value::Array(vec![toml::Value::Array(Vec::new())]);
                    true
                }
            })
        }
        _ => false,
    }
}

/// The reader refuses a wrong type in every key of the tables: it reads all of them.
#[test]
fn every_key_is_read() {
    let name = root().join("tests/models/good/example.toml").display().to_string();
    for table in TABLES {
        for key in table.keys {
            let mut model: toml::Value = toml::from_str(&completed(key.example)).unwrap();
            assert!(spoil(&mut model, table.path, key.name), "{}", key.example);
            let text = toml::to_string(&model).unwrap();
            let error = Model::parse(&name, &text).expect_err(&text).to_string();
            let is_chosen = key.name.len() > 1 && key.name == key.name.to_uppercase();
            assert!(is_chosen || error.contains(key.name), "{}: {error}\n{text}", key.name);
        }
    }
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
