//! The key `device`, and what devices refuse, at its place in the file.

use super::{Device, Document, FileError, Precision, Scene, Section, Value, stage};
use crate::device::{DeviceError, refused_step};

pub fn read(value: &Value) -> Result<Device, FileError> {
    let name = value.string()?.value;
    name.parse().map_err(|message| value.error(message))
}

impl Scene {
    /// The first setting that the device of this scene does not compute, with its place if the file gives it.
    pub fn refused_by_device(&self) -> Option<(DeviceError, Option<FileError>)> {
        if self.device == Device::Cpu {
            return None;
        }
        if self.precision() == Precision::Double {
            let lacks = DeviceError::Lacks("double precision".into());
            return Some(self.located(lacks, |root| root.get("precision")));
        }
        let walls = self.domain.periodic()[..self.model.dimensions()].contains(&false);
        self.stages.iter().find_map(|stage| {
            let lacks = DeviceError::Lacks(refused_step(stage.integrator, walls)?);
            Some(self.located(lacks, |root| stage::place_of_integrator(root, &stage.name)))
        })
    }

    /// An error of the device with its place: that of `find`, or else of the key `device`; `None` if the file has neither.
    pub fn located(
        &self,
        error: DeviceError,
        find: impl for<'a> Fn(&Section<'a>) -> Option<Value<'a>>,
    ) -> (DeviceError, Option<FileError>) {
        let document = Document::parse(self.source.name(), self.source.text()).ok();
        let at = document.as_ref().and_then(|document| {
            let root = document.root();
            let value = find(&root).or_else(|| root.get("device"))?;
            let found = value.error(error.to_string());
            Some(error.help().map_or(found.clone(), |help| found.with_help(help)))
        });
        (error, at)
    }
}
