//! One block of pairs through the formula, in straight loops: what the lobes share, then lobe by
//! lobe, and in each colour by colour.

use std::f64::consts::{FRAC_1_PI, LOG2_E};

use glam::Vec3;

use crate::brdf::batch::masking::BatchMasking;
use crate::brdf::batch::{Pairs, RgbMut};
use crate::brdf::{LobeCurves, LobeTerms, Terms};
use crate::material::{LobeParams, Material};
use crate::math::arithmetic::{Arithmetic, exp2, log2, max, min};
use crate::microfacet::SgdNdf;

/// Pairs that go through the formula together; every block is full, the last one padded, so a
/// pair's result does not depend on its place in a slice.
pub const BLOCK: usize = 128;

type Lanes = [f32; BLOCK];

/// tan²θh beyond which D of every lobe that f32 can hold is 0; its square is still finite.
const LARGEST_TAN2: f32 = 1e15;

/// A material's constants besides its masking, saturated to the range of f32.
#[derive(Clone, Debug, PartialEq)]
pub struct Constants {
    /// ρd/π per colour.
    diffuse: [f32; 3],
    lobes: Vec<LobeConstants>,
}

/// A lobe's constants.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LobeConstants {
    /// D at θ = 0.
    peak: f32,
    /// log₂e/α.
    decay: f32,
    /// 1/α².
    inv_alpha2: f32,
    p: f32,
    colours: [ColourConstants; 3],
}

/// The constants of one colour of a lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ColourConstants {
    /// ρs/π; 0 where the lobe does not colour.
    specular: f32,
    /// F(0°) = f0 − f1.
    fresnel_normal: f32,
    /// 1 − f0.
    fresnel_schlick: f32,
    f1: f32,
}

/// The f32 nearest to a value, at most 1e38 in magnitude.
fn single(value: f64) -> f32 {
    value.clamp(-1e38, 1e38) as f32
}

impl Constants {
    /// The constants of a material.
    #[must_use]
    pub fn new(material: &Material) -> Self {
        Self {
            diffuse: material.rho_d().map(|rho_d| single(rho_d * FRAC_1_PI)),
            lobes: material.lobes().iter().map(LobeConstants::new).collect(),
        }
    }
}

impl LobeConstants {
    fn new(lobe: &LobeParams) -> Self {
        let (alpha, p) = (lobe.alpha(), lobe.p());
        let colour = |c: usize| ColourConstants {
            specular: single(lobe.rho_s()[c] * FRAC_1_PI),
            fresnel_normal: single(lobe.f0()[c] - lobe.f1()[c]),
            fresnel_schlick: single(1.0 - lobe.f0()[c]),
            f1: single(lobe.f1()[c]),
        };
        Self {
            peak: single(SgdNdf::new(alpha, p).peak()),
            decay: single(LOG2_E / alpha),
            inv_alpha2: single(1.0 / (alpha * alpha)),
            p: single(p),
            colours: [0, 1, 2].map(colour),
        }
    }

    /// D at x = tan²θ: peak · 2^(−x log₂e/α − p log₂(1 + x/α²)) · (1+x)².
    #[inline(always)]
    fn ndf<A: Arithmetic>(&self, tan2_theta: f32) -> f32 {
        let x = min(tan2_theta, LARGEST_TAN2);
        let power = self.p * log2::<A>(min(A::mul_add(x, self.inv_alpha2, 1.0), f32::MAX));
        let density = self.peak * exp2::<A>(A::mul_add(-x, self.decay, -power));
        min(density * ((1.0 + x) * (1.0 + x)), f32::MAX)
    }
}

impl ColourConstants {
    /// F at ε = 1 − cosθd, as (f0 − f1) + (1 − f0) ε⁵ + f1 ε: no cancellation towards ε = 0.
    #[inline(always)]
    fn fresnel<A: Arithmetic>(&self, one_minus_cos_d: f32) -> f32 {
        let e = one_minus_cos_d;
        let e2 = e * e;
        let linear = A::mul_add(self.f1, e, self.fresnel_normal);
        A::mul_add(self.fresnel_schlick * e, e2 * e2, linear)
    }
}

/// The quantities of one pair that all lobes share.
#[derive(Clone, Copy, Debug)]
struct Shared {
    visible: bool,
    tan2_h: f32,
    one_minus_cos_d: f32,
    masking_i: f32,
    masking_o: f32,
    inv_cos_i: f32,
    inv_cos_o: f32,
}

impl Shared {
    #[inline(always)]
    fn new<A: Arithmetic, M: BatchMasking>(wi: [f32; 3], wo: [f32; 3]) -> Self {
        let [hx, hy, hz] = [wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]];
        let inv_hz = 1.0 / hz;
        let (slope_x, slope_y) = (hx * inv_hz, hy * inv_hz);
        let cos_d = 0.5 * A::mul_add(hx, hx, A::mul_add(hy, hy, hz * hz)).sqrt();
        Self {
            visible: above_horizon::<A>(wi) & above_horizon::<A>(wo),
            tan2_h: A::mul_add(slope_x, slope_x, slope_y * slope_y),
            one_minus_cos_d: max(1.0 - cos_d, 0.0),
            masking_i: M::coordinate::<A>(wi[2], sin_theta::<A>(wi)),
            masking_o: M::coordinate::<A>(wo[2], sin_theta::<A>(wo)),
            inv_cos_i: 1.0 / wi[2],
            inv_cos_o: 1.0 / wo[2],
        }
    }
}

/// As [`crate::math::direction::above_horizon`].
#[inline(always)]
fn above_horizon<A: Arithmetic>([x, y, z]: [f32; 3]) -> bool {
    let length2 = A::mul_add(x, x, A::mul_add(y, y, z * z));
    (z >= f32::MIN_POSITIVE) & ((length2 - 1.0).abs() <= 1e-2)
}

#[inline(always)]
fn sin_theta<A: Arithmetic>([x, y, _]: [f32; 3]) -> f32 {
    A::mul_add(x, x, y * y).sqrt()
}

/// The factors of a lobe that its colours share, for one pair.
#[derive(Clone, Copy, Debug)]
struct LobeAt {
    ndf: f32,
    g1_i: f32,
    g1_o: f32,
    /// (G1(wi)/cosθi) (G1(wo)/cosθo).
    visibility: f32,
}

impl LobeAt {
    #[inline(always)]
    fn new<A: Arithmetic, M: BatchMasking>(
        lobe: &LobeConstants,
        masking: &M,
        shared: &Shared,
    ) -> Self {
        let g1_i = masking.g1::<A>(shared.masking_i);
        let g1_o = masking.g1::<A>(shared.masking_o);
        let (v_i, v_o) = (g1_i * shared.inv_cos_i, g1_o * shared.inv_cos_o);
        Self { ndf: lobe.ndf::<A>(shared.tan2_h), g1_i, g1_o, visibility: v_i * v_o }
    }
}

/// (ρs/π) F D (G1(wi)/cosθi) (G1(wo)/cosθo) of one colour.
#[inline(always)]
fn specular<A: Arithmetic>(
    colour: &ColourConstants,
    one_minus_cos_d: f32,
    ndf: f32,
    visibility: f32,
) -> f32 {
    let specular = colour.specular * colour.fresnel::<A>(one_minus_cos_d) * ndf * visibility;
    max(min(specular, f32::MAX), -f32::MAX)
}

/// [`Shared`] for a block of pairs, array by array.
struct SharedBlock {
    visible: [u32; BLOCK],
    tan2_h: Lanes,
    one_minus_cos_d: Lanes,
    masking_i: Lanes,
    masking_o: Lanes,
    inv_cos_i: Lanes,
    inv_cos_o: Lanes,
}

impl SharedBlock {
    #[inline(always)]
    fn new<A: Arithmetic, M: BatchMasking>(wi: &[Lanes; 3], wo: &[Lanes; 3]) -> Self {
        let empty = [0.0; BLOCK];
        let mut block = Self {
            visible: [0; BLOCK],
            tan2_h: empty,
            one_minus_cos_d: empty,
            masking_i: empty,
            masking_o: empty,
            inv_cos_i: empty,
            inv_cos_o: empty,
        };
        for i in 0..BLOCK {
            let shared =
                Shared::new::<A, M>([wi[0][i], wi[1][i], wi[2][i]], [wo[0][i], wo[1][i], wo[2][i]]);
            block.visible[i] = u32::from(shared.visible);
            block.tan2_h[i] = shared.tan2_h;
            block.one_minus_cos_d[i] = shared.one_minus_cos_d;
            block.masking_i[i] = shared.masking_i;
            block.masking_o[i] = shared.masking_o;
            block.inv_cos_i[i] = shared.inv_cos_i;
            block.inv_cos_o[i] = shared.inv_cos_o;
        }
        block
    }

    #[inline(always)]
    fn lane(&self, i: usize) -> Shared {
        Shared {
            visible: self.visible[i] != 0,
            tan2_h: self.tan2_h[i],
            one_minus_cos_d: self.one_minus_cos_d[i],
            masking_i: self.masking_i[i],
            masking_o: self.masking_o[i],
            inv_cos_i: self.inv_cos_i[i],
            inv_cos_o: self.inv_cos_o[i],
        }
    }
}

/// f of every pair into `out`; all slices have one length.
#[inline(always)]
pub fn eval<A: Arithmetic, M: BatchMasking>(
    material: &Constants,
    maskings: &[M],
    pairs: &Pairs<'_>,
    out: &mut RgbMut<'_>,
) {
    let length = pairs.wi[0].len();
    for start in (0..length).step_by(BLOCK) {
        let count = BLOCK.min(length - start);
        let [wi, wo] = [load(pairs.wi, start, count), load(pairs.wo, start, count)];
        let shared = SharedBlock::new::<A, M>(&wi, &wo);
        let mut values = material.diffuse.map(|diffuse| [diffuse; BLOCK]);
        for (lobe, masking) in material.lobes.iter().zip(maskings) {
            add_lobe::<A, M>(lobe, masking, &shared, &mut values);
        }
        for (values, out) in values.iter_mut().zip(out.0.iter_mut()) {
            for (value, visible) in values.iter_mut().zip(&shared.visible) {
                *value = if *visible != 0 { *value } else { 0.0 };
            }
            out[start..start + count].copy_from_slice(&values[..count]);
        }
    }
}

/// Adds a lobe to the colours of a block of pairs.
#[inline(always)]
fn add_lobe<A: Arithmetic, M: BatchMasking>(
    lobe: &LobeConstants,
    masking: &M,
    shared: &SharedBlock,
    values: &mut [Lanes; 3],
) {
    let (mut ndf, mut visibility) = ([0.0; BLOCK], [0.0; BLOCK]);
    for i in 0..BLOCK {
        let at = LobeAt::new::<A, M>(lobe, masking, &shared.lane(i));
        (ndf[i], visibility[i]) = (at.ndf, at.visibility);
    }
    for (colour, values) in lobe.colours.iter().zip(values) {
        if colour.specular == 0.0 {
            continue;
        }
        for (i, value) in values.iter_mut().enumerate() {
            *value += specular::<A>(colour, shared.one_minus_cos_d[i], ndf[i], visibility[i]);
        }
    }
}

#[inline(always)]
fn load(components: [&[f32]; 3], start: usize, count: usize) -> [Lanes; 3] {
    let mut lanes = [[0.0; BLOCK]; 3];
    for (lanes, component) in lanes.iter_mut().zip(components) {
        lanes[..count].copy_from_slice(&component[start..start + count]);
    }
    lanes
}

/// Every factor for one pair, with the bits that [`eval`] gives.
#[inline(always)]
pub fn pair<A: Arithmetic, M: BatchMasking>(
    material: &Constants,
    maskings: &[M],
    wi: Vec3,
    wo: Vec3,
) -> Terms {
    let shared = Shared::new::<A, M>(wi.to_array(), wo.to_array());
    if !shared.visible {
        return Terms::default();
    }
    let (mut terms, mut brdf) = (Terms::default(), material.diffuse);
    let mut sums = [0.0_f32; 3];
    for ((lobe, masking), slot) in material.lobes.iter().zip(maskings).zip(&mut terms.lobes) {
        let at = LobeAt::new::<A, M>(lobe, masking, &shared);
        let mut fresnel = [0.0; 3];
        for c in 0..3 {
            let colour = &lobe.colours[c];
            fresnel[c] = colour.fresnel::<A>(shared.one_minus_cos_d).into();
            if colour.specular != 0.0 {
                let specular = specular::<A>(colour, shared.one_minus_cos_d, at.ndf, at.visibility);
                sums[c] += specular;
                brdf[c] += specular;
            }
        }
        *slot =
            LobeTerms { ndf: at.ndf.into(), g1_i: at.g1_i.into(), g1_o: at.g1_o.into(), fresnel };
    }
    Terms {
        specular: sums.map(f64::from),
        diffuse: material.diffuse.map(f64::from),
        brdf: brdf.map(f64::from),
        ..terms
    }
}

/// D, Λ, G1 and F of each lobe against one angle.
#[inline(always)]
pub fn curves<A: Arithmetic, M: BatchMasking>(
    material: &Constants,
    maskings: &[M],
    cos_theta: f32,
    sin_theta: f32,
) -> Vec<LobeCurves> {
    let tan_theta = sin_theta / cos_theta;
    let coordinate = M::coordinate::<A>(cos_theta, sin_theta);
    let of_lobe = |(lobe, masking): (&LobeConstants, &M)| {
        let g1 = masking.g1::<A>(coordinate);
        let fresnel = |c: usize| lobe.colours[c].fresnel::<A>(1.0 - cos_theta).into();
        LobeCurves {
            ndf: lobe.ndf::<A>(tan_theta * tan_theta).into(),
            lambda: (1.0 / g1 - 1.0).into(),
            g1: g1.into(),
            fresnel: std::array::from_fn(fresnel),
        }
    };
    material.lobes.iter().zip(maskings).map(of_lobe).collect()
}
