#![allow(clippy::print_stdout, missing_docs)]
use std::time::Instant;
use glam::DVec3;
use sgdbake::brdf::batch::{InstructionSet, Pairs, RgbMut, SgdBatch};
use sgdbake::brdf::sampler::{Sampler, Strategy};
use sgdbake::brdf::{MaskingKind, SgdBrdf};
use sgdbake::material::{Material, find};
const N: usize = 512;
fn rnd(s: &mut u64) -> f64 { *s = s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); (*s >> 11) as f64 / (1u64 << 53) as f64 }
fn dirs(seed: u64) -> Vec<DVec3> { let mut s = seed; for _ in 0..9 { rnd(&mut s); } (0..N).map(|_| { let c = rnd(&mut s); let ph = rnd(&mut s) * std::f64::consts::TAU; let r = (1.0 - c * c).sqrt(); DVec3::new(r * ph.cos(), r * ph.sin(), c) }).collect() }
fn time(mut f: impl FnMut(), reps: usize) -> f64 { let mut best = f64::MAX; for _ in 0..reps { let t = Instant::now(); f(); best = best.min(t.elapsed().as_secs_f64()); } best * 1e9 / N as f64 }
fn main() {
    let only = std::env::args().nth(1).unwrap_or_default();
    let gold = &find("gold-paint").unwrap().material;
    let one = { let l = gold.lobes()[1].clone(); Material::new("one", [0.1; 3], vec![l]).unwrap() };
    let two = { let l = gold.lobes()[1].clone(); Material::new("two", [0.1; 3], vec![l.clone(), l]).unwrap() };
    if only == "strat" { strat(); return; }
    let (wi, wo) = (dirs(1), dirs(2));
    let comp = |w: &[DVec3], a: usize| w.iter().map(|w| w[a] as f32).collect::<Vec<_>>();
    let i = [0, 1, 2].map(|a| comp(&wi, a)); let o = [0, 1, 2].map(|a| comp(&wo, a));
    for round in 0..3 {
        let brdf = SgdBrdf::new(gold, MaskingKind::Fitted);
        let base = time(|| { for (i, o) in wi.iter().zip(&wo) { std::hint::black_box(brdf.eval(*i, *o)); } }, 60);
        println!("round {round}: f64 fitted {base:.0}");
        for strategy in [Strategy::Vndf, Strategy::Ggx] { for kind in [MaskingKind::Exact, MaskingKind::Fitted] {
            if !only.is_empty() && only != "s" { continue; }
            let s = Sampler::new(gold, kind, strategy);
            let t = time(|| { for (u, o) in wi.iter().zip(&wo) { std::hint::black_box(s.sample_with_weight(*o, u.abs().to_array())); } }, 60);
            println!("  sample {strategy:?} {kind:?} {t:.0} ({:.2})", base / t);
        } }
        for set in InstructionSet::available() { for kind in [MaskingKind::Exact, MaskingKind::Fitted] {
            if !only.is_empty() && only != format!("b{set:?}") { continue; }
            let s = sgdbake::brdf::batch::SamplerBatch::new(gold, kind).with_instruction_set(set);
            let u = [0, 1, 2].map(|a| wi.iter().map(|w| w[a].abs().min(0.999999) as f32).collect::<Vec<_>>());
            let mut out = [0; 7].map(|_| vec![0f32; N]);
            let t = time(|| { let [a, b, c, d, e, f, g] = &mut out; s.sample(&sgdbake::brdf::batch::Draws { wo: o.each_ref().map(Vec::as_slice), u: u.each_ref().map(Vec::as_slice) }, &mut sgdbake::brdf::batch::SamplesMut { wi: [a, b, c], weight: [d, e, f], pdf: g }).unwrap(); std::hint::black_box(&out); }, if only.is_empty() { 500 } else { 50000 });
            println!("  batch sample {set:?} {kind:?}: {t:.2} ns ({:.1})", base / t);
            let t = time(|| { let [_, _, _, d, e, f, g] = &mut out; s.eval(&Pairs { wi: i.each_ref().map(Vec::as_slice), wo: o.each_ref().map(Vec::as_slice) }, &mut RgbMut([d, e, f]), g).unwrap(); std::hint::black_box(&out); }, 500);
            println!("  batch f and pdf {set:?} {kind:?}: {t:.2} ns ({:.1})", base / t);
        } }
        for set in InstructionSet::available() { for (name, m) in [("3", gold), ("1", &one), ("2", &two)] {
            if !only.is_empty() && only != format!("{set:?}{name}") { continue; }
            let b = SgdBatch::new(m, MaskingKind::Exact).with_instruction_set(set);
            let mut out = [0, 1, 2].map(|_| vec![0f32; N]);
            let t = time(|| { b.eval(&Pairs { wi: i.each_ref().map(Vec::as_slice), wo: o.each_ref().map(Vec::as_slice) }, &mut RgbMut(out.each_mut().map(Vec::as_mut_slice))).unwrap(); std::hint::black_box(&out); }, if only.is_empty() { 2000 } else { 200000 });
            println!("  batch {set:?} lobes {name}: {t:.2} ns ({:.1})", base / t);
        } }
    }
}

const R3: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_97];
fn strat() {
    use sgdbake::microfacet::{Accuracy, Distribution as _, Sgd};
    use sgdbake::brdf::Sample as _;
    for name in ["chrome", "gold-paint", "pink-fabric"] {
        let lobe = find(name).unwrap().material.lobes()[1].clone();
        let sgd = Sgd::new(lobe.alpha(), lobe.p(), Accuracy::Table);
        let m = Material::new("one", [0.0; 3], vec![lobe]).unwrap();
        let s = Sampler::new(&m, MaskingKind::Exact, Strategy::Vndf);
        let brdf = SgdBrdf::new(&m, MaskingKind::Exact).tabulated();
        for theta in [0.0_f64, 45.0, 70.0, 85.0] {
            let th = theta.to_radians();
            let wo = DVec3::new(th.sin(), 0.0, th.cos());
            let mirror = DVec3::new(-th.sin(), 0.0, th.cos());
            let light = |w: DVec3| 0.3 + 0.2 * w.y + if w.dot(mirror) > 0.98 { 2.0 } else { 0.0 } + if w.y > 0.02 { 1.0 } else { 0.0 };
            let mut row = String::new();
            for which in 0..2 { for n in [1, 16, 128] {
                let mut seed = 5; let (mut a, mut b) = (0.0, 0.0); let runs = 3000 / n + 300;
                let t = Instant::now();
                for _ in 0..runs {
                    let start = [rnd(&mut seed), rnd(&mut seed), rnd(&mut seed)];
                    let mut sum = 0.0;
                    for k in 0..n {
                        let u: [f64; 3] = std::array::from_fn(|x| (start[x] + k as f64 * R3[x]).fract());
                        let wi = if which == 0 { let h = sgd.visible_normal(wo, u); let w = 2.0 * wo.dot(h) * h - wo; (w.z > 0.0).then_some(w) } else { s.sample(wo, u) };
                        if let Some(w) = wi { let pdf = s.pdf(w, wo); sum += brdf.eval(w, wo)[1] * w.z / pdf * light(w); }
                    }
                    let e = sum / n as f64; a += e; b += e * e;
                }
                let ns = t.elapsed().as_secs_f64() * 1e9 / (runs * n) as f64;
                let (mean, r) = (a / runs as f64, runs as f64);
                let var = (b / r - mean * mean) / mean / mean * n as f64;
                row += &format!(" n={n}: mean {mean:.4} var*n {var:.4} ns {ns:.0};");
            } row += "  |  "; }
            println!("{name} {theta}: {row}");
        }
    }
}
