//! Templates for `psidpd new`: a commented scene file and its model.

use super::{Path, PathBuf};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Template {
    pub name: &'static str,
    pub about: &'static str,
    /// The text of the scene file, which names its model as a file beside it.
    pub scene: &'static str,
    pub model_name: &'static str,
    pub model: &'static str,
}

macro_rules! template {
    ($name:literal, $model:literal, $about:literal) => {
        Template {
            name: $name,
            about: $about,
            scene: include_str!(concat!("templates/", $name, ".toml")),
            model_name: concat!($model, ".toml"),
            model: include_str!(concat!("../../../models/", $model, ".toml")),
        }
    };
}

pub const TEMPLATES: &[Template] = &[
    template!("bulk", "standard-dpd", "a bulk fluid"),
    template!("slab", "warren2003-set6", "a slab of liquid between two surfaces"),
    template!("droplet", "spline-attractive", "a drop with its vapour"),
    template!("pendant-drop", "warren2003-set6", "a drop that hangs from a frozen support"),
    template!("demixing", "binary-2d", "two liquids, quenched until they separate"),
    template!("collision", "drop-collision", "two drops that meet in another liquid"),
    template!("channel", "standard-dpd", "a flow between walls of frozen particles"),
];

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TemplateError {
    #[error("{} already exists: choose another name, or remove it", .0.display())]
    Exists(PathBuf),
    #[error("{} cannot be written: {source}", path.display())]
    Output { path: PathBuf, source: std::io::Error },
}

impl Template {
    /// Writes the scene to `path`, with `.toml` if the path has no extension, and its model beside it, unless
    /// the same model is there. Nothing is overwritten. Returns the paths of the scene and of the model.
    pub fn write(&self, path: &Path) -> Result<[PathBuf; 2], TemplateError> {
        let scene = match path.extension() {
            Some(extension) if extension == "toml" => path.to_owned(),
            _ => PathBuf::from(format!("{}.toml", path.display())),
        };
        let model = scene.with_file_name(self.model_name);
        if scene.exists() || scene == model {
            return Err(TemplateError::Exists(scene));
        }
        let there = std::fs::read_to_string(&model).ok();
        if there.as_deref().is_some_and(|text| text != self.model) {
            return Err(TemplateError::Exists(model));
        }
        let folder = scene.parent().unwrap_or(Path::new(""));
        std::fs::create_dir_all(folder).map_err(output(folder))?;
        if there.is_none() {
            create(&model, self.model)?;
        }
        create(&scene, self.scene)?;
        Ok([scene, model])
    }
}

/// Writes a file that must not exist.
fn create(path: &Path, text: &str) -> Result<(), TemplateError> {
    use std::io::Write;
    let file = std::fs::OpenOptions::new().write(true).create_new(true).open(path);
    file.and_then(|mut file| file.write_all(text.as_bytes())).map_err(output(path))
}

fn output(path: &Path) -> impl FnOnce(std::io::Error) -> TemplateError + '_ {
    move |source| match source.kind() {
        std::io::ErrorKind::AlreadyExists => TemplateError::Exists(path.to_owned()),
        _ => TemplateError::Output { path: path.to_owned(), source },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn templates_are_written_with_their_models_and_open() {
        let folder = tempfile::tempdir().unwrap();
        for template in TEMPLATES {
            let [scene, model] = template.write(&folder.path().join("deep").join(template.name)).unwrap();
            assert!(scene.ends_with(format!("{}.toml", template.name)) && model.is_file());
            let read = Scene::open(&scene).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(read.model_path, model);
            assert!(template.scene.starts_with("# "));
        }
    }

    #[test]
    fn nothing_is_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        let [scene, model] = TEMPLATES[0].write(&path).unwrap();
        assert_eq!(scene, path);
        assert!(matches!(TEMPLATES[0].write(&path), Err(TemplateError::Exists(p)) if p == path));
        // Another scene uses the same model.
        TEMPLATES[0].write(&folder.path().join("other")).unwrap();
        std::fs::write(&model, "changed").unwrap();
        assert!(
            matches!(TEMPLATES[0].write(&folder.path().join("third")), Err(TemplateError::Exists(p)) if p == model)
        );
        assert!(!folder.path().join("third.toml").exists());
        let own = folder.path().join("standard-dpd");
        assert!(matches!(TEMPLATES[0].write(&own), Err(TemplateError::Exists(_))));
    }
}
