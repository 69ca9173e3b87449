// A lobe as lobes of three.js's prefiltered environment maps.
//
// Towards every view direction the lobe is fitted by the maps' own lobes about three directions in the
// plane of incidence: its mean direction, at the levels that are about as wide, and one to each side,
// at the levels that are as wide as the lobe across the plane. The weights sum to 1; some are negative,
// as an exponential lobe is a heavy-tailed one less its tail.

import {albedoMoments, reflectedPoints} from './albedo.js';
import {constrainedWeights} from './least_squares.js';
import {LEVELS, LOBES, pointsAbout} from './prefiltered.js';

/** Directions of view that are tabulated, evenly in ln(1 + cosθo/s). */
export const VIEWS = 48;

/** The smallest s: a sharp lobe's masking has a smaller scale, but its Fresnel factor has not. */
const SMALLEST_SCALE = 0.05;

/** The scale s of a lobe's views. */
export const viewScale = masking => Math.max(masking.scale, SMALLEST_SCALE);

/** Rows of a lobe's table: the albedo's moments, then two for each of the three directions. */
export const ROWS = 7;

/** The steepest view whose mean direction has an angle to divide by; the quotient is even about 0. */
const STEEPEST = 1 - 1e-6;

/** How far the side directions are, in standard deviations of the lobe in the plane. */
const REACH = 0.9;

/**
 * The table of a lobe, RGBA of ROWS rows and VIEWS columns: the three moments and how far the side
 * directions are [rad]; then for each direction, in two rows, the weights of the six levels and `turn`, the
 * angle of the mean direction over that of the view.
 */
export function environmentTable(lobe) {
  const table = new Float32Array(4 * ROWS * VIEWS);
  for (let column = 0; column < VIEWS; column++) {
    const cosO = cosineAt(column / (VIEWS - 1), viewScale(lobe.masking));
    columnOf(lobe, cosO).forEach((texel, row) => table.set(texel, 4 * (row * VIEWS + column)));
  }
  return table;
}

function cosineAt(coordinate, scale) {
  const cos = scale * Math.expm1(coordinate * Math.log1p(1 / scale));
  return Math.min(Math.max(cos, 1e-6 * scale), STEEPEST);
}

function columnOf(lobe, cosO) {
  const points = reflectedPoints(lobe, cosO);
  const moments = albedoMoments(points);
  const shape = shapeOf(points, moments[0]);
  const reach = REACH * shape.inPlane;
  const weights = fittedWeights(lobe, cosO, points, moments[0], shape, reach);
  const turn = shape.angle / Math.acos(cosO);
  return [
    [...moments, reach],
    ...weights.flatMap(levels => [levels.slice(0, 4), [levels[4], levels[5], turn, 0]]),
  ];
}

/** Angle of the mean direction, and the lobe's standard deviations in and across the plane. */
function shapeOf(points, total) {
  let [x, z] = [0, 0];
  for (const point of points) {
    x += point.weight * point.x;
    z += point.weight * point.z;
  }
  const angle = Math.atan2(x, z);
  let [inPlane, across] = [0, 0];
  for (const point of points) {
    inPlane += point.weight * wrapped(Math.atan2(point.x, point.z) - angle) ** 2;
    across += point.weight * Math.max(1 - point.x * point.x - point.z * point.z, 0);
  }
  return {angle, length: Math.hypot(x, z) / total, inPlane: Math.sqrt(inPlane / total), across: across / total};
}

const wrapped = angle => angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));

/** Six weights for each of the three directions: ahead, further from the normal, nearer to it. */
function fittedWeights(lobe, cosO, points, albedo, shape, reach) {
  const kernels = kernelsFor(shape, reach);
  const density = densityOf(lobe, cosO, albedo);
  const solution = constrainedWeights(samples(kernels, density, points, albedo), kernels.length);
  const weights = [0, 1, 2].map(() => new Array(LOBES.length).fill(0));
  kernels.forEach(({level, direction}, k) => { weights[direction][level] = solution[k]; });
  return weights;
}

/**
 * The lobes' values over a quadrature of the sphere, the union of the kernels' points and the lobe's
 * own: `values` of the kernels, the `target` and the `weight` of a squared difference there.
 *
 * With ρ the mean of all their densities, a point weighs its own quadrature's weight over ρ (Veach's
 * balance heuristic), and a difference counts in relation to ρ: ∫ (q − m)²/ρ dω ≥ (∫ |q − m| dω)².
 */
function samples(kernels, density, points, albedo) {
  const count = kernels.length + 1;
  const sampled = [
    ...points.map(({x, z, weight}) => ({x, z, weight: weight / albedo})),
    ...kernels.flatMap(({lobe, angle}) => pointsAbout(lobe, angle)),
  ];
  return sampled.map(({x, z, weight}) => {
    const values = kernels.map(kernel => kernel.lobe.eval(x * kernel.x + z * kernel.z));
    const target = density(x, z);
    const mean = values.reduce((sum, value) => sum + value, target) / count;
    return {values, target, weight: weight / (count * mean * mean)};
  });
}

/** The prefiltered lobes that are fitted: levels about as wide as the lobe ahead, as wide as it is across aside. */
function kernelsFor(shape, reach) {
  const [level, across] = [levelOf(shape.length), levelOf(1 - shape.across)];
  const first = Math.max(level - 2, 0);
  const ahead = LOBES.map((_, k) => k).filter(k => k >= first && k <= level + 2);
  const place = (k, direction, angle) =>
    ({level: k, direction, angle, lobe: LOBES[k], x: Math.sin(angle), z: Math.cos(angle)});
  return [
    ...ahead.map(k => place(k, 0, shape.angle)),
    ...[across, across + 1].map(k => place(k, 1, shape.angle + reach)),
    ...[across, across + 1].map(k => place(k, 2, shape.angle - reach)),
  ];
}

/** Mean resultant length of each level's lobe. */
const LENGTHS = LOBES.map(({nodes}) => nodes.reduce((sum, {z, w}) => sum + z * w, 0));

/** The last level whose lobe is no wider than one of this mean resultant length; at most the last but one. */
function levelOf(length) {
  const wider = LENGTHS.findIndex(tabulated => tabulated < length);
  return Math.min(Math.max(wider < 0 ? LOBES.length : wider, 1), LOBES.length - 1) - 1;
}

/** The roughness of the prefiltered lobe of the mean resultant length that a lobe has seen along its normal. */
export function roughnessOf(lobe) {
  const points = reflectedPoints(lobe, STEEPEST);
  const {length} = shapeOf(points, albedoMoments(points)[0]);
  const level = levelOf(length);
  const within = (LENGTHS[level] - length) / (LENGTHS[level] - LENGTHS[level + 1]);
  const clamped = Math.min(Math.max(within, 0), 1);
  return LEVELS[level] + clamped * (LEVELS[level + 1] - LEVELS[level]);
}

/** The reflected lobe's density [1/sr] at a wi of the given x and z, normalised. */
function densityOf(lobe, cosO, albedo) {
  const sinO = Math.sqrt((1 - cosO) * (1 + cosO));
  const visibilityO = lobe.masking.visibility(cosO);
  return (x, z) => {
    if (z <= 0) return 0;
    // h = wi + wo, |h|² = 2 + 2 wi·wo
    const along = z + cosO;
    const slope2 = Math.max((2 + 2 * (z * cosO - x * sinO)) / (along * along) - 1, 0);
    const ndf = lobe.distribution.slopeDensity(slope2) * (1 + slope2) ** 2;
    return ndf * lobe.masking.visibility(z) * visibilityO * z / (4 * albedo);
  };
}
