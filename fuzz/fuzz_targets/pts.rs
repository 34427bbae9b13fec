#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| srrf_fuzz::check(Some("pts"), bytes));
