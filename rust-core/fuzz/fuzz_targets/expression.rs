//! Any text is a formula or an error; a formula has a value and a derivative, and evaluates the same
//! one point at a time and expanded.
#![no_main]

use libfuzzer_sys::fuzz_target;
use psidpd_core::model::expression::{Ast, Expansion, Formula, Variables};

fuzz_target!(|text: &str| {
    let Ok(ast) = Ast::parse(text) else { return };
    let variables = Variables { count: 2, names: [("n".into(), vec![0, 1]), ("m".into(), vec![1])].into() };
    let constants = [("kT".into(), 1.0), ("a".into(), 0.3)].into();
    let Ok(formula) = Formula::compile(&ast, &constants, &variables) else { return };
    let value = formula.value(&[0.7, 1.3]);
    if let Ok(slope) = formula.derivative(0) {
        slope.value(&[0.7, 1.3]);
        let _ = slope.with_names(&["n", "m"]).to_string();
    }
    let expanded = Expansion::default().coefficients(&formula, &[0.7, 1.3], &[1])[0];
    let both = value.abs() < 1e100 && expanded.is_finite();
    assert!(!both || (value - expanded).abs() <= 1e-6 * value.abs().max(1.0), "{value} {expanded}");
});
