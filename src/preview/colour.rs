//! Colours as a viewer sees them: the tone curve, CIE Lab, colour differences.

use palette::color_difference::Ciede2000 as _;
use palette::white_point::D65;
use palette::{IntoColor as _, Lab, LinSrgb, Srgb};

/// Luminance Y of linear sRGB (Rec. 709 primaries).
#[must_use]
pub fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.212_639 * r + 0.715_169 * g + 0.072_192 * b
}

/// The luminance that the tone curve shows as white.
const WHITE: f64 = 4.0;

/// Display-referred linear RGB in [0, 1]: c (1 + Y/Y_white²)/(1 + Y) with Y_white = 4, clipped
/// (Reinhard et al. 2002, equation 4).
#[must_use]
pub fn tone_map(rgb: [f64; 3]) -> [f64; 3] {
    // f, and with it Y, is below 0 where a published F is; 1 + Y must stay positive.
    let y = luminance(rgb).max(0.0);
    let scale = (1.0 + y / (WHITE * WHITE)) / (1.0 + y);
    // One scale for all channels keeps the hue until one of them clips.
    rgb.map(|c| (c * scale).clamp(0.0, 1.0))
}

/// The 8-bit sRGB value of a scene colour after the tone curve.
#[must_use]
pub fn to_srgb8(rgb: [f64; 3]) -> [u8; 3] {
    let [r, g, b] = tone_map(rgb);
    let encoded: Srgb<f64> = Srgb::from_linear(LinSrgb::new(r, g, b));
    encoded.into_format::<u8>().into()
}

/// CIE Lab (D65, 2° observer) of a scene colour after the tone curve: L* in [0, 100].
#[must_use]
pub fn lab(rgb: [f64; 3]) -> Lab<D65, f64> {
    let [r, g, b] = tone_map(rgb);
    LinSrgb::new(r, g, b).into_color()
}

/// ΔE2000 between two scene colours as displayed; about 1 is just noticeable side by side.
#[must_use]
pub fn delta_e2000(a: [f64; 3], b: [f64; 3]) -> f64 {
    lab(a).difference(lab(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delta_e_matches_the_published_test_pairs() {
        // Sharma, Wu and Dalal (2005), table 1.
        let pairs = [
            ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
            ([50.0, -0.0010, 2.4900], [50.0, 0.0011, -2.4900], 4.7461),
            ([60.2574, -34.0099, 36.2677], [60.4626, -34.1751, 39.4387], 1.2644),
        ];
        for (a, b, expected) in pairs {
            let [a, b] = [a, b].map(|[l, a, b]| Lab::<D65, f64>::new(l, a, b));
            let difference = a.difference(b);
            assert!((difference - expected).abs() < 1e-4, "{difference} {expected}");
        }
    }

    #[test]
    fn of_two_greys_the_difference_is_in_lightness() {
        // ΔE2000 = ΔL/(1 + 0.015 (L̄ − 50)²/√(20 + (L̄ − 50)²)) with L = 116 ∛Y − 16.
        let [dark, light] = [0.1, 0.9].map(|grey| 116.0 * tone_map([grey; 3])[0].cbrt() - 16.0);
        let from_50 = 0.5 * (dark + light) - 50.0;
        let weight = 1.0 + 0.015 * from_50.powi(2) / (20.0 + from_50.powi(2)).sqrt();
        let difference = delta_e2000([0.1; 3], [0.9; 3]);
        assert!((difference - (light - dark) / weight).abs() < 1e-3, "{difference}");
    }

    #[test]
    fn the_curve_ends_at_white_and_keeps_black() {
        assert_eq!(tone_map([0.0; 3]), [0.0; 3]);
        assert!(tone_map([WHITE; 3]).iter().all(|c| (c - 1.0).abs() < 1e-5));
        assert_eq!(to_srgb8([WHITE * 1.01; 3]), [255; 3]);
        assert!((lab([WHITE * 1.01; 3]).l - 100.0).abs() < 1e-3);
        assert_eq!(to_srgb8([-1.0, f64::NAN, 0.0])[0], 0);
    }
}
