//! OBJ in: [tobj] reads the geometry, this module what surrounds it.
//!
//! * A mesh per `o` or `g` name (the latest counts), a primitive per material in it.
//! * Polygons become triangle fans; lines, points and free-form curves are left out.
//! * Smoothing groups matter where the file has no normals: `s N` smooths within the group, `s off`
//!   is flat, and a file without any `s` is smooth throughout. Normals are weighted by area.
//! * Vertex colours are sRGB in the file and linear in glTF; texture v is turned upside down.
//! * Material libraries are looked for in the file's folder. A missing one is a warning: its
//!   materials keep their names and are plain.
//! * Materials that no face uses are left out.

mod lines;
mod mtl;
mod normals;

use std::{
    collections::HashMap,
    fs::File,
    io::BufReader,
    path::{Path, PathBuf},
};

use palette::Srgb;
use tobj::{LoadError, LoadOptions, Material, Model};

use crate::scene::{
    Scene, SceneError, Source,
    build::{self, Surface},
};
use lines::{Group, Lines};
use normals::Part;

// glTF has one index for all attributes of a vertex, and no polygons.
const OPTIONS: LoadOptions =
    LoadOptions { single_index: true, triangulate: true, ignore_points: true, ignore_lines: true };

/// Reads an OBJ and the material libraries it names. `progress` is told the bytes read so far.
pub(super) fn open(
    path: &Path,
    folder: PathBuf,
    progress: &mut dyn FnMut(u64),
) -> Result<Scene, SceneError> {
    let mut lines = Lines::new(BufReader::with_capacity(1 << 16, File::open(path)?), progress);
    // `Lines` names a library per material, in the order of its own list, so that the indices of
    // tobj are those of the list. The libraries themselves are read by `mtl`.
    let loaded = tobj::load_obj_buf(&mut lines, &OPTIONS, |index| {
        let name = index.display().to_string();
        Ok((vec![Material { name: name.clone(), ..Material::default() }], [(name, 0)].into()))
    });
    let line = lines.line();
    let Lines { groups, materials, libraries, mut warnings, error, .. } = lines;
    let (models, _) = loaded.map_err(|problem| SceneError::Obj {
        line,
        reason: match (problem, error) {
            // `Lines` refuses a line by failing to read, and keeps the reason.
            (LoadError::ReadError, Some(reason)) => reason,
            _ => problem.to_string(),
        },
    })?;
    let parts = parts(models, &groups)?;
    let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into());
    let meshes = meshes(normals::complete(parts), &groups, &stem);
    let document = mtl::document(&materials, &libraries, &folder, &mut warnings)?;
    let mut scene = build::scene(meshes, document, Source::Built(Some(folder)))?;
    scene.warnings = warnings;
    Ok(scene)
}

/// The models as surfaces, each with the index of its group.
fn parts(models: Vec<Model>, groups: &[Group]) -> Result<Vec<Part>, SceneError> {
    let drawn = models.into_iter().filter(|model| !model.mesh.indices.is_empty());
    drawn
        .map(|Model { mesh, name }| {
            // `Lines` has replaced every name by its index.
            let group: usize = name.parse().unwrap_or(0);
            let positions = triples(mesh.positions);
            let count = positions.len();
            // A position cannot be made up, and JSON could not hold the bounds.
            if !positions.as_flattened().iter().all(|x| x.is_finite()) {
                let name = groups.get(group).map_or("", |group| &group.name);
                return Err(SceneError::Invalid(name.into(), "a position is not finite".into()));
            }
            let surface = Surface {
                // tobj leaves an array empty where the faces of a group lack the attribute.
                normals: Some(triples(mesh.normals))
                    .filter(|n| n.len() == count)
                    .unwrap_or_default(),
                texcoords: Some(texcoords(mesh.texcoords))
                    .filter(|t| t.len() == count)
                    .unwrap_or_default(),
                colors: Some(colors(&mesh.vertex_color))
                    .filter(|c| c.len() == count)
                    .unwrap_or_default(),
                positions,
                indices: mesh.indices,
                material: mesh.material_id,
            };
            let shading = groups.get(group).map(|group| group.shading).unwrap_or_default();
            Ok(Part { group, shading, surface })
        })
        .collect()
}

fn triples(flat: Vec<f32>) -> Vec<[f32; 3]> {
    // In place where the capacity is a multiple of three, else copied.
    bytemuck::allocation::try_cast_vec(flat)
        .unwrap_or_else(|(_, flat)| flat.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect())
}

/// v runs upwards in OBJ, downwards in glTF. Numbers that are not finite become 0.
fn texcoords(flat: Vec<f32>) -> Vec<[f32; 2]> {
    flat.chunks_exact(2).map(|uv| [finite_or(uv[0], 0.0), finite_or(1.0 - uv[1], 0.0)]).collect()
}

fn finite_or(x: f32, default: f32) -> f32 {
    if x.is_finite() { x } else { default }
}

fn colors(flat: &[f32]) -> Vec<[f32; 3]> {
    let (encoded, _) = flat.as_chunks::<3>();
    // White in place of a number that is not finite: it leaves the base colour as it is.
    let clean = encoded.iter().map(|rgb| rgb.map(|c| finite_or(c, 1.0).clamp(0.0, 1.0)));
    clean.map(|rgb| Srgb::from(rgb).into_linear::<f32>().into()).collect()
}

/// One mesh per group name, one surface per material and set of attributes in it.
fn meshes(parts: Vec<Part>, groups: &[Group], stem: &str) -> Vec<build::Mesh> {
    let mut meshes: Vec<build::Mesh> = Vec::new();
    let mut by_name = HashMap::new();
    // The surface of each kind that still has room.
    let mut by_kind = HashMap::new();
    for Part { group, surface, .. } in parts {
        let name = groups.get(group).map_or("", |group| &*group.name);
        let name = if name.is_empty() { stem } else { name };
        let mesh = *by_name.entry(name.to_owned()).or_insert_with(|| {
            meshes.push(build::Mesh { name: name.to_owned(), surfaces: Vec::new() });
            meshes.len() - 1
        });
        let surfaces = &mut meshes[mesh].surfaces;
        let kind = (surface.material, surface.texcoords.is_empty(), surface.colors.is_empty());
        match by_kind.get(&(mesh, kind)) {
            Some(&at) if fits(&surfaces[at], &surface) => append(&mut surfaces[at], surface),
            _ => {
                by_kind.insert((mesh, kind), surfaces.len());
                surfaces.push(surface);
            }
        }
    }
    meshes
}

/// Returns whether the indices of both together fit 32 bits.
fn fits(a: &Surface, b: &Surface) -> bool {
    // The largest index is below u32::MAX, which glTF forbids.
    a.positions.len() + b.positions.len() < u32::MAX as usize
}

fn append(surface: &mut Surface, more: Surface) {
    let first = surface.positions.len() as u32;
    surface.positions.extend(more.positions);
    surface.normals.extend(more.normals);
    surface.texcoords.extend(more.texcoords);
    surface.colors.extend(more.colors);
    surface.indices.extend(more.indices.into_iter().map(|index| first + index));
}
