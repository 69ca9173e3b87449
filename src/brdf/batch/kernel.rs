//! One block of pairs through the formula, in straight loops: what the lobes share, then lobe by
//! lobe, and in each colour by colour.

use std::f64::consts::{FRAC_1_PI, LOG2_E};

use glam::Vec3;

use crate::brdf::batch::masking::{BatchMasking, Place};
use crate::brdf::batch::{Pairs, RgbMut};
use crate::brdf::{LobeCurves, LobeTerms, Terms};
use crate::material::{LobeParams, Material};
use crate::math::arithmetic::{Arithmetic, exp2, log2, max, min};
use crate::microfacet::SgdNdf;

/// Pairs that go through the formula together; every block is full, the last one padded, so a
/// pair's result does not depend on its place in a slice.
pub const BLOCK: usize = 128;

/// A value for each pair of a block.
pub type Lanes = [f32; BLOCK];

/// tan²θh beyond which D of every lobe that f32 can hold is 0; its square is still finite.
const LARGEST_TAN2: f32 = 1e15;
/// 1/α² at most: its product with [`LARGEST_TAN2`] is finite.
const LARGEST_INV_ALPHA2: f64 = 1e22;

/// A material's constants besides its masking, saturated to the range of f32.
#[derive(Clone, Debug, PartialEq)]
pub struct Constants {
    /// ρd/π per colour.
    pub(super) diffuse: [f32; 3],
    pub(super) lobes: Vec<LobeConstants>,
}

/// A lobe's constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LobeConstants {
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
            inv_alpha2: (1.0 / (alpha * alpha)).min(LARGEST_INV_ALPHA2) as f32,
            p: single(p),
            colours: [0, 1, 2].map(colour),
        }
    }

    /// D at x = tan²θ: peak · 2^(−x log₂e/α − p log₂(1 + x/α²)) · (1+x)².
    #[inline(always)]
    pub(super) fn ndf<A: Arithmetic>(&self, NormalAt { x, spread }: NormalAt) -> f32 {
        let power = self.p * log2::<A>(A::mul_add(x, self.inv_alpha2, 1.0));
        let density = self.peak * exp2::<A>(A::mul_add(-x, self.decay, -power));
        min(density * spread, f32::MAX)
    }

    /// Adds (ρs/π) F D (G1(wi)/cosθi) (G1(wo)/cosθo) of each colour; `shape` is that without ρs/π and F.
    #[inline(always)]
    pub(super) fn add<A: Arithmetic>(
        &self,
        shared: &SharedBlock,
        shape: &Lanes,
        values: &mut [Lanes; 3],
    ) {
        if self.colours.iter().all(|colour| colour.specular != 0.0) {
            return self.add_to_all::<A>(shared, shape, values);
        }
        for (colour, values) in self.colours.iter().zip(values) {
            if colour.specular == 0.0 {
                continue;
            }
            for (i, value) in values.iter_mut().enumerate() {
                *value += specular::<A>(colour, shared.fresnel(i), shape[i]);
            }
        }
    }

    /// As [`Self::add`], one loop for all colours: what they share is loaded once.
    #[inline(always)]
    fn add_to_all<A: Arithmetic>(
        &self,
        shared: &SharedBlock,
        shape: &Lanes,
        [r, g, b]: &mut [Lanes; 3],
    ) {
        let [of_r, of_g, of_b] = &self.colours;
        for i in 0..BLOCK {
            let (fresnel, shape) = (shared.fresnel(i), shape[i]);
            r[i] += specular::<A>(of_r, fresnel, shape);
            g[i] += specular::<A>(of_g, fresnel, shape);
            b[i] += specular::<A>(of_b, fresnel, shape);
        }
    }
}

impl ColourConstants {
    /// F at ε = 1 − cosθd, as (f0 − f1) + (1 − f0) ε⁵ + f1 ε: no cancellation towards ε = 0.
    #[inline(always)]
    fn fresnel<A: Arithmetic>(&self, fresnel: FresnelAt) -> f32 {
        let linear = A::mul_add(self.f1, fresnel.e, self.fresnel_normal);
        A::mul_add(self.fresnel_schlick, fresnel.e5, linear)
    }
}

/// x = tan²θh and (1+x)².
#[derive(Clone, Copy, Debug)]
pub(super) struct NormalAt {
    x: f32,
    spread: f32,
}

impl NormalAt {
    #[inline(always)]
    fn new(tan2_theta: f32) -> Self {
        let x = min(tan2_theta, LARGEST_TAN2);
        Self { x, spread: (1.0 + x) * (1.0 + x) }
    }
}

/// ε = 1 − cosθd and ε⁵.
#[derive(Clone, Copy, Debug)]
struct FresnelAt {
    e: f32,
    e5: f32,
}

impl FresnelAt {
    #[inline(always)]
    fn new(cos_d: f32) -> Self {
        let e = max(1.0 - cos_d, 0.0);
        let e2 = e * e;
        Self { e, e5: e * (e2 * e2) }
    }
}

/// The quantities of one pair that all lobes share.
#[derive(Clone, Copy, Debug)]
struct Shared {
    visible: bool,
    normal: NormalAt,
    fresnel: FresnelAt,
    masking_i: Place,
    masking_o: Place,
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
            normal: NormalAt::new(A::mul_add(slope_x, slope_x, slope_y * slope_y)),
            fresnel: FresnelAt::new(cos_d),
            masking_i: M::place::<A>(wi),
            masking_o: M::place::<A>(wo),
        }
    }
}

/// As [`crate::math::direction::above_horizon`].
#[inline(always)]
fn above_horizon<A: Arithmetic>([x, y, z]: [f32; 3]) -> bool {
    let length2 = A::mul_add(x, x, A::mul_add(y, y, z * z));
    (z >= f32::MIN_POSITIVE) & ((length2 - 1.0).abs() <= 1e-2)
}

/// (ρs/π) F D (G1(wi)/cosθi) (G1(wo)/cosθo) of one colour; `shape` is the product without ρs/π and F.
#[inline(always)]
fn specular<A: Arithmetic>(colour: &ColourConstants, fresnel: FresnelAt, shape: f32) -> f32 {
    let specular = colour.specular * colour.fresnel::<A>(fresnel) * shape;
    max(min(specular, f32::MAX), -f32::MAX)
}

/// [`Shared`] for a block of pairs, array by array.
pub(super) struct SharedBlock {
    visible: [u32; BLOCK],
    x: Lanes,
    spread: Lanes,
    e: Lanes,
    e5: Lanes,
    pub(super) masking_i: [Lanes; 2],
    pub(super) masking_o: [Lanes; 2],
}

impl SharedBlock {
    #[inline(always)]
    pub(super) fn empty() -> Self {
        Self {
            visible: [0; BLOCK],
            x: [0.0; BLOCK],
            spread: [0.0; BLOCK],
            e: [0.0; BLOCK],
            e5: [0.0; BLOCK],
            masking_i: [[0.0; BLOCK]; 2],
            masking_o: [[0.0; BLOCK]; 2],
        }
    }

    /// Overwritten where it lies: moving it would take as long as a fifth of the evaluation.
    #[inline(always)]
    pub(super) fn fill<A: Arithmetic, M: BatchMasking>(
        &mut self,
        wi: [&Lanes; 3],
        wo: [&Lanes; 3],
    ) {
        for i in 0..BLOCK {
            let shared =
                Shared::new::<A, M>([wi[0][i], wi[1][i], wi[2][i]], [wo[0][i], wo[1][i], wo[2][i]]);
            self.visible[i] = u32::from(shared.visible);
            self.x[i] = shared.normal.x;
            self.spread[i] = shared.normal.spread;
            self.e[i] = shared.fresnel.e;
            self.e5[i] = shared.fresnel.e5;
            [self.masking_i[0][i], self.masking_i[1][i]] = shared.masking_i;
            [self.masking_o[0][i], self.masking_o[1][i]] = shared.masking_o;
        }
    }

    #[inline(always)]
    pub(super) fn normal(&self, i: usize) -> NormalAt {
        NormalAt { x: self.x[i], spread: self.spread[i] }
    }

    /// The values of the first pairs, 0 where a direction is not above the horizon.
    #[inline(always)]
    pub(super) fn seen(&self, values: &Lanes, out: &mut [f32]) {
        for ((out, value), visible) in out.iter_mut().zip(values).zip(&self.visible) {
            *out = if *visible != 0 { *value } else { 0.0 };
        }
    }

    #[inline(always)]
    fn fresnel(&self, i: usize) -> FresnelAt {
        FresnelAt { e: self.e[i], e5: self.e5[i] }
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
    let mut shared = SharedBlock::empty();
    let mut padded = [[0.0; BLOCK]; 6];
    let mut values = [[0.0; BLOCK]; 3];
    for start in (0..length).step_by(BLOCK) {
        let count = BLOCK.min(length - start);
        if count < BLOCK {
            for (padded, component) in padded.iter_mut().zip(pairs.wi.iter().chain(&pairs.wo)) {
                *padded = [0.0; BLOCK];
                padded[..count].copy_from_slice(&component[start..]);
            }
        }
        let [ix, iy, iz, ox, oy, oz] = &padded;
        let [wi, wo] = [pairs.wi, pairs.wo].map(|w| w.map(|w| &w[start..]));
        let wi = [full(wi[0], ix), full(wi[1], iy), full(wi[2], iz)];
        let wo = [full(wo[0], ox), full(wo[1], oy), full(wo[2], oz)];
        shared.fill::<A, M>(wi, wo);
        for (values, diffuse) in values.iter_mut().zip(material.diffuse) {
            *values = [diffuse; BLOCK];
        }
        for (lobe, masking) in material.lobes.iter().zip(maskings) {
            add_lobe::<A, M>(lobe, masking, &shared, &mut values);
        }
        for (values, out) in values.iter().zip(out.0.iter_mut()) {
            shared.seen(values, &mut out[start..start + count]);
        }
    }
}

/// The block at the start of `rest`, or `padded` where the rest is shorter.
#[inline(always)]
fn full<'a>(rest: &'a [f32], padded: &'a Lanes) -> &'a Lanes {
    rest.first_chunk().unwrap_or(padded)
}

/// Adds a lobe to the colours of a block of pairs.
#[inline(always)]
fn add_lobe<A: Arithmetic, M: BatchMasking>(
    lobe: &LobeConstants,
    masking: &M,
    shared: &SharedBlock,
    values: &mut [Lanes; 3],
) {
    let mut shape = [0.0; BLOCK];
    masking.visibilities::<A>(&shared.masking_i, &shared.masking_o, &mut shape);
    for (i, shape) in shape.iter_mut().enumerate() {
        *shape *= lobe.ndf::<A>(shared.normal(i));
    }
    lobe.add::<A>(shared, &shape, values);
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
        let ndf = lobe.ndf::<A>(shared.normal);
        let shape = masking.visibility::<A>(shared.masking_i, shared.masking_o) * ndf;
        for (c, colour) in lobe.colours.iter().enumerate() {
            slot.fresnel[c] = colour.fresnel::<A>(shared.fresnel).into();
            if colour.specular != 0.0 {
                let specular = specular::<A>(colour, shared.fresnel, shape);
                sums[c] += specular;
                brdf[c] += specular;
            }
        }
        let [g1_i, g1_o] = [shared.masking_i, shared.masking_o].map(|at| masking.g1::<A>(at));
        *slot = LobeTerms { ndf: ndf.into(), g1_i: g1_i.into(), g1_o: g1_o.into(), ..*slot };
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
    let place = M::place::<A>([sin_theta, 0.0, cos_theta]);
    let of_lobe = |(lobe, masking): (&LobeConstants, &M)| {
        let g1 = masking.g1::<A>(place);
        let at = FresnelAt::new(cos_theta);
        let fresnel = |c: usize| lobe.colours[c].fresnel::<A>(at).into();
        LobeCurves {
            ndf: lobe.ndf::<A>(NormalAt::new(tan_theta * tan_theta)).into(),
            lambda: (1.0 / g1 - 1.0).into(),
            g1: g1.into(),
            fresnel: std::array::from_fn(fresnel),
        }
    };
    material.lobes.iter().zip(maskings).map(of_lobe).collect()
}
