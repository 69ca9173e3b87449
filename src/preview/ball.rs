//! The unit ball as the orthographic camera sees it, and its exact picture under one sun.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::brdf::Reflectance;
use crate::preview::film::{Film, Pixel};

/// The direction to the viewer, everywhere in the picture.
pub const TO_VIEWER: DVec3 = DVec3::Z;

/// A distant light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit direction to it.
    pub direction: DVec3,
    /// Irradiance of a surface that faces it; π shows a white diffuse surface as 1.
    pub irradiance: f64,
}

/// From the upper left, 45° off the line of sight, as bright as a white surface needs to be 1.
pub const KEY_LIGHT: Sun = Sun {
    direction: DVec3::new(-0.5, 0.5, std::f64::consts::FRAC_1_SQRT_2),
    irradiance: std::f64::consts::PI,
};

/// The ball's normal at a point of the picture plane, both coordinates in [−1, 1]; `None` beside
/// the ball.
#[must_use]
pub fn normal_at(x: f64, y: f64) -> Option<DVec3> {
    let rest = 1.0 - x * x - y * y;
    (rest > 0.0).then(|| DVec3::new(x, y, rest.sqrt()))
}

/// A shading frame whose third axis is the unit `normal` (Duff et al. 2017).
#[must_use]
pub fn frame(normal: DVec3) -> DMat3 {
    // Each hemisphere has a form of its own, so that nothing is divided by 0 at ∓z.
    let sign = 1.0_f64.copysign(normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    let tangent = DVec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x);
    let bitangent = DVec3::new(b, sign + normal.y * normal.y * a, -normal.y);
    DMat3::from_cols(tangent, bitangent, normal)
}

/// The centre of pixel (column, row) in the picture plane; the ball touches the edges.
#[must_use]
pub fn pixel_centre(size: usize, column: usize, row: usize) -> [f64; 2] {
    let [x, y] = [column, row].map(|index| 2.0 * (index as f64 + 0.5) / size as f64 - 1.0);
    // Rows run downwards, y upwards.
    [x, -y]
}

/// The ball under one sun, without noise: radiance f(wi, wo) cosθi E at each pixel's centre.
#[must_use]
pub fn under_sun(reflectance: &dyn Reflectance, sun: Sun, size: usize) -> Film {
    let centres = (0..size * size)
        .into_par_iter()
        .map(|index| pixel_centre(size, index % size, index / size));
    let pixels = centres.map(|[x, y]| {
        normal_at(x, y).map_or_else(Pixel::default, |normal| lit(reflectance, sun, normal))
    });
    Film { width: size, height: size, pixels: pixels.collect() }
}

/// The point of the ball with this normal, under the sun.
fn lit(reflectance: &dyn Reflectance, sun: Sun, normal: DVec3) -> Pixel {
    let to_local = frame(normal).transpose();
    let (wi, wo) = (to_local * sun.direction, to_local * TO_VIEWER);
    let scale = sun.irradiance * wi.z.max(0.0);
    Pixel { rgb: reflectance.eval(wi, wo).map(|f| f * scale), alpha: 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::MaskingKind;
    use crate::brdf::SgdBrdf;
    use crate::material::find;

    #[test]
    fn frames_are_orthonormal_and_keep_the_normal() {
        for normal in
            [DVec3::Z, DVec3::NEG_Z, DVec3::new(0.6, 0.0, -0.8), DVec3::new(0.48, 0.6, 0.64)]
        {
            let m = frame(normal);
            assert!((m * m.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-14));
            assert!((m.determinant() - 1.0).abs() < 1e-14);
            assert_eq!(m.z_axis, normal);
        }
    }

    #[test]
    fn the_picture_is_lit_from_the_upper_left() {
        let material = &find("gold-paint").expect("in the catalogue").material;
        let brdf = SgdBrdf::new(material, MaskingKind::Fitted);
        let film = under_sun(&brdf, KEY_LIGHT, 32);
        let [corner, upper_left, lower_right] = [0, 10, 21].map(|i| film.pixels[i * 32 + i]);
        assert_eq!(corner.alpha, 0.0);
        assert!(upper_left.rgb[0] > 4.0 * lower_right.rgb[0]);
        assert!(upper_left.rgb[0] > upper_left.rgb[2], "gold is yellow");
    }
}
