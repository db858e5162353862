//! 10⁹ particles on paper: what limits a run on many ranks, from costs measured on one and two.

use super::BenchError;
use super::outcome::{Run, Scaling};
use minijinja::syntax::SyntaxConfig;
use minijinja::{Environment, context};
use serde::Serialize;

/// Bytes that LAMMPS sends for a ghost in a step: positions and velocities forward, slopes of ψ forward,
/// forces back.
pub fn bytes_per_ghost(slope_width: usize) -> f64 {
    (6 + slope_width + 3) as f64 * 8.0
}

/// Particles.
const PARTICLES: f64 = 1e9;
/// Messages of a rank in a step: each of the three rounds (positions, slopes, forces) has one in each of six
/// directions.
const MESSAGES: f64 = 18.0;
/// Seconds that a short message takes: a network of the fast kind.
const LATENCY: f64 = 1.5e-6;
/// Bytes per second and rank: 25 GB/s shared by 64 ranks of a node.
const BANDWIDTH: f64 = 25e9 / 64.0;
/// Bytes of memory of a node with 64 ranks.
const NODE_MEMORY: f64 = 256e9;
const RANKS_PER_NODE: f64 = 64.0;

/// The estimate, with what it starts from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Projection {
    /// Particles.
    pub particles: f64,
    /// Their number density.
    pub density: f64,
    /// How far a rank sees beyond its own box: cut-off and skin.
    pub halo: f64,
    /// The runs on one rank and two that costs come from, by size.
    pub measured_size: usize,
    /// Nanoseconds of a step for each particle or ghost of a rank that has ghosts, communication left out; measured.
    pub work_nanoseconds: f64,
    /// Nanoseconds of communication for each ghost in a step without a network; measured.
    pub packing_nanoseconds: f64,
    /// What two ranks on one machine wait in a step beyond that, in microseconds; measured.
    pub waiting_microseconds: f64,
    /// Bytes sent for a ghost in a step.
    pub bytes_per_ghost: f64,
    /// Messages of a rank in a step.
    pub messages_per_step: f64,
    /// Assumed: seconds of a short message.
    pub latency_seconds: f64,
    /// Assumed: bytes per second for each rank.
    pub bandwidth_bytes_per_second: f64,
    /// By number of ranks.
    pub rows: Vec<Row>,
    /// Ranks at which half of the time is spent on anything but a rank's own particles.
    pub half_efficiency_ranks: f64,
}

/// A step on some number of ranks; times in microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Row {
    /// Ranks.
    pub ranks: f64,
    /// Particles of each.
    pub particles_per_rank: f64,
    /// Ghosts of each.
    pub ghosts_per_rank: f64,
    /// Forces and integration of own particles.
    pub own_microseconds: f64,
    /// The same work on ghosts.
    pub ghost_microseconds: f64,
    /// Packing and unpacking.
    pub packing_microseconds: f64,
    /// Bytes through the network.
    pub transfer_microseconds: f64,
    /// Messages.
    pub latency_microseconds: f64,
    /// The sum over all ranks that decides whether particles are exchanged.
    pub collective_microseconds: f64,
    /// All of these.
    pub step_microseconds: f64,
    /// Part of the step that goes into own particles.
    pub efficiency: f64,
}

impl Projection {
    /// From the plugin's runs on one rank and on two, and how these scale, at the largest size that has both.
    pub fn of(
        [one, two]: [&Run; 2],
        strong: &Scaling,
        density: f64,
        slope_width: usize,
        cutoff: f64,
    ) -> Option<Projection> {
        let n = one.particles as f64;
        let packing = one.parts.get("comm")? * n / one.ghosts?;
        let waiting = (strong.communication_microseconds - 1e-3 * packing * strong.ghosts).max(0.0);
        let halo = cutoff + one.skin?;
        // A cube cut into two has two faces with ghosts that are no images of a rank's own atoms.
        let ghosts = 2.0 * density * (n / density).cbrt().powi(2) * halo;
        let alone = (two.nanoseconds_per_particle_step - two.parts.get("comm")?) * n;
        let work = alone / (0.5 * n + ghosts);
        let mut projection = Projection {
            particles: PARTICLES,
            density,
            halo,
            measured_size: one.size,
            work_nanoseconds: work,
            packing_nanoseconds: packing,
            waiting_microseconds: waiting,
            bytes_per_ghost: bytes_per_ghost(slope_width),
            messages_per_step: MESSAGES,
            latency_seconds: LATENCY,
            bandwidth_bytes_per_second: BANDWIDTH,
            rows: Vec::new(),
            half_efficiency_ranks: f64::NAN,
        };
        projection.rows = (2..=7).map(|k| projection.row(10f64.powi(k))).collect();
        // Efficiency falls with the number of ranks: bisection in its logarithm.
        let (mut low, mut high) = (0f64, 9f64);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if projection.row(10f64.powf(middle)).efficiency > 0.5 { low = middle } else { high = middle }
        }
        projection.half_efficiency_ranks = 10f64.powf(low);
        Some(projection)
    }

    /// A step on `ranks`, each with a cube.
    pub fn row(&self, ranks: f64) -> Row {
        let n = self.particles / ranks;
        let edge = (n / self.density).cbrt();
        let ghosts = self.density * (edge + 2.0 * self.halo).powi(3) - n;
        let own = 1e-3 * self.work_nanoseconds * n;
        let ghost = 1e-3 * self.work_nanoseconds * ghosts;
        let packing = 1e-3 * self.packing_nanoseconds * ghosts;
        let transfer = 1e6 * self.bytes_per_ghost * ghosts / self.bandwidth_bytes_per_second;
        // A box thinner than the halo needs more layers of neighbours, each with a message of its own.
        let layers = (self.halo / edge).ceil();
        let latency = 1e6 * self.latency_seconds * self.messages_per_step * layers;
        let collective = 1e6 * self.latency_seconds * 2.0 * ranks.log2().ceil();
        let step = own + ghost + packing + transfer + latency + collective;
        Row {
            ranks,
            particles_per_rank: n,
            ghosts_per_rank: ghosts,
            own_microseconds: own,
            ghost_microseconds: ghost,
            packing_microseconds: packing,
            transfer_microseconds: transfer,
            latency_microseconds: latency,
            collective_microseconds: collective,
            step_microseconds: step,
            efficiency: own / step,
        }
    }
}

const TEMPLATE: &str = include_str!("scaling.md.j2");

/// Three digits, without an exponent where that can be read.
fn digits(x: f64) -> String {
    match x.abs() {
        a if a < 1e6 && x.fract() == 0.0 => format!("{x:.0}"),
        a if a >= 1e6 => format!("{x:.1e}"),
        a if a >= 100.0 => format!("{x:.0}"),
        a if a >= 10.0 => format!("{x:.1}"),
        _ => format!("{x:.2}"),
    }
}

/// `docs/scaling.md`: the argument with the numbers of this run.
///
/// # Errors
/// The template does not fit.
pub fn page(
    projection: &Projection,
    scaling: &[Scaling],
    bytes_per_particle: Option<f64>,
    machine: &str,
) -> Result<String, BenchError> {
    let mut environment = Environment::new();
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).build()?);
    environment.add_template("scaling.md", TEMPLATE)?;
    let p = projection;
    let rows: Vec<_> = p
        .rows
        .iter()
        .map(|r| {
            let hours = r.step_microseconds / 3600.0;
            [
                format!("10^{:.0}", r.ranks.log10()),
                digits(r.particles_per_rank),
                digits(r.ghosts_per_rank),
                digits(r.own_microseconds),
                digits(r.ghost_microseconds),
                digits(r.packing_microseconds),
                digits(r.transfer_microseconds),
                digits(r.latency_microseconds),
                digits(r.collective_microseconds),
                digits(r.step_microseconds),
                format!("{:.0} %", 100.0 * r.efficiency),
                digits(hours),
            ]
            .join(" | ")
        })
        .collect();
    let measured: Vec<_> = scaling
        .iter()
        .map(|s| {
            [
                s.code.clone(),
                s.kind.to_owned(),
                s.size.to_string(),
                s.ranks.to_string(),
                format!("{:.2} ({:.2}–{:.2})", s.speed_up.median, s.speed_up.min, s.speed_up.max),
                digits(s.ghosts),
                s.bytes_per_step.map_or_else(|| "–".to_owned(), |b| digits(1e-3 * b)),
                digits(s.communication_microseconds),
            ]
            .join(" | ")
        })
        .collect();
    let half = p.row(p.half_efficiency_ranks);
    let per_particle = bytes_per_particle.unwrap_or(300.0);
    let page = environment.get_template("scaling.md")?.render(context! {
        machine,
        measured,
        rows,
        size => p.measured_size,
        density => p.density,
        halo => digits(p.halo),
        work => digits(p.work_nanoseconds),
        packing => digits(p.packing_nanoseconds),
        waiting => digits(p.waiting_microseconds),
        bytes => digits(p.bytes_per_ghost),
        messages => digits(p.messages_per_step),
        latency => digits(1e6 * p.latency_seconds),
        bandwidth => digits(1e-9 * p.bandwidth_bytes_per_second),
        half_ranks => digits(p.half_efficiency_ranks),
        half_particles => digits(half.particles_per_rank),
        half_edge => digits((half.particles_per_rank / p.density).cbrt()),
        half_ghosts => digits(half.ghosts_per_rank),
        half_step => digits(half.step_microseconds),
        half_network => format!(
            "{:.0}",
            100.0 * (half.transfer_microseconds + half.latency_microseconds + half.collective_microseconds)
                / half.step_microseconds
        ),
        half_ghost_share => format!(
            "{:.0}", 100.0 * (half.ghost_microseconds + half.packing_microseconds) / half.step_microseconds
        ),
        per_particle => digits(per_particle),
        terabytes => digits(1e-12 * per_particle * p.particles),
        nodes => digits((per_particle * p.particles / NODE_MEMORY).ceil()),
        node_memory => digits(1e-9 * NODE_MEMORY),
        per_node => digits(RANKS_PER_NODE),
    })?;
    // The last newline of a template is left out.
    Ok(page + "\n")
}

#[cfg(test)]
mod tests {
    use super::super::spread::Spread;
    use super::*;
    use std::collections::BTreeMap;

    fn measured() -> ([Run; 2], Scaling) {
        let spread = Spread { min: 1.0, median: 1.0, max: 1.0 };
        let run = Run {
            fluid: "mdpd",
            size: 48_400,
            code: "plugin dpd/psi".into(),
            particles: 48_400,
            pairs_per_particle: 13.0,
            ranks: 1,
            threads: 1,
            precision: None,
            instructions: None,
            skin: Some(0.3),
            steps: 100,
            seconds: vec![1.0],
            mega_particle_steps_per_second: spread,
            nanoseconds_per_particle_step: 200.0,
            nanoseconds_per_pair: 15.0,
            ratio_to_built_in: None,
            parts: BTreeMap::from([("comm".into(), 20.0)]),
            ghosts: Some(20_000.0),
            steps_between_builds: Some(4.0),
        };
        let scaling = Scaling {
            code: "plugin dpd/psi".into(),
            kind: "strong",
            size: 48_400,
            ranks: 2,
            speed_up: spread,
            efficiency: spread,
            ghosts: 14_000.0,
            bytes_per_step: Some(1e6),
            communication_microseconds: 1000.0,
        };
        let two = Run { ranks: 2, nanoseconds_per_particle_step: 130.0, ..run.clone() };
        ([run, two], scaling)
    }

    #[test]
    fn the_parts_of_a_step_add_up_and_efficiency_falls() {
        let (runs, scaling) = measured();
        let p = Projection::of(runs.each_ref(), &scaling, 6.05, 1, 1.0).unwrap();
        assert_eq!(p.bytes_per_ghost, 80.0);
        // Ranks of the measured sizes cost what was measured: there are two slabs of 20 by 20 by 1.3 with ghosts.
        let n = 48_400.0;
        let half = p.work_nanoseconds * (0.5 * n + 2.0 * 6.05 * 400.0 * 1.3);
        assert!((half / n - 110.0).abs() < 1e-9 && p.packing_nanoseconds == 48.4);
        assert!((p.waiting_microseconds - (1000.0 - 0.0484 * 14_000.0)).abs() < 1e-9);
        for pair in p.rows.windows(2) {
            assert!(pair[0].efficiency > pair[1].efficiency);
        }
        assert!((p.row(p.half_efficiency_ranks).efficiency - 0.5).abs() < 1e-6);
        // 10 particles in a box thinner than the halo: more than one layer.
        assert!(p.row(1e8).latency_microseconds > p.row(1e3).latency_microseconds);
    }

    #[test]
    fn the_page_has_its_numbers() {
        let (runs, scaling) = measured();
        let p = Projection::of(runs.each_ref(), &scaling, 6.05, 1, 1.0).unwrap();
        let page = page(&p, &[scaling], Some(250.0), "a machine").unwrap();
        assert!(
            page.contains("80 bytes") && page.contains("a machine") && page.contains("0.25 TB"),
            "{page}"
        );
        assert!(!page.contains("{{") && !page.contains("{%"));
    }
}
