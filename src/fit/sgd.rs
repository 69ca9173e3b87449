//! The best SGD lobes for a measurement.

use std::f64::consts::FRAC_1_PI;

use nalgebra::DVector;

use crate::fit::descent::further;
use crate::fit::energy::{MAX_ALBEDO, dimmed, largest_albedo, limit_albedo};
use crate::fit::fresnel_curve::{COEFFICIENTS, fresnel_basis};
use crate::fit::measured_target::MeasuredTarget;
use crate::fit::penalty::settle;
use crate::fit::sgd_model::SgdModel;
use crate::fit::shape::{ShapeGrid, ShapeSamples};
use crate::fit::start::Library;
use crate::fit::uncertainty::{self, Uncertainty};
use crate::fit::unknowns::Layout;
use crate::math::least_squares::{Bounds, NormalEquations, minimise};

pub use crate::fit::fresnel_curve::Energy;

/// The number of lobes of a fit, and the channels they colour.
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

/// A search for the best fit to a target.
struct Search<'a> {
    target: &'a MeasuredTarget,
    grid: &'a ShapeGrid,
    energy: Energy,
}

/// Unknowns, and the shapes of their lobes at every pair.
struct Model<'a> {
    layout: &'a Layout,
    x: &'a DVector<f64>,
    shapes: Vec<ShapeSamples>,
}

impl Search<'_> {
    /// The best fit of a layout.
    fn of(&self, layout: Layout, library: &Library) -> SgdFit {
        let bounds = layout.bounds(self.energy);
        let starts = library.starts(&layout, STARTS).into_iter();
        // Only the lowest is followed to the end.
        let rough =
            starts.map(|start| minimise(|x| self.equations(&layout, x), &start, &bounds, ROUGH));
        let best = rough.min_by(|a, b| a.squares.total_cmp(&b.squares));
        let best = best.expect("a library has a start for every layout");
        let best = further(|x| self.equations(&layout, x), &best.x, &bounds, FINE);
        let x = match self.energy {
            Energy::Free => best.x,
            Energy::Conserve => self.conserving(&layout, best.x, &bounds),
        };
        let model = layout.model(&x, self.energy);
        SgdFit {
            difference: self.difference(&layout, &x),
            uncertainty: self.uncertainty(&layout, &model),
            model,
        }
    }

    /// The nearest solution whose albedo is at most 1.
    fn conserving(&self, layout: &Layout, x: DVector<f64>, bounds: &Bounds) -> DVector<f64> {
        if largest_albedo(layout, &x) <= MAX_ALBEDO {
            return x;
        }
        // The limit bends the fit at a few angles; what it leaves between them is dimmed away.
        let limited = further(|x| self.limited_equations(layout, x), &x, bounds, FINE);
        dimmed(layout, limited.x)
    }

    /// [`Self::equations`] with the limit of the albedo.
    fn limited_equations(&self, layout: &Layout, x: &DVector<f64>) -> NormalEquations {
        let mut equations = self.equations(layout, x);
        limit_albedo(layout, x, &mut equations);
        equations
    }

    /// Standard errors of a model's parameters, as if none had met the end of its range.
    fn uncertainty(&self, layout: &Layout, model: &SgdModel) -> Uncertainty {
        // ρs, F0 and F1 are quotients of the free coefficients: errors carry over by slopes.
        let free = Search { energy: Energy::Free, ..*self };
        let x = layout.unknowns_of(model);
        let here = free.model(layout, &x);
        let [scatter, flatness] =
            self.target.scatter(layout.unknowns(), |i, rows| free.value(&here, i, rows));
        // The equations hold each pair's weight fixed; in truth it falls as the error grows.
        let hessian = free.equations(layout, &x).hessian - flatness;
        let bounds = layout.bounds(free.energy);
        let pairs = self.target.pairs.len();
        let covariance = uncertainty::covariance(&hessian, &scatter, &bounds, pairs);
        uncertainty::of(model, layout, &covariance)
    }

    /// The mean ΔE over the ball.
    fn difference(&self, layout: &Layout, x: &DVector<f64>) -> f64 {
        let model = self.model(layout, x);
        // `value` always writes its derivatives; here nobody reads them.
        let mut rows = vec![[0.0; 3]; layout.unknowns()];
        let pairs = 0..self.target.pairs.len();
        let f: Vec<[f64; 3]> = pairs.map(|i| self.value(&model, i, &mut rows)).collect();
        self.target.picture_difference(|i| f[i])
    }

    /// The model of the unknowns.
    fn model<'a>(&self, layout: &'a Layout, x: &'a DVector<f64>) -> Model<'a> {
        let lobes = 0..layout.lobes().len();
        let shapes = lobes.map(|lobe| self.grid.samples(layout.log_shape(x, lobe))).collect();
        Model { layout, x, shapes }
    }

    /// The equations of the measurement and of what settles it.
    fn equations(&self, layout: &Layout, x: &DVector<f64>) -> NormalEquations {
        let model = self.model(layout, x);
        let mut equations =
            self.target.equations(layout.unknowns(), |i, rows| self.value(&model, i, rows));
        settle(layout, x, &mut equations);
        equations
    }

    /// f at the pair of index `i`, and its derivative by each unknown.
    fn value(&self, model: &Model<'_>, i: usize, rows: &mut [[f64; 3]]) -> [f64; 3] {
        let Model { layout, x, shapes } = model;
        let basis = fresnel_basis(self.energy, self.target.pairs[i].cos_theta_d);
        let mut f = [0.0; 3];
        // `MeasuredTarget` hands over rows of 0: what is not set here has no derivative.
        for c in 0..3 {
            f[c] = x[c] * FRAC_1_PI;
            rows[c][c] = FRAC_1_PI;
        }
        for (lobe, sample) in shapes.iter().enumerate() {
            let shape = sample.value[i];
            let at = layout.shape(lobe);
            for c in 0..3 {
                // f is linear in the coefficients: each one's derivative is its curve's.
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
}
