//! Materials as a bake knows them: their exact values at probes, and the lobes that show.

use crate::brdf::{MaskingKind, SgdBrdf};
use crate::lut::error::LeftOut;
use crate::lut::probe::{Probe, probes};
use crate::material::{MAX_LOBES, Material};
use crate::microfacet::Accuracy;

/// A material with its exact values at the probes.
pub(super) struct Sampled<'a> {
    pub material: &'a Material,
    pub brdf: SgdBrdf,
    pub probes: Vec<Probe>,
    pub visible: [bool; MAX_LOBES],
}

impl<'a> Sampled<'a> {
    /// Evaluates a material at its probes. A lobe is visible if leaving it out would err by more
    /// than its part of `invisible` anywhere.
    pub fn new(material: &'a Material, kind: MaskingKind, invisible: f64) -> Self {
        let brdf = SgdBrdf::with_accuracy(material, kind, Accuracy::Table).tabulated();
        let probes = probes(&brdf, 0);
        // Shared among the lobes of a colour: all of them together may be left out.
        let parts = [0, 1, 2].map(|c| {
            let colouring = brdf.lobes.iter().filter(|lobe| lobe.rho_s[c] > 0.0).count();
            invisible / colouring.max(1) as f64
        });
        let visible = std::array::from_fn(|j| {
            j < brdf.lobes.len() && probes.iter().any(|probe| shows(probe, j, parts))
        });
        Self { material, brdf, probes, visible }
    }

    /// The reasons why the invisible lobes of a material are not stored.
    pub fn left_out(&self, invisible: f64) -> impl Iterator<Item = LeftOut> {
        let lobes = self.material.lobes().iter().enumerate();
        lobes.filter(|(j, _)| !self.visible[*j]).map(move |(j, lobe)| LeftOut {
            material: self.material.name.clone(),
            lobe: j,
            reason: format!(
                "rho_s {:e}: without this lobe f errs by less than {invisible:e}",
                lobe.rho_s().into_iter().fold(0.0, f64::max)
            ),
        })
    }
}

/// Returns whether f at a probe would err by more than its parts without lobe `j`.
fn shows(probe: &Probe, j: usize, parts: [f64; 3]) -> bool {
    let specular = probe.lobes[j].specular();
    (0..3).any(|c| probe.colours[c].error_of(specular[c].abs()) > parts[c])
}
