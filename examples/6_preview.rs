//! A ball in a measured material next to its best GGX fit, and how different they look.

// An example shows what it found.
#![allow(clippy::print_stdout)]

use sgdbake::material::find;
use sgdbake::preview::render::{Quality, drawn_from, render};
use sgdbake::preview::{Environment, Model, Shape};

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let material = &find("gold-paint")?.material;
    let models = [Model::Sgd.reflectance(material)?, Model::Ggx.reflectance(material)?];
    let quality = Quality { size: 64, samples: 64, seed: 1 };
    let [sgd, ggx] = render(
        &Shape::Ball,
        &Environment::studio(),
        &drawn_from(material),
        models.each_ref().map(AsRef::as_ref),
        quality,
        &|| (),
    );
    let difference = ggx.film.delta_e(&sgd.film);
    println!("ΔE2000: mean {:.2}, largest {:.2}", difference.mean, difference.max);
    println!("{} bytes of PNG", sgd.film.to_png()?.len());
    Ok(())
}
