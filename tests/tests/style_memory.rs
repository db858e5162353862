//! Valgrind over a short run of each style: no invalid access and no use of uninitialised memory has the
//! plugin in its stack. Faults within LAMMPS and MPI alone do not count.

use psidpd_tests::{lammps, root};
use std::path::Path;
use std::process::{Command, Output};

fn deck(plugin: &Path, style: &str) -> String {
    let models = root().join("validation/models");
    let (types, pair) = match style {
        "dpd/psi" => (2, {
            let model = models.join("huggins.toml");
            format!("pair_style dpd/psi 1.0 5\npair_coeff * * \"{}\" A B\n", model.display())
        }),
        "dpd/psi mixed" => (1, {
            let model = models.join("warren2003-set6-two-densities.toml");
            format!(
                "pair_style dpd/psi 1.0 5 precision mixed threads 2\npair_coeff * * \"{}\" F\n",
                model.display()
            )
        }),
        "mdpd/psi" => (1, "pair_style mdpd/psi 1.0 1.0 5\npair_coeff 1 1 -40 25 18.0 1.0 0.75\n".to_owned()),
        _ => (1, "pair_style dpd/spline 1.0 1.0 5\npair_coeff 1 1 9.5 2.0 1.0 0.8 1.0 4.5\n".to_owned()),
    };
    let mut text = format!(
        "units lj\natom_style atomic\ncomm_modify vel yes\nregion b block 0 4 0 4 0 4\ncreate_box {types} b\n\
         create_atoms 1 random 150 4711 NULL overlap 0.3 maxtry 100\n"
    );
    if types == 2 {
        text.push_str("create_atoms 2 random 150 4712 NULL overlap 0.3 maxtry 100\n");
    }
    text.push_str("mass * 1\nvelocity all create 1.0 87 loop geom\n");
    text.push_str(&format!("plugin load \"{}\"\n{pair}", plugin.display()));
    text.push_str(
        "compute s all stress/atom NULL\ncompute t all reduce sum c_s[1]\ntimestep 0.005\n\
         thermo 2\nthermo_style custom step pe press c_t\n",
    );
    // Before any run, and after one, a minimiser reads the pressure; a wall has the force of drag on it.
    let relax = "fix r all box/relax iso 0 vmax 0.01\nminimize 0 1e-3 3 10\nunfix r\n";
    let scheme = if style.starts_with("dpd/psi") { "force-gradient every 2" } else { "aboba" };
    text.push_str(&format!(
        "group w id <= 20\nfix 1 all dpd/splitting {scheme}\n{relax}fix 2 w setforce 0 0 0\n\
         thermo_style custom step pe press c_t f_2[1]\nrun 4\n{relax}unfix 2\nunfix 1\nfix 1 all nve\n\
         thermo_style custom step pe press c_t\nrun 4\n\
         neigh_modify exclude type 1 1\nrun 2\n"
    ));
    // With more exclusions than the style stores, pairs come from LAMMPS's list.
    text.push_str(&format!(
        "group none empty\nneigh_modify{}\nrun 2\n",
        " exclude group none none".repeat(17)
    ));
    text
}

/// Memory faults in a log of valgrind: the paragraphs with the plugin in their stack.
fn ours(log: &str) -> Vec<String> {
    let lines = log.lines().map(|l| l.splitn(3, "==").nth(2).unwrap_or(l).trim_end());
    let text = lines.collect::<Vec<_>>().join("\n");
    text.split("\n\n")
        .filter(|p| {
            let fault = ["Invalid ", "Conditional jump", "Use of uninitialised", "Mismatched", "overlap in"];
            fault.iter().any(|f| p.trim_start().starts_with(f)) && p.lines().any(in_plugin)
        })
        .map(str::to_owned)
        .collect()
}

/// Runs a script under valgrind on `ranks` ranks and returns LAMMPS's output and the logs of the ranks.
fn under_valgrind(script: &Path, ranks: usize, origins: bool) -> (Output, Vec<String>) {
    let host = &lammps().0;
    let folder = script.parent().unwrap();
    let plain = host.command(ranks);
    let mut run = if ranks > 1 {
        // The launcher starts valgrind, and valgrind starts LAMMPS.
        let mut run = Command::new(plain.get_program());
        run.args(["-np", &ranks.to_string(), "valgrind"]);
        run
    } else {
        Command::new("valgrind")
    };
    run.args(["--num-callers=40", "--leak-check=no"]);
    // Who made memory that another reads before it is set: asked for only where a fault was found, as it doubles the time.
    run.arg(if origins { "--track-origins=yes" } else { "--track-origins=no" });
    run.arg(format!("--log-file={}", folder.join("valgrind.%p.txt").display()));
    run.arg(&host.lmp).arg("-in").arg(script).args(["-nocite", "-log", "none"]);
    for (name, value) in plain.get_envs() {
        if let Some(value) = value {
            run.env(name, value);
        }
    }
    let output = run.current_dir(folder).output().unwrap_or_else(|e| {
        panic!("valgrind does not start ({e}): install it (Debian: apt-get install valgrind)")
    });
    let files = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let logs = files.filter(|p| p.file_name().unwrap().to_str().unwrap().starts_with("valgrind."));
    (output, logs.map(|p| std::fs::read_to_string(p).unwrap()).collect())
}

/// Whether a line of a stack names a function of the crates or a library of the plugin. Folder names do not
/// count: LAMMPS and MPI themselves may lie in a subfolder of the checkout.
fn in_plugin(line: &str) -> bool {
    let (function, file) = line.split_once(" (in ").unwrap_or((line, ""));
    let file = Path::new(file.trim_end_matches(')')).file_name();
    function.contains("psidpd") || file.is_some_and(|name| name.to_string_lossy().starts_with("psidpd"))
}

fn is_clean(style: &str) {
    for ranks in [1, 2] {
        let faults = |origins: bool| -> Vec<String> {
            let folder = tempfile::tempdir().unwrap();
            let script = folder.path().join("in.lammps");
            std::fs::write(&script, deck(&lammps().1, style)).unwrap();
            let (output, logs) = under_valgrind(&script, ranks, origins);
            let said = psidpd_tests::said(&output);
            assert!(output.status.success() && said.contains("Loop time"), "{style} on {ranks}: {said}");
            assert_eq!(logs.len(), ranks, "{style}");
            assert!(logs.iter().all(|log| log.contains("ERROR SUMMARY")), "{logs:?}");
            logs.iter().flat_map(|log| ours(log)).collect()
        };
        if !faults(false).is_empty() {
            let faults = faults(true);
            panic!("{style} on {ranks}: {}\n\n{}", faults.len(), faults.join("\n\n"));
        }
    }
}

#[test]
fn a_mixture_is_clean() {
    is_clean("dpd/psi");
}

#[test]
fn mixed_precision_is_clean() {
    is_clean("dpd/psi mixed");
}

#[test]
fn coefficients_are_clean() {
    is_clean("mdpd/psi");
}

#[test]
fn splines_are_clean() {
    is_clean("dpd/spline");
}

#[test]
fn faults_in_the_plugin_are_told_from_others() {
    let mpi = "/a folder/psidpd/target/lammps/venv/lib/libmpi.so.12.3";
    let plugin = "/a folder/target/lammps/psidpdplugin.so";
    let stacks = [
        ("psidpd_core::f (x.rs:1)".to_owned(), true),
        (format!("MPIR_Init (in {mpi})"), false),
        ("LAMMPS_NS::Input::file() (input.cpp:2)".to_owned(), false),
        (format!("??? (in {plugin})"), true),
        ("psidpd::PairPsi::compute(int, int) (pair_psi.cpp:3)".to_owned(), true),
    ];
    let log: String = stacks
        .iter()
        .map(|(frame, _)| format!("==7== Invalid read of size 8\n==7==    at 0x1: {frame}\n==7== \n"))
        .collect();
    let found = ours(&format!("{log}==7== ERROR SUMMARY: 5 errors\n"));
    let expected: Vec<&String> = stacks.iter().filter(|(_, ours)| *ours).map(|(frame, _)| frame).collect();
    assert_eq!(found.len(), expected.len(), "{found:?}");
    assert!(found.iter().zip(expected).all(|(paragraph, frame)| paragraph.contains(frame)), "{found:?}");
}
