//! The dimensionless numbers of a scene, of the liquid and of its model.

use serde::Serialize;

/// Properties in SI units; `None` is not known.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Properties {
    pub density: Option<f64>,
    pub tension: Option<f64>,
    pub viscosity: Option<f64>,
    /// Isothermal, as sound in a fluid with a thermostat.
    pub sound_speed: Option<f64>,
    pub diffusion: Option<f64>,
}

/// Length, velocity and acceleration of a scene, in SI units.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Scales {
    pub length: Option<f64>,
    pub velocity: Option<f64>,
    pub gravity: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Number {
    pub name: &'static str,
    pub of_liquid: Option<f64>,
    pub of_model: Option<f64>,
}

impl Number {
    /// Whether both are known and differ by more than this share.
    pub fn is_off(&self, by: f64) -> bool {
        matches!((self.of_liquid, self.of_model), (Some(a), Some(b)) if (b / a - 1.0).abs() > by)
    }
}

type Formula = fn(&Properties, &Scales) -> Option<f64>;

const NUMBERS: [(&str, Formula); 7] = [
    ("Ohnesorge  viscosity/sqrt(density tension length)", |p, s| {
        Some(p.viscosity? / (p.density? * p.tension? * s.length?).sqrt())
    }),
    ("Weber      density velocity2 length/tension", |p, s| {
        Some(p.density? * s.velocity?.powi(2) * s.length? / p.tension?)
    }),
    ("capillary  viscosity velocity/tension", |p, s| Some(p.viscosity? * s.velocity? / p.tension?)),
    ("Reynolds   density velocity length/viscosity", |p, s| {
        Some(p.density? * s.velocity? * s.length? / p.viscosity?)
    }),
    ("Bond       density gravity length2/tension", |p, s| {
        Some(p.density? * s.gravity? * s.length?.powi(2) / p.tension?)
    }),
    ("Mach       velocity/speed of sound", |p, s| Some(s.velocity? / p.sound_speed?)),
    ("Schmidt    viscosity/(density diffusion)", |p, _| Some(p.viscosity? / (p.density? * p.diffusion?))),
];

/// The dimensionless numbers that the scales and the properties of the liquid or of the model give.
pub fn numbers(liquid: &Properties, model: &Properties, scales: &Scales) -> Vec<Number> {
    let of = |(name, formula): &(&'static str, Formula)| Number {
        name,
        of_liquid: formula(liquid, scales),
        of_model: formula(model, scales),
    };
    NUMBERS.iter().map(of).filter(|n| n.of_liquid.is_some() || n.of_model.is_some()).collect()
}
