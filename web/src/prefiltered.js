// The lobes that three.js's prefiltered maps are averaged with: GGX seen along its normal, times cos.

import {gaussLegendre} from './quadrature.js';

/** Roughnesses of the mip levels of a map of 256² faces; a mirror first. */
export const LEVELS = [0, 1, 2, 3, 4, 5].map(level => 1 - Math.sqrt(1 - level / 5));

/** What a texel of the mirror level is taken for: a lobe about as wide. */
const SHARPEST = 0.05;

const RADII = gaussLegendre(12);
const AZIMUTHS = 8;

/**
 * k(δ) ∝ cosδ/(1 + α² + (α² − 1) cosδ)², ∫ k dω = 1, and points of a quadrature of it: x along the
 * tangent, z along the lobe's direction, standing for both signs of y.
 */
class PrefilteredLobe {
  constructor(roughness) {
    this.alpha2 = Math.max(roughness, SHARPEST) ** 4;
    const rule = RADII.map(({x: u, w}) => ({cos: this.cosine(u), w}))
      .filter(({cos}) => cos > 0);
    const total = rule.reduce((sum, {cos, w}) => sum + w * cos, 0);
    this.nodes = rule.flatMap(({cos, w}) => Array.from({length: AZIMUTHS}, (_, k) => {
      const phi = Math.PI * (k + 0.5) / AZIMUTHS;
      const sin = Math.sqrt(1 - cos * cos);
      return {x: sin * Math.cos(phi), z: cos, w: w * cos / total / AZIMUTHS};
    }));
    this.scale = this.alpha2 / (Math.PI * this.energy());
  }

  /** cosδ of the reflection about a half vector drawn from GGX. */
  cosine(u) {
    return (1 - u - this.alpha2 * u) / (1 - u + this.alpha2 * u);
  }

  /** ∫ cosδ of that density over the hemisphere. */
  energy() {
    const end = 1 / (1 + this.alpha2);
    return FINE.reduce((sum, {x, w}) => sum + w * end * this.cosine(end * x), 0);
  }

  /** k at cosδ. */
  eval(cos) {
    if (cos <= 0) return 0;
    const d = 1 + this.alpha2 + (this.alpha2 - 1) * cos;
    return this.scale * cos / (d * d);
  }
}

const FINE = gaussLegendre(96);

export const LOBES = LEVELS.map(roughness => new PrefilteredLobe(roughness));

/** A lobe's points about the direction at `angle` from the normal. */
export function pointsAbout(lobe, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return lobe.nodes.map(({x, z, w}) => ({x: c * x + s * z, z: c * z - s * x, weight: w}));
}
