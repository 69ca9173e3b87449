//! Rows: the distinct lobes among the materials of a bake, each stored once.

use crate::brdf::{Lobe, MaskingKind, SgdBrdf};
use crate::material::{MAX_LOBES, Material};
use crate::microfacet::{FittedMasking, Fresnel, Sgd, SgdNdf};

/// The rows of a bake's textures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    /// One for each distinct set of lobes: a row of `ndf` and `masking`, three of `albedo`.
    pub lobes: Vec<Row>,
    /// The rows of `fresnel`.
    pub fresnel: Vec<FresnelRow>,
}

/// The visible lobes of a material: texel channel j holds lobe j.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The first material that uses it.
    pub name: String,
    /// The lobes; `None` where none is stored.
    pub lobes: [Option<Lobe<Sgd>>; MAX_LOBES],
    /// The row of `fresnel` that holds each lobe's curves.
    pub fresnel_rows: [usize; MAX_LOBES],
    /// Σρs per colour over all lobes, stored or not: what a decoder multiplies a 3D texel by.
    pub total_rho_s: [f64; 3],
}

/// A row of `fresnel`: a curve per colour.
#[derive(Clone, Debug, PartialEq)]
pub struct FresnelRow {
    /// The first material that uses it.
    pub name: String,
    /// The curve of each colour; `None` where no stored lobe reflects it.
    pub curves: [Option<Fresnel>; 3],
}

/// The place of a material in the textures of a bake.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The material, each lobe with its masking fit.
    pub material: Material,
    /// The row that it uses; `None` where all its lobes are left out.
    pub row: Option<usize>,
    /// The row of `fresnel` of each lobe; empty where all are left out.
    pub fresnel_rows: Vec<usize>,
    /// D(0) of each lobe \[1/sr\], the factor of the `ndf` texels.
    pub ndf_peak: Vec<f64>,
}

impl Placed {
    /// A material placed in a row of `rows`.
    #[must_use]
    pub fn new(material: &Material, row: Option<usize>, rows: &Rows) -> Self {
        let lobes = material.lobes();
        let fresnel_rows = row.map_or(&[][..], |row| &rows.lobes[row].fresnel_rows[..lobes.len()]);
        Self {
            material: with_masking_fits(material),
            row,
            fresnel_rows: fresnel_rows.to_vec(),
            ndf_peak: lobes.iter().map(|lobe| SgdNdf::new(lobe.alpha(), lobe.p()).peak()).collect(),
        }
    }

    /// D(0) for each texel channel; 1 where the material has no lobe.
    #[must_use]
    pub fn ndf_peaks(&self) -> [f64; MAX_LOBES] {
        // A factor that is never used: the texels of such a channel decode to 0.
        std::array::from_fn(|j| self.ndf_peak.get(j).copied().unwrap_or(1.0))
    }
}

/// The material with a masking fit for each lobe, made from the exact masking where none was given.
#[must_use]
pub fn with_masking_fits(material: &Material) -> Material {
    material.clone().map_lobes(|lobe| {
        lobe.with_masking(lobe.masking().unwrap_or_else(|| FittedMasking::of(&lobe).params()))
    })
}

impl Rows {
    /// Adds the row of a material's lobes without those for which `visible` is false, and its rows
    /// of `fresnel`: one where no colour has two stored lobes, else one for each lobe.
    pub fn push(&mut self, name: &str, brdf: &SgdBrdf, visible: [bool; MAX_LOBES]) {
        let lobes: [Option<Lobe<Sgd>>; MAX_LOBES] =
            std::array::from_fn(|j| brdf.lobes.get(j).filter(|_| visible[j]).cloned());
        let first = self.fresnel.len();
        // A lobe that is left out points to the first row: any valid one will do, as its D is 0.
        let mut fresnel_rows = [first; MAX_LOBES];
        let name = name.to_owned();
        // A texel has one number for each colour: two lobes of one colour need a row each.
        if (0..3).all(|c| colouring(&lobes, c).count() <= 1) {
            // A published fit: lobes that colour one channel each fill one row together.
            let curves = [0, 1, 2].map(|c| colouring(&lobes, c).next().map(|lobe| lobe.fresnel[c]));
            self.fresnel.push(FresnelRow { name: name.clone(), curves });
        } else {
            // A refitted lobe has curves in all three colours.
            for (lobe, row) in lobes.iter().zip(&mut fresnel_rows) {
                if let Some(lobe) = lobe {
                    *row = self.fresnel.len();
                    let curves = lobe.fresnel.map(Some);
                    self.fresnel.push(FresnelRow { name: name.clone(), curves });
                }
            }
        }
        let total_rho_s = [0, 1, 2].map(|c| brdf.lobes.iter().map(|lobe| lobe.rho_s[c]).sum());
        self.lobes.push(Row { name, lobes, fresnel_rows, total_rho_s });
    }
}

/// The stored lobes that colour a channel.
fn colouring(lobes: &[Option<Lobe<Sgd>>; MAX_LOBES], c: usize) -> impl Iterator<Item = &Lobe<Sgd>> {
    lobes.iter().flatten().filter(move |lobe| lobe.rho_s[c] > 0.0)
}

impl Row {
    /// The lobes that are stored.
    pub fn visible(&self) -> impl Iterator<Item = &Lobe<Sgd>> {
        self.lobes.iter().flatten()
    }

    /// A number of each stored lobe.
    pub fn each(&self, number: impl Fn(&Lobe<Sgd>) -> f64) -> [Option<f64>; MAX_LOBES] {
        self.lobes.each_ref().map(|lobe| lobe.as_ref().map(&number))
    }

    /// Each stored lobe's share ρs/Σρs of a colour; 0 where no lobe colours it.
    #[must_use]
    pub fn shares(&self, c: usize) -> [f64; MAX_LOBES] {
        let rho_s = self.lobes.each_ref().map(|lobe| lobe.as_ref().map_or(0.0, |l| l.rho_s[c]));
        let total = self.total_rho_s[c];
        if total > 0.0 { rho_s.map(|rho_s| rho_s / total) } else { rho_s }
    }
}

/// The bits that decide whether two materials can share a row: of every number that a texel
/// depends on. Neither name nor diffuse colour is among them, and of ρs only its shares.
#[must_use]
pub fn sharing_key(material: &Material, kind: MaskingKind, visible: [bool; MAX_LOBES]) -> Vec<u64> {
    let totals =
        [0, 1, 2].map(|c| material.lobes().iter().map(|lobe| lobe.rho_s()[c]).sum::<f64>());
    let mut key = Vec::new();
    for (lobe, visible) in material.lobes().iter().zip(visible) {
        if visible {
            // Exact masking follows from α and p; a fit that a file lacks does as well.
            let masking = lobe.masking().filter(|_| kind == MaskingKind::Fitted);
            let fitted = masking.map_or([0.0; 3], |m| [m.lambda, m.c, m.k]);
            let shares =
                [0, 1, 2].map(|c| if totals[c] > 0.0 { lobe.rho_s()[c] / totals[c] } else { 0.0 });
            let numbers = [[lobe.alpha(), lobe.p(), 0.0], lobe.f0(), lobe.f1(), fitted, shares];
            key.extend(numbers.as_flattened().iter().map(|number| number.to_bits()));
        } else {
            // Holds the place of the lobe: channel j of a texel belongs to lobe j.
            key.push(0);
        }
    }
    key
}
