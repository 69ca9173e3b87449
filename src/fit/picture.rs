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
    let shown = channels.each_ref().map(Shown::new);
    let weights = weights(&shown, tan2_theta);
    shown.each_ref().map(|channel| {
        let at = |(x, weight): (&f64, &f64)| {
            let d = channel.ndf.eval(*x);
            let scale = (channel.specular * weight).hypot(OWN / (d + FLOOR * channel.ndf.peak()));
            (scale * d, scale)
        };
        tan2_theta.iter().zip(&weights).map(at).collect()
    })
}

/// How far a picture of fitted lobes under a sun is off, its peak resolved, relative to the picture:
/// √(∫ Σ_c (ρs F̄ (D_fit − D))² dA / ∫ 3 B² dA).
#[must_use]
pub fn error(channels: &[ChannelParams; 3], fitted: &Lobes) -> f64 {
    // tan²θ from where the sharpest peak is flat to 55°, past the widest.
    const SMALLEST: f64 = 1e-9;
    const STEP: f64 = 1.055;
    const STEPS: i32 = 400;
    let shown = channels.each_ref().map(Shown::new);
    let mixtures: [_; 3] = std::array::from_fn(|c| fitted.channel(c));
    let difference = |x: f64| -> f64 {
        let of_channel = |(mixture, channel): (&BeckmannMixture, &Shown)| {
            (channel.specular * (mixture.ndf(x) - channel.ndf.eval(x))).powi(2)
        };
        mixtures.iter().zip(&shown).map(of_channel).sum()
    };
    let angles = (0..STEPS).map(|i| SMALLEST * STEP.powi(i));
    let [off, whole] = angles.fold([0.0, 0.0], |[off, whole], x| {
        [off + x * difference(x), whole + x * 3.0 * brightness(&shown, x).powi(2)]
    });
    (off / whole).sqrt()
}

/// What a picture shows of a channel.
struct Shown {
    rho_d: f64,
    /// rho_s F̄ with the mean Fresnel factor F̄ = ∫₀¹ F(c) 2c dc, which no fit has below 0 by much.
    specular: f64,
    ndf: SgdNdf,
}

impl Shown {
    fn new(c: &ChannelParams) -> Self {
        let mean = c.f0 + (1.0 - c.f0) / 21.0 - c.f1 * 2.0 / 3.0;
        let specular = c.rho_s * mean.max(0.0);
        Self { rho_d: c.rho_d, specular, ndf: SgdNdf::new(c.alpha, c.p) }
    }
}

/// The weight of each angle, B the brightness there and x = tan²θ:
/// w² = x/⟨x B²⟩ + [`FLANKS`]²/B².
///
/// Where angles are spaced by ln θ, the first term makes the sum of squares the mean square error
/// by area, relative to the picture's mean square; the second holds the relative error of the
/// flanks, which are all that is seen where pixels are wider than the peak.
fn weights(shown: &[Shown; 3], tan2_theta: &[f64]) -> Vec<f64> {
    let brightness: Vec<f64> = tan2_theta.iter().map(|x| brightness(shown, *x)).collect();
    let by_area: f64 = tan2_theta.iter().zip(&brightness).map(|(x, b)| x * b * b).sum();
    let mean = by_area / tan2_theta.len() as f64;
    let weight = |(x, b): (&f64, &f64)| (x / mean + (FLANKS / b).powi(2)).sqrt();
    tan2_theta.iter().zip(&brightness).map(weight).collect()
}

/// √(mean over channels of (rho_d + rho_s F̄ D)²), with a floor far below the peak.
fn brightness(shown: &[Shown; 3], tan2_theta: f64) -> f64 {
    let square = |channel: &Shown| {
        let d = channel.ndf.eval(tan2_theta) + FLOOR * channel.ndf.peak();
        (channel.rho_d + channel.specular * d).powi(2)
    };
    (shown.iter().map(square).sum::<f64>() / 3.0).sqrt().max(f64::MIN_POSITIVE.sqrt())
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
