//! One block of pairs through the formula, in straight loops: what the lobes share, then lobe by
//! lobe, and in each colour by colour.

use glam::Vec3;

use crate::brdf::batch::block::{BLOCK, PerPair};
use crate::brdf::batch::constants::{
    Constants, FresnelAt, FresnelConstants, LobeConstants, NormalAt,
};
use crate::brdf::batch::masking::{BatchMasking, Place};
use crate::brdf::batch::{Pairs, RgbMut};
use crate::brdf::{LobeCurves, LobeTerms, Terms};
use crate::material::MAX_LOBES;
use crate::math::arithmetic::{Arithmetic, max, min};

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

/// A sum of lobes within the range of f32.
#[inline(always)]
fn saturated(sum: f32) -> f32 {
    max(min(sum, f32::MAX), -f32::MAX)
}

/// [`Shared`] for a block of pairs, array by array.
pub(super) struct SharedBlock {
    visible: [u32; BLOCK],
    x: PerPair,
    spread: PerPair,
    e: PerPair,
    e5: PerPair,
    pub(super) masking_i: [PerPair; 2],
    pub(super) masking_o: [PerPair; 2],
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
        wi: [&PerPair; 3],
        wo: [&PerPair; 3],
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
    pub(super) fn seen(&self, values: &PerPair, out: &mut [f32]) {
        for ((out, value), visible) in out.iter_mut().zip(values).zip(&self.visible) {
            *out = if *visible != 0 { saturated(*value) } else { 0.0 };
        }
    }

    /// 0 where a direction is not above the horizon; saturated elsewhere.
    #[inline(always)]
    pub(super) fn clear_hidden(&self, values: &mut PerPair) {
        for (value, visible) in values.iter_mut().zip(&self.visible) {
            *value = if *visible != 0 { saturated(*value) } else { 0.0 };
        }
    }

    #[inline(always)]
    fn fresnel(&self, i: usize) -> FresnelAt {
        FresnelAt { e: self.e[i], e5: self.e5[i] }
    }
}

impl Constants {
    /// f of a block of pairs; `shapes` are D (G1(wi)/cosθi) (G1(wo)/cosθo) of the lobes.
    #[inline(always)]
    pub(super) fn colour<A: Arithmetic>(
        &self,
        shared: &SharedBlock,
        shapes: &[PerPair; MAX_LOBES],
        values: &mut [PerPair; 3],
    ) {
        match self.full.as_deref() {
            Some([one]) => coloured::<A, 1>(self.diffuse, &[*one], shared, shapes, values),
            Some([a, b]) => coloured::<A, 2>(self.diffuse, &[*a, *b], shared, shapes, values),
            _ => {
                *values = self.diffuse.map(|diffuse| [diffuse; BLOCK]);
                for (lobe, shape) in self.lobes.iter().zip(shapes) {
                    add::<A>(lobe, shared, shape, values);
                }
            }
        }
    }
}

/// Adds (ρs/π) F D (G1(wi)/cosθi) (G1(wo)/cosθo) of each colour of a lobe; `shape` is that without ρs/π
/// and F.
#[inline(always)]
fn add<A: Arithmetic>(
    lobe: &LobeConstants,
    shared: &SharedBlock,
    shape: &PerPair,
    values: &mut [PerPair; 3],
) {
    for (colour, values) in lobe.colours.iter().zip(values) {
        let Some(specular) = colour.specular else { continue };
        for (i, value) in values.iter_mut().enumerate() {
            *value = A::mul_add(specular.at::<A>(shared.fresnel(i)), shape[i], *value);
        }
    }
}

/// ρd/π + Σ (ρs/π) F D (G1(wi)/cosθi) (G1(wo)/cosθo) of `N` lobes that colour all channels, in one
/// loop: what lobes and colours share is loaded once.
#[inline(always)]
fn coloured<A: Arithmetic, const N: usize>(
    diffuse: [f32; 3],
    lobes: &[[FresnelConstants; 3]; N],
    shared: &SharedBlock,
    shapes: &[PerPair; MAX_LOBES],
    [r, g, b]: &mut [PerPair; 3],
) {
    for i in 0..BLOCK {
        let fresnel = shared.fresnel(i);
        let [mut sum_r, mut sum_g, mut sum_b] = diffuse;
        for ([of_r, of_g, of_b], shape) in lobes.iter().zip(shapes) {
            sum_r = A::mul_add(of_r.at::<A>(fresnel), shape[i], sum_r);
            sum_g = A::mul_add(of_g.at::<A>(fresnel), shape[i], sum_g);
            sum_b = A::mul_add(of_b.at::<A>(fresnel), shape[i], sum_b);
        }
        (r[i], g[i], b[i]) = (sum_r, sum_g, sum_b);
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
    let mut shapes = [[0.0; BLOCK]; MAX_LOBES];
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
        for ((lobe, masking), shape) in material.lobes.iter().zip(maskings).zip(&mut shapes) {
            fill_shape::<A, M>(lobe, masking, &shared, shape);
        }
        material.colour::<A>(&shared, &shapes, &mut values);
        for (values, out) in values.iter().zip(out.0.iter_mut()) {
            shared.seen(values, &mut out[start..start + count]);
        }
    }
}

/// The block at the start of `rest`, or `padded` where the rest is shorter.
#[inline(always)]
fn full<'a>(rest: &'a [f32], padded: &'a PerPair) -> &'a PerPair {
    rest.first_chunk().unwrap_or(padded)
}

/// D (G1(wi)/cosθi) (G1(wo)/cosθo) of a lobe for a block of pairs.
#[inline(always)]
fn fill_shape<A: Arithmetic, M: BatchMasking>(
    lobe: &LobeConstants,
    masking: &M,
    shared: &SharedBlock,
    shape: &mut PerPair,
) {
    masking.visibilities::<A>(&shared.masking_i, &shared.masking_o, shape);
    for (i, shape) in shape.iter_mut().enumerate() {
        *shape *= lobe.ndf::<A>(shared.normal(i));
    }
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
            slot.fresnel[c] = colour.fresnel.at::<A>(shared.fresnel).into();
            if let Some(specular) = colour.specular {
                let specular = specular.at::<A>(shared.fresnel);
                sums[c] = A::mul_add(specular, shape, sums[c]);
                brdf[c] = A::mul_add(specular, shape, brdf[c]);
            }
        }
        let [g1_i, g1_o] = [shared.masking_i, shared.masking_o].map(|at| masking.g1::<A>(at));
        *slot = LobeTerms { ndf: ndf.into(), g1_i: g1_i.into(), g1_o: g1_o.into(), ..*slot };
    }
    Terms {
        specular: sums.map(saturated).map(f64::from),
        diffuse: material.diffuse.map(f64::from),
        brdf: brdf.map(saturated).map(f64::from),
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
        let fresnel = |c: usize| lobe.colours[c].fresnel.at::<A>(at).into();
        LobeCurves {
            ndf: lobe.ndf::<A>(NormalAt::new(tan_theta * tan_theta)).into(),
            lambda: (1.0 / g1 - 1.0).into(),
            g1: g1.into(),
            fresnel: std::array::from_fn(fresnel),
        }
    };
    material.lobes.iter().zip(maskings).map(of_lobe).collect()
}
