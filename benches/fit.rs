//! The fits of the whole catalogue, model by model and all together.
//!
//!     cargo bench --bench fit

use divan::{Bencher, black_box};
use rayon::prelude::*;
use sgdbake::fit::{Metric, Target, gltf, mixture, one_lobe};
use sgdbake::material::catalog;
use sgdbake::microfacet::Family;

fn main() {
    divan::main();
}

fn targets() -> Vec<Target> {
    catalog().iter().map(|entry| Target::new(&entry.material)).collect()
}

/// What the fits of one material share.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn target() {
    for entry in catalog() {
        black_box(Target::new(&entry.material));
    }
}

#[divan::bench(args = [Family::Beckmann, Family::Ggx], sample_count = 3, sample_size = 1)]
fn one_lobe_fit(bencher: Bencher<'_, '_>, family: Family) {
    let targets = targets();
    bencher.bench(|| {
        for target in &targets {
            black_box(one_lobe::fit_target(target, family, Metric::default()));
        }
    });
}

#[divan::bench(args = [1, 2, 4, 8], sample_count = 3, sample_size = 1)]
fn mixture_fit(bencher: Bencher<'_, '_>, count: usize) {
    let targets = targets();
    bencher.bench(|| {
        for target in &targets {
            black_box(mixture::fit_target(target, count));
        }
    });
}

/// The mixtures that a manifest or a scene carries, as many as each material needs.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn mixture_for_picture() {
    for entry in catalog() {
        black_box(mixture::for_picture(&entry.material));
    }
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn gltf_fit(bencher: Bencher<'_, '_>) {
    let targets = targets();
    bencher.bench(|| {
        for target in &targets {
            black_box(gltf::fit_target(target, Metric::default()));
        }
    });
}

/// Every model of every material on all cores: what `sgdbake fit --all` computes before it draws.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn all_models_in_parallel() {
    catalog().par_iter().for_each(|entry| {
        let target = Target::new(&entry.material);
        for family in [Family::Beckmann, Family::Ggx] {
            black_box(one_lobe::fit_target(&target, family, Metric::default()));
        }
        black_box(mixture::fit_target(&target, 8));
        black_box(gltf::fit_target(&target, Metric::default()));
    });
}
