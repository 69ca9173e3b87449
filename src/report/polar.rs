//! Lobes in the plane of incidence: how much is reflected into each direction of a half circle.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Write as _;

use crate::report::chart::escape;

/// A lobe: for each angle from the normal, in (−π/2, π/2), a radius ≥ 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Lobe {
    /// CSS classes.
    pub class: String,
    /// (θo, radius); negative angles lie on the light's side.
    pub points: Vec<[f64; 2]>,
}

/// A half circle with lobes. Its radius is the longest of theirs; points farther out are drawn on its
/// edge.
#[derive(Clone, Debug, PartialEq)]
pub struct Polar {
    /// Title.
    pub title: String,
    /// The light's angle from the normal.
    pub theta_i: f64,
    /// Lobes, the last on top.
    pub lobes: Vec<Lobe>,
    /// Points over them, as those of a lobe.
    pub points: Vec<[f64; 2]>,
}

/// Radius of the half circle and the origin in the drawing.
const RADIUS: f64 = 92.0;
const ORIGIN: [f64; 2] = [100.0, 116.0];

impl Polar {
    /// The drawing as an `svg` element.
    #[must_use]
    pub fn svg(&self) -> String {
        let radii = self.lobes.iter().flat_map(|lobe| &lobe.points).map(|p| p[1]);
        // Not 0, which every radius is divided by.
        let longest = radii.chain([usual(&self.points)]).fold(f64::MIN_POSITIVE, f64::max);
        let mut svg = format!(
            "<svg class=\"polar\" viewBox=\"0 0 200 122\" role=\"img\" aria-label=\"{0}\">\
             <text class=\"title\" x=\"4\" y=\"14\">{0}</text>",
            escape(&self.title)
        );
        for share in [0.5, 1.0] {
            let radius = share * RADIUS;
            let [x, y] = ORIGIN;
            let _ = write!(
                svg,
                "<path class=\"grid\" d=\"M{:.1} {y}A{radius} {radius} 0 0 1 {:.1} {y}\"/>",
                x - radius,
                x + radius
            );
        }
        let [left, right] = [place(-FRAC_PI_2, 1.0), place(FRAC_PI_2, 1.0)];
        let light = place(-self.theta_i, 1.0);
        let _ = write!(
            svg,
            "<path class=\"grid\" d=\"M{:.1} {:.1}H{:.1}\"/>\
             <path class=\"light\" d=\"M{:.1} {:.1}L{:.1} {:.1}\"/>",
            left[0], left[1], right[0], light[0], light[1], ORIGIN[0], ORIGIN[1]
        );
        for lobe in &self.lobes {
            let _ =
                write!(svg, "<path class=\"curve {}\" d=\"{}\"/>", lobe.class, path(lobe, longest));
        }
        for [theta, radius] in &self.points {
            let [x, y] = place(*theta, (radius / longest).min(1.0));
            let _ = write!(svg, "<circle class=\"mark\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1.1\"/>");
        }
        svg + "</svg>"
    }
}

/// The radius that nineteen of twenty points stay within: a value that was measured badly does not
/// shrink the drawing.
fn usual(points: &[[f64; 2]]) -> f64 {
    let mut radii: Vec<f64> = points.iter().map(|p| p[1]).collect();
    radii.sort_by(f64::total_cmp);
    radii.get(radii.len() * 19 / 20).copied().unwrap_or(0.0)
}

fn path(lobe: &Lobe, longest: f64) -> String {
    let mut path = String::new();
    for [theta, radius] in &lobe.points {
        let [x, y] = place(*theta, radius / longest);
        let _ = write!(path, "{}{x:.1} {y:.1}", if path.is_empty() { "M" } else { "L" });
    }
    path
}

fn place(theta: f64, radius: f64) -> [f64; 2] {
    [ORIGIN[0] + RADIUS * radius * theta.sin(), ORIGIN[1] - RADIUS * radius * theta.cos()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_radius_touches_the_edge() {
        let lobe = Lobe { class: "sgd".into(), points: vec![[0.0, 3.0], [FRAC_PI_2, 1.5]] };
        let svg =
            Polar { title: "30°".into(), theta_i: 0.5, lobes: vec![lobe], points: vec![] }.svg();
        assert!(svg.contains("d=\"M100.0 24.0L146.0 116.0\""), "{svg}");
    }
}
