//! Templates for `psidpd new`: a commented scene file and its model.

use super::{Path, PathBuf};
use psidpd_core::document::open_regular;
use psidpd_formats::files::{Existing, PathError, there, write_bytes, write_new};
use std::ffi::OsStr;
use std::fs::create_dir_all;

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
    template!("channel", "standard-dpd", "a flow between walls"),
];

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TemplateError {
    #[error("{} already exists: choose another name, or replace it with --overwrite", .0.display())]
    Exists(PathBuf),
    #[error("{} names no file: give the scene a name, as drop.toml", .0.display())]
    NoName(PathBuf),
    #[error("{} cannot be written: {}", .0.path.display(), .0.cause)]
    Output(#[from] PathError),
}

impl Template {
    /// Writes the scene to `path`, with `.toml` if the path has no extension, and its model beside it, unless
    /// the same model is there. Nothing is overwritten. Returns the paths of the scene and of the model.
    pub fn write(&self, path: &Path, existing: Existing) -> Result<[PathBuf; 2], TemplateError> {
        let name = path.file_name().ok_or_else(|| TemplateError::NoName(path.to_owned()))?;
        let scene = match path.extension() {
            Some(extension) if extension == "toml" => path.to_owned(),
            _ => path.with_file_name([name, ".toml".as_ref()].join(OsStr::new(""))),
        };
        let model = scene.with_file_name(self.model_name);
        let keep = existing == Existing::Keep;
        if scene == model || keep && there(&scene) {
            return Err(TemplateError::Exists(scene));
        }
        let read = |path: &Path| open_regular(path).and_then(std::io::read_to_string).ok();
        let same = there(&model) && read(&model).as_deref() == Some(self.model);
        if keep && there(&model) && !same {
            return Err(TemplateError::Exists(model));
        }
        let folder = scene.parent().unwrap_or(Path::new(""));
        create_dir_all(folder).map_err(PathError::at("write", folder))?;
        if !same {
            create(&model, self.model, keep)?;
        }
        create(&scene, self.scene, keep)?;
        Ok([scene, model])
    }
}

/// Writes a file; if `keep` is set it must not exist.
fn create(path: &Path, text: &str, keep: bool) -> Result<(), TemplateError> {
    if !keep {
        return Ok(write_bytes(path, Existing::Replace, text.as_bytes())?);
    }
    write_new(path, text.as_bytes()).map_err(|error| match error.cause.kind() {
        std::io::ErrorKind::AlreadyExists => TemplateError::Exists(path.to_owned()),
        _ => error.into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn templates_are_written_with_their_models_and_open() {
        let folder = tempfile::tempdir().unwrap();
        for template in TEMPLATES {
            let [scene, model] =
                template.write(&folder.path().join("deep").join(template.name), Existing::Keep).unwrap();
            assert!(scene.ends_with(format!("{}.toml", template.name)) && model.is_file());
            let read = Scene::open(&scene).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(read.model_path, model);
            assert!(template.scene.starts_with("# "));
        }
    }

    /// A folder's name is that of a file beside it.
    #[test]
    fn scenes_have_a_name() {
        let folder = tempfile::tempdir().unwrap();
        for path in ["", ".", "..", "/", "deep/.."] {
            let refused = TEMPLATES[0].write(Path::new(path), Existing::Keep);
            assert!(matches!(refused, Err(TemplateError::NoName(_))), "{path:?}: {refused:?}");
        }
        let [scene, _] = TEMPLATES[0].write(&folder.path().join("drops/"), Existing::Keep).unwrap();
        assert_eq!(scene, folder.path().join("drops.toml"));
    }

    #[test]
    fn nothing_is_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        let [scene, model] = TEMPLATES[0].write(&path, Existing::Keep).unwrap();
        assert_eq!(scene, path);
        assert!(
            matches!(TEMPLATES[0].write(&path, Existing::Keep), Err(TemplateError::Exists(p)) if p == path)
        );
        // Another scene uses the same model.
        TEMPLATES[0].write(&folder.path().join("other"), Existing::Keep).unwrap();
        std::fs::write(&model, "changed").unwrap();
        assert!(
            matches!(TEMPLATES[0].write(&folder.path().join("third"), Existing::Keep), Err(TemplateError::Exists(p)) if p == model)
        );
        assert!(!folder.path().join("third.toml").exists());
        let own = folder.path().join("standard-dpd");
        assert!(matches!(TEMPLATES[0].write(&own, Existing::Keep), Err(TemplateError::Exists(_))));
    }
}
