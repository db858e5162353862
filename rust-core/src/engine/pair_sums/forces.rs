//! Forces, energy and virial over the pairs, in blocks: each term of the plan adds to a block's scalars
//! in a loop of its own, compiled for its kernel, and a last loop adds these to the particles.

use super::closed_forms::subtract_slopes;
use super::pairs::{BLOCK, PairList};
use crate::engine::particles::Particles;
use crate::engine::plan::{LinearTerm, Plan, ThermostatPlan};
use crate::engine::request::Request;
use crate::engine::surroundings::Newton;
use crate::engine::vectors::{Loop, run_best};
use crate::model::PairTerm;
use crate::model::kernel::{Kernel, Shape, ShapeVisitor};
use crate::model::pair::PairForm;
use psidpd_passes::noise::PairNoise;
use psidpd_passes::tally::{Tally, Want};
use std::ops::Range;

/// Input of a force pass.
pub struct ForceInput<'a> {
    pub plan: &'a Plan,
    pub list: &'a PairList,
    pub newton: Newton,
    /// Slopes `∂ψ/∂n` of owned particles and ghosts, [`Plan::slope_width`] each.
    pub slopes: &'a [f64],
    pub request: Request<'a>,
    /// Noise and `dt^{-1/2}`; with `None` there are no dissipative and random forces.
    pub thermostat: Option<(PairNoise, f64)>,
}

impl<'a> ForceInput<'a> {
    /// Input for conservative forces on all particles of a list.
    pub fn conservative(
        plan: &'a Plan,
        list: &'a PairList,
        owned: usize,
        slopes: &'a [f64],
    ) -> ForceInput<'a> {
        let particles = Particles { owned, ..Particles::default() };
        let request = Request { particles, v: &[], step: None, want: Want::TOTALS };
        ForceInput { plan, list, newton: Newton::On, slopes, request, thermostat: None }
    }
}

/// Arrays that a force pass adds to; empty where they are not wanted.
#[derive(Default)]
pub struct ForceOutput<'a> {
    pub force: &'a mut [[f64; 3]],
    pub particle_energy: &'a mut [f64],
    pub particle_virial: &'a mut [[f64; 6]],
    /// The conservative force of each pair along `ê_ij`, positive if repulsive.
    pub pair_force: &'a mut [f64],
    pub tally: Tally,
}

/// The scalars of a block of pairs.
pub struct Block<const N: usize> {
    /// Forces along `ê_ij`.
    pub conservative: [f64; N],
    thermostat: [f64; N],
    /// Drag alone.
    drag: [f64; N],
    /// Energies of terms linear in a density: the parts of `i` and of `j`.
    pub excess_i: [f64; N],
    pub excess_j: [f64; N],
    /// Pair energies `φ`.
    pub pair: [f64; N],
    /// Distances and indices of the pairs that one pair term acts on.
    r: [f64; N],
    phi: [f64; N],
    slope: [f64; N],
    place: [u16; N],
}

/// Adds the forces of all pairs.
pub fn add_forces(input: &ForceInput, output: &mut ForceOutput) {
    let mut block = Block::<BLOCK>::new();
    let energies = input.request.want.energy || input.request.want.particle_energy;
    for begin in (0..input.list.len()).step_by(BLOCK) {
        let pairs = begin..(begin + BLOCK).min(input.list.len());
        block.conserve(input, pairs.clone(), energies);
        if let Some(forces) = output.pair_force.get_mut(pairs.clone()) {
            forces.copy_from_slice(&block.conservative[..pairs.len()]);
        }
        if let (Some((noise, inverse_root_dt)), Some(plan)) = (&input.thermostat, &input.plan.thermostat) {
            add_thermostat(input, plan, noise, *inverse_root_dt, pairs.clone(), &mut block);
        } else {
            block.thermostat.fill(0.0);
            block.drag.fill(0.0);
        }
        scatter(input, output, pairs.clone(), &block);
        if input.request.want.virial || input.request.want.particle_virial {
            tally_virial(input, output, pairs.clone(), &block);
        }
        if energies {
            tally_energy(input, output, pairs, &block);
        }
    }
}

impl<const N: usize> Block<N> {
    pub fn new() -> Block<N> {
        Block {
            conservative: [0.0; N],
            thermostat: [0.0; N],
            drag: [0.0; N],
            excess_i: [0.0; N],
            excess_j: [0.0; N],
            pair: [0.0; N],
            r: [0.0; N],
            phi: [0.0; N],
            slope: [0.0; N],
            place: [0; N],
        }
    }

    /// Computes the conservative forces of some pairs, at most `N`, and their energies if asked for.
    pub fn conserve(&mut self, input: &ForceInput, pairs: Range<usize>, energies: bool) {
        self.conservative.fill(0.0);
        self.pair.fill(0.0);
        if energies {
            self.excess_i.fill(0.0);
            self.excess_j.fill(0.0);
        }
        for (k, density) in input.plan.passes.iter().enumerate() {
            let kernel = &input.plan.densities[*density].force_kernel;
            let out = &mut self.conservative;
            kernel.kind().visit(ManyBody { input, kernel, offset: k, pairs: pairs.clone(), out });
        }
        for term in &input.plan.linear {
            term.kernel.kind().visit(Linear { input, term, energies, pairs: pairs.clone(), block: self });
        }
        for term in &input.plan.pairs {
            add_pair_term(input, term, pairs.clone(), energies, self);
        }
        scale(input.list, pairs, energies, self);
    }
}

/// Scales conservative forces and energies of pairs with reduced strength.
fn scale<const N: usize>(list: &PairList, pairs: Range<usize>, energies: bool, block: &mut Block<N>) {
    if list.factor.is_empty() {
        return;
    }
    for (at, factor) in list.factor[pairs].iter().enumerate() {
        block.conservative[at] *= factor;
        if energies {
            block.excess_i[at] *= factor;
            block.excess_j[at] *= factor;
            block.pair[at] *= factor;
        }
    }
}

/// The many-body force `−[∂ψ_i/∂n_c(j) + ∂ψ_j/∂n_c(i)] w′(r)`.
struct ManyBody<'a, 'b, const N: usize> {
    input: &'a ForceInput<'b>,
    kernel: &'a Kernel,
    offset: usize,
    pairs: Range<usize>,
    out: &'a mut [f64; N],
}

impl<const N: usize> ShapeVisitor for ManyBody<'_, '_, N> {
    type Output = ();

    fn visit<S: Shape>(self) {
        let list = self.input.list;
        let slopes = self.input.slopes;
        let species = self.input.plan.species.len();
        let (width, offset) = (self.input.plan.slope_width(), self.offset * species);
        let mut both = [0.0; N];
        for (both, k) in both.iter_mut().zip(self.pairs.clone()) {
            let here = list.i[k] as usize * width + offset + list.species_j[k] as usize;
            let there = list.j[k] as usize * width + offset + list.species_i[k] as usize;
            *both = slopes[here] + slopes[there];
        }
        let r = &list.r[self.pairs.clone()];
        run_best(TimesSlope { kernel: self.kernel, r, both: &both, out: self.out, _shape: S::default() });
    }
}

/// Subtracts the slopes of a kernel, times `both`, from the forces of a block of pairs.
struct TimesSlope<'a, S> {
    kernel: &'a Kernel,
    r: &'a [f64],
    both: &'a [f64],
    out: &'a mut [f64],
    _shape: S,
}

impl<S: Shape> Loop for TimesSlope<'_, S> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let TimesSlope { kernel, r, both, out, .. } = self;
        let (inverse_range, factor) = (1.0 / kernel.range(), kernel.slope_factor());
        for ((r, both), out) in r.iter().zip(both).zip(out) {
            let s = r * inverse_range;
            let force = both * (factor * S::slope(s));
            // A slope of ψ may be infinite if no particle is in range.
            *out -= if s < 1.0 { force } else { 0.0 };
        }
    }
}

/// The force `−(c_αβ + c_βα) w′(r)` of a density that every ψ is linear in.
struct Linear<'a, 'b, const N: usize> {
    input: &'a ForceInput<'b>,
    term: &'a LinearTerm,
    energies: bool,
    pairs: Range<usize>,
    block: &'a mut Block<N>,
}

impl<const N: usize> ShapeVisitor for Linear<'_, '_, N> {
    type Output = ();

    fn visit<S: Shape>(self) {
        let list = self.input.list;
        let count = self.input.plan.species.len();
        let range = self.term.kernel.range();
        let inverse_range = 1.0 / range;
        let value_factor = self.term.kernel.value_factor();
        let slope_factor = self.term.kernel.slope_factor();
        // Only a law without potential has another kernel in the force; its speed does not matter.
        let foreign = (self.term.force_kernel != self.term.kernel).then_some(self.term.force_kernel);
        for k in self.pairs.clone() {
            let s = list.r[k] * inverse_range;
            if s < 1.0 {
                let (a, b) = (list.species_i[k] as usize, list.species_j[k] as usize);
                let (ab, ba) = (self.term.coefficients[a * count + b], self.term.coefficients[b * count + a]);
                let slope = match foreign {
                    None => slope_factor * S::slope(s),
                    Some(kernel) => kernel.slope(list.r[k]),
                };
                let at = k - self.pairs.start;
                self.block.conservative[at] -= (ab + ba) * slope;
                if self.energies {
                    let w = value_factor * S::value(s);
                    self.block.excess_i[at] += ab * w;
                    self.block.excess_j[at] += ba * w;
                }
            }
        }
    }
}

/// The pair force `−φ′(r)`.
fn add_pair_term<const N: usize>(
    input: &ForceInput,
    term: &PairTerm,
    pairs: Range<usize>,
    energies: bool,
    block: &mut Block<N>,
) {
    let (list, count) = (input.list, pairs.len());
    let Block { conservative, pair, .. } = block;
    if subtract_slopes(term, list, &pairs, &mut conservative[..count], &mut pair[..count]) {
        return;
    }
    let [a, b] = term.between.map(|s| s as u8);
    let range = term.potential.range();
    let mut count = 0;
    for k in pairs.clone() {
        let (si, sj) = (list.species_i[k], list.species_j[k]);
        let takes_part = ((si == a && sj == b) || (si == b && sj == a)) && list.r[k] < range;
        block.r[count] = list.r[k];
        block.place[count] = (k - pairs.start) as u16;
        count += takes_part as usize;
    }
    term.potential.block(&block.r[..count], &mut block.phi[..count], &mut block.slope[..count]);
    for n in 0..count {
        let at = block.place[n] as usize;
        block.conservative[at] -= block.slope[n];
        if energies {
            block.pair[at] += block.phi[n];
        }
    }
}

/// The force `−γ w_R² (ê·v_ij) + σ w_R ξ dt^{-1/2}`.
fn add_thermostat(
    input: &ForceInput,
    plan: &ThermostatPlan,
    noise: &PairNoise,
    inverse_root_dt: f64,
    pairs: Range<usize>,
    block: &mut Block<BLOCK>,
) {
    let list = input.list;
    let count = input.plan.species.len();
    for k in pairs.clone() {
        let at = k - pairs.start;
        let pair = list.species_i[k] as usize * count + list.species_j[k] as usize;
        let (r, range) = (list.r[k], plan.range[pair]);
        (block.thermostat[at], block.drag[at]) = (0.0, 0.0);
        let strength = list.thermostat_factor.get(k).copied().unwrap_or(1.0);
        // A pair at zero distance has no direction.
        if r < range && r > 0.0 && strength != 0.0 {
            let (i, j) = (list.i[k] as usize, list.j[k] as usize);
            let base = 1.0 - r / range;
            let exponent = plan.exponent[pair];
            let w = if exponent == 1.0 { base } else { base.powf(exponent) };
            let (vi, vj) = (&input.request.v[i], &input.request.v[j]);
            let dot = list.d[0][k] * (vi[0] - vj[0])
                + list.d[1][k] * (vi[1] - vj[1])
                + list.d[2][k] * (vi[2] - vj[2]);
            let xi = noise.xi(input.request.particles.tag[i] as u32, input.request.particles.tag[j] as u32);
            let drag = plan.gamma[pair] * w * dot / r;
            block.thermostat[at] = strength * (w * (plan.sigma[pair] * xi * inverse_root_dt - drag));
            block.drag[at] = -strength * (w * drag);
        }
    }
}

fn scatter(input: &ForceInput, output: &mut ForceOutput, pairs: Range<usize>, block: &Block<BLOCK>) {
    let list = input.list;
    let both = input.newton == Newton::On;
    for k in pairs.clone() {
        let r = list.r[k];
        if r == 0.0 {
            continue;
        }
        let scale = (block.conservative[k - pairs.start] + block.thermostat[k - pairs.start]) / r;
        let (i, j) = (list.i[k] as usize, list.j[k] as usize);
        let f = [scale * list.d[0][k], scale * list.d[1][k], scale * list.d[2][k]];
        let fi = &mut output.force[i];
        fi[0] += f[0];
        fi[1] += f[1];
        fi[2] += f[2];
        if both || j < input.request.particles.owned {
            let fj = &mut output.force[j];
            fj[0] -= f[0];
            fj[1] -= f[1];
            fj[2] -= f[2];
        }
    }
}

/// The weight of a pair in the sums of this rank: one half if the other rank counts it too.
#[inline(always)]
fn share(input: &ForceInput, j: usize) -> f64 {
    if input.newton == Newton::On || j < input.request.particles.owned { 1.0 } else { 0.5 }
}

fn tally_virial(input: &ForceInput, output: &mut ForceOutput, pairs: Range<usize>, block: &Block<BLOCK>) {
    let list = input.list;
    let mut virials = [[0.0; 6]; 3];
    for k in pairs.clone() {
        let r = list.r[k];
        if r == 0.0 {
            continue;
        }
        let (i, j) = (list.i[k] as usize, list.j[k] as usize);
        let d = [list.d[0][k], list.d[1][k], list.d[2][k]];
        let dyad = [d[0] * d[0], d[1] * d[1], d[2] * d[2], d[0] * d[1], d[0] * d[2], d[1] * d[2]];
        let (inverse, share) = (1.0 / r, share(input, j));
        let conservative = block.conservative[k - pairs.start] * inverse;
        let [thermostat, drag] = [&block.thermostat, &block.drag].map(|of| of[k - pairs.start] * inverse);
        for c in 0..6 {
            virials[0][c] += share * conservative * dyad[c];
            virials[1][c] += share * thermostat * dyad[c];
            virials[2][c] += share * drag * dyad[c];
        }
        if input.request.want.particle_virial {
            let half = 0.5 * (conservative + thermostat);
            let both = input.newton == Newton::On || j < input.request.particles.owned;
            for c in 0..6 {
                output.particle_virial[i][c] += half * dyad[c];
                if both {
                    output.particle_virial[j][c] += half * dyad[c];
                }
            }
        }
    }
    if input.request.want.virial {
        let Tally { virial, thermostat_virial, drag_virial, .. } = &mut output.tally;
        for (sum, of_block) in [virial, thermostat_virial, drag_virial].into_iter().zip(virials) {
            sum.iter_mut().zip(of_block).for_each(|(sum, of_block)| *sum += of_block);
        }
    }
}

fn tally_energy(input: &ForceInput, output: &mut ForceOutput, pairs: Range<usize>, block: &Block<BLOCK>) {
    let list = input.list;
    let (mut excess, mut pair) = (0.0, 0.0);
    for k in pairs.clone() {
        let (i, j) = (list.i[k] as usize, list.j[k] as usize);
        let at = k - pairs.start;
        let both = input.newton == Newton::On || j < input.request.particles.owned;
        let excess_j = if both { block.excess_j[at] } else { 0.0 };
        excess += block.excess_i[at] + excess_j;
        pair += share(input, j) * block.pair[at];
        if input.request.want.particle_energy {
            output.particle_energy[i] += block.excess_i[at] + 0.5 * block.pair[at];
            if both {
                output.particle_energy[j] += excess_j + 0.5 * block.pair[at];
            }
        }
    }
    output.tally.excess += excess;
    output.tally.pair += pair;
}
