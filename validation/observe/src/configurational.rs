//! The configurational temperature of conservative forces, `⟨Σ F·F⟩/⟨Σ ∇²U⟩`; between reflecting surfaces with weights.

use super::frame::{Frame, View};
use psidpd_core::engine::{Face, PeriodicBox, Place, faces};
use psidpd_core::model::Fluid;

/// The edge of a block of space, in ranges of the forces.
const BLOCK: f64 = 1.5;

/// The largest number of blocks along a direction.
const MOST_BLOCKS: usize = 8;

/// The reason why the fluid has no configurational temperature; `None` if it has one.
pub fn missing(fluid: &Fluid, domain: &PeriodicBox) -> Option<&'static str> {
    let periodic = domain.periodic();
    let heights = (0..fluid.dimensions).filter(|k| periodic[*k]).map(|k| domain.height(k));
    let half_box = 0.5 * heights.fold(f64::INFINITY, f64::min);
    if !fluid.is_conservative() {
        Some("a force of the model has no potential")
    } else if fluid.force_jumps() {
        Some("a force of the model jumps at its range, where its divergence is a delta function")
    } else if half_box < fluid.conservative_range() {
        Some("the box is narrower than twice the range of the forces")
    } else {
        None
    }
}

/// `Σ w F·F` and `Σ (w ∇²U − ∇w·F)` over the mobile particles, with the weights of [`weight`].
pub fn sums(frame: &Frame) -> [f64; 2] {
    let mut sums = [0.0; 2];
    terms(frame, |_, term| (0..2).for_each(|c| sums[c] += term[c]));
    sums
}

/// The weight of a particle and its gradient: that of the piece, which is 1 without one, and near reflecting faces and round walls the
/// distance from them in ranges of the forces.
///
/// `kT = ⟨w F·F⟩/⟨−∇·(w F)⟩` holds for any weight that is 0 where space ends. Without a weight a face adds `ρ F` to the divergence,
/// with the density and the mean outward force of the particles that touch it.
fn weight(frame: &Frame, rounds: &[Face], range: f64, x: [f64; 3]) -> (f64, [f64; 3]) {
    let domain = frame.view.domain;
    let (mut weight, mut gradient) = frame.piece.map_or((1.0, [0.0; 3]), |piece| piece.weight(x));
    for k in (0..frame.view.dimensions).filter(|k| !domain.periodic()[*k]) {
        let (below, length) = (x[k] - domain.origin()[k], domain.lengths()[k]);
        let (distance, slope) = if below < 0.5 * length { (below, 1.0) } else { (length - below, -1.0) };
        let (part, slope) = if distance < range { (distance / range, slope / range) } else { (1.0, 0.0) };
        gradient = gradient.map(|g| g * part);
        gradient[k] += weight * slope;
        weight *= part;
    }
    for Face { place, .. } in rounds {
        let distance = place.distance(&x).max(0.0);
        if distance < range {
            let (part, n) = (distance / range, place.normal(&x));
            gradient = std::array::from_fn(|c| part * gradient[c] + weight * n[c] / range);
            weight *= part;
        }
    }
    (weight, gradient)
}

/// Visits `w F·F` and `w ∇²U − ∇w·F` of each mobile particle, with its index. Where all particles count alike, and pairs of the run are in
/// single precision, the second are shares of the sum, those of the energies of particles.
fn terms(frame: &Frame, mut visit: impl FnMut(usize, [f64; 2])) {
    if let Some((forces, shares)) = alike(frame) {
        let squares = forces.iter().map(|f| f.iter().map(|f| f * f).sum());
        squares.zip(shares).enumerate().for_each(|(k, (square, share))| visit(k, [square, *share]));
        return;
    }
    let evaluation = frame.evaluation();
    let (forces, laplacians) = evaluation.forces_and_laplacians(frame.view.pool, &frame.evaluator.fluid);
    let range = frame.evaluator.fluid.conservative_range().max(f64::MIN_POSITIVE);
    let mut rounds = faces(&frame.evaluator.fluid.walls, frame.view.domain, frame.view.dimensions);
    rounds.retain(|wall| matches!(wall.place, Place::Round { .. }));
    for (k, (f, l)) in forces.iter().zip(laplacians).enumerate() {
        if frame.moves(k) {
            let (w, gradient) = weight(frame, &rounds, range, frame.view.x[k]);
            let across: f64 = gradient.iter().zip(f).map(|(g, f)| g * f).sum();
            visit(k, [w * f.iter().map(|f| f * f).sum::<f64>(), w * l - across]);
        }
    }
}

/// Forces and shares of particles that all have the weight 1; `None` if some do not, if they have to be in double precision, or if the run
/// has no such forces.
fn alike<'a>(frame: &'a Frame) -> Option<(&'a [[f64; 3]], &'a [f64])> {
    let View { domain, dimensions, x, forces, .. } = frame.view;
    let is_whole = frame.piece.is_none() && domain.periodic()[..dimensions] == [true; 3][..dimensions];
    (is_whole && (0..x.len()).all(|k| frame.moves(k))).then(|| Some((forces?, &frame.sums()?.shares[..])))?
}

/// The terms of [`sums`] for each block of space. Blocks without particles are left out.
///
/// Blocks are wider than the range of the forces, so their values are nearly independent. The scatter of the blocks
/// gives the error of a single configuration.
pub fn sums_of_blocks(frame: &Frame) -> Vec<[f64; 2]> {
    let view = &frame.view;
    let range = frame.evaluator.fluid.conservative_range().max(f64::MIN_POSITIVE);
    let count: [usize; 3] = std::array::from_fn(|k| match k < view.dimensions {
        true => ((view.domain.height(k) / (BLOCK * range)) as usize).clamp(1, MOST_BLOCKS),
        false => 1,
    });
    let mut blocks = vec![None; count.iter().product()];
    terms(frame, |particle, term| {
        let s = view.domain.fraction(view.x[particle]);
        let at: [usize; 3] = std::array::from_fn(|k| ((s[k] * count[k] as f64) as usize).min(count[k] - 1));
        let block: &mut [f64; 2] =
            blocks[(at[2] * count[1] + at[1]) * count[0] + at[0]].get_or_insert([0.0; 2]);
        (0..2).for_each(|c| block[c] += term[c]);
    });
    blocks.into_iter().flatten().collect()
}

/// The mean square frequency of a particle in the field of the others, `⟨Σ ∇²U/m⟩/(dN)`.
pub fn mean_square_frequency(frame: &Frame) -> f64 {
    let laplacians = frame.evaluation().laplacians(frame.view.pool, &frame.evaluator.fluid);
    let weight = |k: usize| frame.piece.map_or(1.0, |piece| piece.weight(frame.view.x[k]).0);
    let (mut sum, mut weights) = (0.0, 0.0);
    for (k, l) in laplacians.into_iter().enumerate() {
        let weight = weight(k);
        sum += weight * l / frame.mass(k);
        weights += weight;
    }
    sum / (frame.view.dimensions as f64 * weights)
}
