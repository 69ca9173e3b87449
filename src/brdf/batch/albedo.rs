//! The moments of [`FresnelMoments`] in f32, for tables of them.

use std::f64::consts::PI;
use std::sync::LazyLock;

use crate::brdf::Lobe;
use crate::brdf::albedo::{FresnelMoments, View, azimuths};
use crate::math::arithmetic::{Arithmetic, Fused, exp_m1, exp2, max, min, sum_in_pairs};
use crate::math::direction::cot_of_cos;
use crate::math::instruction_set::{InstructionSet, per_instruction_set};
use crate::math::quadrature::gauss_legendre;
use crate::microfacet::{G1Polynomial, Sgd, grazing_limit};

/// Rings of half vectors that are lit as a whole.
const LIT_RINGS: usize = 16;
/// Rings of half vectors that the horizon cuts.
const CUT_RINGS: usize = 32;
/// Half vectors of a ring.
const AZIMUTH_NODES: usize = 16;
/// Half vectors of an integral, at most: where no ring is cut there are fewer.
pub const NODES: usize = (LIT_RINGS + CUT_RINGS) * AZIMUTH_NODES;

/// x/α beyond which e^{−x/α} is below 1e-6.
const LARGEST_DECAY: f64 = 14.0;
/// Coefficients of the masking's polynomial.
const ORDER: usize = 12;

type Azimuth = [f32; AZIMUTH_NODES];

/// The moments of one lobe by the rule of [`FresnelMoments`] with fewer nodes: at most [`NODES`]
/// half vectors. Within 4e-5 of the moments, which are at most 1, for the published materials.
///
/// The bits are those of every instruction set: all fuse their products and sums, in software where
/// the machine cannot.
#[derive(Clone, Debug)]
pub struct AlbedoBatch {
    set: InstructionSet,
    alpha: f64,
    p: f32,
    /// α² D(0) π/(nodes of a ring).
    scale: f64,
    lobe: Lobe<Sgd>,
    g1: SingleG1,
}

impl AlbedoBatch {
    /// The moments of a lobe on the widest instructions of this machine.
    #[must_use]
    pub fn new(lobe: &Lobe<Sgd>) -> Self {
        let sgd = &lobe.distribution;
        let alpha = sgd.alpha();
        Self {
            set: InstructionSet::widest(),
            alpha,
            p: sgd.p() as f32,
            scale: alpha * alpha * sgd.peak() * PI / AZIMUTH_NODES as f64,
            lobe: lobe.clone(),
            g1: SingleG1::new(lobe),
        }
    }

    /// The same on another instruction set; on the widest where this machine lacks it.
    #[must_use]
    pub fn with_instruction_set(mut self, set: InstructionSet) -> Self {
        self.set = set.or_widest();
        self
    }

    /// The moments at each cosθo in (0, 1]; 0 at and below the horizon.
    #[must_use]
    pub fn moments(&self, cos_theta_o: &[f64]) -> Vec<FresnelMoments> {
        cos_theta_o.iter().map(|cos| dispatch::moments(self.set, self, *cos)).collect()
    }

    #[inline(always)]
    pub(super) fn at<A: Arithmetic>(&self, cos_theta_o: f64) -> FresnelMoments {
        if cos_theta_o.is_nan() || cos_theta_o < f64::MIN_POSITIVE {
            return FresnelMoments::default();
        }
        let view = View::new(&self.lobe, cos_theta_o.min(1.0));
        let [whole, none] = view.radial_ends(self.alpha, LARGEST_DECAY);
        let Rule { lit, cut, .. } = &*RULE;
        let lit = self.part::<A, false, _>(lit, &view, 0.0, whole);
        // At normal incidence, or where D has decayed before the horizon, no ring is cut.
        let none_cut = [0.0; 3];
        let cut =
            if whole < none { self.part::<A, true, _>(cut, &view, whole, none) } else { none_cut };
        let [one, schlick, cosine] =
            std::array::from_fn(|k| self.scale * view.v * f64::from(lit[k] + cut[k]));
        FresnelMoments { one, schlick, cosine }
    }

    /// The integral over the rings from v = `low` to `high`, all lit as a whole or all `CUT` by the
    /// horizon.
    #[inline(always)]
    fn part<A: Arithmetic, const CUT: bool, const N: usize>(
        &self,
        radial: &Radial<N>,
        view: &View,
        low: f64,
        high: f64,
    ) -> [f32; 3] {
        let rings = Rings::new::<A, CUT>(self, radial, view, low as f32, (high - low) as f32);
        let mut sums = [[0.0; AZIMUTH_NODES]; 3];
        for k in 0..N {
            let cos_o = view.cos as f32;
            // The lowest wi of the ring is where nothing masks any more, so all of it is.
            if rings.base[k] >= self.g1.end {
                rings.add::<A>(k, cos_o, |_, _| 1.0, &mut sums);
                continue;
            }
            let lit = rings.lit[k];
            rings.add::<A>(k, cos_o, |cos, psi| self.g1.lit::<A, CUT>(cos, psi, lit), &mut sums);
        }
        sums.map(sum_in_pairs)
    }
}

/// Places and weights of rings over [0, 1].
struct Radial<const N: usize> {
    x: [f32; N],
    weights: [f32; N],
}

impl<const N: usize> Radial<N> {
    fn new() -> Self {
        let rule = gauss_legendre(N);
        let x = std::array::from_fn(|k| rule[k].x as f32);
        Self { x, weights: std::array::from_fn(|k| rule[k].weight as f32) }
    }
}

/// The nodes and weights that all lobes share.
struct Rule {
    lit: Radial<LIT_RINGS>,
    cut: Radial<CUT_RINGS>,
    cos2_psi: Azimuth,
}

static RULE: LazyLock<Rule> = LazyLock::new(|| {
    let azimuths = azimuths(AZIMUTH_NODES);
    let cos2_psi = std::array::from_fn(|m| azimuths[m] as f32);
    Rule { lit: Radial::new(), cut: Radial::new(), cos2_psi }
});

/// What the half vectors of a ring share, ring by ring: cosθi = base + swing cos²ψ.
struct Rings<const N: usize> {
    base: [f32; N],
    swing: [f32; N],
    /// P22 dx (1 + a²)/2, without D(0) α².
    weight: [f32; N],
    /// ½ √(1 + a²).
    half_length: [f32; N],
    /// The lit share of the diameter.
    lit: [f32; N],
}

impl<const N: usize> Rings<N> {
    #[inline(always)]
    fn new<A: Arithmetic, const CUT: bool>(
        lobe: &AlbedoBatch,
        radial: &Radial<N>,
        view: &View,
        low: f32,
        span: f32,
    ) -> Self {
        const LOG2_E: f32 = std::f32::consts::LOG2_E;
        let (alpha, cos_o, sin_o) = (lobe.alpha as f32, view.cos as f32, view.sin as f32);
        let empty = [0.0; N];
        let mut rings =
            Self { base: empty, swing: empty, weight: empty, half_length: empty, lit: empty };
        for k in 0..N {
            let v = A::mul_add(span, radial.x[k], low);
            // x/α² = eᵛ − 1, relatively exact at both ends.
            let ratio = exp2::<A>(LOG2_E * v) * -exp_m1::<A>(-v);
            // P22 dx in one exponential: (1 + x/α²)^−p is e^{−pv}, and dx = α² eᵛ dv.
            let decay = A::mul_add(1.0 - lobe.p, v, -(alpha * ratio));
            let x = alpha * alpha * ratio;
            let length2 = 1.0 + x;
            let inv_length2 = 1.0 / length2;
            // cosθi (1 + a²) of the ring lies between `lowest` and `lowest` + 2 `radius`.
            let radius = 2.0 * x.sqrt() * sin_o;
            let lowest = A::mul_add(cos_o, 1.0 - x, -radius);
            let highest = max(lowest + 2.0 * radius, 0.0);
            rings.base[k] = if CUT { 0.0 } else { max(lowest, 0.0) * inv_length2 };
            rings.swing[k] = (if CUT { highest } else { 2.0 * radius }) * inv_length2;
            // At normal incidence 0/0, which `min` turns into 1.
            rings.lit[k] = if CUT { min(highest / (2.0 * radius), 1.0) } else { 1.0 };
            // ½ √(1 + a²) of cosθd and √(1 + a²) of dωh are here; `add` has the sum of cosines.
            rings.weight[k] =
                span * radial.weights[k] * exp2::<A>(LOG2_E * decay) * (0.5 * length2);
            rings.half_length[k] = 0.5 * length2.sqrt();
        }
        rings
    }

    /// Adds ring `k` to the lanes of the three moments; `visible` is G1(wi) and what of the circle
    /// a node stands for, at cosθi and cos²ψ.
    #[inline(always)]
    fn add<A: Arithmetic>(
        &self,
        k: usize,
        cos_o: f32,
        visible: impl Fn(f32, f32) -> f32,
        sums: &mut [Azimuth; 3],
    ) {
        for (m, cos2_psi) in RULE.cos2_psi.iter().enumerate() {
            let cos_i = A::mul_add(self.swing[k], *cos2_psi, self.base[k]);
            let cosines = cos_i + cos_o;
            let one = self.weight[k] * cosines * visible(cos_i, *cos2_psi);
            let cos_d = self.half_length[k] * cosines;
            let e = 1.0 - cos_d;
            let e2 = e * e;
            sums[0][m] += one;
            sums[1][m] = A::mul_add(one * e, e2 * e2, sums[1][m]);
            sums[2][m] = A::mul_add(one, cos_d, sums[2][m]);
        }
    }
}

/// G1 of a lobe in f32: [`G1Polynomial`] up to where masking ends, 1 beyond.
///
/// With s five times lim cosθ/G1 at grazing, a Beckmann lobe's G1 has most of its rise in the
/// middle of u's range; twelve coefficients leave an absolute 1e-5 for every published lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SingleG1 {
    /// s.
    scale: f32,
    /// cosθ from which G1 is as good as 1, or 1.
    end: f32,
    /// The factor that takes u into [0, 2].
    stretch: f32,
    /// Coefficients over [−1, 1].
    coefficients: [f32; ORDER],
}

impl SingleG1 {
    fn new(lobe: &Lobe<Sgd>) -> Self {
        /// 1 to the rounding of f32.
        const UNMASKED: f64 = 1.0 - 1e-7;
        const STEP: f64 = 0.95;
        let scale = 5.0 * grazing_limit(|cot| lobe.g1(cot));
        // The shorter the range, the more of the nodes lie where G1 rises.
        let mut end = 1.0;
        while end > 0.2 * scale && lobe.g1(cot_of_cos(STEP * end)) > UNMASKED {
            end *= STEP;
        }
        let polynomial = G1Polynomial::new::<ORDER>(|cot| lobe.g1(cot), scale, end, 0.0);
        Self {
            scale: scale as f32,
            end: end as f32,
            stretch: polynomial.stretch as f32,
            coefficients: polynomial.single(),
        }
    }

    #[inline(always)]
    fn eval<A: Arithmetic>(&self, cos: f32) -> f32 {
        let c = min(cos, self.end);
        self.at_u::<A>(c / (c + self.scale))
    }

    /// G1, times the visible share √(above/(1 − lit + above)), above = lit·cos²ψ, of a ring that
    /// the horizon cuts.
    #[inline(always)]
    fn lit<A: Arithmetic, const CUT: bool>(&self, cos: f32, cos2_psi: f32, lit: f32) -> f32 {
        if !CUT {
            return self.eval::<A>(cos);
        }
        let above = lit * cos2_psi;
        // The lit share of dφ, as in `View::ring`.
        let (g1, share) = self.eval_beside::<A>(cos, above, (1.0 - lit) + above);
        g1 * share.sqrt()
    }

    /// G1, and a/b by the same division.
    #[inline(always)]
    fn eval_beside<A: Arithmetic>(&self, cos: f32, a: f32, b: f32) -> (f32, f32) {
        let c = min(cos, self.end);
        let sum = c + self.scale;
        let inverse = 1.0 / (sum * b);
        (self.at_u::<A>(c * b * inverse), a * sum * inverse)
    }

    #[inline(always)]
    fn at_u<A: Arithmetic>(&self, u: f32) -> f32 {
        let t = A::mul_add(u, self.stretch, -1.0);
        let mut sum = self.coefficients[ORDER - 1];
        for k in (0..ORDER - 1).rev() {
            sum = A::mul_add(sum, t, self.coefficients[k]);
        }
        u * sum
    }
}

/// The moments once per instruction set, each with the same bits.
mod dispatch {
    use super::*;

    per_instruction_set!(moments<A: Fused, baseline Fused>
        (lobe: &AlbedoBatch, cos_theta_o: f64) -> FresnelMoments { lobe.at::<A>(cos_theta_o) });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::MaskingKind;
    use crate::material::{LobeFields, LobeParams, catalog};
    use crate::microfacet::Accuracy;

    const VIEWS: [f64; 9] = [1.0, 0.98, 0.7, 0.3, 0.1, 0.0175, 1e-3, 1e-5, 1e-6];

    fn lobes(step: usize) -> impl Iterator<Item = Lobe<Sgd>> {
        let kinds = [MaskingKind::Exact, MaskingKind::Fitted];
        let params = catalog().iter().step_by(step).flat_map(|entry| entry.material.lobes());
        params.flat_map(move |lobe| kinds.map(|kind| Lobe::new(lobe, kind, Accuracy::Table)))
    }

    #[test]
    fn every_published_lobe_is_within_the_stated_error() {
        let mut worst: f64 = 0.0;
        for lobe in lobes(1).map(Lobe::tabulated) {
            let quick = AlbedoBatch::new(&lobe).moments(&VIEWS);
            for (cos, quick) in VIEWS.into_iter().zip(quick) {
                let exact = FresnelMoments::new(&lobe, cos);
                let errors = [
                    quick.one - exact.one,
                    quick.schlick - exact.schlick,
                    quick.cosine - exact.cosine,
                ];
                worst = errors.into_iter().fold(worst, |worst, error| worst.max(error.abs()));
                assert!(errors.iter().all(|error| error.abs() < 4e-5), "{cos} {errors:?}");
            }
        }
        println!("largest error of a moment: {worst:.2e}");
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        for lobe in lobes(30) {
            let batch = AlbedoBatch::new(&lobe);
            let baseline =
                batch.clone().with_instruction_set(InstructionSet::Baseline).moments(&VIEWS);
            for set in InstructionSet::available() {
                assert!(batch.clone().with_instruction_set(set).moments(&VIEWS) == baseline);
            }
        }
    }

    #[test]
    fn hard_shapes_stay_finite_and_the_horizon_is_dark() {
        for (alpha, p) in [(1e-8, 4.0), (50.0, 0.1), (0.3, 0.0), (1e-4, 1.8)] {
            let fields =
                LobeFields { alpha, p, masking: None, rho_s: [1.0; 3], f0: [1.0; 3], f1: [0.0; 3] };
            let params = LobeParams::new(fields).expect("in range");
            let batch = AlbedoBatch::new(&Lobe::new(&params, MaskingKind::Exact, Accuracy::Table));
            for moments in batch.moments(&VIEWS) {
                assert!((0.0..=1.0 + 1e-4).contains(&moments.one), "{alpha} {p} {moments:?}");
            }
            let dark = batch.moments(&[0.0, -1.0, f64::NAN]);
            assert!(dark.iter().all(|moments| *moments == FresnelMoments::default()));
        }
    }
}
