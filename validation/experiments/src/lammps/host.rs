//! LAMMPS with psidpd's pair styles, as a program.

use crate::ExperimentError;
use psidpd_formats::files::{Existing, work_folder, write_bytes};
use psidpd_lammps_host::{Host, LammpsError, plugin};
use std::path::{Path, PathBuf};
use std::time::Duration;

const SCRIPT: &str = "in.lammps";

#[derive(Debug, Clone)]
pub struct PluginHost {
    pub host: Host,
    /// The plugin to load; `None` where the program has the styles in it.
    pub plugin: Option<PathBuf>,
}

impl PluginHost {
    /// Builds the plugin for `host`, if necessary.
    pub fn open(host: Host, note: &dyn Fn(&str)) -> Result<PluginHost, LammpsError> {
        let plugin = plugin::build(&host, note)?;
        plugin::check(&host, &plugin)?;
        // A LAMMPS without plugins has its own program with the styles in it.
        Ok(match plugin::launcher(&plugin) {
            Some(launcher) => PluginHost { host: host.with_program(&launcher), plugin: None },
            None => PluginHost { host, plugin: Some(plugin) },
        })
    }

    /// The LAMMPS in `place`, or one that is installed if it is missing, with the plugin, and its version in words.
    pub fn prepared(place: Option<&Path>, note: &dyn Fn(&str)) -> Result<(PluginHost, String), LammpsError> {
        let host = place.map_or_else(|| plugin::install_to_build(note), Host::at)?;
        let version = host.version()?;
        Ok((PluginHost::open(host, note)?, version.name))
    }

    /// The LAMMPS that is installed, with the plugin.
    pub fn find(note: &dyn Fn(&str)) -> Result<PluginHost, LammpsError> {
        PluginHost::open(Host::find()?, note)
    }

    /// Runs a script on `ranks` ranks in `folder`, at most for `limit`, and gives what LAMMPS prints. Its variable `plugin` is the
    /// plugin's path.
    pub fn run(
        &self,
        ranks: usize,
        folder: &Path,
        script: &str,
        log: &str,
        limit: Duration,
    ) -> Result<String, ExperimentError> {
        work_folder(folder)?;
        let path = folder.join(SCRIPT);
        write_bytes(&path, Existing::Keep, script.as_bytes())?;
        let plugin = self.plugin.as_ref().map(|p| p.display().to_string()).unwrap_or_default();
        let arguments = ["-log", log, "-var", "plugin", plugin.as_str()];
        Ok(self.host.run_script(ranks, folder, &path, &arguments, limit)?.stdout)
    }
}
