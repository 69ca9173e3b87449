//! The best SGD lobes for a measurement.

use std::f64::consts::FRAC_1_PI;

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use crate::fit::descent::further;
use crate::fit::energy::{self, EnergyLimit};
use crate::fit::measured_target::MeasuredTarget;
use crate::fit::sgd_model::{SgdLobe, SgdModel};
use crate::fit::shape::{LogShape, ShapeGrid, ShapeSamples};
use crate::fit::start::Library;
use crate::fit::uncertainty::{self, Uncertainty};
use crate::math::least_squares::{Bounds, Minimum, NormalEquations, minimise};

/// How many lobes a fit has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lobes {
    /// One lobe that colours all channels.
    One,
    /// Two of them.
    Two,
    /// Two where the second lowers the colour difference by more than a tenth.
    #[default]
    Auto,
    /// The paper's form: a lobe for each channel.
    PerChannel,
}

/// Whether a fit may reflect more than arrives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Energy {
    /// F in \[0, 1\], so f ≥ 0 for every pair, and a directional albedo of at most 1.
    #[default]
    Conserve,
    /// Whatever is nearest to the measurement.
    Free,
}

/// The options of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// The lobes.
    pub lobes: Lobes,
    /// The limits.
    pub energy: Energy,
}

/// A fit and how near it is.
#[derive(Clone, Debug, PartialEq)]
pub struct SgdFit {
    /// The parameters.
    pub model: SgdModel,
    /// Mean ΔE over the ball that was fitted to.
    pub difference: f64,
    /// Standard errors of the parameters.
    pub uncertainty: Uncertainty,
}

/// A second lobe must lower the difference to this share of one lobe's.
const WORTHWHILE: f64 = 0.9;
/// Local minima that are looked for.
const STARTS: usize = 5;
/// Relative decrease at which a descent ends: to compare minima, and of the best.
const ROUGH: f64 = 1e-3;
const FINE: f64 = 1e-5;

/// The best fit to a target.
///
/// # Example
///
/// ```no_run
/// use sgdbake::fit::sgd::Options;
/// use sgdbake::{MeasuredTarget, Measurement, fit_sgd};
///
/// let measurement = Measurement::read("gold-paint.binary".as_ref())?;
/// let fit = fit_sgd(&MeasuredTarget::of(&measurement)?, Options::default());
/// println!("mean ΔE of a lit ball: {:.2}", fit.difference);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn fit(target: &MeasuredTarget, options: Options) -> SgdFit {
    let grid = ShapeGrid::new(target);
    let search = Search { target, grid: &grid, energy: options.energy };
    let library = Library::new(target, &grid, options.energy);
    match options.lobes {
        Lobes::One => search.of(Layout::shared(1), &library),
        Lobes::Two => search.of(Layout::shared(2), &library),
        Lobes::PerChannel => search.of(Layout::per_channel(), &library),
        Lobes::Auto => {
            let [one, two] = [1, 2].map(|lobes| search.of(Layout::shared(lobes), &library));
            if two.difference < WORTHWHILE * one.difference { two } else { one }
        }
    }
}

/// Coefficients of a lobe's colour.
pub const COEFFICIENTS: usize = 5;

/// A function of cosθd by its coefficients of 1 − u − cosθd, u and cosθd with u = (1 − cosθd)⁵:
/// ρs F0, ρs F(90°) = ρs and ρs F(0°) of a Fresnel curve.
type Curve = [f64; 3];

/// The rays of the cone of all curves with 0 ≤ F ≤ F(90°): constant; Schlick's; flat at 90°, 0 at
/// 0°; and two that touch 0 between, at cosθd = 1 − 5^(−¼) and at 0.45.
const PHYSICAL: [Curve; COEFFICIENTS] = [
    [1.0, 1.0, 1.0],
    [0.0, 1.0, 0.0],
    [1.25, 1.0, 0.0],
    [-0.869_19, 1.0, 1.0],
    [-0.344_46, 1.0, 0.270_64],
];
/// Any curve.
const ANY: [Curve; COEFFICIENTS] =
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3], [0.0; 3]];

fn curves(energy: Energy) -> &'static [Curve; COEFFICIENTS] {
    match energy {
        Energy::Conserve => &PHYSICAL,
        Energy::Free => &ANY,
    }
}

/// Σ of the curve's coefficients times functions of cosθd, for each coefficient of a colour.
pub fn with_curves(energy: Energy, [one, u, cosine]: [f64; 3]) -> [f64; COEFFICIENTS] {
    curves(energy).map(|[middle, grazing, facing]| {
        middle * (one - u - cosine) + grazing * u + facing * cosine
    })
}

/// The functions of cosθd that a Fresnel curve is a sum of.
pub fn fresnel_basis(energy: Energy, cos_theta_d: f64) -> [f64; COEFFICIENTS] {
    with_curves(energy, [1.0, (1.0 - cos_theta_d).powi(5), cos_theta_d])
}

/// Bounds of the coefficients.
pub fn coefficient_bounds(energy: Energy) -> [[f64; 2]; COEFFICIENTS] {
    const UP: f64 = f64::INFINITY;
    match energy {
        Energy::Conserve => [[0.0, UP]; COEFFICIENTS],
        Energy::Free => [[-UP, UP], [0.0, UP], [-UP, UP], [0.0; 2], [0.0; 2]],
    }
}

/// ρs F0, ρs and ρs (F0 − F1) of a colour's coefficients.
pub fn products(energy: Energy, x: [f64; COEFFICIENTS]) -> Curve {
    let sum = |i: usize| x.iter().zip(curves(energy)).map(|(x, curve)| x * curve[i]).sum();
    std::array::from_fn(sum)
}

/// ln α that is searched.
pub const LOG_ALPHA: [f64; 2] = [-11.5, 0.7];
/// ln p that is searched.
pub const LOG_P: [f64; 2] = [-4.0, 0.9];

/// Which channels a lobe colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colours {
    /// All.
    All,
    /// One.
    Only(usize),
}

impl Colours {
    /// Returns whether a channel is among them.
    #[must_use]
    pub fn has(self, channel: usize) -> bool {
        self == Self::All || self == Self::Only(channel)
    }
}

/// Where each unknown stands: ρd of the three channels, then for each lobe ln α, ln p and the
/// coefficients of each channel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    lobes: Vec<Colours>,
}

/// Unknowns of a lobe.
const LOBE: usize = 2 + 3 * COEFFICIENTS;

impl Layout {
    /// Lobes that colour all channels.
    #[must_use]
    pub fn shared(lobes: usize) -> Self {
        Self { lobes: vec![Colours::All; lobes] }
    }

    /// A lobe a channel.
    #[must_use]
    pub fn per_channel() -> Self {
        Self { lobes: (0..3).map(Colours::Only).collect() }
    }

    /// The channels of each lobe.
    #[must_use]
    pub fn lobes(&self) -> &[Colours] {
        &self.lobes
    }

    /// Number of unknowns.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        3 + LOBE * self.lobes.len()
    }

    /// Where ln α of a lobe stands; ln p follows.
    #[must_use]
    pub fn shape(&self, lobe: usize) -> usize {
        3 + LOBE * lobe
    }

    /// Where the coefficients of a lobe's channel start.
    #[must_use]
    pub fn colour(&self, lobe: usize, channel: usize) -> usize {
        self.shape(lobe) + 2 + COEFFICIENTS * channel
    }

    /// The shape of a lobe.
    #[must_use]
    pub fn log_shape(&self, x: &DVector<f64>, lobe: usize) -> LogShape {
        let at = self.shape(lobe);
        LogShape { alpha: x[at], p: x[at + 1] }
    }

    /// The coefficients of a lobe's channel.
    #[must_use]
    pub fn coefficients(
        &self,
        x: &DVector<f64>,
        lobe: usize,
        channel: usize,
    ) -> [f64; COEFFICIENTS] {
        let at = self.colour(lobe, channel);
        std::array::from_fn(|k| x[at + k])
    }

    /// The unknowns of a model's parameters, for [`Energy::Free`].
    fn unknowns_of(&self, model: &SgdModel) -> DVector<f64> {
        let mut x = DVector::zeros(self.unknowns());
        (0..3).for_each(|c| x[c] = model.rho_d[c]);
        for (j, lobe) in model.lobes.iter().enumerate() {
            let at = self.shape(j);
            (x[at], x[at + 1]) = (lobe.alpha.ln(), lobe.p.ln());
            for c in 0..3 {
                let colour = self.colour(j, c);
                let [rho_s, f0, f1] = [lobe.rho_s[c], lobe.f0[c], lobe.f1[c]];
                (x[colour], x[colour + 1], x[colour + 2]) = (rho_s * f0, rho_s, rho_s * (f0 - f1));
            }
        }
        x
    }

    fn bounds(&self, energy: Energy) -> Bounds {
        let n = self.unknowns();
        let mut bounds = Bounds { lower: DVector::zeros(n), upper: DVector::zeros(n) };
        let mut set = |i: usize, [low, high]: [f64; 2]| {
            (bounds.lower[i], bounds.upper[i]) = (low, high);
        };
        (0..3).for_each(|c| set(c, [0.0, 1.0]));
        for (lobe, colours) in self.lobes.iter().enumerate() {
            set(self.shape(lobe), LOG_ALPHA);
            set(self.shape(lobe) + 1, LOG_P);
            for c in (0..3).filter(|c| colours.has(*c)) {
                for (k, range) in coefficient_bounds(energy).into_iter().enumerate() {
                    set(self.colour(lobe, c) + k, range);
                }
            }
        }
        bounds
    }

    /// The parameters of a solution, sharpest lobe first; lobes without a colour left out.
    #[must_use]
    pub fn model(&self, x: &DVector<f64>, energy: Energy) -> SgdModel {
        let lobe = |j: usize| {
            let shape = self.log_shape(x, j);
            let parts: [[f64; 3]; 3] =
                std::array::from_fn(|c| products(energy, self.coefficients(x, j, c)));
            let rho_s = parts.map(scale);
            let over = |number: f64, c: usize| if rho_s[c] > 0.0 { number / rho_s[c] } else { 0.0 };
            SgdLobe {
                alpha: shape.alpha(),
                p: shape.p(),
                rho_s,
                f0: std::array::from_fn(|c| over(parts[c][0], c)),
                f1: std::array::from_fn(|c| over(parts[c][0] - parts[c][2], c)),
            }
        };
        let mut lobes: Vec<SgdLobe> = (0..self.lobes.len()).map(lobe).collect();
        lobes.retain(|lobe| lobe.rho_s.iter().any(|rho_s| *rho_s > 0.0));
        if !self.lobes.iter().any(|colours| matches!(colours, Colours::Only(_))) {
            lobes.sort_by(|a, b| a.alpha.total_cmp(&b.alpha));
        }
        SgdModel { rho_d: [x[0], x[1], x[2]], lobes }
    }
}

/// ρs of the products: F(90°) = 1 by the model's form, but a curve that vanishes there needs some.
fn scale([middle, grazing, facing]: [f64; 3]) -> f64 {
    const LEAST: f64 = 1e-3;
    grazing.max(LEAST * middle.abs().max(facing.abs()))
}

/// A search for the best fit to a target.
pub struct Search<'a> {
    target: &'a MeasuredTarget,
    grid: &'a ShapeGrid,
    energy: Energy,
}

impl Search<'_> {
    fn of(&self, layout: Layout, library: &Library) -> SgdFit {
        let bounds = layout.bounds(self.energy);
        let equations = |x: &DVector<f64>| self.equations(&layout, x);
        let rough = library.starts(&layout, STARTS).into_iter();
        let rough: Vec<Minimum> =
            rough.map(|start| minimise(equations, &start, &bounds, ROUGH)).collect();
        let best = rough.into_iter().min_by(|a, b| a.squares.total_cmp(&b.squares));
        let best = best.expect("a library has a start for every layout");
        let best = further(equations, &best.x, &bounds, FINE);
        let x = match self.energy {
            Energy::Free => best.x,
            Energy::Conserve => self.conserving(&layout, best.x, &bounds),
        };
        let model = layout.model(&x, self.energy);
        SgdFit {
            difference: self.difference(&layout, &x),
            uncertainty: self.uncertainty(&model),
            model,
        }
    }

    /// The nearest solution whose albedo is at most 1.
    fn conserving(&self, layout: &Layout, x: DVector<f64>, bounds: &Bounds) -> DVector<f64> {
        let limit = EnergyLimit { layout };
        if energy::largest_albedo(layout, &x) <= energy::MOST {
            return x;
        }
        let equations = |x: &DVector<f64>| {
            let mut equations = self.equations(layout, x);
            limit.add(x, &mut equations);
            equations
        };
        let found = further(equations, &x, bounds, FINE);
        energy::dimmed(layout, found.x)
    }

    /// Standard errors of a model's parameters, as if no bound held them.
    fn uncertainty(&self, model: &SgdModel) -> Uncertainty {
        let free = Search { energy: Energy::Free, ..*self };
        let layout = Layout::shared(model.lobes.len());
        let x = layout.unknowns_of(model);
        let samples = free.samples(&layout, &x);
        let at = |i: usize, rows: &mut [[f64; 3]]| free.value(&layout, &x, &samples, i, rows);
        let [scatter, flatness] = self.target.scatter(layout.unknowns(), at);
        let hessian = free.equations(&layout, &x).hessian - flatness;
        let pairs = self.target.pairs.len();
        uncertainty::of(model, &layout, &uncertainty::covariance(hessian, &scatter, pairs))
    }

    fn difference(&self, layout: &Layout, x: &DVector<f64>) -> f64 {
        let samples = self.samples(layout, x);
        let mut rows = vec![[0.0; 3]; layout.unknowns()];
        let f: Vec<[f64; 3]> = (0..self.target.pairs.len())
            .map(|i| self.value(layout, x, &samples, i, &mut rows))
            .collect();
        self.target.picture_difference(|i| f[i])
    }

    fn samples(&self, layout: &Layout, x: &DVector<f64>) -> Vec<ShapeSamples> {
        (0..layout.lobes().len()).map(|lobe| self.grid.samples(layout.log_shape(x, lobe))).collect()
    }

    fn equations(&self, layout: &Layout, x: &DVector<f64>) -> NormalEquations {
        let samples = self.samples(layout, x);
        let mut equations = self
            .target
            .equations(layout.unknowns(), |i, rows| self.value(layout, x, &samples, i, rows));
        self.settle(layout, x, &mut equations);
        equations
    }

    /// f at a pair and its derivative by each unknown.
    fn value(
        &self,
        layout: &Layout,
        x: &DVector<f64>,
        samples: &[ShapeSamples],
        i: usize,
        rows: &mut [[f64; 3]],
    ) -> [f64; 3] {
        let basis = fresnel_basis(self.energy, self.target.pairs[i].cos_theta_d);
        let mut f = [0.0; 3];
        for c in 0..3 {
            f[c] = x[c] * FRAC_1_PI;
            rows[c][c] = FRAC_1_PI;
        }
        for (lobe, sample) in samples.iter().enumerate() {
            let shape = sample.value[i];
            let at = layout.shape(lobe);
            for c in 0..3 {
                let mut fresnel = 0.0;
                let colour = layout.colour(lobe, c);
                for k in 0..COEFFICIENTS {
                    fresnel += x[colour + k] * basis[k];
                    rows[colour + k][c] = shape * basis[k];
                }
                f[c] += fresnel * shape;
                rows[at][c] = fresnel * sample.by_alpha[i];
                rows[at + 1][c] = fresnel * sample.by_p[i];
            }
        }
        f
    }

    /// Adds what settles unknowns that the measurement leaves open: of all curves the one with the
    /// least F(90°), of all p the nearest to ½, and no lobe sharper than [`SHARPEST`].
    fn settle(&self, layout: &Layout, x: &DVector<f64>, equations: &mut NormalEquations) {
        let mut pull = |i: usize, off: f64, strength: f64| {
            equations.squares += strength * off * off;
            equations.gradient[i] += strength * off;
            equations.hessian[(i, i)] += strength;
        };
        for lobe in 0..layout.lobes().len() {
            let p = layout.shape(lobe) + 1;
            pull(p, x[p] - 0.5_f64.ln(), 1e-5);
            for c in 0..3 {
                let colour = layout.colour(lobe, c);
                for k in 0..COEFFICIENTS {
                    pull(colour + k, x[colour + k], if k == 1 { 1e-6 } else { 1e-8 });
                }
            }
        }
        for lobe in 0..layout.lobes().len() {
            limit_peak(layout, x, lobe, equations);
        }
    }
}

/// D(0) of the sharpest lobe: what a half float holds, a core of 0.13°.
pub const SHARPEST: f64 = 6.5e4;

/// Adds a wall at [`SHARPEST`].
fn limit_peak(layout: &Layout, x: &DVector<f64>, lobe: usize, equations: &mut NormalEquations) {
    const STRENGTH: f64 = 10.0;
    /// The wall starts this far, in ln D(0), before the limit.
    const MARGIN: f64 = 0.05;
    let shape = layout.log_shape(x, lobe);
    let peak = |shape: LogShape| shape.ndf().peak().ln();
    let at = peak(shape);
    let over = at - SHARPEST.ln() + MARGIN;
    if over > 0.0 {
        let place = layout.shape(lobe);
        add_residual(equations, STRENGTH, over, &[place, place + 1], &shape.slopes(at, peak));
    }
}

/// Adds a residual with its derivatives by the unknowns at `places`.
pub fn add_residual(
    equations: &mut NormalEquations,
    strength: f64,
    residual: f64,
    places: &[usize],
    slopes: &[f64],
) {
    equations.squares += strength * residual * residual;
    for (i, by_i) in places.iter().zip(slopes) {
        equations.gradient[*i] += strength * residual * by_i;
        for (j, by_j) in places.iter().zip(slopes) {
            equations.hessian[(*i, *j)] += strength * by_i * by_j;
        }
    }
}
