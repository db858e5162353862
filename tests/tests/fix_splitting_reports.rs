//! What LAMMPS reports beside the fix that integrates: pressures at any step, and the forces on walls.

mod style_common;

use style_common::*;

/// Two atoms along a line, so slow that they stay there, and so cold that there is no noise; the line, and half a range of it.
fn pair_of_atoms() -> (tempfile::TempDir, String, [f64; 3]) {
    let (folder, path) =
        file("title = \"pair\"\nspecies = [\"A\", \"B\"]\n[[thermostat]]\ngamma = 6\nrange = 1\n");
    let along = [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0];
    let near = along.map(|e| 2.0 - 0.5 * e);
    let script = format!(
        "units lj\natom_style atomic\natom_modify map yes\nregion b block 0 4 0 4 0 4\n\
         create_box 2 b\ncreate_atoms 1 single 2 2 2\ncreate_atoms 2 single {} {} {}\nmass 1 1\nmass 2 3\n{}\
         pair_style dpd/psi 1e-60 {SEED}\npair_coeff * * \"{path}\" A B\ngroup first type 1\ngroup second type 2\n\
         velocity first set 3e-12 -1e-12 2e-12\ntimestep 0.3\n",
        near[0],
        near[1],
        near[2],
        load()
    );
    (folder, script, along)
}

/// The numbers after `word` in the lines of an output that begin with it.
fn rows(said: &str, word: &str) -> Vec<Vec<f64>> {
    let lines = said.lines().filter_map(|line| line.strip_prefix(word));
    lines.map(|line| line.split_whitespace().map(|w| w.parse().unwrap()).collect()).collect()
}

fn said(folder: &std::path::Path, script: &str, ranks: usize) -> String {
    let path = folder.join("in.said");
    std::fs::write(&path, script).unwrap();
    let run = psidpd_tests::lammps().0.run_script(ranks, folder, &path, &[], LIMIT);
    run.unwrap_or_else(|e| panic!("{ranks} ranks: {e}\n{script}")).stdout
}

/// Drag of a time KΔt on the relative velocity u takes 2x/(1 + x) of it, with x = ½ KΔt D/μ, and its mean force is that times μu
/// over KΔt. The pressure has the virial of this force in each of the K timesteps; before the first action it has that of the
/// drag on the initial velocities.
#[test]
fn the_virial_is_that_of_the_mean_force_in_every_step() {
    let (folder, start, along) = pair_of_atoms();
    let u: f64 = along.iter().zip([3e-12, -1e-12, 2e-12]).map(|(e, v)| e * v).sum();
    for (scheme, every) in [("two-stage", 1), ("two-stage", 3), ("force-gradient", 2), ("aboba", 4)] {
        for ranks in [1, 2] {
            let script = format!(
                "{start}fix 1 all dpd/splitting {scheme} every {every}\ncompute p all pressure NULL fix\n\
                 thermo_style custom step c_p[1] c_p[2] c_p[3] c_p[4] c_p[5] c_p[6]\n\
                 thermo_modify line one format float %.17g\nthermo 1\nvariable s equal step\n\
                 fix say all print 1 \"virial ${{s}} $(c_p[1]:%.17g) $(c_p[4]:%.17g) $(c_p[6]:%.17g)\"\nrun 0\n\
                 print \"virial 0 $(c_p[1]:%.17g) $(c_p[4]:%.17g) $(c_p[6]:%.17g)\"\nrun 9\n"
            );
            let rows = rows(&said(folder.path(), &script, ranks), "virial ");
            assert!(rows.len() >= 10, "{rows:?}");
            // D = γ (1 − ½)², μ = ¾: x = ½ KΔt 1.5/0.75.
            let time = f64::from(every) * 0.3;
            let x = time * 1.5 / 0.75 / 2.0;
            for row in &rows {
                let actions = (row[0] as i32 / every - 1).max(0);
                let before = u * ((1.0 - x) / (1.0 + x)).powi(actions);
                let force = -0.75 * before * 2.0 * x / (1.0 + x) / time;
                for (found, (a, b)) in row[1..].iter().zip([(0, 0), (0, 1), (1, 2)]) {
                    let expected = 0.5 * along[a] * along[b] * force / 64.0;
                    let off = (found - expected).abs() / expected.abs();
                    assert!(off < 1e-7, "{scheme} every {every}, {ranks} ranks: {row:?}, {expected:e}");
                }
            }
        }
    }
}

/// The force of drag on an atom that does not move is what `fix setforce` reports, whether the atom is in the group of the fix or
/// not: μ is now the mass of the other atom.
#[test]
fn the_drag_on_a_held_atom_is_reported() {
    let (folder, start, along) = pair_of_atoms();
    let u: f64 = along.iter().zip([3e-12, -1e-12, 2e-12]).map(|(e, v)| e * v).sum();
    for (scheme, every) in [("two-stage", 1), ("force-gradient", 3), ("aboba", 2)] {
        for (ranks, group) in [(1, "all"), (1, "first"), (2, "all"), (2, "first")] {
            let script = format!(
                "{start}fix 1 {group} dpd/splitting {scheme} every {every}\nfix 2 second setforce 0 0 0\n\
                 variable s equal step\nthermo_style custom step f_2[1]\nthermo 1\n\
                 fix say all print 1 \"force ${{s}} $(f_2[1]:%.17g) $(f_2[2]:%.17g) $(f_2[3]:%.17g)\"\nrun 9\n"
            );
            let rows = rows(&said(folder.path(), &script, ranks), "force ");
            assert!(rows.len() >= 9, "{rows:?}");
            let time = f64::from(every) * 0.3;
            let x = time * 1.5 / 2.0;
            for row in rows.iter().filter(|row| row[0] > 0.0) {
                // The force since the last action before this step; aboba computes the forces that are reported once more behind it.
                let last = if scheme == "aboba" { row[0] as i32 } else { row[0] as i32 - 1 };
                let actions = (last / every - 1).max(0);
                let before = u * ((1.0 - x) / (1.0 + x)).powi(actions);
                let force = before * 2.0 * x / (1.0 + x) / time;
                for c in 0..3 {
                    let off = (row[1 + c] / (force * along[c]) - 1.0).abs();
                    assert!(off < 1e-7, "{scheme} every {every}, {ranks} ranks, {group}: {row:?}, {force:e}");
                }
            }
        }
    }
}

/// A liquid that a force drives along two walls: what `fix setforce` reports of the walls is, in the mean, the momentum that the
/// liquid loses, with walls in the group of the fix and outside, whether they are at rest or slide, and whether energies are asked
/// for at each timestep or not. What is left at the two ends of the run is some ten units of
/// momentum, of some two thousand.
#[test]
fn the_force_on_walls_balances_the_drive() {
    let folder = tempfile::tempdir().unwrap();
    for (scheme, dt, group, speed, more) in [
        ("two-stage", 0.05, "all", 0.0, ""),
        ("force-gradient every 2 lambda 0.17", 0.05, "fl", 1.0, ""),
        ("aboba", 0.03, "all", 0.0, "c_thermo_press"),
        ("aboba every 2", 0.03, "fl", 1.0, ""),
    ] {
        let steps = (45.0 / dt) as usize;
        let script = format!(
            "units lj\natom_style atomic\nboundary p p f\nneigh_modify delay 0 every 1 check yes\n\
             lattice sc 5.359375 origin 0.5 0.5 0.5\nregion box block 0 4 0 4 0 8 units box\ncreate_box 1 box\n\
             create_atoms 1 box\nmass * 1\nreset_atoms id sort yes\nvelocity all create 1.0 4711 loop geom\n{}\
             pair_style mdpd/psi 1.0 1.0 90210\npair_coeff * * -40 25 18 1.0 0.75\n\
             region lo block INF INF INF INF INF 1 units box\nregion hi block INF INF INF INF 7 INF units box\n\
             group lo region lo\ngroup hi region hi\ngroup wall union lo hi\ngroup fl subtract all wall\n\
             velocity lo set -{speed} 0 0\nvelocity hi set {speed} 0 0\nfix 1 {group} dpd/splitting {scheme}\n\
             fix slo lo setforce 0 0 0\nfix shi hi setforce 0 0 0\n\
             fix rf fl wall/reflect zlo 0.3 zhi 7.7 units box\nfix g fl addforce 0.1 0 0\ntimestep {dt}\nthermo 1000\n\
             run 20\nreset_timestep 0\nvariable p equal vcm(fl,x)*count(fl)\nvariable p0 equal ${{p}}\n\
             variable n equal count(fl)\nvariable f equal f_slo[1]+f_shi[1]\n\
             fix a all ave/time 1 {steps} {steps} v_f {more}\nthermo_style custom step v_f v_p\nrun {steps}\n\
             variable found equal {}\n\
             print \"balance $(v_found) $(0.1*v_n-(v_p-v_p0)/({steps}*{dt}))\"\n",
            load(),
            if more.is_empty() { "f_a" } else { "f_a[1]" }
        );
        let rows = rows(&said(folder.path(), &script, 1), "balance ");
        let [found, expected] = rows[0][..] else { panic!("{rows:?}") };
        assert!(expected > 10.0, "{rows:?}");
        let off = (found - expected).abs() / 49.0;
        assert!(off < 0.02, "{scheme}, {group}, {speed}: {found} {expected}");
    }
}

/// Atoms of five times the thermal velocity, at twenty phases of a timestep, come back from walls with their energy within 3 kT at
/// the timesteps of the page, and no wall is named; at longer ones they do not, and each wall is named once in a run.
#[test]
fn walls_that_are_too_stiff_are_named() {
    let (folder, path) = file("title = \"free\"\nspecies = [\"A\"]\n[[thermostat]]\ngamma = 1\nrange = 1\n");
    let page =
        std::fs::read_to_string(psidpd_tests::root().join("lammps-plugin/doc/fix_dpd_splitting.md")).unwrap();
    for row in [
        "| wall/lj93, ε = 1, σ = 1 | 67 | 0.03 | 0.02 |",
        "| wall/lj126, ε = 1, σ = 1 | 63 | 0.03 | 0.02 |",
        "| wall/harmonic, ε = 1000 | 45 | 0.03 | 0.03 |",
    ] {
        assert!(page.contains(row), "{row}");
    }
    for (scheme, right, wrong, mass, kt) in [
        ("two-stage", 0.03, 0.05, 1.0, 1.0),
        ("force-gradient", 0.03, 0.05, 4.0, 2.0),
        ("aboba", 0.02, 0.035, 1.0, 2.0),
    ] {
        let unit = f64::sqrt(mass / kt);
        let speed = 5.0 / unit;
        for (step, named) in [(right, false), (wrong, true)] {
            let dt = step * unit;
            let mut atoms = String::new();
            for (row, [y, z, v, w]) in
                [[10.0, 2.6, 0.0, -speed], [10.0, 17.4, 0.0, speed], [1.1, 10.0, -speed, 0.0]]
                    .into_iter()
                    .enumerate()
            {
                for k in 0..20 {
                    let back = dt * f64::from(k) / 20.0;
                    atoms += &format!(
                        "create_atoms 1 single {} {} {}\n",
                        1.5 * f64::from(k),
                        y - v * back,
                        z - w * back
                    );
                }
                atoms += &format!(
                    "group r{row} id {}:{}\nvelocity r{row} set 0 {v} {w}\n",
                    20 * row + 1,
                    20 * row + 20
                );
            }
            let steps = (1.1 * unit / dt).round();
            let script = format!(
                "units lj\natom_style atomic\nboundary p f f\nregion b block 0 30 0 20 0 20\ncreate_box 1 b\nmass 1 {mass}\n{atoms}{}\
                 pair_style dpd/psi {kt} 5\npair_coeff * * \"{path}\" A\nfix 1 all dpd/splitting {scheme}\n\
                 fix a all wall/lj93 zlo EDGE {kt} 1 2.5\nfix b all wall/lj126 zhi EDGE {kt} 1 2.5\n\
                 fix c all wall/harmonic ylo EDGE $(1000*{kt}) 1 1\ncompute e all ke/atom\ncompute top all reduce max c_e\n\
                 compute low all reduce min c_e\nthermo_style custom step c_top c_low\ntimestep {dt}\nrun {steps}\n\
                 print \"energies $(c_top/{kt}) $(c_low/{kt})\"\nrun 1\n",
                load()
            );
            for ranks in [1, 2] {
                let said = said(folder.path(), &script, ranks);
                let energies = rows(&said, "energies ");
                let off = energies[0].iter().map(|e| (e - 12.5).abs()).fold(0.0, f64::max);
                assert_eq!(off > 3.0, named, "{scheme}, {step}: {energies:?}");
                for wall in ["fix a (wall/lj93)", "fix b (wall/lj126)", "fix c (wall/harmonic)"] {
                    let warned = said.matches(&format!("{wall} at step")).count();
                    assert_eq!(warned, usize::from(named), "{scheme}, {step}, {wall}, {ranks} ranks: {said}");
                }
            }
        }
    }
}
