//! Probes: pairs of directions at which a decoded reflectance is held against the exact one.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use glam::DVec3;

use crate::brdf::ChannelBrdf;
use crate::brdf::eval::{above_horizon, cos_theta_d};
use crate::math::direction::{cos_theta, cot_theta, from_cos_sin, half_sum, spherical, tan2_theta};

/// Viewers that a set of probes covers.
const VIEWERS: usize = 40;
/// Half vectors per viewer, from the lobe's centre to its end.
const HALF_VECTORS: usize = 72;
/// Lights per viewer spread over the whole hemisphere.
const LIGHTS: usize = 12;

/// One pair of directions and the exact values there.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// tan²θh.
    pub tan2_theta_h: f64,
    /// cosθd.
    pub cos_theta_d: f64,
    /// cotθ of the light and the viewer.
    pub cot_theta: [f64; 2],
    /// cosθ of the light and the viewer.
    pub cos_theta: [f64; 2],
    /// Exact values per channel.
    pub exact: [Exact; 3],
}

impl Probe {
    /// |cosφd| of the difference vector: 2 sinθh sinθd |cosφd| = |cosθi − cosθo|.
    #[must_use]
    pub fn abs_cos_phi_d(&self) -> f64 {
        let sin2_theta_h = self.tan2_theta_h / (1.0 + self.tan2_theta_h);
        let sin2_theta_d = ((1.0 - self.cos_theta_d) * (1.0 + self.cos_theta_d)).max(0.0);
        let [cos_i, cos_o] = self.cos_theta;
        let cos = 0.5 * (cos_i - cos_o).abs() / (sin2_theta_h * sin2_theta_d).sqrt();
        if cos.is_nan() { 0.0 } else { cos.min(1.0) }
    }
}

/// The exact factors of one channel at a probe, and what an error there is measured by.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exact {
    /// D(h).
    pub ndf: f64,
    /// F(cosθd).
    pub fresnel: f64,
    /// G1 of the light and the viewer.
    pub g1: [f64; 2],
    /// ρs/(π cosθo): what the product of the factors is multiplied by for f_specular·cosθi.
    pub scale: f64,
    /// f_specular·cosθi.
    pub specular: f64,
    /// |f|·cosθi.
    pub reflected: f64,
    /// max over wi of |f|cosθi for this wo, plus |f|cosθi.
    pub bound: f64,
}

impl Exact {
    /// The error of a decoded f_specular·cosθi: |f_lut − f|cosθi over
    /// max_wi |f|cosθi + |f|cosθi.
    #[must_use]
    pub fn error(&self, decoded: f64) -> f64 {
        self.error_of((decoded - self.specular).abs())
    }

    /// The same of a difference |f_lut − f|cosθi.
    #[must_use]
    pub fn error_of(&self, difference: f64) -> f64 {
        if difference == 0.0 { 0.0 } else { difference / self.bound }
    }
}

/// The region in which the probes of a material lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// tan²θh of the innermost and outermost half vectors.
    pub tan2_theta_h: [f64; 2],
    /// cotθ around which grazing viewers lie.
    pub grazing: f64,
}

impl Reach {
    /// The reach of channels of these widths: from well inside the sharpest peak to where the
    /// widest has vanished.
    #[must_use]
    pub fn new(channels: &[ChannelBrdf; 3]) -> Self {
        let alphas = channels.each_ref().map(|channel| channel.ndf.alpha());
        let sharpest = alphas.into_iter().fold(f64::INFINITY, f64::min);
        let widest = alphas.into_iter().fold(0.0, f64::max);
        Self {
            tan2_theta_h: [0.1 * sharpest * sharpest.min(0.1), 60.0 * widest],
            grazing: sharpest.sqrt().min(1.0),
        }
    }
}

/// The probes of a material; another `seed` gives others.
///
/// Viewers lie evenly in θo and, half of them, evenly in the logarithm of cotθo down to grazing;
/// for each, half vectors lie evenly in the logarithm of tan²θh and lights over the hemisphere.
/// The largest |f|cosθi met for a viewer stands for the maximum over wi: never above it, so an
/// error is never understated.
#[must_use]
pub fn probes(channels: &[ChannelBrdf; 3], seed: usize) -> Vec<Probe> {
    let reach = Reach::new(channels);
    (0..VIEWERS)
        .flat_map(|viewer| {
            let index = seed * VIEWERS + viewer;
            let wo = viewer_direction(viewer, index, reach.grazing);
            of_viewer(channels, wo, lights(wo, index, &reach))
        })
        .collect()
}

fn viewer_direction(viewer: usize, index: usize, grazing: f64) -> DVec3 {
    let offset = (viewer / 2) as f64 + spread(index, 0);
    let fraction = offset / (VIEWERS / 2) as f64;
    if viewer.is_multiple_of(2) {
        return spherical(fraction * FRAC_PI_2 * 0.9999, 0.0);
    }
    let cot = grazing * 10f64.powf(4.5 * fraction - 3.0);
    let sin = 1.0 / cot.hypot(1.0);
    from_cos_sin(cot * sin, sin, 0.0)
}

/// The lights of a viewer: mirrored in half vectors, and all over the hemisphere.
fn lights(wo: DVec3, index: usize, reach: &Reach) -> impl Iterator<Item = DVec3> {
    let [inner, outer] = reach.tan2_theta_h.map(f64::ln);
    let mirrored = (0..HALF_VECTORS).map(move |k| {
        let (a, b) = (spread(index * HALF_VECTORS + k, 1), spread(index * HALF_VECTORS + k, 2));
        let tan = (0.5 * (inner + (outer - inner) * (k as f64 + a) / HALF_VECTORS as f64)).exp();
        // In the plane of incidence, where a grazing viewer's maximum lies, every fourth time.
        let phi = if k.is_multiple_of(4) { (k / 4 % 2) as f64 * PI } else { b * PI };
        let (sin_phi, cos_phi) = phi.sin_cos();
        let h = DVec3::new(tan * cos_phi, tan * sin_phi, 1.0).normalize();
        2.0 * wo.dot(h) * h - wo
    });
    let anywhere = (0..LIGHTS).map(move |k| {
        let (a, b) = (spread(index * LIGHTS + k, 3), spread(index * LIGHTS + k, 4));
        spherical((k as f64 + a) / LIGHTS as f64 * FRAC_PI_2, b * PI)
    });
    let mirror = DVec3::new(-wo.x, -wo.y, wo.z);
    std::iter::once(mirror).chain(mirrored).chain(anywhere).filter(|wi| above_horizon(*wi))
}

/// A Kronecker sequence: the k-th of numbers that fill \[0, 1) evenly, one for each dimension.
fn spread(k: usize, dimension: usize) -> f64 {
    const IRRATIONAL: [f64; 5] = [
        0.618_033_988_749_895,
        0.754_877_666_246_693,
        0.569_840_290_998_053,
        0.414_213_562_373_095,
        0.732_050_807_568_877,
    ];
    (k as f64 * IRRATIONAL[dimension] + 0.37).fract()
}

/// The probes of one viewer, their bounds set from the largest value met.
fn of_viewer(
    channels: &[ChannelBrdf; 3],
    wo: DVec3,
    lights: impl Iterator<Item = DVec3>,
) -> Vec<Probe> {
    let g1_o = channels.each_ref().map(|channel| channel.masking.g1(cot_theta(wo)));
    let mut probes: Vec<Probe> = lights.map(|wi| probe(channels, wi, wo, g1_o)).collect();
    for c in 0..3 {
        let largest = probes.iter().map(|probe| probe.exact[c].reflected).fold(0.0, f64::max);
        for probe in &mut probes {
            probe.exact[c].bound = largest + probe.exact[c].reflected;
        }
    }
    probes
}

fn probe(channels: &[ChannelBrdf; 3], wi: DVec3, wo: DVec3, g1_o: [f64; 3]) -> Probe {
    let h = half_sum(wi, wo);
    let (tan2_theta_h, cos_theta_d) = (tan2_theta(h), cos_theta_d(h));
    let cot_theta = [wi, wo].map(cot_theta);
    let cos_theta = [wi, wo].map(cos_theta);
    let exact = std::array::from_fn(|c| {
        let channel = &channels[c];
        let ndf = channel.ndf.eval(tan2_theta_h);
        let fresnel = channel.fresnel.eval(cos_theta_d);
        let g1 = [channel.masking.g1(cot_theta[0]), g1_o[c]];
        let scale = channel.rho_s * FRAC_1_PI / cos_theta[1];
        let specular = scale * fresnel * ndf * g1[0] * g1[1];
        let reflected = (channel.rho_d * FRAC_1_PI * cos_theta[0] + specular).abs();
        Exact { ndf, fresnel, g1, scale, specular, reflected, bound: 0.0 }
    });
    Probe { tan2_theta_h, cos_theta_d, cot_theta, cos_theta, exact }
}
