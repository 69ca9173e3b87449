//! Measured materials for engines: the Shifted Gamma Distribution (SGD) of Bagher, Soler and
//! Holzschuch, evaluated exactly, sampled, baked into textures, fitted and exported.
//!
//! A [`Material`] is a diffuse colour and up to three lobes. [`catalog`] holds the paper's fits of
//! the 100 materials of the MERL database, [`refit`] fits of this crate, with one lobe or two, to
//! the same surfaces; [`named`] finds both, and [`load_material`] reads a file.
//!
//! # Evaluate
//!
//! The surface normal is n = +z. `wi` points to the light, `wo` to the viewer, both away from the
//! surface and of unit length. Angles are in radians, colours linear RGB.
//!
//! ```
//! use sgdbake::{MaskingKind, SgdBrdf, named, spherical};
//!
//! let material = named("gold-paint")?;
//! let brdf = SgdBrdf::new(material, MaskingKind::Exact);
//! let wi = spherical(30_f64.to_radians(), 0.0);
//! let wo = spherical(40_f64.to_radians(), std::f64::consts::PI);
//! let f = brdf.eval(wi, wo); // 1/sr
//! assert!(f[0] > f[1] && f[1] > f[2], "gold is yellow: {f:?}");
//! assert_eq!(f, brdf.eval(wo, wi), "reciprocal to the last bit");
//! # Ok::<(), sgdbake::material::UnknownMaterial>(())
//! ```
//!
//! # Sample
//!
//! ```
//! use sgdbake::{MaskingKind, Sampler, SgdBrdf, Strategy, directional_albedo, named, spherical};
//!
//! let material = named("gold-paint")?;
//! let sampler = Sampler::new(material, MaskingKind::Exact, Strategy::Vndf);
//! let wo = spherical(60_f64.to_radians(), 0.0);
//! let (mut sum, n) = (0.0, 4096);
//! for i in 0..n {
//!     // Three numbers in [0, 1): here a lattice, in a renderer its random numbers.
//!     let u = [0.8191725134, 0.6710436067, 0.5497004779].map(|step| (f64::from(i) * step).fract());
//!     // The weight is f cosθi/pdf; None is a draw below the horizon, which counts as 0.
//!     sum += sampler.sample_with_weight(wo, u).map_or(0.0, |drawn| drawn.weight[0]);
//! }
//! let exact = directional_albedo(&SgdBrdf::new(material, MaskingKind::Exact), wo.z);
//! assert!((sum / f64::from(n) - exact[0]).abs() < 0.02 * exact[0]);
//! # Ok::<(), sgdbake::material::UnknownMaterial>(())
//! ```
//!
//! # Bake
//!
//! ```
//! # #[cfg(feature = "full")] {
//! use sgdbake::{Depths, Extent, Format, MaskingKind, Quantity, Request, bake, encode, named};
//!
//! let materials = [named("gold-paint")?, named("chrome")?];
//! let request = Request {
//!     quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
//!     masking: MaskingKind::Exact,
//!     extent: Extent::Tolerance(1e-2), // the smallest textures that keep this relative error
//!     depths: Depths::Smallest,
//! };
//! for table in &bake(&materials, &request)?.tables {
//!     let exr = encode(table, Format::Exr)?;
//!     println!("{}: {:?} texels, {} bytes", table.quantity.name(), table.size, exr.len());
//! }
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Fit
//!
//! ```
//! use sgdbake::{GltfBrdf, Metric, fit_gltf, named};
//!
//! let fit = fit_gltf(named("gold-paint")?);
//! let GltfBrdf { base_color, metallic, roughness, .. } = fit.material;
//! println!("base colour {base_color:.3?}, metallic {metallic:.3}, roughness {roughness:.3}");
//! // The relative distance from the material, per channel.
//! let residual = fit.residuals.in_metric(Metric::default());
//! assert!(residual.iter().all(|r| (0.0..1.0).contains(r)), "{residual:?}");
//! # Ok::<(), sgdbake::material::UnknownMaterial>(())
//! ```
//!
//! # Export
//!
//! The product of a material: its best glTF material, its parameters as a glTF extension, and its
//! textures. A scene takes it in any of its slots.
//!
//! ```
//! # #[cfg(feature = "full")] {
//! use sgdbake::{Depths, Extent, Format, MaskingKind, Quantity, Request, Scene, build, named};
//!
//! let request = Request {
//!     quantities: vec![Quantity::Ndf, Quantity::Masking, Quantity::Fresnel],
//!     masking: MaskingKind::Exact,
//!     extent: Extent::Size(64),
//!     depths: Depths::Smallest,
//! };
//! let product = build(&[named("gold-paint")?], &request, Format::Exr)?;
//! let scene = Scene::ball(32)?; // or Scene::open("chair.glb".as_ref())?
//! let slot = scene.slots()[0].id;
//! let export = scene.export(&[(slot, &product.assets[0])], "ball.glb".as_ref())?;
//! let mut glb = Vec::new();
//! export.files[0].write_to(&mut glb)?;
//! assert!(glb.starts_with(b"glTF"));
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Precision
//!
//! `f64` is the reference. [`SgdBatch`] evaluates slices in `f32`, [`SamplerBatch`] draws as many
//! directions, and both are measured against it.
//!
//! # Features
//!
//! Without a feature the crate evaluates, samples and fits. `full` adds measurements, baking,
//! export and pictures; `cli`, the default, the command `sgdbake`. As a library dependency take
//! `default-features = false`, with `features = ["full"]` where you bake or export.

#[cfg(feature = "full")]
pub mod asset;
pub mod brdf;
#[cfg(feature = "full")]
pub mod encode;
pub mod fit;
#[cfg(feature = "full")]
pub mod lut;
pub mod material;
// Public because the command uses it, hidden because it is not part of the interface.
#[doc(hidden)]
pub mod math;
#[cfg(feature = "full")]
pub mod measurement;
pub mod microfacet;
#[cfg(feature = "full")]
pub mod preview;
// As `math`.
#[cfg(feature = "full")]
#[doc(hidden)]
pub mod report;
#[cfg(feature = "full")]
pub mod scene;

pub use glam::DVec3;

#[doc(inline)]
pub use crate::brdf::{
    Brdf, GltfBrdf, Lobe, MaskingKind, Reflectance, Sample, Sampler, SamplerBatch, SgdBatch,
    SgdBrdf, Strategy, directional_albedo,
};
#[doc(inline)]
pub use crate::fit::{
    Metric, Target, gltf::fit as fit_gltf, measured_target::MeasuredTarget,
    mixture::fit as fit_mixture, one_lobe::fit as fit_one_lobe, sgd::fit as fit_sgd,
};
#[doc(inline)]
pub use crate::material::{
    ChannelParams, LobeFields, LobeParams, MaskingParams, Material, catalog, load as load_material,
    named, parse as parse_material, refit,
};
#[doc(inline)]
pub use crate::math::direction::spherical;
#[doc(inline)]
pub use crate::microfacet::{Beckmann, BeckmannMixture, Distribution, Family, Fresnel, Ggx, Sgd};

#[cfg(feature = "full")]
#[doc(inline)]
pub use crate::asset::{Asset, Extension, Manifest, Product, build};
#[cfg(feature = "full")]
#[doc(inline)]
pub use crate::encode::{Format, encode};
#[cfg(feature = "full")]
#[doc(inline)]
pub use crate::lut::{Depths, Extent, Quantity, Request, Table, bake, decode::LutBrdf};
#[cfg(feature = "full")]
#[doc(inline)]
pub use crate::measurement::{Filled, Measurement, Merl, Rgl};
#[cfg(feature = "full")]
#[doc(inline)]
pub use crate::preview::{Environment, Film, Shape, render::render};
#[cfg(feature = "full")]
#[doc(inline)]
pub use crate::scene::Scene;
