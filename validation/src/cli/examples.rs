//! The examples that `--help` shows below the options. A test parses each.

/// Verbs (a subverb follows after a blank), and examples of each.
const EXAMPLES: &[(&str, &[&str])] = &[
    ("validate", &["psidpd validate", "psidpd validate --full --out target/validate-full"]),
    ("bench", &["psidpd bench", "psidpd bench --sizes 6050 --threads 1,2 --json bench.json"]),
    ("pareto", &["psidpd pareto scene.toml --tolerance T=0.5% --minutes 5"]),
    ("hardcases", &["psidpd hardcases --quick"]),
    ("check", &["psidpd check scene.toml --set kT=0.9", "psidpd check model.toml --kT 1 --density 6.05"]),
    (
        "theory",
        &[
            "psidpd theory model.toml --kT 0.8,1,1.2 --report theory.html",
            "psidpd theory model.toml --kT 1 --measure",
            "psidpd theory model.toml --set parameters.A=-50",
        ],
    ),
    ("calibrate", &["psidpd calibrate model.toml --kT 1 --density 3:10 --out calibrated.toml"]),
    (
        "model liquid",
        &[
            "psidpd model liquid water --density 997 --tension 0.0720 --compressibility 4.52e-10 --viscosity 8.9e-4 --temperature 298.15 \
             --molar-mass 0.018015 --molecules 3 --out water.toml",
            "psidpd model liquid oil --data oil.toml --rc 1e-9 --out oil-model.toml",
        ],
    ),
    ("model wall", &["psidpd model wall water.toml --contact-angle 110 --out teflon.toml"]),
    ("reproduce", &["psidpd reproduce --list"]),
    ("new", &["psidpd new hanging --template pendant-drop"]),
    (
        "run",
        &[
            "psidpd run scene.toml --out slab --threads 4 --report",
            "psidpd run scene.toml --out cold --set kT=0.8 --set stage.produce.steps=5000",
            "psidpd run scene.toml --out slab --resume",
            "psidpd run scene.toml --out slab --resume --steps +10000",
            "psidpd run scene.toml --out slab --device gpu",
        ],
    ),
    ("devices", &["psidpd devices --json devices.json"]),
    (
        "sweep",
        &[
            "psidpd sweep scene.toml --over kT=0.5:1.5:11 --out isochore",
            "psidpd sweep scene.toml --over kT=0.8,1 --over model.parameters.B=20:30:5 --out map --jobs 2",
        ],
    ),
    ("report", &["psidpd report slab"]),
    (
        "snapshot",
        &[
            "psidpd snapshot slab/final.data --model model.toml --out slab.svg",
            "psidpd snapshot slab/dump.lammpstrj --frame 3 --view y --slice 1 --out slice.png",
        ],
    ),
    ("forces", &["psidpd forces --model model.toml --data atoms.data --kT 1 --json forces.json"]),
    ("export eam", &["psidpd export eam model.toml --kT 1 --out model.eam.alloy"]),
    ("export lammps", &["psidpd export lammps scene.toml --out deck --set kT=0.8"]),
    ("lammps plugin", &["psidpd lammps plugin --lammps system"]),
    ("lammps convert", &["psidpd lammps convert in.mdpd --out in.psi"]),
    ("completions", &["psidpd completions bash > ~/.local/share/bash-completion/completions/psidpd"]),
    ("man", &["psidpd man --out ~/.local/share/man/man1"]),
];

/// Adds the examples to the help of each verb.
pub fn add(command: clap::Command) -> clap::Command {
    EXAMPLES.iter().fold(command, |command, (verb, examples)| {
        let mut text = "Examples:\n".to_owned();
        examples.iter().for_each(|example| text += &format!("  {example}\n"));
        match verb.split_once(' ') {
            None => command.mut_subcommand(verb, |c| below(c, &text)),
            Some((outer, inner)) => {
                command.mut_subcommand(outer, |c| c.mut_subcommand(inner, |c| below(c, &text)))
            }
        }
    })
}

fn below(command: clap::Command, text: &str) -> clap::Command {
    let before = command.get_after_help().map_or(String::new(), |help| format!("{help}\n"));
    command.after_help(before + text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_example_is_a_command() {
        for example in EXAMPLES.iter().flat_map(|(_, examples)| *examples) {
            let words = example.split(" > ").next().unwrap_or_default().split(' ');
            if let Err(error) = super::super::command().try_get_matches_from(words) {
                panic!("{example}: {error}");
            }
        }
        super::super::command().debug_assert();
    }

    #[test]
    fn every_verb_has_an_example() {
        for verb in super::super::command().get_subcommands().filter(|c| c.get_name() != "help") {
            let name = verb.get_name();
            let has = EXAMPLES.iter().any(|(v, _)| v.split(' ').next() == Some(name));
            assert!(has, "{name}");
        }
    }
}
