#![no_main]
mod targets;

libfuzzer_sys::fuzz_target!(|content: &[u8]| targets::points(content));
