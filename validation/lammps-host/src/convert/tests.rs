use super::data::{Column, data_file};
use super::*;

/// Converts a script that includes nothing.
fn converted(old: &str, law: Law, plugin: &str) -> Converted {
    script(old, law, Some(plugin), &|_| None)
}

const OLD: &str = "# a slab\nunits lj\natom_style  mdpd\ncomm_modify vel yes\nread_data   slab.data\n\
    set type 1 sph/rho 0.0\n\
    pair_style  hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 9872598  # both\n\
    pair_coeff  1 1 mdpd/rhosum  0.75\npair_coeff  1 1 mdpd &\n  -40 25 18.0 1.0 0.75\n\
    fix mvv all mvv/dpd\nprint \"\"\"atom_style mdpd\nfix x all mvv/dpd\n\"\"\"\nrun 10\n";

fn texts(notes: &[Note]) -> String {
    notes.iter().map(|n| format!("{}: {}\n", n.line, n.text)).collect()
}

#[test]
fn only_what_knows_of_the_built_in_is_changed() {
    let new = converted(OLD, Law::Lucy, "psidpdplugin.so");
    assert_eq!(
        new.script,
        "# a slab\nunits lj\natom_style  atomic\ncomm_modify vel yes\nread_data   slab.data.atomic\n\
         plugin      load psidpdplugin.so\n\
         pair_style  mdpd/psi 1.0 1.0 9872598 law lucy  # both\n\
         pair_coeff  1 1 -40 25 18.0 1.0 0.75\n\
         fix mvv all nve\nprint \"\"\"atom_style mdpd\nfix x all mvv/dpd\n\"\"\"\nrun 10\n"
    );
    assert_eq!(new.left, []);
    assert_eq!(new.changed.iter().map(|n| n.line).collect::<Vec<_>>(), [3, 5, 6, 7, 8, 9, 11]);
    assert_eq!(new.by_hand, []);
    assert!(new.data.len() == 1 && new.data[0].name == "slab.data" && new.data[0].column == Column::OF_MDPD);
    let conservative = converted(OLD, Law::Conservative, "p.so");
    assert!(conservative.script.contains("mdpd/psi 1.0 1.0 9872598  #"));
    assert!(texts(&conservative.left).contains("another fluid"));
}

#[test]
fn other_styles_stay_beside() {
    let new = converted(
        "atom_style hybrid mdpd bond\npair_style hybrid/overlay mdpd 1 1 $s mdpd/rhosum lj/cut 2.5\n\
         pair_coeff * * mdpd/rhosum 0.8\npair_coeff * * mdpd -40 25 18 1 0.75\npair_coeff 1 1 lj/cut 1 1\n",
        Law::Lucy,
        "p.so",
    );
    assert_eq!(
        new.script,
        "atom_style hybrid bond\ncomm_modify vel yes\nplugin     load p.so\npair_style hybrid/overlay mdpd/psi 1 1 $s law lucy lj/cut 2.5\n\
         pair_coeff * * mdpd/psi -40 25 18 1 0.75\npair_coeff 1 1 lj/cut 1 1\n"
    );
    let left = texts(&new.left);
    for said in ["used the densities of the previous step", "had the range 0.8, forces 0.75"] {
        assert!(left.contains(said), "{said}: {left}");
    }
    assert!(texts(&new.changed).contains("2: the thermostat needs velocities of ghosts"));
}

#[test]
fn what_is_left_is_said() {
    let old = "units si\natom_style mdpd\nread_data $f\nread_restart r\ncompute n all property/atom rho\n\
        pair_style hybrid/overlay mdpd/rhosum mdpd 1 1 5\npair_coeff 1 1 mdpd -40 25 18 1 0.75\n\
        pair_coeff 1 2 mdpd -40 20 18 1 0.75\nfix 1 all mvv/dpd 0.65\npair_modify pair mdpd shift no\n";
    let new = converted(old, Law::Conservative, "p.so");
    assert!(texts(&new.left).contains("9: mvv/dpd had lambda = 0.65"));
    let by_hand = texts(&new.by_hand);
    for said in [
        "1: the style works in units lj, real and metal",
        "3: a variable has the data file: take the density out of its atoms, column 3",
    ] {
        assert!(by_hand.contains(said), "{said}: {by_hand}");
    }
    assert!(texts(&new.left).contains("4: a restart file"));
    assert!(texts(&new.changed).contains("there is no property rho, which nothing uses"));
    assert!(new.models.len() == 1 && new.models[0].0.line == 6, "{:?}", new.models);
    assert!(new.models[0].0.text.contains("B differs between pairs of types (25 and 20)"));
    let none = converted("units lj\npair_style lj/cut 1\n", Law::Lucy, "p.so");
    assert_eq!(none.script, "units lj\npair_style lj/cut 1\n");
    assert!(texts(&none.by_hand).contains("no pair style of the built-in"));
    let half = converted("pair_style mdpd 1 1 5", Law::Lucy, "p.so");
    assert_eq!(half.script, "pair_style mdpd 1 1 5");
    assert!(texts(&half.by_hand).contains("belong together"));
}

#[test]
fn the_column_of_densities_goes() {
    let old = "title\n\n2 atoms\n1 atom types\n0 1 xlo xhi\n\nAtoms # mdpd\n\n1 1 0.0 0.1 0.2 0.3\n\
        2 1 6.5 0.4 0.5 0.6 1 0 0 # last\n\nVelocities\n\n1 0 0 0\n";
    assert_eq!(
        data_file(old, Column::OF_MDPD).unwrap(),
        "title\n\n2 atoms\n1 atom types\n0 1 xlo xhi\n\nAtoms # atomic\n\n1 1 0.1 0.2 0.3\n\
         2 1 0.4 0.5 0.6 1 0 0\n\nVelocities\n\n1 0 0 0\n"
    );
    assert_eq!(data_file("t\n\nAtoms\n\n1 1 0 0 0\n", Column::OF_MDPD).unwrap_err().line, 5);
    // Of a hybrid the columns of a style that comes first are before it.
    for (styles, before) in [("mdpd bond", 5), ("bond mdpd", 6), ("bond full mdpd", 7), ("sphere mdpd", 7)] {
        let styles: Vec<&str> = styles.split(' ').collect();
        assert_eq!(Column::of_hybrid(&styles), Some(Column(before)), "{styles:?}");
    }
    assert_eq!(Column::of_hybrid(&["line", "mdpd"]), None);
    let hybrid = "t\n\nAtoms # hybrid\n\n1 1 0.1 0.2 0.3 6.5 7 1 0 0\n";
    let without = hybrid.replace("6.5 ", "");
    assert_eq!(data_file(hybrid, Column(5)).unwrap(), without);
    assert_eq!(data_file(&without, Column(9)).unwrap_err().line, 5);
}

/// Commands that name the built-in where they cannot be rewritten, with their lines.
#[test]
fn what_is_hidden_is_named() {
    let style = "pair_style hybrid/overlay mdpd/rhosum mdpd 1 1 5\n";
    for (old, said) in [
        ("atom_style ${a}\n", "1: a variable has the style"),
        ("pair_style ${p}\npair_coeff 1 1 mdpd -40 25 18 1 0.75\n", "1: a variable has the style"),
        (
            "pair_style ${p}\npair_coeff 1 1 mdpd -40 25 18 1 0.75\n",
            "2: names the built-in style: rewrite it for mdpd/psi",
        ),
        (
            "variable p index \"hybrid/overlay mdpd/rhosum mdpd 1 1 5\" other\n",
            "1: names the built-in style: rewrite it for mdpd/psi",
        ),
        (
            "run 10 every 5 \"set group all sph/rho 0\"\n",
            "1: names the built-in style: rewrite it for mdpd/psi",
        ),
        ("include ${f}\n", "1: a variable has the included file"),
        ("\ninclude none\n", "2: the included file cannot be read"),
        ("atom_style hybrid line mdpd\nread_data d\n", "2: atoms of this hybrid have a column"),
    ] {
        let new = converted(&format!("{old}{style}"), Law::Lucy, "p.so");
        assert!(texts(&new.by_hand).contains(said), "{said}: {new:?}");
        assert!(new.script.contains(old.lines().last().unwrap()), "{said}: {}", new.script);
    }
    // Groups, regions and files may have any name.
    let named =
        "region mdpd block 0 1 0 1 0 1\ngroup mdpd region mdpd\nfix 2 mdpd nve\ndump 1 mdpd atom 9 mdpd/f\n";
    assert_eq!(converted(&format!("{named}{style}"), Law::Lucy, "p.so").by_hand, []);
}

/// Files that a script includes are converted as if they were in it, each once.
#[test]
fn included_files_are_converted() {
    let read = |name: &str| match name {
        "set/fluid.in" => {
            Some("pair_style hybrid/overlay mdpd/rhosum mdpd 1 1 5\ninclude more.in\n".to_owned())
        }
        "more.in" => {
            Some("pair_coeff * * mdpd/rhosum 0.75\npair_coeff * * mdpd -40 25 18 1 0.75\n".to_owned())
        }
        "other.in" => Some("include other.in\nthermo 10\n".to_owned()),
        _ => None,
    };
    let old = "atom_style mdpd\ninclude set/fluid.in\ninclude \"set/fluid.in\"\ninclude other.in\nfix 1 all mvv/dpd\n";
    let new = script(old, Law::Lucy, Some("p.so"), &read);
    assert_eq!(
        new.script,
        "atom_style atomic\ninclude fluid.in.psi\ninclude fluid.in.psi\ninclude other.in\nfix 1 all nve\n"
    );
    let fluid = "comm_modify vel yes\nplugin     load p.so\npair_style mdpd/psi 1 1 5 law lucy\ninclude more.in.psi\n";
    let files = [("set/fluid.in", fluid), ("more.in", "pair_coeff * * -40 25 18 1 0.75\n")];
    for (name, text) in files {
        assert!(new.included.contains(&(name.to_owned(), text.to_owned())), "{name}: {:?}", new.included);
    }
    assert_eq!(new.included.len(), 2);
    let [circle] = &new.by_hand[..] else { panic!("{:?}", new.by_hand) };
    assert!(circle.file.as_deref() == Some("other.in") && circle.line == 1, "{circle:?}");
    assert!(new.changed.iter().any(|n| n.file.as_deref() == Some("more.in") && n.line == 2));
}

const HEAD: &str = "units lj\natom_style mdpd\ncreate_box 2 b\nmass * 1.0\n\
    pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 5\n";

/// The remarks of a script that begins with `HEAD`.
fn remarks(rest: &str, law: Law) -> String {
    let new = converted(&format!("{HEAD}{rest}"), law, "p.so");
    let models: Vec<Note> = new.models.iter().map(|(note, _)| note.clone()).collect();
    texts(&new.left) + &texts(&new.by_hand) + &texts(&models)
}

/// Numbers are compared as numbers, for each pair of types and each run.
#[test]
fn fluids_are_compared_when_lammps_runs() {
    let both = "pair_coeff * * mdpd/rhosum 0.75\npair_coeff * * mdpd -40 25 18 1 0.75\n";
    let same = "variable B equal 2.5e1\npair_coeff * * mdpd/rhosum 7.5e-1\npair_coeff 1 1*2 mdpd -40 25 18 1 .75\n\
        pair_coeff 2 2 mdpd -40 25.0 18 1 0.750\npair_coeff 1 2 mdpd -30 ${B} 18 1 0.75\nrun 5\n";
    for (rest, said) in [
        (same.to_owned(), None),
        // A later command mends the ranges, after a run without.
        (
            format!("pair_coeff * * mdpd/rhosum 0.8\npair_coeff * * mdpd -40 25 18 1 0.75\nrun 5\n{both}run 5\n"),
            Some("types 1 2: densities had the range 0.8, forces 0.75"),
        ),
        (format!("pair_coeff * * mdpd/rhosum 0.8\n{both}run 5\n"), None),
        (
            format!("{both}pair_coeff 2 2 mdpd -40 25 18 1 0.70\nrun 5\n"),
            Some("types 2 2: densities had the range 0.75, forces 0.70"),
        ),
        (
            format!("{both}pair_coeff 2 2 mdpd -40 20 18 1 0.75\nrun 5\n{both}run 5\n"),
            Some("B differs between pairs of types (25 and 20)"),
        ),
        // One B with two ranges has no potential either.
        (
            "pair_coeff * * mdpd/rhosum 0.75\npair_coeff 2 2 mdpd/rhosum 0.5\npair_coeff * * mdpd -40 25 18 1 0.75\n\
             pair_coeff 2 2 mdpd -40 25 18 1 0.5\nrun 5\n"
                .into(),
            Some("differs between pairs of types"),
        ),
        // B rd^4 is the same: the force has a potential.
        (
            "pair_coeff * * mdpd/rhosum 0.75\npair_coeff 2 2 mdpd/rhosum 0.5\npair_coeff * * mdpd -40 16 18 1 0.75\n\
             pair_coeff 2 2 mdpd -40 $(16*1.5^4) 18 1 0.5\nrun 5\n"
                .into(),
            None,
        ),
        (format!("{both}mass 2 2.0\nrun 5\n"), Some("masses differ (1 of type 1, 2 of type 2)")),
        (format!("{both}mass * 2.0\nrun 5\n"), Some("B times 2 makes up for it")),
        (format!("{both}variable m equal mass(all)\nmass 2 ${{m}}\nrun 5\n"), Some("a mass is ${m}")),
        (
            "pair_coeff * * mdpd/rhosum 0.75\npair_coeff 1 1 mdpd -40 25 18 1 0.75\nrun 5\n".into(),
            Some("types 1 2 have a density without a force"),
        ),
        (
            "pair_coeff 1 1 mdpd/rhosum 0.75\npair_coeff * * mdpd -40 25 18 1 0.75\nrun 5\n".into(),
            Some("types 1 2 had no mdpd/rhosum when LAMMPS ran"),
        ),
    ] {
        let found = remarks(&rest, Law::Conservative);
        let found: Vec<&str> = found.lines().filter(|line| !line.contains("another fluid")).collect();
        match said {
            Some(said) => assert!(found.iter().any(|line| line.contains(said)), "{said}: {found:?}"),
            None => assert_eq!(found, [] as [&str; 0], "{rest}"),
        }
    }
    // Types of a loop.
    let looped = "pair_coeff * * mdpd/rhosum 0.75\nvariable i loop 2\nlabel a\npair_coeff $i * mdpd -40 25 18 1 0.75\n\
                  next i\njump SELF a\nrun 5\n";
    let found = remarks(looped, Law::Lucy);
    assert!(found.contains("the types $i * are known only when LAMMPS runs"), "{found}");
    assert!(!found.contains("without a force"), "{found}");
    // The built-in's own law has its weights, and any B.
    assert_eq!(remarks(&format!("{both}mass 2 2.0\npair_coeff 1 2 mdpd -40 20 1 1 0.75\n"), Law::Lucy), "");
}

#[test]
fn accelerated_styles_are_the_built_ins() {
    let new = converted(
        "pair_style hybrid/overlay mdpd/rhosum/omp mdpd/gpu 1.0 1.0 0\npair_coeff * * mdpd/rhosum/omp 0.75\n\
         pair_coeff * * mdpd/gpu -40 25 18 1 0.75\nfix 1 all mvv/dpd/kk\n",
        Law::Conservative,
        "p.so",
    );
    assert!(
        new.script
            .ends_with("pair_style mdpd/psi 1.0 1.0 12345\npair_coeff * * -40 25 18 1 0.75\nfix 1 all nve\n"),
        "{}",
        new.script
    );
    assert_eq!(new.by_hand, []);
}

/// The style of some groups, whose drag has a range and an exponent of its own.
#[test]
fn drag_with_its_own_range() {
    let new = converted(
        "pair_style hybrid/overlay mdpd/rhosum mdpd/diffcut 1.0 1.0 3854262 11 srp 0.965 * mid exclude yes\n\
         pair_coeff 1 1 mdpd/rhosum 0.75\npair_coeff 1 1 mdpd/diffcut -40 25 14 1.0 0.75 1.4 0.5 1.00\npair_coeff 1 2 none\n\
         pair_coeff 2 2 srp 50.0 1.0\n",
        Law::Conservative,
        "p.so",
    );
    let expected = "pair_style hybrid/overlay mdpd/psi 1.0 1.4 3854262 srp 0.965 * mid exclude yes\n\
         pair_coeff 1 1 mdpd/psi -40 25 14 1.0 0.75 1.4 0.5\npair_coeff 1 2 none\npair_coeff 2 2 srp 50.0 1.0\n";
    assert!(new.script.ends_with(expected), "{}", new.script);
    assert_eq!(new.by_hand, []);
}

/// Without a plugin that was built here, LAMMPS loads the one of pip by itself.
#[test]
fn without_a_plugin_none_is_loaded() {
    let new = script(OLD, Law::Lucy, None, &|_| None);
    assert!(!new.script.contains("plugin"), "{}", new.script);
    assert!(texts(&new.changed).contains("no 'plugin load'"));
}

#[test]
fn programs_keep_what_is_no_command() {
    let old = "def f():\n    \"\"\"Runs mdpd.\"\"\"\n    lmp.command(\"pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 5\")\n\
        \x20   lmp.command('pair_coeff * * mdpd/rhosum 0.75'); x = 'it\\'s'\n    lmp.command(f'pair_coeff * * mdpd {a[\"x y\"]} 25 1 1 {rd}') # 'mdpd\n\
        \x20   write(\"fix 1 all mvv/dpd\\n\")\n";
    let new = python::program(old, Law::Lucy, Some("p.so"), &|_| None);
    assert_eq!(
        new.script,
        "def f():\n    \"\"\"Runs mdpd.\"\"\"\n    lmp.command(\"comm_modify vel yes\")\n    lmp.command(\"plugin     load p.so\")\n\
         \x20   lmp.command(\"pair_style mdpd/psi 1.0 1.0 5 law lucy\")\n\
         \x20   lmp.command(''); x = 'it\\'s'\n    lmp.command(f'pair_coeff * * {a[\"x y\"]} 25 1 1 {rd}') # 'mdpd\n\
         \x20   write(\"fix 1 all nve\\n\")\n"
    );
}

/// A script that goes on in another file is converted there; one that jumps to itself does so by the name that every script has.
#[test]
fn scripts_that_jump() {
    let style = "pair_style hybrid/overlay mdpd/rhosum mdpd 1 1 5\n";
    let read = |name: &str| match name {
        "fluid.in" => Some(format!("label again\n{style}jump fluid.in again\njump in.main top\n")),
        "in.main" => Some("label top\njump in.main top\njump fluid.in\n".to_owned()),
        _ => None,
    };
    let old = read("in.main").unwrap();
    let new = script(&old, Law::Lucy, Some("p.so"), &read);
    assert_eq!(new.script, "label top\njump SELF top\njump fluid.in.psi\n");
    assert_eq!(
        new.included[0].1,
        "label again\ncomm_modify vel yes\nplugin     load p.so\npair_style mdpd/psi 1 1 5 law lucy\njump SELF again\njump in.main top\n"
    );
    assert!(
        texts(&new.by_hand).contains("in.main is the script, which has another name now"),
        "{:?}",
        new.by_hand
    );
    let lost = converted(&format!("{style}jump other.in\n"), Law::Lucy, "p.so");
    assert!(texts(&lost.by_hand).contains("2: the included file cannot be read"));
}

/// The old integrator had velocities of its own.
#[test]
fn fixes_that_had_no_effect() {
    let style = "pair_style hybrid/overlay mdpd/rhosum mdpd 1 1 5\nfix w all wall/reflect zlo 0\n";
    let undone = "2: fix mvv/dpd undid what this fix does to velocities; now it acts";
    let new = converted(&format!("{style}fix 1 all mvv/dpd\n"), Law::Lucy, "p.so");
    assert!(texts(&new.left).contains(undone), "{:?}", new.left);
    let new = converted(&format!("{style}fix 1 all nve\n"), Law::Lucy, "p.so");
    assert!(!texts(&new.left).contains(undone), "{:?}", new.left);
}

/// Where a program inserts values by `%` a command that goes stays as a comment, which takes the values.
#[test]
fn programs_that_insert_values_by_percent() {
    let old = "l.command('comm_modify vel yes')\nl.command('pair_style hybrid/overlay mdpd/rhosum mdpd 1 1 5')\n\
               l.command('pair_coeff * * mdpd/rhosum %.2f' % rd)\nl.command('pair_coeff * * mdpd %g 25 0 1 %.2f' % (a, rd))\n";
    let new = python::program(old, Law::Lucy, None, &|_| None);
    let expected = "l.command('# not needed: pair_coeff * * mdpd/rhosum %.2f' % rd)\n\
                    l.command('pair_coeff * * %g 25 0 1 %.2f' % (a, rd))\n";
    assert!(new.script.ends_with(expected) && new.by_hand.is_empty(), "{} {:?}", new.script, new.by_hand);
}

/// One text that becomes several commands: elements of lists, arguments of calls, values that a generator yields, names of scripts;
/// code in a formatted text stays, in remarks too.
#[test]
fn programs_send_commands_in_several_ways() {
    let style = "pair_style hybrid/overlay mdpd/rhosum mdpd 1 1 5";
    let read = |name: &str| (name == "in.part").then(|| format!("{style}\n"));
    let plugin = "plugin     load p.so";
    let new = "pair_style mdpd/psi 1 1 5 law lucy";
    for (old, expected, by_hand) in [
        (format!("a = ['{style}', 'x']\n"), format!("a = ['{plugin}', '{new}', 'x']\n"), ""),
        (format!("a = '{style}', 'x'\n"), format!("a = '{plugin}', '{new}', 'x'\n"), ""),
        (
            format!("def f():\n    yield '{style}'\n"),
            format!("def f():\n    yield '{plugin}'\n    yield '{new}'\n"),
            "",
        ),
        (
            format!("  l.command('{style}') # c\n"),
            format!("  l.command('{plugin}')\n  l.command('{new}') # c\n"),
            "",
        ),
        (
            format!("if a: l.command('{style}')\n"),
            format!("if a: l.command('{plugin}'); l.command('{new}')\n"),
            "",
        ),
        (format!("send(\"{style}\")\n"), format!("send(\"{plugin}\")\nsend(\"{new}\")\n"), ""),
        (
            format!("a = '{style}'\n"),
            format!("a = '{plugin}\\n{new}'\n"),
            "1: this text is several commands now",
        ),
        ("l.file('in.part')\n".to_owned(), "l.file('in.part.psi')\n".to_owned(), ""),
    ] {
        let old = format!("# \"it's\"\nc = 'comm_modify vel yes'\n{old}");
        let new = python::program(&old, Law::Lucy, Some("p.so"), &read);
        assert!(new.script.ends_with(&expected), "{expected}: {}", new.script);
        let by_hand = by_hand.replace("1:", "3:");
        assert!(
            texts(&new.by_hand).contains(&by_hand) && new.by_hand.is_empty() == by_hand.is_empty(),
            "{:?}",
            new.by_hand
        );
    }
    let old = format!(
        "l.command(f'{style}')\nl.command(f'pair_coeff * * mdpd/rhosum {{0.8}}')\nl.command(f'pair_coeff * * mdpd {{a[\"x\"]}} 25 0 1 {{rd:.2f}}')\n"
    );
    let new = python::program(&old, Law::Lucy, None, &read);
    assert!(
        new.script.ends_with("l.command(f'pair_coeff * * {a[\"x\"]} 25 0 1 {rd:.2f}')\n"),
        "{}",
        new.script
    );
    assert!(
        texts(&new.left).contains("had the range 0.8, forces {rd:.2f}, which may differ"),
        "{:?}",
        new.left
    );
}
