//! The JSON schema and the page of a kind of file, from its tables of keys, and tests of all keys.

use psidpd_core::document::FileError;
use psidpd_core::document::keys::{REQUIRED, Table, ValueKind, is_any_name};
use serde_json::{Map, Value, json};
use std::path::Path;

/// The tables of a kind of file.
pub struct Tables(pub &'static [Table]);

impl Tables {
    fn at(&self, path: &str) -> &'static Table {
        self.0.iter().find(|table| table.path == path).unwrap_or_else(|| panic!("{path}"))
    }

    pub fn schema_of_value(&self, kind: &ValueKind) -> Value {
        let string = json!({ "type": "string" });
        let positive = json!({ "type": "number", "exclusiveMinimum": 0 });
        let formula = json!({ "$ref": "#/definitions/number" });
        let array = |items: &Value, fewest: usize, most: usize| json!({ "type": "array", "items": items, "minItems": fewest, "maxItems": most });
        let whole = |low: u64, high: u64| json!({ "type": "integer", "minimum": low, "maximum": high });
        let each = |items: &Value| array(items, 2, 3);
        match *kind {
            ValueKind::Text | ValueKind::File | ValueKind::TableFile | ValueKind::Formula => string,
            ValueKind::Name(_) => string,
            ValueKind::Number => json!({ "type": "number" }),
            ValueKind::NumberOrFormula | ValueKind::Parameter => formula,
            ValueKind::Positive | ValueKind::HalfBox => positive,
            ValueKind::Count => json!({ "type": "integer", "minimum": 0 }),
            ValueKind::Dimensions => json!({ "enum": [2, 3], "default": 3 }),
            ValueKind::Flag => json!({ "type": "boolean" }),
            ValueKind::Bounds => array(&formula, 2, 2),
            ValueKind::Point => each(&json!({ "type": "number" })),
            ValueKind::Lengths => json!({ "anyOf": [positive, each(&positive)] }),
            ValueKind::Box => json!({ "anyOf": [positive, each(&positive), self.object("box", None)] }),
            ValueKind::Choice(choices) => json!({ "enum": choices() }),
            ValueKind::EachOf(choices) => {
                let one = json!({ "enum": choices() });
                json!({ "anyOf": [one, each(&one)] })
            }
            ValueKind::Temperature => json!({ "anyOf": [positive, array(&positive, 2, 2)] }),
            ValueKind::Species => {
                let mut names = array(&json!({ "type": "string", "minLength": 1 }), 1, 64);
                names["uniqueItems"] = true.into();
                names
            }
            ValueKind::Between => array(&string, 2, 2),
            ValueKind::Names => json!({ "type": "array", "items": string, "minItems": 1 }),
            ValueKind::Fractions => json!({
                "type": "object", "additionalProperties": { "type": "number", "minimum": 0, "maximum": 1 }
            }),
            ValueKind::Ids => array(&json!({ "type": "integer", "minimum": 0 }), 2, 2),
            ValueKind::Correction => {
                let polynomial = array(&formula, 1, 16);
                json!({ "anyOf": [polynomial, { "type": "object", "additionalProperties": polynomial }] })
            }
            ValueKind::Excess => {
                let mut curve = self.object("excess_free_energy.SPECIES", None);
                curve["oneOf"] =
                    ["table", "pressure", "slopes"].map(|key| json!({ "required": [key] })).into();
                json!({ "anyOf": [string, curve] })
            }
            ValueKind::Pressure => json!({ "anyOf": [{ "type": "string" }, {
                "type": "object", "properties": { "table": { "type": "string" } }, "required": ["table"],
                "additionalProperties": false
            }]}),
            ValueKind::Slopes => json!({ "type": "object", "additionalProperties": string }),
            ValueKind::Measured => array(&json!({ "type": "number" }), 2, 2),
            ValueKind::Whole(low, u64::MAX) => json!({ "type": "integer", "minimum": low }),
            ValueKind::Whole(low, high) => whole(low, high),
            ValueKind::Wholes(low, high) => array(&whole(low, high), 2, 2),
            ValueKind::Within(low, f64::INFINITY) => json!({ "type": "number", "minimum": low }),
            ValueKind::Within(low, high) => json!({ "type": "number", "minimum": low, "maximum": high }),
            ValueKind::FlagOrSpecies => json!({ "anyOf": [{ "type": "boolean" }, string] }),
        }
    }

    fn object(&self, path: &str, form: Option<&str>) -> Value {
        let table = self.at(path);
        let mut properties = Map::new();
        let mut required = Vec::new();
        let mut any_name = json!(false);
        for key in table.keys_of(form) {
            let mut schema = match form.filter(|_| key.name == table.forms.0) {
                Some(form) => json!({ "const": form }),
                None => self.schema_of_value(&key.value),
            };
            // Old readers of schemas ignore siblings of a reference.
            if schema.get("$ref").is_some() {
                schema = json!({ "allOf": [schema] });
            }
            schema["description"] = json!(key.about);
            if is_any_name(key.name) {
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

    /// The schema of a table, with one alternative for each of its forms.
    fn forms(&self, table: &Table) -> Value {
        match table.forms.1 {
            [] => self.object(table.path, None),
            forms => {
                let forms: Vec<Value> =
                    forms.iter().map(|form| self.object(table.path, Some(form))).collect();
                json!({ "oneOf": forms })
            }
        }
    }

    pub fn schema(&self, title: &str) -> Value {
        let mut root = self.object("", None);
        root["$schema"] = json!("http://json-schema.org/draft-07/schema#");
        root["title"] = json!(title);
        // Values of keys may be the other tables.
        for table in self.0.iter().filter(|t| !["", "box", "excess_free_energy.SPECIES"].contains(&t.path)) {
            let (name, chosen) = table.path.split_once('.').unwrap_or((table.path, ""));
            let (about, schema) = (table.about, self.forms(table));
            root["properties"][name] = match (table.array, chosen) {
                (true, _) => json!({ "type": "array", "description": about, "items": schema }),
                (false, "") => schema,
                _ => json!({ "type": "object", "description": about, "additionalProperties": schema }),
            };
        }
        root
    }

    /// The page of all keys, after its introduction.
    pub fn page(&self, introduction: &str) -> String {
        let heading = |table: &Table| match (table.title, table.path, table.array) {
            ("", "", _) => "Top level".to_owned(),
            ("", path, true) => format!("`[[{path}]]`"),
            ("", path, false) => format!("`[{path}]`"),
            (title, ..) => title.to_owned(),
        };
        let chapters = self.0.iter().map(|t| format!("\n## {}\n\n{}", heading(t), t.reference()));
        introduction.to_owned() + &chapters.collect::<String>()
    }

    /// The reader refuses a wrong type in every key of the tables: it reads all of them. `completed` makes a file of an example.
    pub fn assert_all_are_read<T: std::fmt::Debug>(
        &self,
        completed: fn(&str) -> String,
        parse: impl Fn(&str) -> Result<T, FileError>,
    ) {
        // Of a type that no key has.
        let wrong = toml::Value::Array(vec![toml::Value::Array(Vec::new())]);
        for table in self.0 {
            for key in table.keys {
                let mut file: toml::Value = toml::from_str(&completed(key.example)).unwrap();
                assert!(put(&mut file, table.path, key.name, Some(&wrong)), "{}", key.example);
                let text = toml::to_string(&file).unwrap();
                let error = parse(&text).expect_err(&text).to_string();
                assert!(is_any_name(key.name) || error.contains(key.name), "{}: {error}\n{text}", key.name);
            }
        }
    }
}

/// The examples of a page.
pub fn examples(page: &str) -> Vec<&str> {
    page.split("```toml\n").skip(1).map(|block| block.split("\n```").next().unwrap()).collect()
}

/// Puts another value for a key into the table at `path`, or takes the key away; false if the table lacks it.
pub fn put(value: &mut toml::Value, path: &str, key: &str, new: Option<&toml::Value>) -> bool {
    match value {
        toml::Value::Array(items) => items.iter_mut().any(|item| put(item, path, key, new)),
        toml::Value::Table(table) => {
            let (name, rest) = path.split_once('.').unwrap_or((path, ""));
            let (name, rest) = if path.is_empty() { (key, None) } else { (name, Some(rest)) };
            let found: Vec<String> =
                table.keys().filter(|k| *k == name || is_any_name(name)).cloned().collect();
            found.into_iter().any(|k| match (rest, new) {
                (Some(rest), _) => put(&mut table[&k], rest, key, new),
                (None, Some(new)) => table.insert(k, new.clone()).is_some(),
                (None, None) => table.remove(&k).is_some(),
            })
        }
        _ => false,
    }
}

/// Compares a file with its expected text, or writes it if `PSIDPD_UPDATE_SCHEMA` is set.
pub fn assert_current(path: &Path, expected: &str) {
    if std::env::var_os("PSIDPD_UPDATE_SCHEMA").is_some() {
        std::fs::write(path, expected).unwrap();
    }
    let found = std::fs::read_to_string(path).unwrap_or_default();
    assert!(
        found.replace("\r\n", "\n") == expected,
        "{} is not current: run this test with PSIDPD_UPDATE_SCHEMA=1",
        path.display()
    );
}
