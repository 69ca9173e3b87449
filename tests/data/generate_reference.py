#!/usr/bin/env python3
"""Writes shape-reference.csv: what no catalogue holds, computed with 40 digits.

    python3 generate_reference.py > shape-reference.csv

Needs mpmath. For shapes (alpha, p) over the accepted range and cotangents of theta on every scale
of the distribution:

    scaled_e = e^x E_p(x) at x = alpha, with Gamma(1-p, x) = x^(1-p) e^-x scaled_e
    ndf      = D at tan(theta_h) = cot (only a convenient argument), pi D = K e^-t t^-p (1+x)^2
    lambda   = (2/c) Int_0^inf s P22(c^2+s^2)/pi (s - c atan(s/c)) ds,  the radial integral
    g1       = 1/(1+lambda)
"""

from mpmath import atan, exp, expint, mp, mpf, nstr, pi, quad, sqrt

mp.dps = 40

ALPHAS = ["1e-8", "1.6e-5", "1e-3", "0.03", "0.5", "5", "50", "100"]
PS = ["0", "4.6e-15", "1e-6", "0.3", "0.9999999", "0.999999999999", "1", "1.000000000001",
      "1.0000001", "1.78", "2.5", "4", "10"]


def double(x):
    """The f64 nearest to x, exactly: what the tested code is given."""
    return mpf(float(x))


def slope_density(x, alpha, p, e):
    """P22(x)/pi = e^(-x/alpha) (1 + x/alpha^2)^-p / (pi alpha^2 e)."""
    return exp(-x / alpha) * (1 + x / alpha**2) ** -p / (pi * alpha**2 * e)


def smith_lambda(c, alpha, p, e):
    end = sqrt(110 * alpha)
    scales = sorted({s for s in (c / 10, c, 10 * c, alpha / 3, alpha, 3 * alpha, 10 * alpha, 100 * alpha,
                                 sqrt(alpha) / 30, sqrt(alpha) / 6, sqrt(alpha), end / 3) if s < end})

    def integrand(s):
        # The difference cancels below 40 digits where s is far below c: its series instead.
        z = s / c
        rise = s * (z**2 / 3 - z**4 / 5 + z**6 / 7) if z < mpf(10) ** -6 else s - c * atan(z)
        return s * slope_density(c * c + s * s, alpha, p, e) * rise

    return 2 / c * quad(integrand, [mpf(0), *scales, end])


print("alpha,p,scaled_e,cot_theta,ndf,lambda,g1")
for alpha_text in ALPHAS:
    for p_text in PS:
        alpha, p = double(alpha_text), double(p_text)
        e = exp(alpha) * expint(p, alpha)
        for cot in [alpha * mpf("0.1"), alpha, *(sqrt(alpha) * mpf(a) for a in ("0.01", "0.3", "1", "2.5"))]:
            cot = double(cot)
            x = double(cot * cot)
            ndf = slope_density(x, alpha, p, e) * (1 + x) ** 2
            lam = smith_lambda(cot, alpha, p, e)
            row = [nstr(e, 25), repr(float(cot)), nstr(ndf, 25), nstr(lam, 25), nstr(1 / (1 + lam), 25)]
            print(",".join([alpha_text, p_text, *row]), flush=True)
