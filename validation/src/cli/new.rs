use super::*;
use psidpd_dynamics::scene::{TEMPLATES, Template};

/// Write a scene to begin with, and its model.
#[derive(Debug, clap::Args)]
#[command(after_help = templates())]
pub struct Arguments {
    /// The scene file to write; `.toml` is added if it has no extension.
    name: PathBuf,
    /// What to begin with.
    #[arg(long, default_value = TEMPLATES[0].name, value_parser = names())]
    template: String,
}

fn names() -> clap::builder::PossibleValuesParser {
    TEMPLATES.iter().map(|t| t.name).collect::<Vec<_>>().into()
}

/// The help text with a line for each template.
fn templates() -> String {
    let lines = TEMPLATES.iter().map(|t| format!("  {:<14}{}\n", t.name, t.about));
    format!("Templates:\n{}", lines.collect::<String>())
}

pub fn run(arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let chosen: Option<&Template> = TEMPLATES.iter().find(|t| t.name == arguments.template);
    let template = chosen.unwrap_or(&TEMPLATES[0]);
    let [scene, model] = template.write(&arguments.name, told.existing)?;
    say!("{}: {}", scene.display(), template.about);
    say!("{}: its model", model.display());
    say!("run it: psidpd run {} --out {}", scene.display(), scene.with_extension("").display());
    conclude(told, &json!({"scene": shown(&scene), "model": shown(&model), "template": template.name}), true)
}
