use super::{Document, Failure, Model, Path};
use psidpd_core::document::{FileError, Source};
use psidpd_dynamics::scene::{Edit, Scene, edit_model};
use std::sync::Arc;

#[derive(Debug, Clone, Default, clap::Args)]
pub struct Settings {
    /// Another value for a key of the scene or of its model: kT=0.9, density=3, stage.produce.dt=0.02,
    /// model.parameters.A=-50; can be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub edits: Vec<Edit>,
}

impl Settings {
    /// Reads a scene with these values.
    pub fn scene(&self, path: &Path) -> Result<Scene, Failure> {
        Ok(Scene::open_with(path, &self.edits)?)
    }

    /// Reads a model with these values. The second result is kT, if it is one of them.
    pub fn model(&self, path: &Path) -> Result<(Model, Option<f64>), FileError> {
        if self.edits.is_empty() {
            return Ok((Model::open(path)?, None));
        }
        let (of_host, of_model): (Vec<_>, Vec<_>) = self.edits.iter().partition(|e| e.key() == "kT");
        let of_model: Vec<Edit> = of_model.into_iter().cloned().collect();
        let document = Document::open(path)?;
        let text = edit_model(document.source.text(), &of_model)?;
        let model = Model::parse_in(path, &text)?;
        let wrong = |e: &&Edit| {
            let source = Arc::new(Source::new("--set", ""));
            FileError::new(&source, 0..0, "kT", format!("{e} of --set: {POSITIVE}"))
        };
        let positive =
            |e: &&Edit| e.number().filter(|kt| *kt > 0.0 && kt.is_finite()).ok_or_else(|| wrong(e));
        Ok((model, of_host.last().map(positive).transpose()?))
    }
}

const POSITIVE: &str = "a temperature is a positive number";

/// Parses a temperature.
pub fn temperature(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|e| format!("{e}"))?;
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(POSITIVE.into()) }
}
