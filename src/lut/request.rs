//! The request for a bake: quantities, masking, size or tolerance, number format.

use crate::brdf::MaskingKind;
use crate::lut::error::BakeError;
use crate::lut::quantity::Quantity;
use crate::lut::range::{TOLERANCES, WIDTHS};
use crate::lut::table::Depth;

/// The request for a bake.
///
/// # Example
///
/// ```
/// use sgdbake::{Depths, Extent, MaskingKind, Quantity, Request};
///
/// let request = Request {
///     quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
///     masking: MaskingKind::Exact,
///     extent: Extent::Size(32),
///     depths: Depths::Smallest,
/// };
/// assert!(request.wants(Quantity::Ndf) && !request.wants(Quantity::Albedo));
/// assert!(request.check().is_ok());
/// assert!(Request { extent: Extent::Size(1), ..request }.check().is_err());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// The quantities, one texture each.
    pub quantities: Vec<Quantity>,
    /// The masking that is stored.
    pub masking: MaskingKind,
    /// The size of the textures.
    pub extent: Extent,
    /// The texels' number format.
    pub depths: Depths,
}

impl Request {
    /// Returns true if a quantity is asked for.
    #[must_use]
    pub fn wants(&self, quantity: Quantity) -> bool {
        self.quantities.contains(&quantity)
    }

    /// The tolerance, if one was asked for.
    #[must_use]
    pub fn tolerance(&self) -> Option<f64> {
        match self.extent {
            Extent::Size(_) => None,
            Extent::Tolerance(tolerance) => Some(tolerance),
        }
    }

    /// Refuses what no bake can do.
    ///
    /// # Errors
    ///
    /// A size or a tolerance out of range, or a quantity that its depth cannot hold.
    pub fn check(&self) -> Result<(), BakeError> {
        let integers = self.depths == Depths::Only(Depth::Unorm16);
        let unbounded = self.quantities.iter().find(|quantity| !quantity.fits_a_range());
        if let (true, Some(quantity)) = (integers, unbounded) {
            return Err(BakeError::Range(*quantity));
        }
        match self.extent {
            Extent::Size(found) if !WIDTHS.contains(&found) => Err(BakeError::Size { found }),
            Extent::Tolerance(found) if !TOLERANCES.contains(&found) => {
                Err(BakeError::Tolerance { found })
            }
            _ => Ok(()),
        }
    }
}

/// The size of textures.
///
/// # Example
///
/// ```
/// use sgdbake::{Depths, Extent, MaskingKind, Quantity, Request, bake, named};
///
/// let request = Request {
///     quantities: vec![Quantity::Fresnel],
///     masking: MaskingKind::Exact,
///     extent: Extent::Tolerance(1e-2), // the smallest textures that keep this relative error
///     depths: Depths::Smallest,
/// };
/// let table = &bake(&[named("gold-paint")?], &request)?.tables[0];
/// assert!(table.error.measured.is_some_and(|error| error <= 1e-2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extent {
    /// So many texels along every axis that is not a row.
    Size(usize),
    /// As few as keep this error.
    Tolerance(f64),
}

/// The number formats that a bake may use.
///
/// # Example
///
/// ```
/// use sgdbake::{Depths, lut::Depth};
///
/// assert_eq!(Depths::Smallest.candidates()[0], Depth::Half);
/// assert_eq!(Depths::Only(Depth::Float).candidates(), [Depth::Float]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Depths {
    /// The smallest that keeps the tolerance; half for a fixed size.
    #[default]
    Smallest,
    /// This one.
    Only(Depth),
}

impl Depths {
    /// The depths to try, in that order.
    #[must_use]
    pub fn candidates(&self) -> &[Depth] {
        match self {
            Self::Smallest => &[Depth::Half, Depth::Float],
            Self::Only(depth) => std::slice::from_ref(depth),
        }
    }
}
