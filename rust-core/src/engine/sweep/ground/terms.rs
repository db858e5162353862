//! The plan of a fluid as tables of numbers in the precision of the pairs.

use super::species_pairs::SpeciesPairTable;
use crate::engine::plan::{PairStorage, Plan, ThermostatPlan};
use crate::engine::sweep::simd::Scalar;
use crate::model::PairTerm;
use crate::model::kernel::{Kernel, KernelKind};
use crate::model::pair::{PairForm, PairPotential, SplineAttractive};

/// All terms between pairs. Tables have an entry for each pair of species, row by row.
#[derive(Debug, Clone, Default)]
pub struct Terms<T> {
    pub species: usize,
    /// At least one: without soft repulsion, one of no strength.
    soft: Vec<Soft<T>>,
    pub linear: Vec<Linear<T>>,
    pub spline: Vec<Spline<T>>,
    /// Potentials without vector code.
    pub scalar_fallback: Vec<PairTerm>,
    pub thermostat: Option<ThermostatTables<T>>,
    pub passes: Vec<Pass<T>>,
    /// Whether all pairs go to the full pair cache. Only loops compiled for several species look at it, so that a fluid of
    /// one density and one species does not pay for it.
    pub full_cache: bool,
    /// For each species: 1 where the i-particle is of it and 0 elsewhere, and the same for the j-particle.
    pub is_species: Vec<[SpeciesPairTable<T>; 2]>,
}

/// `a (1 − r/R)`.
#[derive(Debug, Clone)]
pub struct Soft<T> {
    pub strength: SpeciesPairTable<T>,
    pub inverse_range: SpeciesPairTable<T>,
    /// `½ a R`.
    pub energy: SpeciesPairTable<T>,
}

/// `−(c_αβ + c_βα) w′(r)` of a density that every ψ is linear in.
#[derive(Debug, Clone)]
pub struct Linear<T> {
    pub kernel: KernelKind,
    pub inverse_range: T,
    pub force_kernel: KernelKind,
    pub force_inverse_range: T,
    /// `−(c_αβ + c_βα)` times the factor of `w′`.
    pub force: SpeciesPairTable<T>,
    /// `c_αβ + c_βα` times the factor of `w`.
    pub energy: SpeciesPairTable<T>,
}

/// `a [A W(r, R_A) − B W(r, R_B)]`.
#[derive(Debug, Clone)]
pub struct Spline<T> {
    pub repulsion: SpeciesPairTable<T>,
    pub attraction: SpeciesPairTable<T>,
    pub repulsion_inverse_range: SpeciesPairTable<T>,
    pub attraction_inverse_range: SpeciesPairTable<T>,
}

/// `−γ w_R² (ê·v) + σ w_R ξ dt^{−1/2}`.
#[derive(Debug, Clone)]
pub struct ThermostatTables<T> {
    pub gamma: SpeciesPairTable<T>,
    pub sigma: SpeciesPairTable<T>,
    pub inverse_range: SpeciesPairTable<T>,
    pub exponent: Exponent<T>,
}

/// The exponent of `w_R`.
#[derive(Debug, Clone)]
pub enum Exponent<T> {
    One,
    Two,
    Any(SpeciesPairTable<T>),
}

impl<T: Scalar> Exponent<T> {
    fn new(plan: &ThermostatPlan) -> Exponent<T> {
        let all = |e: f64| plan.exponent.iter().zip(&plan.gamma).all(|(x, gamma)| *gamma == 0.0 || *x == e);
        if all(1.0) {
            Exponent::One
        } else if all(2.0) {
            Exponent::Two
        } else {
            Exponent::Any(SpeciesPairTable::new(plan.exponent.iter().map(|x| T::of(*x))))
        }
    }
}

/// A density that some ψ is not linear in.
#[derive(Debug, Clone)]
pub struct Pass<T> {
    pub kernel: KernelKind,
    pub inverse_range: T,
    pub value: T,
    pub force_kernel: KernelKind,
    pub force_range: T,
    pub force_inverse_range: T,
    /// Minus the factor of `w′`.
    pub force: T,
}

/// One over a range. A range of zero gives a number so large that every pair is beyond the range.
fn inverse(range: f64) -> f64 {
    if range > 0.0 { 1.0 / range } else { f64::from(f32::MAX) }
}

impl<T: Scalar> Terms<T> {
    pub fn new(plan: &Plan) -> Terms<T> {
        let count = plan.species.len();
        let mut terms = Terms { species: count, ..Terms::default() };
        for term in &plan.pairs {
            terms.add_pair(term);
        }
        for term in &plan.linear {
            let both = |factor: f64| -> SpeciesPairTable<T> {
                let c = &term.coefficients;
                let sum = |p: usize| c[p] + c[p % count * count + p / count];
                SpeciesPairTable::new((0..count * count).map(|p| T::of(factor * sum(p))))
            };
            terms.linear.push(Linear {
                kernel: term.kernel.kind(),
                inverse_range: T::of(1.0 / term.kernel.range()),
                force_kernel: term.force_kernel.kind(),
                force_inverse_range: T::of(1.0 / term.force_kernel.range()),
                force: both(-term.force_kernel.slope_factor()),
                energy: both(term.kernel.value_factor()),
            });
        }
        if terms.soft.is_empty() {
            terms.soft.push(Soft::none(count * count));
        }
        terms.is_species = (0..count)
            .map(|s| {
                let one = |yes: bool| T::of(f64::from(u8::from(yes)));
                let first = SpeciesPairTable::new((0..count * count).map(|p| one(p / count == s)));
                let second = SpeciesPairTable::new((0..count * count).map(|p| one(p % count == s)));
                [first, second]
            })
            .collect();
        terms.passes = plan
            .passes
            .iter()
            .map(|d| Pass::new(&plan.densities[*d].kernel, &plan.densities[*d].force_kernel))
            .collect();
        terms.full_cache = plan.pair_storage() == Some(PairStorage::FullCache);
        terms.thermostat = plan.thermostat.as_ref().map(|t| ThermostatTables {
            gamma: SpeciesPairTable::new(t.gamma.iter().map(|x| T::of(*x))),
            sigma: SpeciesPairTable::new(t.sigma.iter().map(|x| T::of(*x))),
            inverse_range: SpeciesPairTable::new(t.range.iter().map(|x| T::of(inverse(*x)))),
            exponent: Exponent::new(t),
        });
        terms
    }

    /// Variables of ψ: one for each density pass and species.
    #[inline(always)]
    pub fn variables(&self) -> usize {
        self.passes.len() * self.species
    }

    /// The first soft repulsion; a term of no strength if there is none.
    #[inline(always)]
    pub fn first_soft(&self) -> &Soft<T> {
        &self.soft[0]
    }

    /// Further soft repulsions between the same species.
    #[inline(always)]
    pub fn other_soft(&self) -> &[Soft<T>] {
        &self.soft[1..]
    }

    /// Whether there are terms besides the first soft one, the thermostat and the densities.
    #[inline(always)]
    pub fn has_more(&self) -> bool {
        self.soft.len() > 1
            || !(self.linear.is_empty() && self.spline.is_empty() && self.scalar_fallback.is_empty())
    }

    /// Entries of the pair of species that a term acts on.
    fn entries(&self, [a, b]: [usize; 2]) -> [usize; 2] {
        [a * self.species + b, b * self.species + a]
    }

    fn add_pair(&mut self, term: &PairTerm) {
        let entries = self.entries(term.between);
        let size = self.species * self.species;
        let far = T::of(inverse(0.0));
        let zero = || SpeciesPairTable::of(size, T::default());
        match &term.potential {
            PairPotential::Soft(form) => {
                // The first term that has nothing for this pair of species yet.
                let free = self.soft.iter().position(|s| s.inverse_range[entries[0]] == far);
                let at = free.unwrap_or_else(|| {
                    self.soft.push(Soft::none(size));
                    self.soft.len() - 1
                });
                for p in entries {
                    self.soft[at].strength[p] = T::of(form.strength());
                    self.soft[at].inverse_range[p] = T::of(inverse(form.range()));
                    self.soft[at].energy[p] = T::of(0.5 * form.strength() * form.range());
                }
            }
            PairPotential::Spline(form) => {
                let free = self.spline.iter().position(|s| s.repulsion_inverse_range[entries[0]] == far);
                let at = free.unwrap_or_else(|| {
                    self.spline.push(Spline {
                        repulsion: zero(),
                        attraction: zero(),
                        repulsion_inverse_range: SpeciesPairTable::of(size, far),
                        attraction_inverse_range: SpeciesPairTable::of(size, far),
                    });
                    self.spline.len() - 1
                });
                self.spline[at].set(form, entries);
            }
            PairPotential::Expression(_) | PairPotential::Table(_) => self.scalar_fallback.push(term.clone()),
        }
    }
}

impl<T: Scalar> Soft<T> {
    /// Between no pair of species.
    fn none(size: usize) -> Soft<T> {
        let zero = || SpeciesPairTable::of(size, T::default());
        Soft {
            strength: zero(),
            inverse_range: SpeciesPairTable::of(size, T::of(inverse(0.0))),
            energy: zero(),
        }
    }
}

impl<T: Scalar> Spline<T> {
    fn set(&mut self, form: &SplineAttractive, entries: [usize; 2]) {
        for p in entries {
            self.repulsion[p] = T::of(form.repulsion());
            self.attraction[p] = T::of(form.attraction());
            self.repulsion_inverse_range[p] = T::of(inverse(form.repulsion_range()));
            self.attraction_inverse_range[p] = T::of(inverse(form.attraction_range()));
        }
    }
}

impl<T: Scalar> Pass<T> {
    fn new(kernel: &Kernel, force: &Kernel) -> Pass<T> {
        Pass {
            kernel: kernel.kind(),
            inverse_range: T::of(1.0 / kernel.range()),
            value: T::of(kernel.value_factor()),
            force_kernel: force.kind(),
            force_range: T::of(force.range()),
            force_inverse_range: T::of(1.0 / force.range()),
            force: T::of(-force.slope_factor()),
        }
    }
}
