//! What several tests share.

#![allow(dead_code, reason = "each test crate uses its own part")]

pub mod chi2;
pub mod double_exponential;
pub mod materials;
pub mod network;
