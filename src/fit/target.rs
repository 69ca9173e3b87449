//! The aim of every fit: the exact reflectance of a material at well-chosen pairs of directions.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2};
use std::sync::{Arc, OnceLock};

use glam::DVec3;
use serde::Serialize;

use crate::brdf::{Lobe, MaskingKind, Reflectance, SgdBrdf};
use crate::fit::metric::Metric;
use crate::material::{LobeParams, Material};
use crate::math::direction::cot_theta;
use crate::math::quadrature::{Node, gauss_legendre};
use crate::microfacet::{Accuracy, Distribution as _, Sgd};

/// A pair of directions as a microfacet model sees it, and its share of the integral over pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Direction to the light.
    pub wi: DVec3,
    /// Direction to the viewer.
    pub wo: DVec3,
    /// tan²θh.
    pub tan2_theta_h: f64,
    /// cosθd = wi·h.
    pub cos_theta_d: f64,
    /// cosθi, cosθo.
    pub cos_theta: [f64; 2],
    /// cotθi, cotθo.
    pub cot_theta: [f64; 2],
    /// cosθo dωi dωo as a share of the sum over all pairs, for light along `wi` and, as f is
    /// reciprocal, for light along `wo` with the roles swapped.
    pub weights: [f64; 2],
}

/// The exact reflectance of a material at quadrature pairs.
///
/// # Example
///
/// ```
/// use sgdbake::{MaskingKind, Metric, SgdBrdf, Target, named};
///
/// let target = Target::new(named("gold-paint")?);
/// let chrome = SgdBrdf::new(named("chrome")?, MaskingKind::Exact);
/// // The relative distance of chrome from gold paint, per channel.
/// let distance = target.residuals(&chrome).in_metric(Metric::CubeRoot);
/// assert!(distance.iter().all(|d| *d > 0.1), "{distance:?}");
/// # Ok::<(), sgdbake::material::UnknownMaterial>(())
/// ```
#[derive(Clone, Debug)]
pub struct Target {
    /// The material as given.
    pub material: Material,
    /// Quadrature nodes over both hemispheres.
    pub pairs: Vec<Pair>,
    /// f at each pair, per channel \[1/sr\].
    pub channels: [Vec<f64>; 3],
    /// Finer nodes of the same material, made when first asked for; `None` where the nodes were
    /// chosen, so that such a target is its own judge.
    finer: Option<Arc<Finer>>,
}

/// The targets on which the fits to another are finished and judged.
#[derive(Debug, Default)]
struct Finer {
    polish: OnceLock<Target>,
    judge: OnceLock<Target>,
}

/// Relative residuals √(∫(g(x_fit) − g(x))² / ∫g(x)²) of a fit, in each metric per channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Residuals {
    /// Those of g = x.
    pub cosine: [f64; 3],
    /// Those of g = lightness.
    pub cube_root: [f64; 3],
    /// Those of g = ln(1 + x).
    pub log: [f64; 3],
}

impl Residuals {
    /// The residuals in one metric, per channel.
    #[must_use]
    pub fn in_metric(&self, metric: Metric) -> [f64; 3] {
        match metric {
            Metric::Cosine => self.cosine,
            Metric::CubeRoot => self.cube_root,
            Metric::Log => self.log,
        }
    }
}

/// Nodes over θh, θd and φd.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution {
    /// Half vector's polar angle, spaced by the lobe's own logarithm.
    pub theta_h: usize,
    /// Difference angle.
    pub theta_d: usize,
    /// Difference azimuth, over a quarter turn.
    pub phi_d: usize,
}

impl Default for Resolution {
    fn default() -> Self {
        Self { theta_h: 24, theta_d: 5, phi_d: 3 }
    }
}

impl Resolution {
    /// The nodes on which a fit that was found on fewer is brought to its minimum.
    pub const POLISHED: Self = Self { theta_h: 36, theta_d: 6, phi_d: 4 };

    /// The nodes of a fit's residual, more than a fit is made on: on its own nodes a fit is up to
    /// a fifth nearer than it is.
    pub const JUDGED: Self = Self { theta_h: 72, theta_d: 8, phi_d: 5 };
}

impl Target {
    /// The target of a material.
    #[must_use]
    pub fn new(material: &Material) -> Self {
        let target = Self::with_resolution(material, Resolution::default());
        Self { finer: Some(Arc::default()), ..target }
    }

    /// The target with a chosen number of nodes, on which its fits are judged as well.
    #[must_use]
    pub fn with_resolution(material: &Material, resolution: Resolution) -> Self {
        let pairs = pairs(lobe_scale(material), resolution);
        let channels = samples(material, &pairs);
        Self { material: material.clone(), pairs, channels, finer: None }
    }

    /// The target on which fits to this one are judged: of [`Resolution::JUDGED`].
    #[must_use]
    pub fn judge(&self) -> &Self {
        self.finer.as_ref().map_or(self, |finer| {
            finer.judge.get_or_init(|| Self::with_resolution(&self.material, Resolution::JUDGED))
        })
    }

    /// The target on which fits to this one are finished: of [`Resolution::POLISHED`].
    #[must_use]
    pub fn polish(&self) -> &Self {
        self.finer.as_ref().map_or(self, |finer| {
            finer.polish.get_or_init(|| Self::with_resolution(&self.material, Resolution::POLISHED))
        })
    }

    /// The distance of `reflectance` from the material, on finer nodes than a fit to this target
    /// uses.
    #[must_use]
    pub fn residuals(&self, reflectance: &(impl Reflectance + ?Sized)) -> Residuals {
        self.judge().own_residuals(reflectance)
    }

    /// The distance of `reflectance` from the target on its own nodes.
    #[must_use]
    pub fn own_residuals(&self, reflectance: &(impl Reflectance + ?Sized)) -> Residuals {
        let pairs = self.pairs.iter();
        let values: Vec<[[f64; 3]; 2]> = pairs
            .map(|pair| [reflectance.eval(pair.wi, pair.wo), reflectance.eval(pair.wo, pair.wi)])
            .collect();
        let [cosine, cube_root, log] = Metric::ALL.map(|metric| {
            std::array::from_fn(|c| self.residual(metric, c, |i, side| values[i][side][c]))
        });
        Residuals { cosine, cube_root, log }
    }

    /// √(∫(g(x_fit) − g(x))² / ∫g(x)²) of a channel whose values at the pairs, for light along
    /// either direction, are `fit`: a coat makes a glTF material's depend on it.
    fn residual(&self, metric: Metric, channel: usize, fit: impl Fn(usize, usize) -> f64) -> f64 {
        let (mut difference, mut total) = (0.0, 0.0);
        for (i, (pair, exact)) in self.pairs.iter().zip(&self.channels[channel]).enumerate() {
            for side in 0..2 {
                // The transform takes the light's cosine, the weight already holds the viewer's.
                let [fitted, exact] =
                    [fit(i, side), *exact].map(|f| metric.transform(f, pair.cos_theta[side]).0);
                difference += pair.weights[side] * (fitted - exact).powi(2);
                total += pair.weights[side] * exact * exact;
            }
        }
        // A black channel has no relative error: the absolute one stands for it.
        if total > 0.0 { (difference / total).sqrt() } else { difference.sqrt() }
    }
}

/// The smallest tan²θh at which a lobe's distribution bends: α² where the power law starts, but
/// no finer than what a pixel of a picture could show.
fn lobe_scale(material: &Material) -> f64 {
    // The sharpest lobe sets the spacing; a material without lobes, ∞ here, takes the widest scale.
    material.lobes().iter().map(bend).fold(f64::INFINITY, f64::min).clamp(1e-7, 0.1)
}

/// tan²θ at which a distribution bends; without a power law, a Beckmann distribution's width.
fn bend(lobe: &LobeParams) -> f64 {
    // t = α + x/α: t⁻ᵖ bends at x = α², e⁻ᵗ falls from x = α on.
    if lobe.p() > 0.0 { lobe.alpha() * lobe.alpha() } else { lobe.alpha() }
}

/// Quadrature over pairs in (ln(1 + tan²θh/s), θd, φd), with
/// dωi dωo = 4 cosθd · dωh dωd and cosθo as weight, θd up to where a direction meets the horizon.
/// φd covers the first quarter turn: the second holds the same pairs with light and view swapped,
/// and the horizon has a kink between them.
#[must_use]
pub fn pairs(scale: f64, resolution: Resolution) -> Vec<Pair> {
    let theta_d_rule = gauss_legendre(resolution.theta_d);
    let phi_d_rule = gauss_legendre(resolution.phi_d);
    let mut pairs = Vec::with_capacity(resolution.theta_h * theta_d_rule.len() * phi_d_rule.len());
    for (tan2_theta_h, theta_h_weight) in half_angles(scale, resolution.theta_h) {
        for theta_d in &theta_d_rule {
            for phi_d in &phi_d_rule {
                let weight = theta_h_weight * phi_d.weight;
                pairs.extend(pair(tan2_theta_h, weight, *theta_d, phi_d.x * FRAC_PI_2));
            }
        }
    }
    // The solid angles' constant factors (4, 2π, a quarter turn) cancel here; `pair` omits them.
    let total: f64 = pairs.iter().flat_map(|pair| pair.weights).sum();
    pairs.iter_mut().for_each(|pair| pair.weights = pair.weights.map(|weight| weight / total));
    pairs
}

/// (tan²θh, sinθh dθh) over the hemisphere.
fn half_angles(scale: f64, nodes: usize) -> Vec<(f64, f64)> {
    /// θh = 86°.
    const MAX_TAN2_THETA_H: f64 = 200.0;
    let length = (MAX_TAN2_THETA_H / scale).ln_1p();
    let nodes = gauss_legendre(nodes);
    nodes
        .iter()
        .map(|node| {
            // Even steps in y = ln(1 + x/s) are even in x in the core and even in ln x in the tail.
            let x = scale * (node.x * length).exp_m1();
            // sinθ dθ = ½ (1+x)^{−3/2} dx, dx = (x + s) dy.
            (x, node.weight * length * 0.5 * (x + scale) * (1.0 + x).powf(-1.5))
        })
        .collect()
}

/// cosθ below which a direction counts as below the horizon: less than a pixel of any picture.
const MIN_COS_THETA: f64 = 1e-3;

/// The pair at θh, at a share `theta_d.x` of the largest θd there, and at φd.
pub(super) fn pair(tan2_theta_h: f64, weight: f64, theta_d: Node, phi_d: f64) -> Option<Pair> {
    // Both directions are above the horizon as long as tanθd < cotθh/|cosφd|.
    let largest = (tan2_theta_h.sqrt() * phi_d.cos().abs()).recip().atan();
    let (sin_d, cos_d) = (theta_d.x * largest).sin_cos();
    let cos_h = (1.0 + tan2_theta_h).sqrt().recip();
    let sin_h = tan2_theta_h.sqrt() * cos_h;
    // wi,o = cosθd h ± sinθd (cosφd t + sinφd b), with h in the xz plane.
    let along = sin_d * phi_d.cos();
    let across = sin_d * phi_d.sin();
    let [wi, wo] = [1.0, -1.0].map(|sign| {
        let z = cos_d * cos_h - sign * along * sin_h;
        let x = cos_d * sin_h + sign * along * cos_h;
        DVec3::new(x, sign * across, z)
    });
    (wi.z > MIN_COS_THETA && wo.z > MIN_COS_THETA).then(|| Pair {
        wi,
        wo,
        tan2_theta_h,
        cos_theta_d: cos_d,
        cos_theta: [wi.z, wo.z],
        cot_theta: [cot_theta(wi), cot_theta(wo)],
        weights: [wo.z, wi.z].map(|cos| weight * theta_d.weight * largest * sin_d * cos_d * cos),
    })
}

/// f of each colour at every pair.
fn samples(material: &Material, pairs: &[Pair]) -> [Vec<f64>; 3] {
    // 1e-6 is far below any fit's residual, and G1 is most of the cost.
    let brdf = SgdBrdf::with_accuracy(material, MaskingKind::Exact, Accuracy::Picture).tabulated();
    let mut sums = [(); 3].map(|()| vec![0.0; pairs.len()]);
    for lobe in &brdf.lobes {
        add_lobe(lobe, pairs, &mut sums);
    }
    for (sums, rho_d) in sums.iter_mut().zip(brdf.rho_d) {
        sums.iter_mut().for_each(|sum| *sum = FRAC_1_PI * (rho_d + *sum));
    }
    sums
}

/// Adds ρs F D (G1(wi)/cosθi) (G1(wo)/cosθo) of a lobe at every pair.
fn add_lobe(lobe: &Lobe<Sgd>, pairs: &[Pair], sums: &mut [Vec<f64>; 3]) {
    // Pairs come in runs of one θh.
    let (mut tan2_theta_h, mut ndf) = (f64::NAN, f64::NAN);
    for (i, pair) in pairs.iter().enumerate() {
        if tan2_theta_h != pair.tan2_theta_h {
            (tan2_theta_h, ndf) = (pair.tan2_theta_h, lobe.distribution.ndf(pair.tan2_theta_h));
        }
        let [v_i, v_o] = [0, 1].map(|side| lobe.g1(pair.cot_theta[side]) / pair.cos_theta[side]);
        let visibility = v_i * v_o;
        for c in (0..3).filter(|c| lobe.rho_s[*c] > 0.0) {
            let fresnel = lobe.fresnel[c].eval(pair.cos_theta_d);
            sums[c][i] += lobe.rho_s[c] * fresnel * ndf * visibility;
        }
    }
}
