//! Triangles become a glTF document.

use serde_json::{Map, Value, json};

use crate::scene::{Bytes, Scene, SceneError, Source};

/// Triangles of one material, vertices shared through indices. Optional arrays are empty, or as
/// long as `positions`.
#[derive(Debug, Default)]
pub(super) struct Surface {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    /// glTF counts v from the top.
    pub texcoords: Vec<[f32; 2]>,
    /// Linear RGB.
    pub colors: Vec<[f32; 3]>,
    pub indices: Vec<u32>,
    /// Index into the document's materials.
    pub material: Option<usize>,
}

/// A named mesh.
#[derive(Debug, Default)]
pub(super) struct Mesh {
    pub name: String,
    pub surfaces: Vec<Surface>,
}

/// Parts of a document other than the meshes: `materials`, `textures`, `images`.
pub(super) type Parts = Map<String, Value>;

/// One node per mesh; one buffer view per attribute and surface, planar, so that every accessor is
/// compact and starts its view.
pub(super) fn scene(meshes: Vec<Mesh>, parts: Parts, source: Source) -> Result<Scene, SceneError> {
    let mut builder = Builder::default();
    let nodes: Vec<_> = meshes
        .iter()
        .enumerate()
        .map(|(index, mesh)| json!({"name": mesh.name, "mesh": index}))
        .collect();
    let roots: Vec<_> = (0..nodes.len()).collect();
    let meshes: Vec<_> = meshes.into_iter().map(|mesh| builder.mesh(mesh)).collect();
    let mut document = Map::new();
    let generator = concat!("sgdbake ", env!("CARGO_PKG_VERSION"));
    document.insert("asset".into(), json!({"version": "2.0", "generator": generator}));
    document.insert("scene".into(), json!(0));
    document.insert("scenes".into(), json!([{"nodes": roots}]));
    document.insert("nodes".into(), Value::Array(nodes));
    document.insert("meshes".into(), Value::Array(meshes));
    document.extend(parts);
    document.insert("accessors".into(), Value::Array(builder.accessors));
    document.insert("bufferViews".into(), Value::Array(builder.views));
    document.insert("buffers".into(), json!([{"byteLength": builder.bytes.len()}]));
    let text = Value::Object(document).to_string();
    Scene::new(text, Some(vec![Bytes::from(builder.bytes)]), None, source)
}

// Targets and component types by their numbers in glTF, which are those of WebGL.
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

#[derive(Default)]
struct Builder {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Builder {
    fn mesh(&mut self, mesh: Mesh) -> Value {
        let primitives: Vec<_> =
            mesh.surfaces.into_iter().map(|surface| self.primitive(surface)).collect();
        json!({"name": mesh.name, "primitives": primitives})
    }

    fn primitive(&mut self, surface: Surface) -> Value {
        let mut attributes = Map::new();
        // glTF requires bounds of positions, and of nothing else here.
        let bounds = bounds(&surface.positions);
        let positions = self.attribute("VEC3", &surface.positions, Some(bounds));
        attributes.insert("POSITION".into(), positions);
        if !surface.normals.is_empty() {
            let normals = self.attribute("VEC3", &surface.normals, None);
            attributes.insert("NORMAL".into(), normals);
        }
        if !surface.texcoords.is_empty() {
            let texcoords = self.attribute("VEC2", &surface.texcoords, None);
            attributes.insert("TEXCOORD_0".into(), texcoords);
        }
        if !surface.colors.is_empty() {
            let colors = self.attribute("VEC3", &surface.colors, None);
            attributes.insert("COLOR_0".into(), colors);
        }
        let indices = self.indices(&surface);
        let mut primitive = json!({"attributes": attributes, "indices": indices});
        if let Some(material) = surface.material {
            primitive["material"] = material.into();
        }
        primitive
    }

    fn attribute<const N: usize>(
        &mut self,
        kind: &str,
        values: &[[f32; N]],
        bounds: Option<[[f32; 3]; 2]>,
    ) -> Value {
        let view = self.view(bytemuck::cast_slice(values.as_flattened()), ARRAY_BUFFER);
        let mut accessor = json!({
            "bufferView": view, "componentType": FLOAT, "count": values.len(), "type": kind,
        });
        if let Some([min, max]) = bounds {
            accessor["min"] = json!(min.map(f64::from));
            accessor["max"] = json!(max.map(f64::from));
        }
        self.accessor(accessor)
    }

    /// 16 bits where they are enough; 65535 is kept free, glTF forbids it as an index.
    fn indices(&mut self, surface: &Surface) -> Value {
        let short = surface.positions.len() < usize::from(u16::MAX);
        let view = if short {
            // No index is cut: `short` has compared the number of vertices.
            let indices: Vec<u16> = surface.indices.iter().map(|&index| index as u16).collect();
            self.view(bytemuck::cast_slice(&indices), ELEMENT_ARRAY_BUFFER)
        } else {
            self.view(bytemuck::cast_slice(&surface.indices), ELEMENT_ARRAY_BUFFER)
        };
        self.accessor(json!({
            "bufferView": view,
            "componentType": if short { UNSIGNED_SHORT } else { UNSIGNED_INT },
            "count": surface.indices.len(),
            "type": "SCALAR",
        }))
    }

    fn accessor(&mut self, accessor: Value) -> Value {
        self.accessors.push(accessor);
        (self.accessors.len() - 1).into()
    }

    fn view(&mut self, bytes: &[u8], target: u32) -> Value {
        // Floats and 32-bit indices must start at multiples of four.
        let offset = self.bytes.len().next_multiple_of(4);
        self.bytes.resize(offset, 0);
        self.bytes.extend_from_slice(bytes);
        self.views.push(json!({
            "buffer": 0, "byteOffset": offset, "byteLength": bytes.len(), "target": target,
        }));
        (self.views.len() - 1).into()
    }
}

/// Smallest and largest coordinates.
fn bounds(positions: &[[f32; 3]]) -> [[f32; 3]; 2] {
    let start = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
    positions.iter().fold(start, |[min, max], p| {
        [[0, 1, 2].map(|i| min[i].min(p[i])), [0, 1, 2].map(|i| max[i].max(p[i]))]
    })
}
