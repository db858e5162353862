//! Files and arguments that nobody means well with, or that went wrong: they end with a message, soon, and touch nothing.

use psidpd_tests::{program, psidpd, said};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

const SOFT: &str = "title = \"t\"\nspecies = [\"F\"]\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = 25\n\
                    range = 1\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";

fn write(folder: &Path, name: &str, text: &str) {
    std::fs::write(folder.join(name), text).unwrap();
}

/// What the program says, with its lines put together, and its exit code.
fn words(output: &Output) -> (String, Option<i32>) {
    let text = said(output).replace(['│', '×'], " ");
    (text.split_whitespace().collect::<Vec<_>>().join(" "), output.status.code())
}

/// Results go through links and into pipes; nothing that is no file is replaced by one.
#[test]
fn json_is_written_through_what_is_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "m.toml", SOFT);
    std::fs::create_dir(here.join("inner")).unwrap();
    symlink("inner/real.json", here.join("link.json")).unwrap();
    for _ in 0..2 {
        let output = psidpd(here, &["check", "m.toml", "--json", "link.json"]);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        assert!(here.join("link.json").is_symlink());
        let text = std::fs::read_to_string(here.join("inner/real.json")).unwrap();
        serde_json::from_str::<serde_json::Value>(&text).unwrap();
    }
    // A pipe, and a file that the output was sent to: what was said before stays.
    let output = psidpd(here, &["check", "m.toml", "--json", "/dev/stdout"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let all = std::fs::File::create(here.join("all.txt")).unwrap();
    let status = Command::new(program())
        .args(["check", "m.toml", "--json", "/dev/stdout"])
        .current_dir(here)
        .stdout(all)
        .status()
        .unwrap();
    assert!(status.success());
    for text in [said(&output), std::fs::read_to_string(here.join("all.txt")).unwrap()] {
        assert!(text.starts_with("psidpd") || text.contains("kT"), "{text}");
        let json = &text[text.find("\n{").expect(&text)..];
        serde_json::from_str::<serde_json::Value>(json).unwrap();
    }
    psidpd(here, &["check", "m.toml", "--json", "/dev/null"]);
    assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
}

/// A pipe without a writer would be waited for.
#[test]
fn pipes_are_no_input() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "m.toml", SOFT);
    mknodat(CWD, here.join("pipe"), FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
    for arguments in [
        &["check", "pipe"][..],
        &["theory", "pipe"],
        &["run", "pipe", "--out", "out"],
        &["forces", "--model", "m.toml", "--data", "pipe", "--kT", "1"],
        &["snapshot", "pipe", "--out", "a.svg"],
    ] {
        let mut child = Command::new(program())
            .args(arguments)
            .current_dir(here)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let begun = Instant::now();
        while child.try_wait().unwrap().is_none() {
            if begun.elapsed() > Duration::from_secs(60) {
                child.kill().unwrap();
                panic!("{arguments:?} waits");
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let (text, code) = words(&child.wait_with_output().unwrap());
        assert_eq!(code, Some(2), "{arguments:?}: {text}");
        assert!(text.contains("not a regular file"), "{arguments:?}: {text}");
    }
}

#[test]
fn more_than_a_machine_has_is_refused_with_a_number() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let scene = |range: &str| {
        write(here, "m.toml", &SOFT.replace("range = 1\n[[thermo", &format!("range = {range}\n[[thermo")));
        let text =
            "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nbox = [4.0, 4.0, 4.0]\ndensity = 3.0\nsteps = 1\n";
        write(here, "s.toml", text);
    };
    scene("1");
    let (text, code) = words(&psidpd(here, &["run", "s.toml", "--out", "o", "--threads", "20000"]));
    assert!(code == Some(2) && text.contains("at most 1024"), "{text}");
    for (range, times) in [("20", "5.0 times"), ("1e6", "250000.0 times")] {
        scene(range);
        let begun = Instant::now();
        let (text, code) = words(&psidpd(here, &["run", "s.toml", "--out", "o"]));
        assert!(code == Some(2) && text.contains(times) && text.contains("GB"), "{text}");
        let (text, code) = words(&psidpd(here, &["check", "s.toml"]));
        assert!(code == Some(1) && text.contains(times), "{text}");
        assert!(begun.elapsed() < Duration::from_secs(60));
    }
    scene("1");
    let box_of = |edge: &str| format!("0 {edge} xlo xhi\n0 {edge} ylo yhi\n0 {edge} zlo zhi\n");
    let data = format!("t\n\n1 atoms\n1 atom types\n{}\nAtoms # atomic\n\n1 1 0 0 0\n", box_of("0.001"));
    write(here, "d.data", &data);
    for arguments in [
        &["forces", "--model", "m.toml", "--data", "d.data", "--kT", "1"][..],
        &["snapshot", "d.data", "--density", "--range", "1", "--out", "a.svg"],
        &["snapshot", "d.data", "--colour", "density", "--range", "1", "--out", "a.svg"],
        &["snapshot", "d.data", "--colour", "psi", "--model", "m.toml", "--kT", "1", "--out", "a.svg"],
    ] {
        let (text, code) = words(&psidpd(here, arguments));
        assert!(code == Some(2) && text.contains("1000.0 times"), "{arguments:?}: {text}");
    }
}

/// 64 species, each with a product of 64 factors.
#[test]
fn many_species_are_looked_at_in_a_moment() {
    let folder = tempfile::tempdir().unwrap();
    let names: Vec<String> = (0..64).map(|k| format!("S{k}")).collect();
    let list = |before: &str, after: &str, by: &str| {
        names.iter().map(|n| format!("{before}{n}{after}")).collect::<Vec<_>>().join(by)
    };
    for psi in [list("(1 + n_", ")", "*"), "0.5*n^2".to_owned()] {
        let text = format!(
            "title = \"many\"\nspecies = [{}]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n[excess_free_energy]\n{}\n",
            list("\"", "\"", ", "),
            list("", &format!(" = \"{psi}\""), "\n")
        );
        write(folder.path(), "m.toml", &text);
        let begun = Instant::now();
        let output = psidpd(folder.path(), &["check", "m.toml"]);
        let took = begun.elapsed();
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        assert!(took < Duration::from_secs(60), "{took:?}");
    }
}

/// What is in a file is shown, and does nothing else to a terminal.
#[test]
fn messages_are_plain_and_short() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let title = SOFT.replace("\"t\"", "\"a\\u001b[31mb\"");
    let raw = SOFT.replace("range = 1\n[[", "range = \u{1b}[31m\n[[");
    let key = SOFT.replace("range = 1\n[[", "range = 1\n\"\\u001b[31mx\" = 2\n[[");
    let long = SOFT.replace("\"t\"", &format!("\"t\"\n\"{}\" = 1", "x".repeat(2_000_000)));
    for (text, message) in [
        (&title, "control character"),
        (&raw, "not valid TOML"),
        (&key, "unknown key"),
        (&long, "unknown key"),
    ] {
        write(here, "m.toml", text);
        for verb in ["check", "theory"] {
            let output = psidpd(here, &[verb, "m.toml"]);
            assert_eq!(output.status.code(), Some(2), "{}", said(&output));
            let bare = said(&output);
            assert!(bare.len() < 10_000, "{} bytes", bare.len());
            let (text, _) = words(&output);
            assert!(text.contains(message), "{text}");
            assert!(!bare.contains("\u{1b}[31m"), "{bare:?}");
        }
    }
}

/// A model may come from anywhere: tables are read from its folder, unless the user says otherwise, and nothing in them is
/// shown.
#[test]
fn tables_stay_in_the_folder_of_the_model() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path().join("inner");
    std::fs::create_dir(&here).unwrap();
    write(folder.path(), "outside.csv", "n, psi\n0, 0\n1, secret\n");
    symlink("../outside.csv", here.join("link.csv")).unwrap();
    write(&here, "inside.csv", "n, psi\n0, 0\n1, secret\n");
    let outside = folder.path().join("outside.csv");
    for (table, anywhere, message) in [
        ("../outside.csv", false, "outside the folder"),
        (outside.to_str().unwrap(), false, "outside the folder"),
        ("link.csv", false, "outside the folder"),
        ("../outside.csv", true, "field 2 is not a finite number"),
        ("inside.csv", false, "field 2 is not a finite number"),
    ] {
        let text = format!(
            "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n[excess_free_energy]\n\
             F = {{ table = \"{table}\" }}\n"
        );
        write(&here, "m.toml", &text);
        let mut check = Command::new(program());
        check.args(["check", "m.toml"]).current_dir(&here).env_remove("PSIDPD_TABLES_ANYWHERE");
        if anywhere {
            check.env("PSIDPD_TABLES_ANYWHERE", "1");
        }
        let (text, code) = words(&check.output().unwrap());
        assert!(code == Some(2) && text.contains(message) && !text.contains("secret"), "{table}: {text}");
    }
}

/// A stand-in for Python: pip notes its beginning and its end, with its process, and takes a second; what it has started
/// takes another.
const SLOW_PIP: &str = r#"#!/bin/sh
[ "$1" = -c ] && exit 0
if [ "$2" = venv ]; then mkdir -p "$3/bin"; cp "$0" "$3/bin/python"; exit 0; fi
echo "begin $$" >> "$PSIDPD_LAMMPS_DIR/log"
exec 3<&0
sh -c 'sleep 2; echo "child $0" >> "$PSIDPD_LAMMPS_DIR/log"' $$ <&3 &
sleep 1
echo "end $$" >> "$PSIDPD_LAMMPS_DIR/log"
wait
exit 1
"#;

#[test]
fn pip_ends_with_an_installation_that_is_killed_before_the_next_begins() {
    let folder = tempfile::tempdir().unwrap();
    let python = folder.path().join("python");
    std::fs::write(&python, SLOW_PIP).unwrap();
    std::fs::set_permissions(&python, std::fs::Permissions::from_mode(0o755)).unwrap();
    let install = || {
        let mut command = Command::new(program());
        command.args(["lammps", "install"]).env("PSIDPD_PYTHON", &python);
        command.env("PSIDPD_LAMMPS_DIR", folder.path()).stdout(Stdio::null()).stderr(Stdio::null());
        command.spawn().unwrap()
    };
    let log = || std::fs::read_to_string(folder.path().join("log")).unwrap_or_default();
    let mut first = install();
    while !log().contains("begin") {
        std::thread::sleep(Duration::from_millis(5));
    }
    first.kill().unwrap();
    first.wait().unwrap();
    install().wait().unwrap();
    // The first pip is gone at once; what it had started ends before the second pip begins.
    let log = log();
    let words: Vec<&str> = log.lines().filter_map(|line| line.split(' ').next()).collect();
    assert_eq!(words, ["begin", "child", "begin", "end", "child"], "{log}");
}
