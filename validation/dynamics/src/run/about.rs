//! The description of a run in `about.json`.

use crate::prediction;
use crate::scene::Scene;
use psidpd_formats::about::{Column, THERMO, UNITS};
use psidpd_formats::{About, AboutDensity, AboutStage};

pub fn about(scene: &Scene) -> About {
    let mut begin = 0;
    let moving = scene.model.walls().iter().any(|wall| wall.velocity != [0.0; 3]);
    let stages = scene.stages.iter().map(|s| {
        let stage = AboutStage {
            name: s.name.clone(),
            begin,
            end: begin + s.steps,
            dt: s.dt,
            kt: s.kt,
            thermostat: s.thermostat,
            body_forces: s.body_forces && !scene.body_forces.is_empty() || moving,
            integrator: s.integrator.to_string(),
        };
        begin = stage.end;
        stage
    });
    let stages: Vec<AboutStage> = stages.collect();
    let [x, y, z] = scene.domain.periodic();
    // Reading the scene has checked the model at this temperature, so the default is never used.
    let densities = scene.model.at(scene.kt).map(|f| f.densities).unwrap_or_default();
    About {
        program: format!("psidpd {}", env!("CARGO_PKG_VERSION")),
        title: scene.title.clone(),
        model: scene.model.title.clone(),
        dimensions: scene.model.dimensions(),
        species: scene.model.species().to_vec(),
        masses: scene.mass.clone(),
        densities: densities
            .iter()
            .map(|d| AboutDensity {
                name: d.name.clone(),
                kernel: d.kernel.kind().name().into(),
                range: d.kernel.range(),
            })
            .collect(),
        kt: scene.kt,
        seed: scene.seed,
        precision: scene.precision().to_string(),
        device: scene.device.to_string(),
        box_origin: scene.domain.origin(),
        box_edges: [0, 1, 2].map(|k| scene.domain.edge(k)),
        box_periodic: [x, y, z && scene.model.dimensions() == 3],
        stages,
        units: UNITS.into(),
        thermo: THERMO.map(|c| column(c, scene.model.dimensions())).to_vec(),
        expected: scene
            .model
            .at(scene.stages.last().map_or(scene.kt, |s| s.kt))
            .map(|fluid| prediction::expected(&scene.model, &fluid, scene.uniform_density()))
            .unwrap_or_default(),
    }
}

fn column((name, title, unit): (&str, &str, &str), dimensions: usize) -> Column {
    Column { name: name.into(), title: title.into(), unit: unit.replace("^d", &format!("^{dimensions}")) }
}
