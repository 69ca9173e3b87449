//! What an evaluation, an exact masking and a sample cost. Ratios within one run are what counts;
//! `benches/table.py` makes the table in docs/speed.md from this output.

use divan::Bencher;
use divan::counter::ItemsCount;
use glam::DVec3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use sgdbake::brdf::batch::{
    Draws, InstructionSet, Pairs, RgbMut, SamplerBatch, SamplesMut, SgdBatch,
};
use sgdbake::brdf::sampler::{Sampler, Strategy, published_sample};
use sgdbake::brdf::{MaskingKind, SgdBrdf};
use sgdbake::material::{LobeFields, LobeParams, Material, find, named};
use sgdbake::math::direction::{cot_theta, from_cos_sin};
use sgdbake::microfacet::{Accuracy, BeckmannMixture, Distribution as _};

fn main() {
    divan::main();
}

/// Pairs per iteration: few, so that the fastest iteration was not interrupted on a busy machine.
const PAIRS: usize = 512;

fn material() -> &'static Material {
    &find("gold-paint").expect("in the catalogue").material
}

fn directions(seed: u64) -> Vec<DVec3> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut uniform = || {
        let cos: f64 = rng.random();
        from_cos_sin(cos, (1.0 - cos * cos).sqrt(), rng.random::<f64>() * std::f64::consts::TAU)
    };
    (0..PAIRS).map(|_| uniform()).collect()
}

/// One pair after another through `eval`.
fn pair_by_pair<T>(bencher: Bencher<'_, '_>, eval: impl Fn(DVec3, DVec3) -> T + Sync) {
    let (wi, wo) = (directions(1), directions(2));
    bencher.counter(ItemsCount::new(PAIRS)).bench(|| {
        for (wi, wo) in wi.iter().zip(&wo) {
            divan::black_box(eval(*wi, *wo));
        }
    });
}

#[divan::bench]
fn f64_fitted(bencher: Bencher<'_, '_>) {
    let brdf = SgdBrdf::new(material(), MaskingKind::Fitted);
    pair_by_pair(bencher, |wi, wo| brdf.eval(wi, wo));
}

/// The exact masking to rounding and to six digits.
#[divan::bench(args = [Accuracy::Reference, Accuracy::Picture])]
fn f64_exact(bencher: Bencher<'_, '_>, accuracy: Accuracy) {
    let brdf = SgdBrdf::with_accuracy(material(), MaskingKind::Exact, accuracy);
    pair_by_pair(bencher, |wi, wo| brdf.eval(wi, wo));
}

#[divan::bench]
fn f32_fitted_pair_by_pair(bencher: Bencher<'_, '_>) {
    let batch = SgdBatch::new(material(), MaskingKind::Fitted)
        .with_instruction_set(InstructionSet::Baseline);
    pair_by_pair(bencher, |wi, wo| batch.terms(wi.as_vec3(), wo.as_vec3()).brdf);
}

/// One lobe that colours all channels: D and G1 are evaluated once in place of thrice.
fn one_lobe() -> Material {
    let [r, g, b] = find("gold-paint").expect("in the catalogue").channels;
    let fields = LobeFields {
        alpha: g.alpha,
        p: g.p,
        masking: g.masking,
        rho_s: [r.rho_s, g.rho_s, b.rho_s],
        f0: [r.f0, g.f0, b.f0],
        f1: [r.f1, g.f1, b.f1],
    };
    let lobe = LobeParams::new(fields).expect("of a published material");
    Material::new("one lobe", [r.rho_d, g.rho_d, b.rho_d], vec![lobe]).expect("in range")
}

fn batch(bencher: Bencher<'_, '_>, material: &Material, kind: MaskingKind, set: InstructionSet) {
    let batch = SgdBatch::new(material, kind).with_instruction_set(set);
    let (wi, wo) = (directions(1), directions(2));
    let component = |w: &[DVec3], axis: usize| w.iter().map(|w| w[axis] as f32).collect::<Vec<_>>();
    let wi = [0, 1, 2].map(|axis| component(&wi, axis));
    let wo = [0, 1, 2].map(|axis| component(&wo, axis));
    let mut out = [0, 1, 2].map(|_| vec![0.0; PAIRS]);
    bencher.counter(ItemsCount::new(PAIRS)).bench_local(|| {
        let pairs =
            Pairs { wi: wi.each_ref().map(Vec::as_slice), wo: wo.each_ref().map(Vec::as_slice) };
        let mut rgb = RgbMut(out.each_mut().map(Vec::as_mut_slice));
        divan::black_box(batch.eval(&pairs, &mut rgb)).expect("equal lengths");
    });
}

#[divan::bench(args = InstructionSet::available())]
fn batch_fitted(bencher: Bencher<'_, '_>, set: &InstructionSet) {
    batch(bencher, material(), MaskingKind::Fitted, *set);
}

#[divan::bench(args = InstructionSet::available())]
fn batch_exact(bencher: Bencher<'_, '_>, set: &InstructionSet) {
    batch(bencher, material(), MaskingKind::Exact, *set);
}

#[divan::bench(args = InstructionSet::available())]
fn batch_fitted_one_lobe(bencher: Bencher<'_, '_>, set: &InstructionSet) {
    batch(bencher, &one_lobe(), MaskingKind::Fitted, *set);
}

#[divan::bench(args = InstructionSet::available())]
fn batch_exact_one_lobe(bencher: Bencher<'_, '_>, set: &InstructionSet) {
    batch(bencher, &one_lobe(), MaskingKind::Exact, *set);
}

/// Two lobes that colour all channels, as most refitted materials have.
#[divan::bench(args = InstructionSet::available())]
fn batch_exact_two_lobes(bencher: Bencher<'_, '_>, set: &InstructionSet) {
    let refit = named("gold-paint@refit").expect("in the catalogue");
    batch(bencher, refit, MaskingKind::Exact, *set);
}

#[divan::bench]
fn f64_fitted_one_lobe(bencher: Bencher<'_, '_>) {
    let brdf = SgdBrdf::new(&one_lobe(), MaskingKind::Fitted);
    pair_by_pair(bencher, |wi, wo| brdf.eval(wi, wo));
}

/// One exact G1 of one lobe, to a relative accuracy of 10^−digits.
#[divan::bench(args = [12, 6, 3])]
fn g1_exact(bencher: Bencher<'_, '_>, digits: i32) {
    let params = &material().lobes()[1];
    let mixture = BeckmannMixture::new(params.alpha(), params.p(), 10_f64.powi(-digits));
    pair_by_pair(bencher, |wi, _| mixture.g1(cot_theta(wi)));
}

/// One sample with its weight in three channels.
#[divan::bench(args = ["vndf", "ggx"])]
fn sample(bencher: Bencher<'_, '_>, strategy: &str) {
    let strategy = if strategy == "vndf" { Strategy::Vndf } else { Strategy::Ggx };
    let sampler = Sampler::new(material(), MaskingKind::Fitted, strategy);
    pair_by_pair(bencher, |u, wo| sampler.sample_with_weight(wo, u.abs().to_array()));
}

/// The same, many at a time in f32.
#[divan::bench(args = InstructionSet::available())]
fn sample_batch(bencher: Bencher<'_, '_>, set: &InstructionSet) {
    let sampler = SamplerBatch::new(material(), MaskingKind::Exact).with_instruction_set(*set);
    let (u, wo) = (directions(1), directions(2));
    let component = |w: &[DVec3], axis: usize| w.iter().map(|w| w[axis] as f32).collect::<Vec<_>>();
    let u = [0, 1, 2].map(|axis| component(&u, axis).into_iter().map(f32::abs).collect::<Vec<_>>());
    let wo = [0, 1, 2].map(|axis| component(&wo, axis));
    let [mut x, mut y, mut z, mut r, mut g, mut b, mut pdf] = [0; 7].map(|_| vec![0.0; PAIRS]);
    bencher.counter(ItemsCount::new(PAIRS)).bench_local(|| {
        let draws =
            Draws { wo: wo.each_ref().map(Vec::as_slice), u: u.each_ref().map(Vec::as_slice) };
        let mut samples = SamplesMut {
            wi: [&mut x, &mut y, &mut z],
            weight: [&mut r, &mut g, &mut b],
            pdf: &mut pdf,
        };
        divan::black_box(sampler.sample(&draws, &mut samples)).expect("equal lengths");
    });
}

/// The published estimator: one direction per channel.
#[divan::bench]
fn sample_published(bencher: Bencher<'_, '_>) {
    let brdf = SgdBrdf::new(material(), MaskingKind::Fitted);
    pair_by_pair(bencher, |u, wo| {
        [0, 1, 2].map(|c| published_sample(&brdf, c, c, wo, u.abs().to_array()))
    });
}
