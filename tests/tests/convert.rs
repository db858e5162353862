//! `psidpd lammps convert` turns a script for the built-in `mdpd` into one for the same fluid with `mdpd/psi`.

mod style_common;

use psidpd::formats::dump;
use psidpd_tests::{lammps, psidpd, said};
use std::path::Path;
use style_common::{LIMIT, difference};

/// A user's script for a drop, which includes its fluid; older versions of the built-in need no velocities of ghosts.
const OLD: &str = "# a drop\nunits        lj\natom_style   STYLE\nread_data    drop.data\n\
    set          type * sph/rho 0.0\nmass         * 1.0\ninclude      fluid.in\n\
    fix          move all mvv/dpd\ntimestep     0.001\n\
    dump         d all custom 20 f.dump id type x y z fx fy fz\n\
    dump_modify  d sort id format float %.17g\nrun          20\n";

const FLUID: &str = "pair_style   hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 9872598\n\
    pair_coeff   * * mdpd/rhosum 0.75\npair_coeff   * * mdpd -40 25 &\n             4.5 1.0 0.75\n";

/// Positions and forces at the start and at the end.
fn frames(folder: &Path, script: &str) -> Vec<[Vec<[f64; 3]>; 2]> {
    let run = lammps().0.run_script(1, folder, script.as_ref(), &[], LIMIT);
    run.unwrap_or_else(|e| panic!("{script}: {e}"));
    let frames = dump::read(&folder.join("f.dump")).unwrap();
    frames
        .iter()
        .map(|f| [["x", "y", "z"], ["fx", "fy", "fz"]].map(|names| f.vectors(names).unwrap()))
        .collect()
}

#[test]
fn a_converted_script_is_the_same_fluid() {
    for style in ["mdpd", "hybrid mdpd bond", "hybrid charge mdpd"] {
        is_the_same_fluid(style);
    }
}

fn is_the_same_fluid(style: &str) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let make = format!(
        "units lj\natom_style {style}\nregion b block 0 5 0 5 0 5\ncreate_box 2 b\n\
         create_atoms 1 random 600 4711 NULL overlap 0.3 maxtry 100\nset type 1 type/ratio 2 0.4 77\nmass * 1\n\
         pair_style zero 1.0\npair_coeff * *\nvelocity all create 1.0 87 loop geom\nwrite_data drop.data nocoeff\n"
    );
    std::fs::write(at("in.make"), make).unwrap();
    lammps().0.run_script(1, folder.path(), "in.make".as_ref(), &[], LIMIT).unwrap();
    std::fs::write(at("in.old"), OLD.replace("STYLE", style)).unwrap();
    // Noise is not the built-in's, so that the same fluid is the one without drag.
    std::fs::write(at("fluid.in"), FLUID.replace(" 4.5 ", " 0 ")).unwrap();
    let run = OLD.replace("STYLE", style).replace("read_data", "comm_modify vel yes\nread_data");
    std::fs::write(at("in.run"), run).unwrap();
    let old = frames(folder.path(), "in.run");

    let arguments = ["lammps", "convert", "in.old", "--law", "lucy", "--out", "in.new", "--json", "new.json"];
    let out = psidpd(folder.path(), &arguments);
    assert!(out.status.success(), "{}", said(&out));
    let report: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(at("new.json")).unwrap()).unwrap();
    for none in ["left", "by_hand"] {
        assert_eq!(report[none].as_array().unwrap().len(), 0, "{report}");
    }
    assert_eq!(report["files"].as_array().unwrap().len(), 3, "{report}");
    // The script loads the plugin of this test instead of the program's default path.
    let text = std::fs::read_to_string(at("fluid.in.psi")).unwrap();
    let plugin = text.lines().find(|l| l.starts_with("plugin")).unwrap().to_owned();
    let text = text.replace(&plugin, &format!("plugin load \"{}\"", lammps().1.display()));
    std::fs::write(at("fluid.in.psi"), &text).unwrap();
    let new = frames(folder.path(), "in.new");
    assert_eq!(old.len(), 2);
    for ([x, f], [same_x, same_f]) in old.iter().zip(&new) {
        assert!(difference(same_x, x) < 1e-9, "{style}: {}", difference(same_x, x));
        assert!(difference(same_f, f) < 1e-9, "{style}: {}", difference(same_f, f));
    }
    // With drag the new style needs velocities of ghosts, which the new script asks for.
    std::fs::write(at("fluid.in.psi"), text.replace(" 0 1.0 0.75", " 4.5 1.0 0.75")).unwrap();
    frames(folder.path(), "in.new");

    // The conservative law is another fluid, and the output says so.
    let out = psidpd(folder.path(), &["lammps", "convert", "fluid.in"]);
    assert!(out.status.success() && said(&out).contains("another fluid"), "{}", said(&out));
    assert!(String::from_utf8_lossy(&out.stdout).contains("mdpd/psi 1.0 1.0 9872598\n"), "{}", said(&out));

    // A command that cannot be rewritten is named with its line, and the exit code is 1.
    let hidden = format!("{}fix 2 all adapt 1 pair mdpd A * * v_a\n", OLD.replace("STYLE", style));
    std::fs::write(at("in.hidden"), &hidden).unwrap();
    let out = psidpd(folder.path(), &["lammps", "convert", "in.hidden", "--law", "lucy"]);
    let expected = format!(
        "by hand  line {:4}: names the built-in style: rewrite it for mdpd/psi",
        hidden.lines().count()
    );
    assert!(out.status.code() == Some(1) && said(&out).contains(&expected), "{}", said(&out));
    let missing = psidpd(folder.path(), &["lammps", "convert", "in.nowhere"]);
    assert_eq!(missing.status.code(), Some(2), "{}", said(&missing));
}
