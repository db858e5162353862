//! Shell completions and manual pages.

use super::*;
use clap_complete::Shell;
use psidpd_core::document::open_regular;
use std::fs::create_dir_all;
use std::io::Read;

/// Print a script that completes verbs and options in a shell.
#[derive(Debug, clap::Args)]
pub struct Completions {
    /// The shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// Write manual pages: psidpd.1, and one for each verb.
#[derive(Debug, clap::Args)]
pub struct Man {
    /// Folder for the pages; it is made if necessary.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn completions(a: &Completions) -> Result<Verdict, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(a.shell, &mut super::command(), "psidpd", &mut script);
    say::bytes(&script);
    Ok(Verdict::Good)
}

pub fn man(a: &Man, told: Told) -> Result<Verdict, Failure> {
    create_dir_all(&a.out).map_err(PathError::at("write", &a.out))?;
    let mut pages = Vec::new();
    let mut command = super::command().disable_help_subcommand(true);
    command.build();
    add_pages(command, &mut pages);
    let pages = pages.into_iter().map(|(name, page)| (a.out.join(name), page));
    let pages: Vec<(PathBuf, Vec<u8>)> = pages.collect();
    // No page is written unless all can be.
    pages
        .iter()
        .filter(|(path, page)| !has(path, page))
        .try_for_each(|(path, _)| may_replace(path, told.existing))?;
    for (path, page) in pages.iter().filter(|(path, page)| !has(path, page)) {
        write_bytes(path, told.existing, page)?;
    }
    say!("{}", a.out.join("psidpd.1").display());
    conclude(told, &json!({"folder": shown(&a.out)}), true)
}

/// Whether a file has this content already.
fn has(path: &Path, page: &[u8]) -> bool {
    let mut found = Vec::new();
    open_regular(path).and_then(|mut file| file.read_to_end(&mut found)).is_ok() && found == page
}

/// The pages of a command and of those below it, with the names of their files.
fn add_pages(command: clap::Command, pages: &mut Vec<(String, Vec<u8>)>) {
    for below in command.get_subcommands().filter(|below| !below.is_hide_set()) {
        add_pages(below.clone(), pages);
    }
    let man = clap_mangen::Man::new(command);
    let mut page = Vec::new();
    // Writing to memory cannot fail.
    let _ = man.render(&mut page);
    pages.push((man.get_filename(), page));
}
