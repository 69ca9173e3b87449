//! Normals for surfaces that have none, and unit length for those that have.

use std::collections::HashMap;

use glam::Vec3;

use crate::scene::build::Surface;
use crate::scene::obj::lines::Shading;

/// A surface before it is merged with others of its group.
#[derive(Debug)]
pub(super) struct Part {
    pub group: usize,
    pub shading: Shading,
    pub surface: Surface,
}

type Corner = (Shading, [u32; 3]);

/// Every part with unit normals. Missing ones are the area-weighted mean over the faces that meet
/// at a position and share a smoothing group, across materials; or the face's own where flat.
pub(super) fn complete(parts: Vec<Part>) -> Vec<Part> {
    // All sums before any normal: the faces at a position may lie in several parts.
    let mut sums: HashMap<Corner, Vec3> = HashMap::new();
    for part in parts.iter().filter(|part| part.shading != Shading::Flat && missing(part)) {
        for triangle in part.surface.indices.chunks_exact(3) {
            let corners = [0, 1, 2].map(|i| part.surface.positions[triangle[i] as usize]);
            let normal = face_normal(corners);
            for position in corners {
                *sums.entry((part.shading, key(position))).or_default() += normal;
            }
        }
    }
    parts.into_iter().map(|part| with_normals(part, &sums)).collect()
}

fn missing(part: &Part) -> bool {
    part.surface.normals.is_empty()
}

fn with_normals(mut part: Part, sums: &HashMap<Corner, Vec3>) -> Part {
    let smooth = part.shading != Shading::Flat;
    match (missing(&part), smooth) {
        (false, _) => {}
        (true, false) => part.surface = flat(&part.surface),
        (true, true) => {
            let corners = part.surface.positions.iter().map(|p| (part.shading, key(*p)));
            // Every position of a part belongs to a face, so the default is never taken.
            let sums = corners.map(|corner| sums.get(&corner).copied().unwrap_or_default());
            part.surface.normals = sums.map(Into::into).collect();
        }
    }
    for normal in &mut part.surface.normals {
        // Faces without area, or opposite ones, sum to 0; glTF wants unit length even then.
        *normal = Vec3::from(*normal).try_normalize().unwrap_or(Vec3::Z).into();
    }
    part
}

/// The surface with three vertices of its own for every triangle.
fn flat(surface: &Surface) -> Surface {
    let indices = &surface.indices[..surface.indices.len() / 3 * 3];
    let positions: Vec<_> = indices.iter().map(|i| surface.positions[*i as usize]).collect();
    let normals = positions
        .chunks_exact(3)
        .flat_map(|p| [face_normal([p[0], p[1], p[2]]).into(); 3])
        .collect();
    Surface {
        normals,
        texcoords: picked(&surface.texcoords, indices),
        colors: picked(&surface.colors, indices),
        indices: (0..positions.len() as u32).collect(),
        positions,
        material: surface.material,
    }
}

/// The value at each index; none where a surface has none at all.
fn picked<T: Copy>(values: &[T], indices: &[u32]) -> Vec<T> {
    match values {
        [] => Vec::new(),
        _ => indices.iter().map(|i| values[*i as usize]).collect(),
    }
}

/// (b − a) × (c − a): along the normal, as long as twice the area.
fn face_normal([a, b, c]: [[f32; 3]; 3]) -> Vec3 {
    let [a, b, c] = [a, b, c].map(Vec3::from);
    (b - a).cross(c - a)
}

/// Equal positions have equal keys: −0 counts as 0.
fn key(position: [f32; 3]) -> [u32; 3] {
    // −0 + 0 is 0, and positions are finite, so equal bits are equal positions.
    position.map(|x| (x + 0.0).to_bits())
}
