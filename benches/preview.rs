//! The picture of the preview's goal, 256² pixels of 256 samples, for two materials.

use sgdbake::material::find;
use sgdbake::preview::render::{Quality, drawn_from, render};
use sgdbake::preview::{Environment, Model, Shape};

fn main() {
    divan::main();
}

#[divan::bench(args = ["gold-paint", "chrome"], sample_count = 3)]
fn ball_256_by_256_samples(bencher: divan::Bencher<'_, '_>, name: &str) {
    let material = &find(name).expect("in the catalogue").material;
    let model = Model::Sgd.reflectance(material).expect("needs no bake");
    let (environment, surface) = (Environment::studio(), drawn_from(material));
    let quality = Quality { size: 256, samples: 256, seed: 1 };
    bencher
        .bench(|| render(&Shape::Ball, &environment, &surface, [model.as_ref()], quality, &|| ()));
}
