#![no_main]
#[path = "../targets.rs"]
mod targets;
#[path = "../../tests/support/replacement.rs"]
mod support;
use support::replacement;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::measurement(bytes));
