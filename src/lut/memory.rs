//! The memory that a bake needs, asked for before it is used.

use std::fs;
use std::hint::black_box;

use crate::lut::error::BakeError;
use crate::lut::quantity::Quantity;
use crate::lut::request::{Extent, Request};
use crate::lut::table::Depth;

/// Measured peaks: bytes for each material, and for each byte of the texture at hand (its texels,
/// their file and the buffer between the two).
const PER_MATERIAL: usize = 4 << 20;
const PER_TEXTURE: usize = 4;

/// Channels of a texel.
const CHANNELS: usize = 3;

/// Bytes that filling and encoding one texture of so many texels takes.
#[must_use]
pub fn of_texture(size: &[usize], depth: Depth) -> usize {
    let texels = size.iter().fold(CHANNELS, |bytes, n| bytes.saturating_mul(*n));
    texels.saturating_mul(PER_TEXTURE * depth.bytes())
}

/// Bytes that a bake of so many materials in so many rows takes at least: with a tolerance the sizes
/// of textures are not known before.
#[must_use]
pub fn of_bake(request: &Request, materials: usize, rows: usize) -> usize {
    let of_materials = materials.saturating_mul(PER_MATERIAL);
    let (Extent::Size(n), [depth, ..]) = (request.extent, request.depths.candidates()) else {
        return of_materials;
    };
    let textures = request.quantities.iter().map(|quantity| match quantity {
        // Each row is a texture of its own; all are kept until they are written.
        Quantity::Brdf3d => {
            let one = of_texture(&[n, n, n], *depth);
            one.saturating_add((one / PER_TEXTURE).saturating_mul(rows.saturating_sub(1)))
        }
        _ => of_texture(&[n, rows], *depth),
    });
    textures.fold(of_materials, usize::saturating_add)
}

/// Returns an error where so many bytes are more than this process can have.
///
/// # Errors
///
/// [`BakeError::Memory`] where the allocator refuses them, or where Linux has fewer to give.
pub fn check(needed: usize) -> Result<(), BakeError> {
    let mut trial: Vec<u8> = Vec::new();
    // The allocator knows limits that Linux does not report below, such as `ulimit -v`.
    let refused = trial.try_reserve_exact(needed).is_err();
    // Or the compiler takes out an allocation that nobody uses.
    black_box(&mut trial);
    let free = free();
    if refused || free.is_some_and(|free| free < needed) {
        return Err(BakeError::Memory { needed, free: free.filter(|free| *free < needed) });
    }
    Ok(())
}

/// Bytes that Linux can give without refusing other programs theirs: those of main memory and of
/// swap, within the container's limit; `None` on other systems.
fn free() -> Option<usize> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    // Not MemFree, which leaves out the caches that Linux gives back.
    let free = kibibytes(&text, "MemAvailable:")? + kibibytes(&text, "SwapFree:").unwrap_or(0);
    Some(free.saturating_mul(1024).min(left_in_container()))
}

/// Bytes below the limit of the container, which sees the memory of its host in /proc.
fn left_in_container() -> usize {
    // Without a limit `memory.max` says `max`.
    let limit = cgroup("memory.max").unwrap_or(usize::MAX);
    let used = cgroup("memory.current").unwrap_or(0);
    // Cached files are counted as used, and given back when needed.
    limit.saturating_sub(used.saturating_sub(cached_files()))
}

/// Bytes of cached files in this control group.
fn cached_files() -> usize {
    let text = fs::read_to_string("/sys/fs/cgroup/memory.stat").unwrap_or_default();
    let file = text.lines().find_map(|line| line.strip_prefix("file "));
    file.and_then(|bytes| bytes.trim().parse().ok()).unwrap_or(0)
}

/// A number of bytes of this control group.
fn cgroup(file: &str) -> Option<usize> {
    fs::read_to_string(format!("/sys/fs/cgroup/{file}")).ok()?.trim().parse().ok()
}

/// A field of /proc/meminfo \[KiB\].
fn kibibytes(text: &str, field: &str) -> Option<usize> {
    let line = text.lines().find_map(|line| line.strip_prefix(field))?;
    line.trim().strip_suffix("kB")?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_machine_has_is_refused_and_a_little_is_not() {
        assert!(matches!(check(usize::MAX / 2), Err(BakeError::Memory { .. })));
        assert_eq!(check(1 << 20), Ok(()));
        assert_eq!(of_texture(&[512, 512, 512], Depth::Half), 4 * 805_306_368);
        assert_eq!(of_texture(&[usize::MAX, 2], Depth::Float), usize::MAX);
    }
}
