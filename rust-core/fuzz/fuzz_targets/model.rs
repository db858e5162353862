//! Any text is a model or an error, and a model makes an engine or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use psidpd_core::engine::Plan;
use psidpd_core::model::Model;

fuzz_target!(|text: &str| {
    if let Ok(model) = Model::parse("fuzz.toml", text)
        && let Ok(fluid) = model.at(1.0)
        && fluid.variables() <= 8
        && let Ok(plan) = Plan::new(&fluid)
    {
        let _ = plan.to_string();
    }
});
