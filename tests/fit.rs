//! The fits against an independent optimiser, the whole catalogue's mixtures, odd materials, and
//! the command.

use assert_cmd::Command;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DVector, Dyn, OMatrix, U4, Vector4};

use sgdbake::brdf::{GltfBrdf, Reflectance as _};
use sgdbake::fit::mixture::Objective;
use sgdbake::fit::{Metric, Target, gltf, mixture, one_lobe};
use sgdbake::material::{ChannelParams, Material, catalog};
use sgdbake::microfacet::{Distribution as _, Family};
use sgdbake::preview::ball::{KEY_LIGHT, TO_VIEWER, frame, normal_at};

/// A channel at one lobe width, for an optimiser that shares nothing with the fit: coefficients
/// ≥ 0 as squares, derivatives by differences, Levenberg–Marquardt from a crate.
#[derive(Clone)]
struct AtWidth<'a> {
    target: &'a Target,
    channel: usize,
    /// The value of each coefficient's share at each pair.
    basis: &'a [[f64; 4]],
    roots: Vector4<f64>,
}

impl AtWidth<'_> {
    fn residuals_at(&self, roots: &Vector4<f64>) -> DVector<f64> {
        let exact = &self.target.channels[self.channel];
        let pairs = self.target.pairs.iter().zip(self.basis).zip(exact);
        let residuals =
            |((pair, basis), exact): ((&sgdbake::fit::target::Pair, &[f64; 4]), &f64)| {
                let fit: f64 = (0..4).map(|i| roots[i] * roots[i] * basis[i]).sum();
                [0, 1].map(|side| {
                    let lightness = |f: f64| Metric::CubeRoot.transform(f, pair.cos_theta[side]).0;
                    pair.weights[side].sqrt() * (lightness(fit) - lightness(*exact))
                })
            };
        DVector::from_iterator(2 * exact.len(), pairs.flat_map(residuals))
    }
}

impl LeastSquaresProblem<f64, Dyn, U4> for AtWidth<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, U4>;
    type ParameterStorage = Owned<f64, U4>;

    fn set_params(&mut self, roots: &Vector4<f64>) {
        self.roots = *roots;
    }

    fn params(&self) -> Vector4<f64> {
        self.roots
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.residuals_at(&self.roots))
    }

    fn jacobian(&self) -> Option<OMatrix<f64, Dyn, U4>> {
        const STEP: f64 = 1e-6;
        let column = |axis: usize| {
            let mut step = Vector4::zeros();
            step[axis] = STEP;
            let forward = self.residuals_at(&(self.roots + step));
            (forward - self.residuals_at(&(self.roots - step))) / (2.0 * STEP)
        };
        Some(OMatrix::<f64, Dyn, U4>::from_columns(&[column(0), column(1), column(2), column(3)]))
    }
}

/// The lowest Σ r² of a channel over a dense grid of widths, and the width.
fn best_of_grid(target: &Target, channel: usize, family: Family) -> (f64, f64) {
    const GRID: usize = 120;
    let mut best = (f64::INFINITY, f64::NAN);
    for i in 0..GRID {
        let alpha = 1e-3 * 2000_f64.powf(i as f64 / (GRID - 1) as f64);
        let distribution = family.of_width(alpha);
        let basis: Vec<[f64; 4]> = target
            .pairs
            .iter()
            .map(|pair| {
                let g1 = |side: usize| distribution.g1(pair.cot_theta[side]);
                let d = distribution.ndf(pair.tan2_theta_h);
                let lobe = d * g1(0) * g1(1) / (4.0 * pair.cos_theta[0] * pair.cos_theta[1]);
                let c = pair.cos_theta_d;
                let u = (1.0 - c).powi(5);
                [std::f64::consts::FRAC_1_PI, lobe * (1.0 - u - c), lobe * u, lobe * c]
            })
            .collect();
        let problem = AtWidth { target, channel, basis: &basis, roots: Vector4::repeat(0.3) };
        let (_, report) = LevenbergMarquardt::new().minimize(problem);
        let squares = 2.0 * report.objective_function;
        if squares < best.0 {
            best = (squares, alpha);
        }
    }
    best
}

#[test]
fn no_independent_optimiser_finds_a_better_lobe() {
    for entry in catalog().iter().skip(3).step_by(8) {
        let given = Target::new(&entry.material);
        // The nodes on which a fit is finished.
        let target = given.polish();
        for family in [Family::Beckmann, Family::Ggx] {
            let fit = one_lobe::fit_target(&given, family, Metric::CubeRoot);
            let residuals = target.own_residuals(&fit.per_channel.brdf());
            let channel = 1;
            let exact: f64 = target
                .pairs
                .iter()
                .zip(&target.channels[channel])
                .flat_map(|(p, f)| {
                    let lightness =
                        |side: usize| Metric::CubeRoot.transform(*f, p.cos_theta[side]).0;
                    [0, 1].map(|side| p.weights[side] * lightness(side).powi(2))
                })
                .sum();
            let ours = residuals.cube_root[channel].powi(2) * exact;
            let (theirs, alpha) = best_of_grid(target, channel, family);
            assert!(
                ours <= theirs * (1.0 + 1e-6) + 1e-14,
                "{} {family:?}: {ours:e} at {}, the grid has {theirs:e} at {alpha}",
                entry.material.name,
                fit.per_channel.channels[channel].alpha,
            );
        }
    }
}

/// The materials whose three distributions eight shared widths cannot reach to 0.1 %, and how near
/// they come: a search by linear programs from many starts finds no less than 0.198, 0.126, 0.129,
/// 0.128, 0.104, 0.101 and 0.098 % for them.
const BEYOND_EIGHT: [(&str, f64); 7] = [
    ("silicon-nitrade", 2.05e-3),
    ("red-specular-plastic", 1.32e-3),
    ("green-acrylic", 1.32e-3),
    ("specular-white-phenolic", 1.32e-3),
    ("specular-yellow-phenolic", 1.09e-3),
    ("blue-acrylic", 1.10e-3),
    ("gold-metallic-paint2", 1.02e-3),
];

#[test]
fn eight_components_are_within_a_tenth_of_a_percent_but_on_seven_materials() {
    for entry in catalog() {
        let name = &*entry.material.name;
        let fit = mixture::fit(&entry.material, 8);
        let beyond = BEYOND_EIGHT.iter().find(|(beyond, _)| *beyond == name);
        let most = beyond.map_or(1e-3, |(_, most)| *most);
        for (c, error) in fit.ndf_error.into_iter().enumerate() {
            assert!(error <= most, "{name} lobe {c}: {error}");
            let sum: f64 = fit.mixture.weights.iter().map(|w| w[c]).sum();
            assert!((sum - 1.0).abs() < 1e-12, "{name}: energy {sum}");
        }
        assert!(fit.mixture.weights.iter().flatten().all(|w| *w >= 0.0));
        assert!(fit.mixture.alpha.is_sorted());
    }
}

#[test]
fn ten_components_are_within_a_tenth_of_a_percent_where_eight_are_not() {
    for (name, _) in BEYOND_EIGHT {
        let material = &sgdbake::material::find(name).expect("in the catalogue").material;
        let error = mixture::fit(material, 10).ndf_error.into_iter().fold(0.0, f64::max);
        assert!(error <= 1e-3, "{name}: {error}");
    }
}

/// A component more never makes the largest error larger, and almost always smaller.
#[test]
fn more_components_are_better() {
    for entry in catalog().iter().step_by(5) {
        let error = |count| {
            let fit = mixture::fit(&entry.material, count);
            fit.ndf_error.into_iter().fold(0.0, f64::max)
        };
        let errors: Vec<f64> = (1..=9).map(error).collect();
        let name = &entry.material.name;
        assert!(errors.windows(2).all(|pair| pair[1] <= pair[0]), "{name}: {errors:?}");
        let falls = errors.windows(2).filter(|pair| pair[1] < pair[0]).count();
        assert!(falls >= errors.len() - 2, "{name}: {errors:?}");
    }
}

/// The minimax fit's largest error is at most the least squares fit's, over a few materials less.
#[test]
fn the_minimax_fit_has_the_smaller_largest_error() {
    let mut ratios = Vec::new();
    for entry in catalog().iter().step_by(9) {
        let target = Target::new(&entry.material);
        let largest = |objective| {
            let fit = mixture::fit_target(&target, 6, objective);
            fit.ndf_error.into_iter().fold(0.0, f64::max)
        };
        let [squares, minimax] = [Objective::LeastSquares, Objective::Minimax].map(largest);
        // Below a hundredth of a percent either may be caught in a local minimum (green-latex is).
        let most = (1.02 * squares).max(1e-4);
        assert!(minimax <= most, "{}: {minimax} {squares}", entry.material.name);
        ratios.push(squares / minimax);
    }
    ratios.sort_by(f64::total_cmp);
    assert!(ratios[ratios.len() / 2] > 1.05, "{ratios:?}");
}

/// Judged at 32 times the pairs, a fit is within a twentieth of the best there.
#[test]
fn the_quadrature_is_fine_enough() {
    let dense = sgdbake::fit::target::Resolution { theta_h: 64, theta_d: 24, phi_d: 6 };
    for entry in catalog().iter().step_by(13) {
        let target = Target::new(&entry.material);
        let fit = one_lobe::fit_target(&target, Family::Ggx, Metric::default());
        let dense_target = Target::with_resolution(&entry.material, dense);
        let best = one_lobe::fit_target(&dense_target, Family::Ggx, Metric::default());
        let judged = dense_target.residuals(&fit.joint.brdf()).cube_root;
        for (judged, best) in judged.into_iter().zip(best.joint_residuals.cube_root) {
            let name = &entry.material.name;
            assert!(judged <= 1.05 * best + 1e-4, "{name}: {judged} against {best}");
        }
    }
}

fn odd_materials() -> Vec<(&'static str, ChannelParams)> {
    let plain = ChannelParams {
        rho_d: 0.2,
        rho_s: 0.1,
        alpha: 0.05,
        p: 0.5,
        f0: 0.2,
        f1: 0.1,
        masking: None,
    };
    vec![
        ("black", ChannelParams { rho_d: 0.0, rho_s: 0.0, ..plain }),
        ("matte", ChannelParams { rho_s: 0.0, ..plain }),
        ("no diffuse", ChannelParams { rho_d: 0.0, ..plain }),
        ("negative Fresnel", ChannelParams { f0: 0.05, f1: 0.6, ..plain }),
        ("bright", ChannelParams { rho_s: 40.0, f0: 5.0, ..plain }),
        ("very wide", ChannelParams { alpha: 50.0, ..plain }),
        ("a mirror", ChannelParams { alpha: 1e-8, ..plain }),
        ("a long tail", ChannelParams { alpha: 1e-4, p: 4.0, ..plain }),
        ("no tail", ChannelParams { p: 0.0, ..plain }),
    ]
}

#[test]
fn odd_channels_give_finite_fits_in_range() {
    let plain = odd_materials()[8].1;
    for (name, odd) in odd_materials() {
        for channels in [[odd; 3], [plain, odd, plain]] {
            let material = Material::of_channels(name, &channels).expect("in range");
            let target = Target::new(&material);
            for family in [Family::Beckmann, Family::Ggx] {
                let fit = one_lobe::fit_target(&target, family, Metric::default());
                for channel in fit.per_channel.channels.iter().chain(&fit.joint.channels) {
                    assert!(channel.alpha > 0.0 && channel.alpha.is_finite(), "{name}");
                    assert!(channel.rho_d >= 0.0, "{name}");
                }
                let joint = fit.joint.brdf();
                assert!(target.pairs.iter().all(|pair| {
                    joint.eval(pair.wi, pair.wo).iter().all(|f| *f >= 0.0 && f.is_finite())
                }));
            }
            // Lobes that differ by decades share eight widths: then the error is stated.
            let mixture = mixture::fit(&material, 8);
            let most = if channels[0] == channels[1] { 0.02 } else { 1.0 };
            assert!(mixture.ndf_error.iter().all(|e| *e <= most), "{name} {:?}", mixture.ndf_error);
            let gltf = gltf::fit(&material).material;
            let unit = [gltf.metallic, gltf.roughness, gltf.specular_factor].into_iter();
            assert!(
                unit.chain(gltf.base_color).all(|x| (0.0..=1.0).contains(&x)),
                "{name} {gltf:?}"
            );
            assert!(gltf.specular_color.iter().all(|x| (0.0..=25.0).contains(x)), "{name}");
        }
    }
}

#[test]
fn odd_channels_are_named_in_the_reasons() {
    let reasons = |index: usize| {
        let channels = [odd_materials()[index].1; 3];
        let material = Material::of_channels("odd", &channels).expect("in range");
        let fit = one_lobe::fit(&material, Family::Ggx);
        fit.reasons.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
    };
    assert!(reasons(1).contains("g: no visible lobe"));
    assert!(reasons(3).contains("Fresnel factor falls to -0.55"), "{}", reasons(3));
    assert!(reasons(4).contains("above all light that arrives"));
    assert_eq!(reasons(8), "");
}

fn sgdbake() -> Command {
    Command::new(env!("CARGO_BIN_EXE_sgdbake"))
}

#[test]
fn a_material_file_is_fitted_like_the_rest() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("mine.toml");
    let channel = "rho_d = 0.14\nrho_s = 0.16\nalpha = 0.12\np = 0.79\nf0 = 9.2e-12\nf1 = -0.6\n";
    let text = format!("name = \"mine\"\n[r]\n{channel}[g]\n{channel}[b]\n{channel}");
    std::fs::write(&path, text).expect("writes");
    let run = sgdbake().args(["fit", "--json", "--material"]).arg(&path).assert().success();
    let lines: Vec<serde_json::Value> = std::str::from_utf8(&run.get_output().stdout)
        .expect("text")
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let models: Vec<&str> = lines.iter().map(|l| l["model"].as_str().expect("a name")).collect();
    assert_eq!(models, ["beckmann", "ggx", "mixture", "gltf"]);
    for line in &lines {
        assert_eq!(line["schema"], "sgdbake/fit/1");
        assert_eq!(line["material"], "mine");
        let appearance = line["appearance"].as_array().expect("a list");
        assert!(appearance.iter().all(|a| a["delta_e_mean"].as_f64().is_some_and(|e| e < 3.0)));
    }
    let errors = lines[2]["fit"]["ndf_error"].as_array().expect("one a lobe");
    assert!(errors.iter().all(|e| e.as_f64().is_some_and(|e| e < 0.01)));
}

#[test]
fn wrong_usage_is_refused() {
    sgdbake().args(["fit"]).assert().code(2);
    sgdbake().args(["fit", "--all", "--material", "chrome"]).assert().code(2);
    sgdbake().args(["fit", "--all", "--model", "phong"]).assert().code(2);
    sgdbake().args(["fit", "--all", "--components", "0"]).assert().code(2);
    sgdbake().args(["fit", "--material", "chrme"]).assert().code(2);
}

/// A pixel of the ball that Blender rendered: case, (x, y) of the picture plane, radiance.
fn rendered_ball() -> Vec<(String, [f64; 2], [f64; 3])> {
    let rows = include_str!("data/blender-gltf-ball.csv").lines().skip(1);
    rows.map(|line| {
        let (case, numbers) = line.split_once(',').expect("a case and five numbers");
        let n: Vec<f64> = numbers.split(',').map(|n| n.parse().expect("a number")).collect();
        (case.to_owned(), [n[0], n[1]], [n[2], n[3], n[4]])
    })
    .collect()
}

/// The materials of blender/tests/gltf_ball.py, and how far Blender may be (relative RMS): its
/// metals are glTF's; under a dielectric's lobe it darkens the diffuse base by the lobe's albedo
/// where glTF's appendix B takes 1 − F.
fn rendered_materials() -> [(&'static str, f64, GltfBrdf); 5] {
    let metal = GltfBrdf {
        base_color: [0.9, 0.6, 0.3],
        metallic: 1.0,
        roughness: 0.4,
        specular_factor: 1.0,
        specular_color: [1.0; 3],
        clearcoat: None,
        clearcoat_roughness: None,
    };
    let brown = GltfBrdf { base_color: [0.3, 0.1, 0.02], metallic: 0.0, ..metal };
    [
        ("metal", 1e-3, metal),
        ("rough-metal", 1e-3, GltfBrdf { base_color: [0.2, 0.5, 0.8], roughness: 0.8, ..metal }),
        (
            "plastic",
            0.06,
            GltfBrdf { base_color: [0.5, 0.2, 0.1], metallic: 0.0, roughness: 0.3, ..metal },
        ),
        (
            "tinted",
            0.03,
            GltfBrdf {
                roughness: 0.5,
                specular_factor: 0.8,
                specular_color: [5.0, 3.0, 1.0],
                ..brown
            },
        ),
        (
            "coated",
            0.03,
            GltfBrdf {
                roughness: 0.6,
                clearcoat: Some(1.0),
                clearcoat_roughness: Some(0.2),
                ..brown
            },
        ),
    ]
}

#[test]
fn the_gltf_model_is_what_blender_renders() {
    let pixels = rendered_ball();
    for (case, tolerance, material) in rendered_materials() {
        let (mut difference, mut total, mut count) = (0.0, 0.0, 0);
        for (_, [x, y], seen) in pixels.iter().filter(|(name, ..)| name == case) {
            let to_local = frame(normal_at(*x, *y).expect("on the ball")).transpose();
            let (wi, wo) = (to_local * KEY_LIGHT.direction, to_local * TO_VIEWER);
            let f = material.eval(wi, wo);
            for (f, seen) in f.into_iter().zip(seen) {
                let radiance = f * wi.z.max(0.0) * KEY_LIGHT.irradiance;
                difference += (radiance - seen).powi(2);
                total += seen * seen;
                count += 1;
            }
        }
        let error = (difference / total).sqrt();
        assert!(count > 100 && error < tolerance, "{case}: {error} over {count} values");
    }
}
