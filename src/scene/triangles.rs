//! The triangles of a scene, for a program that looks at it instead of passing it on.

use std::fmt;

use base64::{Engine as _, prelude::BASE64_STANDARD};
use glam::{DMat4, DVec3, Mat4, Vec3};
use gltf::mesh::Mode;

use crate::scene::resource::Resource;
use crate::scene::{Scene, SceneError};

/// A triangle in the scene's world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Corners.
    pub corners: [DVec3; 3],
    /// Unit normals at the corners, where the scene has them.
    pub normals: Option<[DVec3; 3]>,
}

impl Scene {
    /// Every triangle of the default scene, or of the first, at its place in the world.
    ///
    /// # Errors
    /// A document that is not valid glTF or requires an extension that is not read (compressed
    /// geometry), and buffers that cannot be read.
    pub fn triangles(&self) -> Result<Vec<Triangle>, SceneError> {
        let document = gltf::Gltf::from_slice(self.text.as_bytes())
            .map_err(|error| SceneError::Invalid("document".into(), error.to_string()))?
            .document;
        let buffers = document.buffers().map(|b| self.buffer(&b)).collect::<Result<Vec<_>, _>>()?;
        let mut triangles = Vec::new();
        let scene = document.default_scene().or_else(|| document.scenes().next());
        let roots = scene.iter().flat_map(gltf::Scene::nodes);
        let mut nodes: Vec<(gltf::Node<'_>, DMat4)> = roots.map(|n| (n, DMat4::IDENTITY)).collect();
        // A stack in place of recursion, as nodes may nest deeply; `check` has refused cycles.
        while let Some((node, parent)) = nodes.pop() {
            let place = parent * Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
            for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
                append(&primitive, &buffers, place, &mut triangles);
            }
            nodes.extend(node.children().map(|child| (child, place)));
        }
        Ok(triangles)
    }

    fn buffer(&self, buffer: &gltf::Buffer<'_>) -> Result<Vec<u8>, SceneError> {
        let uri = match buffer.source() {
            gltf::buffer::Source::Bin => {
                let pieces = self.bin.as_ref().ok_or_else(|| invalid(buffer, "no BIN chunk"))?;
                let mut bytes = Vec::new();
                pieces.iter().try_for_each(|piece| piece.write_to(&mut bytes))?;
                return Ok(bytes);
            }
            gltf::buffer::Source::Uri(uri) => uri,
        };
        match Resource::new(uri)? {
            Some(resource) => Ok(std::fs::read(resource.locate(self.folder())?)?),
            None => {
                let data = uri.split_once(";base64,");
                let (_, data) = data.ok_or_else(|| invalid(buffer, "no base64 data"))?;
                BASE64_STANDARD.decode(data).map_err(|error| invalid(buffer, error))
            }
        }
    }
}

/// The error of a buffer that cannot be read.
fn invalid(buffer: &gltf::Buffer<'_>, what: impl fmt::Display) -> SceneError {
    SceneError::Invalid(format!("buffers/{}", buffer.index()), what.to_string())
}

fn append(
    primitive: &gltf::Primitive<'_>,
    buffers: &[Vec<u8>],
    place: DMat4,
    triangles: &mut Vec<Triangle>,
) {
    let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
    let Some(positions) = reader.read_positions() else { return };
    let positions: Vec<DVec3> =
        positions.map(|p| place.transform_point3(Vec3::from(p).as_dvec3())).collect();
    // The inverse transpose keeps normals perpendicular under uneven scaling. A transform without
    // an inverse gives NaN, which becomes +z below.
    let to_normal = place.inverse().transpose();
    let normals: Option<Vec<DVec3>> = reader.read_normals().map(|normals| {
        let turned = normals.map(|n| to_normal.transform_vector3(Vec3::from(n).as_dvec3()));
        turned.map(|n| n.normalize_or(DVec3::Z)).collect()
    });
    let indices: Vec<usize> = reader.read_indices().map_or_else(
        || (0..positions.len()).collect(),
        |indices| indices.into_u32().map(|index| index as usize).collect(),
    );
    triangles.extend(index_triples(primitive.mode(), &indices).into_iter().filter_map(|ids| {
        let normals = normals.as_ref().and_then(|normals| corners(normals, ids));
        corners(&positions, ids).map(|corners| Triangle { corners, normals })
    }));
}

/// The vectors at three corners, if they are all there.
fn corners(vectors: &[DVec3], ids: [usize; 3]) -> Option<[DVec3; 3]> {
    Some([*vectors.get(ids[0])?, *vectors.get(ids[1])?, *vectors.get(ids[2])?])
}

/// The corners of each triangle; points and lines have none.
fn index_triples(mode: Mode, indices: &[usize]) -> Vec<[usize; 3]> {
    match mode {
        Mode::Triangles => indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            // Every other triangle of a strip runs the other way round.
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] })
            .collect(),
        Mode::TriangleFan => {
            indices.windows(2).skip(1).map(|pair| [indices[0], pair[0], pair[1]]).collect()
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_ball_is_round_and_faces_outwards() {
        let triangles = Scene::ball(32).expect("a size it can have").triangles().expect("valid");
        assert!(triangles.len() > 500);
        for Triangle { corners, normals } in triangles {
            let radius = corners[0].length();
            for (corner, normal) in corners.into_iter().zip(normals.expect("smooth")) {
                assert!((corner.length() - radius).abs() < 1e-5);
                assert!(corner.dot(normal) > 0.99 * radius);
            }
        }
    }

    #[test]
    fn strips_and_fans_keep_their_winding() {
        let indices = [0, 1, 2, 3];
        assert_eq!(index_triples(Mode::TriangleStrip, &indices), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(index_triples(Mode::TriangleFan, &indices), [[0, 1, 2], [0, 2, 3]]);
        assert!(index_triples(Mode::Lines, &indices).is_empty());
        assert!(index_triples(Mode::TriangleFan, &[]).is_empty());
    }
}
