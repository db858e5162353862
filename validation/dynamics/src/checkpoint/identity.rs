//! What tells one run from another: the keys of its scene and of its model.

use super::Written;
use crate::scene::Scene;
use psidpd_core::document::open_regular;
use psidpd_core::engine::Precision;
use psidpd_core::model::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The values of all keys of a scene and of its model. Comments, the order of keys and number formats do not count.
///
/// A key that names a file has the content of the file as its value. Titles and the interval of checkpoints
/// are left out: they change nothing in a trajectory. The device is left out because a run may continue on another.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Identity {
    scene: BTreeMap<String, String>,
    model: BTreeMap<String, String>,
}

/// Keys that name files, in any table.
const FILES: [&str; 2] = ["file", "table"];

impl Identity {
    pub fn of_scene(scene: &Scene) -> Identity {
        Identity::of(scene.source.text(), &scene.folder, scene.precision(), &scene.model)
    }

    /// The identity of a scene: `scene` is its text, and its paths start from `folder`.
    pub fn of(scene: &str, folder: &Path, precision: Precision, model: &Model) -> Identity {
        let model = model.source();
        let mut of_scene =
            keys(scene, folder, &["title", "model", "output.checkpoint", "precision", "device"]);
        // The precision in use can come from the file, the command line or the default.
        of_scene.insert("precision".into(), format!("{:?}", precision.to_string()));
        let beside_model = Path::new(model.name()).parent().unwrap_or(Path::new(""));
        Identity {
            // The content of the model is compared, not its path.
            scene: of_scene,
            model: keys(model.text(), beside_model, &["title", "reference", "literature"]),
        }
    }

    /// The number of steps of the last stage, with its key.
    pub fn last_steps(&self) -> Option<(String, u64)> {
        let stages = (1..).map(|k| format!("stage[{k}].steps"));
        let last = stages.take_while(|key| self.scene.contains_key(key)).last();
        let key = last.unwrap_or_else(|| "steps".into());
        let steps = self.scene.get(&key)?.parse().ok()?;
        Some((key, steps))
    }

    /// Whether nothing but the number of steps of the last stage differs from `before`, and both numbers: before and now.
    pub fn lengths(&self, before: &Identity) -> Option<[u64; 2]> {
        let ((key, steps), (_, earlier)) = (self.last_steps()?, before.last_steps()?);
        let mut alike = before.clone();
        alike.scene.insert(key.clone(), self.scene.get(&key)?.clone());
        (alike == *self && steps != earlier).then_some([earlier, steps])
    }

    /// The keys whose values differ from those in `before`, each with both values.
    pub fn differences(&self, before: &Identity) -> Vec<String> {
        let pairs = [("", &self.scene, &before.scene), ("the model's ", &self.model, &before.model)];
        let mut found = Vec::new();
        for (whose, now, before) in pairs {
            for (key, value) in now {
                match before.get(key) {
                    None => found.push(format!("{whose}{key} is {value}, was not given")),
                    Some(old) if old != value => found.push(format!("{whose}{key} is {value}, was {old}")),
                    Some(_) => {}
                }
            }
            for (key, old) in before.iter().filter(|(key, _)| !now.contains_key(*key)) {
                found.push(format!("{whose}{key} is not given, was {old}"));
            }
        }
        found
    }
}

fn keys(text: &str, folder: &Path, without: &[&str]) -> BTreeMap<String, String> {
    let mut keys = BTreeMap::new();
    match text.parse::<toml::Table>() {
        Ok(table) => collect(&toml::Value::Table(table), "", folder, &mut keys),
        // A scene has been parsed before, so its text is TOML. If parsing failed, the text itself would
        // identify the scene.
        Err(_) => _ = keys.insert("text".into(), text.to_owned()),
    }
    keys.retain(|key, _| !without.iter().any(|w| key == w || key.starts_with(&format!("{w}["))));
    keys
}

fn collect(value: &toml::Value, path: &str, folder: &Path, keys: &mut BTreeMap<String, String>) {
    let is_table = |value: &toml::Value| matches!(value, toml::Value::Table(_));
    match value {
        toml::Value::Table(table) => {
            for (key, value) in table {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                let content = value.as_str().filter(|_| FILES.contains(&key.as_str()));
                match content.and_then(|name| content_of(&folder.join(name))) {
                    Some(content) => _ = keys.insert(path, content),
                    None => collect(value, &path, folder, keys),
                }
            }
        }
        toml::Value::Array(items) if items.iter().any(is_table) => {
            for (k, item) in items.iter().enumerate() {
                collect(item, &format!("{path}[{}]", k + 1), folder, keys);
            }
        }
        _ => _ = keys.insert(path.to_owned(), written(value)),
    }
}

/// Writes equal values (not tables) as equal texts.
fn written(value: &toml::Value) -> String {
    match value {
        toml::Value::Integer(x) => format!("{x}"),
        // The numbers 1 and 1.0 are equal.
        toml::Value::Float(x) => format!("{x}"),
        toml::Value::Array(items) => {
            format!("[{}]", items.iter().map(written).collect::<Vec<_>>().join(", "))
        }
        _ => value.to_string(),
    }
}

/// The length and checksum of a file's content; `None` if the file cannot be read.
fn content_of(path: &Path) -> Option<String> {
    let Written { length, checksum } = Written::of(open_regular(path).ok()?, u64::MAX).ok()?;
    Some(format!("a file of {length} bytes with the CRC-32 {checksum:08x}"))
}
