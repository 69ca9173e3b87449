//! The distance of a stored reflectance from the one it was made of.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;
use serde::Serialize;

use crate::brdf::Reflectance;
use crate::measurement::half_difference::HalfDifference;

/// Relative errors Σ|Δf|/Σf, the sums over the colours, at pairs that no table has nodes at.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Deviation {
    /// Pairs compared.
    pub pairs: usize,
    /// Half of the errors are at most this.
    pub median: f64,
    /// 95 % of the errors are at most this.
    pub percentile_95: f64,
    /// The largest.
    pub largest: f64,
}

/// Pairs that are compared.
const PAIRS: usize = 20_000;

/// cos 80°: nearer to the horizon no measurement is reliable.
const MIN_COSINE: f64 = 0.173_648_177_666_930_33;

impl Deviation {
    /// The errors of `stored` against `exact`, at pairs up to 80° from the normal whose half
    /// vectors are dense towards it, as √θh is spread evenly. `None` where no pair reflects.
    #[must_use]
    pub fn of(stored: &dyn Reflectance, exact: &dyn Reflectance) -> Option<Self> {
        let (mut f, mut g) = (vec![[0.0; 3]; PAIRS], vec![[0.0; 3]; PAIRS]);
        // A fixed sequence: the figures of a file are the same in every run.
        let pairs: Vec<[DVec3; 2]> = (0..).filter_map(pair).take(PAIRS).collect();
        stored.eval_all(&pairs, &mut f);
        exact.eval_all(&pairs, &mut g);
        let mut errors: Vec<f64> = f
            .into_iter()
            // Negative values are stored as 0.
            .zip(g.into_iter().map(|g| g.map(|g| g.max(0.0))))
            .filter_map(|(f, g)| relative_error(f, g))
            .collect();
        errors.sort_by(f64::total_cmp);
        let last = errors.len().checked_sub(1)?;
        let [median, percentile_95, largest] =
            [0.5, 0.95, 1.0].map(|share| errors[(last as f64 * share) as usize]);
        Some(Self { pairs: errors.len(), median, percentile_95, largest })
    }
}

/// Σ|f − g|/Σg over the colours, where both are known and g reflects.
fn relative_error(f: [f64; 3], g: [f64; 3]) -> Option<f64> {
    let off = [0, 1, 2].map(|c| (f[c] - g[c]).abs());
    let sum = g.iter().sum::<f64>();
    // A pair that one of the two does not have is no error of the table.
    let known = f.iter().chain(&g).all(|x| x.is_finite());
    (known && sum > 0.0).then(|| off.iter().sum::<f64>() / sum)
}

/// The n-th of a sequence of pairs that fills (√θh, θd, φd) evenly, if it is high enough.
fn pair(n: u32) -> Option<[DVec3; 2]> {
    // Roberts' generalised golden ratios in three dimensions.
    const STEPS: [f64; 3] =
        [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_4];
    let [h, d, phi] = STEPS.map(|step| (0.5 + step * f64::from(n)).fract());
    let angles =
        HalfDifference { theta_h: FRAC_PI_2 * h * h, theta_d: FRAC_PI_2 * d, phi_d: TAU * phi };
    Some(angles.directions()).filter(|pair| pair.iter().all(|w| w.z > MIN_COSINE))
}
