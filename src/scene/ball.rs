//! The built-in preview ball.

use std::f32::consts::{PI, TAU};

use serde_json::{Value, json};

use crate::scene::{
    Scene, SceneError, Source,
    build::{self, Mesh, Parts, Surface},
};

impl Scene {
    /// A unit sphere of `segments` × 2·`segments` quads (at least 2) around +y, with texture
    /// coordinates and one material slot, `ball`.
    ///
    /// # Errors
    /// None for the sizes that fit into a .glb.
    pub fn ball(segments: u16) -> Result<Self, SceneError> {
        let mesh = Mesh { name: "ball".into(), surfaces: vec![ball(u32::from(segments.max(2)))] };
        let mut parts = Parts::new();
        parts.insert("materials".into(), json!([{"name": "ball"}]));
        build::scene(vec![mesh], parts, Source::Built(None))
    }
}

impl Scene {
    /// Unit spheres as [`Scene::ball`], one for each of `slots`: nodes of their own that share one
    /// geometry, all in the origin.
    ///
    /// # Errors
    /// None for the sizes that fit into a .glb.
    pub fn balls(segments: u16, slots: &[&str]) -> Result<Self, SceneError> {
        let ball = Self::ball(segments)?;
        let mut document: Value = serde_json::from_str(&ball.text)?;
        let primitive = document["meshes"][0]["primitives"][0].take();
        let meshes = slots.iter().enumerate().map(|(index, slot)| {
            let mut primitive = primitive.clone();
            primitive["material"] = index.into();
            json!({"name": slot, "primitives": [primitive]})
        });
        document["meshes"] = meshes.collect();
        let nodes = slots.iter().enumerate();
        document["nodes"] = nodes.map(|(i, slot)| json!({"name": slot, "mesh": i})).collect();
        document["materials"] = slots.iter().map(|slot| json!({"name": slot})).collect();
        document["scenes"][0]["nodes"] = (0..slots.len()).collect();
        Self::new(document.to_string(), ball.bin, None, Source::Built(None))
    }
}

/// Rows run from the north pole; the pole rows have one vertex per column for its texture
/// coordinate, and one triangle per quad.
fn ball(rows: u32) -> Surface {
    let columns = 2 * rows;
    let mut ball = Surface { material: Some(0), ..Surface::default() };
    for row in 0..=rows {
        for column in 0..=columns {
            let [u, v] = [column as f32 / columns as f32, row as f32 / rows as f32];
            // At the seam u is 1, and φ 0 again: the same position to the last bit.
            let normal = direction(PI * v, TAU * (u % 1.0), row % rows == 0);
            ball.positions.push(normal);
            ball.normals.push(normal);
            ball.texcoords.push([u, v]);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let b = a + columns + 1;
            if row > 0 {
                ball.indices.extend([a, b, a + 1]);
            }
            if row + 1 < rows {
                ball.indices.extend([a + 1, b, b + 1]);
            }
        }
    }
    ball
}

/// The unit vector at polar angle `theta` from +y and azimuth `phi`; exactly ±y at a pole.
fn direction(theta: f32, phi: f32, pole: bool) -> [f32; 3] {
    // sin π is not 0 in f32.
    let sin = if pole { 0.0 } else { theta.sin() };
    [sin * phi.sin(), theta.cos(), sin * phi.cos()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Slot;

    #[test]
    fn balls_share_their_geometry() {
        let one = Scene::ball(8).expect("a small scene").counts();
        let three = Scene::balls(8, &["a", "b", "a"]).expect("a small scene");
        let names: Vec<String> = three.slots().iter().map(Slot::label).collect();
        assert_eq!(names.len(), 3);
        assert_eq!(three.counts().buffer_bytes, one.buffer_bytes);
        assert_eq!((three.counts().nodes, three.counts().triangles), (3, 3 * one.triangles));
    }
}
