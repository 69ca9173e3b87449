//! The cost of baking: the 2D set of the whole catalogue at a tolerance, a 256³ table, an albedo
//! table, and their files. Ratios within one run are what counts.

use divan::{Bencher, black_box};
use rayon::{ThreadPool, ThreadPoolBuilder};
use sgdbake::brdf::batch::InstructionSet;
use sgdbake::brdf::{MaskingKind, SgdBrdf};
use sgdbake::encode::{Format, encode};
use sgdbake::lut::{Depth, Depths, Extent, Quantity, Request, Row, Rows, albedo, bake, volume};
use sgdbake::material::{Material, catalog, find};
use sgdbake::microfacet::Accuracy;

fn main() {
    divan::main();
}

fn row(name: &str) -> Row {
    let material = &find(name).expect("in the catalogue").material;
    let brdf = SgdBrdf::with_accuracy(material, MaskingKind::Exact, Accuracy::Table).tabulated();
    let mut rows = Rows::default();
    rows.push(name, &brdf, [true; 3]);
    rows.lobes.swap_remove(0)
}

/// The search, its verification and the tables, at tolerance 1e-3.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn catalogue_2d() -> usize {
    let materials: Vec<&Material> = catalog().iter().map(|entry| &entry.material).collect();
    let request = Request {
        quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
        masking: MaskingKind::Exact,
        extent: Extent::Tolerance(1e-3),
        depths: Depths::Smallest,
    };
    bake(&materials, &request).expect("within reach").tables.len()
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn volume_256(bencher: Bencher<'_, '_>) {
    let row = row("gold-paint");
    bencher.bench(|| volume::tabulate(black_box(&row), 0, [256; 3], Depth::Half));
}

/// The same on one thread, so that its time is what the evaluation takes of a CPU.
#[divan::bench(sample_count = 3, sample_size = 1, args = InstructionSet::available())]
fn volume_256_on(bencher: Bencher<'_, '_>, set: &InstructionSet) {
    let (row, one) = (row("gold-paint"), one_thread());
    let tabulate = || volume::tabulate_on(*set, black_box(&row), 0, [256; 3], Depth::Half);
    bencher.bench(|| one.install(tabulate));
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn volume_256_as_ktx2(bencher: Bencher<'_, '_>) {
    let table = volume::tabulate(&row("gold-paint"), 0, [256; 3], Depth::Half);
    bencher.bench(|| encode(black_box(&table), Format::Ktx2));
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn volume_256_as_exr(bencher: Bencher<'_, '_>) {
    let table = volume::tabulate(&row("gold-paint"), 0, [256; 3], Depth::Half);
    bencher.bench(|| encode(black_box(&table), Format::Exr));
}

/// 43 materials, three moments each, at 128 angles: 129 × 128 texels of three channels, from at
/// most 768 half vectors each. One thread.
#[divan::bench(sample_count = 10, sample_size = 1)]
fn albedo_128(bencher: Bencher<'_, '_>) {
    let rows: Vec<Row> = catalog().iter().take(43).map(|entry| row(&entry.material.name)).collect();
    let one = one_thread();
    bencher.bench(|| one.install(|| albedo::tabulate(black_box(&rows), 128, Depth::Half)));
}

/// The quadrature of the same rows that the table is held against. One thread.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn albedo_checks(bencher: Bencher<'_, '_>) {
    let rows: Vec<Row> = catalog().iter().take(43).map(|entry| row(&entry.material.name)).collect();
    let one = one_thread();
    bencher.bench(|| one.install(|| albedo::Checks::new(black_box(&rows))));
}

fn one_thread() -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(1).build().expect("one thread can be had")
}
