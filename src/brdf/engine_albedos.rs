//! Tables of what a GGX lobe reflects in all, by which engines make up for light that is reflected
//! more than once.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use glam::DVec3;

use crate::microfacet::ggx;

/// The index of refraction of a reflectance at normal incidence.
pub(super) fn index_of(f0: f64) -> f64 {
    (1.0 + f0.sqrt()) / (1.0 - f0.sqrt())
}

/// How far Fresnel's reflectance of a dielectric has risen from f0 to 1.
pub(super) fn share(cos: f64, f0: f64) -> f64 {
    let index = index_of(f0);
    let g = (index * index - 1.0 + cos * cos).sqrt();
    let (a, b) = ((g - cos) / (g + cos), cos * (g + cos) - 1.0);
    let fresnel = 0.5 * a * a * (1.0 + (b / (cos * (g - cos) + 1.0)).powi(2));
    ((fresnel - f0) / (1.0 - f0)).max(0.0)
}

/// Directional albedos of a GGX lobe with F = 1, against roughness and cosθ.
pub(super) struct Albedos {
    /// E.
    ggx: Vec<f64>,
    /// Ē = ∫ 2µ E dµ, against roughness.
    mean: Vec<f64>,
    /// The mean of [`share`] over the normals seen, for each F0^¼ = [`FOURTH_ROOTS`].
    share: Vec<Vec<f64>>,
}

/// Nodes in roughness and cosθ.
const NODES: usize = 24;
/// F0^¼ of the tables of [`share`], evenly spaced from F0 = 1e-4 to just above the 0.04 that a glTF
/// dielectric has at most.
const FOURTH_ROOTS: [f64; 4] = [0.1, 0.2162, 0.3324, 0.4486];

static ALBEDOS: LazyLock<Albedos> = LazyLock::new(Albedos::new);

impl Albedos {
    fn new() -> Self {
        let mut table =
            Self { ggx: Vec::new(), mean: Vec::new(), share: vec![Vec::new(); FOURTH_ROOTS.len()] };
        for r in 0..NODES {
            for o in 0..NODES {
                let (albedo, shares) = seen_from(node(r), node(o));
                table.ggx.push(albedo);
                table.share.iter_mut().zip(shares).for_each(|(table, share)| table.push(share));
            }
            table.mean.push(mean(&table.ggx[r * NODES..]));
        }
        table
    }

    /// E of a roughness, seen from cosθo.
    pub(super) fn of_ggx(roughness: f64, cos_o: f64) -> f64 {
        bilinear(&ALBEDOS.ggx, roughness, cos_o)
    }

    /// The mean of [`share`] over the normals seen.
    pub(super) fn share(roughness: f64, cos_o: f64, f0: f64) -> f64 {
        let [first, .., last] = FOURTH_ROOTS;
        let steps = (FOURTH_ROOTS.len() - 1) as f64;
        // Short of the last node, so that there is a next one.
        let at = ((f0.powf(0.25) - first) / (last - first) * steps).clamp(0.0, steps - 1e-9);
        let k = at as usize;
        let [a, b] = [k, k + 1].map(|k| bilinear(&ALBEDOS.share[k], roughness, cos_o));
        mix(a, b, at - k as f64)
    }

    /// 1 + Fms (1 − E)/E of a mean Fresnel factor.
    pub(super) fn scattered(roughness: f64, cos_o: f64, fresnel: f64) -> f64 {
        let (k, t) = place(roughness);
        let mean = mix(ALBEDOS.mean[k], ALBEDOS.mean[k + 1], t);
        // Fms = Σ Fss Ē (Fss (1 − Ē))ⁿ: light that stays n times more and then leaves.
        let often = fresnel * mean / (1.0 - fresnel * (1.0 - mean));
        compensation(often, Self::of_ggx(roughness, cos_o))
    }
}

/// The roughness or cosine of a node.
fn node(k: usize) -> f64 {
    k as f64 / (NODES - 1) as f64
}

/// The node before a roughness or cosine, and how far it is to the next.
fn place(x: f64) -> (usize, f64) {
    let at = x.clamp(0.0, 1.0) * (NODES - 1) as f64;
    let k = (at as usize).min(NODES - 2);
    (k, at - k as f64)
}

/// 2 ∫ E(c) c dc by trapezoids, from the E of a roughness.
fn mean(row: &[f64]) -> f64 {
    let strips = (0..NODES - 1).map(|k| {
        let (a, b) = (node(k), node(k + 1));
        (b - a) * (a * row[k] + b * row[k + 1])
    });
    strips.sum()
}

fn bilinear(table: &[f64], roughness: f64, cos_o: f64) -> f64 {
    let ((r, t), (o, s)) = (place(roughness), place(cos_o));
    let [a, b] = [r, r + 1].map(|r| mix(table[r * NODES + o], table[r * NODES + o + 1], s));
    mix(a, b, t)
}

/// E and the mean of [`share`] seen from cosθo, by visible normals spread evenly.
fn seen_from(roughness: f64, cos_o: f64) -> (f64, [f64; 4]) {
    const SIDE: usize = 16;
    let alpha = (roughness * roughness).max(1e-4);
    // At the horizon Λ is infinite, and G2/G1 would be ∞/∞.
    let cos_o = cos_o.max(1e-3);
    let wo = DVec3::new((1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o);
    let lambda_o = lambda(wo, alpha);
    let (mut albedo, mut shares) = (0.0, [0.0; 4]);
    for k in 0..SIDE * SIDE {
        let u = [k / SIDE, k % SIDE].map(|i| (i as f64 + 0.5) / SIDE as f64);
        let h = visible_normal(wo, alpha, u);
        let d = wo.dot(h);
        let wi = 2.0 * d * h - wo;
        if wi.z > 0.0 {
            // G2/G1(wo), the weight of a visible normal with F = 1.
            albedo += (1.0 + lambda_o) / (1.0 + lambda_o + lambda(wi, alpha));
        }
        for (sum, root) in shares.iter_mut().zip(FOURTH_ROOTS) {
            *sum += share(d.clamp(0.0, 1.0), root.powi(4));
        }
    }
    let count = (SIDE * SIDE) as f64;
    (albedo / count, shares.map(|sum| sum / count))
}

/// Smith's Λ of a direction.
fn lambda(w: DVec3, alpha: f64) -> f64 {
    ggx::lambda(w.z / w.x.hypot(w.y).max(1e-12) / alpha)
}

/// A normal seen from wo (Heitz 2018).
fn visible_normal(wo: DVec3, alpha: f64, [u, v]: [f64; 2]) -> DVec3 {
    let stretched = DVec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
    let across = DVec3::Z.cross(stretched);
    let t1 = if across.length_squared() > 1e-20 { across.normalize() } else { DVec3::X };
    let t2 = stretched.cross(t1);
    let (radius, (sin, cos)) = (u.sqrt(), (TAU * v).sin_cos());
    let (p1, p2) = (radius * cos, radius * sin);
    // The disc is squeezed to the projection of the upper hemisphere along wo.
    let s = 0.5 * (1.0 + stretched.z);
    let p2 = mix((1.0 - p1 * p1).sqrt(), p2, s);
    let up = (1.0 - p1 * p1 - p2 * p2).max(0.0).sqrt();
    let n = p1 * t1 + p2 * t2 + up * stretched;
    DVec3::new(alpha * n.x, alpha * n.y, n.z.max(1e-9)).normalize()
}

/// 1 + f0 (1/E − 1): what light that is reflected more than once adds.
pub(super) fn compensation(f0: f64, albedo: f64) -> f64 {
    1.0 + f0 * (albedo.recip() - 1.0)
}

pub(super) fn mix(a: f64, b: f64, share: f64) -> f64 {
    a + (b - a) * share
}
