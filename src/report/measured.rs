//! The audit of a measurement: coverage, noise, reciprocity and energy.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::brdf::Reflectance;
use crate::material::Channel;
use crate::math::direction::{above_horizon, spherical};
use crate::measurement::symmetry::Spread;
use crate::measurement::{Format, Measurement, Sample};
use crate::report::audit::AlbedoAt;

/// The audit of a measurement.
#[derive(Clone, Debug, Serialize)]
pub struct MeasuredAudit {
    /// Its name.
    pub measurement: String,
    /// Its format.
    pub format: Format,
    /// Measured values.
    pub samples: usize,
    /// The share of all pairs of directions, by solid angle, that they stand for.
    pub coverage: f64,
    /// Noise and reciprocity by elevation.
    pub bands: Vec<Band>,
    /// Energy of the channels in the order r, g, b.
    pub channels: [Energy; 3],
}

/// Samples of about one elevation.
#[derive(Clone, Debug, Serialize)]
pub struct Band {
    /// The larger of θi and θo is from here … \[degrees\].
    pub from_deg: f64,
    /// … to here.
    pub to_deg: f64,
    /// Samples looked at.
    pub samples: usize,
    /// Median over them of the relative spread over φd, −φd, φd + π and π − φd; none where no two
    /// of the four were measured.
    pub noise: Option<f64>,
    /// Median of |f(wi, wo) − f(wo, wi)| relative to their mean.
    pub reciprocity: Option<f64>,
}

/// The directional albedo of one channel.
#[derive(Clone, Debug, Serialize)]
pub struct Energy {
    /// The channel.
    pub channel: Channel,
    /// ∫ f cosθi dωi against θo, what was not measured counted as 0.
    pub albedo: Vec<AlbedoAt>,
    /// The smallest of these angles at which it exceeds 1.
    pub gains_energy_from_deg: Option<f64>,
}

/// Limits of the bands \[degrees\].
const BANDS: [f64; 5] = [0.0, 30.0, 60.0, 80.0, 90.0];

/// Angles of the albedo \[degrees\].
const ALBEDO_ANGLES: [f64; 9] = [0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0];

/// The most samples that the spread is computed from.
const MAX_SAMPLES: usize = 60_000;

/// The audit of a measurement.
#[must_use]
pub fn audit_measured(name: &str, measurement: &Measurement) -> MeasuredAudit {
    let (samples, solid_angle) = measurement
        .samples()
        .fold((0, 0.0), |(count, sum), sample| (count + 1, sum + sample.weight));
    // Every n-th of the file, so that all elevations are met.
    let step = samples / MAX_SAMPLES + 1;
    let looked_at: Vec<Sample> = measurement.samples().step_by(step).collect();
    MeasuredAudit {
        measurement: name.to_owned(),
        format: measurement.format(),
        samples,
        // Two hemispheres of 2π each; the sum of the weights may round above them.
        coverage: (solid_angle / (TAU * TAU)).min(1.0),
        bands: BANDS
            .windows(2)
            .map(|ends| band(measurement, &looked_at, ends[0], ends[1]))
            .collect(),
        channels: energy(measurement),
    }
}

fn band(measurement: &Measurement, samples: &[Sample], from_deg: f64, to_deg: f64) -> Band {
    let range = from_deg..to_deg;
    let samples: Vec<&Sample> =
        samples.iter().filter(|sample| range.contains(&elevation_deg(sample))).collect();
    let spread = samples.par_iter().filter_map(|s| Spread::of(measurement, s.wi, s.wo).relative);
    let swapped = samples.par_iter().filter_map(|s| asymmetry(measurement, s.wi, s.wo));
    Band {
        from_deg,
        to_deg,
        samples: samples.len(),
        noise: median(spread.collect()),
        reciprocity: median(swapped.collect()),
    }
}

/// The larger of θi and θo \[degrees\].
fn elevation_deg(sample: &Sample) -> f64 {
    // The lower direction has the larger angle.
    sample.wi.z.min(sample.wo.z).clamp(0.0, 1.0).acos().to_degrees()
}

/// |f(wi, wo) − f(wo, wi)| relative to their mean; none where one was not measured, or both are 0.
fn asymmetry(reflectance: &dyn Reflectance, wi: DVec3, wo: DVec3) -> Option<f64> {
    let [a, b] = [(wi, wo), (wo, wi)].map(|(wi, wo)| reflectance.eval(wi, wo).iter().sum::<f64>());
    // False for a NaN, too.
    (a + b > 0.0).then(|| 2.0 * (a - b).abs() / (a + b))
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

fn energy(measurement: &Measurement) -> [Energy; 3] {
    let albedos: Vec<[f64; 3]> = ALBEDO_ANGLES
        .par_iter()
        .map(|theta_deg| albedo(measurement, spherical(theta_deg.to_radians(), 0.0)))
        .collect();
    [0, 1, 2].map(|c| {
        let albedo: Vec<AlbedoAt> = ALBEDO_ANGLES
            .into_iter()
            .zip(&albedos)
            .map(|(theta_deg, albedo)| AlbedoAt { theta_deg, albedo: albedo[c] })
            .collect();
        let gaining = albedo.iter().find(|at| at.albedo > 1.0);
        Energy {
            channel: Channel::ALL[c],
            gains_energy_from_deg: gaining.map(|at| at.theta_deg),
            albedo,
        }
    })
}

/// ∫ f(wi, wo) cosθi dωi over half vectors, dωi = 4 (wo·h) dωh, evenly in √θh and φh.
fn albedo(reflectance: &dyn Reflectance, wo: DVec3) -> [f64; 3] {
    const RINGS: usize = 240;
    const AZIMUTHS: usize = 90;
    let mut sum = [0.0; 3];
    for ring in 0..RINGS {
        let u = (ring as f64 + 0.5) / RINGS as f64;
        // Squared, so that rings are dense where a sharp lobe is.
        let theta_h = FRAC_PI_2 * u * u;
        // sinθh dθh dφh, dθh = π u du.
        let solid_angle = theta_h.sin() * PI * u / RINGS as f64 * TAU / AZIMUTHS as f64;
        for azimuth in 0..AZIMUTHS {
            let h = spherical(theta_h, TAU * (azimuth as f64 + 0.5) / AZIMUTHS as f64);
            let wi = 2.0 * wo.dot(h) * h - wo;
            let f = reflectance.eval(wi, wo);
            if above_horizon(wi) && wo.dot(h) > 0.0 && f.iter().all(|f| f.is_finite()) {
                let weight = 4.0 * wo.dot(h) * wi.z * solid_angle;
                sum = [0, 1, 2].map(|c| sum[c] + weight * f[c]);
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::MaskingKind;
    use crate::brdf::{SgdBrdf, directional_albedo};
    use crate::material::find;

    #[test]
    fn the_albedo_is_that_of_the_exact_quadrature() {
        for name in ["gold-paint", "alum-bronze", "white-paint"] {
            let material = &find(name).expect("in the catalogue").material;
            let brdf = SgdBrdf::new(material, MaskingKind::Fitted);
            for theta_deg in [0.0_f64, 45.0, 75.0] {
                let wo = spherical(theta_deg.to_radians(), 0.0);
                let exact = directional_albedo(&brdf, wo.z);
                for (found, exact) in albedo(&brdf, wo).into_iter().zip(exact) {
                    assert!(
                        (found / exact - 1.0).abs() < 5e-3,
                        "{name} {theta_deg}: {found} {exact}"
                    );
                }
            }
        }
    }
}
