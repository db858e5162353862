//! A LAMMPS built from source, with plugins. `.ci/source-host` builds one, keeps it, and runs these tests in it.

mod host_common;
mod style_common;

use host_common::{Runs, model, script};
use psidpd::lammps::{Host, HostKind, plugin};
use psidpd_tests::{psidpd, said};
use std::path::PathBuf;
use std::sync::OnceLock;
use style_common::difference;

/// The source tree, and the plugin built for it.
struct Source {
    host: Host,
    plugin: PathBuf,
}

fn source() -> &'static Source {
    static SOURCE: OnceLock<Source> = OnceLock::new();
    SOURCE.get_or_init(|| {
        let place = std::env::var_os("PSIDPD_LAMMPS_SOURCE")
            .expect("PSIDPD_LAMMPS_SOURCE names a LAMMPS source tree with a build");
        let host = Host::at(place.as_ref()).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(host.kind, HostKind::Source);
        assert!(host.version().unwrap().plugins, "it must be built with -D PKG_PLUGIN=on");
        let plugin = plugin::build(&host, &|_| {}).unwrap_or_else(|e| panic!("{e}"));
        assert!(plugin::launcher(&plugin).is_none(), "this LAMMPS loads plugins: it needs no launcher");
        Source { host, plugin }
    })
}

impl Source {
    fn runs(&self) -> Runs {
        Runs { host: self.host.clone(), load: format!("plugin load \"{}\"\n", self.plugin.display()) }
    }
}

#[test]
#[ignore = "needs a LAMMPS built from source, in PSIDPD_LAMMPS_SOURCE"]
fn forces_equal_the_native_engine() {
    host_common::forces_equal_the_native_engine(&source().runs());
}

#[test]
#[ignore = "needs a LAMMPS built from source, in PSIDPD_LAMMPS_SOURCE"]
fn splittings_are_the_native_ones() {
    host_common::splittings_are_the_native_ones(&source().runs());
}

#[test]
#[ignore = "needs a LAMMPS built from source, in PSIDPD_LAMMPS_SOURCE"]
fn walls_are_the_native_ones() {
    host_common::walls_are_the_native_ones(&source().runs());
}

/// Weakened or excluded pairs, with newton on and off.
#[test]
#[ignore = "needs a LAMMPS built from source, in PSIDPD_LAMMPS_SOURCE"]
fn weakened_and_excluded_pairs_are_the_formulas() {
    for newton in ["on", "off"] {
        let said = host_common::special_factors_and_exclusions(&source().runs(), newton);
        assert!(said[0].contains("  special bonds factors"), "{}", said[0]);
        assert!(said[1].contains("  exclusions    pairs"), "{}", said[1]);
    }
}

/// The program prints how to use its build, and the plugin can be loaded and unloaded.
#[test]
#[ignore = "needs a LAMMPS built from source, in PSIDPD_LAMMPS_SOURCE"]
fn the_program_builds_for_it_and_the_plugin_goes_and_comes() {
    let folder = tempfile::tempdir().unwrap();
    let place = source().host.root.display().to_string();
    let out = psidpd(folder.path(), &["lammps", "plugin", "--lammps", &place]);
    assert!(out.status.success(), "{}", said(&out));
    assert!(said(&out).contains(&format!("plugin load \"{}\"", source().plugin.display())), "{}", said(&out));
    let runs = source().runs();
    let text = script(&model());
    let again = format!("{text}plugin unload pair dpd/psi\nclear\n{}{text}", runs.load);
    for ranks in [1, 2] {
        let said = runs.outcome(&again, ranks, folder.path()).unwrap();
        assert_eq!(said.matches("Loop time").count(), 2, "{said}");
        assert!(said.contains(&format!("on {ranks} procs")), "{said}");
    }
}

/// If this version has the built-in `mdpd`, the laws agree.
#[test]
#[ignore = "needs a LAMMPS built from source with DPD-MESO, in PSIDPD_LAMMPS_SOURCE"]
fn law_lucy_is_its_built_in_mdpd() {
    let folder = tempfile::tempdir().unwrap();
    let runs = source().runs();
    let forces = |style: &str| {
        let text = format!(
            "units lj\natom_style mdpd\ncomm_modify vel yes\nregion b block 0 5 0 5 0 5\ncreate_box 2 b\n\
             create_atoms 1 random 600 4711 NULL\nset type 1 type/fraction 2 0.4 8731\nmass 1 1\nmass 2 2.5\n\
             {style}fix 1 all nve\ndump d all custom 1 f.dump id type x y z fx fy fz\n\
             dump_modify d sort id format float %.17g\nrun 0\n"
        );
        runs.outcome(&text, 1, folder.path()).unwrap_or_else(|e| panic!("{e}"));
        host_common::read_forces(&folder.path().join("f.dump"))
    };
    let [x, theirs] = forces(
        "pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 5\npair_coeff 1 1 mdpd/rhosum 0.75\n\
         pair_coeff 1 2 mdpd/rhosum 0.6\npair_coeff 2 2 mdpd/rhosum 0.75\npair_coeff 1 1 mdpd -40 25 0 1 0.75\n\
         pair_coeff 1 2 mdpd -30 20 0 0.9 0.6\npair_coeff 2 2 mdpd -20 12.5 0 1 0.75\n",
    );
    let [same, ours] = forces(
        "pair_style mdpd/psi 1.0 1.0 5 law lucy\npair_coeff 1 1 -40 25 0 1 0.75\n\
         pair_coeff 1 2 -30 20 0 0.9 0.6\npair_coeff 2 2 -20 12.5 0 1 0.75\n",
    );
    assert_eq!(x, same);
    let apart = difference(&ours, &theirs);
    assert!(apart < 1e-10, "{apart}");
}
