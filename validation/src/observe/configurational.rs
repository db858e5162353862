//! The temperature of configurations, `⟨Σ F·F⟩/⟨Σ ∇²U⟩` of conservative forces.

use super::frame::Frame;
use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::Fluid;

/// Why there is none, if there is none.
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

/// `Σ F·F` and `Σ ∇²U` over the particles that move.
pub fn sums(frame: &Frame) -> [f64; 2] {
    let evaluation = frame.evaluation();
    let laplacians = evaluation.laplacians(frame.evaluator().fluid(), frame.view.species);
    let mut sums = [0.0; 2];
    for (k, (f, l)) in evaluation.forces.iter().zip(laplacians).enumerate() {
        if frame.moves(k) {
            sums[0] += f.iter().map(|f| f * f).sum::<f64>();
            sums[1] += l;
        }
    }
    sums
}
