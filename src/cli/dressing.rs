//! From materials to what a scene takes for them: the best glTF fit, the parameters, the textures.

use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::cli::failure::Failure;
use crate::encode::exr;
use crate::encode::manifest::{Format, Location, MaterialEntry, TextureEntry};
use crate::fit;
use crate::lut::{self, Baked, Placed, Request, Table};
use crate::material::Material;
use crate::scene::{Attachment, Clearcoat, Replacement, Specular};

/// Version of the extension's body and of `extras.sgd`.
const VERSION: u32 = 1;

/// The replacement for each material; their textures are shared.
///
/// # Errors
///
/// What the bake refuses.
pub fn replacements(
    materials: &[Material],
    request: &Request,
) -> Result<Vec<Replacement>, Failure> {
    if materials.is_empty() {
        return Ok(Vec::new());
    }
    let baked = lut::bake(&materials.iter().collect::<Vec<_>>(), request)?;
    let textures = attachments(&baked)?;
    let placed = materials.par_iter().zip(&baked.placed);
    placed.map(|(material, placed)| replacement(material, placed, &textures)).collect()
}

/// A baked material's entry in the manifest, with its fits.
pub fn entry(material: &Material, placed: &Placed) -> MaterialEntry {
    MaterialEntry {
        gltf: Some(fit::gltf::fit(material).material),
        lobes: Some(fit::lobes::for_picture(material)),
        ..MaterialEntry::new(placed)
    }
}

fn replacement(
    material: &Material,
    placed: &Placed,
    textures: &[Attachment],
) -> Result<Replacement, Failure> {
    let best = fit::gltf::fit(material).material;
    let specular = Specular { factor: best.specular_factor, color: best.specular_color };
    let coat = best.clearcoat.zip(best.clearcoat_roughness);
    let entry = MaterialEntry::new(placed);
    let lobes = fit::lobes::for_picture(material);
    let extension = json!({
        "version": VERSION,
        "name": entry.name,
        "channels": value(&entry.channels)?,
        "ndf_peak": entry.ndf_peak,
        "lobes": value(&lobes)?,
        "row": entry.row,
    });
    let extras =
        json!({"version": VERSION, "name": entry.name, "channels": value(&entry.channels)?});
    Ok(Replacement {
        name: entry.name,
        base_color: best.base_color,
        metallic: best.metallic,
        roughness: best.roughness,
        specular: Some(specular).filter(|specular| *specular != Specular::DEFAULT),
        clearcoat: coat.map(|(factor, roughness)| Clearcoat { factor, roughness }),
        extension: object(extension),
        extras,
        textures: if entry.row.is_some() { textures.to_vec() } else { Vec::new() },
    })
}

/// The baked textures as EXR files.
fn attachments(baked: &Baked) -> Result<Vec<Attachment>, Failure> {
    let attachment = |table: &Table| {
        let file_name = format!("{}.exr", table.quantity.name());
        let bytes: Arc<[u8]> = exr::encode(table, &file_name).into();
        let file = Location::File { file: file_name.clone() };
        let mut entry = object(value(&TextureEntry::new(table, Format::Exr, file))?);
        entry.shift_remove("file");
        Ok(Attachment { entry, file_name, mime: exr::MIME_TYPE, bytes })
    };
    baked.tables.iter().map(attachment).collect()
}

fn value(item: &impl Serialize) -> Result<Value, Failure> {
    serde_json::to_value(item).map_err(Failure::job)
}

fn object(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(object) => object,
        _ => Map::new(),
    }
}
