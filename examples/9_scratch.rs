use sgdbake::fit::*;
use sgdbake::brdf::Distribution;
use std::time::Instant;
fn main() {
    let cat = sgdbake::material::catalog();
    let verbose = std::env::args().nth(1).is_some();
    let t = Instant::now();
    let targets: Vec<Target> = cat.iter().map(|e| Target::new(&e.material)).collect();
    eprintln!("targets {:?} pairs {}", t.elapsed(), targets[0].pairs.len());
    for n in [1,2,4,6,8] {
        let t = Instant::now();
        let mut worst: Vec<(f64,&str)> = cat.iter().map(|e| (lobes::fit(&e.material, n).residual.into_iter().fold(0.0,f64::max), e.material.name.as_str())).collect();
        let t = t.elapsed();
        worst.sort_by(|a,b| b.0.total_cmp(&a.0));
        eprintln!("{n} {t:?} worst {:?} median {}", &worst[..4], worst[50].0);
    }
    let med = |v: &[f64]| { let mut v = v.to_vec(); v.sort_by(f64::total_cmp); (v[v.len()/2], v[v.len()-1]) };
    for d in [Distribution::Beckmann, Distribution::Ggx] {
        let t = Instant::now();
        let fits: Vec<_> = targets.iter().map(|t| one_lobe::fit_target(t, d, Metric::default())).collect();
        let t = t.elapsed();
        let r: Vec<f64> = fits.iter().flat_map(|f| f.per_channel_residuals.cube_root).collect();
        let j: Vec<f64> = fits.iter().flat_map(|f| f.joint_residuals.cube_root).collect();
        eprintln!("{d:?} {t:?} {:?} {:?}", med(&r), med(&j));
    }
    let t = Instant::now();
    let fits: Vec<_> = targets.iter().map(|t| gltf::fit_target(t, Metric::default())).collect();
    let t = t.elapsed();
    let r: Vec<f64> = fits.iter().flat_map(|f| f.residuals.cube_root).collect();
    eprintln!("gltf {t:?} {:?}", med(&r));
    if verbose { for (e, f) in cat.iter().zip(&fits) { let m = &f.material; println!("{:24} base {:.3?} m {:.2} r {:.3} s {:.2} c {:.2?} coat {:.2?} {:.2?} res {:.4?} {:?}", e.material.name, m.base_color, m.metallic, m.roughness, m.specular_factor, m.specular_color, m.clearcoat, m.clearcoat_roughness, f.residuals.cube_root, f.reasons.iter().map(ToString::to_string).collect::<Vec<_>>()); } }
}
