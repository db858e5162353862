//! `psidpd lammps convert` with the idioms of real decks: loops, variables, included files, `respa`, hybrids, programs in Python.
//! Each deck runs beside its converted form; without drag and with the built-in's own law both are one trajectory.

mod style_common;

use psidpd::formats::dump;
use psidpd_tests::{json, lammps};
use std::path::Path;
use std::process::Command;
use style_common::{LIMIT, difference};

/// Writes `drop.data` for an atom style, with two types of given masses.
fn start(folder: &Path, style: &str, masses: [f64; 2]) {
    let text = format!(
        "units lj\natom_style {style}\nregion b block 0 5 0 5 0 5\ncreate_box 2 b\n\
         create_atoms 1 random 600 4711 NULL overlap 0.3 maxtry 100\nset type 1 type/ratio 2 0.4 77\n\
         mass 1 {}\nmass 2 {}\npair_style zero 1.0\npair_coeff * *\nvelocity all create 1.0 87 loop geom\n\
         write_data drop.data nocoeff\n",
        masses[0], masses[1]
    );
    run(folder, "in.start", &text);
}

/// The plugin by a link in the folder of a test: its own path may have a space.
const PLUGIN: &str = "plugins/psidpdplugin.so";

fn link_plugin(folder: &Path) {
    let link = folder.join("plugins");
    if !link.exists() {
        std::os::unix::fs::symlink(lammps().1.parent().unwrap(), link).unwrap();
    }
}

fn run(folder: &Path, name: &str, text: &str) {
    link_plugin(folder);
    std::fs::write(folder.join(name), text).unwrap();
    let done = lammps().0.run_script(1, folder, name.as_ref(), &[], LIMIT);
    done.unwrap_or_else(|e| panic!("{e}\n{text}"));
}

/// Runs a program in Python with the LAMMPS of the tests.
fn run_python(folder: &Path, name: &str) {
    link_plugin(folder);
    let venv = &lammps().0.root;
    let out = Command::new(venv.join("bin/python"))
        .arg(name)
        .current_dir(folder)
        .env("LD_LIBRARY_PATH", venv.join("lib"))
        .env("OMP_NUM_THREADS", "1")
        .output()
        .unwrap();
    let said = psidpd_tests::said(&out);
    assert!(out.status.success(), "{said}\n{}", std::fs::read_to_string(folder.join(name)).unwrap());
}

/// Columns of all frames of `f.dump`.
fn frames(folder: &Path, columns: [&str; 3]) -> Vec<Vec<[f64; 3]>> {
    let frames = dump::read(&folder.join("f.dump")).unwrap();
    frames.iter().map(|f| f.vectors(columns).unwrap()).collect()
}

/// The columns by which runs are compared: positions, and what `more` names.
fn results(folder: &Path, more: [&str; 3]) -> Vec<Vec<[f64; 3]>> {
    [frames(folder, ["x", "y", "z"]), frames(folder, more)].concat()
}

/// Makes a converted file load the plugin of this test.
fn with_plugin(text: &str) -> String {
    let lines = text.lines().map(|line| match line.find("plugin") {
        Some(at) if line[at..].split_whitespace().nth(1) == Some("load") => {
            let end = line[at..].find(".so").map_or(line.len(), |end| at + end + 3);
            // A path with a space is in quotation marks, which Python's strings escape.
            let path = line[at..].split_once("load ").map_or("", |(_, path)| path);
            let mark = ["\\\"", "\"", ""].into_iter().find(|mark| path.starts_with(mark)).unwrap_or_default();
            let rest = line[end..].strip_prefix(mark).unwrap_or(&line[end..]);
            format!("{}plugin load {PLUGIN}{rest}\n", &line[..at])
        }
        _ => format!("{line}\n"),
    });
    lines.collect()
}

/// Converts `old`, whose files are in the folder; returns the report.
fn convert(folder: &Path, old: &str, new: &str, law: &str) -> serde_json::Value {
    let report = json(folder, &["lammps", "convert", old, "--law", law, "--out", new, "--overwrite"], 0);
    for file in report["files"].as_array().unwrap() {
        let path = folder.join(file.as_str().unwrap());
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(path, with_plugin(&text)).unwrap();
    }
    report
}

/// Runs a deck and its converted form, and compares positions and other columns of their dumps.
fn hold(folder: &Path, deck: &str, more: [&str; 3]) -> String {
    run(folder, "in.old", deck);
    let old = results(folder, more);
    std::fs::remove_file(folder.join("f.dump")).unwrap();
    // The built-in's seed may stand for the time of day, which it does not accept any more.
    std::fs::write(folder.join("in.old"), deck.replace(" 1.0 777\n", " 1.0 -1\n")).unwrap();
    convert(folder, "in.old", "in.new", "lucy");
    let text = std::fs::read_to_string(folder.join("in.new")).unwrap();
    run(folder, "in.new", &text);
    compare(&old, &results(folder, more), &text);
    text
}

fn compare(old: &[Vec<[f64; 3]>], new: &[Vec<[f64; 3]>], text: &str) {
    assert_eq!(old.len(), new.len(), "{text}");
    for (theirs, ours) in old.iter().zip(new) {
        let apart = difference(ours, theirs);
        assert!(apart < 1e-8, "{apart}\n{text}");
    }
}

const DUMP: &str =
    "dump d all custom 10 f.dump id type x y z fx fy fz\ndump_modify d sort id format float %.17g\n";
const FORCES: [&str; 3] = ["fx", "fy", "fz"];

/// Loops with labels, variables of several kinds, formulas, quotes, continued lines, a seed from the clock, masses.
#[test]
fn variables_and_loops() {
    let folder = tempfile::tempdir().unwrap();
    start(folder.path(), "mdpd", [1.0, 2.5]);
    let deck = format!(
        "variable a index -40   # strength\nvariable B equal 2.5e1\nvariable rd string 0.75\nvariable data index drop.data\n\
         variable law string \"hybrid/overlay mdpd/rhosum mdpd\"\nunits lj\nsuffix omp\natom_style mdpd\nread_data ${{data}}\n\
         comm_modify vel yes\nneighbor 0.3 bin\npair_style ${{law}} 1.0 &\n   1.0 777\n\
         pair_coeff * * mdpd/rhosum ${{rd}}\npair_coeff 1*2 * mdpd ${{a}} $B 0 $(2*v_rd-0.5) $(v_rd:%.2f)  # 'all'\n\
         pair_coeff 1 2 mdpd -30 $(v_B - 5.0) 0.0 1. 7.5e-1\n\
         fix \t1 all mvv/dpd 0.5\ntimestep 0.001\n{DUMP}\
         label again\nvariable k loop 3\nrun 5\n\
         if \"${{k}} == 2\" then \"pair_coeff 2 2 mdpd -20 25.0 0 1.0 0.75\" \"print 'two # of three'\" else \"timestep 0.0015\"\n\
         next k\njump SELF again\nrun 10 every 5 \"pair_coeff * * mdpd/rhosum 0.750\" \"pair_coeff 1 1 mdpd -35 20 0 0.9 0.75\"\n"
    );
    let text = hold(folder.path(), &deck, FORCES);
    assert!(text.contains("pair_style mdpd/psi 1.0 1.0 12345 law lucy"), "{text}");
    assert!(text.contains("pair_coeff 1 2 -30 $(v_B - 5.0) 0.0 1. 7.5e-1"), "{text}");
}

/// Included files, a second system after `clear`, a data file that the script has written, densities in dumps.
#[test]
fn files_and_densities() {
    let folder = tempfile::tempdir().unwrap();
    start(folder.path(), "hybrid charge mdpd", [1.0, 3.0]);
    let fluid = "# the fluid\npair_style hybrid/overlay mdpd/rhosum mdpd ${kT} 1.0 77\n\
                 pair_coeff * * mdpd/rhosum 0.75\n\npair_coeff * * mdpd -40 25 0 1.0 0.75 # set 6\n";
    std::fs::write(folder.path().join("fluid.in"), fluid).unwrap();
    let deck = "units lj\natom_style hybrid charge mdpd\ncomm_modify vel yes\nread_data drop.data\nset type * sph/rho 0.0\nvariable kT equal 1.0\n\
         compute density all property/atom rho\ninclude \"fluid.in\"\nfix 1 all mvv/dpd\ntimestep 0.001\nrun 4\n\
         write_data out.data nocoeff\nclear\nunits lj\natom_style hybrid charge mdpd\ncomm_modify vel yes\nread_data out.data\n\
         include fluid.in\nfix 1 all mvv/dpd\ntimestep 0.001\ncompute rho all property/atom rho\n\
         compute top all reduce max c_rho\nthermo_style custom step temp c_top\n\
         dump d all custom 5 f.dump id x y z c_rho fx fy\ndump_modify d sort id format float %.17g colname c_rho rho\nrun 10\n";
    let text = hold(folder.path(), deck, ["rho", "fx", "fy"]);
    assert!(text.contains("variable rho_rho atom f_rho[1]+3*f_rho[2]"), "{text}");
}

/// Levels of respa lose one; other styles and pairs without interaction stay.
#[test]
fn hybrids_and_respa() {
    for (style, levels, new) in [
        ("mdpd/rhosum mdpd 1.0 1.0 5 lj/cut 0.9", "2 2 1", "hybrid 2 1"),
        ("lj/cut 0.9 mdpd/rhosum mdpd 1.0 1.0 5", "1 2 2", "hybrid 1 2"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        start(folder.path(), "mdpd", [1.0, 1.0]);
        let deck = format!(
            "units lj\natom_style mdpd\ncomm_modify vel yes\nread_data drop.data\npair_style hybrid/overlay {style}\n\
             pair_coeff * * mdpd/rhosum 0.75\npair_coeff * * mdpd -40 25 0 1.0 0.75\npair_coeff 1 1 lj/cut 0.1 0.3\n\
             pair_coeff 1 2 lj/cut 0.0 0.3\npair_coeff 2 2 lj/cut 0.2 0.3\nrun_style respa 2 2 hybrid {levels}\n\
             pair_modify pair mdpd special lj 1 1 1\nspecial_bonds lj 1 1 1\nfix 1 all nve\ntimestep 0.001\n{DUMP}run 10\n"
        );
        let text = hold(folder.path(), &deck, FORCES);
        assert!(text.contains(&format!("run_style respa 2 2 {new}\n")), "{text}");
    }
    let folder = tempfile::tempdir().unwrap();
    start(folder.path(), "mdpd", [1.0, 1.0]);
    let head = "units lj\natom_style mdpd\ncomm_modify vel yes\nread_data drop.data\n";
    let style = "pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 5\n";
    let coefficients = "pair_coeff * * mdpd/rhosum 0.75\npair_coeff * * mdpd -40 25 0 1.0 0.75\n";
    let rest = format!("fix 1 all nve\ntimestep 0.001\n{DUMP}run 10\n");
    let alone = format!("{head}{style}{coefficients}run_style respa 2 2 hybrid 2 2\n{rest}");
    assert!(hold(folder.path(), &alone, FORCES).contains("run_style respa 2 2 pair 2\n"));
    let of = |types: &str| coefficients.replace("* *", types);
    let none = format!("{head}{style}{}{}pair_coeff 1 2 none\n{rest}", of("1 1"), of("2 2"));
    assert!(hold(folder.path(), &none, FORCES).contains("pair_style hybrid/overlay mdpd/psi"));
}

/// Plain DPD, alone with a cut-off of its own for a pair, and in a hybrid.
#[test]
fn plain_dpd() {
    for (style, name) in [("dpd 1.0 1.0 34387", ""), ("hybrid/overlay dpd 1.0 1.0 34387 lj/cut 0.5", "dpd ")]
    {
        let folder = tempfile::tempdir().unwrap();
        start(folder.path(), "atomic", [1.0, 2.0]);
        let more = if name.is_empty() { "" } else { "pair_coeff * * lj/cut 0.1 0.2\n" };
        let deck = format!(
            "variable g equal 0\nunits lj\natom_style atomic\nread_data drop.data\ncomm_modify vel yes\npair_style {style}\n\
             pair_coeff * * {name}25 ${{g}}\npair_coeff 1 2 {name}30.0 ${{g}} 1.2\n{more}fix 1 all nve\ntimestep 0.005\n{DUMP}run 20\n"
        );
        let text = hold(folder.path(), &deck, FORCES);
        assert!(text.contains("mdpd/psi 1.0 1.2 34387") && !text.contains("lucy"), "{text}");
    }
}

/// Commands one by one, in lists, in texts of several lines, and with numbers that the program inserts.
#[test]
fn programs_in_python() {
    let folder = tempfile::tempdir().unwrap();
    start(folder.path(), "mdpd", [1.0, 1.0]);
    let program = "# drives LAMMPS: pair_style mdpd in a comment\n\
        from lammps import lammps\n\
        A, B = -40, 25.0\nrd = 0.75\n\
        lmp = lammps(cmdargs=['-log', 'none', '-screen', 'none'])\n\
        begin = [\"units lj\", 'atom_style  mdpd',\n         \"read_data drop.data\", \"comm_modify vel yes\"]\n\
        fluid = [\n    \"pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 9872598\",\n\
        \x20   f\"pair_coeff 1 1 mdpd/rhosum {rd}\",\n    f\"pair_coeff * * mdpd {A + 0} {B} 0 {1.0:.2f} {rd}\",\n]\n\
        lmp.commands_list(begin)\nlmp.commands_list(fluid)\n\
        if True:\n    lmp.command('pair_coeff * * mdpd/rhosum ' + str(rd))\n    lmp.command(\"fix 1 all mvv/dpd\")\n\
        lmp.command('pair_coeff 1 2 mdpd ' + str(A) + ' 20 0 1.0 %g' % rd)\n\
        lmp.commands_string(\"\"\"\ntimestep 0.001\ndump d all custom 10 f.dump id type x y z fx fy fz\n\
        dump_modify d sort id format float %.17g\n\"\"\")\n\
        for k in range(2):\n    lmp.command(f'run {k + 9}')\n";
    std::fs::write(folder.path().join("old.py"), program).unwrap();
    run_python(folder.path(), "old.py");
    let old = results(folder.path(), FORCES);
    std::fs::remove_file(folder.path().join("f.dump")).unwrap();
    convert(folder.path(), "old.py", "new.py", "lucy");
    let text = std::fs::read_to_string(folder.path().join("new.py")).unwrap();
    run_python(folder.path(), "new.py");
    compare(&old, &results(folder.path(), FORCES), &text);
    assert!(text.starts_with("# drives LAMMPS: pair_style mdpd in a comment\n"), "{text}");
}

/// Coefficients that have no potential come with the file of the nearest model, which the style takes.
#[test]
fn the_nearest_model_is_written() {
    let folder = tempfile::tempdir().unwrap();
    start(folder.path(), "mdpd", [1.0, 1.0]);
    let deck = format!(
        "units lj\natom_style mdpd\ncomm_modify vel yes\nread_data drop.data\n\
         pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 5\npair_coeff * * mdpd/rhosum 0.75\n\
         pair_coeff * * mdpd -40 25 0 1.0 0.75\npair_coeff 1 2 mdpd -40 20 0 1.0 0.75\nfix 1 all mvv/dpd\n{DUMP}run 1\n"
    );
    std::fs::write(folder.path().join("in.old"), deck).unwrap();
    let report = json(folder.path(), &["lammps", "convert", "in.old", "--out", "in.new"], 1);
    let by_hand = report["by_hand"][0]["text"].as_str().unwrap();
    assert!(by_hand.contains("B differs") && by_hand.contains("is in.new.nearest.toml"), "{by_hand}");
    let script = format!(
        "units lj\natom_style atomic\ncomm_modify vel yes\nread_data drop.data.atomic\nplugin load {PLUGIN}\n\
         pair_style dpd/psi 1.0 5\npair_coeff * * in.new.nearest.toml T1 T2\nrun 0\n"
    );
    run(folder.path(), "in.nearest", &script);
}

/// A restart file of the built-in continues with the new style: it brings its atom style.
#[test]
fn restart_files() {
    let folder = tempfile::tempdir().unwrap();
    start(folder.path(), "mdpd", [1.0, 1.0]);
    let style = "pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 5\npair_coeff * * mdpd/rhosum 0.75\n\
                 pair_coeff * * mdpd -40 25 0 1.0 0.75\n";
    let first = format!(
        "units lj\natom_style mdpd\nread_data drop.data\ncomm_modify vel yes\n{style}fix 1 all mvv/dpd\ntimestep 0.001\nrun 3\n"
    );
    run(folder.path(), "in.first", &format!("{first}write_restart drop.restart\n"));
    let deck = format!(
        "units lj\nread_restart drop.restart\ncomm_modify vel yes\n{style}fix 1 all mvv/dpd\n{DUMP}run 10\n"
    );
    hold(folder.path(), &deck, FORCES);
}
