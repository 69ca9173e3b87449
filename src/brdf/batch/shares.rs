//! The shares of the techniques that a batch sampler draws by, and the choice among them.

use std::f64::consts::FRAC_1_PI;

use crate::brdf::batch::block::{BLOCK, PerPair};
use crate::brdf::sampler::MIN_FRESNEL;
use crate::material::{LobeParams, MAX_LOBES, Material};
use crate::math::arithmetic::{max, min};

/// The technique that is no lobe.
pub const DIFFUSE: u32 = MAX_LOBES as u32;

/// The largest f32 below 1.
pub const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// What q(wo), the shares of the lobes and of diffuse, depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct Shares {
    lobes: Vec<[ShareOfColour; 3]>,
    diffuse: f32,
    /// The last technique that is ever chosen.
    last: u32,
}

/// 4ρs/π and the Fresnel curve of a colour, as (f0 − f1) + (1 − f0) ε⁵ + f1 ε.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ShareOfColour {
    scale: f32,
    normal: f32,
    schlick: f32,
    f1: f32,
}

/// The techniques of a block of draws.
pub struct Choices {
    /// A lobe's index, or [`DIFFUSE`].
    pub technique: [u32; BLOCK],
    /// Where the uniform number fell in the technique's share, in [0, 1).
    pub place: PerPair,
    /// G1(wo) of the chosen lobe; 1 for diffuse.
    pub g1: PerPair,
}

impl ShareOfColour {
    fn new(lobe: &LobeParams, c: usize) -> Self {
        let (f0, f1) = (lobe.f0()[c], lobe.f1()[c]);
        Self {
            scale: (4.0 * FRAC_1_PI * lobe.rho_s()[c]) as f32,
            normal: (f0 - f1) as f32,
            schlick: (1.0 - f0) as f32,
            f1: f1 as f32,
        }
    }

    /// 4ρs/π (|F| + a little) at ε = 1 − cosθo.
    #[inline(always)]
    fn share(&self, e: f32, e5: f32) -> f32 {
        let fresnel = self.normal + self.schlick * e5 + self.f1 * e;
        self.scale * (fresnel.abs() + MIN_FRESNEL as f32)
    }
}

impl Shares {
    /// Of a material.
    #[must_use]
    pub fn new(material: &Material) -> Self {
        let lobes = material.lobes().iter();
        let lobes: Vec<[ShareOfColour; 3]> =
            lobes.map(|lobe| [0, 1, 2].map(|c| ShareOfColour::new(lobe, c))).collect();
        let diffuse = material.rho_d().iter().sum::<f64>() as f32;
        let last =
            lobes.iter().rposition(|lobe| lobe.iter().any(|of_colour| of_colour.scale > 0.0));
        match last {
            Some(last) if diffuse == 0.0 => Self { lobes, diffuse, last: last as u32 },
            None if diffuse == 0.0 => Self { lobes, diffuse: 1.0, last: DIFFUSE },
            _ => Self { lobes, diffuse, last: DIFFUSE },
        }
    }

    /// q(wo) of the lobes and of diffuse.
    #[inline(always)]
    pub fn fill(&self, cos_theta_o: &PerPair, shares: &mut [PerPair; MAX_LOBES + 1]) {
        shares[MAX_LOBES] = [self.diffuse; BLOCK];
        for (lobe, shares) in self.lobes.iter().zip(&mut *shares) {
            // Not through the reference: the vectoriser must see that no share overwrites it.
            let [r, g, b] = *lobe;
            for i in 0..BLOCK {
                let e = max(1.0 - cos_theta_o[i], 0.0);
                let e2 = e * e;
                let e5 = e2 * e2 * e;
                shares[i] = r.share(e, e5) + g.share(e, e5) + b.share(e, e5);
            }
        }
        let [a, b, c, d] = shares;
        for i in 0..BLOCK {
            let inverse = 1.0 / (a[i] + b[i] + c[i] + d[i]);
            a[i] *= inverse;
            b[i] *= inverse;
            c[i] *= inverse;
            d[i] *= inverse;
        }
    }

    /// The techniques that uniform numbers fall to; `g1` is G1(wo) of each lobe.
    #[inline(always)]
    pub fn choose(
        &self,
        u: &PerPair,
        [a, b, c, d]: &[PerPair; MAX_LOBES + 1],
        [g1_a, g1_b, g1_c]: &[PerPair; MAX_LOBES],
        choices: &mut Choices,
    ) {
        for i in 0..BLOCK {
            let (to_a, to_b, to_c) = (a[i], a[i] + b[i], a[i] + b[i] + c[i]);
            let passed =
                u32::from(u[i] >= to_a) + u32::from(u[i] >= to_b) + u32::from(u[i] >= to_c);
            let technique = passed.min(self.last);
            let start = of(technique, [0.0, to_a, to_b, to_c]);
            let share = of(technique, [a[i], b[i], c[i], d[i]]);
            choices.technique[i] = technique;
            choices.place[i] = min((u[i] - start) / share, BELOW_ONE);
            choices.g1[i] = of(technique, [g1_a[i], g1_b[i], g1_c[i], 1.0]);
        }
    }
}

impl Choices {
    #[inline(always)]
    pub fn empty() -> Self {
        Self { technique: [0; BLOCK], place: [0.0; BLOCK], g1: [0.0; BLOCK] }
    }
}

/// The value of a technique, by selects.
#[inline(always)]
fn of(technique: u32, [a, b, c, d]: [f32; MAX_LOBES + 1]) -> f32 {
    let low = if technique == 0 { a } else { b };
    let high = if technique == 2 { c } else { d };
    if technique < 2 { low } else { high }
}
