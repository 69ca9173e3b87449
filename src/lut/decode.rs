//! A material's reflectance read back from its tables, as a shader reads it.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::brdf::Reflectance;
use crate::brdf::eval::{above_horizon, cos_theta_d};
use crate::lut::bake::{BakeError, Depths, Extent, Request, bake};
use crate::lut::quantity::{Encoding, Quantity};
use crate::lut::table::{Depth, Filter, Table};
use crate::material::{ChannelParams, Material};
use crate::math::direction::{cos_theta, cot_theta, half_sum, tan2_theta};
use crate::microfacet::masking::MaskingKind;

/// How a coordinate between texel centres is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lookup {
    /// By the nearest texel.
    Nearest,
    /// By the two around it, mixed in f32.
    Filtered,
}

/// f(wi, wo) from the textures of D, G1 and F of one material.
///
/// # Formula
///
/// f = ρd/π + (ρs/π) F(wi·h) D(h) G1(wi) G1(wo)/(cosθi cosθo), the factors from the tables.
#[derive(Clone, Debug)]
pub struct LutBrdf {
    channels: [ChannelParams; 3],
    ndf_peak: [f64; 3],
    ndf: Table,
    masking: Table,
    fresnel: Table,
    lookup: Lookup,
}

impl LutBrdf {
    /// The material through freshly baked tables, `width` texels along each axis.
    ///
    /// # Errors
    ///
    /// A width that no texture has.
    pub fn bake(
        material: &Material,
        width: usize,
        depth: Depth,
        lookup: Lookup,
    ) -> Result<Self, BakeError> {
        let table = |quantity: Quantity| {
            let request = Request {
                quantities: vec![quantity],
                masking: MaskingKind::Exact,
                extent: Extent::Size(width),
                depths: Depths::Only(depth),
            };
            let baked = bake(&[material], &request)?;
            let table = baked.tables.into_iter().next().ok_or(BakeError::NoMaterial)?;
            Ok((table, baked.placed[0].ndf_peak))
        };
        let (ndf, ndf_peak) = table(Quantity::Ndf)?;
        let (masking, fresnel) = (table(Quantity::Masking)?.0, table(Quantity::Fresnel)?.0);
        Ok(Self { channels: material.channels, ndf_peak, ndf, masking, fresnel, lookup })
    }

    /// Bytes of the texels.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.ndf.bytes() + self.masking.bytes() + self.fresnel.bytes()
    }

    /// A table's value at `x`, per channel.
    fn read(&self, table: &Table, x: f64) -> [f64; 3] {
        let u = table.coordinate(0, 0, x);
        let steps = (table.size[0] - 1) as f32;
        let u = match self.lookup {
            Lookup::Nearest => (u * steps).round() / steps,
            Lookup::Filtered => u,
        };
        table.value(0, u, self.ndf_peak, Filter::Fetched)
    }
}

impl Reflectance for LutBrdf {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !(above_horizon(wi) && above_horizon(wo)) {
            return [0.0; 3];
        }
        let h = half_sum(wi, wo);
        let x = tan2_theta(h);
        let cos4 = (1.0 + x).powi(2);
        let d = self.read(&self.ndf, x);
        let f = self.read(&self.fresnel, cos_theta_d(h));
        let [g1_i, g1_o] = [wi, wo].map(|w| self.read(&self.masking, cot_theta(w)));
        std::array::from_fn(|c| {
            let ChannelParams { rho_d, rho_s, .. } = self.channels[c];
            let v = g1_i[c] / cos_theta(wi) * (g1_o[c] / cos_theta(wo));
            FRAC_1_PI * (rho_d + rho_s * f[c] * d[c] * cos4 * v)
        })
    }
}

/// f(wi, wo) from the 3D texture of one material's whole specular term.
///
/// # Formula
///
/// f = ρd/π + (ρs/π) B(θh, θd, |cosφd|), |cosφd| = |cosθo − cosθi|/(2 sinθh sinθd)
#[derive(Clone, Debug)]
pub struct VolumeBrdf {
    channels: [ChannelParams; 3],
    table: Table,
}

impl VolumeBrdf {
    /// The material through a freshly baked table, `size` texels along each axis.
    ///
    /// # Errors
    ///
    /// A size that no texture has, or a material without a visible lobe.
    pub fn bake(material: &Material, size: usize, depth: Depth) -> Result<Self, BakeError> {
        let request = Request {
            quantities: vec![Quantity::Brdf3d],
            masking: MaskingKind::Exact,
            extent: Extent::Size(size),
            depths: Depths::Only(depth),
        };
        let table = bake(&[material], &request)?.tables.into_iter().next();
        Ok(Self { channels: material.channels, table: table.ok_or(BakeError::NoMaterial)? })
    }

    /// Bytes of the texels.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.table.bytes()
    }
}

impl Reflectance for VolumeBrdf {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !(above_horizon(wi) && above_horizon(wo)) {
            return [0.0; 3];
        }
        let h = half_sum(wi, wo);
        let (x, cos_d) = (tan2_theta(h), cos_theta_d(h));
        let sin_h = (x / (1.0 + x)).sqrt();
        let sin_d = ((1.0 - cos_d) * (1.0 + cos_d)).sqrt();
        let swing = (cos_theta(wo) - cos_theta(wi)).abs() / (2.0 * sin_h * sin_d);
        // At θh = 0 or θd = 0 every φd is the same.
        let cos_phi = if swing.is_finite() { swing.min(1.0) } else { 0.0 };
        let at = |axis: usize, value: f64| self.table.coordinate(axis, 0, value);
        let u = [at(0, x), at(1, cos_d), at(2, cos_phi)];
        let texel = self.table.fetch_3d(u, Filter::Fetched);
        let Encoding::Times { factor } = self.table.encoding else { return [0.0; 3] };
        std::array::from_fn(|c| {
            let ChannelParams { rho_d, rho_s, .. } = self.channels[c];
            FRAC_1_PI * (rho_d + rho_s * factor[c] * f64::from(texel[c]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::SgdBrdf;
    use crate::material::find;
    use crate::math::direction::spherical;

    #[test]
    fn finer_tables_are_nearer_and_filtering_helps() {
        let material = &find("gold-paint").expect("in the catalogue").material;
        let exact = SgdBrdf::new(material, MaskingKind::Exact);
        let error = |width: usize, lookup: Lookup| -> f64 {
            let lut =
                LutBrdf::bake(material, width, Depth::Float, lookup).expect("a size it can have");
            let of = |i: u32| {
                let wo = spherical(0.015 * f64::from(i), 0.0);
                let wi = spherical(0.013 * f64::from(i), 3.0);
                (lut.eval(wi, wo)[1] / exact.eval(wi, wo)[1] - 1.0).abs()
            };
            (0..100).map(of).fold(0.0, f64::max)
        };
        let fine = error(1024, Lookup::Filtered);
        assert!(fine < 1e-4, "{fine:e}");
        assert!(fine < 0.1 * error(64, Lookup::Filtered));
        assert!(fine < 0.1 * error(1024, Lookup::Nearest));
    }

    #[test]
    fn the_volume_is_the_whole_reflectance() {
        let material = &find("gold-paint").expect("in the catalogue").material;
        let exact = SgdBrdf::new(material, MaskingKind::Exact);
        let volume = VolumeBrdf::bake(material, 96, Depth::Float).expect("a size it can have");
        for i in 1..60 {
            let wo = spherical(0.02 * f64::from(i), 0.0);
            let wi = spherical(0.017 * f64::from(60 - i), 0.05 * f64::from(i) + 1.0);
            let (decoded, exact) = (volume.eval(wi, wo)[0], exact.eval(wi, wo)[0]);
            assert!((decoded / exact - 1.0).abs() < 0.02, "{i}: {decoded} {exact}");
        }
    }

    #[test]
    fn below_the_horizon_is_dark() {
        let material = &find("chrome").expect("in the catalogue").material;
        let lut =
            LutBrdf::bake(material, 16, Depth::Half, Lookup::Filtered).expect("a size it can have");
        assert_eq!(lut.eval(spherical(2.0, 0.0), DVec3::Z), [0.0; 3]);
        assert_eq!(lut.bytes(), 3 * 16 * 3 * 2);
    }
}
