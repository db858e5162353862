//! Predictions of theory and literature for a fluid, and how far the theory can be trusted.

use crate::freezing::{Freezing, freezing};
use psidpd_core::model::{Fluid, Model};
use psidpd_core::theory::{Binodal, Correlated, Interface, MeanField, TheoryError};
use psidpd_formats::Expected;

/// Correlations matter if they change the density or the pressure by at least this share.
const MATTERS: f64 = 0.1;

/// The liquid of the correlated fluid is sought up to this multiple of the mean-field liquid density.
const BEYOND: f64 = 6.0;

/// The mean-field theory of a fluid of one species, and the corrections by correlations.
#[derive(Debug, Clone)]
pub struct Prediction {
    pub density: f64,
    /// Whether the caller gave the density.
    asked: bool,
    pub pressure: f64,
    /// Mean local densities and pressure with correlations to first order; `None` where the theory does not apply.
    pub correlated: Option<Correlated>,
    pub names: Vec<String>,
    /// Mean-field coexistence of vapour and liquid.
    pub phases: Result<Binodal, TheoryError>,
    /// Density of zero pressure with correlations to first order: close to that of the liquid.
    pub correlated_liquid: Option<f64>,
    pub interface: Result<Interface, TheoryError>,
    /// What a measured line says of crystals, which mean field does not know.
    pub freezing: Option<Freezing>,
}

/// The theory of a fluid at a number density; `None` without a mean field or with several species. The
/// default density is that of the liquid, or 3 without a liquid.
pub fn predict(fluid: &Fluid, density: Option<f64>) -> Option<Prediction> {
    if fluid.species.len() != 1 || fluid.stated_slopes().is_some() {
        return None;
    }
    let theory = MeanField::new(fluid).ok()?;
    let correlations = theory.correlations().ok().flatten();
    let phases = theory.binodal();
    let correlated_liquid = phases
        .as_ref()
        .ok()
        .and_then(|b| correlations.as_ref()?.zero_pressure_density([0.5 * b.liquid, BEYOND * b.liquid]));
    let liquid = correlated_liquid.or(phases.as_ref().ok().map(|b| b.liquid));
    let asked = density.is_some();
    let freezing = freezing(fluid, density);
    let density = density.or(liquid).unwrap_or(3.0);
    Some(Prediction {
        density,
        asked,
        pressure: theory.pressure(&[density]),
        correlated: correlations.as_ref().and_then(|c| c.at(density)),
        names: fluid.densities.iter().map(|d| d.name.clone()).collect(),
        interface: theory.interface(201),
        correlated_liquid,
        phases,
        freezing,
    })
}

impl Prediction {
    /// Lines about the expected phases, then [`Prediction::doubts`].
    pub fn summary(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if let Ok(b) = &self.phases {
            let (low, high) = (b.vapour, self.correlated_liquid.unwrap_or(b.liquid));
            let expected = match self.density {
                _ if self.freezing.is_some_and(|f| f.is_certain()) => "a crystal",
                rho if rho <= low => "a vapour",
                rho if rho >= high * (1.0 - MATTERS) => "a liquid, compressed or near coexistence",
                _ => "vapour and liquid, where the box has room for both",
            };
            let correlated = match self.correlated_liquid {
                Some(liquid) => format!(", or about {liquid:.3} with correlations"),
                None => String::new(),
            };
            lines.push(format!(
                "mean field has a vapour of density {:.4} and a liquid of {:.3}{correlated}; at {:.3} expect {expected}",
                b.vapour, b.liquid, self.density
            ));
        } else {
            lines.push("mean field has one phase at this temperature".into());
        }
        lines.extend(self.doubts());
        lines
    }

    /// Lines that say where and by how much mean field fails for this fluid; empty where correlations change little.
    pub fn doubts(&self) -> Vec<String> {
        let mut doubts: Vec<String> = self.freezing.iter().map(Freezing::message).collect();
        if let Some(c) = &self.correlated {
            let rho = self.density;
            for (name, n) in self.names.iter().zip(&c.mean_density) {
                if (n / rho - 1.0).abs() > MATTERS {
                    doubts.push(format!(
                        "mean field is off here: it puts the local density {name} of every particle at the bulk density {rho:.3}; \
                         with the correlations of neighbours, to first order, its mean is {n:.3} ({:+.0} %)",
                        100.0 * (n / rho - 1.0)
                    ));
                }
            }
            let scale = self.pressure.abs().max(c.pressure.abs());
            if self.asked && (self.pressure - c.pressure).abs() > MATTERS * scale {
                doubts.push(format!(
                    "at density {rho:.3} the pressure of mean field is {:.2}; correlations to first order make it {:.2}, and may \
                     overshoot: the fluid is somewhere from one to the other",
                    self.pressure, c.pressure
                ));
            }
        }
        if let (Ok(b), Some(liquid)) = (&self.phases, self.correlated_liquid)
            && (liquid / b.liquid - 1.0).abs() > MATTERS
        {
            doubts.push(format!(
                "the liquid that mean field puts at density {:.2} is expected near {liquid:.2} (zero pressure with correlations \
                 to first order; tension and width of mean field belong to the wrong liquid)",
                b.liquid
            ));
        }
        if let Err(TheoryError::GradientNotPositive { at, .. }) = &self.interface {
            doubts.push(format!(
                "no planar interface from mean field: the square-gradient coefficient is negative at density {at:.2}, where the \
                 many-body repulsion outweighs the attraction in gradients, so the expansion in gradients fails; this says \
                 nothing of the fluid, which may have an interface. Remedy: measure it in a slab, theory --measure"
            ));
        }
        doubts
    }
}

/// Reference values for the measured results of a run at kT. `uniform` is the number density of a homogeneous fluid.
pub fn expected(model: &Model, fluid: &Fluid, uniform: Option<f64>) -> Vec<Expected> {
    let mut all: Vec<Expected> = Vec::new();
    let mut add = |name: &str, mean_field: Option<f64>| {
        let mean_field = mean_field.filter(|x| x.is_finite());
        if mean_field.is_some() {
            all.push(Expected { name: name.into(), mean_field, published: None });
        }
    };
    // Without correlations, which have no part in these values.
    if fluid.species.len() == 1
        && fluid.stated_slopes().is_none()
        && let Ok(theory) = MeanField::new(fluid)
    {
        add("pressure", uniform.map(|rho| theory.pressure(&[rho])));
        let phases = theory.binodal().ok();
        add("liquid", phases.map(|b| b.liquid));
        add("vapour", phases.map(|b| b.vapour));
        let interface = theory.interface(0).ok();
        add("tension", interface.as_ref().map(|i| i.tension));
        add("width", interface.as_ref().map(|i| i.width));
    }
    for (name, value) in published(model, fluid.kt, uniform) {
        match all.iter_mut().find(|e| e.name == name) {
            Some(known) => known.published = Some(value),
            None => all.push(Expected { name: name.into(), mean_field: None, published: Some(value) }),
        }
    }
    all
}

/// Published results of a fluid; pressures only if they belong to its density.
pub fn published(model: &Model, kt: f64, density: Option<f64>) -> Vec<(&'static str, [f64; 2])> {
    let Some(found) = model.published(kt) else { return Vec::new() };
    let same = found.density.zip(density).is_some_and(|(a, b)| (a / b - 1.0).abs() < 0.005);
    found.values.iter().copied().filter(|(name, _)| *name != "pressure" || same).collect()
}
