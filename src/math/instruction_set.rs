//! The vector instructions of a machine, and functions compiled once for each set of them.

/// A set of vector instructions that the loops are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum InstructionSet {
    /// The set of every machine of the architecture: SSE2 on x86-64, NEON on 64-bit Arm.
    Baseline,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 F, VL, BW and DQ.
    Avx512,
}

impl InstructionSet {
    /// Every set, widest last.
    pub const ALL: [Self; 3] = [Self::Baseline, Self::Avx2, Self::Avx512];

    /// The usual name; of the baseline, that of its vector instructions.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline if cfg!(target_arch = "x86_64") => "SSE2",
            Self::Baseline if cfg!(target_arch = "aarch64") => "NEON",
            Self::Baseline => "baseline",
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        }
    }

    /// Returns whether this machine has it.
    #[must_use]
    pub fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq")
            }
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// The sets of this machine, widest last.
    pub fn available() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|set| set.is_available())
    }

    /// This set, or the widest where this machine lacks it.
    #[must_use]
    pub fn or_widest(self) -> Self {
        if self.is_available() { self } else { Self::widest() }
    }

    /// The widest set of this machine.
    #[must_use]
    pub fn widest() -> Self {
        Self::available().last().unwrap_or(Self::Baseline)
    }
}

/// A function per instruction set and one, `name(set, …)`, that calls the right one. The body is
/// compiled for each; where it names an arithmetic, with one for the sets that fuse products and
/// sums and another for the baseline.
///
/// The only unsafe code of the crate: calling a function compiled for instructions that a machine
/// might lack. Whoever passes an [`InstructionSet`] has it from [`InstructionSet::widest`] or
/// [`InstructionSet::or_widest`].
macro_rules! per_instruction_set {
    ($name:ident $(<$arithmetic:ident: $wide:ty, baseline $baseline:ty>)?
     ($($argument:ident: $type:ty),* $(,)?) -> $output:ty $body:block) => {
        #[allow(unsafe_code)]
        pub fn $name(
            set: $crate::math::instruction_set::InstructionSet,
            $($argument: $type),*
        ) -> $output {
            // Only what is inlined into the body is compiled for the set. Hence the
            // `#[inline(always)]` of everything that a body calls.
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,avx2,fma")]
            fn avx512($($argument: $type),*) -> $output {
                $(type $arithmetic = $wide;)?
                $body
            }

            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma")]
            fn avx2($($argument: $type),*) -> $output {
                $(type $arithmetic = $wide;)?
                $body
            }

            fn baseline($($argument: $type),*) -> $output {
                $(type $arithmetic = $baseline;)?
                $body
            }

            #[cfg(target_arch = "x86_64")]
            use $crate::math::instruction_set::InstructionSet;
            match set {
                // SAFETY: sets are only held where this machine was found to have them.
                #[cfg(target_arch = "x86_64")]
                InstructionSet::Avx512 => unsafe { avx512($($argument),*) },
                // SAFETY: as above.
                #[cfg(target_arch = "x86_64")]
                InstructionSet::Avx2 => unsafe { avx2($($argument),*) },
                _ => baseline($($argument),*),
            }
        }
    };
}

pub(crate) use per_instruction_set;
