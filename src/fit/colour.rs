//! A radiance as a viewer sees it, and the distance of another from it in ΔE2000.

/// A colour in CIELAB (D65), with its derivative by the linear RGB that shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lab {
    /// L*, a*, b*.
    pub value: [f64; 3],
    /// ∂(L*, a*, b*)/∂(r, g, b), a row each.
    pub slope: [[f64; 3]; 3],
}

/// XYZ of linear sRGB, each divided by the white point's (D65).
const XYZ_OVER_WHITE: [[f64; 3]; 3] = [
    [0.412_456_4 / 0.950_47, 0.357_576_1 / 0.950_47, 0.180_437_5 / 0.950_47],
    [0.212_672_9, 0.715_152_2, 0.072_175_0],
    [0.019_333_9 / 1.088_83, 0.119_192_0 / 1.088_83, 0.950_304_1 / 1.088_83],
];

/// How much of a highlight's brightness above white counts: a picture of it shows white, but under
/// another light, or at another exposure, it would not.
const ABOVE_WHITE: f64 = 0.4;

impl Lab {
    /// The colour of a radiance relative to white; what exceeds white counts by its logarithm,
    /// 1 + 0.4 ln x.
    #[must_use]
    pub fn of_radiance(rgb: [f64; 3]) -> Self {
        // The logarithm meets the identity at white, where its slope drops to 0.4: the fit still
        // sees how bright a highlight is, but a few very bright pairs do not outweigh all others.
        let shown = rgb.map(compressed);
        let root = XYZ_OVER_WHITE.map(|row| {
            let xyz: f64 = (0..3).map(|c| row[c] * shown[c].0).sum();
            let (root, slope) = lightness(xyz);
            (root, std::array::from_fn::<f64, 3, _>(|c| slope * row[c] * shown[c].1))
        });
        // CIELAB: L* = 116 Y' − 16, a* = 500 (X' − Y'), b* = 200 (Y' − Z') of the cube roots.
        let [x, y, z] = root;
        Self {
            value: [116.0 * y.0 - 16.0, 500.0 * (x.0 - y.0), 200.0 * (y.0 - z.0)],
            slope: [
                y.1.map(|slope| 116.0 * slope),
                scaled_difference(500.0, x.1, y.1),
                scaled_difference(200.0, y.1, z.1),
            ],
        }
    }
}

/// s (a − b).
fn scaled_difference(s: f64, a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| s * (a[c] - b[c]))
}

/// x below white, 1 + 0.4 ln x above; and the slope.
fn compressed(x: f64) -> (f64, f64) {
    if x <= 1.0 { (x, 1.0) } else { (1.0 + ABOVE_WHITE * x.ln(), ABOVE_WHITE / x) }
}

/// x^⅓ with CIELAB's linear toe, and its slope.
fn lightness(x: f64) -> (f64, f64) {
    // (6/29)³ and (29/6)²/3, below which the slope of x^⅓ would go to infinity at black.
    const TOE: f64 = 216.0 / 24389.0;
    const TOE_SLOPE: f64 = 841.0 / 108.0;
    if x > TOE {
        let root = x.cbrt();
        (root, root / (3.0 * x))
    } else {
        (TOE_SLOPE * x + 4.0 / 29.0, TOE_SLOPE)
    }
}

/// A linear map E of differences in CIELAB, |E ΔLab| = ΔE2000 for small ones about a colour.
pub type Ellipsoid = [[f64; 3]; 3];

/// The unit ellipsoid of ΔE2000 about a colour (Sharma, Wu and Dalal 2005).
#[must_use]
pub fn ellipsoid([l, a, b]: [f64; 3]) -> Ellipsoid {
    // G depends on the mean chroma of the two colours, so both have the same: a* is only stretched.
    let g = 0.5 * (1.0 - chroma_share(a.hypot(b)));
    let (a, stretch) = ((1.0 + g) * a, 1.0 + g);
    let (chroma, hue) = (a.hypot(b), b.atan2(a));
    let from_50 = (l - 50.0).powi(2);
    // S_L, S_C and S_H are of the two colours' mean: for close ones, of either.
    let s_l = 1.0 + 0.015 * from_50 / (20.0 + from_50).sqrt();
    let (s_c, s_h) = (1.0 + 0.045 * chroma, 1.0 + 0.015 * chroma * hue_weight(hue));
    // ΔE² = L² + C² + H² + R·C·H = L² + (C + RH/2)² + (1 − R²/4) H².
    let half_rotation = 0.5 * rotation(chroma, hue.to_degrees().rem_euclid(360.0));
    // R is in [−2, 0], so that rounding alone could make the square root's argument negative.
    let along = (1.0 - half_rotation * half_rotation).max(0.0).sqrt() / s_h;
    // ΔC' = cos h Δa' + sin h Δb' and ΔH' = −sin h Δa' + cos h Δb' for small differences.
    let (sin, cos) = hue.sin_cos();
    let skew = half_rotation / s_h;
    [
        [1.0 / s_l, 0.0, 0.0],
        [0.0, stretch * (cos / s_c - sin * skew), sin / s_c + cos * skew],
        [0.0, -stretch * sin * along, cos * along],
    ]
}

/// T = 1 − 0.17 cos(h − 30°) + 0.24 cos 2h + 0.32 cos(3h + 6°) − 0.20 cos(4h − 63°) of a hue.
fn hue_weight(h: f64) -> f64 {
    let [deg_6, deg_30, deg_63] = [6.0, 30.0, 63.0].map(f64::to_radians);
    1.0 - 0.17 * (h - deg_30).cos() + 0.24 * (2.0 * h).cos() + 0.32 * (3.0 * h + deg_6).cos()
        - 0.20 * (4.0 * h - deg_63).cos()
}

/// √(C⁷/(C⁷ + 25⁷)).
fn chroma_share(chroma: f64) -> f64 {
    let seventh = chroma.powi(7);
    (seventh / (seventh + 25.0_f64.powi(7))).sqrt()
}

/// R_T of a chroma and a hue in degrees.
fn rotation(chroma: f64, hue: f64) -> f64 {
    // Δθ = 30° exp(−((h − 275°)/25°)²), and R_T = −R_C sin 2Δθ with R_C = 2 √(C⁷/(C⁷ + 25⁷)).
    let turn = 60.0 * (-((hue - 275.0) / 25.0).powi(2)).exp();
    -2.0 * chroma_share(chroma) * turn.to_radians().sin()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palette::color_difference::Ciede2000 as _;
    use palette::white_point::D65;

    #[test]
    fn the_ellipsoid_is_the_difference_of_close_colours() {
        for colour in [
            [60.0, 20.0, -30.0],
            [30.0, -5.0, 2.0],
            [80.0, 60.0, 70.0],
            [5.0, 1.0, 0.0],
            [50.0, 10.0, -60.0],
        ] {
            for step in [[0.02, 0.0, 0.0], [0.0, 0.02, 0.01], [0.01, -0.02, 0.02], [0.0, 0.0, 0.02]]
            {
                let other: [f64; 3] = std::array::from_fn(|i| colour[i] + step[i]);
                let [from, to] =
                    [colour, other].map(|[l, a, b]| palette::Lab::<D65, f64>::new(l, a, b));
                let exact = from.difference(to);
                let e = ellipsoid(colour).map(|row| (0..3).map(|i| row[i] * step[i]).sum::<f64>());
                let length = e.iter().map(|e| e * e).sum::<f64>().sqrt();
                assert!(
                    (length / exact - 1.0).abs() < 2e-3,
                    "{colour:?} {step:?}: {length} {exact}"
                );
            }
        }
    }

    #[test]
    fn the_slope_is_the_derivative() {
        for rgb in [[0.2, 0.5, 0.1], [0.001, 0.002, 0.0], [3.0, 0.4, 1.2]] {
            let at = Lab::of_radiance(rgb);
            for c in 0..3 {
                let mut moved = rgb;
                moved[c] += 1e-7;
                let moved = Lab::of_radiance(moved).value;
                for (k, slope) in at.slope.iter().enumerate() {
                    let difference = (moved[k] - at.value[k]) / 1e-7;
                    assert!((difference - slope[c]).abs() < 1e-3 * (1.0 + difference.abs()));
                }
            }
        }
    }

    #[test]
    fn white_is_white() {
        let [l, a, b] = Lab::of_radiance([1.0; 3]).value;
        assert!((l - 100.0).abs() < 1e-3 && a.abs() < 1e-2 && b.abs() < 1e-2, "{l} {a} {b}");
    }
}
