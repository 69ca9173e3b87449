//! Any reflectance as the tables of an RGL file.
//!
//! The format leaves the maker of a file two choices. The factor `ndf`, which the stored colours
//! are divided by, is here the reflectance's own profile along θh, so that what is left changes
//! little and survives coarse tables. The density `vndf`, which says where the nodes of the
//! colours lie, is high where that profile changes, and not the density of visible normals: a
//! sharp lobe then has as many nodes as the rest.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::brdf::Reflectance;
use crate::math::direction::{above_horizon, cos_theta, sin_theta, spherical};
use crate::measurement::half_difference::HalfDifference;
use crate::measurement::rgl::{Rgl, half_vector_at, solid_angle_of_wo};
use crate::measurement::warp::{Grid, Place, Warp, node};

/// Angles of incidence, evenly from 0 to the last.
pub const INCIDENCES: usize = 32;
/// The last angle of incidence: at 90° nothing arrives.
const LAST_INCIDENCE_DEG: f64 = 89.9;
/// Nodes of `ndf` along θh.
const PROFILE_NODES: usize = 1024;
/// Nodes of `sigma` along θi.
const SIGMA_NODES: usize = 128;
/// Nodes of `vndf` along θm and φm.
const WARP_SIZE: [usize; 2] = [128, 33];
/// Nodes of the colours along both axes of the square.
const COLOUR_SIZE: [usize; 2] = [96, 96];
/// The least `ndf` relative to its largest, so that single precision can divide by it.
const MIN_PROFILE: f64 = 1e-12;
/// The part of the nodes that follows the changes of the profile; the rest are spread evenly.
const FOLLOWING: f64 = 0.6;
/// The least `luminance` relative to its mean: what is nearly black is still drawn.
const MIN_LUMINANCE: f64 = 1e-3;

impl Rgl {
    /// The tables of a reflectance, `incidence_done` called after each of the [`INCIDENCES`].
    ///
    /// NaN, for pairs that were not measured, becomes 0.
    #[must_use]
    pub fn tabulate(
        reflectance: &dyn Reflectance,
        description: String,
        incidence_done: &(dyn Fn() + Sync),
    ) -> Self {
        let theta_i: Vec<f32> = (0..INCIDENCES)
            .map(|i| LAST_INCIDENCE_DEG.to_radians() * i as f64 / (INCIDENCES - 1) as f64)
            .map(|theta| theta as f32)
            .collect();
        let ndf = profile(reflectance);
        // The same density for every azimuth and incidence: the profile depends on θh alone.
        let density = repeated(&nodes_density(&ndf), WARP_SIZE[1] * INCIDENCES);
        let vndf = Warp::new(Grid { size: WARP_SIZE, values: density });
        let mut rgl = Self {
            description,
            phi_i: vec![0.0],
            sigma: sigma(&ndf),
            ndf,
            vndf: vndf.expect("the density is positive everywhere"),
            luminance: Grid { size: COLOUR_SIZE, values: Vec::new() },
            rgb: Grid { size: COLOUR_SIZE, values: Vec::new() },
            jacobian: true,
            theta_i,
        };
        // In order of incidence whatever the threads do, so that equal input gives equal bytes.
        let tables: Vec<(Vec<f32>, Vec<f32>)> = (0..INCIDENCES)
            .into_par_iter()
            .map(|i| {
                let tables = rgl.incidence(reflectance, i);
                incidence_done();
                tables
            })
            .collect();
        for (rgb, luminance) in tables {
            rgl.rgb.values.extend(rgb);
            rgl.luminance.values.extend(luminance);
        }
        rgl
    }

    /// The layers of red, green and blue for one angle of incidence, and the luminance.
    fn incidence(&self, reflectance: &dyn Reflectance, i: usize) -> (Vec<f32>, Vec<f32>) {
        // The angle as the file holds it, in single precision: it is the one that readers will use.
        let theta_i = f64::from(self.theta_i[i]);
        let place = Place::of(theta_i, &self.theta_i);
        let [columns, rows] = COLOUR_SIZE;
        let nodes: Vec<Node> = (0..rows * columns)
            .map(|n| {
                let (at, density) =
                    self.vndf.sample(node(COLOUR_SIZE, n % columns, n / columns), place);
                self.node(reflectance, theta_i, at, density)
            })
            .collect();
        let rgb = (0..3).flat_map(|c| nodes.iter().map(move |node| node.colour[c] as f32));
        let mean = nodes.iter().map(|node| node.share).sum::<f64>() / nodes.len() as f64;
        // A black incidence has any luminance; 1 can be normalised.
        let least = if mean > 0.0 { MIN_LUMINANCE * mean } else { 1.0 };
        let luminance = nodes.iter().map(|node| node.share.max(least) as f32);
        (rgb.collect(), luminance.collect())
    }

    /// The values at a node of the colours: f cosθo · 4 sigma/ndf, and 0 below the horizon, so that
    /// nothing that is interpolated is negative.
    fn node(&self, reflectance: &dyn Reflectance, theta_i: f64, at: DVec2, density: f64) -> Node {
        let wi = spherical(theta_i, 0.0);
        let m = half_vector_at(at);
        let wo = 2.0 * wi.dot(m) * m - wi;
        if !above_horizon(wo) {
            return Node::default();
        }
        let reflected =
            reflectance.eval(wi, wo).map(|f| if f > 0.0 { f * cos_theta(wo) } else { 0.0 });
        let factor = self.jacobian(at, theta_i);
        let mean = reflected.iter().sum::<f64>() / 3.0;
        Node {
            colour: reflected.map(|reflected| reflected / factor),
            // f cosθo · dωo/d(u, v) · d(u, v)/ds: the light per unit of s.
            share: mean * solid_angle_of_wo(at, wi, m).max(0.0) / density,
        }
    }
}

/// The values stored at one node.
#[derive(Clone, Copy, Default)]
struct Node {
    colour: [f64; 3],
    /// ∝ the light that the node's part of the square reflects.
    share: f64,
}

/// f cosθo against θh, the mean of a few θd across the plane of incidence and of the colours.
fn profile(reflectance: &dyn Reflectance) -> Grid {
    let values: Vec<f64> = (0..PROFILE_NODES).map(|node| reflected(reflectance, node)).collect();
    let largest = values.iter().copied().fold(0.0, f64::max);
    let row: Vec<f32> = values
        .into_iter()
        .map(|value| if largest > 0.0 { (value / largest).max(MIN_PROFILE) } else { 1.0 } as f32)
        .collect();
    // Isotropic; two equal rows are the fewest that the format interpolates.
    Grid { size: [PROFILE_NODES, 2], values: repeated(&row, 2) }
}

/// The mean of f cosθo, its colours added up, at a node of the profile.
fn reflected(reflectance: &dyn Reflectance, node: usize) -> f64 {
    // Half a step before the horizon, where no pair is.
    let u = (node as f64 / (PROFILE_NODES - 1) as f64).min(1.0 - 0.5 / PROFILE_NODES as f64);
    let theta_h = FRAC_PI_2 * u * u;
    let values = [0.0, 20.0, 40.0, 60.0_f64].map(|degrees| {
        // At φd = 90° both have cosθ = cosθd cosθh: above the horizon for every θh.
        let angles = HalfDifference { theta_h, theta_d: degrees.to_radians(), phi_d: FRAC_PI_2 };
        let [wi, wo] = angles.directions();
        reflectance.eval(wi, wo).iter().map(|f| f * cos_theta(wo)).sum::<f64>()
    });
    // Pairs that were not measured (NaN) drop out here too.
    let measured = values.iter().filter(|value| **value > 0.0);
    measured.clone().sum::<f64>() / measured.count().max(1) as f64
}

/// Density of nodes against u(θm): even, and where ln ndf changes.
fn nodes_density(ndf: &Grid) -> Vec<f32> {
    let columns = WARP_SIZE[0];
    let step = 1.0 / (columns - 1) as f64;
    let changes: Vec<f64> =
        (0..columns).map(|column| change(ndf, column as f64 * step, step)).collect();
    let mean = changes.iter().sum::<f64>() / columns as f64;
    let relative = changes.iter().map(|change| if mean > 0.0 { change / mean } else { 1.0 });
    relative.map(|relative| (1.0 - FOLLOWING + FOLLOWING * relative) as f32).collect()
}

/// The change of ln ndf within a step to both sides of u.
fn change(ndf: &Grid, u: f64, step: f64) -> f64 {
    // In halves, so that a maximum between them is not missed.
    let values = [-1.0, -0.5, 0.0, 0.5, 1.0]
        .map(|k| ndf.eval(DVec2::new((u + k * step).clamp(0.0, 1.0), 0.0), Place::ONLY).ln());
    values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum::<f64>()
}

/// Steps in azimuth of the integral of [`sigma`].
const AZIMUTHS: usize = 64;

/// ∫ ndf(m) ⟨w, m⟩ dωm against u(θ) of w.
fn sigma(ndf: &Grid) -> Grid {
    let rings: Vec<(f64, f64)> = (1..PROFILE_NODES)
        .map(|i| {
            let [a, b] =
                [i - 1, i].map(|i| FRAC_PI_2 * (i as f64 / (PROFILE_NODES - 1) as f64).powi(2));
            let middle = 0.5 * (f64::from(ndf.values[i - 1]) + f64::from(ndf.values[i]));
            (0.5 * (a + b), middle * (a.cos() - b.cos()) * TAU / AZIMUTHS as f64)
        })
        .collect();
    let row: Vec<f32> = (0..SIGMA_NODES)
        .into_par_iter()
        .map(|i| {
            let w = spherical(FRAC_PI_2 * (i as f64 / (SIGMA_NODES - 1) as f64).powi(2), 0.0);
            rings.iter().map(|(theta_m, weight)| weight * facing(w, *theta_m)).sum::<f64>() as f32
        })
        .collect();
    Grid { size: [SIGMA_NODES, 2], values: repeated(&row, 2) }
}

/// Σ ⟨w, m⟩ over the normals m around the ring at θm.
fn facing(w: DVec3, theta_m: f64) -> f64 {
    let (along, across) = (theta_m.cos() * w.z, theta_m.sin() * sin_theta(w));
    // Half of the ring, φ in (0, π): the other half is its mirror image. `weight` counts both.
    let cosines = (0..AZIMUTHS).map(|k| (PI * (k as f64 + 0.5) / AZIMUTHS as f64).cos());
    cosines.map(|cos| (along + across * cos).max(0.0)).sum()
}

fn repeated(row: &[f32], times: usize) -> Vec<f32> {
    row.iter().copied().cycle().take(row.len() * times).collect()
}
