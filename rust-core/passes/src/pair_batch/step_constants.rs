//! Values that are the same for all batches of a step, in registers.

use super::inputs::PairInputs;
use super::thermostat::NOISE_UNIT;
use crate::ground::arithmetic::Arithmetic;
use crate::noise::PairNoise;
use crate::simd::{Isa, Reals, Scalar};
use psidpd_model::kernel::Real;

#[derive(Clone, Copy)]
pub struct StepConstants<I: Isa, A: Arithmetic<I>> {
    pub metric: A::Metric,
    /// The noise, if the thermostat acts in this step.
    pub noise: Option<PairNoise>,
    /// Factor that turns signed random words into `ξ dt^{−1/2}`.
    pub noise_scale: A::Reals,
    /// The numbers 0, 1, 2 … of the lanes.
    pub lane: A::Reals,
}

impl<I: Isa, A: Arithmetic<I>> StepConstants<I, A> {
    /// # Safety
    /// The caller fulfils the contract of `simd`.
    #[inline(always)]
    pub unsafe fn new(inputs: &PairInputs<A::Scalar, A::PackedParticle>) -> Self {
        // SAFETY: no vector has more than sixteen lanes.
        unsafe {
            let thermostat = inputs.thermostat.filter(|_| inputs.terms.thermostat.is_some());
            let (noise, inverse_root_dt) = thermostat.unzip();
            let noise_scale = A::Reals::constant(NOISE_UNIT * inverse_root_dt.unwrap_or_default());
            let mut lane = [A::Scalar::default(); 16];
            for (k, lane) in lane.iter_mut().enumerate() {
                *lane = A::Scalar::of(k as f64);
            }
            let (metric, lane) = (A::metric(inputs.geometry), A::Reals::load(lane.as_ptr()));
            StepConstants { metric, noise, noise_scale, lane }
        }
    }
}
