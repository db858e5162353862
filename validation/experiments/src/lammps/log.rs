//! What LAMMPS prints after a run.

use crate::ExperimentError;
use std::collections::BTreeMap;

/// LAMMPS's own account of a timed loop.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Loop {
    pub seconds: f64,
    pub steps: u64,
    pub particles: usize,
    /// Seconds of each part, the mean over ranks: Pair, Neigh, Comm, Output, Modify, Other, in lower case.
    pub parts: BTreeMap<String, f64>,
    /// Ghosts of a rank, the mean.
    pub ghosts: f64,
    /// How often particles were exchanged and lists built.
    pub builds: u64,
}

/// Reads the account of the last loop of a run, which an error names as `what`.
pub fn timed(what: &str, text: &str) -> Result<Loop, ExperimentError> {
    parse(text).map_err(|problem| ExperimentError::Printed { what: what.to_owned(), problem })
}

/// Seconds of all loops of a run, which an error names as `what`.
pub fn seconds_of_loops(what: &str, text: &str) -> Result<f64, ExperimentError> {
    let seconds = |line: &str| line.strip_prefix("Loop time of ")?.split(' ').next()?.parse::<f64>().ok();
    let loops: Vec<f64> = text.lines().filter_map(seconds).collect();
    match loops.is_empty() {
        true => Err(ExperimentError::Printed { what: what.to_owned(), problem: "no loop time" }),
        false => Ok(loops.iter().sum()),
    }
}

fn parse(text: &str) -> Result<Loop, &'static str> {
    let lines: Vec<&str> = text.lines().collect();
    let begin = lines.iter().rposition(|l| l.starts_with("Loop time of")).ok_or("no loop time")?;
    let words: Vec<&str> = lines[begin].split_whitespace().collect();
    // Loop time of 0.5 on 1 procs for 100 steps with 6050 atoms
    let after = |word: &str| {
        let k = words.iter().position(|w| *w == word)?;
        words.get(k + 1)
    };
    let seconds = after("of").and_then(|w| w.parse().ok()).ok_or("no loop time")?;
    let steps = after("for").and_then(|w| w.parse().ok()).ok_or("no number of steps")?;
    let particles = after("with").and_then(|w| w.parse().ok()).ok_or("no number of atoms")?;
    let mut account = Loop { seconds, steps, particles, ..Loop::default() };
    for line in &lines[begin..] {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        if let [name, _, mean, ..] = cells[..]
            && PARTS.contains(&name)
        {
            account.parts.insert(name.to_lowercase(), mean.parse().map_err(|_| "no time of a part")?);
        } else if let Some(rest) = line.strip_prefix("Nghost:") {
            let mean = rest.split_whitespace().next().and_then(|w| w.parse().ok());
            account.ghosts = mean.ok_or("no number of ghosts")?;
        } else if let Some(rest) = line.strip_prefix("Neighbor list builds =") {
            account.builds = rest.trim().parse().map_err(|_| "no number of list builds")?;
        }
    }
    if account.parts.len() < PARTS.len() { Err("no timing of the parts") } else { Ok(account) }
}

/// The rows of numbers of the last table that LAMMPS printed, of so many columns.
pub fn rows(text: &str, columns: usize) -> Vec<Vec<f64>> {
    let lines: Vec<&str> = text.lines().collect();
    let header = lines.iter().rposition(|line| line.split_whitespace().next() == Some("Step"));
    let table = header.map_or(&[][..], |k| &lines[k + 1..]);
    let read = |line: &&str| line.split_whitespace().map(|w| w.parse().ok()).collect::<Option<Vec<f64>>>();
    table.iter().map_while(read).filter(|row| row.len() == columns).collect()
}

const PARTS: [&str; 6] = ["Pair", "Neigh", "Comm", "Output", "Modify", "Other"];

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
Loop time of 9.9 on 1 procs for 10 steps with 6050 atoms
Loop time of 0.85 on 2 procs for 100 steps with 6050 atoms

Performance: 101647.059 tau/day, 117.647 timesteps/s, 711.765 katom-step/s
99.5% CPU use with 2 MPI tasks x 1 OpenMP threads

MPI task timing breakdown:
Section |  min time  |  avg time  |  max time  |%varavg| %total
---------------------------------------------------------------
Pair    | 0.50       | 0.51       | 0.52       |   0.1 | 60.00
Neigh   | 0.25       | 0.26       | 0.27       |   0.1 | 30.59
Comm    | 0.03       | 0.04       | 0.05       |   0.1 |  4.71
Output  | 1e-05      | 1e-05      | 1e-05      |   0.0 |  0.00
Modify  | 0.02       | 0.02       | 0.02       |   0.0 |  2.35
Other   |            | 0.01999    |            |       |  2.35

Nlocal:           3025 ave        3030 max        3020 min
Histogram: 1 0 0 0 0 0 0 0 0 1
Nghost:         4567.5 ave        4570 max        4565 min
Histogram: 1 0 0 0 0 0 0 0 0 1
Neighs:         111111 ave      111112 max      111110 min

Total # of neighbors = 222222
Neighbor list builds = 23
Dangerous builds = 0
Total wall time: 0:00:01
";

    #[test]
    fn loops_add_up() {
        assert_eq!(seconds_of_loops("it", TEXT).unwrap(), 9.9 + 0.85);
        assert!(seconds_of_loops("it", "Loop time").is_err());
    }

    #[test]
    fn the_last_loop_is_read() {
        let account = parse(TEXT).unwrap();
        assert_eq!((account.seconds, account.steps, account.particles), (0.85, 100, 6050));
        assert_eq!((account.ghosts, account.builds), (4567.5, 23));
        let sum: f64 = account.parts.values().sum();
        assert!((sum - 0.85).abs() < 1e-9, "{sum}");
        assert_eq!(account.parts["pair"], 0.51);
    }

    #[test]
    fn what_is_missing_is_named() {
        assert_eq!(parse("ERROR: no such style"), Err("no loop time"));
        assert_eq!(parse("Loop time of x on"), Err("no loop time"));
        let short = TEXT.split("MPI task").next().unwrap();
        assert_eq!(parse(short), Err("no timing of the parts"));
        assert_eq!(parse(&TEXT.replace("= 23", "= many")), Err("no number of list builds"));
    }

    #[test]
    fn the_last_table_is_read() {
        let text = "Step Temp Press\n 0 9 9\nLoop time\n   Step  Temp  Press \n 10 1.5 2\n 20 1 3.5\n 30 2 4\nLoop time of\n";
        assert_eq!(rows(text, 3), [[10.0, 1.5, 2.0], [20.0, 1.0, 3.5], [30.0, 2.0, 4.0]]);
        assert!(rows("nothing", 3).is_empty());
    }
}
