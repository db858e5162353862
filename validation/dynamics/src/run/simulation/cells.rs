//! Kinetic temperatures of the motion within cells of space, for which no pairs are searched.

use super::Simulation;
use crate::particles::State;

/// Degrees of freedom that suffice: their temperature scatters by 0.8 %, that of their pairs by 2 %.
const ENOUGH: usize = 30_000;

/// Cells whose motion is known at a time.
const SLOTS: usize = 1024;

/// Largest number of cells along a direction, so that cells of any box have numbers.
const MOST: f64 = 1_048_576.0;

/// Pairs that a particle makes with those before it in its cell, at most.
const PARTNERS: usize = 4;

/// The particles of a cell, up to now: their mass and velocity, and those that came last.
#[derive(Clone, Copy, Default)]
struct Cell {
    number: u64,
    mass: f64,
    v: [f64; 3],
    count: usize,
    last: [u32; PARTNERS],
}

/// Kinetic temperatures of the motion within cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::run) struct InCells {
    /// kT of the velocities relative to those of cells, `Σ m (v − v_cell)²/(d Σ (n − 1))`.
    pub all: f64,
    /// kT of the relative velocities along pairs in a cell, `Σ w μ u²/Σ w` with `w = (1 − r²/r_c²)²`; not a number without a pair.
    pub pairs: f64,
}

impl Simulation {
    /// kT of the mobile particles in cells as wide as forces reach. The flow of a cell does not count; shear at a rate γ̇ adds
    /// `m γ̇² r_c²/(12 d)` to that of all, and less to that of pairs. `None` without two particles in a cell.
    ///
    /// Particles count from `first` on, in the order in memory, until [`ENOUGH`] degrees of freedom are found or all have
    /// counted. In a run this order follows cells, so that few particles suffice among however many; in any other order the
    /// result is right too, and takes more of them.
    pub(in crate::run) fn temperatures_in_cells(&self, first: usize) -> Option<InCells> {
        let State { domain, mass, x, v, species, .. } = self.state();
        let (dimensions, range) = (self.dimensions(), self.engine().plan().cutoff());
        let along = |k: usize| (domain.height(k) / range).floor().clamp(1.0, MOST);
        let count: [f64; 3] = std::array::from_fn(|k| if k < dimensions { along(k) } else { 1.0 });
        let (mut squares, mut freedom) = (0.0, 0);
        let (mut of_pairs, mut weights) = (0.0, 0.0);
        // Another cell in the place of one ends it: its next particles are those of a new one.
        let mut cells = [Cell::default(); SLOTS];
        for k in (first..x.len()).chain(0..first.min(x.len())) {
            if self.frozen().get(k).is_some_and(|frozen| *frozen) {
                continue;
            }
            let s = domain.fraction(x[k]);
            let at: [u64; 3] = std::array::from_fn(|c| (s[c] * count[c]).min(count[c] - 1.0) as u64);
            let number = (at[0] * count[1] as u64 + at[1]) * count[2] as u64 + at[2];
            let cell = &mut cells[number as usize % SLOTS];
            if cell.number != number {
                *cell = Cell { number, ..Cell::default() };
            }
            let m = mass[species[k] as usize];
            let joined = m / (cell.mass + m);
            let apart: [f64; 3] = std::array::from_fn(|c| v[k][c] - cell.v[c]);
            squares += cell.mass * joined * apart[..dimensions].iter().map(|u| u * u).sum::<f64>();
            freedom += if cell.mass > 0.0 { dimensions } else { 0 };
            (0..3).for_each(|c| cell.v[c] += joined * apart[c]);
            cell.mass += m;
            for j in &cell.last[..cell.count.min(PARTNERS)] {
                let j = *j as usize;
                let d: [f64; 3] = std::array::from_fn(|c| x[k][c] - x[j][c]);
                let square: f64 = d.iter().map(|d| d * d).sum();
                if square > 0.0 && square < range * range {
                    let along: f64 = (0..3).map(|c| d[c] * (v[k][c] - v[j][c])).sum();
                    let other = mass[species[j] as usize];
                    let weight = (1.0 - square / (range * range)).powi(2);
                    of_pairs += weight * m * other * along * along / ((m + other) * square);
                    weights += weight;
                }
            }
            cell.last[cell.count % PARTNERS] = k as u32;
            cell.count += 1;
            if freedom >= ENOUGH {
                break;
            }
        }
        (freedom > 0).then(|| InCells { all: squares / freedom as f64, pairs: of_pairs / weights })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::Tags;
    use crate::tests::support::{SET6, scene};
    use nalgebra::{Matrix3, Vector3};
    use psidpd_core::engine::PeriodicBox;
    use std::collections::HashMap;

    const MIXTURE: &str = include_str!("../../../../models/huggins.toml");
    const PLANE: &str = include_str!("../../../../models/van-der-waals-2d.toml");

    /// Particles at random, with velocities of kT = 1.
    fn crowd(model: &str, lengths: &str, density: f64) -> Simulation {
        let text = format!(
            "model = \"m.toml\"\nkT = 1.0\nseed = 5\nbox = {lengths}\nsteps = 1\ndt = 0.01\n[initial]\n\
             kind = \"random\"\ndensity = {density}\n"
        );
        let scene = scene(model, &text).unwrap();
        Simulation::new(&scene.model, 1.0, scene.initial_state(), 5).unwrap()
    }

    /// The same with another state.
    fn with(simulation: &Simulation, change: impl FnOnce(&mut State)) -> Simulation {
        let mut state = simulation.state().clone();
        change(&mut state);
        Simulation::new(simulation.model(), 1.0, state, 5).unwrap()
    }

    /// The definitions: of each cell the kinetic energy less that of its whole, and the number of its particles less one; all pairs in
    /// a cell, and the largest number of particles there.
    fn plain(simulation: &Simulation) -> (InCells, usize) {
        let State { domain, mass, x, v, species, .. } = simulation.state();
        let dimensions = simulation.dimensions();
        let range = simulation.engine().plan().cutoff();
        let mut cells: HashMap<Vec<usize>, Vec<usize>> = HashMap::new();
        for k in (0..x.len()).filter(|k| simulation.frozen().get(*k) != Some(&true)) {
            let s = domain.fraction(x[k]);
            let count = |c: usize| (domain.height(c) / range).floor();
            let at = (0..dimensions).map(|c| (s[c] * count(c)) as usize).collect();
            cells.entry(at).or_default().push(k);
        }
        let (mut squares, mut freedom, mut of_pairs, mut weights) = (0.0, 0, 0.0, 0.0);
        for cell in cells.values() {
            let sum = |f: &dyn Fn(f64, [f64; 3]) -> f64| -> f64 {
                cell.iter().map(|k| f(mass[species[*k] as usize], v[*k])).sum()
            };
            for c in 0..dimensions {
                squares += sum(&|m, v| m * v[c] * v[c]) - sum(&|m, v| m * v[c]).powi(2) / sum(&|m, _| m);
            }
            freedom += dimensions * (cell.len() - 1);
            for (i, j) in cell.iter().flat_map(|i| cell.iter().map(move |j| (*i, *j))).filter(|(i, j)| i < j)
            {
                let d = Vector3::from(x[i]) - Vector3::from(x[j]);
                if d.norm() < range {
                    let along = d.normalize().dot(&(Vector3::from(v[i]) - Vector3::from(v[j])));
                    let [m, other] = [i, j].map(|k| mass[species[k] as usize]);
                    let weight = (1.0 - (d.norm() / range).powi(2)).powi(2);
                    of_pairs += weight / (1.0 / m + 1.0 / other) * along * along;
                    weights += weight;
                }
            }
        }
        let most = cells.values().map(Vec::len).max().unwrap();
        (InCells { all: squares / freedom as f64, pairs: of_pairs / weights }, most)
    }

    /// In boxes that are periodic, tilted and open, in the plane, of a mixture of two masses, and with particles that never move;
    /// wherever it begins.
    #[test]
    fn motion_in_cells_is_by_definition() {
        let set6 = crowd(SET6, "[9.0, 8.0, 10.0]", 3.0);
        let tilted = with(&set6, |state| {
            let edges = Matrix3::new(9.0, 2.0, -1.0, 0.0, 8.0, 3.0, 0.0, 0.0, 10.0);
            let domain = PeriodicBox::new([0.5, 1.0, -2.0], edges, [true, true, false]).unwrap();
            state.x.iter_mut().for_each(|x| *x = domain.point(state.domain.fraction(*x)));
            state.domain = domain;
        });
        let mut held = with(&set6, |_| {});
        held.set_frozen(&Tags::Ranges((1..900).step_by(3).map(|tag| tag..=tag).collect()));
        let mixed = with(&crowd(MIXTURE, "[8.0, 9.0, 8.0]", 4.0), |state| state.mass = vec![0.5, 3.0]);
        let few = with(&crowd(MIXTURE, "[9.0, 8.0, 9.0]", 0.4), |state| state.mass = vec![0.5, 3.0]);
        let mut seen = 0;
        for of in [set6, tilted, held, crowd(PLANE, "[16.0, 18.0]", 4.0), mixed, few] {
            let (expected, most) = plain(&of);
            for first in [0, 7, of.len()] {
                let found = of.temperatures_in_cells(first).unwrap();
                assert!((found.all / expected.all - 1.0).abs() < 1e-10, "{found:?} {expected:?}");
                // With more particles in a cell not all pairs count.
                if most <= PARTNERS + 1 {
                    assert!((found.pairs / expected.pairs - 1.0).abs() < 1e-10, "{found:?} {expected:?}");
                    seen += 1;
                }
            }
        }
        assert!(seen > 0);
    }

    /// Among many particles in whatever order, and more cells than are known at a time, the temperature is that of the particles to its
    /// scatter, and no flow of the whole changes it. Shear at a rate of 2 adds a ninth of the square of the edge, which is 1.
    #[test]
    fn few_of_many_particles_have_their_temperature_and_no_flow() {
        let rest = crowd(SET6, "30.0", 3.0);
        let moved = |f: &dyn Fn([f64; 3], [f64; 3]) -> [f64; 3]| {
            with(&rest, |state| state.v.iter_mut().zip(&state.x).for_each(|(v, x)| *v = f(*v, *x)))
        };
        let flies = moved(&|v, _| [v[0] + 1e3, v[1], v[2] - 2e3]);
        let sheared = moved(&|v, x| [v[0] + 2.0 * x[1], v[1], v[2]]);
        let mut seen = Vec::new();
        for first in [0, 31_000, 62_000] {
            let found = [&rest, &flies, &sheared].map(|of| of.temperatures_in_cells(first).unwrap());
            let ([here, flying, shear], pairs) =
                (found.map(|found| found.all), found.map(|found| found.pairs));
            assert!((pairs[0] - 1.0).abs() < 0.08 && (pairs[1] / pairs[0] - 1.0).abs() < 1e-9, "{pairs:?}");
            assert!((pairs[2] - pairs[0] - 1.0 / 20.0).abs() < 0.03, "{pairs:?}");
            assert!((here - 1.0).abs() < 0.035, "{here}");
            assert!((flying / here - 1.0).abs() < 1e-9, "{flying} {here}");
            assert!((shear - here - 1.0 / 9.0).abs() < 0.02, "{shear} {here}");
            seen.push(here);
        }
        assert!(seen[0] != seen[1] && seen[1] != seen[2], "{seen:?}");
        let sparse = crowd(SET6, "30.0", 1.0 / 27_000.0);
        assert_eq!(sparse.temperatures_in_cells(0), None);
    }
}
