// The Shifted Gamma Distribution of normals and its Smith masking.

import {chebyshevPowers, integrate, polynomial} from './quadrature.js';

/** x/α beyond which e^{−x/α} no longer counts. */
export const LARGEST_DECAY = 45;

/** Panels of 16 points over the logarithm of a slope. */
const PANELS = 4;

/** Coefficients of a masking polynomial; the shader has room for so many. */
export const MASKING_TERMS = 16;

/** s as a multiple of lim cotθ/G1 at grazing: the polynomials are most accurate around here. */
const WIDTH = 3;

/**
 * D(θ) = P22(tan²θ)/(π cos⁴θ), P22(x) = K e^{−t} t^{−p}, t = α + x/α (Bagher, Soler and Holzschuch
 * 2012), written as P22(x)/π = D(0) e^{−x/α} (1 + x/α²)^{−p}.
 */
export class ShiftedGamma {
  constructor(alpha, p) {
    this.alpha = alpha;
    this.p = p;
    this.peak = 1 / (Math.PI * alpha * alpha * scaledExponentialIntegral(p, alpha));
  }

  /** D·cos⁴θ at x = tan²θ [1/sr]. */
  slopeDensity(x) {
    const {alpha, p, peak} = this;
    return peak * Math.exp(-x / alpha - p * Math.log1p(x / alpha / alpha));
  }

  /**
   * c·Λ(c) of Smith's Λ at c = cotθ:
   *
   *     c Λ = 2 ∫_0^∞ r · P22(c² + r²)/π · [r − c·atan(r/c)] dr
   *
   * over v = ln(1 + r²/α²), in which P22 is smooth on every scale, and over √v, as r grows with it.
   * Finite at c = 0.
   */
  slopeTimesLambda(c) {
    const alpha2 = this.alpha * this.alpha;
    const end = Math.sqrt(Math.log1p(LARGEST_DECAY / this.alpha));
    return integrate(root => {
      const v = root * root;
      const r = this.alpha * Math.sqrt(Math.expm1(v));
      // r dr = ½ α² e^v dv, dv = 2 √v d√v
      return 2 * root * alpha2 * Math.exp(v) * this.slopeDensity(c * c + r * r) * excess(r, c);
    }, 0, end, PANELS);
  }

  /** G1 = 1/(1 + Λ) at cosθ in (0, 1]. */
  g1(cos) {
    const sin = Math.sqrt((1 - cos) * (1 + cos));
    return cos / (cos + sin * this.slopeTimesLambda(cos / sin));
  }
}

/** r − c·atan(r/c). */
function excess(r, c) {
  const ratio = r / c;
  if (!(ratio < 0.03)) return r - c * Math.atan(ratio);
  const square = ratio * ratio;
  return r * square * (1 / 3 - square * (1 / 5 - square * (1 / 7 - square / 9)));
}

/** eᵅ E_p(α) = ∫_0^∞ e^{−αu} (1 + u)^{−p} du. */
function scaledExponentialIntegral(p, alpha) {
  const end = Math.log1p(LARGEST_DECAY / alpha);
  return integrate(v => Math.exp(v * (1 - p) - alpha * Math.expm1(v)), 0, end, PANELS);
}

/**
 * G1/cosθ as a polynomial: with c = cosθ and u = c/(c + s), (G1/c)·(c + s) is smooth in u from the
 * horizon to the zenith. t = stretch·u − 1 lies in [−1, 1].
 */
export class Masking {
  constructor(distribution) {
    this.scale = WIDTH * distribution.slopeTimesLambda(0);
    this.stretch = 2 * (1 + this.scale);
    this.coefficients = chebyshevPowers(t => {
      const cos = this.cosine(t);
      return distribution.g1(cos) * (cos + this.scale) / cos;
    }, MASKING_TERMS);
  }

  /** cosθ at the polynomial's coordinate t. */
  cosine(t) {
    const u = (t + 1) / this.stretch;
    return Math.min(Math.max(this.scale * u / (1 - u), 1e-12 * this.scale), 1);
  }

  /** G1/cosθ, finite at grazing. */
  visibility(cos) {
    const length = cos + this.scale;
    return polynomial(this.coefficients, this.stretch * cos / length - 1) / length;
  }
}
