//! The built-in preview ball.

use std::f32::consts::{PI, TAU};

use serde_json::json;

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

/// Rows run from the north pole; the pole rows have one vertex per column for its texture
/// coordinate, and one triangle per quad.
fn ball(rows: u32) -> Surface {
    let columns = 2 * rows;
    let mut ball = Surface { material: Some(0), ..Surface::default() };
    for row in 0..=rows {
        for column in 0..=columns {
            let [u, v] = [column as f32 / columns as f32, row as f32 / rows as f32];
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
    let sin = if pole { 0.0 } else { theta.sin() };
    [sin * phi.sin(), theta.cos(), sin * phi.cos()]
}
