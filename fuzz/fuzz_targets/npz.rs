#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    hydro_fuzz::npz::read(bytes);
});
