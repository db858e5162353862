//! Export of a scene as a LAMMPS input deck for the pair style `dpd/psi`: initial state, model and script.
//!
//! The deck makes the same steps as [`run_scene`](psidpd_dynamics::run::run_scene), with the same noise. The
//! native runner computes the forces of the present step anew at the start of a stage, as LAMMPS does at the
//! start of a `run`. Both key the noise of a step by its number, so stages become `run` commands.

mod physics;

use crate::LammpsError;
use physics::Physics;
use psidpd_core::document::{Document, FileError, open_regular};
use psidpd_core::engine::noise::Law;
use psidpd_core::model::{Fluid, Model};
use psidpd_dynamics::integrator::{Counterpart, Integrator};
use psidpd_dynamics::particles::State;
use psidpd_dynamics::scene::{Scene, Stage};
use psidpd_formats::files::{Existing, may_replace, protect, write_bytes, write_result};
use psidpd_formats::{PathError, memory};
use std::fmt::Write;
use std::fs::create_dir_all;
use std::path::{Component, Path, PathBuf};

pub const SCRIPT: &str = "in.lammps";
pub const START: &str = "start.data";
pub const MODEL: &str = "model.toml";
pub const MODEL_WITHOUT_THERMOSTAT: &str = "model-without-thermostat.toml";

pub const FILES: [&str; 4] = [SCRIPT, START, MODEL, MODEL_WITHOUT_THERMOSTAT];

/// Largest number of steps of one `run` command.
const MOST_STEPS: u64 = i32::MAX as u64;

/// Largest number of body forces: each may need three of LAMMPS's 32 groups.
const MOST_BODY_FORCES: usize = 9;

/// What a script has beside what its scene says: by default it is the script of the plugin for the whole scene.
#[derive(Debug, Clone, Copy)]
pub struct Script<'a> {
    /// Whether it loads the plugin.
    pub plugin: bool,
    /// Another pair style than the plugin's: the atom style that it needs, and its commands.
    pub style: Option<(&'a str, &'a str)>,
    /// Commands before the last `run`.
    pub before_last_run: &'a str,
    /// Whether the last state is written.
    pub final_data: bool,
}

impl Default for Script<'_> {
    fn default() -> Self {
        Script { plugin: true, style: None, before_last_run: "", final_data: true }
    }
}

/// Writes the deck of `scene` to the folder `out`, which is created if it is missing, and returns the paths of its files.
pub fn write(scene: &Scene, out: &Path, existing: Existing) -> Result<Vec<PathBuf>, LammpsError> {
    let script = script_of(scene, Script::default())?;
    let particles = scene.initial.count();
    memory::check(particles, memory::PARTICLE)?;
    let _inputs = protect(scene.inputs());
    // No file is written unless all can be: existing files may be somebody's work.
    let (_, tables) = copy_of_model(scene)?;
    let needless = |name: &Path| {
        name == Path::new(MODEL_WITHOUT_THERMOSTAT) && scene.stages.iter().all(|s| s.thermostat)
    };
    let names = FILES.map(PathBuf::from).into_iter().filter(|name| !needless(name));
    for path in names.map(|name| out.join(name)) {
        may_replace(&path, existing)?;
    }
    for (from, to) in &tables {
        if !is_same_file(from, &out.join(to)) {
            may_replace(&out.join(to), existing)?;
        }
    }
    let mut files = vec![PathBuf::from(SCRIPT)];
    files.extend(write_inputs(scene, &scene.initial_state(), out, existing)?);
    write_bytes(&out.join(SCRIPT), existing, script.as_bytes())?;
    Ok(files)
}

/// Writes what the script of a scene reads, with `state` as its start, and returns the names of the files.
pub fn write_inputs(
    scene: &Scene,
    state: &State,
    out: &Path,
    existing: Existing,
) -> Result<Vec<PathBuf>, LammpsError> {
    create_dir_all(out).map_err(PathError::at("write", out))?;
    let mut files = vec![PathBuf::from(START), PathBuf::from(MODEL)];
    let (text, tables) = copy_of_model(scene)?;
    for (from, to) in tables {
        let path = out.join(&to);
        if let Some(parent) = path.parent() {
            create_dir_all(parent).map_err(PathError::at("write", parent))?;
        }
        if !is_same_file(&from, &path) {
            let mut table = open_regular(&from).map_err(PathError::at("read", &from))?;
            write_result(&path, existing, |out| std::io::copy(&mut table, out).map(drop))?;
        }
        files.push(to);
    }
    write_bytes(&out.join(MODEL), existing, text.as_bytes())?;
    compare(scene, &out.join(MODEL), true).and_then(|same| {
        if same { Ok(()) } else { Err(LammpsError::Copy { model: scene.model_path.clone() }) }
    })?;
    if scene.stages.iter().any(|s| !s.thermostat) {
        let path = out.join(MODEL_WITHOUT_THERMOSTAT);
        write_bytes(&path, existing, without_thermostat(&text).as_bytes())?;
        if !compare(scene, &path, false).unwrap_or(false) {
            return Err(LammpsError::Thermostat { model: scene.model_path.clone() });
        }
        files.push(MODEL_WITHOUT_THERMOSTAT.into());
    }

    write_start(scene, state, &out.join(START), existing)?;
    Ok(files)
}

fn check(scene: &Scene) -> Result<(), LammpsError> {
    if scene.seed == 0 {
        return Err(LammpsError::Seed(scene.seed));
    }
    let reversed = scene.body_forces.iter().any(|b| b.reversed_along.is_some());
    let orthogonal = (0..3).all(|k| (0..3).all(|c| c == k || scene.domain.edge(k)[c] == 0.0));
    if reversed && !orthogonal {
        return Err(LammpsError::Tilt);
    }
    if scene.body_forces.len() > MOST_BODY_FORCES {
        return Err(LammpsError::BodyForces { found: scene.body_forces.len(), most: MOST_BODY_FORCES });
    }
    for stage in &scene.stages {
        if stage.steps > MOST_STEPS {
            return Err(LammpsError::Steps {
                stage: stage.name.clone(),
                steps: stage.steps,
                most: MOST_STEPS,
            });
        }
        let integrator = stage.integrator;
        if integrator.properties().lammps == Counterpart::None {
            return Err(LammpsError::Integrator {
                stage: stage.name.clone(),
                name: integrator.name(),
                integrator,
            });
        }
    }
    Ok(())
}

/// The text of the model with its tables in the same folder, and the source and target of each copied table.
fn copy_of_model(scene: &Scene) -> Result<(String, Vec<(PathBuf, PathBuf)>), LammpsError> {
    let source = scene.model.source();
    let mut text = source.text().to_owned();
    let directory = scene.model_path.parent().unwrap_or(Path::new(""));
    let mut copies: Vec<(PathBuf, PathBuf)> = Vec::new();
    for name in tables(source.name(), source.text())? {
        let path = Path::new(&name);
        let from = directory.join(path);
        let inside = path.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        let to = match path.file_name() {
            Some(file) if !inside => {
                let short = file.to_string_lossy().into_owned();
                for quote in ['"', '\''] {
                    text = text.replace(&format!("{quote}{name}{quote}"), &format!("{quote}{short}{quote}"));
                }
                PathBuf::from(short)
            }
            _ => path.to_owned(),
        };
        match copies.iter().find(|(_, other)| *other == to) {
            None => copies.push((from, to)),
            Some((other, _)) if *other == from => {}
            Some(_) => return Err(LammpsError::Tables { model: scene.model_path.clone(), table: to }),
        }
    }
    Ok((text, copies))
}

/// Names of the tables of a model, as the model writes them.
fn tables(name: &str, text: &str) -> Result<Vec<String>, FileError> {
    let document = Document::parse(name, text)?;
    let root = document.root();
    let mut sections = Vec::new();
    if let Some(excess) = root.get("excess_free_energy").and_then(|v| v.as_section()) {
        let curves = excess.entries().into_iter().filter_map(|(_, value)| value.as_section());
        for curve in curves {
            let pressure = curve.get("pressure").and_then(|p| p.as_section());
            sections.extend([curve].into_iter().chain(pressure).map(|table| (table, "table")));
        }
    }
    for pair in root.get("pair").and_then(|v| v.as_array()).unwrap_or_default() {
        sections.extend(pair.as_section().map(|pair| (pair, "file")));
    }
    let names = sections.iter().filter_map(|(section, key)| Some(section.get(key)?.as_str()?.to_owned()));
    Ok(names.collect())
}

/// The text without its `[[thermostat]]` sections.
fn without_thermostat(text: &str) -> String {
    let mut inside = false;
    let mut kept = String::from("# As model.toml, without drag and noise.\n");
    for line in text.lines() {
        if line.trim_start().starts_with('[') {
            let header: String = line.chars().filter(|c| !c.is_whitespace()).collect();
            inside = header.starts_with("[[thermostat]]");
        }
        if !inside {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    kept
}

/// Whether the model at `path` equals the fluids of the scene, without their thermostat if `thermostat` is false.
fn compare(scene: &Scene, path: &Path, thermostat: bool) -> Result<bool, LammpsError> {
    let copy = Model::open(path)?;
    let same = |a: &Fluid, b: &Fluid| {
        let thermostats = match thermostat {
            true => format!("{:?}", a.thermostats) == format!("{:?}", b.thermostats),
            false => b.thermostats.iter().all(Option::is_none),
        };
        a.dimensions == b.dimensions
            && a.species == b.species
            && format!("{:?}", a.densities) == format!("{:?}", b.densities)
            && format!("{:?}", a.excess) == format!("{:?}", b.excess)
            && format!("{:?}", a.pairs) == format!("{:?}", b.pairs)
            && thermostats
    };
    for stage in scene.stages.iter().filter(|s| s.thermostat == thermostat) {
        if !same(&scene.model.at(stage.kt)?, &copy.at(stage.kt)?) {
            return Ok(false);
        }
    }
    Ok(true)
}

fn is_same_file(one: &Path, other: &Path) -> bool {
    other.canonicalize().is_ok_and(|there| one.canonicalize().is_ok_and(|here| here == there))
}

fn write_start(scene: &Scene, state: &State, path: &Path, existing: Existing) -> Result<(), LammpsError> {
    let mut data = state.to_data(&format!("psidpd: {}, step 0", one_line(&scene.title)));
    data.sort_by_id();
    if scene.model.dimensions() == 2 {
        // LAMMPS requires the plane z = 0, and nothing depends on the third edge.
        (data.boxlo[2], data.boxhi[2]) = (-0.5, 0.5);
        data.tilt = data.tilt.map(|[xy, _, _]| [xy, 0.0, 0.0]);
        for atom in &mut data.atoms {
            (atom.x[2], atom.image[2]) = (0.0, 0);
        }
    }
    Ok(data.write_over(path, existing)?)
}

pub fn script_of(scene: &Scene, script: Script) -> Result<String, LammpsError> {
    check(scene)?;
    if script.style.is_some() && !scene.model.walls().is_empty() {
        return Err(LammpsError::Walls);
    }
    let mut s = String::new();
    // Writing to a String cannot fail.
    let _ = write_script(scene, script, &mut s);
    Ok(s)
}

fn write_script(scene: &Scene, script: Script, s: &mut String) -> std::fmt::Result {
    let physics = Physics::of(scene);
    writeln!(s, "# {}", one_line(&scene.title))?;
    writeln!(s, "# lmp -in {SCRIPT} -var plugin PATH/psidpdplugin.so\n")?;
    writeln!(s, "variable      plugin index psidpdplugin.so\n")?;
    writeln!(s, "units         lj")?;
    writeln!(s, "dimension     {}", scene.model.dimensions())?;
    writeln!(s, "boundary      {}", physics.boundary())?;
    writeln!(s, "atom_style    {}", script.style.map_or("atomic", |(atoms, _)| atoms))?;
    // The styles of the plugin leave no forces on ghosts.
    writeln!(s, "newton        {}", if script.style.is_some() { "on" } else { "off" })?;
    if script.style.is_none() && physics.boundary() == "p p p" {
        writeln!(s, "# on one rank, without computes or fixes that need ghosts, these two are faster:")?;
        writeln!(s, "# neighbor      0.0 bin")?;
        writeln!(s, "# neigh_modify  delay 0 every 20 check no")?;
    }
    writeln!(s, "comm_modify   vel yes")?;
    writeln!(s, "read_data     {START}\n")?;
    if script.plugin {
        writeln!(s, "# to be left out where LAMMPS has the styles already")?;
        writeln!(s, "plugin        load ${{plugin}}\n")?;
    }
    physics.write_surroundings(s)?;
    writeln!(s)?;
    writeln!(s, "thermo_style  custom step time temp pe ke press pxx pyy pzz pxy pxz pyz")?;
    writeln!(s, "thermo_modify norm no format float %.17g")?;
    physics.write_temperature(s)?;
    writeln!(s, "thermo        {}", scene.output.thermo)?;
    if scene.output.dump > 0 {
        writeln!(
            s,
            "dump          frames all custom {} dump.lammpstrj id type x y z vx vy vz",
            scene.output.dump
        )?;
        writeln!(s, "dump_modify   frames sort id format float %.17g")?;
    }
    let mut before: Option<&Stage> = None;
    for (k, stage) in scene.stages.iter().enumerate() {
        writeln!(s, "\n# {}", one_line(&stage.label()))?;
        if let Integrator::GrootWarren { .. } = stage.integrator {
            writeln!(s, "# groot-warren with lambda = 0.5 is velocity Verlet")?;
        }
        if before.is_none_or(|b| (b.kt, b.thermostat) != (stage.kt, stage.thermostat)) {
            let model = if stage.thermostat { MODEL } else { MODEL_WITHOUT_THERMOSTAT };
            if !stage.thermostat {
                writeln!(s, "# thermostat = false: a copy of the model without drag and noise")?;
            }
            if let Some((_, commands)) = script.style {
                s.push_str(commands);
            } else {
                let precision = scene.precision();
                writeln!(s, "pair_style    dpd/psi {:?} {} precision {precision}", stage.kt, scene.seed)?;
                writeln!(s, "pair_coeff    * * {model} {}", scene.model.species().join(" "))?;
            }
        }
        if before.is_none_or(|b| motion(&b.integrator) != motion(&stage.integrator)) {
            if before.is_some() {
                writeln!(s, "unfix         move")?;
            }
            writeln!(s, "fix           move {} {}", physics.mobile, motion(&stage.integrator))?;
        }
        if before.is_none_or(|b| b.thermostat != stage.thermostat) {
            physics.write_matter(s, stage, before.is_some())?;
        }
        match (before.is_some_and(|b| b.body_forces), stage.body_forces) {
            (false, true) => physics.write_body_forces(s)?,
            (true, false) => physics.write_end_of_body_forces(s)?,
            _ => {}
        }
        writeln!(s, "timestep      {:?}", stage.dt)?;
        if k + 1 == scene.stages.len() {
            s.push_str(script.before_last_run);
        }
        writeln!(s, "run           {}", stage.steps)?;
        before = Some(stage);
    }
    if script.final_data {
        writeln!(s, "\nwrite_data    final.data nocoeff")?;
    }
    Ok(())
}

/// The style and the arguments of the fix that integrates.
fn motion(integrator: &Integrator) -> String {
    let mut integrator = *integrator;
    if integrator.properties().lammps != Counterpart::Splitting {
        return "nve".to_owned();
    }
    let mut text = format!("dpd/splitting {}", integrator.name());
    if let Some((lambda, _)) = integrator.settings().lambda {
        text += &format!(" lambda {lambda:?}");
    }
    if let Some(gradient) = integrator.settings().gradient {
        text += &format!(" gradient {gradient:?}");
    }
    if let Some(coupling) = integrator.settings().coupling.filter(|coupling| coupling.every > 1) {
        text += &format!(" every {}", coupling.every);
    }
    if let Some(Law::Uniform) = integrator.noise() {
        text += " noise uniform";
    }
    text
}

/// Makes a title fit for a comment: one line, without `&`, which continues a line, and without double quotes,
/// because three of them begin a multi-line text in LAMMPS.
fn one_line(text: &str) -> String {
    let plain = |c: char| match c {
        '&' => ' ',
        '"' => '\'',
        c if c.is_control() => ' ',
        c => c,
    };
    text.chars().map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_dynamics::integrator::Coupling;

    #[test]
    fn steps_become_arguments_of_a_fix() {
        let coupling = Coupling { every: 3, noise: Law::Uniform, ..Coupling::DEFAULT };
        let two_stage = Integrator::TwoStage { lambda: 0.2, coupling };
        assert_eq!(motion(&two_stage), "dpd/splitting two-stage lambda 0.2 every 3 noise uniform");
        let force_gradient = Integrator::ForceGradient { lambda: 0.17, gradient: 0.04, coupling };
        assert_eq!(
            motion(&force_gradient),
            "dpd/splitting force-gradient lambda 0.17 gradient 0.04 every 3 noise uniform"
        );
        assert_eq!(motion(&Integrator::Aboba(Coupling::DEFAULT)), "dpd/splitting aboba");
        assert_eq!(motion(&Integrator::VelocityVerlet), "nve");
    }

    /// A scene in two dimensions that starts from a file, in a box that begins at (1, −3) and leans by `tilt`.
    fn flat(folder: &Path, tilt: f64, more: &str) -> Scene {
        let model = "title = \"t\"\ndimensions = 2\nspecies = [\"A\", \"B\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";
        std::fs::write(folder.join("m.toml"), model).unwrap();
        let rows: String = (0..40)
            .map(|k| {
                format!(
                    "{} {} {} {} 0.0\n",
                    k + 1,
                    1 + k % 2,
                    1.5 + 0.6 * f64::from(k % 8),
                    f64::from(k / 8) - 2.5
                )
            })
            .collect();
        let lean = if tilt == 0.0 { String::new() } else { format!("{tilt} 0 0 xy xz yz\n") };
        let data = format!(
            "flat\n\n40 atoms\n2 atom types\n\n1 7 xlo xhi\n-3 5 ylo yhi\n-0.5 0.5 zlo zhi\n{lean}\nMasses\n\n1 1.0\n2 3.0\n\n\
             Atoms # atomic\n\n{rows}"
        );
        std::fs::write(folder.join("start.data"), data).unwrap();
        let text = format!(
            "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 3\ndt = 0.01\nsteps = 5\n[initial]\nkind = \"data\"\n\
             file = \"start.data\"\nvelocities = \"thermal\"\n{more}"
        );
        Scene::parse("flat.toml", &text, folder).unwrap_or_else(|error| panic!("{error}"))
    }

    /// The half of the box in which a force is reversed is counted from where the box begins, and types from 1.
    #[test]
    fn forces_are_reversed_in_the_upper_half_of_the_box() {
        let folder = tempfile::tempdir().unwrap();
        let force = "[[body_force]]\nacceleration = [0.25, 0.0]\nreversed_along = \"y\"\nspecies = [\"B\"]\n";
        let script = script_of(&flat(folder.path(), 0.0, force), Script::default()).unwrap();
        for line in [
            "variable      body1x atom mass*(0.25)*(1-2*((y-(-3.0))/8.0-floor((y-(-3.0))/8.0)>=0.5))\n",
            "group         body1types type 2\n",
            "fix           body1 body1group addforce v_body1x v_body1y 0.0\n",
        ] {
            assert!(script.contains(line), "{line}{script}");
        }
    }

    /// A box in the plane keeps its tilt, and has a thickness of 1.
    #[test]
    fn boxes_in_the_plane_keep_their_tilt() {
        let folder = tempfile::tempdir().unwrap();
        let scene = flat(folder.path(), 1.5, "");
        write_inputs(&scene, &scene.initial_state(), &folder.path().join("out"), Existing::Keep).unwrap();
        let data = psidpd_formats::DataFile::read(&folder.path().join("out").join(START)).unwrap();
        assert_eq!(
            (data.tilt, data.boxlo, data.boxhi),
            (Some([1.5, 0.0, 0.0]), [1.0, -3.0, -0.5], [7.0, 5.0, 0.5])
        );
        assert!(data.atoms.len() == 40 && data.atoms.iter().all(|atom| atom.x[2] == 0.0));
    }

    #[test]
    fn the_thermostat_is_cut_out_and_what_follows_stays() {
        let text = "title = \"t\"\n[[ thermostat ]] # one\ngamma = 1\n[[thermostat]]\ngamma = 2\n[[pair]]\nrange = 1\n";
        let kept = without_thermostat(text);
        assert_eq!(kept.lines().skip(1).collect::<Vec<_>>(), ["title = \"t\"", "[[pair]]", "range = 1"]);
    }

    #[test]
    fn tables_are_found() {
        let text =
            "[excess_free_energy]\nA = { table = \"a.csv\" }\nB = \"n\"\n[[pair]]\nfile = \"sub/b.txt\"\n";
        assert_eq!(tables("m.toml", text).unwrap(), ["a.csv", "sub/b.txt"]);
    }

    #[test]
    fn titles_become_one_line() {
        assert_eq!(one_line("a &\nrun 5"), "a   run 5");
        assert_eq!(one_line("a \"\"\" b"), "a ''' b");
    }
}
