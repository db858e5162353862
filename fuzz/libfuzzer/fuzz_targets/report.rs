#![no_main]

libfuzzer_sys::fuzz_target!(|input: &str| psidpd_fuzz_inputs::report(input));
