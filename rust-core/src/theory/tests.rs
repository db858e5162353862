mod interface;
mod limit;
mod mean_field;
mod mixtures;
mod one_component;
mod stability;

use super::radial::integral;
use super::search::spaced;
use super::*;
use crate::model::kernel::{Kernel, KernelKind};
use crate::model::{ForceLaw, Model, WarrenPair, warren_ab};
use std::f64::consts::PI;

fn model(text: &str) -> Model {
    Model::parse("test.toml", text).unwrap()
}

fn theory(model: &Model, kt: f64) -> MeanField {
    MeanField::new(&model.at(kt).unwrap()).unwrap()
}

#[track_caller]
fn close(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "found {found}, expected {expected}");
}

/// Pagonabarraga–Frenkel's van der Waals fluid.
fn van_der_waals(dimensions: usize, a: f64, b: f64, alpha3: f64) -> Model {
    model(&format!(
        "title = 'vdW'\ndimensions = {dimensions}\nspecies = ['F']\n\
         [parameters]\na = {a:?}\nb = {b:?}\nalpha3 = {alpha3:?}\n\
         [density.n]\nkernel = 'quadratic'\nrange = 1\n\
         [excess_free_energy]\nF = '-kT*ln(1 - b*n) - a*n - 0.5*alpha3*a*b*n^2'\n"
    ))
}

/// Pagonabarraga–Frenkel's binary mixture.
fn mixture(dimensions: usize, lambda: f64, lambda_a: f64, lambda_b: f64) -> Model {
    model(&format!(
        "title = 'mixture'\ndimensions = {dimensions}\nspecies = ['A', 'B']\n\
         [density.n]\nkernel = 'quadratic'\nrange = 1\n\
         [excess_free_energy]\nA = '{lambda:?}*n_B + {lambda_a:?}*n_A'\nB = '{lambda:?}*n_A + {lambda_b:?}*n_B'\n"
    ))
}

/// Trofimov et al.'s compressible Huggins fluid.
fn huggins(epsilon: f64) -> Model {
    let psi = |own: &str, other: &str| {
        format!(
            "kT/(n0*n)*(1-n0*Nm*n)*ln(1-n0*Nm*n) + Nm*kT*ln(n0*Nm*n_{own}) \
             - Nm^2*n0*(e*n_{own} + e/4*n_{other}) - kT*ln(n_{own})"
        )
    };
    model(&format!(
        "title = 'CHF'\nspecies = ['A', 'B']\n[parameters]\nn0 = 0.001\nNm = 50\ne = {epsilon:?}\n\
         [density.n]\nkernel = 'quadratic'\nrange = 1\n\
         [excess_free_energy]\nA = '{}'\nB = '{}'\n",
        psi("A", "B"),
        psi("B", "A"),
    ))
}

fn warren(a: f64, b: f64, dimensions: usize) -> Model {
    let pair = WarrenPair { a, b, gamma: 18.0, rc: 1.0, rd: 0.75, weight: None };
    warren_ab(&["F".into()], &[Some(pair)], dimensions, ForceLaw::Conservative).unwrap()
}

/// Wang–Chen's spline potential `first W(0.8) − second W(1.0)`.
fn spline(first: f64, second: f64) -> Model {
    model(&format!(
        "title = 'spline'\nspecies = ['F']\n[[pair]]\nbetween = ['F', 'F']\nform = 'spline'\n\
         strength = 1\nA = {first:?}\nB = {second:?}\nrange_A = 0.8\nrange_B = 1.0\n"
    ))
}
