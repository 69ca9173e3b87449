//! A material's reflectance read back from its tables, as a shader reads it.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::brdf::Reflectance;
use crate::lut::bake::Baked;
use crate::lut::quantity::{Encoding, Quantity};
use crate::lut::row::Placed;
use crate::lut::table::{Filter, Table};
use crate::material::Material;
use crate::math::direction::{Angles, abs_cos_phi_d};

/// How a coordinate between texel centres is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lookup {
    /// By the nearest texel.
    Nearest,
    /// By the two around it, mixed in f32.
    Filtered,
}

/// f(wi, wo) from the textures of D, G1 and F.
///
/// # Formula
///
/// f = ρd/π + Σ_lobes (ρs/π) F(wi·h) D(h) G1(wi) G1(wo)/(cosθi cosθo), the factors from the tables.
///
/// # Example
///
/// ```
/// use sgdbake::lut::decode::Lookup;
/// use sgdbake::{LutBrdf, Reflectance, SgdBrdf, spherical};
/// use sgdbake::{Depths, Extent, MaskingKind, Quantity, Request, bake, named};
///
/// let request = Request {
///     quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
///     masking: MaskingKind::Exact,
///     extent: Extent::Size(32),
///     depths: Depths::Smallest,
/// };
/// let baked = bake(&[named("gold-paint")?], &request)?;
/// let decoded = LutBrdf::new(&baked, 0, Lookup::Filtered).expect("all three are baked");
/// let exact = SgdBrdf::new(named("gold-paint")?, MaskingKind::Exact);
/// let (wi, wo) = (spherical(0.4, 0.0), spherical(0.6, 2.0));
/// assert!((decoded.eval(wi, wo)[0] / exact.eval(wi, wo)[0] - 1.0).abs() < 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct LutBrdf {
    placed: Placed,
    /// `ndf`, `masking` and `fresnel`; none for a material without a visible lobe.
    tables: Option<[Table; 3]>,
    lookup: Lookup,
}

impl LutBrdf {
    /// A material of a bake, by its index among those given; `None` where the bake has no such
    /// material, or lacks one of the three quantities.
    #[must_use]
    pub fn new(baked: &Baked, index: usize, lookup: Lookup) -> Option<Self> {
        let placed = baked.placed.get(index)?.clone();
        let tables = match placed.row {
            None => None,
            Some(_) => Some([
                baked.table(Quantity::Ndf)?.clone(),
                baked.table(Quantity::Masking)?.clone(),
                baked.table(Quantity::Fresnel)?.clone(),
            ]),
        };
        Some(Self { placed, tables, lookup })
    }

    /// Bytes of the texels.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.tables.iter().flatten().map(Table::bytes).sum()
    }

    /// The three numbers of a table's row at `x`.
    fn read(&self, table: &Table, row: usize, x: f64) -> [f64; 3] {
        let u = table.coordinate(0, row, x);
        let steps = (table.size[0] - 1) as f32;
        let u = match self.lookup {
            // At a texel's centre its neighbour has a weight of 0.
            Lookup::Nearest => (u * steps).round() / steps,
            Lookup::Filtered => u,
        };
        // Only the encoding of `ndf` makes use of the peaks.
        table.value(row, u, self.placed.ndf_peaks(), Filter::Fetched)
    }

    /// Σ_lobes ρs F D (G1(wi)/cosθi) (G1(wo)/cosθo) per colour.
    fn specular(&self, [ndf, masking, fresnel]: &[Table; 3], row: usize, at: &Angles) -> [f64; 3] {
        let d = self.read(ndf, row, at.tan2_h);
        let inv_cos4 = (1.0 + at.tan2_h).powi(2);
        let [g1_i, g1_o] = at.cot.map(|cot| self.read(masking, row, cot));
        let mut sums = [0.0; 3];
        for (j, lobe) in self.placed.material.lobes().iter().enumerate() {
            let f = self.read(fresnel, self.placed.fresnel_rows[j], at.cos_d);
            // Divided side by side: the product of two cosines underflows before G1/cosθ does.
            let v = g1_i[j] / at.cos[0] * (g1_o[j] / at.cos[1]);
            for (c, sum) in sums.iter_mut().enumerate() {
                *sum += lobe.rho_s()[c] * f[c] * d[j] * inv_cos4 * v;
            }
        }
        sums
    }
}

impl Reflectance for LutBrdf {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let Some(angles) = Angles::of(wi, wo) else { return [0.0; 3] };
        let specular = match (&self.tables, self.placed.row) {
            (Some(tables), Some(row)) => self.specular(tables, row, &angles),
            _ => [0.0; 3],
        };
        let rho_d = self.placed.material.rho_d();
        std::array::from_fn(|c| FRAC_1_PI * (rho_d[c] + specular[c]))
    }
}

/// f(wi, wo) from the 3D texture of the whole specular term.
///
/// # Formula
///
/// f = ρd/π + (Σρs/π) B(θh, θd, |cosφd|)
#[derive(Clone, Debug)]
pub struct VolumeBrdf {
    rho_d: [f64; 3],
    /// Σρs of the lobes.
    rho_s: [f64; 3],
    /// None for a material without a visible lobe.
    table: Option<Table>,
}

impl VolumeBrdf {
    /// A material of a bake, by its index among those given; `None` where the bake has no such
    /// material or no 3D table of it.
    #[must_use]
    pub fn new(baked: &Baked, index: usize) -> Option<Self> {
        let placed = baked.placed.get(index)?;
        let table = match placed.row {
            None => None,
            Some(row) => Some(baked.volume(row)?.clone()),
        };
        Some(Self { rho_d: placed.material.rho_d(), rho_s: total_rho_s(&placed.material), table })
    }

    /// Bytes of the texels.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.table.as_ref().map_or(0, Table::bytes)
    }
}

/// Σρs of a material's lobes, per colour.
fn total_rho_s(material: &Material) -> [f64; 3] {
    // Left-out lobes too: the shares in the texels are of all lobes.
    [0, 1, 2].map(|c| material.lobes().iter().map(|lobe| lobe.rho_s()[c]).sum())
}

impl Reflectance for VolumeBrdf {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let Some(angles) = Angles::of(wi, wo) else { return [0.0; 3] };
        let mut brdf = [0.0; 3];
        // A bake encodes a 3D table in no other way.
        if let Some((table, Encoding::Times { factor })) =
            self.table.as_ref().map(|table| (table, table.encoding))
        {
            let variables = [angles.tan2_h, angles.cos_d, abs_cos_phi_d(wi, wo)];
            let u = std::array::from_fn(|axis| table.coordinate(axis, 0, variables[axis]));
            let texel = table.fetch_3d(u, Filter::Fetched);
            brdf = std::array::from_fn(|c| factor[c] * f64::from(texel[c]));
        }
        std::array::from_fn(|c| FRAC_1_PI * (self.rho_d[c] + self.rho_s[c] * brdf[c]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{MaskingKind, SgdBrdf};
    use crate::lut::bake::bake;
    use crate::lut::request::{Depths, Extent, Request};
    use crate::lut::table::Depth;
    use crate::material::{LobeFields, LobeParams, find};
    use crate::math::direction::spherical;

    fn baked(material: &Material, quantities: &[Quantity], size: usize, depth: Depth) -> Baked {
        let request = Request {
            quantities: quantities.to_vec(),
            masking: MaskingKind::Exact,
            extent: Extent::Size(size),
            depths: Depths::Only(depth),
        };
        bake(&[material], &request).expect("a size that textures have")
    }

    const FACTORS: [Quantity; 3] = [Quantity::Ndf, Quantity::Masking, Quantity::Fresnel];

    #[test]
    fn finer_tables_are_nearer_and_filtering_helps() {
        let material = &find("gold-paint").expect("in the catalogue").material;
        let exact = SgdBrdf::new(material, MaskingKind::Exact);
        let [fine, coarse, nearest] =
            [(1024, Lookup::Filtered), (64, Lookup::Filtered), (1024, Lookup::Nearest)].map(
                |(width, lookup)| {
                    let baked = baked(material, &FACTORS, width, Depth::Float);
                    let lut = LutBrdf::new(&baked, 0, lookup).expect("all three are baked");
                    largest_error(&lut, &exact)
                },
            );
        assert!(fine < 1e-4, "{fine:e}");
        assert!(fine < 0.1 * coarse);
        assert!(fine < 0.1 * nearest);
    }

    /// The largest relative error of green over a hundred pairs.
    fn largest_error(lut: &LutBrdf, exact: &SgdBrdf) -> f64 {
        let errors = (0..100).map(|i| {
            let wo = spherical(0.015 * f64::from(i), 0.0);
            let wi = spherical(0.013 * f64::from(i), 3.0);
            (lut.eval(wi, wo)[1] / exact.eval(wi, wo)[1] - 1.0).abs()
        });
        errors.fold(0.0, f64::max)
    }

    #[test]
    fn the_volume_is_the_whole_reflectance() {
        let material = &find("gold-paint").expect("in the catalogue").material;
        let exact = SgdBrdf::new(material, MaskingKind::Exact);
        let baked = baked(material, &[Quantity::Brdf3d], 96, Depth::Float);
        let volume = VolumeBrdf::new(&baked, 0).expect("baked");
        for i in 1..60 {
            let wo = spherical(0.02 * f64::from(i), 0.0);
            let wi = spherical(0.017 * f64::from(60 - i), 0.05 * f64::from(i) + 1.0);
            let (decoded, exact) = (volume.eval(wi, wo)[0], exact.eval(wi, wo)[0]);
            assert!((decoded / exact - 1.0).abs() < 0.02, "{i}: {decoded} {exact}");
        }
    }

    /// Two lobes that colour all channels, through both kinds of textures.
    #[test]
    fn overlapping_lobes_come_back() {
        let lobes = ["gold-paint", "pink-fabric"].map(|name| {
            let green = &find(name).expect("in the catalogue").channels[1];
            let fields = LobeFields {
                alpha: green.alpha,
                p: green.p,
                masking: None,
                rho_s: [0.3, 0.2, 0.1],
                f0: [0.2, 0.3, 0.4],
                f1: [0.0, -0.1, 0.1],
            };
            LobeParams::new(fields).expect("in range")
        });
        let material = Material::new("two", [0.1, 0.2, 0.3], lobes.into()).expect("two lobes");
        let exact = SgdBrdf::new(&material, MaskingKind::Exact);
        let [factors, volume] =
            [&FACTORS[..], &[Quantity::Brdf3d]].map(|q| baked(&material, q, 200, Depth::Float));
        let lut = LutBrdf::new(&factors, 0, Lookup::Filtered).expect("baked");
        let volume = VolumeBrdf::new(&volume, 0).expect("baked");
        for i in 1..60 {
            let wo = spherical(0.02 * f64::from(i), 0.0);
            let wi = spherical(0.017 * f64::from(60 - i), 0.05 * f64::from(i) + 1.0);
            for c in 0..3 {
                let exact = exact.eval(wi, wo)[c];
                let (a, b) = (lut.eval(wi, wo)[c], volume.eval(wi, wo)[c]);
                assert!((a / exact - 1.0).abs() < 2e-3, "{i}: {a} {exact}");
                assert!((b / exact - 1.0).abs() < 1e-2, "{i}: {b} {exact}");
            }
        }
    }

    #[test]
    fn below_the_horizon_is_dark() {
        let material = &find("chrome").expect("in the catalogue").material;
        let baked = baked(material, &FACTORS, 16, Depth::Half);
        let lut = LutBrdf::new(&baked, 0, Lookup::Filtered).expect("baked");
        assert_eq!(lut.eval(spherical(2.0, 0.0), DVec3::Z), [0.0; 3]);
        assert_eq!(lut.bytes(), 3 * 16 * 3 * 2);
    }

    #[test]
    fn a_material_without_a_lobe_is_its_diffuse_colour() {
        let material = Material::new("matte", [0.1, 0.2, 0.3], Vec::new()).expect("in range");
        let lut = LutBrdf::new(&baked(&material, &FACTORS, 16, Depth::Half), 0, Lookup::Filtered);
        let f = lut.expect("nothing is missing").eval(DVec3::Z, spherical(0.3, 0.0));
        assert_eq!(f, [0.1, 0.2, 0.3].map(|rho_d| FRAC_1_PI * rho_d));
    }
}
