use super::Options;
use crate::ExperimentError;
use crate::bulk;
use psidpd_dynamics::run::Begin;
use psidpd_dynamics::scene::Scene;
use psidpd_observe::Measured;
use std::path::Path;

/// What a slab of liquid in its vapour has.
pub struct Slab {
    pub liquid: Measured,
    pub tension: Measured,
}

/// Runs a slab of the model in the file `path`.
pub fn measure(path: &Path, options: &Options, folder: &Path) -> Result<Slab, ExperimentError> {
    let dt = options.sampling.dt;
    let text = format!(
        "title = \"slab\"\nmodel = \"trial.toml\"\nkT = 1.0\nseed = {}\nbox = [7.0, 7.0, 18.0]\ndt = {dt:?}\nequilibrate = {}\n\
         steps = {}\n[initial]\nkind = \"slab\"\naxis = \"z\"\nthickness = 9.0\ndensity = {:?}\n[output]\nthermo = 0\n[observe]\n\
         every = 10\nsurface_tension = {{ every = 20 }}\ninterface_width = true\n",
        options.sampling.seed,
        options.sampling.equilibrate * 3,
        options.sampling.steps * 8,
        options.density,
    );
    let scene = Scene::parse("slab", &text, path.parent().unwrap_or(Path::new("")))?;
    let observed = bulk::run(&scene, &folder.join("slab"), Begin::Overwrite, options.sampling.threads)?;
    Ok(Slab {
        liquid: observed.scalar("interface_width", "liquid"),
        tension: observed.scalar("surface_tension", "stress"),
    })
}
