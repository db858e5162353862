//! The checks of each reader of the project with arbitrary input: the result is an error or an object that can be used.
//! Fuzzers call these functions (`libfuzzer/`), and so does a test, for a bounded time.

mod bytes;
mod c_api;
mod checkpoint;
mod coefficients;
mod files;
mod report;
mod scene;

pub use c_api::c_api;
pub use checkpoint::{checkpoint, checkpoint_of_a_run};
pub use coefficients::coefficients;
pub use files::{data, dump};
pub use report::report;
pub use scene::scene;

use psidpd_core::engine::Plan;
use psidpd_core::model::Model;
use psidpd_core::model::expression::{Ast, Expansion, Formula, Variables};

/// Any text is a model or an error, and a model makes a plan or an error.
pub fn model(text: &str) {
    if let Ok(model) = Model::parse("fuzz.toml", text)
        && let Ok(fluid) = model.at(1.0)
        && fluid.variables() <= 8
        && let Ok(plan) = Plan::new(&fluid)
    {
        assert!(!plan.to_string().is_empty());
    }
}

/// Any text is a formula or an error. A formula has a value and a derivative, and gives the same results one point at a
/// time and expanded.
pub fn expression(text: &str) {
    let Ok(ast) = Ast::parse(text) else { return };
    let variables = Variables { count: 2, names: [("n".into(), vec![0, 1]), ("m".into(), vec![1])].into() };
    let constants = [("kT".into(), 1.0), ("a".into(), 0.3)].into();
    let Ok(formula) = Formula::compile(&ast, &constants, &variables) else { return };
    let value = formula.value(&[0.7, 1.3]);
    if let Ok(slope) = formula.derivative(0) {
        slope.value(&[0.7, 1.3]);
        assert!(!slope.with_names(&["n", "m"]).to_string().is_empty());
    }
    let expanded = Expansion::default().coefficients(&formula, &[0.7, 1.3], &[1])[0];
    let both = value.abs() < 1e100 && expanded.is_finite();
    // Large numbers that cancel leave their rounding errors.
    let error = 1e-6 * value.abs().max(1.0) + 1e-12 * formula.greatest(&[0.7, 1.3]);
    assert!(!both || (value - expanded).abs() <= error, "{value} {expanded}: {text}");
}
