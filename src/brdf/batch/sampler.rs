//! Many directions at once for a material, in f32: the directions to the viewer and uniform numbers
//! in; directions to the light, weights and densities out.

use std::f32::consts::FRAC_1_PI;

use crate::brdf::MaskingKind;
use crate::brdf::batch::block::{BLOCK, PerPair, at, load, store};
use crate::brdf::batch::kernel::SharedBlock;
use crate::brdf::batch::masking::{BatchMasking, BatchMaskings, SingleG1Polynomial};
use crate::brdf::batch::pairs::{LengthMismatch, Pairs, same_length};
use crate::brdf::batch::sgd_batch::{Baseline, SgdBatch};
use crate::brdf::batch::shares::{BELOW_ONE, Choices, DIFFUSE, Shares};
use crate::brdf::batch::squared_slopes::SquaredSlopes;
use crate::material::{MAX_LOBES, Material};
use crate::math::arithmetic::{Arithmetic, Separate, ln_1p, max, min, sin_cos_turns};
use crate::math::instruction_set::{InstructionSet, per_instruction_set};
use crate::microfacet::{Accuracy, Sgd, VisibleNormals};

/// What directions are drawn from: a unit direction to the viewer and three uniform numbers in
/// [0, 1) for each, one slice per component.
///
/// # Example
///
/// ```
/// use sgdbake::brdf::batch::Draws;
///
/// // One draw, towards a viewer above the surface.
/// let draws = Draws { wo: [&[0.0], &[0.0], &[1.0]], u: [&[0.1], &[0.5], &[0.7]] };
/// assert_eq!(draws.wo[2].len(), draws.u[0].len());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Draws<'a> {
    /// Directions to the viewer.
    pub wo: [&'a [f32]; 3],
    /// Uniform numbers.
    pub u: [&'a [f32]; 3],
}

/// Where drawn directions go, one slice per component.
///
/// # Example
///
/// See [`SamplerBatch`].
#[derive(Debug)]
pub struct SamplesMut<'a> {
    /// Unit directions to the light.
    pub wi: [&'a mut [f32]; 3],
    /// f·cosθi/pdf per colour.
    pub weight: [&'a mut [f32]; 3],
    /// Densities \[1/sr\].
    pub pdf: &'a mut [f32],
}

/// Draws directions for a material by its visible normals, many at once.
///
/// # Formula
///
/// That of [`Sampler`](crate::brdf::Sampler), pdf(wi) = q_d cosθi/π + Σ_j q_j D_j(h) G1_j(wo)/(4 cosθo),
/// in f32: densities are within 2e-5 of its, weights within 4e-5 of themselves or of 0.01.
///
/// # Example
///
/// ```
/// use sgdbake::brdf::batch::{Draws, SamplesMut};
/// use sgdbake::{MaskingKind, SamplerBatch, named};
///
/// let sampler = SamplerBatch::new(named("gold-paint")?, MaskingKind::Exact);
/// // Two directions for a viewer above the surface, one for a viewer at 53°.
/// let (x, y, z) = ([0.0, 0.0, 0.8], [0.0; 3], [1.0, 1.0, 0.6]);
/// let (u, v, w) = ([0.1, 0.4, 0.8], [0.5, 0.2, 0.9], [0.7, 0.3, 0.6]);
/// let [mut wi, mut weight] = [[[0.0_f32; 3]; 3]; 2];
/// let mut pdf = [0.0_f32; 3];
/// let draws = Draws { wo: [&x, &y, &z], u: [&u, &v, &w] };
/// let mut samples = SamplesMut {
///     wi: wi.each_mut().map(|axis| &mut axis[..]),
///     weight: weight.each_mut().map(|colour| &mut colour[..]),
///     pdf: &mut pdf,
/// };
/// sampler.sample(&draws, &mut samples)?;
/// assert!(pdf[0] > 0.0 && wi[2][0] > 0.0 && weight[0][0] > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SamplerBatch {
    batch: SgdBatch,
    /// G1 of the lobes' own distributions.
    drawn_g1: BatchMaskings,
    squared_slopes: SquaredSlopes,
    normals: Vec<VisibleNormals>,
    shares: Shares,
}

impl SamplerBatch {
    /// The sampler of a material on the widest instructions of this machine; `kind` is the masking
    /// of f. Normals are drawn by the exact one.
    #[must_use]
    pub fn new(material: &Material, kind: MaskingKind) -> Self {
        let lobes = material.lobes().iter();
        let sgd: Vec<Sgd> =
            lobes.map(|lobe| Sgd::new(lobe.alpha(), lobe.p(), Accuracy::Table)).collect();
        let normals: Vec<VisibleNormals> =
            sgd.iter().map(|sgd| VisibleNormals::new(sgd.mixture())).collect();
        Self {
            batch: SgdBatch::new(material, kind),
            drawn_g1: BatchMaskings::exact(&sgd),
            squared_slopes: SquaredSlopes::new(&normals),
            normals,
            shares: Shares::new(material),
        }
    }

    /// The same on another instruction set; on the widest where this machine lacks it.
    #[must_use]
    pub fn with_instruction_set(mut self, set: InstructionSet) -> Self {
        self.batch = self.batch.with_instruction_set(set);
        self
    }

    /// The instruction set in use.
    #[must_use]
    pub fn instruction_set(&self) -> InstructionSet {
        self.batch.instruction_set()
    }

    /// A direction to the light for each direction to the viewer, with its weights f·cosθi/pdf and its
    /// density; weights and density are 0, and the direction means nothing, where the draw fell
    /// below the horizon or the viewer is there.
    ///
    /// # Errors
    ///
    /// The slices differ in length; nothing is written.
    pub fn sample(
        &self,
        draws: &Draws<'_>,
        out: &mut SamplesMut<'_>,
    ) -> Result<(), LengthMismatch> {
        let inputs = draws.wo.iter().chain(&draws.u).map(|slice| slice.len());
        let outputs = out.wi.iter().chain(&out.weight).map(|slice| slice.len());
        same_length(inputs.chain(outputs).chain([out.pdf.len()]))?;
        dispatch::sample(self.batch.set, self, draws, out);
        Ok(())
    }

    /// The density \[1/sr\] with which [`Self::sample`] draws the wi of each pair; 0 below the horizon.
    ///
    /// # Errors
    ///
    /// The slices differ in length; nothing is written.
    pub fn pdf(&self, pairs: &Pairs<'_>, pdf: &mut [f32]) -> Result<(), LengthMismatch> {
        let inputs = pairs.wi.iter().chain(&pairs.wo).map(|slice| slice.len());
        same_length(inputs.chain([pdf.len()]))?;
        dispatch::pdf(self.batch.set, self, pairs, pdf);
        Ok(())
    }

    /// [`Self::sample`] in straight loops.
    #[inline(always)]
    pub(super) fn sample_with<A: Arithmetic>(&self, draws: &Draws<'_>, out: &mut SamplesMut<'_>) {
        let length = out.pdf.len();
        let mut blocks = Blocks::empty();
        for start in (0..length).step_by(BLOCK) {
            let count = BLOCK.min(length - start);
            load(&mut blocks.wo, draws.wo, start, count);
            load(&mut blocks.u, draws.u, start, count);
            blocks.u.iter_mut().for_each(clamp);
            self.prepare::<A>(&mut blocks);
            self.shares.choose(&blocks.u[0], &blocks.shares, &blocks.g1, &mut blocks.choices);
            self.draw::<A>(&mut blocks);
            self.draw_beyond(&mut blocks, count);
            self.weigh::<A>(&mut blocks);
            blocks.divide();
            store(&mut out.wi, &blocks.wi, start, count);
            store(&mut out.weight, &blocks.values, start, count);
            out.pdf[start..start + count].copy_from_slice(&blocks.pdf[..count]);
        }
    }

    /// [`Self::pdf`] in straight loops.
    #[inline(always)]
    pub(super) fn pdf_with<A: Arithmetic>(&self, pairs: &Pairs<'_>, pdf: &mut [f32]) {
        let mut blocks = Blocks::empty();
        for start in (0..pdf.len()).step_by(BLOCK) {
            let count = BLOCK.min(pdf.len() - start);
            load(&mut blocks.wo, pairs.wo, start, count);
            load(&mut blocks.wi, pairs.wi, start, count);
            self.prepare::<A>(&mut blocks);
            // That place costs nothing, and no masking looks at it.
            blocks.share::<A, SingleG1Polynomial>();
            self.fill_density::<A>(&mut blocks);
            pdf[start..start + count].copy_from_slice(&blocks.pdf[..count]);
        }
    }

    /// G1(wo) of the normals that are drawn, and the shares of the techniques.
    #[inline(always)]
    fn prepare<A: Arithmetic>(&self, blocks: &mut Blocks) {
        let Blocks { wo, g1, shares, .. } = blocks;
        match &self.drawn_g1 {
            BatchMaskings::Exact(m) => fill_g1::<A, _>(m, wo, g1),
            BatchMaskings::Tabulated(m) => fill_g1::<A, _>(m, wo, g1),
            // Normals are drawn from the distribution itself.
            BatchMaskings::Fitted(_) => {}
        }
        self.shares.fill(&wo[2], shares);
    }

    /// A direction by the technique of each draw.
    #[inline(always)]
    fn draw<A: Arithmetic>(&self, blocks: &mut Blocks) {
        let Blocks { wo, u, choices, wi, .. } = blocks;
        for i in 0..BLOCK {
            let technique = choices.technique[i];
            let wo = at(wo, i);
            let (u, v) = (u[1][i], u[2][i]);
            let (sin, cos) = sin_cos_turns::<A>(v);

            // Not −0, whose bits are those of a number below all others.
            let e = max(-ln_1p::<A>(-u), 0.0);
            let length = self.squared_slopes.at(technique, e).sqrt();
            let (along, across) = (length * cos, length * sin);
            let sin_o = A::mul_add(wo[0], wo[0], wo[1] * wo[1]).sqrt();
            // With the probability t |x|: the place in G1 is a uniform number.
            let mirrored = choices.place[i] * wo[2] < -along * sin_o * choices.g1[i];
            let along = if mirrored { -along } else { along };
            let reflected = reflect::<A>(wo, sin_o, along, across);

            let radius = u.sqrt();
            let diffuse = [radius * cos, radius * sin, (1.0 - u).sqrt()];
            wi[0][i] = if technique == DIFFUSE { diffuse[0] } else { reflected[0] };
            wi[1][i] = if technique == DIFFUSE { diffuse[1] } else { reflected[1] };
            wi[2][i] = if technique == DIFFUSE { diffuse[2] } else { reflected[2] };
        }
    }

    /// The draws that the mirrored slopes do not cover, one after another: a twentieth over the
    /// hemisphere.
    fn draw_beyond(&self, blocks: &mut Blocks, count: usize) {
        let Blocks { wo, u, choices, wi, .. } = blocks;
        for i in (0..count).filter(|i| choices.place[*i] >= choices.g1[*i]) {
            let Some(normals) = self.normals.get(choices.technique[i] as usize) else { continue };
            let wo = at(wo, i);
            let sin_o = wo[0].hypot(wo[1]);
            let cot = f64::from(wo[2] / sin_o);
            let g1 = normals.g1(cot);
            let place = (f64::from(choices.place[i]) - g1) / (1.0 - g1);
            let [u, v] = [u[1][i], u[2][i]].map(f64::from);
            let numbers = [place.clamp(0.0, BELOW_ONE.into()), u, v];
            let slope = normals.beyond(cot, g1.recip() - 1.0, numbers).as_vec2();
            let reflected = reflect::<Separate>(wo, sin_o, slope.x, slope.y);
            for (wi, reflected) in wi.iter_mut().zip(reflected) {
                wi[i] = reflected;
            }
        }
    }

    /// f and the density of wi.
    #[inline(always)]
    fn weigh<A: Arithmetic>(&self, blocks: &mut Blocks) {
        match &self.batch.maskings {
            BatchMaskings::Exact(m) => self.weigh_by::<A, _>(m, blocks),
            BatchMaskings::Tabulated(m) => self.weigh_by::<A, _>(m, blocks),
            BatchMaskings::Fitted(m) => self.weigh_by::<A, _>(m, blocks),
        }
    }

    #[inline(always)]
    fn weigh_by<A: Arithmetic, M: BatchMasking>(&self, maskings: &[M], blocks: &mut Blocks) {
        blocks.share::<A, M>();
        self.fill_density::<A>(blocks);
        let Blocks { shared, shapes, values, .. } = blocks;
        // An array of its own: the vectoriser must see that it shares no memory with a lobe's.
        let mut visibilities = [0.0; BLOCK];
        for (masking, shape) in maskings.iter().zip(&mut *shapes) {
            masking.visibilities::<A>(&shared.masking_i, &shared.masking_o, &mut visibilities);
            for (shape, visibility) in shape.iter_mut().zip(&visibilities) {
                *shape *= visibility;
            }
        }
        self.batch.constants.colour::<A>(shared, shapes, values.each_mut());
    }

    /// q_d cosθi/π + Σ q D G1(wo)/(4 cosθo); leaves D of each lobe in `shapes`.
    #[inline(always)]
    fn fill_density<A: Arithmetic>(&self, blocks: &mut Blocks) {
        let Blocks { wi: [_, _, iz], wo: [_, _, oz], shared, shapes, pdf, shares, g1, .. } = blocks;
        let [shares @ .., diffuse] = shares;
        for i in 0..BLOCK {
            pdf[i] = diffuse[i] * iz[i] * FRAC_1_PI;
        }
        let (mut ndf, drawn) = ([0.0; BLOCK], shares.iter().zip(g1));
        for ((lobe, (share, g1)), shape) in self.batch.constants.lobes.iter().zip(drawn).zip(shapes)
        {
            let lobe = *lobe;
            for (i, ndf) in ndf.iter_mut().enumerate() {
                *ndf = lobe.ndf::<A>(shared.normal(i));
            }
            for i in 0..BLOCK {
                pdf[i] += 0.25 * share[i] * (g1[i] / oz[i]) * ndf[i];
            }
            *shape = ndf;
        }
        shared.clear_hidden(pdf);
    }
}

/// A block of draws on its way.
struct Blocks {
    wo: [PerPair; 3],
    u: [PerPair; 3],
    /// q of the lobes and of diffuse.
    shares: [PerPair; MAX_LOBES + 1],
    /// G1(wo) of each lobe's normals.
    g1: [PerPair; MAX_LOBES],
    choices: Choices,
    wi: [PerPair; 3],
    shared: SharedBlock,
    /// D of each lobe, then D (G1(wi)/cosθi) (G1(wo)/cosθo).
    shapes: [PerPair; MAX_LOBES],
    values: [PerPair; 3],
    pdf: PerPair,
}

impl Blocks {
    #[inline(always)]
    fn empty() -> Self {
        let empty = [0.0; BLOCK];
        Self {
            wo: [empty; 3],
            u: [empty; 3],
            shares: [empty; MAX_LOBES + 1],
            g1: [empty; MAX_LOBES],
            choices: Choices::empty(),
            wi: [empty; 3],
            shared: SharedBlock::empty(),
            shapes: [empty; MAX_LOBES],
            values: [empty; 3],
            pdf: empty,
        }
    }

    /// What the lobes share of each pair.
    #[inline(always)]
    fn share<A: Arithmetic, M: BatchMasking>(&mut self) {
        self.shared.fill::<A, M>(self.wi.each_ref(), self.wo.each_ref());
    }

    /// f to f·cosθi/pdf.
    #[inline(always)]
    fn divide(&mut self) {
        for values in &mut self.values {
            for (i, value) in values.iter_mut().enumerate() {
                let weight = *value * (self.wi[2][i] / self.pdf[i]);
                *value = if self.pdf[i] > 0.0 { weight } else { 0.0 };
            }
        }
    }
}

/// Into [0, 1): a number in f64 may have been rounded to 1.
#[inline(always)]
fn clamp(numbers: &mut PerPair) {
    for u in numbers {
        *u = max(min(*u, BELOW_ONE), 0.0);
    }
}

/// wo at the normal of slope (`along`, `across`), the first towards wo.
#[inline(always)]
fn reflect<A: Arithmetic>(wo: [f32; 3], sin_o: f32, along: f32, across: f32) -> [f32; 3] {
    let inverse = 1.0 / max(sin_o, f32::MIN_POSITIVE);
    let towards = if sin_o > 0.0 { [wo[0] * inverse, wo[1] * inverse] } else { [1.0, 0.0] };
    let x = along * towards[0] - across * towards[1];
    let y = along * towards[1] + across * towards[0];
    let length2 = A::mul_add(x, x, A::mul_add(y, y, 1.0));
    let twice = 2.0 * A::mul_add(x, wo[0], A::mul_add(y, wo[1], wo[2])) / length2;
    [A::mul_add(twice, x, -wo[0]), A::mul_add(twice, y, -wo[1]), twice - wo[2]]
}

/// G1(wo) of each lobe.
#[inline(always)]
fn fill_g1<A: Arithmetic, M: BatchMasking>(
    maskings: &[M],
    wo: &[PerPair; 3],
    g1: &mut [PerPair; MAX_LOBES],
) {
    // An array of its own: the vectoriser must see that it shares no memory with the maskings.
    let mut of_lobe = [0.0; BLOCK];
    for (masking, g1) in maskings.iter().zip(g1) {
        for (i, g1) in of_lobe.iter_mut().enumerate() {
            *g1 = masking.g1::<A>(M::place::<A>(at(wo, i)));
        }
        *g1 = of_lobe;
    }
}

/// The kernels once per instruction set.
mod dispatch {
    use super::*;

    per_instruction_set!(sample<A: crate::math::arithmetic::Fused, baseline Baseline>
    (sampler: &SamplerBatch, draws: &Draws<'_>, out: &mut SamplesMut<'_>) -> () {
        sampler.sample_with::<A>(draws, out);
    });
    per_instruction_set!(pdf<A: crate::math::arithmetic::Fused, baseline Baseline>
    (sampler: &SamplerBatch, pairs: &Pairs<'_>, pdf: &mut [f32]) -> () {
        sampler.pdf_with::<A>(pairs, pdf);
    });
}
