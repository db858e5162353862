//! The kinetic temperature of relative velocities along pairs within cells of space, for which no pairs are searched.

use super::Simulation;
use crate::particles::State;
use psidpd_core::engine::PeriodicBox;

/// Cells whose particles count, among however many.
const CELLS: u64 = 1024;

/// Particles in a cell on average, at least, as far as this needs cells less than twice as wide.
const CROWD: f64 = 5.0;

/// Particles of which the mean number in a cell is taken.
const FEW: usize = 512;

/// Particles that a thread looks through at a time.
const PART: usize = 1 << 14;

/// Largest number of cells along a direction, so that cells of any box have numbers.
const MOST: f64 = 1_048_576.0;

/// Pairs that a particle makes with those before it in its cell, at most.
const PARTNERS: usize = 8;

/// The particles of a cell, up to now.
#[derive(Clone, Copy, Default)]
struct Cell {
    count: usize,
    /// All of them, or so many at random. Particles that are next to each other in memory were so some steps ago: pairs of these that are
    /// still in one cell are slower than others.
    some: [u32; PARTNERS],
}

/// A grid of cells in the box.
struct Grid<'a> {
    domain: &'a PeriodicBox,
    count: [f64; 3],
}

impl<'a> Grid<'a> {
    fn new(domain: &'a PeriodicBox, dimensions: usize, edge: f64) -> Grid<'a> {
        let along = |k: usize| (domain.height(k) / edge).floor().clamp(1.0, MOST);
        Grid { domain, count: std::array::from_fn(|k| if k < dimensions { along(k) } else { 1.0 }) }
    }

    fn number(&self, x: &[f64; 3]) -> u64 {
        let (s, count) = (self.domain.fraction(*x), self.count);
        let at: [u32; 3] = std::array::from_fn(|c| (s[c] * count[c]).min(count[c] - 1.0) as u32);
        (u64::from(at[0]) * count[1] as u64 + u64::from(at[1])) * count[2] as u64 + u64::from(at[2])
    }

    fn cells(&self) -> u64 {
        self.count.iter().map(|count| *count as u64).product()
    }
}

impl Simulation {
    /// Cells as wide as the longest range, and wider where `of` are few in a cell. These are next to each other in memory, so that empty
    /// space around a drop does not count; if they are far from each other, cells are as wide as for one in each.
    fn grid(&self, of: &[[f64; 3]]) -> Grid<'_> {
        let (domain, dimensions, range) =
            (&self.state().domain, self.dimensions(), self.engine().plan().cutoff());
        let grid = Grid::new(domain, dimensions, range);
        let mut numbers: Vec<u64> = of.iter().map(|x| grid.number(x)).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let wider = (CROWD * numbers.len() as f64 / of.len() as f64).powf(1.0 / dimensions as f64);
        if wider > 1.0 { Grid::new(domain, dimensions, range * wider) } else { grid }
    }

    /// kT of the relative velocities along pairs of mobile particles in a cell, `Σ w μ u²/Σ w` with `w = 1 − r²/r_c²` within the longest range
    /// r_c: flow on scales beyond that hardly contributes. It is an estimate of that of all pairs in their cells, whatever the order of
    /// particles. The cells are those around particle `middle`; `None` where they have no pair.
    pub(in crate::run) fn temperature_in_cells(&self, middle: usize) -> Option<f64> {
        let State { mass, x, v, species, .. } = self.state();
        let inverse = self.engine().plan().cutoff().powi(-2);
        let from = middle.min(x.len().saturating_sub(FEW));
        let grid = self.grid(&x[from..x.len().min(from + FEW)]);
        let first = grid.number(x.get(middle)?).saturating_sub(CELLS / 2);
        let first = first.min(grid.cells().saturating_sub(CELLS));
        let mut parts: Vec<_> = (0..x.len().div_ceil(PART)).map(|part| (part * PART, Vec::new())).collect();
        self.engine().pool().each(&mut parts, |(start, found)| {
            for k in *start..x.len().min(*start + PART) {
                let cell = grid.number(&x[k]).wrapping_sub(first);
                if cell < CELLS && self.frozen().get(k) != Some(&true) {
                    found.push((k, cell as usize));
                }
            }
        });
        let (mut sum, mut weights) = (0.0, 0.0);
        let mut cells = vec![Cell::default(); CELLS as usize];
        for (k, cell) in parts.into_iter().flat_map(|(_, found)| found) {
            let cell = &mut cells[cell];
            let known = cell.count.min(PARTNERS);
            let m = mass[species[k] as usize];
            let (mut squares, mut of_one) = (0.0, 0.0);
            for j in &cell.some[..known] {
                let j = *j as usize;
                let other = mass[species[j] as usize];
                let d: [f64; 3] = std::array::from_fn(|c| x[k][c] - x[j][c]);
                let square = d.iter().map(|d| d * d).sum::<f64>();
                // Which pairs are in range is chance, so that a branch costs more than the sum.
                let weight = if square > 0.0 { (1.0 - square * inverse).max(0.0) } else { 0.0 };
                let along = (0..3).map(|c| d[c] * (v[k][c] - v[j][c])).sum::<f64>();
                squares +=
                    weight * (m * other * along * along) / ((m + other) * square.max(f64::MIN_POSITIVE));
                of_one += weight;
            }
            let mut place = known;
            if cell.count >= PARTNERS {
                // Each of those known stands for as many.
                let stands_for = cell.count as f64 / known as f64;
                squares *= stands_for;
                of_one *= stands_for;
                place = random(k) as usize % (cell.count + 1);
            }
            sum += squares;
            weights += of_one;
            // The new one takes the place of one with the chance that each of all has to be known.
            if let Some(some) = cell.some.get_mut(place) {
                *some = k as u32;
            }
            cell.count += 1;
        }
        Some(sum / weights).filter(|kt| kt.is_finite())
    }
}

/// A number that depends on the index alone.
fn random(k: usize) -> u64 {
    let mixed = (k as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 33
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::Tags;
    use crate::tests::support::{SET6, scene};
    use nalgebra::{Matrix3, Vector3};
    use std::collections::HashMap;

    const MIXTURE: &str = include_str!("../../../../models/huggins.toml");
    const PLANE: &str = include_str!("../../../../models/van-der-waals-2d.toml");

    /// Particles at random, with velocities of kT = 1.
    fn crowd(model: &str, lengths: &str, density: f64) -> Simulation {
        placed("random", model, lengths, density)
    }

    fn placed(kind: &str, model: &str, lengths: &str, density: f64) -> Simulation {
        let text = format!(
            "model = \"m.toml\"\nkT = 1.0\nseed = 5\nbox = {lengths}\nsteps = 1\ndt = 0.01\n[initial]\n\
             kind = \"{kind}\"\ndensity = {density}\n"
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

    /// The definition, by all pairs in a cell, and the largest number of particles there.
    fn plain(simulation: &Simulation, count: [f64; 3]) -> (f64, usize) {
        let State { domain, mass, x, v, species, .. } = simulation.state();
        let dimensions = simulation.dimensions();
        let range = simulation.engine().plan().cutoff();
        let mut cells: HashMap<Vec<usize>, Vec<usize>> = HashMap::new();
        for k in (0..x.len()).filter(|k| simulation.frozen().get(*k) != Some(&true)) {
            let s = domain.fraction(x[k]);
            let at = (0..dimensions).map(|c| (s[c] * count[c]) as usize).collect();
            cells.entry(at).or_default().push(k);
        }
        let (mut sum, mut weights) = (0.0, 0.0);
        for cell in cells.values() {
            for (i, j) in cell.iter().flat_map(|i| cell.iter().map(move |j| (*i, *j))).filter(|(i, j)| i < j)
            {
                let d = Vector3::from(x[i]) - Vector3::from(x[j]);
                if d.norm() < range {
                    let along = d.normalize().dot(&(Vector3::from(v[i]) - Vector3::from(v[j])));
                    let [m, other] = [i, j].map(|k| mass[species[k] as usize]);
                    let weight = 1.0 - (d.norm() / range).powi(2);
                    sum += weight * along * along / (1.0 / m + 1.0 / other);
                    weights += weight;
                }
            }
        }
        (sum / weights, cells.values().map(Vec::len).max().unwrap())
    }

    /// In boxes that are periodic, tilted and open, in the plane, of a mixture of two masses, and with particles that never move.
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
        // On a lattice no cell has more particles than are known.
        let even = placed("lattice", MIXTURE, "10.5", 4.0);
        let even = with(&even, |state| state.mass = vec![0.5, 3.0]);
        let mut exact = 0;
        for of in [set6, tilted, held, crowd(PLANE, "[16.0, 18.0]", 4.0), mixed, even] {
            let last = of.len() - 1;
            for middle in [0, last / 2, last] {
                let first = middle.min(of.len().saturating_sub(FEW));
                let count = of.grid(&of.state().x[first..of.len().min(first + FEW)]).count;
                let (expected, most) = plain(&of, count);
                let found = of.temperature_in_cells(middle).unwrap();
                let bound = if most <= PARTNERS + 1 { 1e-10 } else { 0.1 };
                exact += usize::from(most <= PARTNERS + 1);
                assert!((found / expected - 1.0).abs() < bound, "{found} {expected} {most}");
            }
        }
        assert!(exact > 0);
    }

    /// Cells are as wide as the range in a dense liquid, also in a drop in a wide box, and wider by a cube root of 5 at most.
    #[test]
    fn cells_hold_some_particles() {
        let edge = |of: &Simulation| 30.0 / of.grid(&of.state().x[..FEW]).count[0];
        let dense = with(&crowd(SET6, "30.0", 1000.0 / 27_000.0), |state| {
            state.x.sort_by(|a, b| a[0].total_cmp(&b[0]));
            state.x.iter_mut().for_each(|x| *x = x.map(|c| 10.0 + c / 6.0));
        });
        assert!((1.0..1.01).contains(&edge(&dense)), "{}", edge(&dense));
        let sparse = crowd(SET6, "30.0", 0.05);
        assert!((1.6..1.8).contains(&edge(&sparse)), "{}", edge(&sparse));
    }

    /// In whatever order particles are in memory, in that of their velocities too, where neighbours move alike; whichever of many cells
    /// count; and whatever the flow of the whole. Shear at a rate γ̇ = 2 adds γ̇²⟨r²⟩/30,
    /// which is 0.08 for all pairs, and less for those in one cell.
    #[test]
    fn no_order_changes_the_temperature() {
        let rest = crowd(SET6, "20.0", 20.0);
        let changed = |f: &dyn Fn([f64; 3], [f64; 3]) -> [f64; 3]| {
            with(&rest, |state| state.v.iter_mut().zip(&state.x).for_each(|(v, x)| *v = f(*v, *x)))
        };
        let ordered = with(&rest, |state| {
            let mut both: Vec<_> = state.x.iter().copied().zip(state.v.iter().copied()).collect();
            both.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
            (state.x, state.v) = both.into_iter().unzip();
        });
        let flies = changed(&|v, _| [v[0] + 1e3, v[1], v[2] - 2e3]);
        let sheared = changed(&|v, x| [v[0] + 2.0 * x[1], v[1], v[2]]);
        let mut seen = Vec::new();
        for middle in [0, 50_000, 120_000] {
            let of = |simulation: &Simulation| simulation.temperature_in_cells(middle).unwrap();
            let here = of(&rest);
            assert!(
                (here - 1.0).abs() < 0.04 && (of(&ordered) - 1.0).abs() < 0.04,
                "{here} {}",
                of(&ordered)
            );
            assert!((of(&flies) / here - 1.0).abs() < 1e-9);
            assert!((0.03..0.08).contains(&(of(&sheared) - here)), "{}", of(&sheared) - here);
            seen.push(here);
        }
        assert!(seen[0] != seen[1] && seen[1] != seen[2], "{seen:?}");
        let sparse = crowd(SET6, "30.0", 1.0 / 27_000.0);
        assert_eq!(sparse.temperature_in_cells(0), None);
        // Particles at one point have no direction.
        let together = with(&crowd(SET6, "10.0", 0.3), |state| state.x.fill([5.0; 3]));
        assert_eq!(together.temperature_in_cells(0), None);
    }
}
