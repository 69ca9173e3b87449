//! The unknowns of a glTF fit: their places, their bounds, and the material that they make.

use nalgebra::DVector;

use crate::brdf::gltf::{DIELECTRIC_F0, GltfBrdf};
use crate::math::least_squares::Bounds;

/// The place of the specular factor.
pub const SPECULAR: usize = 0;
/// The first place of F0, of the three channels.
pub const F0: usize = 1;
/// The first place of the base colour.
pub const BASE: usize = 4;
/// The place of the metallic factor.
pub const METALLIC: usize = 7;
/// The place of the roughness.
pub const ROUGHNESS: usize = 8;
/// The place of the clearcoat factor.
pub const CLEARCOAT: usize = 9;
/// The place of the clearcoat's roughness.
pub const COAT_ROUGHNESS: usize = 10;
/// The number of unknowns.
pub const UNKNOWNS: usize = 11;

/// Roughness that is searched: below it a lobe is a mirror for any picture.
pub const ROUGHNESS_RANGE: [f64; 2] = [0.03, 1.0];

/// The unknowns that a fit may move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Base colour, metallic and roughness.
    Core,
    /// Base colour, roughness, specular factor and colour of a dielectric.
    Specular,
    /// The same under a clear coat.
    Coated,
}

impl Family {
    /// The ranges of the unknowns; one that the family does not move has the range of its value.
    #[must_use]
    pub fn bounds(self) -> Bounds {
        let mut ranges = [[0.0, 1.0]; UNKNOWNS];
        ranges[ROUGHNESS] = ROUGHNESS_RANGE;
        match self {
            Self::Core => {
                // Core properties are a dielectric of index 1.5, blended with a metal.
                ranges[SPECULAR] = [1.0; 2];
                ranges[F0..F0 + 3].fill([DIELECTRIC_F0; 2]);
            }
            // A dielectric with F0 of any colour can be a metal: the factor would be ambiguous.
            Self::Specular | Self::Coated => ranges[METALLIC] = [0.0; 2],
        }
        match self {
            Self::Core | Self::Specular => {
                ranges[CLEARCOAT] = [0.0; 2];
                // Without a coat its roughness has no effect: it is held at any value.
                ranges[COAT_ROUGHNESS] = [ROUGHNESS_RANGE[1]; 2];
            }
            Self::Coated => ranges[COAT_ROUGHNESS] = ROUGHNESS_RANGE,
        }
        Bounds::of_ranges(&ranges)
    }

    /// The family with its roughness held.
    #[must_use]
    pub fn bounds_at(self, roughness: f64) -> Bounds {
        let mut bounds = self.bounds();
        (bounds.lower[ROUGHNESS], bounds.upper[ROUGHNESS]) = (roughness, roughness);
        bounds
    }
}

/// The factors of a solution.
#[must_use]
pub fn gltf_material(x: &DVector<f64>) -> GltfBrdf {
    // A specular term below what 16 bits show is none, and its colour of no consequence.
    let visible = x[SPECULAR] > 1.0 / 65535.0;
    let coated = x[CLEARCOAT] > 0.0;
    GltfBrdf {
        base_color: std::array::from_fn(|c| x[BASE + c]),
        metallic: x[METALLIC],
        roughness: x[ROUGHNESS],
        specular_factor: if visible { x[SPECULAR] } else { 0.0 },
        specular_color: [0, 1, 2].map(|c| if visible { x[F0 + c] / DIELECTRIC_F0 } else { 1.0 }),
        clearcoat: coated.then_some(x[CLEARCOAT]),
        clearcoat_roughness: coated.then_some(x[COAT_ROUGHNESS]),
    }
}

/// The channel whose F0 is the largest, as the place of its unknown.
#[must_use]
pub fn brightest(x: &DVector<f64>) -> usize {
    (F0..F0 + 3).max_by(|a, b| x[*a].total_cmp(&x[*b])).unwrap_or(F0)
}
