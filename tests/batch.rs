//! The f32 batch path against f64: all published materials, hard cases, and bits that do not
//! depend on a pair's place.

mod common;

use common::materials::shared_lobes;
use glam::{DVec3, Vec3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use sgdbake::brdf::batch::{
    Draws, InstructionSet, LengthMismatch, Pairs, RgbMut, SamplerBatch, SamplesMut, SgdBatch,
};
use sgdbake::brdf::{
    MaskingKind, Reflectance as _, Sample as _, Sampler, SgdBrdf, Strategy, directional_albedo,
};
use sgdbake::material::{Material, catalog, find};
use sgdbake::math::direction::{cos_sin_degrees, from_cos_sin};
use sgdbake::microfacet::Accuracy;

/// Pairs of directions with the same f32 components for both precisions.
struct Directions {
    wi: Vec<Vec3>,
    wo: Vec<Vec3>,
}

impl Directions {
    /// For each of several wo: wi uniform over the hemisphere, and wi around the mirror direction
    /// on every scale down to 1e-4 of the material's width.
    fn spread(material: &Material, rng: &mut Pcg64Mcg) -> Vec<Self> {
        [0.0, 20.0, 45.0, 70.0, 85.0, 89.0, 89.9]
            .map(|theta| {
                let (cos, sin) = cos_sin_degrees(theta);
                let wo = from_cos_sin(cos, sin, rng.random::<f64>());
                let mut wi: Vec<Vec3> = (0..200).map(|_| uniform(rng).as_vec3()).collect();
                for lobe in material.lobes() {
                    wi.extend((0..100).filter_map(|_| near_mirror(wo, lobe.alpha(), rng)));
                }
                Self { wo: vec![wo.as_vec3(); wi.len()], wi }
            })
            .into()
    }

    fn eval(&self, batch: &SgdBatch) -> [Vec<f32>; 3] {
        let components = |w: &[Vec3], axis: usize| w.iter().map(|w| w[axis]).collect::<Vec<_>>();
        let wi = [0, 1, 2].map(|axis| components(&self.wi, axis));
        let wo = [0, 1, 2].map(|axis| components(&self.wo, axis));
        let mut out = [0, 1, 2].map(|_| vec![f32::NAN; self.wi.len()]);
        let pairs =
            Pairs { wi: wi.each_ref().map(Vec::as_slice), wo: wo.each_ref().map(Vec::as_slice) };
        let mut rgb = RgbMut(out.each_mut().map(Vec::as_mut_slice));
        batch.eval(&pairs, &mut rgb).expect("equal lengths");
        out
    }
}

fn uniform(rng: &mut Pcg64Mcg) -> DVec3 {
    let cos: f64 = rng.random();
    from_cos_sin(cos, (1.0 - cos * cos).sqrt(), rng.random::<f64>() * std::f64::consts::TAU)
}

fn near_mirror(wo: DVec3, alpha: f64, rng: &mut Pcg64Mcg) -> Option<Vec3> {
    let slope = alpha.sqrt() * 4.0 * 10_f64.powf(-4.0 * rng.random::<f64>());
    let (sin, cos) = (rng.random::<f64>() * std::f64::consts::TAU).sin_cos();
    let h = DVec3::new(slope * cos, slope * sin, 1.0).normalize();
    let wi = 2.0 * wo.dot(h) * h - wo;
    (wi.z > 0.0).then(|| wi.as_vec3())
}

/// The largest |Δf| in units of 1e-5·|f| + 1e-6·(largest f of the same wo).
fn error(material: &Material, kind: MaskingKind, sets: &[Directions]) -> f64 {
    let exact = SgdBrdf::with_accuracy(material, kind, Accuracy::Reference);
    let batch = SgdBatch::new(material, kind);
    let mut worst: f64 = 0.0;
    for directions in sets {
        let f32s = directions.eval(&batch);
        let f64s: Vec<[f64; 3]> = directions
            .wi
            .iter()
            .zip(&directions.wo)
            .map(|(wi, wo)| exact.eval(wi.as_dvec3(), wo.as_dvec3()))
            .collect();
        for c in 0..3 {
            let largest = f64s.iter().map(|f| f[c].abs()).fold(0.0, f64::max);
            for (i, f) in f64s.iter().enumerate() {
                let difference = (f64::from(f32s[c][i]) - f[c]).abs();
                let ratio = difference / (1e-5 * f[c].abs() + 1e-6 * largest);
                assert!(
                    !ratio.is_nan(),
                    "{} {:?} {:?}",
                    material.name,
                    directions.wi[i],
                    directions.wo[i]
                );
                worst = worst.max(ratio);
            }
        }
    }
    worst
}

#[test]
fn every_published_material_is_within_its_stated_error() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let mut worst = [0.0_f64; 2];
    for entry in catalog() {
        let sets = Directions::spread(&entry.material, &mut rng);
        for (kind, worst) in [MaskingKind::Fitted, MaskingKind::Exact].into_iter().zip(&mut worst) {
            let error = error(&entry.material, kind, &sets);
            if error > *worst {
                println!("{} {kind:?} {error}", entry.material.name);
                *worst = error;
            }
        }
    }
    println!("largest error in units of the tolerance: fitted {}, exact {}", worst[0], worst[1]);
    assert!(worst.iter().all(|worst| *worst <= 1.0), "{worst:?}");
}

#[test]
fn lobes_that_colour_all_channels_are_within_the_stated_error() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    for material in shared_lobes() {
        let sets = Directions::spread(&material, &mut rng);
        for kind in [MaskingKind::Fitted, MaskingKind::Exact] {
            let error = error(&material, kind, &sets);
            assert!(error <= 1.0, "{} {kind:?}: {error} of the tolerance", material.name);
        }
    }
}

#[test]
fn results_do_not_depend_on_length_place_or_alignment() {
    let gold = find("gold-paint").expect("catalogue").material.clone();
    for material in [gold].into_iter().chain(shared_lobes()) {
        same_wherever_they_stand(&material);
    }
}

fn same_wherever_they_stand(material: &Material) {
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    let all = &Directions::spread(material, &mut rng)[3];
    for set in InstructionSet::available() {
        for kind in [MaskingKind::Fitted, MaskingKind::Exact] {
            let batch = SgdBatch::new(material, kind).with_instruction_set(set);
            let whole = all.eval(&batch);
            for (start, end) in [(0, 1), (1, 2), (3, 131), (7, 290), (0, 128)] {
                let part =
                    Directions { wi: all.wi[start..end].to_vec(), wo: all.wo[start..end].to_vec() };
                for (part, whole) in part.eval(&batch).iter().zip(&whole) {
                    assert_eq!(part[..], whole[start..end], "{set:?} {kind:?} {start}..{end}");
                }
            }
            for (i, (wi, wo)) in all.wi.iter().zip(&all.wo).enumerate() {
                let one = batch.terms(*wi, *wo).brdf.map(|f| f as f32);
                assert_eq!(one, [whole[0][i], whole[1][i], whole[2][i]], "{set:?} {kind:?} {i}");
            }
        }
    }
}

/// Draws for many directions to the viewer, and what the sampler makes of them.
struct Drawn {
    wo: Vec<Vec3>,
    u: Vec<[f32; 3]>,
    wi: Vec<Vec3>,
    weight: Vec<[f32; 3]>,
    pdf: Vec<f32>,
}

fn drawn(sampler: &SamplerBatch, wo: Vec<Vec3>, u: Vec<[f32; 3]>) -> Drawn {
    let count = wo.len();
    let wo_axes = [0, 1, 2].map(|axis| wo.iter().map(|w| w[axis]).collect::<Vec<_>>());
    let u_axes = [0, 1, 2].map(|axis| u.iter().map(|u| u[axis]).collect::<Vec<_>>());
    let [mut x, mut y, mut z, mut r, mut g, mut b, mut pdf] = [0; 7].map(|_| vec![0.0; count]);
    let draws = Draws {
        wo: wo_axes.each_ref().map(Vec::as_slice),
        u: u_axes.each_ref().map(Vec::as_slice),
    };
    let mut samples = SamplesMut {
        wi: [&mut x, &mut y, &mut z],
        weight: [&mut r, &mut g, &mut b],
        pdf: &mut pdf,
    };
    sampler.sample(&draws, &mut samples).expect("equal lengths");
    let wi = (0..count).map(|i| Vec3::new(x[i], y[i], z[i])).collect();
    Drawn { wo, u, wi, weight: (0..count).map(|i| [r[i], g[i], b[i]]).collect(), pdf }
}

/// Directions of every angle, with numbers that fill the cube, its ends among them.
fn many_draws(count: usize) -> (Vec<Vec3>, Vec<[f32; 3]>) {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let wo = (0..count).map(|_| uniform(&mut rng).as_vec3()).collect();
    let ends = [0.0, 1.0 - f32::EPSILON / 2.0];
    let mut u: Vec<[f32; 3]> = (0..count).map(|_| rng.random()).collect();
    for (i, u) in u.iter_mut().take(8).enumerate() {
        *u = [ends[i & 1], ends[i >> 1 & 1], ends[i >> 2 & 1]];
    }
    (wo, u)
}

/// The f64 sampler draws the same directions from the same numbers, with the same densities and
/// weights, but for what f32 cannot hold.
#[test]
fn batch_samples_are_the_samplers() {
    for name in ["gold-paint", "chrome", "pink-fabric", "blue-acrylic", "violet-acrylic"] {
        let material = &find(name).expect("catalogue").material;
        for kind in [MaskingKind::Exact, MaskingKind::Fitted] {
            let exact = Sampler::new(material, kind, Strategy::Vndf);
            let (wo, u) = many_draws(4000);
            let batch = drawn(&SamplerBatch::new(material, kind), wo, u);
            let draws = 0..batch.wo.len();
            draws.clone().for_each(|i| check_densities(name, &exact, &batch, i));
            let far = draws.filter(|i| !is_near(&exact, &batch, *i)).count();
            // Where a number falls on the border between two techniques.
            assert!(far < 12, "{name} {kind:?}: {far} directions differ");
        }
    }
}

fn check_densities(name: &str, exact: &Sampler, batch: &Drawn, i: usize) {
    if batch.pdf[i] == 0.0 {
        return;
    }
    let [wi, wo] = [batch.wi[i], batch.wo[i]].map(Vec3::as_dvec3);
    let pdf = exact.pdf(wi, wo);
    let error = (f64::from(batch.pdf[i]) / pdf - 1.0).abs();
    assert!(error < 2e-5, "{name} {wi} {wo}: {error:e}");
    for (f, found) in exact.eval(wi, wo).into_iter().zip(batch.weight[i]) {
        let weight = f * wi.z / pdf;
        let error = (f64::from(found) - weight).abs();
        assert!(error < 4e-5 * weight.abs().max(0.01), "{name} {wi} {wo}: {error:e}");
    }
}

/// Whether draw `i` is the f64 sampler's but for what the rounding of its first number changes: that
/// number chooses a technique, then in its share a half of the visible normals, then a component in
/// that half's, and what is left of it places the slope. Each step loses digits.
fn is_near(exact: &Sampler, batch: &Drawn, i: usize) -> bool {
    const ROUNDING: f64 = f32::EPSILON as f64;
    let wo = batch.wo[i].as_dvec3();
    let [choice, u, v] = batch.u[i].map(f64::from);
    let near = [choice - ROUNDING, choice, choice + ROUNDING]
        .map(|choice| exact.sample(wo, [choice.clamp(0.0, 1.0 - ROUNDING), u, v]));
    let [Some(before), Some(same), Some(after)] = near else { return batch.pdf[i] == 0.0 };
    let rounding = same.distance(before).max(same.distance(after));
    same.distance(batch.wi[i].as_dvec3()) < 1e-3 + rounding
}

/// No bias: the mean of many weights is the albedo, within five standard errors.
#[test]
fn weights_average_to_the_albedo() {
    const DRAWS: usize = 200_000;
    let gold = find("gold-paint").expect("catalogue").material.clone();
    let chrome = find("chrome").expect("catalogue").material.clone();
    for material in [gold, chrome].into_iter().chain(shared_lobes()) {
        let brdf = SgdBrdf::new(&material, MaskingKind::Exact);
        let sampler = SamplerBatch::new(&material, MaskingKind::Exact);
        for theta in [0.0, 50.0, 80.0] {
            let (cos, sin) = cos_sin_degrees(theta);
            let (_, u) = many_draws(DRAWS);
            let batch = drawn(&sampler, vec![from_cos_sin(cos, sin, 0.3).as_vec3(); DRAWS], u);
            for (c, albedo) in directional_albedo(&brdf, cos).into_iter().enumerate() {
                let weights = batch.weight.iter().map(|weight| f64::from(weight[c]));
                let mean = weights.clone().sum::<f64>() / DRAWS as f64;
                let variance = weights.map(|weight| (weight - mean).powi(2)).sum::<f64>()
                    / (DRAWS * (DRAWS - 1)) as f64;
                let error = (mean - albedo).abs() / (variance.sqrt() + 1e-5 * albedo);
                assert!(error < 5.0, "{} {theta}°: {mean} {albedo}: {error}", material.name);
            }
        }
    }
}

#[test]
fn densities_of_pairs_are_those_of_draws() {
    for material in
        [find("gold-paint").expect("catalogue").material.clone()].into_iter().chain(shared_lobes())
    {
        let sampler = SamplerBatch::new(&material, MaskingKind::Fitted);
        let (wo, u) = many_draws(600);
        let batch = drawn(&sampler, wo, u);
        let [wi, wo] = [&batch.wi, &batch.wo].map(|w| axes(w));
        let pairs =
            Pairs { wi: wi.each_ref().map(Vec::as_slice), wo: wo.each_ref().map(Vec::as_slice) };
        let mut pdf = vec![f32::NAN; batch.pdf.len()];
        sampler.pdf(&pairs, &mut pdf).expect("equal lengths");
        assert_eq!(pdf, batch.pdf, "{}", material.name);
    }
}

fn axes(w: &[Vec3]) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|axis| w.iter().map(|w| w[axis]).collect())
}

#[test]
fn a_sample_does_not_depend_on_its_place_or_the_width_of_vectors() {
    let material = &find("gold-paint").expect("catalogue").material;
    let (wo, u) = many_draws(300);
    let of_set = |set: InstructionSet| {
        SamplerBatch::new(material, MaskingKind::Exact).with_instruction_set(set)
    };
    for set in InstructionSet::available() {
        let sampler = of_set(set);
        let whole = drawn(&sampler, wo.clone(), u.clone());
        for (start, end) in [(0, 1), (3, 131), (7, 290)] {
            let part = drawn(&sampler, wo[start..end].to_vec(), u[start..end].to_vec());
            assert_eq!(part.wi[..], whole.wi[start..end], "{set:?}");
            assert_eq!(part.weight[..], whole.weight[start..end], "{set:?}");
            assert_eq!(part.pdf[..], whole.pdf[start..end], "{set:?}");
        }
        // Both fuse products and sums.
        if set == InstructionSet::Avx512 {
            let narrower = drawn(&of_set(InstructionSet::Avx2), wo.clone(), u.clone());
            assert_eq!(narrower.wi, whole.wi);
            assert_eq!(narrower.weight, whole.weight);
            assert_eq!(narrower.pdf, whole.pdf);
        }
    }
}

#[test]
fn nothing_that_is_drawn_from_makes_a_weight_that_is_no_number() {
    const ODD: [f32; 8] = [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e-38, 0.5, 1.0, 3.0];
    let material = &find("gold-paint").expect("catalogue").material;
    let of_digits = |i: usize| [0, 1, 2].map(|axis| ODD[i >> (3 * axis) & 7]);
    let wo: Vec<Vec3> = (0..1 << 15).map(|i| Vec3::from(of_digits(i % 512))).collect();
    let u: Vec<[f32; 3]> = (0..1 << 15).map(|i| of_digits(i / 64)).collect();
    for set in InstructionSet::available() {
        let sampler = SamplerBatch::new(material, MaskingKind::Exact).with_instruction_set(set);
        let drawn = drawn(&sampler, wo.clone(), u.clone());
        for (i, (pdf, weight)) in drawn.pdf.iter().zip(&drawn.weight).enumerate() {
            let finite = pdf.is_finite() && weight.iter().all(|weight| weight.is_finite());
            assert!(finite && *pdf >= 0.0, "{set:?} {} {:?}: {pdf} {weight:?}", wo[i], u[i]);
        }
    }
}

#[test]
fn slices_of_different_lengths_are_refused() {
    let batch = SgdBatch::new(&find("chrome").expect("catalogue").material, MaskingKind::Fitted);
    let (two, three) = ([0.0, 1.0], [0.0; 3]);
    let (mut r, mut g, mut b) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    let pairs = Pairs { wi: [&two, &two, &two], wo: [&two, &two, &three] };
    let refused = batch.eval(&pairs, &mut RgbMut([&mut r, &mut g, &mut b]));
    assert_eq!(refused, Err(LengthMismatch { expected: 2, found: 3 }));
}

/// The plain loops stand on the compiler's vectoriser. This looks at what it made of them: few
/// scalar instructions beside the vectors. It is skipped where `objdump` is missing.
#[cfg(target_arch = "x86_64")]
#[test]
fn the_loops_are_vectors() {
    for set in ["avx2", "avx512"] {
        for loops in ["eval", "sample", "pdf"] {
            let name = format!("sgdbake::brdf::batch::dispatch::{loops}::{set}");
            let Some([scalar, vector]) = float_instructions(&name) else {
                println!("skipped: objdump does not show {name}");
                continue;
            };
            assert!(
                vector > 100 && scalar * 4 < vector,
                "{name}: {scalar} scalar, {vector} vector"
            );
        }
    }
}

/// Scalar and packed single-precision arithmetic in a function of this program.
#[cfg(target_arch = "x86_64")]
fn float_instructions(function: &str) -> Option<[usize; 2]> {
    let program = std::env::current_exe().ok()?;
    let mut objdump = std::process::Command::new("objdump");
    objdump.args(["-C", "--no-show-raw-insn", &format!("--disassemble={function}")]).arg(program);
    let listing = String::from_utf8(objdump.output().ok()?.stdout).ok()?;
    let operations = ["add", "sub", "mul", "div", "sqrt"];
    let count = |suffix: &str| {
        let words = listing.split_whitespace().filter(|word| word.ends_with(suffix));
        words.filter(|word| operations.iter().any(|name| word.contains(name))).count()
    };
    let counts = [count("ss"), count("ps")];
    (counts[1] > 0).then_some(counts)
}
