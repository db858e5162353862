//! The tension of interfaces normal to an axis.
//!
//! The derivative of the free energy is known in each sample from its virial. With x = ΔU/kT the stretched boxes give the same but for
//! about x³/6. So while x is small every eighth sample is stretched, and what the two differ by in these is added to the mean of the
//! virials.

use super::across::Across;
use super::*;
use nalgebra::Matrix3;

/// Samples for each that is stretched.
const EVERY: u64 = 8;

/// After a change of the energy by a larger part of kT all samples are stretched.
const LARGE: f64 = 0.2;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SurfaceTension {
    across: Across,
    dimensions: usize,
    interfaces: f64,
    perturbation: f64,
    kt: f64,
    samples: u64,
    /// Whether all samples are stretched.
    all: bool,
    /// γ from the momentum transport, from the conservative stress, and from its virial alone; then, 0 in samples that are not stretched,
    /// exp(−ΔU/kT) for more and for less area, γ from the virial, and 1.
    series: Series,
}

/// The scale factors of a box whose faces normal to `axis` get `1 + change` times the area at constant volume.
fn deformation(axis: usize, dimensions: usize, change: f64) -> [f64; 3] {
    let rest = (1.0 + change).powf(1.0 / (dimensions - 1) as f64);
    std::array::from_fn(|c| match c {
        c if c == axis => 1.0 / (1.0 + change),
        c if c < dimensions => rest,
        _ => 1.0,
    })
}

/// The energy `U` of a configuration, scaled with its box to `1 + change` times the area at constant volume.
pub fn stretched_energy(frame: &Frame, axis: usize, change: f64) -> f64 {
    let view = frame.view;
    let domain = view.domain;
    // The other two edges span the faces normal to a direction, so edges are scaled and not directions.
    let scale = deformation(axis, view.dimensions, change);
    let of_same_pairs =
        frame.evaluator.energy_of_stretched(view.pool, frame.evaluation(), view.species, scale);
    if let Some(energy) = of_same_pairs {
        return energy;
    }
    let edges = Matrix3::from_fn(|row, k| scale[k] * domain.edge(k)[row]);
    let Ok(stretched) = PeriodicBox::new(domain.origin(), edges, domain.periodic()) else { return f64::NAN };
    let x: Vec<[f64; 3]> = view.x.iter().map(|x| stretched.point(domain.fraction(*x))).collect();
    frame.evaluator.energy(view.pool, &x, view.species, &stretched)
}

/// `Σ m v v/V` of the particles that move: xx, yy, zz; the rest is 0.
fn kinetic_pressure(frame: &Frame) -> [f64; 6] {
    let mut sum = [0.0; 6];
    for (k, v) in frame.view.v.iter().enumerate().filter(|(k, _)| frame.moves(*k)) {
        let share = frame.mass(k) / frame.volume();
        (0..3).for_each(|c| sum[c] += share * v[c] * v[c]);
    }
    sum
}

impl Meter for SurfaceTension {
    const TABLE: Table = Table {
        path: "surface_tension",
        title: "surface tension of a slab, by stress and by free energy",
        about: "`stress` is (L/m)(P_N − P_T) with the flux of momentum that the integrator makes in the whole box, as \
                `carried` of `pressure`, m the number of interfaces, P_T the mean of the other directions. \
                `stress_conservative` has the velocities at the ends of steps and conservative forces alone. Both have \
                the same limit as the time step goes to 0. `free_energy` is the \
                test-area method (Gloor et al., J. Chem. Phys. 123, 134703 (2005)): configurations are stretched \
                with their box at constant volume to 1 ± ε times the area, the many-body energy is computed again, \
                and γ = −kT [ln⟨exp(−ΔU₊/kT)⟩ − ln⟨exp(−ΔU₋/kT)⟩]/(2 m ε A) with the kT of the stage. While ΔU is below \
                0.2 kT, that is done in every eighth sample; what it differs by from γ of the virial alone is added to the mean of \
                this over all samples. The two \
                routes agree in equilibrium, to the error of the time step. ε should be small enough that ΔU stays below kT. In two dimensions the area is a length.",
        keys: keys! {
            use AXIS;
            "interfaces": ValueKind::Whole(1, 1000), Need::Default("2"),
                "How many interfaces are normal to the axis."
                => "1";
            "perturbation": ValueKind::Within(1e-7, 0.1), Need::Default("0.0001"),
                "ε, the relative change of the area."
                => "5e-4";
        },
        ..PLAIN
    };

    const NEEDS: Want = Want::TOTALS;
    const FLUX: Recorded = Recorded::Sum;
    const PRESSURE: bool = false;
    const OF_LIQUIDS: bool = true;
    const PAIRS: Pairs = Pairs::List;

    fn read(options: &Options) -> Result<SurfaceTension, FileError> {
        let place = options.place;
        let axis =
            options.axis("axis")?.or(place.slab.map(|slab| slab.axis)).unwrap_or(place.fluid.dimensions - 1);
        options.require_right_angles("axis")?;
        if !place.fluid.is_conservative() {
            return Err(options.error("", "a force of the model has no potential: there is no free energy"));
        }
        Ok(SurfaceTension {
            across: Across::at(options, axis),
            dimensions: place.fluid.dimensions,
            interfaces: options.count("interfaces")? as f64,
            perturbation: options.number("perturbation")?,
            kt: 0.0,
            samples: 0,
            all: false,
            series: Series::new(7),
        })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let (axis, view) = (self.across.axis, frame.view);
        self.kt = view.kt;
        let Some(carried) = frame.carried_pressure() else { return false };
        let tension = |p: [f64; 6]| {
            let others: f64 = (0..self.dimensions).filter(|c| *c != axis).map(|c| p[c]).sum();
            let difference = p[axis] - others / (self.dimensions - 1) as f64;
            self.across.height / self.interfaces * difference
        };
        let conservative = tension(view.conservative_pressure);
        let of_virial = conservative - tension(kinetic_pressure(frame));
        let mut sample = [tension(carried), conservative, of_virial, 0.0, 0.0, 0.0, 0.0];
        if self.all || self.samples.is_multiple_of(EVERY) {
            let energy = frame.evaluation().energy;
            let weight = |change: f64| (-(stretched_energy(frame, axis, change) - energy) / self.kt).exp();
            let [more, less] = [self.perturbation, -self.perturbation].map(weight);
            sample[3..].copy_from_slice(&[more, less, of_virial, 1.0]);
            self.all |= [more, less].iter().any(|weight| weight.ln().abs() > LARGE);
        }
        let taken = self.series.push(&sample);
        self.samples += u64::from(taken);
        taken
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn restart(&mut self) {
        (self.kt, self.samples, self.all) = (0.0, 0, false);
    }

    fn finish(&self) -> Vec<Observation> {
        let mut free_energy = self.series.mean(0);
        if !self.series.is_empty() {
            let area = 2.0 * self.interfaces * self.perturbation * self.across.area();
            let means = self.series.means();
            let [more, less, known, stretched] = [3, 4, 5, 6].map(|c| means[c]);
            let of_virial = known / stretched;
            free_energy.value = means[2] - of_virial - self.kt * (more.ln() - less.ln()) / area;
            let linear = |s: &[f64]| {
                let apart = (s[5] - of_virial * s[6]) / stretched;
                s[2] - apart - self.kt * (s[3] / more - s[4] / less) / area
            };
            free_energy.error = self.series.linear(linear).error;
        }
        vec![
            Observation::new("surface_tension", "Surface tension", Kind::Scalar, &self.series)
                .column("stress", "energy/area", [self.series.mean(0)])
                .column("stress_conservative", "energy/area", [self.series.mean(1)])
                .column("free_energy", "energy/area", [free_energy]),
        ]
    }
}
