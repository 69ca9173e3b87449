//! Many directions at once for a material, in f32: the directions to the viewer and uniform numbers
//! in; directions to the light, weights and densities out.

use std::f64::consts::FRAC_1_PI;

use crate::brdf::MaskingKind;
use crate::brdf::batch::constants::Constants;
use crate::brdf::batch::kernel::{BLOCK, Lanes, SharedBlock};
use crate::brdf::batch::masking::{BatchMasking, BatchMaskings};
use crate::brdf::batch::{LengthMismatch, Pairs, RgbMut, SgdBatch, dispatch, same_length};
use crate::brdf::sampler::MIN_FRESNEL;
use crate::material::{MAX_LOBES, Material};
use crate::math::arithmetic::{Arithmetic, Separate, ln_1p, max, min, sin_cos_turns};
use crate::math::chebyshev::{interpolation, nodes};
use crate::math::instruction_set::InstructionSet;
use crate::microfacet::{Accuracy, Sgd, VisibleNormals};

/// What directions are drawn from: a direction to the viewer and three uniform numbers in [0, 1) for
/// each, one slice per component.
#[derive(Clone, Copy, Debug)]
pub struct Draws<'a> {
    /// Directions to the viewer.
    pub wo: [&'a [f32]; 3],
    /// Uniform numbers.
    pub u: [&'a [f32]; 3],
}

/// Where drawn directions go, one slice per component.
#[derive(Debug)]
pub struct SamplesMut<'a> {
    /// Directions to the light.
    pub wi: [&'a mut [f32]; 3],
    /// f·cosθi/pdf per colour.
    pub weight: [&'a mut [f32]; 3],
    /// Densities \[1/sr\].
    pub pdf: &'a mut [f32],
}

/// Draws directions for a material by its visible normals, many at once: the formulas of
/// [`Sampler`](crate::brdf::Sampler), whose densities it has within 1e-5.
#[derive(Clone, Debug)]
pub struct SamplerBatch {
    batch: SgdBatch,
    /// G1 of the lobes' own distributions.
    drawn_g1: BatchMaskings,
    squared_slopes: SquaredSlopes,
    normals: Vec<VisibleNormals>,
    shares: Shares,
}

impl SamplerBatch {
    /// The sampler of a material on the widest instructions of this machine.
    #[must_use]
    pub fn new(material: &Material, kind: MaskingKind) -> Self {
        let lobes = material.lobes().iter();
        let sgd: Vec<Sgd> =
            lobes.map(|lobe| Sgd::new(lobe.alpha(), lobe.p(), Accuracy::Picture)).collect();
        let normals: Vec<_> = sgd.iter().map(|sgd| VisibleNormals::new(sgd.mixture())).collect();
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

    /// A direction to the light for each direction to the viewer, with its weights f·cosθi/pdf and its
    /// density; weights and density are 0 where the draw fell below the horizon.
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

    /// f \[1/sr\] of every pair and the density \[1/sr\] with which [`Self::sample`] draws its wi.
    ///
    /// # Errors
    ///
    /// The slices differ in length; nothing is written.
    pub fn eval(
        &self,
        pairs: &Pairs<'_>,
        f: &mut RgbMut<'_>,
        pdf: &mut [f32],
    ) -> Result<(), LengthMismatch> {
        let inputs = pairs.wi.iter().chain(&pairs.wo).map(|slice| slice.len());
        same_length(inputs.chain(f.0.iter().map(|slice| slice.len())).chain([pdf.len()]))?;
        dispatch::weigh(self.batch.set, self, pairs, f, pdf);
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
            for numbers in &mut blocks.u {
                clamp(numbers);
            }
            self.prepare::<A>(&mut blocks);
            self.shares.choose(&mut blocks);
            self.draw::<A>(&mut blocks);
            self.draw_beyond(&mut blocks, count);
            self.weigh::<A>(&mut blocks);
            blocks.divide();
            store(&mut out.wi, &blocks.wi, start, count);
            store(&mut out.weight, &blocks.values, start, count);
            out.pdf[start..start + count].copy_from_slice(&blocks.pdf[..count]);
        }
    }

    /// [`Self::eval`] in straight loops.
    #[inline(always)]
    pub(super) fn eval_with<A: Arithmetic>(
        &self,
        pairs: &Pairs<'_>,
        f: &mut RgbMut<'_>,
        pdf: &mut [f32],
    ) {
        let mut blocks = Blocks::empty();
        for start in (0..pdf.len()).step_by(BLOCK) {
            let count = BLOCK.min(pdf.len() - start);
            load(&mut blocks.wo, pairs.wo, start, count);
            load(&mut blocks.wi, pairs.wi, start, count);
            self.prepare::<A>(&mut blocks);
            self.weigh::<A>(&mut blocks);
            store(&mut f.0, &blocks.values, start, count);
            pdf[start..start + count].copy_from_slice(&blocks.pdf[..count]);
        }
    }

    /// G1(wo) of the normals that are drawn, and the shares of the techniques.
    #[inline(always)]
    fn prepare<A: Arithmetic>(&self, blocks: &mut Blocks) {
        match &self.drawn_g1 {
            BatchMaskings::Exact(m) => drawn_g1::<A, _>(m, blocks),
            BatchMaskings::Tabulated(m) => drawn_g1::<A, _>(m, blocks),
            // Normals are drawn from the distribution itself.
            BatchMaskings::Fitted(_) => {}
        }
        self.shares.fill(blocks);
    }

    /// A direction by the technique of each draw.
    #[inline(always)]
    fn draw<A: Arithmetic>(&self, blocks: &mut Blocks) {
        for i in 0..BLOCK {
            let lobe = blocks.technique[i];
            let wo = at(&blocks.wo, i);
            let g1 = blocks.g1_chosen[i];
            let (u, v) = (blocks.u[1][i], blocks.u[2][i]);
            let (sin, cos) = sin_cos_turns::<A>(v);

            // Not −0, whose bits are those of a number below all others.
            let e = max(-ln_1p::<A>(-u), 0.0);
            let length = self.squared_slopes.at(lobe, e).sqrt();
            let (along, across) = (length * cos, length * sin);
            let sin_o = A::mul_add(wo[0], wo[0], wo[1] * wo[1]).sqrt();
            let mirrored = blocks.choice[i] * wo[2] < -along * sin_o * g1;
            let along = if mirrored { -along } else { along };
            let reflected = reflect::<A>(wo, sin_o, along, across);

            let radius = u.sqrt();
            let diffuse = [radius * cos, radius * sin, (1.0 - u).sqrt()];
            blocks.wi[0][i] = if lobe == DIFFUSE { diffuse[0] } else { reflected[0] };
            blocks.wi[1][i] = if lobe == DIFFUSE { diffuse[1] } else { reflected[1] };
            blocks.wi[2][i] = if lobe == DIFFUSE { diffuse[2] } else { reflected[2] };
        }
    }

    /// The draws that the mirrored slopes do not cover, one after another: a twentieth over the
    /// hemisphere.
    fn draw_beyond(&self, blocks: &mut Blocks, count: usize) {
        for i in 0..count {
            let (lobe, choice) = (blocks.technique[i] as usize, f64::from(blocks.choice[i]));
            if blocks.choice[i] < blocks.g1_chosen[i] {
                continue;
            }
            let Some(normals) = self.normals.get(lobe) else { continue };
            let wo = at(&blocks.wo, i);
            let sin_o = wo[0].hypot(wo[1]);
            let cot = f64::from(wo[2] / sin_o);
            let g1 = normals.g1(cot);
            let place = ((choice - g1) / (1.0 - g1)).clamp(0.0, 1.0 - f64::EPSILON);
            let [u, v] = [blocks.u[1][i], blocks.u[2][i]].map(f64::from);
            let slope = normals.beyond(cot, g1.recip() - 1.0, [place, u, v]).as_vec2();
            let wi = reflect::<Separate>(wo, sin_o, slope.x, slope.y);
            for axis in 0..3 {
                blocks.wi[axis][i] = wi[axis];
            }
        }
    }

    /// f and the density of wi.
    #[inline(always)]
    fn weigh<A: Arithmetic>(&self, blocks: &mut Blocks) {
        let constants = &self.batch.constants;
        match &self.batch.maskings {
            BatchMaskings::Exact(m) => weigh::<A, _>(constants, m, blocks),
            BatchMaskings::Tabulated(m) => weigh::<A, _>(constants, m, blocks),
            BatchMaskings::Fitted(m) => weigh::<A, _>(constants, m, blocks),
        }
    }
}

/// The technique that is no lobe.
const DIFFUSE: u32 = MAX_LOBES as u32;

/// A block of draws on its way.
struct Blocks {
    wo: [Lanes; 3],
    u: [Lanes; 3],
    /// q of the lobes and of diffuse.
    shares: [Lanes; MAX_LOBES + 1],
    /// G1(wo) of each lobe's normals.
    g1: [Lanes; MAX_LOBES],
    /// The technique of each draw, and where in its share the draw fell, in [0, 1).
    technique: [u32; BLOCK],
    choice: Lanes,
    /// G1(wo) of the chosen lobe; 1 for diffuse.
    g1_chosen: Lanes,
    wi: [Lanes; 3],
    shared: SharedBlock,
    shapes: [Lanes; MAX_LOBES],
    values: [Lanes; 3],
    pdf: Lanes,
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
            technique: [0; BLOCK],
            choice: empty,
            g1_chosen: empty,
            wi: [empty; 3],
            shared: SharedBlock::empty(),
            shapes: [empty; MAX_LOBES],
            values: [empty; 3],
            pdf: empty,
        }
    }

    /// f to f·cosθi/pdf.
    #[inline(always)]
    fn divide(&mut self) {
        for values in &mut self.values {
            for i in 0..BLOCK {
                let weight = values[i] * (self.wi[2][i] / self.pdf[i]);
                values[i] = if self.pdf[i] > 0.0 { weight } else { 0.0 };
            }
        }
    }
}

#[inline(always)]
fn load<const N: usize>(lanes: &mut [Lanes; N], from: [&[f32]; N], start: usize, count: usize) {
    for (lanes, from) in lanes.iter_mut().zip(from) {
        if count < BLOCK {
            *lanes = [0.0; BLOCK];
        }
        lanes[..count].copy_from_slice(&from[start..start + count]);
    }
}

#[inline(always)]
fn store<const N: usize>(to: &mut [&mut [f32]; N], lanes: &[Lanes; N], start: usize, count: usize) {
    for (to, lanes) in to.iter_mut().zip(lanes) {
        to[start..start + count].copy_from_slice(&lanes[..count]);
    }
}

/// Not a closure over the axes: those stay calls, and a loop with a call is no vector loop.
#[inline(always)]
fn at([x, y, z]: &[Lanes; 3], i: usize) -> [f32; 3] {
    [x[i], y[i], z[i]]
}

/// Into [0, 1): a number in f64 may have been rounded to 1.
#[inline(always)]
fn clamp(numbers: &mut Lanes) {
    for u in numbers {
        *u = max(min(*u, 1.0 - f32::EPSILON / 2.0), 0.0);
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

#[inline(always)]
fn drawn_g1<A: Arithmetic, M: BatchMasking>(maskings: &[M], blocks: &mut Blocks) {
    for (masking, g1) in maskings.iter().zip(&mut blocks.g1) {
        for i in 0..BLOCK {
            g1[i] = masking.g1::<A>(M::place::<A>(at(&blocks.wo, i)));
        }
    }
}

#[inline(always)]
fn weigh<A: Arithmetic, M: BatchMasking>(
    constants: &Constants,
    maskings: &[M],
    blocks: &mut Blocks,
) {
    let Blocks { wi, wo, shared, shapes, values, pdf, shares, g1, .. } = blocks;
    // Arrays of their own: the vectoriser must see that they share no memory with a lobe's.
    let [mut ndf, mut factor] = [[0.0; BLOCK]; 2];
    let ([ix, iy, iz], [ox, oy, oz]) = (&*wi, &*wo);
    shared.fill::<A, M>([ix, iy, iz], [ox, oy, oz]);
    let [of_lobes @ .., diffuse] = &*shares;
    for i in 0..BLOCK {
        pdf[i] = diffuse[i] * iz[i] * std::f32::consts::FRAC_1_PI;
    }
    let of_lobes = of_lobes.iter().zip(&*g1).zip(&mut *shapes);
    for ((lobe, masking), ((share, g1), shape)) in
        constants.lobes.iter().zip(maskings).zip(of_lobes)
    {
        masking.visibilities::<A>(&shared.masking_i, &shared.masking_o, shape);
        for i in 0..BLOCK {
            factor[i] = 0.25 * share[i] * (g1[i] / oz[i]);
        }
        let lobe = *lobe;
        for (i, ndf) in ndf.iter_mut().enumerate() {
            *ndf = lobe.ndf::<A>(shared.normal(i));
        }
        for i in 0..BLOCK {
            shape[i] *= ndf[i];
            pdf[i] += factor[i] * ndf[i];
        }
    }
    constants.colour::<A>(shared, shapes, values);
    for values in values {
        shared.clear_hidden(values);
    }
    shared.clear_hidden(pdf);
}

/// What the shares of the techniques depend on.
#[derive(Clone, Debug)]
struct Shares {
    lobes: Vec<[ShareOfColour; 3]>,
    diffuse: f32,
    /// The last technique that is ever chosen.
    last: u32,
}

/// 4ρs/π and the Fresnel curve of a colour, as (f0 − f1) + (1 − f0) ε⁵ + f1 ε.
#[derive(Clone, Copy, Debug)]
struct ShareOfColour {
    scale: f32,
    normal: f32,
    schlick: f32,
    f1: f32,
}

impl ShareOfColour {
    /// 4ρs/π (|F| + a little) at ε = 1 − cosθo.
    #[inline(always)]
    fn share(&self, e: f32, e5: f32) -> f32 {
        let fresnel = self.normal + self.schlick * e5 + self.f1 * e;
        self.scale * (fresnel.abs() + MIN_FRESNEL as f32)
    }
}

impl Shares {
    fn new(material: &Material) -> Self {
        let lobes: Vec<_> = material
            .lobes()
            .iter()
            .map(|lobe| {
                let colour = |c: usize| ShareOfColour {
                    scale: (4.0 * FRAC_1_PI * lobe.rho_s()[c]) as f32,
                    normal: (lobe.f0()[c] - lobe.f1()[c]) as f32,
                    schlick: (1.0 - lobe.f0()[c]) as f32,
                    f1: lobe.f1()[c] as f32,
                };
                [0, 1, 2].map(colour)
            })
            .collect();
        let diffuse = material.rho_d().iter().sum::<f64>() as f32;
        let coloured = |lobe: &[ShareOfColour; 3]| lobe.iter().any(|colour| colour.scale > 0.0);
        match lobes.iter().rposition(coloured) {
            Some(last) if diffuse == 0.0 => Self { lobes, diffuse, last: last as u32 },
            None if diffuse == 0.0 => Self { lobes, diffuse: 1.0, last: DIFFUSE },
            _ => Self { lobes, diffuse, last: DIFFUSE },
        }
    }

    /// q(wo) of the lobes and of diffuse.
    #[inline(always)]
    fn fill(&self, blocks: &mut Blocks) {
        blocks.shares[MAX_LOBES] = [self.diffuse; BLOCK];
        for (lobe, shares) in self.lobes.iter().zip(&mut blocks.shares) {
            for i in 0..BLOCK {
                let e = max(1.0 - blocks.wo[2][i], 0.0);
                let (e2, [r, g, b]) = (e * e, lobe);
                let e5 = e2 * e2 * e;
                shares[i] = r.share(e, e5) + g.share(e, e5) + b.share(e, e5);
            }
        }
        let [a, b, c, d] = &mut blocks.shares;
        for i in 0..BLOCK {
            let inverse = 1.0 / (a[i] + b[i] + c[i] + d[i]);
            a[i] *= inverse;
            b[i] *= inverse;
            c[i] *= inverse;
            d[i] *= inverse;
        }
    }

    /// The technique that the first uniform number falls to, and where in its share.
    #[inline(always)]
    fn choose(&self, blocks: &mut Blocks) {
        let (last, [a, b, c, d], [g1_a, g1_b, g1_c]) = (self.last, &blocks.shares, &blocks.g1);
        for i in 0..BLOCK {
            let u = blocks.u[0][i];
            let (to_a, to_b, to_c) = (a[i], a[i] + b[i], a[i] + b[i] + c[i]);
            let chosen = u32::from(u >= to_a) + u32::from(u >= to_b) + u32::from(u >= to_c);
            let chosen = chosen.min(last);
            let start = of(chosen, [0.0, to_a, to_b, to_c]);
            let share = of(chosen, [a[i], b[i], c[i], d[i]]);
            blocks.technique[i] = chosen;
            blocks.choice[i] = min((u - start) / share, 1.0 - f32::EPSILON / 2.0);
            blocks.g1_chosen[i] = of(chosen, [g1_a[i], g1_b[i], g1_c[i], 1.0]);
        }
    }
}

/// The value of the chosen technique, by selects.
#[inline(always)]
fn of(chosen: u32, [a, b, c, d]: [f32; MAX_LOBES + 1]) -> f32 {
    let low = if chosen == 0 { a } else { b };
    let high = if chosen == 2 { c } else { d };
    if chosen < 2 { low } else { high }
}

/// Pieces of a lobe's table.
const PIECES: usize = 256;

/// The squared length x of a slope against e = −ln of the share of longer slopes, for each lobe: x/e as
/// piecewise cubics, eight an octave of e.
#[derive(Clone, Debug)]
struct SquaredSlopes(Box<[[f32; 4]; (MAX_LOBES + 1) * PIECES]>);

impl SquaredSlopes {
    /// log₂ of the pieces per octave.
    const FINENESS: u32 = 3;
    /// log₂ of the least e with a piece of its own: half of what a uniform f32 tells from 0.
    const LOWEST: i32 = -25;
    const SHIFT: u32 = 23 - Self::FINENESS;

    fn new(normals: &[VisibleNormals]) -> Self {
        let fit = interpolation::<4>();
        let mut table = Box::new([[0.0; 4]; (MAX_LOBES + 1) * PIECES]);
        for (normals, pieces) in normals.iter().zip(table.chunks_exact_mut(PIECES)) {
            for (index, piece) in pieces.iter_mut().enumerate() {
                let octave = Self::LOWEST + (index >> Self::FINENESS) as i32;
                let width = f64::from(octave - Self::FINENESS as i32).exp2();
                let place = (index & ((1 << Self::FINENESS) - 1)) as f64;
                let start = f64::from(octave).exp2() + place * width;
                let values = nodes::<4>().map(|v| {
                    // Beyond the last share that a uniform number has.
                    let e = (start + 0.5 * width * (v + 1.0)).min(36.0);
                    normals.squared_slope(e) / e
                });
                *piece = (fit * nalgebra::SVector::from(values)).map(|c| c as f32).into();
            }
        }
        Self(table)
    }

    /// x of lobe `lobe`; 0 for diffuse.
    #[inline(always)]
    fn at(&self, lobe: u32, e: f32) -> f32 {
        let first = ((127 + Self::LOWEST) as u32) << 23;
        let offset = (e.to_bits().cast_signed() - first.cast_signed()).max(0).cast_unsigned();
        let piece = (offset >> Self::SHIFT).min(PIECES as u32 - 1);
        let index = (lobe.min(DIFFUSE) * PIECES as u32 + piece) as usize;
        let [c0, c1, c2, c3] = self.0[index];
        let within = (offset & ((1 << Self::SHIFT) - 1)).cast_signed() as f32;
        let v = 2.0 * (within * f32::from_bits((127 - Self::SHIFT) << 23)) - 1.0;
        e * (c0 + v * (c1 + v * (c2 + v * c3)))
    }
}
