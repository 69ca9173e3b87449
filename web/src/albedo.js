// The directional albedo of a lobe, in the three moments that its Fresnel factor needs.

import {LARGEST_DECAY} from './distribution.js';
import {gaussLegendre} from './quadrature.js';

const RADIAL = gaussLegendre(24);
const AZIMUTHS = 20;
const COS2 = Array.from({length: AZIMUTHS}, (_, k) => Math.cos(Math.PI / 2 * (k + 0.5) / AZIMUTHS) ** 2);

/**
 * Points wi of a quadrature of what a lobe without Fresnel factor reflects to wo = (−sinθo, 0, cosθo):
 *
 *     D(h) G1(wi) G1(wo)/(4 cosθi cosθo) · cosθi dωi
 *
 * each with `x` and `z`, the parts of wi along the tangent away from wo and along the normal, cosθd
 * and its `weight`; together they weigh the albedo. The points stand for both signs of y.
 *
 * Over half vectors of slope a and azimuth φ from wo, dωi = 4 (wo·h) dωh; a circle of half vectors
 * is lit for cosφ > cotθo (a² − 1)/(2a), and halved as cosφ = 1 − 2q sin²ψ, q its lit share.
 */
export function reflectedPoints(lobe, cosO) {
  const {alpha} = lobe.distribution;
  const alpha2 = alpha * alpha;
  const sinO = Math.sqrt((1 - cosO) * (1 + cosO));
  const visibilityO = lobe.masking.visibility(cosO);
  const toV = slope => Math.log1p(Math.min(slope * slope, LARGEST_DECAY * alpha) / alpha2);
  const whole = toV(cosO / (1 + sinO));
  const none = toV((1 + sinO) / cosO);
  const points = [];
  for (const [low, high] of [[0, whole], [whole, none]]) {
    if (!(low < high)) continue;
    for (const {x: node, w} of RADIAL) {
      const v = low + (high - low) * node;
      const x = alpha2 * Math.expm1(v);
      const dx = alpha2 * Math.exp(v) * (high - low) * w;
      const mass = lobe.distribution.slopeDensity(x) * dx * visibilityO * Math.PI / AZIMUTHS;
      addRing(points, lobe.masking, Math.sqrt(x), cosO, sinO, mass);
    }
  }
  return points;
}

/** The points whose half vectors have one slope. */
function addRing(points, masking, slope, cosO, sinO, mass) {
  const length2 = 1 + slope * slope;
  const length = Math.sqrt(length2);
  const diameter = 4 * slope * sinO;
  const lowest = cosO * (1 - slope * slope) - diameter / 2;
  const base = Math.max(lowest, 0);
  const lit = lowest < 0 ? 1 + lowest / diameter : 1;
  for (const cos2 of COS2) {
    const z = Math.min((base + diameter * lit * cos2) / length2, 1);
    const dPhi = Math.sqrt(lit * cos2 / (1 - lit + lit * cos2));
    const cosD = Math.min(0.5 * length * (z + cosO), 1);
    // wi = 2 (wo·h) h − wo
    const x = sinO - 2 * cosD * slope / length * (1 - 2 * lit * (1 - cos2));
    const weight = mass * length * dPhi * masking.visibility(z) * z * cosD;
    points.push({x, z, cosD, weight});
  }
}

/** The albedo for F = 1, (1 − cosθd)⁵ and cosθd; the specular scale is 4ρs/π. */
export function albedoMoments(points) {
  const moments = [0, 0, 0];
  for (const {cosD, weight} of points) {
    moments[0] += weight;
    moments[1] += weight * (1 - cosD) ** 5;
    moments[2] += weight * cosD;
  }
  return moments;
}
