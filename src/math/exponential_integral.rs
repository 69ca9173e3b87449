//! The generalised exponential integral, which is the incomplete gamma function of every order
//! that SGD needs.

/// Scaled exponential integral g(p, x) = eˣ E_p(x) for p ≥ 0, x > 0.
///
/// # Formula
///
/// ```text
/// g(p, x) = ∫_1^∞ u^{-p} e^{-x(u-1)} du,      Γ(1-p, x) = x^{1-p} e^{-x} g(p, x)
/// ```
///
/// so the upper incomplete gamma function of an order 1 − p that may be zero or negative
/// (DLMF 8.19.1) is reached without the poles of Γ, and the scaled form neither over- nor
/// underflows. x ≥ 1 or large p: the continued fraction DLMF 8.19.17. Otherwise the order is
/// brought into [½, 3/2), where the pole of Γ at order 0 is divided out analytically, and raised
/// by p g(p+1, x) = 1 − x g(p, x) (DLMF 8.19.12), which damps errors by x/p.
///
/// Relative error below 1e-14 for p in [0, 4], x in [1e-8, 50].
#[must_use]
pub fn scaled_exponential_integral(p: f64, x: f64) -> f64 {
    if x >= 1.0 || p > 30.0 {
        return continued_fraction(p, x);
    }
    if p < 0.5 {
        return scaled(p, x, gamma_minus_lower(1.0 - p, x));
    }
    // The recurrence only climbs, so it starts from the order of [½, 3/2) that is p − an integer.
    let steps = (p - 0.5).floor();
    let base = p - steps;
    let start = scaled(base, x, gamma_near_pole(1.0 - base, x));
    (0..steps as u32).fold(start, |g, step| (1.0 - x * g) / (base + f64::from(step)))
}

/// eˣ x^{p−1} Γ(1−p, x).
fn scaled(p: f64, x: f64, upper_gamma: f64) -> f64 {
    x.exp() * x.powf(p - 1.0) * upper_gamma
}

/// g = 1/(x+p − 1·p/(x+p+2 − 2(p+1)/(x+p+4 − …))), by Lentz's method.
fn continued_fraction(p: f64, x: f64) -> f64 {
    const MAX_TERMS: u32 = 500;
    let mut b = x + p;
    let mut d = 1.0 / b;
    // The ratio of the first two numerators, 1 and 0: as good as infinite.
    let mut c = f64::MAX;
    let mut g = d;
    for k in (1..MAX_TERMS).map(f64::from) {
        let a = -k * (p + k - 1.0);
        b += 2.0;
        d = 1.0 / (b + a * d);
        c = b + a / c;
        let factor = c * d;
        g *= factor;
        if (factor - 1.0).abs() <= f64::EPSILON {
            break;
        }
    }
    g
}

/// Γ(a, x) = Γ(a) − γ(a, x) for a in (½, 1], x < 1, where the difference loses little.
fn gamma_minus_lower(a: f64, x: f64) -> f64 {
    libm::tgamma(a) - x.powf(a) * (1.0 / a + lower_series_tail(a, x))
}

/// Γ(a, x) for |a| ≤ ½, x < 1, with the pole of Γ at a = 0 divided out:
///
/// Γ(a, x) = [(Γ(1+a) − 1) − (x^a − 1)]/a − x^a Σ_{k≥1} (−x)^k/((a+k) k!).
fn gamma_near_pole(a: f64, x: f64) -> f64 {
    let log_x = x.ln();
    let pole = if a == 0.0 {
        // The limit for a → 0: Γ′(1) = −γ, and (x^a − 1)/a → ln x.
        -EULER_GAMMA - log_x
    } else {
        // Γ(1+a) − 1 and x^a − 1 both vanish with a; as expm1 they keep their digits.
        ((ln_gamma_1p(a)).exp_m1() - (a * log_x).exp_m1()) / a
    };
    pole - x.powf(a) * lower_series_tail(a, x)
}

/// Σ_{k≥1} (−x)^k/((a+k) k!).
fn lower_series_tail(a: f64, x: f64) -> f64 {
    let mut power = 1.0;
    let mut sum = 0.0;
    // x < 1 here: 1/40! is far below rounding.
    for k in (1..40).map(f64::from) {
        power *= -x / k;
        sum += power / (a + k);
        if power.abs() < 1e-18 * sum.abs() {
            break;
        }
    }
    sum
}

/// The Euler–Mascheroni constant γ.
const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;

/// ln Γ(1+a) for |a| ≤ ½ to full *relative* accuracy at a → 0.
///
/// ln Γ(1+a) = −ln(1+a) + (1−γ)a + Σ_{k≥2} (ζ(k)−1)(−a)^k/k   (DLMF 5.7.3)
fn ln_gamma_1p(a: f64) -> f64 {
    // With |a| ≤ ½ the first term that the table lacks is below 1e-20.
    let mut power = -a;
    let mut sum = 0.0;
    for (k, zeta_minus_1) in (2..).map(f64::from).zip(ZETA_MINUS_1) {
        power *= -a;
        sum += zeta_minus_1 * power / k;
    }
    (1.0 - EULER_GAMMA) * a - a.ln_1p() + sum
}

/// ζ(k) − 1 for k = 2, 3, … (DLMF table 25.2).
const ZETA_MINUS_1: [f64; 29] = [
    0.6449340668482264,
    0.2020569031595943,
    0.08232323371113819,
    0.03692775514336993,
    0.01734306198444914,
    0.008349277381922827,
    0.00407735619794434,
    0.0020083928260822143,
    0.0009945751278180853,
    0.0004941886041194645,
    0.0002460865533080483,
    0.00012271334757848915,
    6.124813505870483e-05,
    3.058823630702049e-05,
    1.528225940865187e-05,
    7.637197637899763e-06,
    3.81729326499984e-06,
    1.908212716553939e-06,
    9.539620338727962e-07,
    4.769329867878064e-07,
    2.38450502727733e-07,
    1.1921992596531106e-07,
    5.960818905125948e-08,
    2.980350351465228e-08,
    1.4901554828365043e-08,
    7.45071178983543e-09,
    3.725334024788457e-09,
    1.862659723513049e-09,
    9.313274324196682e-10,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_closed_forms() {
        for x in [1e-8, 1e-3, 0.3, 0.999, 1.0, 7.0, 50.0] {
            let g0 = scaled_exponential_integral(0.0, x);
            assert!((g0 * x - 1.0).abs() < 1e-14, "E_0 = e^-x/x at {x}: {g0}");
            let g_half = scaled_exponential_integral(0.5, x);
            let expected = {
                use crate::math::RealErrorFunctions as _;
                (std::f64::consts::PI / x).sqrt() * x.sqrt().erfcx()
            };
            assert!((g_half / expected - 1.0).abs() < 1e-14, "E_1/2 at {x}");
        }
    }

    #[test]
    fn the_recurrence_holds_across_every_branch() {
        for x in [1e-8, 1e-4, 0.1, 0.9, 1.1, 20.0] {
            for p in [1e-9, 0.2, 0.4999, 0.5001, 1.0, 1.0 + 1e-12, 1.0 - 1e-7, 1.4999, 2.6, 3.9] {
                let g = scaled_exponential_integral(p, x);
                let next = scaled_exponential_integral(p + 1.0, x);
                let left = p * next + x * g;
                assert!((left - 1.0).abs() < 3e-14, "p {p} x {x}: {left}");
            }
        }
    }
}
