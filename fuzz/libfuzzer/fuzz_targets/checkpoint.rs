#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    psidpd_fuzz_inputs::checkpoint(input);
});
