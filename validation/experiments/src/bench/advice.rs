//! Which of MPI ranks, threads or both to take on a number of cores: reckoned from the two-thread and the two-rank runs.

use super::outcome::Benchmark;
use psidpd_report::Table;

/// What a run of Warren's liquid in LAMMPS costs on more than one core, in times of one particle on one core.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Costs {
    /// Share of a step that threads do not divide: what LAMMPS does itself.
    pub serial: f64,
    /// Cost of one ghost of LAMMPS, with the messages for it, over that of a particle.
    pub ghost: f64,
}

/// The liquid and the distance to which a rank has ghosts, in cut-offs.
const DENSITY: f64 = 6.05;
const REACH: f64 = 1.3;
/// Time that the messages of a step take besides the work on ghosts, in times of one particle: some ten microseconds.
const MESSAGES: f64 = 150.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    pub ranks: usize,
    pub threads: usize,
}

impl std::fmt::Display for Layout {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Layout { ranks: 1, threads } => write!(f, "1 rank, threads {threads}"),
            Layout { ranks, threads: 1 } => write!(f, "{ranks} ranks"),
            Layout { ranks, threads } => write!(f, "{ranks} ranks, threads {threads}"),
        }
    }
}

impl Costs {
    /// Costs from the speed-ups on two threads and on two ranks, with the ghosts of each of these and its particles.
    pub fn of(two_threads: f64, two_ranks: f64, ghosts_per_particle: f64) -> Costs {
        let serial = (2.0 / two_threads - 1.0).clamp(0.0, 1.0);
        let ghost = ((2.0 / two_ranks - 1.0) / ghosts_per_particle).max(0.0);
        Costs { serial, ghost }
    }

    /// The costs that a benchmark found in its largest box with all three runs.
    pub fn found(outcome: &Benchmark) -> Option<Costs> {
        const ALONE: &str = "plugin dpd/psi precision mixed";
        let rate = |size: usize, code: &str| {
            let run = outcome.runs.iter().find(|r| r.fluid == "mdpd" && r.size == size && r.code == code)?;
            Some(run.mega_particle_steps_per_second.median)
        };
        outcome.options.sizes.iter().rev().find_map(|size| {
            let two_threads = rate(*size, &format!("{ALONE} threads 2"))? / rate(*size, ALONE)?;
            let of_ranks = |s: &&super::outcome::Scaling| {
                s.code == ALONE && s.kind == "strong" && s.size == *size && s.ranks == 2
            };
            let scaling = outcome.scaling.iter().find(of_ranks)?;
            let ghosts_per_particle = scaling.ghosts / (*size as f64 / 2.0);
            Some(Costs::of(two_threads, scaling.speed_up.median, ghosts_per_particle))
        })
    }

    /// Speed-up over one core in a cubic box of so many particles.
    pub fn speed_up(&self, particles: usize, layout: Layout) -> f64 {
        let edge = (particles as f64 / DENSITY).cbrt();
        let (ghosts, parts) = fewest_ghosts(edge, layout.ranks);
        let balance = balance(edge / parts[1] as f64, edge / parts[2] as f64, layout.threads);
        let step = self.serial + (1.0 - self.serial) / (layout.threads as f64 * balance);
        let of_rank = particles as f64 / layout.ranks as f64;
        let messages = if layout.ranks > 1 { MESSAGES } else { 0.0 };
        particles as f64 / (of_rank * step * (1.0 + self.ghost * ghosts) + messages)
    }

    /// The fastest layout on a number of cores, of which a rank may have so many.
    pub fn fastest(&self, particles: usize, cores: usize, most_threads: usize) -> Layout {
        let layouts =
            (1..=cores).filter(|ranks| cores.is_multiple_of(*ranks) && cores / ranks <= most_threads);
        let layouts = layouts.map(|ranks| Layout { ranks, threads: cores / ranks });
        let rate = |layout: &Layout| self.speed_up(particles, *layout);
        layouts.max_by(|a, b| rate(a).total_cmp(&rate(b))).unwrap_or(Layout { ranks: 1, threads: cores })
    }
}

/// Ghosts for each particle of a rank, with the division of a cubic box that has the fewest, and that division.
fn fewest_ghosts(edge: f64, ranks: usize) -> (f64, [usize; 3]) {
    let mut best = (f64::INFINITY, [1, 1, ranks]);
    for x in (1..=ranks).filter(|x| ranks.is_multiple_of(*x)) {
        for y in (1..=ranks / x).filter(|y| (ranks / x).is_multiple_of(*y)) {
            let parts = [x, y, ranks / x / y];
            let grown = parts.map(|n| if n > 1 { 1.0 + 2.0 * REACH * n as f64 / edge } else { 1.0 });
            let ghosts = grown.iter().product::<f64>() - 1.0;
            if ghosts < best.0 {
                best = (ghosts, parts);
            }
        }
    }
    best
}

/// The mean work of a thread over the most, if planes of columns, one cut-off wide, are divided as the engine does.
fn balance(columns: f64, planes: f64, threads: usize) -> f64 {
    let [columns, planes] = [columns, planes].map(|n| (n as usize).max(1));
    let units = planes * ((columns / 5) & !1).max(1);
    units as f64 / (threads * units.div_ceil(threads)) as f64
}

/// The layouts to take for 10⁴ to 10⁷ particles, with what threads alone and ranks alone give.
pub fn table(costs: &Costs, cores: usize) -> Table {
    let mut table = Table::new(["particles", "take", "times one core", "threads alone", "ranks alone"]);
    for particles in [10_000, 100_000, 1_000_000, 10_000_000] {
        let fastest = costs.fastest(particles, cores, cores);
        let rate = |ranks, threads| format!("{:.1}", costs.speed_up(particles, Layout { ranks, threads }));
        table.push([
            particles.to_string(),
            fastest.to_string(),
            rate(fastest.ranks, fastest.threads),
            rate(1, cores),
            rate(cores, 1),
        ]);
    }
    table
}

/// The advice for the cores of the machine; `None` without runs on two threads and on two ranks.
pub fn of(outcome: &Benchmark) -> Option<(String, Table)> {
    let (costs, cores) = (Costs::found(outcome)?, outcome.machine.cores);
    let text = format!(
        "What to take in LAMMPS on {cores} cores, reckoned: threads leave {:.0} % of a step to one core, a ghost costs {:.1} \
         times a particle. Natively all cores are threads:",
        100.0 * costs.serial,
        costs.ghost
    );
    Some((text, table(&costs, cores)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_give_the_speed_ups_they_come_from() {
        let costs = Costs::of(1.8, 1.3, 0.3);
        let speed_up = |layout| costs.speed_up(10_000_000, layout);
        assert!((speed_up(Layout { ranks: 1, threads: 2 }) - 1.8).abs() < 1e-12);
        assert!((speed_up(Layout { ranks: 1, threads: 1 }) - 1.0).abs() < 1e-12);
        // In a large box ghosts are few.
        let two = speed_up(Layout { ranks: 2, threads: 1 });
        assert!(two > 1.3 && two < 2.0, "{two}");
        let perfect = Costs::of(2.0, 2.0, 0.3);
        assert_eq!(perfect, Costs { serial: 0.0, ghost: 0.0 });
    }

    #[test]
    fn small_boxes_want_threads_and_large_ones_ranks() {
        let costs = Costs { serial: 0.1, ghost: 1.0 };
        assert_eq!(costs.fastest(10_000, 2, 2), Layout { ranks: 1, threads: 2 });
        // Sixteen threads are held by what one of them does alone, and a large box has few ghosts.
        assert!(costs.fastest(10_000_000, 16, 16).ranks > 4);
        assert!(costs.fastest(10_000, 64, 64).ranks < 64);
        // Nothing serial: threads have no ghosts.
        let costs = Costs { serial: 0.0, ghost: 1.0 };
        assert_eq!(costs.fastest(1_000_000, 16, 16), Layout { ranks: 1, threads: 16 });
    }

    /// The table of `docs/scaling.md`, from the costs that the page states.
    #[test]
    fn the_page_has_this_advice() {
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/scaling.md");
        let page = std::fs::read_to_string(page).expect("the page");
        let costs = Costs { serial: 0.08, ghost: 1.3 };
        let mut rows = String::new();
        for (name, particles) in [("10⁴", 10_000), ("10⁵", 100_000), ("10⁶", 1_000_000), ("10⁷", 10_000_000)]
        {
            let best = |(cores, of_node)| {
                let layout = costs.fastest(particles, cores, of_node);
                format!("{} × {} ({:.1})", layout.ranks, layout.threads, costs.speed_up(particles, layout))
            };
            let cells = [(2, 2), (4, 4), (16, 16), (64, 64), (256, 64)].map(best);
            rows += &format!("{name} | {}\n", cells.join(" | "));
        }
        assert!(page.contains(&rows), "the page needs these rows:\n{rows}");
    }

    #[test]
    fn a_box_of_edge_20_feeds_sixteen_threads() {
        assert!(balance(20.0, 20.0, 16) > 0.9 && balance(20.0, 20.0, 64) < 0.9);
        assert!(balance(40.0, 40.0, 64) > 0.9);
    }
}
