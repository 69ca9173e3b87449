//! The networks that stand in for measurements, read from the shared folder; see its README.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Deserialize;
use sgdbake::brdf::Reflectance;

/// A network of three layers that gives the reflectance of a measured material.
///
/// # Formula
///
/// x = (sinθh, 0, cosθh, sinθd cosφd, sinθd sinφd, cosθd); a = max(0, x·w1 + b1);
/// a = max(0, a·w2 + b2); f = max(0, e^{a·w3 + b3} − 1) \[1/sr\], averaged over φd, −φd, φd + π and
/// π − φd, so that it is isotropic and reciprocal
/// (Sztrajman, Rainer, Ritschel and Weyrich 2021).
#[derive(Clone, Debug, Deserialize)]
pub struct Network {
    w1: Vec<Vec<f64>>,
    b1: Vec<f64>,
    w2: Vec<Vec<f64>>,
    b2: Vec<f64>,
    w3: Vec<Vec<f64>>,
    b3: Vec<f64>,
}

/// Where the networks lie, or `None` with a message.
pub fn folder() -> Option<PathBuf> {
    let shared = std::env::var_os("SGDBAKE_SHARED").map(PathBuf::from);
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let measured = shared.unwrap_or(beside).join("measured");
    if !measured.is_dir() {
        eprintln!("skipped: no {}", measured.display());
        return None;
    }
    Some(measured)
}

/// The networks of a file of the folder, by names such as `merl/gold-paint`.
pub fn read(folder: &Path, file: &str) -> BTreeMap<String, Network> {
    let bytes = fs::read(folder.join(file)).expect("the folder holds the file");
    serde_json::from_slice(&bytes).expect("a file of networks")
}

/// All networks of both files, or `None` with a message.
pub fn all() -> Option<BTreeMap<String, Network>> {
    let folder = folder()?;
    let mut networks = read(&folder, "networks.json");
    networks.append(&mut read(&folder, "merl.json"));
    Some(networks)
}

impl Network {
    /// f at Rusinkiewicz's angles given by (sinθh, cosθh) and the difference vector.
    fn value(&self, [sin_h, cos_h]: [f64; 2], difference: DVec3) -> [f64; 3] {
        let x = [sin_h, 0.0, cos_h, difference.x, difference.y, difference.z];
        let relu = |values: Vec<f64>| values.into_iter().map(|a| a.max(0.0)).collect::<Vec<f64>>();
        let a = relu(layer(&self.w1, &self.b1, &x));
        let a = relu(layer(&self.w2, &self.b2, &a));
        let last = layer(&self.w3, &self.b3, &a);
        std::array::from_fn(|c| last[c].exp_m1().max(0.0))
    }
}

/// x·w + b.
fn layer(w: &[Vec<f64>], b: &[f64], x: &[f64]) -> Vec<f64> {
    let mut sum = b.to_vec();
    for (row, x) in w.iter().zip(x) {
        for (sum, w) in sum.iter_mut().zip(row) {
            *sum += w * x;
        }
    }
    sum
}

impl Reflectance for Network {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !(wi.z > 0.0 && wo.z > 0.0) {
            return [0.0; 3];
        }
        let h = (wi + wo).normalize();
        let sin_h = h.x.hypot(h.y);
        // The azimuth of a half vector along the normal is arbitrary: f does not depend on it.
        let t = if sin_h > 0.0 { DVec3::new(h.x, h.y, 0.0) / sin_h } else { DVec3::X };
        let in_plane = DVec3::new(t.x * h.z, t.y * h.z, -sin_h);
        let across = DVec3::new(-t.y, t.x, 0.0);
        let d = DVec3::new(wi.dot(in_plane), wi.dot(across), wi.dot(h));
        let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)];
        let values = signs.map(|(x, y)| self.value([sin_h, h.z], d * DVec3::new(x, y, 1.0)));
        std::array::from_fn(|c| values.iter().map(|f| 0.25 * f[c]).sum())
    }
}
