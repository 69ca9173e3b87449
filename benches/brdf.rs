//! What an evaluation, an exact masking and a sample cost. Ratios within one run are what counts;
//! `benches/table.py` makes the table in docs/speed.md from this output.

use divan::Bencher;
use divan::counter::ItemsCount;
use glam::DVec3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use sgdbake::brdf::batch::{InstructionSet, Pairs, RgbMut, SgdBatch};
use sgdbake::brdf::sampler::{Sampler, Strategy, published_sample};
use sgdbake::brdf::{ChannelBrdf, SgdBrdf};
use sgdbake::material::{Material, find};
use sgdbake::math::direction::{cot_theta, from_cos_sin};
use sgdbake::microfacet::masking::MaskingKind;
use sgdbake::microfacet::{BeckmannMixture, SmithMasking};

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

/// The exact masking to a relative accuracy of 10^−digits.
#[divan::bench(args = [12, 6])]
fn f64_exact(bencher: Bencher<'_, '_>, digits: i32) {
    let accuracy = 10_f64.powi(-digits);
    let channels = material().channels.each_ref();
    let brdf = SgdBrdf {
        channels: channels.map(|c| ChannelBrdf::with_accuracy(c, MaskingKind::Exact, accuracy)),
    };
    pair_by_pair(bencher, |wi, wo| brdf.eval(wi, wo));
}

#[divan::bench]
fn f32_fitted_pair_by_pair(bencher: Bencher<'_, '_>) {
    let batch = SgdBatch::new(material(), MaskingKind::Fitted)
        .with_instruction_set(InstructionSet::Baseline);
    pair_by_pair(bencher, |wi, wo| batch.terms(wi.as_vec3(), wo.as_vec3()).map(|t| t.brdf));
}

fn batch(bencher: Bencher<'_, '_>, kind: MaskingKind, set: InstructionSet) {
    let batch = SgdBatch::new(material(), kind).with_instruction_set(set);
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
    batch(bencher, MaskingKind::Fitted, *set);
}

#[divan::bench(args = InstructionSet::available())]
fn batch_exact(bencher: Bencher<'_, '_>, set: &InstructionSet) {
    batch(bencher, MaskingKind::Exact, *set);
}

/// One exact G1 of one channel, to a relative accuracy of 10^−digits.
#[divan::bench(args = [12, 6, 3])]
fn g1_exact(bencher: Bencher<'_, '_>, digits: i32) {
    let params = &material().channels[1];
    let mixture = BeckmannMixture::new(params.alpha, params.p, 10_f64.powi(-digits));
    let masking = SmithMasking::new(&mixture);
    pair_by_pair(bencher, |wi, _| masking.g1(cot_theta(wi)));
}

/// One sample with its weight in three channels.
#[divan::bench(args = ["vndf", "ggx"])]
fn sample(bencher: Bencher<'_, '_>, strategy: &str) {
    let strategy = if strategy == "vndf" { Strategy::Vndf } else { Strategy::Ggx };
    let sampler = Sampler::new(material(), MaskingKind::Fitted, strategy);
    pair_by_pair(bencher, |u, wo| sampler.sample_with_weight(wo, u.abs().to_array()));
}

/// The published estimator: one direction per channel.
#[divan::bench]
fn sample_published(bencher: Bencher<'_, '_>) {
    let brdf = SgdBrdf::new(material(), MaskingKind::Fitted);
    pair_by_pair(bencher, |u, wo| {
        brdf.channels.each_ref().map(|channel| published_sample(channel, wo, u.abs().to_array()))
    });
}
