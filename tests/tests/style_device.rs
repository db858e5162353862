//! Pair styles with `device gpu`, in a plugin that was built with and without it.

mod style_common;

use style_common::*;

fn style(keywords: &str) -> String {
    format!("pair_style dpd/psi 1.0 {SEED} {keywords}\npair_coeff * * \"{}\" F\n", warren())
}

fn box_of(before: &str) -> String {
    particles(before, "block 0 6 0 5 0 5", 1, 700)
}

fn refusal(script: &str) -> String {
    let l = open(&box_of(""));
    l.commands(&format!("{script}\nfix 1 all nve\ntimestep {DT}\nrun 0\n")).unwrap_err().to_string()
}

/// Nothing falls back to the CPU.
#[test]
fn a_plugin_without_gpus_says_how_to_build_one() {
    if std::env::var_os("PSIDPD_WITH_GPU").is_some() {
        return;
    }
    let error = refusal(&style("device gpu"));
    assert!(error.contains("PSIDPD_WITH_GPU=1 psidpd lammps plugin"), "{error}");
    let error = refusal(&style("device cuda"));
    assert!(error.contains("unknown device 'cuda': expected 'cpu', 'gpu' or 'gpu:N'"), "{error}");
    let error = refusal(&style("precision double device gpu"));
    assert!(error.contains("single precision"), "{error}");
    open(&format!("{}{}fix 1 all nve\ntimestep {DT}\nrun 0\n", box_of(""), style("device cpu")));
}

#[test]
#[ignore = "needs a plugin with `device gpu`, and Vulkan: .ci/gpu"]
fn what_a_gpu_does_not_do_is_refused_by_name() {
    for (commands, what) in [
        (style("device gpu:99"), "there is no device 99"),
        (style("device gpu") + "neigh_modify exclude type 1 1\n", "neigh_modify exclude"),
        (format!("{}{}", style("device gpu"), listed()), "takes no pairs from a neighbor list"),
        (style("device gpu") + "fix u all pair 1 dpd/psi psi 0\n", "no psi of single atoms"),
    ] {
        let error = refusal(&commands);
        assert!(error.contains(what), "{what}: {error}");
    }
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("chains.data");
    std::fs::write(&data, chains(60)).unwrap();
    let l = open(&format!(
        "units lj\natom_style bond\ncomm_modify vel yes\nread_data \"{}\"\nbond_style harmonic\nbond_coeff 1 1 1\n{}\
         pair_style dpd/psi 1.0 {SEED} device gpu\npair_coeff * * \"{}\" F F\nfix 1 all nve\ntimestep {DT}\n",
        data.display(),
        load(),
        warren()
    ));
    let error = l.commands("run 0").unwrap_err().to_string();
    assert!(error.contains("special_bonds lj 1 1 1"), "{error}");
    l.commands("special_bonds lj 1 1 1\nrun 0").unwrap();
}

/// Trajectories, energies and pressures beside those of the CPU: one rank and two, a ramp of the temperature, a thermostat
/// apart from the forces, a box that changes, and values of single atoms.
#[test]
#[ignore = "needs a plugin with `device gpu`, and Vulkan: .ci/gpu"]
fn trajectories_are_those_of_the_cpu() {
    let nve = "fix 1 all nve\n";
    // The CPU computes values of single atoms, and with them the forces of the steps that ask.
    let atoms = "fix 1 all nve\ncompute e all pe/atom\ncompute s all reduce sum c_e\ncompute d all pair/local force\n\
                 compute f all reduce max c_d inputs local\n";
    let ramp = "fix 1 all nve\nvariable t equal 1+0.02*step\nfix a all adapt 1 pair dpd/psi T * * v_t\n";
    for (what, ranks, fixes, more) in [
        ("one rank", 1, nve, ""),
        ("two ranks", 2, nve, ""),
        ("hotter", 1, ramp, ""),
        ("fix dpd/splitting", 2, "fix 1 all dpd/splitting force-gradient\n", ""),
        ("pressed", 1, "fix 1 all nve\nfix p all press/berendsen iso 20 20 1\n", ""),
        ("single atoms", 1, atoms, "c_s c_f"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let values: String = more.split_whitespace().map(|c| format!(" $({c}:%.10g)")).collect();
        let of = |keywords: &str| {
            let script = format!(
                "{}{}{fixes}thermo 10\nthermo_style custom step temp pe press pxy {more}\nthermo_modify norm no\n\
                 timestep {DT}\nrun 20\nprint \"$(pe:%.10g) $(press:%.10g) $(pxy:%.10g){values}\" file totals\n",
                box_of(""),
                style(keywords)
            );
            let frame = run_in(folder.path(), &script, ranks);
            let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
            let totals: Vec<f64> = read("totals").split_whitespace().map(|w| w.parse().unwrap()).collect();
            (frame, totals, read("log.lammps"))
        };
        let ((cpu, expected, _), (gpu, found, log)) = (of("precision double"), of("device gpu"));
        let says = ["evaluation    gpu:0, ", "arithmetic    single precision"];
        assert!(says.iter().all(|words| log.contains(words)), "{log}");
        let apart = [difference(&gpu.x, &cpu.x), difference(&gpu.v, &cpu.v), difference(&gpu.f, &cpu.f)];
        let errors: Vec<f64> = (0..found.len())
            .map(|k| (found[k] - expected[k]).abs() / expected[if k == 2 { 1 } else { k }].abs())
            .collect();
        println!("{what}: x, v and f differ by {apart:?}, energy, pressures and values by {errors:?}");
        assert!(apart[0] < 1e-5 && apart[1] < 1e-3 && apart[2] < 1e-3, "{what}: {apart:?}");
        assert!(apart[0] > 1e-13, "{what}: the CPU has computed both");
        assert!(
            errors[0] < 1e-5 && errors.iter().all(|error| *error < 1e-3),
            "{what}: {found:?} {expected:?}"
        );
    }
}
