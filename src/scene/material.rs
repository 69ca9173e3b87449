//! One glTF material is replaced: what describes its reflection goes, the rest stays.

use std::collections::HashMap;

use serde_json::{Value, json};

use crate::asset::{Asset, EXTENSION, Extension, Extras, MaterialEntry};
use crate::encode::TextureEntry;
use crate::scene::text::{Pieces, quote};

pub(super) const SPECULAR: &str = "KHR_materials_specular";
pub(super) const CLEARCOAT: &str = "KHR_materials_clearcoat";

/// Material extensions that describe reflection or transmission themselves: with the fit they
/// would bend it, so they are taken out. `KHR_materials_ior` is among them because the fit's F0 is
/// meant at the default index 1.5. Emission, levels of detail and all unknown extensions stay.
pub(super) const REFLECTION: [&str; 14] = [
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_subsurface",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    EXTENSION,
];

/// The extensions that `asset` puts into a material.
pub(super) fn extensions_of(asset: &Asset) -> impl Iterator<Item = &'static str> {
    let fit = &asset.gltf;
    let specular = (fit.specular_factor, fit.specular_color) != DEFAULT_SPECULAR;
    let coat = fit.clearcoat.is_some() && fit.clearcoat_roughness.is_some();
    // At the defaults KHR_materials_specular would say nothing.
    [Some(EXTENSION), specular.then_some(SPECULAR), coat.then_some(CLEARCOAT)].into_iter().flatten()
}

/// The factor and colour that glTF takes where [`SPECULAR`] is absent.
const DEFAULT_SPECULAR: (f64, [f64; 3]) = (1.0, [1.0; 3]);

/// The text of the material `raw` with `asset` in it; `textures` say where its textures are, and
/// `document` is the mark of an export.
pub(super) fn replace(
    raw: &str,
    asset: &Asset,
    textures: Vec<TextureEntry>,
    document: Option<String>,
) -> serde_json::Result<String> {
    let mut material = Pieces::object(raw)?;
    if material.get("name").is_none() {
        material.set("name", quote(&asset.material.parameters.name));
    }
    let reflection = metallic_roughness(material.get("pbrMetallicRoughness"), asset)?;
    material.set("pbrMetallicRoughness", reflection);
    let extensions = extensions(material.get("extensions"), asset, textures, document)?;
    material.set("extensions", extensions);
    if let Some(extras) = extras(material.get("extras"), asset)? {
        material.set("extras", extras);
    }
    Ok(material.to_text())
}

/// The text of the material `raw` with the extension alone set to that of `entry`.
pub(super) fn restore(
    raw: &str,
    entry: &MaterialEntry,
    textures: Vec<TextureEntry>,
    document: Option<String>,
) -> serde_json::Result<String> {
    let mut material = Pieces::object(raw)?;
    let mut extensions = Pieces::object(material.get("extensions").unwrap_or("{}"))?;
    // A key may stand more than once, and `set` changes only the last.
    extensions.remove(EXTENSION);
    extensions.set(EXTENSION, body(entry, textures, document)?);
    let extensions = extensions.to_text();
    material.set("extensions", extensions);
    Ok(material.to_text())
}

/// The addresses of the textures in the extension's body.
pub(super) fn lookup_uris(body: &Value) -> impl Iterator<Item = &str> {
    let textures = body["textures"].as_array().into_iter().flatten();
    textures.filter_map(|texture| texture["uri"].as_str())
}

/// The text of the material `raw`, its lookup textures at these addresses in these buffer views,
/// of these media types.
pub(super) fn embedded(
    raw: &str,
    views: &HashMap<&str, (usize, &str)>,
) -> serde_json::Result<String> {
    let mut material = Pieces::object(raw)?;
    // `original` borrows from `raw`, so that the pieces can be changed from the inside out.
    let mut extensions = Pieces::object(material.original("extensions").unwrap_or("{}"))?;
    let mut body = Pieces::object(extensions.original(EXTENSION).unwrap_or("{}"))?;
    let mut textures = Pieces::array(body.original("textures").unwrap_or("[]"))?;
    for index in 0..textures.len() {
        let raw = textures.item(index).unwrap_or("{}").to_owned();
        let mut texture = Pieces::object(&raw)?;
        let uri = texture.get("uri").and_then(|raw| serde_json::from_str::<String>(raw).ok());
        let Some((view, mime)) = uri.and_then(|uri| views.get(&*uri)) else { continue };
        texture.remove("uri");
        texture.set("bufferView", view.to_string());
        texture.set("mimeType", quote(mime));
        textures.replace(index, texture.to_text());
    }
    body.set("textures", textures.to_text());
    extensions.set(EXTENSION, body.to_text());
    material.set("extensions", extensions.to_text());
    Ok(material.to_text())
}

/// The text of the material `raw` without [`EXTENSION`].
pub(super) fn without_extension(raw: &str) -> serde_json::Result<String> {
    let mut material = Pieces::object(raw)?;
    let extensions = material.get("extensions").map(str::to_owned);
    if let Some(extensions) = extensions.filter(|extensions| extensions.starts_with('{')) {
        let mut extensions = Pieces::object(&extensions)?;
        extensions.remove(EXTENSION);
        material.set("extensions", extensions.to_text());
    }
    Ok(material.to_text())
}

/// Warnings about parts of the material `raw` that its replacement loses.
pub(super) fn losses(raw: &str) -> serde_json::Result<Vec<&'static str>> {
    let material = Pieces::object(raw)?;
    let reflection = Pieces::object(material.get("pbrMetallicRoughness").unwrap_or("{}"))?;
    // Values are JSON text, so a string has its quotes.
    let transparent = material.get("alphaMode").is_some_and(|mode| mode != "\"OPAQUE\"");
    let cut_out = transparent && reflection.get("baseColorTexture").is_some();
    let no_room = material.get("extras").is_some_and(|extras| !extras.starts_with('{'));
    let losses = [
        cut_out.then_some("its alpha came from the base colour texture, which goes"),
        no_room.then_some("its extras are not an object, so extras.sgd is left out"),
    ];
    Ok(losses.into_iter().flatten().collect())
}

/// Base colour, metallic and roughness from the fit; alpha stays.
fn metallic_roughness(raw: Option<&str>, asset: &Asset) -> serde_json::Result<String> {
    let fit = &asset.gltf;
    let mut reflection = Pieces::object(raw.unwrap_or("{}"))?;
    let alpha = match reflection.get("baseColorFactor") {
        Some(factor) => Pieces::array(factor)?.values().nth(3).map(str::to_owned),
        None => None,
    };
    let [r, g, b] = fit.base_color;
    let alpha = alpha.as_deref().unwrap_or("1");
    // `{:?}` writes the shortest digits that read back as the same number.
    reflection.set("baseColorFactor", format!("[{r:?},{g:?},{b:?},{alpha}]"));
    reflection.set("metallicFactor", json!(fit.metallic).to_string());
    reflection.set("roughnessFactor", json!(fit.roughness).to_string());
    reflection.remove("baseColorTexture");
    reflection.remove("metallicRoughnessTexture");
    Ok(reflection.to_text())
}

fn extensions(
    raw: Option<&str>,
    asset: &Asset,
    textures: Vec<TextureEntry>,
    document: Option<String>,
) -> serde_json::Result<String> {
    let fit = &asset.gltf;
    let mut extensions = Pieces::object(raw.unwrap_or("{}"))?;
    // Those that the fit sets below go as well: the old ones may hold textures.
    for name in REFLECTION {
        extensions.remove(name);
    }
    for name in extensions_of(asset) {
        let body = match name {
            SPECULAR => json!({
                "specularFactor": fit.specular_factor,
                "specularColorFactor": fit.specular_color,
            })
            .to_string(),
            CLEARCOAT => json!({
                "clearcoatFactor": fit.clearcoat,
                "clearcoatRoughnessFactor": fit.clearcoat_roughness,
            })
            .to_string(),
            // The extension itself follows, with its textures.
            _ => continue,
        };
        extensions.set(name, body);
    }
    extensions.set(EXTENSION, body(&asset.material, textures, document)?);
    Ok(extensions.to_text())
}

/// The text of the extension's body.
fn body(
    material: &MaterialEntry,
    textures: Vec<TextureEntry>,
    document: Option<String>,
) -> serde_json::Result<String> {
    let mut body = Extension::new(material, textures);
    body.document = document;
    serde_json::to_string(&body)
}

/// `extras` with `sgd` in it; `None` where `extras` is not an object.
fn extras(raw: Option<&str>, asset: &Asset) -> serde_json::Result<Option<String>> {
    let raw = raw.unwrap_or("{}");
    if !raw.starts_with('{') {
        return Ok(None);
    }
    let mut extras = Pieces::object(raw)?;
    extras.set("sgd", serde_json::to_string(&Extras::new(&asset.material))?);
    Ok(Some(extras.to_text()))
}
