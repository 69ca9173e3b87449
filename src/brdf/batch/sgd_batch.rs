//! A material in f32: its constants, its masking, and the kernels on every instruction set.

use glam::Vec3;

use crate::brdf::batch::constants::Constants;
use crate::brdf::batch::kernel;
use crate::brdf::batch::masking::{BatchMaskings, FittedG1};
use crate::brdf::batch::pairs::{LengthMismatch, Pairs, RgbMut, same_length};
use crate::brdf::{LobeCurves, MaskingKind, Terms};
use crate::material::Material;
use crate::math::arithmetic::Fused;
use crate::math::instruction_set::{InstructionSet, per_instruction_set};
use crate::microfacet::{Accuracy, FittedMasking, Sgd};

/// A material's reflectance in f32.
///
/// The absolute error against f64 is at most 1e-5·|f| + 1e-6·(largest f of the same wo) for the
/// published materials. Parameters beyond the range of f32 saturate; nothing becomes NaN or
/// infinite.
///
/// # Example
///
/// ```
/// use sgdbake::brdf::batch::{Pairs, RgbMut};
/// use sgdbake::{MaskingKind, SgdBatch, named};
///
/// let batch = SgdBatch::new(named("gold-paint")?, MaskingKind::Exact);
/// // Two pairs, facing the surface and at 53°.
/// let (x, y, z) = ([0.0, 0.8], [0.0; 2], [1.0, 0.6]);
/// let mut rgb = [[0.0_f32; 2]; 3];
/// let [r, g, b] = &mut rgb;
/// let pairs = Pairs { wi: [&x, &y, &z], wo: [&x, &y, &z] };
/// batch.eval(&pairs, &mut RgbMut([r, g, b]))?;
/// assert!(rgb[0][0] > rgb[0][1] && rgb[0][1] > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SgdBatch {
    pub(super) set: InstructionSet,
    pub(super) constants: Constants,
    pub(super) maskings: BatchMaskings,
}

impl SgdBatch {
    /// The evaluator of a material on the widest instructions of this machine.
    #[must_use]
    pub fn new(material: &Material, kind: MaskingKind) -> Self {
        let lobes = material.lobes().iter();
        let maskings = match kind {
            MaskingKind::Exact => {
                let sgd = lobes.map(|lobe| Sgd::new(lobe.alpha(), lobe.p(), Accuracy::Table));
                BatchMaskings::exact(&sgd.collect::<Vec<_>>())
            }
            MaskingKind::Fitted => BatchMaskings::Fitted(
                lobes.map(|lobe| FittedG1::new(&FittedMasking::of(lobe))).collect(),
            ),
        };
        Self { set: InstructionSet::widest(), constants: Constants::new(material), maskings }
    }

    /// The same on another instruction set; on the widest where this machine lacks it.
    #[must_use]
    pub fn with_instruction_set(mut self, set: InstructionSet) -> Self {
        self.set = set.or_widest();
        self
    }

    /// The instruction set in use.
    #[must_use]
    pub fn instruction_set(&self) -> InstructionSet {
        self.set
    }

    /// f(wi, wo) \[1/sr\] of every pair; 0 at and below the horizon and for vectors that are not of unit length.
    ///
    /// # Errors
    ///
    /// The slices differ in length; nothing is written.
    pub fn eval(&self, pairs: &Pairs<'_>, out: &mut RgbMut<'_>) -> Result<(), LengthMismatch> {
        let inputs = pairs.wi.iter().chain(&pairs.wo).map(|slice| slice.len());
        // All lengths are compared before the first value is written.
        same_length(inputs.chain(out.0.iter().map(|slice| slice.len())))?;
        dispatch::eval(self.set, self, pairs, out);
        Ok(())
    }

    /// Every factor of f for one pair, with the bits of [`Self::eval`].
    #[must_use]
    pub fn terms(&self, wi: Vec3, wo: Vec3) -> Terms {
        dispatch::pair(self.set, self, wi, wo)
    }

    /// The factors of each lobe against one angle θ with the given cosine and sine ≥ 0; Λ = 1/G1 − 1 in f32.
    #[must_use]
    pub fn curves(&self, cos_theta: f32, sin_theta: f32) -> Vec<LobeCurves> {
        dispatch::curves(self.set, self, cos_theta, sin_theta)
    }
}

/// 64-bit Arm fuses products and sums in its baseline; x86-64 does not.
#[cfg(target_arch = "aarch64")]
pub(super) type Baseline = Fused;
#[cfg(not(target_arch = "aarch64"))]
pub(super) type Baseline = crate::math::arithmetic::Separate;

/// The kernels once per instruction set.
mod dispatch {
    use super::*;

    per_instruction_set!(eval<A: Fused, baseline Baseline>
    (batch: &SgdBatch, pairs: &Pairs<'_>, out: &mut RgbMut<'_>) -> () {
        match &batch.maskings {
            BatchMaskings::Exact(m) => kernel::eval::<A, _>(&batch.constants, m, pairs, out),
            BatchMaskings::Tabulated(m) => kernel::eval::<A, _>(&batch.constants, m, pairs, out),
            BatchMaskings::Fitted(m) => kernel::eval::<A, _>(&batch.constants, m, pairs, out),
        }
    });
    per_instruction_set!(pair<A: Fused, baseline Baseline>
    (batch: &SgdBatch, wi: Vec3, wo: Vec3) -> Terms {
        match &batch.maskings {
            BatchMaskings::Exact(m) => kernel::pair::<A, _>(&batch.constants, m, wi, wo),
            BatchMaskings::Tabulated(m) => kernel::pair::<A, _>(&batch.constants, m, wi, wo),
            BatchMaskings::Fitted(m) => kernel::pair::<A, _>(&batch.constants, m, wi, wo),
        }
    });
    per_instruction_set!(curves<A: Fused, baseline Baseline>
    (batch: &SgdBatch, cos: f32, sin: f32) -> Vec<LobeCurves> {
        match &batch.maskings {
            BatchMaskings::Exact(m) => kernel::curves::<A, _>(&batch.constants, m, cos, sin),
            BatchMaskings::Tabulated(m) => kernel::curves::<A, _>(&batch.constants, m, cos, sin),
            BatchMaskings::Fitted(m) => kernel::curves::<A, _>(&batch.constants, m, cos, sin),
        }
    });
}
