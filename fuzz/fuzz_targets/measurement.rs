#![no_main]
#[path = "../targets.rs"]
mod targets;
#[path = "../../tests/support/asset.rs"]
mod support;
use support::asset;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::measurement(bytes));
