//! One block of pairs through the formula, in straight loops: first what the channels share, then
//! channel by channel.

use std::f64::consts::{FRAC_1_PI, LOG2_E};

use glam::Vec3;

use crate::brdf::batch::masking::BatchMasking;
use crate::brdf::batch::{Pairs, RgbMut};
use crate::brdf::eval::{Factors, Terms};
use crate::material::ChannelParams;
use crate::math::arithmetic::{Arithmetic, exp2, log2, max, min};
use crate::microfacet::SgdNdf;

/// Pairs that go through the formula together; every block is full, the last one padded, so a
/// pair's result does not depend on its place in a slice.
pub const BLOCK: usize = 128;

type Lanes = [f32; BLOCK];

/// tan²θh beyond which D of every lobe that f32 can hold is 0; its square is still finite.
const LARGEST_TAN2: f32 = 1e15;

/// One channel's constants besides its masking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelConstants {
    /// ρd/π.
    diffuse: f32,
    /// ρs/π.
    specular: f32,
    /// D at θ = 0.
    peak: f32,
    /// log₂e/α.
    decay: f32,
    /// 1/α².
    inv_alpha2: f32,
    p: f32,
    /// F(0°) = f0 − f1.
    fresnel_normal: f32,
    /// 1 − f0.
    fresnel_schlick: f32,
    f1: f32,
}

impl ChannelConstants {
    /// The constants of a channel, saturated to the range of f32.
    #[must_use]
    pub fn new(params: &ChannelParams) -> Self {
        let single = |value: f64| value.clamp(-1e38, 1e38) as f32;
        let ChannelParams { rho_d, rho_s, alpha, p, f0, f1, .. } = *params;
        Self {
            diffuse: single(rho_d * FRAC_1_PI),
            specular: single(rho_s * FRAC_1_PI),
            peak: single(SgdNdf::new(alpha, p).peak()),
            decay: single(LOG2_E / alpha),
            inv_alpha2: single(1.0 / (alpha * alpha)),
            p: single(p),
            fresnel_normal: single(f0 - f1),
            fresnel_schlick: single(1.0 - f0),
            f1: single(f1),
        }
    }

    /// D at x = tan²θ: peak · 2^(−x log₂e/α − p log₂(1 + x/α²)) · (1+x)².
    #[inline(always)]
    pub fn ndf<A: Arithmetic>(&self, tan2_theta: f32) -> f32 {
        let x = min(tan2_theta, LARGEST_TAN2);
        let power = self.p * log2::<A>(min(A::mul_add(x, self.inv_alpha2, 1.0), f32::MAX));
        let density = self.peak * exp2::<A>(A::mul_add(-x, self.decay, -power));
        min(density * ((1.0 + x) * (1.0 + x)), f32::MAX)
    }

    /// F at ε = 1 − cosθd, as (f0 − f1) + (1 − f0) ε⁵ + f1 ε: no cancellation towards ε = 0.
    #[inline(always)]
    pub fn fresnel<A: Arithmetic>(&self, one_minus_cos_d: f32) -> f32 {
        let e = one_minus_cos_d;
        let e2 = e * e;
        let linear = A::mul_add(self.f1, e, self.fresnel_normal);
        A::mul_add(self.fresnel_schlick * e, e2 * e2, linear)
    }
}

/// What the three channels share about one pair.
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

/// As [`crate::brdf::eval::above_horizon`].
#[inline(always)]
fn above_horizon<A: Arithmetic>([x, y, z]: [f32; 3]) -> bool {
    let length2 = A::mul_add(x, x, A::mul_add(y, y, z * z));
    (z >= f32::MIN_POSITIVE) & ((length2 - 1.0).abs() <= 1e-2)
}

#[inline(always)]
fn sin_theta<A: Arithmetic>([x, y, _]: [f32; 3]) -> f32 {
    A::mul_add(x, x, y * y).sqrt()
}

/// The printed equation for one channel and pair; 0 where either direction is below the horizon.
#[inline(always)]
fn terms<A: Arithmetic, M: BatchMasking>(
    channel: &ChannelConstants,
    masking: &M,
    shared: &Shared,
) -> [f32; 7] {
    let ndf = channel.ndf::<A>(shared.tan2_h);
    let fresnel = channel.fresnel::<A>(shared.one_minus_cos_d);
    let g1_i = masking.g1::<A>(shared.masking_i);
    let g1_o = masking.g1::<A>(shared.masking_o);
    let (v_i, v_o) = (g1_i * shared.inv_cos_i, g1_o * shared.inv_cos_o);
    let specular = channel.specular * fresnel * ndf * (v_i * v_o);
    let specular = max(min(specular, f32::MAX), -f32::MAX);
    let brdf = channel.diffuse + specular;
    // Not mapped: what an array's map becomes stops the loop around it from being vectorised, or
    // does not, as the rest of the crate is compiled.
    let shown = |term: f32| if shared.visible { term } else { 0.0 };
    [
        shown(ndf),
        shown(g1_i),
        shown(g1_o),
        shown(fresnel),
        shown(specular),
        shown(channel.diffuse),
        shown(brdf),
    ]
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
    channels: &[ChannelConstants; 3],
    maskings: &[M; 3],
    pairs: &Pairs<'_>,
    out: &mut RgbMut<'_>,
) {
    let length = pairs.wi[0].len();
    for start in (0..length).step_by(BLOCK) {
        let count = BLOCK.min(length - start);
        let [wi, wo] = [load(pairs.wi, start, count), load(pairs.wo, start, count)];
        let shared = SharedBlock::new::<A, M>(&wi, &wo);
        for (c, out) in out.0.iter_mut().enumerate() {
            let mut values = [0.0; BLOCK];
            for (i, value) in values.iter_mut().enumerate() {
                *value = terms::<A, M>(&channels[c], &maskings[c], &shared.lane(i))[6];
            }
            out[start..start + count].copy_from_slice(&values[..count]);
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
    channels: &[ChannelConstants; 3],
    maskings: &[M; 3],
    wi: Vec3,
    wo: Vec3,
) -> [Terms; 3] {
    let shared = Shared::new::<A, M>(wi.to_array(), wo.to_array());
    std::array::from_fn(|c| {
        let [ndf, g1_i, g1_o, fresnel, specular, diffuse, brdf] =
            terms::<A, M>(&channels[c], &maskings[c], &shared).map(f64::from);
        Terms { ndf, g1_i, g1_o, fresnel, specular, diffuse, brdf }
    })
}

/// D, Λ, G1 and F against one angle.
#[inline(always)]
pub fn factors<A: Arithmetic, M: BatchMasking>(
    channels: &[ChannelConstants; 3],
    maskings: &[M; 3],
    cos_theta: f32,
    sin_theta: f32,
) -> [Factors; 3] {
    let tan_theta = sin_theta / cos_theta;
    let coordinate = M::coordinate::<A>(cos_theta, sin_theta);
    std::array::from_fn(|c| {
        let ndf = channels[c].ndf::<A>(tan_theta * tan_theta).into();
        let g1 = maskings[c].g1::<A>(coordinate);
        let lambda = (1.0 / g1 - 1.0).into();
        let fresnel = channels[c].fresnel::<A>(1.0 - cos_theta).into();
        Factors { ndf, lambda, g1: g1.into(), fresnel }
    })
}
