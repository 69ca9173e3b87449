//! A χ² test of any sampler against its stated density.

use std::f64::consts::TAU;

use glam::DVec3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

/// Cells of the half vector: slope tanθh on the scale of the lobe, and azimuth.
const SLOPES: usize = 24;
const AZIMUTHS: usize = 16;

/// Cells that expect fewer draws are counted together.
const FEWEST: f64 = 10.0;

/// A sampler as the test sees it.
pub struct Sampler<'a> {
    /// A direction from three uniform numbers, or a draw that carries nothing.
    pub sample: &'a dyn Fn([f64; 3]) -> Option<DVec3>,
    /// The density of directions \[1/sr\].
    pub pdf: &'a dyn Fn(DVec3) -> f64,
}

/// The p-value of `draws` draws: how likely so large a deviation from the density is by chance.
///
/// Directions are counted by their half vector with `wo`, in cells even in r = s/(s + width) for
/// the slope s = tanθh: `width` is the scale of the lobe, so its peak and its tails fill many
/// cells however sharp it is. Draws that carry nothing have the rest of the probability.
pub fn p_value(sampler: &Sampler<'_>, wo: DVec3, width: f64, draws: u32, seed: u64) -> f64 {
    let mut counts = vec![0_u32; SLOPES * AZIMUTHS];
    let mut nothing = 0_u32;
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    for _ in 0..draws {
        match (sampler.sample)(rng.random()) {
            Some(wi) => counts[cell(wi, wo, width)] += 1,
            None => nothing += 1,
        }
    }
    let expected: Vec<f64> = (0..counts.len())
        .map(|index| f64::from(draws) * probability(sampler, wo, width, index))
        .collect();
    let rest = f64::from(draws) - expected.iter().sum::<f64>();
    assert!(rest > -1e-3 * f64::from(draws), "the density integrates to more than 1: {rest}");
    let mut pooled = (f64::from(nothing), rest.max(0.0));
    let (mut chi2, mut cells) = (0.0, 0);
    for (count, expected) in counts.iter().zip(&expected) {
        if *expected < FEWEST {
            pooled = (pooled.0 + f64::from(*count), pooled.1 + expected);
        } else {
            chi2 += (f64::from(*count) - expected).powi(2) / expected;
            cells += 1;
        }
    }
    if pooled.1 >= FEWEST {
        chi2 += (pooled.0 - pooled.1).powi(2) / pooled.1;
        cells += 1;
    } else if pooled.0 > pooled.1 + 6.0 * FEWEST {
        return 0.0;
    }
    upper_tail(chi2, f64::from(cells - 1))
}

fn cell(wi: DVec3, wo: DVec3, width: f64) -> usize {
    let h = wi + wo;
    let slope = h.x.hypot(h.y) / h.z;
    let r = slope / (slope + width);
    let turn = h.y.atan2(h.x).rem_euclid(TAU) / TAU;
    let ring = ((r * SLOPES as f64) as usize).min(SLOPES - 1);
    ring * AZIMUTHS + ((turn * AZIMUTHS as f64) as usize).min(AZIMUTHS - 1)
}

/// The density's integral over a cell, by bisection of its larger pieces.
fn probability(sampler: &Sampler<'_>, wo: DVec3, width: f64, index: usize) -> f64 {
    let (ring, sector) = ((index / AZIMUTHS) as f64, (index % AZIMUTHS) as f64);
    let density = |r: f64, phi: f64| {
        let slope = width * r / (1.0 - r);
        let d_slope = width / (1.0 - r).powi(2);
        let h = DVec3::new(slope * phi.cos(), slope * phi.sin(), 1.0);
        let inv_length = h.length().recip();
        let h = h * inv_length;
        let wi = 2.0 * wo.dot(h) * h - wo;
        if wi.z <= 0.0 || wo.dot(h) <= 0.0 {
            return 0.0;
        }
        // dωi = 4 ⟨wo,h⟩ dωh, dωh = cos³θh s ds dφ.
        (sampler.pdf)(wi) * 4.0 * wo.dot(h) * inv_length.powi(3) * slope * d_slope
    };
    let r = [ring / SLOPES as f64, (ring + 1.0) / SLOPES as f64];
    let phi = [TAU * sector / AZIMUTHS as f64, TAU * (sector + 1.0) / AZIMUTHS as f64];
    adaptive(&density, r, phi, 0)
}

fn adaptive(density: &dyn Fn(f64, f64) -> f64, r: [f64; 2], phi: [f64; 2], depth: u32) -> f64 {
    const ENOUGH: f64 = 1e-7;
    let whole = gauss(density, r, phi);
    let (rm, pm) = (0.5 * (r[0] + r[1]), 0.5 * (phi[0] + phi[1]));
    let quarters = [
        ([r[0], rm], [phi[0], pm]),
        ([rm, r[1]], [phi[0], pm]),
        ([r[0], rm], [pm, phi[1]]),
        ([rm, r[1]], [pm, phi[1]]),
    ];
    let parts: f64 = quarters.iter().map(|(r, phi)| gauss(density, *r, *phi)).sum();
    if depth >= 7 || (parts - whole).abs() < ENOUGH {
        return parts;
    }
    quarters.iter().map(|(r, phi)| adaptive(density, *r, *phi, depth + 1)).sum()
}

/// Three by three Gauss–Legendre points.
fn gauss(density: &dyn Fn(f64, f64) -> f64, r: [f64; 2], phi: [f64; 2]) -> f64 {
    const POINTS: [(f64, f64); 3] = [
        (0.112_701_665_379_258_3, 5.0 / 18.0),
        (0.5, 8.0 / 18.0),
        (0.887_298_334_620_741_7, 5.0 / 18.0),
    ];
    let (dr, dphi) = (r[1] - r[0], phi[1] - phi[0]);
    let mut sum = 0.0;
    for (x, wx) in POINTS {
        for (y, wy) in POINTS {
            sum += wx * wy * density(r[0] + dr * x, phi[0] + dphi * y);
        }
    }
    sum * dr * dphi
}

/// P(χ² > value) for many degrees of freedom (Wilson and Hilferty 1931).
fn upper_tail(chi2: f64, freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    let z = ((chi2 / freedom).cbrt() - (1.0 - spread)) / spread.sqrt();
    0.5 * libm::erfc(z / std::f64::consts::SQRT_2)
}
