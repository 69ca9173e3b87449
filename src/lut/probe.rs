//! Probes: pairs of directions at which a decoded reflectance is held against the exact one.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use glam::DVec3;

use crate::brdf::SgdBrdf;
use crate::material::MAX_LOBES;
use crate::math::direction::{
    Angles, above_horizon, abs_cos_phi_d, at_cot, cot_theta, from_cos_sin, spherical,
};
use crate::microfacet::{Distribution as _, Fresnel};

/// Viewers that a set of probes covers.
const VIEWERS: usize = 40;
/// Half vectors per viewer, from the lobe's centre to its end.
const HALF_VECTORS: usize = 72;
/// Lights per viewer spread over the whole hemisphere.
const LIGHTS: usize = 12;

/// One pair of directions and the exact values there.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// wi and wo.
    pub pair: [DVec3; 2],
    /// The angles of the pair.
    pub angles: Angles,
    /// |cosφd|.
    pub abs_cos_phi_d: f64,
    /// The exact factors of each lobe.
    pub lobes: [ExactLobe; MAX_LOBES],
    /// The exact values of each colour.
    pub colours: [Exact; 3],
}

/// The exact factors of one lobe at a probe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExactLobe {
    /// D(h).
    pub ndf: f64,
    /// F(cosθd) per colour.
    pub fresnel: [f64; 3],
    /// G1 of the light and the viewer.
    pub g1: [f64; 2],
    /// ρs/(π cosθo) per colour: the scale of F D G1 G1 in f_specular·cosθi.
    pub scale: [f64; 3],
}

impl ExactLobe {
    /// The lobe's part of f·cosθi, per colour.
    #[must_use]
    pub fn specular(&self) -> [f64; 3] {
        let Self { ndf, fresnel, g1, scale } = self;
        std::array::from_fn(|c| match scale[c] {
            0.0 => 0.0,
            scale => scale * fresnel[c] * ndf * g1[0] * g1[1],
        })
    }
}

/// The exact values of one colour at a probe, and the measure of an error there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exact {
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
    /// The reach of a material's lobes: from well inside the sharpest peak to where the widest has
    /// vanished.
    #[must_use]
    pub fn new(brdf: &SgdBrdf) -> Self {
        let alphas = brdf.lobes.iter().map(|lobe| lobe.distribution.alpha());
        let sharpest = alphas.clone().fold(f64::INFINITY, f64::min);
        let widest = alphas.fold(0.0, f64::max);
        Self {
            // The power factor of D bends at x = α², the exponential at x = α: this is inside both.
            tan2_theta_h: [0.1 * sharpest * sharpest.min(0.1), 60.0 * widest],
            // Masking sets in where cotθ is about the width √α of the slopes.
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
pub fn probes(brdf: &SgdBrdf, seed: usize) -> Vec<Probe> {
    if brdf.lobes.is_empty() {
        return Vec::new();
    }
    let reach = Reach::new(brdf);
    (0..VIEWERS)
        .flat_map(|viewer| {
            let index = seed * VIEWERS + viewer;
            let wo = viewer_direction(viewer, index, reach.grazing);
            of_viewer(brdf, wo, lights(wo, index, &reach))
        })
        .collect()
}

/// Probes of the viewers whose mirror direction a lobe leaves dark in some colour, as its Fresnel
/// curve crosses 0 there: next to the little that is left the error of a texture is largest.
#[must_use]
pub fn crossings(brdf: &SgdBrdf) -> Vec<Probe> {
    let curves = brdf.lobes.iter().filter(|lobe| lobe.rho_s.iter().any(|rho_s| *rho_s > 0.0));
    let zeros = curves.flat_map(|lobe| lobe.fresnel.iter().flat_map(zeros));
    // In the mirror pair θd = θo.
    let viewers = zeros.map(|cos| from_cos_sin(cos, (1.0 - cos * cos).sqrt(), 0.0));
    viewers.flat_map(|wo| probes_of_pair(brdf, [DVec3::new(-wo.x, -wo.y, wo.z), wo])).collect()
}

/// The cosθd between 0 and 1 at which a Fresnel curve is 0.
fn zeros(fresnel: &Fresnel) -> Vec<f64> {
    const CELLS: u32 = 64;
    (0..CELLS)
        .map(|cell| [cell, cell + 1].map(|edge| f64::from(edge) / f64::from(CELLS)))
        .filter(|[a, b]| fresnel.eval(*a) * fresnel.eval(*b) < 0.0)
        .map(|cell| zero_between(fresnel, cell))
        .collect()
}

/// The zero of a Fresnel curve between cosθd = `a` and `b`, where its signs differ.
fn zero_between(fresnel: &Fresnel, [mut a, mut b]: [f64; 2]) -> f64 {
    // A cell of 1/64 ends up 1e-14 wide.
    const HALVINGS: usize = 40;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (a + b);
        if fresnel.eval(a) * fresnel.eval(middle) <= 0.0 { b = middle } else { a = middle }
    }
    0.5 * (a + b)
}

/// A viewer with the largest |f|cosθi of each colour that its lights give: many probes of one viewer
/// need it once.
#[derive(Clone, Copy, Debug)]
pub struct Viewer {
    wo: DVec3,
    brightest: [f64; 3],
}

impl Viewer {
    /// A viewer above the horizon; `None` of one below.
    #[must_use]
    pub fn new(brdf: &SgdBrdf, wo: DVec3) -> Option<Self> {
        if !above_horizon(wo) {
            return None;
        }
        let reach = Reach::new(brdf);
        let mut viewer = Self { wo, brightest: [0.0; 3] };
        let mut lights_of_colours = [None; 3];
        for wi in lights(wo, 0, &reach) {
            let brighter = viewer.see(brdf, wi);
            for (light, _) in lights_of_colours.iter_mut().zip(brighter).filter(|(_, b)| *b) {
                *light = Some(wi);
            }
        }
        for c in 0..3 {
            if let Some(wi) = lights_of_colours[c]
                && !lights_of_colours[..c].contains(&Some(wi))
            {
                viewer.look_around(brdf, wi);
            }
        }
        Some(viewer)
    }

    /// Counts a light; returns the colours of which it is the brightest so far.
    fn see(&mut self, brdf: &SgdBrdf, wi: DVec3) -> [bool; 3] {
        let Some(probe) = probe(brdf, wi, self.wo) else { return [false; 3] };
        let brighter = [0, 1, 2].map(|c| probe.colours[c].reflected > self.brightest[c]);
        for (brightest, exact) in self.brightest.iter_mut().zip(probe.colours) {
            *brightest = brightest.max(exact.reflected);
        }
        brighter
    }

    /// Counts brighter and brighter lights near one: half vectors in its plane, nearer the normal and
    /// farther from it.
    fn look_around(&mut self, brdf: &SgdBrdf, wi: DVec3) {
        const STEPS: [f64; 8] = [0.16, 0.08, 0.04, 0.02, 0.01, 5e-3, 2.5e-3, 1e-3];
        let mut h = (wi + self.wo).normalize();
        for step in STEPS {
            for stretch in [1.0 + step, 1.0 - step] {
                let moved = DVec3::new(h.x * stretch, h.y * stretch, h.z).normalize();
                let wi = 2.0 * self.wo.dot(moved) * moved - self.wo;
                if above_horizon(wi) && self.see(brdf, wi).contains(&true) {
                    h = moved;
                }
            }
        }
    }

    /// The probe of a light; `None` below the horizon.
    #[must_use]
    pub fn probe(&self, brdf: &SgdBrdf, wi: DVec3) -> Option<Probe> {
        let mut probe = probe(brdf, wi, self.wo)?;
        for (exact, brightest) in probe.colours.iter_mut().zip(self.brightest) {
            exact.bound = brightest.max(exact.reflected) + exact.reflected;
        }
        Some(probe)
    }
}

/// Viewers from the horizon to the normal, between which the brightest light of any other lies.
pub struct Viewers {
    /// cotθ where they are densest.
    grazing: f64,
    brightest: Vec<[f64; 3]>,
}

impl Viewers {
    const COUNT: usize = 96;
    const FARTHEST: f64 = 1e3;

    /// The viewers of a material, evenly in ln(cotθ + s).
    #[must_use]
    pub fn new(brdf: &SgdBrdf) -> Self {
        let mut viewers = Self { grazing: 1e-2 * Reach::new(brdf).grazing, brightest: Vec::new() };
        let length = (Self::FARTHEST / viewers.grazing).ln_1p();
        let brightest = (0..Self::COUNT).map(|k| {
            let y = length * k as f64 / (Self::COUNT - 1) as f64;
            let cot = (viewers.grazing * y.exp_m1()).max(1e-12);
            Viewer::new(brdf, at_cot(cot)).map_or([0.0; 3], |viewer| viewer.brightest)
        });
        viewers.brightest = brightest.collect();
        viewers
    }

    /// A viewer, its brightest light between those of its neighbours; `None` of one below the horizon.
    #[must_use]
    pub fn at(&self, wo: DVec3) -> Option<Viewer> {
        let length = (Self::FARTHEST / self.grazing).ln_1p();
        let cot = cot_theta(wo).min(Self::FARTHEST);
        let place = (cot / self.grazing).ln_1p() / length * (Self::COUNT - 1) as f64;
        let left = (place as usize).min(Self::COUNT - 2);
        let [a, b] = [self.brightest[left], self.brightest[left + 1]];
        let weight = place - left as f64;
        let brightest = std::array::from_fn(|c| a[c] + (b[c] - a[c]) * weight);
        above_horizon(wo).then_some(Viewer { wo, brightest })
    }
}

/// The probes of the viewer of one pair of directions, that pair the first; none below the horizon.
#[must_use]
pub fn probes_of_pair(brdf: &SgdBrdf, [wi, wo]: [DVec3; 2]) -> Vec<Probe> {
    let reach = Reach::new(brdf);
    if !above_horizon(wi) || !above_horizon(wo) {
        return Vec::new();
    }
    of_viewer(brdf, wo, std::iter::once(wi).chain(lights(wo, 0, &reach)))
}

fn viewer_direction(viewer: usize, index: usize, grazing: f64) -> DVec3 {
    // One viewer in each of the even parts, at a place that differs from seed to seed.
    let offset = (viewer / 2) as f64 + spread(index, 0);
    let fraction = offset / (VIEWERS / 2) as f64;
    if viewer.is_multiple_of(2) {
        // Short of the horizon, where no pair counts.
        return spherical(fraction * FRAC_PI_2 * 0.9999, 0.0);
    }
    // From a thousandth of where masking sets in to thirty times it.
    at_cot(grazing * 10f64.powf(4.5 * fraction - 3.0))
}

/// The lights of a viewer: mirrored in half vectors, and all over the hemisphere.
fn lights(wo: DVec3, index: usize, reach: &Reach) -> impl Iterator<Item = DVec3> {
    let [inner, outer] = reach.tan2_theta_h.map(f64::ln);
    let mirrored = (0..HALF_VECTORS).map(move |k| {
        let (a, b) = (spread(index * HALF_VECTORS + k, 1), spread(index * HALF_VECTORS + k, 2));
        // Half the logarithm of tan²θh.
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
    // 1 over the golden ratio, Roberts' two numbers for the square, √2 − 1 and √3 − 1.
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
fn of_viewer(brdf: &SgdBrdf, wo: DVec3, lights: impl Iterator<Item = DVec3>) -> Vec<Probe> {
    let mut probes: Vec<Probe> = lights.filter_map(|wi| probe(brdf, wi, wo)).collect();
    for c in 0..3 {
        let largest = probes.iter().map(|probe| probe.colours[c].reflected).fold(0.0, f64::max);
        for probe in &mut probes {
            probe.colours[c].bound = largest + probe.colours[c].reflected;
        }
    }
    probes
}

/// The exact values of a pair; `None` below the horizon.
fn probe(brdf: &SgdBrdf, wi: DVec3, wo: DVec3) -> Option<Probe> {
    let angles = Angles::of(wi, wo)?;
    let mut lobes = [ExactLobe::default(); MAX_LOBES];
    let mut specular = [0.0; 3];
    for (lobe, slot) in brdf.lobes.iter().zip(&mut lobes) {
        *slot = ExactLobe {
            ndf: lobe.distribution.ndf(angles.tan2_h),
            fresnel: lobe.fresnel.map(|fresnel| fresnel.eval(angles.cos_d)),
            g1: angles.cot.map(|cot| lobe.g1(cot)),
            // f cosθi: the cosine of the light cancels and is never divided by.
            scale: lobe.rho_s.map(|rho_s| rho_s * FRAC_1_PI / angles.cos[1]),
        };
        let of_lobe = slot.specular();
        specular = std::array::from_fn(|c| specular[c] + of_lobe[c]);
    }
    let colours = [0, 1, 2].map(|c| {
        let reflected = (brdf.rho_d[c] * FRAC_1_PI * angles.cos[0] + specular[c]).abs();
        Exact { specular: specular[c], reflected, bound: 0.0 }
    });
    Some(Probe { pair: [wi, wo], angles, abs_cos_phi_d: abs_cos_phi_d(wi, wo), lobes, colours })
}
