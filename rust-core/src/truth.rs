//! The plain reference: the theory written down once, which tests compare all faster code with.
//!
//! Plain loops over all pairs of particles and their images, in double precision, in the order of the
//! formulas. This module shares no code with the engine; it uses only the formulas of the model (`w`, `w′`,
//! `φ`, `φ′`, ψ and its symbolic derivatives). Its time grows as the square of the number of particles.
//!
//! ```text
//! n_β,i = Σ_j w(r_ij) over j of species β        ñ = ρ̃(n)        U = Σ_i ψ_i(ñ_i) + Σ_pairs φ(r)
//! F_i   = −Σ_j [(s_i,c(j) + s_j,c(i)) w′(r_ij) + φ′(r_ij)] ê_ij,    s = ∂ψ/∂ñ ρ̃′(n)
//! F^D_i = −Σ_j γ w_R² (ê_ij·v_ij) ê_ij,    F^R_i = Σ_j σ w_R ξ_ij Δt^(−1/2) ê_ij,    σ² = 2γkT
//! W     = ½ Σ_i Σ_j r_ij ⊗ F_ij,    r_ij = r_i − r_j
//! n_w,i += ρ_w ∫ w    U += ρ_w [∫ φ + ψ′_w ∫ w]    W += z n ⊗ F    of a wall, at the distance z along its normal n
//! ```

use crate::engine::{PeriodicBox, Step};
use crate::model::expression::{Formula, TooLarge};
use crate::model::pair::PairForm;
use crate::model::wall::{Surface, WallField};
use crate::model::{Bounds, ExcessFreeEnergy, Fluid};

/// Energy, densities, forces and virial of one configuration.
#[derive(Debug, Clone)]
pub struct Truth {
    /// Potential energy `U`.
    pub energy: f64,
    /// ψ of each particle.
    pub excess: Vec<f64>,
    /// Uncorrected local densities, one for each density and species, density-major, particle by particle.
    pub densities: Vec<f64>,
    /// Conservative forces.
    pub forces: Vec<[f64; 3]>,
    /// Virial of the conservative forces: xx, yy, zz, xy, xz, yz.
    pub virial: [f64; 6],
}

impl Truth {
    /// Uncorrected local densities of one particle.
    pub fn densities_of(&self, particle: usize) -> &[f64] {
        let variables = self.densities.len() / self.forces.len();
        &self.densities[particle * variables..][..variables]
    }
}

/// Computes `U` and its gradient for particles at `x`, inside `domain` along its periodic directions.
///
/// # Errors
/// Fails if a derivative of ψ grows beyond the limits of formulas.
pub fn conservative(
    fluid: &Fluid,
    x: &[[f64; 3]],
    species: &[usize],
    domain: &PeriodicBox,
) -> Result<Truth, TooLarge> {
    let (count, variables) = (fluid.species.len(), fluid.variables());
    let mut n = vec![0.0; x.len() * variables];
    let (mut pair_energy, range) = (0.0, fluid.cutoff());
    for (d, density) in fluid.densities.iter().enumerate().filter(|(_, density)| density.includes_self) {
        for i in 0..x.len() {
            n[i * variables + d * count + species[i]] += density.kernel.value(0.0);
        }
    }
    for_each_neighbour(fluid, x, domain, range, |i, j, _, r| {
        for (d, density) in
            fluid.densities.iter().enumerate().filter(|(_, density)| r < density.kernel.range())
        {
            n[i * variables + d * count + species[j]] += density.kernel.value(r);
        }
        for term in fluid.pairs.iter().filter(|term| term.acts(species[i], species[j], r)) {
            pair_energy += 0.5 * term.potential.at(r).0;
        }
    });
    let there = |wall: &&WallField| wall.wall.surface.face().is_none_or(|(axis, _)| !domain.periodic()[axis]);
    let walls: Vec<&WallField> = fluid.walls.iter().filter(there).collect();
    for (i, wall) in (0..x.len()).flat_map(|i| walls.iter().map(move |wall| (i, wall))) {
        for (d, density) in &wall.fields[species[i]].densities {
            n[i * variables + d * count + wall.wall.species] += density.at(distance(wall, domain, x[i]).0)[0];
        }
    }
    let (mut excess, mut slopes) = (Vec::new(), Vec::new());
    for i in 0..x.len() {
        let (psi, s) = free_energy(fluid, species[i], &n[i * variables..][..variables])?;
        excess.push(psi);
        slopes.extend(s);
    }
    let (mut forces, mut virial) = (vec![[0.0; 3]; x.len()], [0.0; 6]);
    for_each_neighbour(fluid, x, domain, range, |i, j, d, r| {
        let mut force = 0.0;
        for (k, density) in
            fluid.densities.iter().enumerate().filter(|(_, density)| r < density.force_kernel.range())
        {
            let s_i = slopes[i * variables + k * count + species[j]];
            let s_j = slopes[j * variables + k * count + species[i]];
            force -= (s_i + s_j) * density.force_kernel.slope(r);
        }
        for term in fluid.pairs.iter().filter(|term| term.acts(species[i], species[j], r)) {
            force -= term.potential.at(r).1;
        }
        add(&mut forces[i], &mut virial, d, r, force);
    });
    let mut wall_energy = 0.0;
    for (i, wall) in (0..x.len()).flat_map(|i| walls.iter().map(move |wall| (i, wall))) {
        let (field, (z, normal)) = (&wall.fields[species[i]], distance(wall, domain, x[i]));
        let energies = field.energies.iter().map(|energy| energy.at(z));
        let of_densities = field
            .densities
            .iter()
            .map(|(d, density)| -slopes[i * variables + d * count + wall.wall.species] * density.at(z)[1]);
        let force = of_densities.sum::<f64>() - energies.clone().map(|[_, slope, _]| slope).sum::<f64>();
        wall_energy += energies.map(|[energy, ..]| energy).sum::<f64>();
        (0..3).for_each(|c| forces[i][c] += force * normal[c]);
        for (k, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            virial[k] += z * force * normal[a] * normal[b];
        }
    }
    Ok(Truth {
        energy: wall_energy + excess.iter().sum::<f64>() + pair_energy,
        excess,
        densities: n,
        forces,
        virial,
    })
}

/// The distance of a place from the surface of a wall, and the direction from there into the fluid.
fn distance(wall: &WallField, domain: &PeriodicBox, x: [f64; 3]) -> (f64, [f64; 3]) {
    match wall.wall.surface {
        Surface::Face { axis, high } => {
            let low = domain.origin()[axis];
            let mut normal = [0.0; 3];
            normal[axis] = if high { -1.0 } else { 1.0 };
            (if high { low + domain.lengths()[axis] - x[axis] } else { x[axis] - low }, normal)
        }
        Surface::Round(round) => {
            // The nearest of the images of the centre.
            let mut d = [0.0; 3];
            for c in (0..3).filter(|c| round.across[*c]) {
                let shifts = if domain.periodic()[c] { [-1.0, 0.0, 1.0] } else { [0.0; 3] };
                let all = shifts.map(|shift| x[c] - round.center[c] - shift * domain.lengths()[c]);
                d[c] = all.into_iter().min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
            }
            let c = d[0].hypot(d[1]).hypot(d[2]);
            match round.inside {
                true => (round.radius - c, d.map(|d| -d / c)),
                false => (c - round.radius, d.map(|d| d / c)),
            }
        }
    }
}

/// Drag and noise of one step, with their virial.
pub fn drag_and_noise(
    fluid: &Fluid,
    x: &[[f64; 3]],
    v: &[[f64; 3]],
    tag: &[i32],
    species: &[usize],
    domain: &PeriodicBox,
    step: Step,
) -> (Vec<[f64; 3]>, [f64; 6]) {
    let (mut forces, mut virial) = (vec![[0.0; 3]; x.len()], [0.0; 6]);
    let words = |number: u64| [number as u32, (number >> 32) as u32];
    let key = threefry(20, words(step.number), words(step.seed));
    for_each_neighbour(fluid, x, domain, fluid.cutoff(), |i, j, d, r| {
        let Some(law) = fluid.thermostats[species[i] * fluid.species.len() + species[j]] else { return };
        if r >= law.range {
            return;
        }
        let w = (1.0 - r / law.range).powf(law.exponent);
        let towards: f64 = (0..3).map(|c| d[c] / r * (v[i][c] - v[j][c])).sum();
        let tags = [tag[i].min(tag[j]) as u32, tag[i].max(tag[j]) as u32];
        // The noise is uniform on (−√3, √3), with unit variance.
        let xi = 3f64.sqrt() * ((f64::from(threefry(13, tags, key)[0]) + 0.5) / 2f64.powi(31) - 1.0);
        let sigma = (2.0 * law.gamma * fluid.kt).sqrt();
        let force = sigma * w * xi / step.dt.sqrt() - law.gamma * w * w * towards;
        add(&mut forces[i], &mut virial, d, r, force);
    });
    (forces, virial)
}

/// Adds the force of one neighbour along `ê = d/r`, and half its virial. A pair at zero distance has no direction.
fn add(on: &mut [f64; 3], virial: &mut [f64; 6], d: [f64; 3], r: f64, force: f64) {
    if r > 0.0 {
        for (k, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            virial[k] += 0.5 * force * d[a] * d[b] / r;
        }
        (0..3).for_each(|c| on[c] += force * d[c] / r);
    }
}

/// Calls `visit` with `i`, `j`, `r_i − r_j` and the distance for every particle `i` and every other
/// particle or image `j` closer than `range`.
fn for_each_neighbour(
    fluid: &Fluid,
    x: &[[f64; 3]],
    domain: &PeriodicBox,
    range: f64,
    mut visit: impl FnMut(usize, usize, [f64; 3], f64),
) {
    let dimensions = fluid.dimensions;
    let most = [0, 1, 2].map(|k| {
        let repeats = k < dimensions && domain.periodic()[k];
        // Two particles inside the box are less than one height apart.
        if repeats { (range / domain.height(k)).ceil() as i32 } else { 0 }
    });
    for (i, j) in (0..x.len()).flat_map(|i| (0..x.len()).map(move |j| (i, j))) {
        for a in -most[0]..=most[0] {
            for b in -most[1]..=most[1] {
                for c in -most[2]..=most[2] {
                    let mut d = [0.0; 3];
                    for m in 0..dimensions {
                        let shift: f64 = [a, b, c]
                            .iter()
                            .enumerate()
                            .map(|(k, s)| f64::from(*s) * domain.edge(k)[m])
                            .sum();
                        d[m] = x[i][m] - x[j][m] - shift;
                    }
                    let r = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
                    if r < range && (i, [a, b, c]) != (j, [0; 3]) {
                        visit(i, j, d, r);
                    }
                }
            }
        }
    }
}

/// ψ of a particle of species `alpha` and its derivatives by the uncorrected densities `n`.
fn free_energy(fluid: &Fluid, alpha: usize, n: &[f64]) -> Result<(f64, Vec<f64>), TooLarge> {
    let count = fluid.species.len();
    let powers = |v: usize| &fluid.densities[v / count].correction[alpha * count + v % count].0;
    let power = |v: usize, k: usize| n[v].powi(k as i32);
    let corrected: Vec<f64> =
        (0..n.len()).map(|v| powers(v).iter().enumerate().map(|(k, a)| a * power(v, k)).sum()).collect();
    let bounds: Vec<Option<Bounds>> = (0..n.len()).map(|v| fluid.densities[v / count].bounds).collect();
    let (psi, mut slopes) = match &fluid.excess[alpha] {
        ExcessFreeEnergy::Formula(psi) => {
            let by = |v| continued(psi, &corrected, &bounds, 0, Some(v));
            (continued(psi, &corrected, &bounds, 0, None)?, (0..n.len()).map(by).collect::<Result<_, _>>()?)
        }
        ExcessFreeEnergy::Curve(curve) => {
            // The bounds apply to the total density.
            let own = |v: usize| v / count == curve.density;
            let total: f64 = (0..n.len()).filter(|v| own(*v)).map(|v| corrected[v]).sum();
            let (inside, beyond, order) = bounded(total, fluid.densities[curve.density].bounds);
            let [psi, slope, curvature] = curve.at(inside);
            let second = if order == 2 { curvature } else { 0.0 };
            let slopes = (0..n.len()).map(|v| if own(v) { slope + beyond * second } else { 0.0 }).collect();
            (psi + beyond * slope + 0.5 * beyond * beyond * second, slopes)
        }
        ExcessFreeEnergy::Slopes(law) => (
            law.energy.value(&corrected),
            law.slopes.iter().map(|s| s.value(&corrected)).collect::<Vec<f64>>(),
        ),
    };
    for (v, slope) in slopes.iter_mut().enumerate() {
        *slope *=
            powers(v).iter().enumerate().skip(1).map(|(k, a)| k as f64 * a * power(v, k - 1)).sum::<f64>();
    }
    Ok((psi, slopes))
}

/// The nearest value within the bounds, the distance of `x` from it, and the highest power of this distance in ψ.
fn bounded(x: f64, bounds: Option<Bounds>) -> (f64, f64, usize) {
    match bounds {
        Some(bounds) if x < bounds.low => (bounds.low, x - bounds.low, bounds.order(x - bounds.low)),
        Some(bounds) if x > bounds.high => (bounds.high, x - bounds.high, 2),
        _ => (x, 0.0, 2),
    }
}

/// ψ, or its derivative with respect to one variable, continued beyond the bounds of the variables from
/// the `v`-th on: a series `ψ + δ ψ_v + ½ δ² ψ_vv` in each, as in [`Bounds`].
fn continued(
    psi: &Formula,
    x: &[f64],
    bounds: &[Option<Bounds>],
    v: usize,
    by: Option<usize>,
) -> Result<f64, TooLarge> {
    if v == x.len() {
        let inside: Vec<f64> = x.iter().zip(bounds).map(|(x, bounds)| bounded(*x, *bounds).0).collect();
        return Ok(psi.value(&inside));
    }
    let term = |psi: &Formula| continued(psi, x, bounds, v + 1, by);
    let (_, beyond, order) = bounded(x[v], bounds[v]);
    let first = || psi.derivative(v);
    if by == Some(v) {
        let slope = term(&first()?)?;
        return Ok(if beyond != 0.0 && order == 2 {
            slope + beyond * term(&first()?.derivative(v)?)?
        } else {
            slope
        });
    }
    let mut sum = term(psi)?;
    if beyond != 0.0 {
        sum += beyond * term(&first()?)?;
        if order == 2 {
            sum += 0.5 * beyond * beyond * term(&first()?.derivative(v)?)?;
        }
    }
    Ok(sum)
}

/// The Threefry-2x32 generator (Salmon, Moraes, Dror and Shaw, SC'11).
fn threefry(rounds: usize, counter: [u32; 2], key: [u32; 2]) -> [u32; 2] {
    const ROTATIONS: [u32; 8] = [13, 15, 26, 6, 17, 29, 16, 24];
    let keys = [key[0], key[1], 0x1BD1_1BDA ^ key[0] ^ key[1]];
    let mut x = [counter[0].wrapping_add(keys[0]), counter[1].wrapping_add(keys[1])];
    for round in 1..=rounds {
        x[0] = x[0].wrapping_add(x[1]);
        x[1] = x[1].rotate_left(ROTATIONS[(round - 1) % 8]) ^ x[0];
        if round % 4 == 0 {
            let s = round / 4;
            x[0] = x[0].wrapping_add(keys[s % 3]);
            x[1] = x[1].wrapping_add(keys[(s + 1) % 3]).wrapping_add(s as u32);
        }
    }
    x
}
