//! The unknowns of an SGD fit: their places, their bounds, and the parameters they stand for.

use nalgebra::DVector;

use crate::fit::fresnel_curve::{
    COEFFICIENTS, Energy, coefficient_bounds, free_coefficients, parameters,
};
use crate::fit::sgd_model::{SgdLobe, SgdModel};
use crate::fit::shape::LogShape;
use crate::math::least_squares::Bounds;

/// The range of ln α that is searched: α from 1e-5 to 2.
pub const LOG_ALPHA: [f64; 2] = [-11.5, 0.7];
/// The range of ln p that is searched: p from 0.018 to 2.46.
pub const LOG_P: [f64; 2] = [-4.0, 0.9];

/// The channels that a lobe colours.
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

/// The place of each unknown: ρd of the three channels, then for each lobe ln α, ln p and the
/// coefficients of each channel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    lobes: Vec<Colours>,
}

/// Unknowns of a lobe, with those of channels that it does not colour: their bounds hold them at 0.
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

    /// The place of ln α of a lobe; ln p follows.
    #[must_use]
    pub fn shape(&self, lobe: usize) -> usize {
        3 + LOBE * lobe
    }

    /// The place of the first coefficient of a lobe's channel.
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
    #[must_use]
    pub fn unknowns_of(&self, model: &SgdModel) -> DVector<f64> {
        let mut x = DVector::zeros(self.unknowns());
        (0..3).for_each(|c| x[c] = model.rho_d[c]);
        for (j, lobe) in model.lobes.iter().enumerate() {
            let at = self.shape(j);
            (x[at], x[at + 1]) = (lobe.alpha.ln(), lobe.p.ln());
            for c in 0..3 {
                let coefficients = free_coefficients([lobe.rho_s[c], lobe.f0[c], lobe.f1[c]]);
                x.rows_mut(self.colour(j, c), COEFFICIENTS).copy_from_slice(&coefficients);
            }
        }
        x
    }

    /// The ranges of the unknowns; those of a colour that a lobe does not have are 0.
    #[must_use]
    pub fn bounds(&self, energy: Energy) -> Bounds {
        let mut ranges = vec![[0.0; 2]; self.unknowns()];
        ranges[..3].fill([0.0, 1.0]);
        for (lobe, colours) in self.lobes.iter().enumerate() {
            let shape = self.shape(lobe);
            ranges[shape..shape + 2].copy_from_slice(&[LOG_ALPHA, LOG_P]);
            for c in (0..3).filter(|c| colours.has(*c)) {
                let colour = self.colour(lobe, c);
                ranges[colour..colour + COEFFICIENTS].copy_from_slice(&coefficient_bounds(energy));
            }
        }
        Bounds::of_ranges(&ranges)
    }

    /// The parameters of a solution, sharpest lobe first; lobes without a colour left out.
    #[must_use]
    pub fn model(&self, x: &DVector<f64>, energy: Energy) -> SgdModel {
        let mut lobes: Vec<SgdLobe> =
            (0..self.lobes.len()).map(|j| self.lobe(x, j, energy)).collect();
        lobes.retain(|lobe| lobe.rho_s.iter().any(|rho_s| *rho_s > 0.0));
        // The lobes of the paper's form stay in the order of the channels.
        if !self.lobes.iter().any(|colours| matches!(colours, Colours::Only(_))) {
            lobes.sort_by(|a, b| a.alpha.total_cmp(&b.alpha));
        }
        SgdModel { rho_d: [x[0], x[1], x[2]], lobes }
    }

    /// The parameters of a lobe.
    fn lobe(&self, x: &DVector<f64>, j: usize, energy: Energy) -> SgdLobe {
        let shape = self.log_shape(x, j);
        // Transposed: a lobe has each parameter of three channels side by side.
        let colours = [0, 1, 2].map(|c| parameters(energy, self.coefficients(x, j, c)));
        let [rho_s, f0, f1] = [0, 1, 2].map(|k| colours.map(|colour| colour[k]));
        SgdLobe { alpha: shape.alpha(), p: shape.p(), rho_s, f0, f1 }
    }
}
