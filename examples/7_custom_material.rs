//! A material of one's own: parameters from a file's text, checked, completed and evaluated.

// An example shows what it found.
#![allow(clippy::print_stdout)]

use sgdbake::brdf::albedo::directional_albedo;
use sgdbake::brdf::{MaskingKind, SgdBrdf};
use sgdbake::material::parse;

const FILE: &str = r#"
name = "my-paint"
[r]
rho_d = 0.14
rho_s = 0.16
alpha = 0.12
p = 0.79
f0 = 0.02
f1 = -0.6
[g]
rho_d = 0.09
rho_s = 0.11
alpha = 0.11
p = 0.81
f0 = 0.02
f1 = -0.5
[b]
rho_d = 0.03
rho_s = 0.05
alpha = 0.12
p = 0.75
f0 = 0.02
f1 = -0.4
"#;

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let material = parse(FILE, "my-paint.toml".as_ref())?;
    let brdf = SgdBrdf::new(&material, MaskingKind::Exact);
    for theta_deg in [0.0_f64, 45.0, 80.0] {
        let albedo = directional_albedo(&brdf, theta_deg.to_radians().cos());
        println!("{}: albedo at {theta_deg}° {albedo:.4?}", material.name);
    }
    // A value out of range is refused with its place in the file.
    let refused = parse(&FILE.replace("alpha = 0.12", "alpha = -1"), "bad.toml".as_ref());
    println!("refused: {}", refused.err().ok_or("a negative width was accepted")?);
    Ok(())
}
