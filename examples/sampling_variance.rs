//! How noisy each way of sampling is, and what the published estimator gets wrong: the tables of
//! docs/sampling.md.
//!
//!     cargo run --release --example sampling_variance

// An example shows what it found.
#![allow(clippy::print_stdout)]

use std::time::Instant;

use glam::DVec3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use sgdbake::brdf::albedo::directional_albedo;
use sgdbake::brdf::sampler::published_sample;
use sgdbake::brdf::{MaskingKind, Sampler, SgdBrdf, Strategy};
use sgdbake::material::{ChannelParams, LobeParams, Material, find};
use sgdbake::math::direction::{cos_sin_degrees, from_cos_sin};

const DRAWS: u32 = 200_000;
const KIND: MaskingKind = MaskingKind::Fitted;

fn direction(theta: f64) -> DVec3 {
    let (cos, sin) = cos_sin_degrees(theta);
    from_cos_sin(cos, sin, 0.0)
}

/// E[w²]/albedo² and the largest weight over the albedo, the worst of the channels; and what a
/// given noise costs: the relative variance times the nanoseconds of a draw.
fn noise(albedo: [f64; 3], mut draw: impl FnMut([f64; 3]) -> [f64; 3]) -> [f64; 3] {
    let start = Instant::now();
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let (mut squares, mut largest) = ([0.0; 3], 0.0_f64);
    for _ in 0..DRAWS {
        let weight = draw(rng.random());
        for c in 0..3 {
            let relative = weight[c] / albedo[c];
            squares[c] += relative * relative / f64::from(DRAWS);
            largest = largest.max(relative);
        }
    }
    let nanoseconds = start.elapsed().as_secs_f64() * 1e9 / f64::from(DRAWS);
    let second_moment = squares.into_iter().fold(0.0, f64::max);
    [second_moment, largest, (second_moment - 1.0).max(0.0) * nanoseconds]
}

/// One direction for the three channels.
fn shared(sampler: &Sampler, wo: DVec3, u: [f64; 3]) -> [f64; 3] {
    sampler.sample_with_weight(wo, u).map_or([0.0; 3], |sample| sample.weight)
}

/// A direction of its own for each channel: the sampler of a grey material per channel.
fn per_channel(material: &Material) -> [Sampler; 3] {
    material.channels().expect("in the paper's form").map(|channel| {
        let grey = Material::of_channels("grey", &[channel; 3]).expect("in range");
        Sampler::new(&grey, KIND, Strategy::Vndf)
    })
}

fn variance_table() {
    println!(
        "| material, θo | vndf | vndf, a direction per channel | ggx, tuned width | ggx, width α | published |"
    );
    println!("|---|---|---|---|---|---|");
    for name in ["chrome", "blue-acrylic", "gold-metallic-paint2", "gold-paint", "pink-fabric"] {
        let material = &find(name).expect("in the catalogue").material;
        let brdf = SgdBrdf::new(material, KIND);
        let widths: Vec<f64> = material.lobes().iter().map(LobeParams::alpha).collect();
        let samplers = [
            Sampler::new(material, KIND, Strategy::Vndf),
            Sampler::new(material, KIND, Strategy::Ggx),
            Sampler::new(material, KIND, Strategy::Ggx).with_ggx_widths(&widths),
        ];
        let own = per_channel(material);
        for theta in [0.0, 45.0, 80.0] {
            let wo = direction(theta);
            let albedo = directional_albedo(&brdf, wo.z);
            let [vndf, ggx, narrow] =
                samplers.each_ref().map(|sampler| noise(albedo, |u| shared(sampler, wo, u)));
            let separate = noise(albedo, |u| std::array::from_fn(|c| shared(&own[c], wo, u)[c]));
            let published =
                noise(albedo, |u| [0, 1, 2].map(|c| published_sample(&brdf, c, c, wo, u).printed));
            let cells =
                [vndf, separate, ggx, narrow, published].map(|[second_moment, largest, cost]| {
                    format!("{second_moment:.3} ({largest:.3}) {cost:.0}")
                });
            println!("| {name}, {theta}° | {} |", cells.join(" | "));
        }
    }
}

fn erratum_table() {
    println!("| θo | quadrature | published weight | corrected weight | standard error |");
    println!("|---|---|---|---|---|");
    let params = find("gold-paint").expect("in the catalogue").channels[1];
    let specular = [ChannelParams { rho_d: 0.0, ..params }; 3];
    let brdf = SgdBrdf::new(&Material::of_channels("specular", &specular).expect("in range"), KIND);
    for theta in [0.0, 30.0, 60.0, 80.0] {
        let wo = direction(theta);
        let quadrature = directional_albedo(&brdf, wo.z)[1];
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let (mut printed, mut corrected, mut squares) = (0.0, 0.0, 0.0);
        for _ in 0..10 * DRAWS {
            let sample = published_sample(&brdf, 1, 0, wo, rng.random());
            printed += sample.printed;
            corrected += sample.corrected;
            squares += sample.corrected * sample.corrected;
        }
        let n = f64::from(10 * DRAWS);
        let (printed, corrected) = (printed / n, corrected / n);
        let error = ((squares / n - corrected * corrected) / n).sqrt();
        println!("| {theta}° | {quadrature:.4} | {printed:.4} | {corrected:.4} | {error:.5} |");
    }
}

fn main() {
    println!(
        "Second moment E[w²] of the weights over the squared albedo, and in brackets the largest of {DRAWS} weights over the albedo; the worst of the three channels.\n"
    );
    variance_table();
    println!("\nSpecular albedo of gold-paint green, fitted masking.\n");
    erratum_table();
}
