//! The shape of an SGD lobe, D G1 G1/(π cosθi cosθo), at the pairs of a target, for many α and p.

use std::f64::consts::FRAC_1_PI;

use crate::brdf::Lobe;
use crate::fit::measured_target::MeasuredTarget;
use crate::microfacet::Accuracy;
use crate::microfacet::{BeckmannMixture, Distribution as _, Fresnel, Sgd, SgdNdf};

/// α and p of a distribution, by their logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogShape {
    /// ln α.
    pub alpha: f64,
    /// ln p.
    pub p: f64,
}

/// A lobe's shape at every pair, and its derivatives.
#[derive(Clone, Debug)]
pub struct ShapeSamples {
    /// D G1 G1/(π cosθi cosθo).
    pub value: Vec<f64>,
    /// The derivative by ln α.
    pub by_alpha: Vec<f64>,
    /// The derivative by ln p.
    pub by_p: Vec<f64>,
}

/// A pair's half vector, and the places of its two directions on the masking's grid.
struct Place {
    tan2_theta_h: f64,
    inverse_cosines: f64,
    cot: [GridPlace; 2],
}

/// The grid point before, and the weights of the four around.
#[derive(Clone, Copy)]
struct GridPlace {
    first: usize,
    weights: [f64; 4],
}

/// The pairs of a target as a shape sees them. G1 is evaluated on a grid of ln cotθ and
/// interpolated by cubics: within 1e-5.
pub struct ShapeGrid {
    places: Vec<Place>,
}

/// ln cotθ of the grid's first point, its step, and its length: from below that of any pair,
/// whose cosθ is above 1e-3, to 0.6° from the normal, where even the widest lobe masks nothing.
const GRID_START: f64 = -7.8;
const GRID_STEP: f64 = 0.1;
const GRID: usize = 126;

/// Relative accuracy of G1 on the grid.
const ACCURACY: f64 = 1e-7;
/// Step of the derivatives by ln α and ln p.
const STEP: f64 = 1e-3;

impl LogShape {
    /// α.
    #[must_use]
    pub fn alpha(self) -> f64 {
        self.alpha.exp()
    }

    /// p.
    #[must_use]
    pub fn p(self) -> f64 {
        self.p.exp()
    }

    /// The distribution of normals.
    #[must_use]
    pub fn ndf(self) -> SgdNdf {
        SgdNdf::new(self.alpha(), self.p())
    }

    /// ln D(0).
    #[must_use]
    pub fn log_peak(self) -> f64 {
        self.ndf().peak().ln()
    }

    /// The exact masking.
    #[must_use]
    pub fn masking(self) -> BeckmannMixture {
        BeckmannMixture::new(self.alpha(), self.p(), ACCURACY)
    }

    /// A lobe of the shape without a colour, its masking from a table.
    #[must_use]
    pub fn lobe(self) -> Lobe<Sgd> {
        // The albedo's quadrature asks for G1 so often that a table pays.
        let distribution = Sgd::new(self.alpha(), self.p(), Accuracy::Picture).tabulated();
        Lobe { distribution, fitted: None, rho_s: [0.0; 3], fresnel: [Fresnel::sgd(0.0, 0.0); 3] }
    }

    /// A step up in ln α, and one in ln p.
    #[must_use]
    pub fn steps(self) -> [Self; 2] {
        [Self { alpha: self.alpha + STEP, ..self }, Self { p: self.p + STEP, ..self }]
    }

    /// The derivatives by ln α and ln p of a number that depends on the shape.
    pub fn slopes(self, at: f64, number: impl Fn(Self) -> f64) -> [f64; 2] {
        self.steps().map(|moved| (number(moved) - at) / STEP)
    }
}

impl GridPlace {
    fn of(cot_theta: f64) -> Self {
        // A cubic needs one point before and two after. The normal, cotθ = ∞, is put where G1 = 1.
        let at = ((cot_theta.ln() - GRID_START) / GRID_STEP).clamp(1.0, (GRID - 3) as f64);
        let first = at as usize - 1;
        let t = at - at.floor();
        // Lagrange's cubics through −1, 0, 1, 2.
        let weights = [
            -t * (t - 1.0) * (t - 2.0) / 6.0,
            (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
            -(t + 1.0) * t * (t - 2.0) / 2.0,
            (t + 1.0) * t * (t - 1.0) / 6.0,
        ];
        Self { first, weights }
    }

    fn interpolate(self, grid: &[f64; GRID]) -> f64 {
        (0..4).map(|k| self.weights[k] * grid[self.first + k]).sum()
    }
}

impl ShapeGrid {
    /// The grid of a target's pairs.
    #[must_use]
    pub fn new(target: &MeasuredTarget) -> Self {
        let places = target.pairs.iter().map(|pair| Place {
            tan2_theta_h: pair.tan2_theta_h,
            inverse_cosines: FRAC_1_PI / (pair.cos_theta[0] * pair.cos_theta[1]),
            cot: pair.cot_theta.map(GridPlace::of),
        });
        Self { places: places.collect() }
    }

    /// D G1 G1/(π cosθi cosθo) at every pair.
    #[must_use]
    pub fn values(&self, shape: LogShape) -> Vec<f64> {
        let (ndf, masking) = (shape.ndf(), shape.masking());
        // G1 depends on θ alone, and costs more than all the rest: the grid has far fewer points
        // than there are directions.
        let grid: [f64; GRID] =
            std::array::from_fn(|k| masking.g1((GRID_START + GRID_STEP * k as f64).exp()));
        let places = self.places.iter();
        places
            .map(|place| {
                let g = place.cot[0].interpolate(&grid) * place.cot[1].interpolate(&grid);
                ndf.ndf(place.tan2_theta_h) * g * place.inverse_cosines
            })
            .collect()
    }

    /// The same with its derivatives.
    #[must_use]
    pub fn samples(&self, shape: LogShape) -> ShapeSamples {
        let value = self.values(shape);
        // One-sided: a central difference would cost another evaluation each.
        let [by_alpha, by_p] = shape.steps().map(|moved| {
            let moved = self.values(moved);
            moved.iter().zip(&value).map(|(moved, at)| (moved - at) / STEP).collect()
        });
        ShapeSamples { value, by_alpha, by_p }
    }
}
