//! Rows: the distinct lobes among the materials of a bake, each stored once.

use crate::brdf::ChannelBrdf;
use crate::material::{ChannelParams, Material};
use crate::microfacet::masking::MaskingKind;
use crate::microfacet::{BeckmannMixture, FittedMasking, SgdNdf, SmithMasking};

/// Relative accuracy of the masking that is baked: below what a float texel can hold.
pub(crate) const MASKING_ACCURACY: f64 = 1e-8;

/// One texture row: a material's visible lobes.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The first material that uses it.
    pub name: String,
    /// Evaluators in the order r, g, b; `None` where no lobe is stored.
    pub lobes: [Option<ChannelBrdf>; 3],
}

/// Where a material of a bake ended up.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// Its name.
    pub name: String,
    /// Its parameters, the masking fit always among them.
    pub channels: [ChannelParams; 3],
    /// The row that it uses; `None` where all its lobes are left out.
    pub row: Option<usize>,
    /// D(0) per channel \[1/sr\], the factor of the `ndf` texels.
    pub ndf_peak: [f64; 3],
}

impl Placed {
    /// A material placed in a row.
    #[must_use]
    pub fn new(material: &Material, row: Option<usize>) -> Self {
        let peak = |params: &ChannelParams| SgdNdf::new(params.alpha, params.p).peak();
        Self {
            name: material.name.clone(),
            channels: material.channels.map(with_masking_fit),
            row,
            ndf_peak: material.channels.each_ref().map(peak),
        }
    }
}

/// The parameters with the masking fit, made from the exact masking where none was given.
fn with_masking_fit(params: ChannelParams) -> ChannelParams {
    let fitted = || {
        let mixture = BeckmannMixture::new(params.alpha, params.p, MASKING_ACCURACY);
        FittedMasking::fit(&SmithMasking::new(&mixture)).params()
    };
    ChannelParams { masking: Some(params.masking.unwrap_or_else(fitted)), ..params }
}

impl Row {
    /// The row of a material's `channels`, without those for which `visible` is false.
    #[must_use]
    pub fn new(name: &str, channels: &[ChannelBrdf; 3], visible: [bool; 3]) -> Self {
        let lobe = |c: usize| visible[c].then(|| channels[c].clone());
        Self { name: name.to_owned(), lobes: std::array::from_fn(lobe) }
    }

    /// The lobes that are stored.
    pub fn visible(&self) -> impl Iterator<Item = &ChannelBrdf> {
        self.lobes.iter().flatten()
    }
}

/// What decides whether two materials can share a row: the bits of every number that a texel
/// depends on. Neither name nor albedo is among them.
#[must_use]
pub fn sharing_key(material: &Material, kind: MaskingKind, visible: [bool; 3]) -> Vec<u64> {
    let channel = |params: &ChannelParams| {
        let masking = params.masking.filter(|_| kind == MaskingKind::Fitted);
        let fitted = masking.map_or([0.0; 3], |m| [m.lambda, m.c, m.k]);
        let shape = [params.alpha, params.p, params.f0, params.f1];
        shape.into_iter().chain(fitted).map(f64::to_bits)
    };
    let stored =
        material.channels.iter().zip(visible).map(|(params, visible)| visible.then_some(params));
    stored.flat_map(|params| params.map_or_else(|| vec![0], |p| channel(p).collect())).collect()
}
