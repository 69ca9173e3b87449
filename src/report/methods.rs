//! The ways in which this crate can evaluate a material.

use std::time::{Duration, Instant};

use glam::DVec3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;

use crate::brdf::batch::{InstructionSet, Pairs, RgbMut, SgdBatch};
use crate::brdf::model::fresnel;
use crate::brdf::reflectance::cosine_sample;
use crate::brdf::{Brdf, Lobe, MaskingKind, Reflectance, SgdBrdf};
use crate::fit::{gltf, mixture, one_lobe};
use crate::lut::decode::{Lookup, LutBrdf, VolumeBrdf};
use crate::lut::{BakeError, Baked, Depth, Depths, Extent, Quantity, Request, bake};
use crate::material::Material;
use crate::microfacet::{Accuracy, BeckmannMixture, Family};
use crate::report::stopwatch::Job;

/// Kinds of methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MethodFamily {
    /// The model's formula, pair by pair.
    Formula,
    /// The model's formula over slices, in f32 vectors.
    Batch,
    /// Lookup tables.
    Table,
    /// The best fit of another model.
    Fit,
}

impl MethodFamily {
    /// Every family.
    pub const ALL: [Self; 4] = [Self::Formula, Self::Batch, Self::Table, Self::Fit];

    /// Its name, as in JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Formula => "formula",
            Self::Batch => "batch",
            Self::Table => "table",
            Self::Fit => "fit",
        }
    }
}

/// The thoroughness of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Fewer methods and rounds: seconds per material.
    Quick,
    /// Everything.
    Full,
}

impl Effort {
    fn table_widths(self) -> &'static [usize] {
        match self {
            Self::Quick => &[64, 512],
            Self::Full => &[32, 64, 128, 256, 512, 1024],
        }
    }

    fn volume_sizes(self) -> &'static [usize] {
        match self {
            Self::Quick => &[32],
            Self::Full => &[32, 64, 128],
        }
    }

    fn component_counts(self) -> &'static [usize] {
        match self {
            Self::Quick => &[1, 5],
            Self::Full => &[1, 2, 3, 4, 5, 6, 8, 10, 12],
        }
    }
}

/// A way to evaluate a material.
pub(super) struct Method {
    pub(super) name: String,
    pub(super) family: MethodFamily,
    pub(super) bytes: usize,
    pub(super) preparation: Duration,
    evaluator: Evaluator,
}

enum Evaluator {
    PairByPair(Box<dyn Reflectance>),
    Slices(SgdBatch),
}

/// Bytes of `count` numbers in f64.
const fn numbers(count: usize) -> usize {
    8 * count
}

/// Numbers that describe a material: ρd of three colours; α and p of each lobe, and ρs, f0 and f1
/// of each colour that it reflects.
fn exact_parameters(material: &Material) -> usize {
    let mut numbers = 3;
    for lobe in material.lobes() {
        let colours = lobe.rho_s().iter().filter(|rho_s| **rho_s > 0.0).count();
        numbers += 2 + 3 * colours;
    }
    numbers
}

/// The same with λ, c and k of each lobe.
fn fitted_parameters(material: &Material) -> usize {
    exact_parameters(material) + 3 * material.lobes().len()
}

/// Every method of a material.
pub(super) fn methods(material: &Material, effort: Effort) -> Result<Vec<Method>, BakeError> {
    let mut methods = formulas(material);
    methods.extend(batches(material));
    for width in effort.table_widths() {
        for depth in [Depth::Half, Depth::Float] {
            methods.extend(tables(material, *width, depth)?);
        }
    }
    for size in effort.volume_sizes() {
        methods.extend(volume(material, *size)?);
    }
    methods.extend(fits(material, effort));
    Ok(methods)
}

fn formulas(material: &Material) -> Vec<Method> {
    let exact = numbers(exact_parameters(material));
    let fitted = numbers(fitted_parameters(material));
    vec![
        Method::formula("f64 exact, 1e-13", exact, || {
            SgdBrdf::with_accuracy(material, MaskingKind::Exact, Accuracy::Reference)
        }),
        Method::formula("f64 exact, 1e-6", exact, || {
            SgdBrdf::with_accuracy(material, MaskingKind::Exact, Accuracy::Picture)
        }),
        Method::formula("f64 exact, 1e-3", exact, || coarse(material, 1e-3)),
        Method::formula("f64 fitted", fitted, || SgdBrdf::new(material, MaskingKind::Fitted)),
        Method::formula("f32 exact", exact / 2, || {
            OneByOne(SgdBatch::new(material, MaskingKind::Exact))
        }),
        Method::formula("f32 fitted", fitted / 2, || {
            OneByOne(SgdBatch::new(material, MaskingKind::Fitted))
        }),
    ]
}

/// SGD through Beckmann mixtures so short that masking is within `accuracy` of the exact one.
fn coarse(material: &Material, accuracy: f64) -> Brdf<BeckmannMixture> {
    let lobes = material.lobes().iter().map(|params| Lobe {
        distribution: BeckmannMixture::new(params.alpha(), params.p(), accuracy),
        fitted: None,
        rho_s: params.rho_s(),
        fresnel: fresnel(params),
    });
    Brdf { rho_d: material.rho_d(), lobes: lobes.collect() }
}

/// The f32 kernel called for each pair by itself.
struct OneByOne(SgdBatch);

impl Reflectance for OneByOne {
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        Reflectance::eval(&self.0, wi, wo)
    }
}

fn batches(material: &Material) -> Vec<Method> {
    let kinds = [
        (MaskingKind::Exact, "exact", exact_parameters(material)),
        (MaskingKind::Fitted, "fitted", fitted_parameters(material)),
    ];
    let mut methods = Vec::new();
    for set in InstructionSet::available() {
        for (kind, name, parameters) in kinds {
            let name = format!("batch {name}, {}", set.name());
            methods.push(Method::new(&name, MethodFamily::Batch, numbers(parameters) / 2, || {
                Evaluator::Slices(SgdBatch::new(material, kind).with_instruction_set(set))
            }));
        }
    }
    methods
}

/// Bakes some quantities of one material.
fn baked(
    material: &Material,
    quantities: &[Quantity],
    size: usize,
    depth: Depth,
) -> Result<Baked, BakeError> {
    let request = Request {
        quantities: quantities.to_vec(),
        masking: MaskingKind::Exact,
        extent: Extent::Size(size),
        depths: Depths::Only(depth),
    };
    bake(&[material], &request)
}

fn tables(material: &Material, width: usize, depth: Depth) -> Result<Vec<Method>, BakeError> {
    const FACTORS: [Quantity; 3] = [Quantity::Ndf, Quantity::Masking, Quantity::Fresnel];
    // One bake serves both lookups, and counts for each.
    let start = Instant::now();
    let baked = baked(material, &FACTORS, width, depth)?;
    let preparation = start.elapsed();
    let mut methods = Vec::new();
    for (lookup, how) in [(Lookup::Nearest, "nearest"), (Lookup::Filtered, "filtered")] {
        methods.extend(LutBrdf::new(&baked, 0, lookup).map(|lut| Method {
            name: format!("table {width} {}, {how}", depth.name()),
            family: MethodFamily::Table,
            bytes: lut.bytes(),
            preparation,
            evaluator: pair_by_pair(lut),
        }));
    }
    Ok(methods)
}

fn volume(material: &Material, size: usize) -> Result<Option<Method>, BakeError> {
    let start = Instant::now();
    let baked = baked(material, &[Quantity::Brdf3d], size, Depth::Half)?;
    Ok(VolumeBrdf::new(&baked, 0).map(|volume| Method {
        name: format!("3D table {size}³ half"),
        family: MethodFamily::Table,
        bytes: volume.bytes(),
        preparation: start.elapsed(),
        evaluator: pair_by_pair(volume),
    }))
}

fn fits(material: &Material, effort: Effort) -> Vec<Method> {
    let lobes = material.lobes().len();
    // Base colour, metallic, roughness, specular factor and colour, clearcoat and its roughness.
    let gltf = Method::new("glTF", MethodFamily::Fit, numbers(11), || {
        pair_by_pair(gltf::fit(material).material)
    });
    let engines = [(Family::Beckmann, "Beckmann"), (Family::Ggx, "GGX")].map(|(family, name)| {
        // ρd, α and three Fresnel numbers per channel.
        Method::new(name, MethodFamily::Fit, numbers(15), || {
            pair_by_pair(one_lobe::fit(material, family).per_channel.brdf())
        })
    });
    let mixtures = effort.component_counts().iter().map(|count| {
        let name = format!("{count} Beckmann");
        // In place of α and p of each lobe: shared widths, and a weight of each width per lobe.
        let bytes = numbers(exact_parameters(material) - 2 * lobes + (1 + lobes) * count);
        Method::new(&name, MethodFamily::Fit, bytes, || {
            let mixture = mixture::best_picture(material, *count);
            pair_by_pair(Brdf::of_mixture(material, &mixture))
        })
    });
    engines.into_iter().chain([gltf]).chain(mixtures).collect()
}

fn pair_by_pair(reflectance: impl Reflectance + 'static) -> Evaluator {
    Evaluator::PairByPair(Box::new(reflectance))
}

impl Method {
    /// A method whose preparation is timed.
    fn new(
        name: &str,
        family: MethodFamily,
        bytes: usize,
        prepare: impl FnOnce() -> Evaluator,
    ) -> Self {
        let start = Instant::now();
        let evaluator = prepare();
        Self { name: name.to_owned(), family, bytes, preparation: start.elapsed(), evaluator }
    }

    /// A formula of `bytes` parameters that is evaluated pair by pair.
    fn formula<R: Reflectance + 'static>(
        name: &str,
        bytes: usize,
        prepare: impl FnOnce() -> R,
    ) -> Self {
        Self::new(name, MethodFamily::Formula, bytes, || pair_by_pair(prepare()))
    }

    pub(super) fn reflectance(&self) -> &dyn Reflectance {
        match &self.evaluator {
            Evaluator::PairByPair(reflectance) => reflectance.as_ref(),
            Evaluator::Slices(batch) => batch,
        }
    }

    pub(super) fn job<'a>(&'a self, pairs: &'a Hemisphere) -> Job<'a> {
        let run: Box<dyn FnMut() + 'a> = match &self.evaluator {
            Evaluator::PairByPair(reflectance) => {
                let mut f = vec![[0.0; 3]; pairs.rows.len()];
                Box::new(move || {
                    // Opaque pairs and a result that is looked at: nothing is hoisted or dropped.
                    reflectance.eval_all(std::hint::black_box(&pairs.rows), &mut f);
                    std::hint::black_box(&f);
                })
            }
            Evaluator::Slices(batch) => {
                let mut f = [(); 3].map(|()| vec![0.0_f32; pairs.rows.len()]);
                Box::new(move || {
                    let [r, g, b] = &mut f;
                    let columns = std::hint::black_box(pairs).columns();
                    batch
                        .eval(&columns, &mut RgbMut([r, g, b]))
                        .expect("all columns have one length");
                    std::hint::black_box(&f);
                })
            }
        };
        Job { run, evaluations: pairs.rows.len() }
    }
}

/// Pairs of directions spread over the hemisphere, as rows and as columns.
pub(super) struct Hemisphere {
    rows: Vec<[DVec3; 2]>,
    columns: [[Vec<f32>; 3]; 2],
}

/// Pairs in a round: few enough to stay in the first cache.
const PAIRS: usize = 128;

impl Hemisphere {
    pub(super) fn new() -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        // Cosine-weighted, from a fixed seed: the same pairs for every method and in every run.
        let rows: Vec<[DVec3; 2]> = (0..PAIRS)
            .map(|_| [cosine_sample(rng.random()), cosine_sample(rng.random())])
            .collect();
        let columns = [0, 1].map(|side| {
            [0, 1, 2].map(|axis| rows.iter().map(|pair| pair[side][axis] as f32).collect())
        });
        Self { rows, columns }
    }

    fn columns(&self) -> Pairs<'_> {
        let [wi, wo] = self.columns.each_ref().map(|side| side.each_ref().map(Vec::as_slice));
        Pairs { wi, wo }
    }
}
