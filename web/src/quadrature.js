// Gauss–Legendre rules and Chebyshev polynomials.

/** Nodes x and weights w of the rule of `count` points over [0, 1], by Newton's method. */
export function gaussLegendre(count) {
  return Array.from({length: count}, (_, k) => {
    let x = Math.cos(Math.PI * (k + 0.75) / (count + 0.5));
    let slope = 1;
    for (let step = 0; step < 12; step++) {
      const [value, previous] = legendre(count, x);
      slope = count * (previous - x * value) / (1 - x * x);
      x -= value / slope;
    }
    return {x: 0.5 * (1 + x), w: 1 / ((1 - x * x) * slope * slope)};
  });
}

/** P_n(x) and P_{n−1}(x). */
function legendre(n, x) {
  let [value, previous] = [x, 1];
  for (let k = 2; k <= n; k++) {
    [value, previous] = [((2 * k - 1) * x * value - (k - 1) * previous) / k, value];
  }
  return [value, previous];
}

const PANEL = gaussLegendre(16);

/** ∫ f over [low, high] in `panels` equal panels of 16 points. */
export function integrate(f, low, high, panels) {
  const width = (high - low) / panels;
  let sum = 0;
  for (let panel = 0; panel < panels; panel++) {
    for (const {x, w} of PANEL) sum += w * f(low + (panel + x) * width);
  }
  return sum * width;
}

/** The `count` power coefficients of the polynomial through f at the Chebyshev points of [−1, 1]. */
export function chebyshevPowers(f, count) {
  const angles = Array.from({length: count}, (_, k) => Math.PI * (k + 0.5) / count);
  const values = angles.map(angle => f(Math.cos(angle)));
  const series = Array.from({length: count}, (_, n) =>
    values.reduce((sum, value, k) => sum + value * Math.cos(n * angles[k]), 0) * (n ? 2 : 1) / count);
  return powers(series);
}

/** Σ series[n] T_n(t) as powers of t. */
function powers(series) {
  const count = series.length;
  const result = new Array(count).fill(0);
  let [current, previous] = [[1], [0]];
  for (let n = 0; n < count; n++) {
    current.forEach((a, k) => { result[k] += series[n] * a; });
    const next = [0, ...current.map(a => (n ? 2 : 1) * a)];
    if (n) previous.forEach((a, k) => { next[k] -= a; });
    [current, previous] = [next, current];
  }
  return result;
}

/** Σ coefficients[k] t^k. */
export function polynomial(coefficients, t) {
  let sum = 0;
  for (let k = coefficients.length - 1; k >= 0; k--) sum = sum * t + coefficients[k];
  return sum;
}
