//! What a picture of a lobe shows: the weights of angles in a fit of the distribution.

use crate::brdf::lobes::Lobes;
use crate::material::ChannelParams;
use crate::microfacet::{BeckmannMixture, SgdNdf};

/// How much a relative error in the flanks counts next to the picture's.
const FLANKS: f64 = 0.3;

/// How much a relative error of a channel's own distribution counts: it decides where the channel
/// is invisible.
const OWN: f64 = 0.01;

/// Share of the peak below which a distribution counts as vanished.
const FLOOR: f64 = 1e-7;

/// (D, 1) at each angle times its scale, √((rho_s F̄ w)² + ([`OWN`]/D)²) with the weight w of the
/// angle; per channel.
///
/// The squares of D_fit − D times the scale, summed over angles spaced by ln θ, are the error of a
/// picture of the lobe under a sun.
#[must_use]
pub fn goals(channels: &[ChannelParams; 3], tan2_theta: &[f64]) -> [Vec<(f64, f64)>; 3] {
    let weights = weights(channels, tan2_theta);
    channels.each_ref().map(|c| {
        let (ndf, specular) = (SgdNdf::new(c.alpha, c.p), specular(c));
        let at = |(x, weight): (&f64, &f64)| {
            let d = ndf.eval(*x);
            let scale = (specular * weight).hypot(OWN / (d + FLOOR * ndf.peak()));
            (scale * d, scale)
        };
        tan2_theta.iter().zip(&weights).map(at).collect()
    })
}

/// The weight of each angle, B the brightness there and x = tan²θ:
/// w² = x/⟨x B²⟩ + [`FLANKS`]²/B².
///
/// Where angles are spaced by ln θ, the first term makes the sum of squares the mean square error
/// by area, relative to the picture's mean square; the second holds the relative error of the
/// flanks, which are all that is seen where pixels are wider than the peak.
fn weights(channels: &[ChannelParams; 3], tan2_theta: &[f64]) -> Vec<f64> {
    let brightness: Vec<f64> = tan2_theta.iter().map(|x| brightness(channels, *x)).collect();
    let by_area: f64 = tan2_theta.iter().zip(&brightness).map(|(x, b)| x * b * b).sum();
    let mean = by_area / tan2_theta.len() as f64;
    let weight = |(x, b): (&f64, &f64)| (x / mean + (FLANKS / b).powi(2)).sqrt();
    tan2_theta.iter().zip(&brightness).map(weight).collect()
}

/// How far a picture of fitted lobes under a sun is off, its peak resolved, relative to the picture:
/// √(∫ Σ_c (ρs F̄ (D_fit − D))² dA / ∫ 3 B² dA).
#[must_use]
pub fn error(channels: &[ChannelParams; 3], fitted: &Lobes) -> f64 {
    // tan²θ from where the sharpest peak is flat to 55°, past the widest.
    const SMALLEST: f64 = 1e-9;
    const STEP: f64 = 1.055;
    const STEPS: i32 = 400;
    let mixtures: [_; 3] = std::array::from_fn(|c| (fitted.channel(c), &channels[c]));
    let difference = |x: f64| -> f64 {
        let of_channel = |(mixture, c): &(BeckmannMixture, &ChannelParams)| {
            (specular(c) * (mixture.ndf(x) - SgdNdf::new(c.alpha, c.p).eval(x))).powi(2)
        };
        mixtures.iter().map(of_channel).sum()
    };
    let angles = (0..STEPS).map(|i| SMALLEST * STEP.powi(i));
    let [off, whole] = angles.fold([0.0, 0.0], |[off, whole], x| {
        [off + x * difference(x), whole + x * 3.0 * brightness(channels, x).powi(2)]
    });
    (off / whole).sqrt()
}

/// √(mean over channels of (rho_d + rho_s F̄ D)²), with a floor far below the peak.
fn brightness(channels: &[ChannelParams; 3], tan2_theta: f64) -> f64 {
    let square = |c: &ChannelParams| {
        let ndf = SgdNdf::new(c.alpha, c.p);
        let d = ndf.eval(tan2_theta) + FLOOR * ndf.peak();
        (c.rho_d + specular(c) * d).powi(2)
    };
    (channels.iter().map(square).sum::<f64>() / 3.0).sqrt().max(f64::MIN_POSITIVE.sqrt())
}

/// rho_s F̄ with the mean Fresnel factor F̄ = ∫₀¹ F(c) 2c dc, which no fit has below 0 by much.
fn specular(c: &ChannelParams) -> f64 {
    let mean = c.f0 + (1.0 - c.f0) / 21.0 - c.f1 * 2.0 / 3.0;
    c.rho_s * mean.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::lobes;
    use crate::material::catalog;

    #[test]
    fn seven_lobes_look_like_the_material_within_two_percent() {
        for entry in catalog().iter().step_by(4) {
            let channels = &entry.material.channels;
            let error = error(channels, &lobes::lobes(&entry.material, 7));
            assert!(error <= 0.02, "{}: {error}", entry.material.name);
        }
    }
}
