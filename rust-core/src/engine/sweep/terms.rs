//! The plan of a fluid as tables of numbers in the precision of the pairs.

use crate::engine::plan::Plan;
use crate::model::PairTerm;
use crate::model::kernel::Kernel;
use crate::model::pair::{PairForm, PairPotential, SplineAttractive};
use psidpd_passes::ground::species_pairs::SpeciesPairTable;
use psidpd_passes::ground::terms::{Linear, Pass, Soft, Spline, Terms, ThermostatTables};
use psidpd_passes::simd::Scalar;

/// The tables of all terms of a plan.
pub fn terms<T: Scalar>(plan: &Plan) -> Terms<T> {
    let count = plan.species.len();
    let mut terms = Terms { species: count, ..Terms::default() };
    for term in &plan.pairs {
        add_pair(&mut terms, term);
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
        terms.soft.push(no_soft(count * count));
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
        .map(|d| {
            let density = &plan.densities[*d];
            pass(&density.kernel, &density.force_kernel)
        })
        .collect();
    terms.full_cache = plan.caches_all_pairs();
    terms.thermostat = plan.thermostat.as_ref().map(|t| ThermostatTables {
        gamma: SpeciesPairTable::new(t.gamma.iter().map(|x| T::of(*x))),
        sigma: SpeciesPairTable::new(t.sigma.iter().map(|x| T::of(*x))),
        inverse_range: SpeciesPairTable::new(t.range.iter().map(|x| T::of(inverse(*x)))),
        exponent: t.exponent_of_weights(),
    });
    terms
}

/// The reciprocal of a range. A range of zero gives a number so large that every pair is beyond the range.
fn inverse(range: f64) -> f64 {
    if range > 0.0 { 1.0 / range } else { f64::from(f32::MAX) }
}

fn pass<T: Scalar>(kernel: &Kernel, force: &Kernel) -> Pass<T> {
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

/// A soft repulsion of strength 0 for all pairs of species.
fn no_soft<T: Scalar>(size: usize) -> Soft<T> {
    let zero = || SpeciesPairTable::of(size, T::default());
    Soft { strength: zero(), inverse_range: SpeciesPairTable::of(size, T::of(inverse(0.0))), energy: zero() }
}

/// Adds a potential to the first table of its form that has no entry for this pair of species.
fn add_pair<T: Scalar>(terms: &mut Terms<T>, term: &PairTerm) {
    let [a, b] = term.between;
    let entries = [a * terms.species + b, b * terms.species + a];
    let size = terms.species * terms.species;
    let far = T::of(inverse(0.0));
    match &term.potential {
        PairPotential::Soft(form) => {
            let free = terms.soft.iter().position(|s| s.inverse_range[entries[0]] == far);
            let at = free.unwrap_or_else(|| {
                terms.soft.push(no_soft(size));
                terms.soft.len() - 1
            });
            for p in entries {
                terms.soft[at].strength[p] = T::of(form.strength);
                terms.soft[at].inverse_range[p] = T::of(inverse(form.range()));
                terms.soft[at].energy[p] = T::of(0.5 * form.strength * form.range());
            }
        }
        PairPotential::Spline(form) => {
            let free = terms.spline.iter().position(|s| s.repulsion_inverse_range[entries[0]] == far);
            let at = free.unwrap_or_else(|| {
                let zero = || SpeciesPairTable::of(size, T::default());
                terms.spline.push(Spline {
                    repulsion: zero(),
                    attraction: zero(),
                    repulsion_inverse_range: SpeciesPairTable::of(size, far),
                    attraction_inverse_range: SpeciesPairTable::of(size, far),
                });
                terms.spline.len() - 1
            });
            set_spline(&mut terms.spline[at], form, entries);
        }
        // The other forms have no vector loops: `PairForm::block` computes the pairs of a batch.
        _ => terms.scalar_fallback.push(term.clone()),
    }
}

fn set_spline<T: Scalar>(table: &mut Spline<T>, form: &SplineAttractive, entries: [usize; 2]) {
    for p in entries {
        table.repulsion[p] = T::of(form.repulsion);
        table.attraction[p] = T::of(form.attraction);
        table.repulsion_inverse_range[p] = T::of(inverse(form.repulsion_range));
        table.attraction_inverse_range[p] = T::of(inverse(form.attraction_range));
    }
}
