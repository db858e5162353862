//! Any text is a model or an error, and a model makes an engine or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use psidpd_core::engine::Engine;
use psidpd_core::model::Model;

fuzz_target!(|text: &str| {
    if let Ok(model) = Model::parse("fuzz.toml", text)
        && let Ok(fluid) = model.at(1.0)
        && fluid.variables() <= 8
        && let Ok(engine) = Engine::new(&fluid)
    {
        let _ = engine.plan().to_string();
    }
});
