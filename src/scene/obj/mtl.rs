//! Material libraries (MTL) become glTF materials.

use std::{collections::HashMap, fs, ops::RangeInclusive, path::Path};

use serde_json::{Map, Value, json};
use tobj::Material;

use crate::scene::{
    SceneError,
    build::Parts,
    conversion::mime,
    resource::{Resource, percent_encode},
    size::{self, Text},
};

/// `materials`, and the `images` and `textures` they need, for the material names in use.
pub(super) fn document(
    names: &[String],
    libraries: &[String],
    folder: &Path,
    warnings: &mut Vec<String>,
) -> Result<Parts, SceneError> {
    let mut known = HashMap::new();
    for library in libraries {
        for material in load(library, folder, warnings)? {
            known.insert(material.name.clone(), material);
        }
    }
    let mut writer = Writer { folder, warnings, images: Vec::new() };
    let mut materials = Vec::new();
    for name in names {
        if !known.contains_key(name) {
            writer
                .warnings
                .push(format!("material {name:?} is in no material library: it is plain"));
        }
        let plain = Material { name: name.clone(), ..Material::default() };
        materials.push(writer.material(known.get(name).unwrap_or(&plain))?);
    }
    let textures: Vec<_> =
        (0..writer.images.len()).map(|source| json!({"source": source})).collect();
    let images: Vec<_> = writer.images.iter().map(|uri| json!({"uri": uri})).collect();
    let arrays = [("materials", materials), ("textures", textures), ("images", images)];
    let arrays = arrays.into_iter().filter(|(_, items)| !items.is_empty());
    Ok(arrays.map(|(key, items)| (key.to_owned(), Value::Array(items))).collect())
}

/// The materials of one `mtllib` line: a file name that may hold spaces, or several names.
fn load(
    library: &str,
    folder: &Path,
    warnings: &mut Vec<String>,
) -> Result<Vec<Material>, SceneError> {
    let mut materials = Vec::new();
    // `mtllib a b.mtl` is one file if that is there, else two.
    let whole = resource(library)?.locate(folder);
    let names = if whole.is_ok() { vec![library] } else { library.split_whitespace().collect() };
    for name in names {
        let path = match resource(name)?.locate(folder) {
            Ok(path) => path,
            Err(error @ SceneError::Uri { .. }) => return Err(error),
            Err(_) => {
                warnings.push(format!("material library {name:?} is not there"));
                continue;
            }
        };
        size::check(Text::Mtl, fs::metadata(&path)?.len())?;
        let text = completed(&String::from_utf8_lossy(&fs::read(path)?));
        match tobj::load_mtl_buf(&mut text.as_bytes()) {
            Ok((loaded, _)) => materials.extend(loaded),
            Err(error) => warnings.push(format!("material library {name:?} is left out: {error}")),
        }
    }
    Ok(materials)
}

/// MTL names are plain file names: nothing in them is percent encoded.
fn resource(name: &str) -> Result<Resource, SceneError> {
    // Files from Windows have backslashes in their paths.
    Resource::new(&percent_encode(&name.replace('\\', "/")))?
        .ok_or_else(|| SceneError::Uri { uri: name.to_owned(), reason: "is not a file name" })
}

/// Colours with one number get all three, as the format says; spectral curves are left out.
fn completed(text: &str) -> String {
    let mut completed = String::with_capacity(text.len());
    for line in text.lines() {
        let words: Vec<_> = line.split_whitespace().collect();
        match *words {
            // tobj panics on a colour of fewer than three numbers.
            ["Ka" | "Kd" | "Ks" | "Ke", "spectral" | "xyz", ..] | ["Ka" | "Kd" | "Ks" | "Ke"] => {}
            [key @ ("Ka" | "Kd" | "Ks" | "Ke"), gray]
            | [key @ ("Ka" | "Kd" | "Ks" | "Ke"), gray, _] => {
                completed.push_str(&format!("{key} {gray} {gray} {gray}\n"));
            }
            _ => {
                completed.push_str(line);
                completed.push('\n');
            }
        }
    }
    completed
}

/// A number that the parser leaves as text.
fn number(mtl: &Material, key: &str) -> Option<f32> {
    mtl.unknown_param.get(key)?.split_whitespace().next()?.parse().ok()
}

struct Writer<'a> {
    folder: &'a Path,
    warnings: &'a mut Vec<String>,
    /// Addresses of the images, which are the textures too.
    images: Vec<String>,
}

impl Writer<'_> {
    /// Kd and d are the base colour, Ke the emission; roughness is Pr, or 1 − √(Ns/1000) as
    /// is usual for shininess; Pm is metallic.
    fn material(&mut self, mtl: &Material) -> Result<Value, SceneError> {
        let [r, g, b] = mtl.diffuse.unwrap_or([0.8; 3]).map(unit);
        let alpha = unit(mtl.dissolve.unwrap_or(1.0));
        let shininess = mtl.shininess.map(|ns| 1.0 - (unit(ns / 1000.0)).sqrt());
        let roughness = number(mtl, "Pr").map(unit).or(shininess).unwrap_or(1.0);
        let mut reflection = json!({
            "baseColorFactor": [r, g, b, alpha],
            "metallicFactor": number(mtl, "Pm").map_or(0.0, unit),
            "roughnessFactor": roughness,
        });
        if let Some(texture) = self.texture(mtl.diffuse_texture.as_deref())? {
            reflection["baseColorTexture"] = texture;
        }
        let mut material = Map::new();
        material.insert("name".into(), json!(mtl.name));
        material.insert("pbrMetallicRoughness".into(), reflection);
        if let Some(texture) = self.texture(mtl.unknown_param.get("norm").map(String::as_str))? {
            material.insert("normalTexture".into(), texture);
        }
        let emission = mtl.emissive.filter(|e| e.iter().any(|x| *x > 0.0));
        let texture = self.texture(mtl.unknown_param.get("map_Ke").map(String::as_str))?;
        // glTF multiplies the texture by the factor, which is 0 where it is absent.
        if let Some(emission) = emission.or(texture.is_some().then_some([1.0; 3])) {
            // glTF allows no factor above 1.
            material.insert("emissiveFactor".into(), json!(emission.map(unit)));
        }
        if let Some(texture) = texture {
            material.insert("emissiveTexture".into(), texture);
        }
        if alpha < 1.0 {
            material.insert("alphaMode".into(), json!("BLEND"));
        }
        Ok(Value::Object(material))
    }

    /// The texture for a map's file; `None` with a warning for one that is missing or that glTF
    /// cannot show.
    fn texture(&mut self, statement: Option<&str>) -> Result<Option<Value>, SceneError> {
        let Some(name) = statement.map(file_name).filter(|name| !name.is_empty()) else {
            return Ok(None);
        };
        let resource = resource(name)?;
        match resource.locate(self.folder) {
            // An address outside the folder is refused, not passed over like a missing file.
            Err(error @ SceneError::Uri { .. }) => return Err(error),
            Err(_) => self.warnings.push(format!("texture {name:?} is not there")),
            Ok(_) if !matches!(mime(&resource.path), Some("image/png" | "image/jpeg")) => {
                self.warnings.push(format!("texture {name:?} is neither PNG nor JPEG: left out"));
            }
            Ok(_) => {
                let known = self.images.iter().position(|uri| *uri == resource.uri);
                let index = known.unwrap_or_else(|| {
                    self.images.push(resource.uri);
                    self.images.len() - 1
                });
                return Ok(Some(json!({"index": index})));
            }
        }
        Ok(None)
    }
}

/// The file in `-s 1 1 1 -clamp on file name.png`: what follows the options.
fn file_name(statement: &str) -> &str {
    let mut rest = statement.trim();
    while let Some((option, tail)) = first_word(rest)
        && option.starts_with('-')
    {
        rest = without_arguments(tail, option_arguments(option));
    }
    rest
}

/// The least and the most arguments of a texture option. Those beyond the least are numbers.
fn option_arguments(option: &str) -> RangeInclusive<usize> {
    match option {
        "-blendu" | "-blendv" | "-bm" | "-boost" | "-cc" | "-clamp" | "-imfchan" | "-texres"
        | "-type" => 1..=1,
        "-mm" => 2..=2,
        "-o" | "-s" | "-t" => 1..=3,
        // An option of another program: numbers are not part of a file's name.
        _ => 0..=3,
    }
}

fn without_arguments(mut text: &str, count: RangeInclusive<usize>) -> &str {
    for number in 1..=*count.end() {
        match first_word(text) {
            Some((word, tail)) if number <= *count.start() || word.parse::<f64>().is_ok() => {
                text = tail;
            }
            _ => break,
        }
    }
    text
}

/// The first of several words, and the rest. The last word is the file's name, whatever it is.
fn first_word(text: &str) -> Option<(&str, &str)> {
    let (word, tail) = text.split_once(char::is_whitespace)?;
    Some((word, tail.trim_start()))
}

fn unit(value: f32) -> f32 {
    if value.is_finite() { value.clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::file_name;

    #[test]
    fn a_file_name_follows_the_options() {
        for (statement, name) in [
            ("a b.png", "a b.png"),
            ("-imfchan l e.png", "e.png"),
            ("-type cube_top -texres 512 e.png", "e.png"),
            ("-mm 0 1 -cc on -boost 2 -bm 0.5 e.png", "e.png"),
            ("-s 1 1 1 -o 0.5 map 2.png", "map 2.png"),
            ("-t 1 2 3 4 map.png", "4 map.png"),
            ("-blendu off  -blendv\ton -clamp on -dark.png", "-dark.png"),
            ("-imfchan l on.png", "on.png"),
            ("-other 1 2 e.png", "e.png"),
        ] {
            assert_eq!(file_name(statement), name, "{statement}");
        }
    }
}
