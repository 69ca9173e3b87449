//! A hash by which a file that was written is told from one that was edited since.

/// FNV-1a of 64 bits, in hexadecimal: it guards against mistakes, not against forgers. White space
/// at the end is padding.
#[must_use]
pub fn fingerprint(text: &str) -> String {
    // The offset basis and the prime of FNV.
    let hash = text.trim_end().bytes().fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}
