//! Speed against error: every way this crate can evaluate a material, timed and held against the
//! exact f64 value in the same run.

use std::time::{Duration, Instant};

use glam::DVec3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;

use crate::brdf::batch::{InstructionSet, Pairs, RgbMut, SgdBatch};
use crate::brdf::lobes::LobesBrdf;
use crate::brdf::one_lobe::Distribution;
use crate::brdf::reflectance::cosine_sample;
use crate::brdf::{ChannelBrdf, Reflectance, SgdBrdf};
use crate::fit::{gltf, lobes, one_lobe};
use crate::lut::BakeError;
use crate::lut::decode::{Lookup, LutBrdf, VolumeBrdf};
use crate::lut::table::Depth;
use crate::material::Material;
use crate::microfacet::masking::MaskingKind;
use crate::report::deviation::{Deviation, Yardstick};
use crate::report::front::margins;
use crate::report::stopwatch::{Job, Patience, Timing, measure};

/// A material's methods with their time and error.
#[derive(Clone, Debug, Serialize)]
pub struct SpeedError {
    /// The material.
    pub material: String,
    /// Every method.
    pub methods: Vec<Measured>,
}

/// A method's figures.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// Its name.
    pub method: String,
    /// What kind of method it is.
    pub family: Family,
    /// Time of one RGB evaluation.
    pub time: Timing,
    /// Parameters or texels that must be stored \[bytes\].
    pub bytes: usize,
    /// Time to make it from the material's parameters: the bake, the fit \[ms\].
    pub preparation_ms: f64,
    /// Error against exact f64.
    pub error: Deviation,
    /// Whether it is on the Pareto front of time and largest error: `margin` > 1.
    pub front: bool,
    /// Its time ratio over the limit that comes nearest to pushing it off, see [`margins`]; null in
    /// JSON where no other method can.
    pub margin: f64,
}

/// Kinds of methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Family {
    /// The model's formula, pair by pair.
    Formula,
    /// The model's formula over slices, in f32 vectors.
    Batch,
    /// Lookup tables.
    Table,
    /// The best fit of another model.
    Fit,
}

impl Family {
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

/// How thoroughly to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Fewer methods and rounds: seconds per material.
    Quick,
    /// Everything.
    Full,
}

/// Measures a material's methods.
///
/// # Errors
///
/// A table that cannot be baked.
pub fn speed_error(material: &Material, effort: Effort) -> Result<SpeedError, BakeError> {
    let methods = methods(material, effort)?;
    let yardstick = Yardstick::new(material);
    let errors: Vec<Deviation> =
        methods.iter().map(|method| yardstick.measure(method.reflectance())).collect();
    let pairs = Hemisphere::new();
    let rounds = measure(methods.iter().map(|m| m.job(&pairs)).collect(), effort.patience());
    let margins = margins(&rounds, &errors.iter().map(|error| error.max).collect::<Vec<_>>());
    let figures = rounds.timings().into_iter().zip(errors).zip(margins);
    let measured = |(m, ((time, error), margin)): (&Method, _)| m.measured(time, error, margin);
    let methods = methods.iter().zip(figures).map(measured).collect();
    Ok(SpeedError { material: material.name.clone(), methods })
}

/// Far shorter than a scheduler's time slice: of many such rounds on a busy machine, few are cut.
const ROUND: Duration = Duration::from_micros(50);

impl Effort {
    fn patience(self) -> Patience {
        match self {
            Self::Quick => Patience { repeats: 51, round: ROUND },
            Self::Full => Patience { repeats: 201, round: ROUND },
        }
    }

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

    fn lobe_counts(self) -> &'static [usize] {
        match self {
            Self::Quick => &[1, 5],
            Self::Full => &[1, 2, 3, 4, 5, 6, 8, 10, 12],
        }
    }
}

/// A way to evaluate a material.
struct Method {
    name: String,
    family: Family,
    bytes: usize,
    preparation: Duration,
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

/// Parameters of a material: 6 per channel, and 3 more of the masking fit.
const EXACT_PARAMETERS: usize = 18;
const FITTED_PARAMETERS: usize = 27;

fn methods(material: &Material, effort: Effort) -> Result<Vec<Method>, BakeError> {
    let mut methods = formulas(material);
    methods.extend(batches(material));
    for width in effort.table_widths() {
        for depth in [Depth::Half, Depth::Float] {
            methods.extend(tables(material, *width, depth)?);
        }
    }
    for size in effort.volume_sizes() {
        methods.push(volume(material, *size)?);
    }
    methods.extend(fits(material, effort));
    Ok(methods)
}

fn formulas(material: &Material) -> Vec<Method> {
    let exact = |accuracy: f64| {
        let name = format!("f64 exact, {accuracy:.0e}");
        Method::new(&name, Family::Formula, numbers(EXACT_PARAMETERS), || {
            let channel = |c| ChannelBrdf::with_accuracy(c, MaskingKind::Exact, accuracy);
            pair_by_pair(SgdBrdf { channels: material.channels.each_ref().map(channel) })
        })
    };
    vec![
        exact(1e-13),
        exact(1e-6),
        exact(1e-3),
        Method::new("f64 fitted", Family::Formula, numbers(FITTED_PARAMETERS), || {
            pair_by_pair(SgdBrdf::new(material, MaskingKind::Fitted))
        }),
        Method::new("f32 exact", Family::Formula, numbers(EXACT_PARAMETERS) / 2, || {
            pair_by_pair(OneByOne(SgdBatch::new(material, MaskingKind::Exact)))
        }),
        Method::new("f32 fitted", Family::Formula, numbers(FITTED_PARAMETERS) / 2, || {
            pair_by_pair(OneByOne(SgdBatch::new(material, MaskingKind::Fitted)))
        }),
    ]
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
        (MaskingKind::Exact, "exact", EXACT_PARAMETERS),
        (MaskingKind::Fitted, "fitted", FITTED_PARAMETERS),
    ];
    let method = |set: InstructionSet| {
        kinds.map(|(kind, name, parameters)| {
            let name = format!("batch {name}, {}", set.name());
            Method::new(&name, Family::Batch, numbers(parameters) / 2, || {
                Evaluator::Slices(SgdBatch::new(material, kind).with_instruction_set(set))
            })
        })
    };
    InstructionSet::available().flat_map(method).collect()
}

fn tables(material: &Material, width: usize, depth: Depth) -> Result<[Method; 2], BakeError> {
    let method = |lookup: Lookup, how: &str| {
        let start = Instant::now();
        let lut = LutBrdf::bake(material, width, depth, lookup)?;
        Ok(Method {
            name: format!("table {width} {}, {how}", depth.name()),
            family: Family::Table,
            bytes: lut.bytes(),
            preparation: start.elapsed(),
            evaluator: pair_by_pair(lut),
        })
    };
    Ok([method(Lookup::Nearest, "nearest")?, method(Lookup::Filtered, "filtered")?])
}

fn volume(material: &Material, size: usize) -> Result<Method, BakeError> {
    let start = Instant::now();
    let volume = VolumeBrdf::bake(material, size, Depth::Half)?;
    Ok(Method {
        name: format!("3D table {size}³ half"),
        family: Family::Table,
        bytes: volume.bytes(),
        preparation: start.elapsed(),
        evaluator: pair_by_pair(volume),
    })
}

fn fits(material: &Material, effort: Effort) -> Vec<Method> {
    // ρd, α and three Fresnel numbers per channel.
    let one_lobe = |distribution, name: &str| {
        Method::new(name, Family::Fit, numbers(15), || {
            pair_by_pair(one_lobe::fit(material, distribution).per_channel)
        })
    };
    // ρd, ρs, f0, f1 per channel; a width and three weights per lobe.
    let lobes = |count: &usize| {
        let name = format!("{count} lobe{}", if *count == 1 { "" } else { "s" });
        Method::new(&name, Family::Fit, numbers(12 + 4 * count), || {
            pair_by_pair(LobesBrdf::new(material, &lobes::lobes(material, *count)))
        })
    };
    let gltf = Method::new("glTF", Family::Fit, numbers(11), || {
        pair_by_pair(gltf::fit(material).material)
    });
    let engines =
        [one_lobe(Distribution::Beckmann, "Beckmann"), one_lobe(Distribution::Ggx, "GGX"), gltf];
    engines.into_iter().chain(effort.lobe_counts().iter().map(lobes)).collect()
}

fn pair_by_pair(reflectance: impl Reflectance + 'static) -> Evaluator {
    Evaluator::PairByPair(Box::new(reflectance))
}

impl Method {
    /// A method whose preparation is timed.
    fn new(name: &str, family: Family, bytes: usize, prepare: impl FnOnce() -> Evaluator) -> Self {
        let start = Instant::now();
        let evaluator = prepare();
        Self { name: name.to_owned(), family, bytes, preparation: start.elapsed(), evaluator }
    }

    fn reflectance(&self) -> &dyn Reflectance {
        match &self.evaluator {
            Evaluator::PairByPair(reflectance) => reflectance.as_ref(),
            Evaluator::Slices(batch) => batch,
        }
    }

    fn job<'a>(&'a self, pairs: &'a Hemisphere) -> Job<'a> {
        let run: Box<dyn FnMut() + 'a> = match &self.evaluator {
            Evaluator::PairByPair(reflectance) => {
                let mut f = vec![[0.0; 3]; pairs.rows.len()];
                Box::new(move || {
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

    fn measured(&self, time: Timing, error: Deviation, margin: f64) -> Measured {
        Measured {
            method: self.name.clone(),
            family: self.family,
            time,
            bytes: self.bytes,
            preparation_ms: self.preparation.as_secs_f64() * 1e3,
            error,
            front: margin > 1.0,
            margin,
        }
    }
}

/// Pairs of directions spread over the hemisphere, as rows and as columns.
struct Hemisphere {
    rows: Vec<[DVec3; 2]>,
    columns: [[Vec<f32>; 3]; 2],
}

/// Pairs in a round: few enough to stay in the first cache.
const PAIRS: usize = 128;

impl Hemisphere {
    fn new() -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let mut direction = || cosine_sample(rng.random());
        let rows: Vec<[DVec3; 2]> = (0..PAIRS).map(|_| [direction(), direction()]).collect();
        let column =
            |side: usize, axis: usize| rows.iter().map(|pair| pair[side][axis] as f32).collect();
        let columns = [0, 1].map(|side| [0, 1, 2].map(|axis| column(side, axis)));
        Self { rows, columns }
    }

    fn columns(&self) -> Pairs<'_> {
        let [wi, wo] = self.columns.each_ref().map(|side| side.each_ref().map(Vec::as_slice));
        Pairs { wi, wo }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::find;

    #[test]
    fn every_family_is_measured_and_the_exact_one_is_exact() {
        let material = &find("gold-paint").expect("in the catalogue").material;
        let report = speed_error(material, Effort::Quick).expect("bakes");
        for family in Family::ALL {
            assert!(report.methods.iter().any(|m| m.family == family), "{family:?}");
        }
        let exact = &report.methods[0];
        assert!(exact.front && exact.error.max == 0.0 && exact.time.median_ns > 0.0);
        let by_name = |name: &str| {
            report.methods.iter().find(|m| m.method == name).unwrap_or_else(|| panic!("no {name}"))
        };
        assert!(by_name("GGX").error.max > 100.0 * by_name("table 512 float, filtered").error.max);
        assert!(by_name("f32 exact").error.max < 1e-4);
    }
}
