/** What a squared weight costs: keeps alike kernels from fighting. */
const RIDGE = 1e-3;

/**
 * The weights w of Σ w = 1 that minimise Σ weight (target − Σ w values)² + λ |w|² over samples of
 * `count` values, by Lagrange's multiplier.
 */
export function constrainedWeights(samples, count) {
  const rows = Array.from({length: count}, () => new Array(count + 2).fill(0));
  for (const {values, target, weight} of samples) {
    for (let i = 0; i < count; i++) {
      const scaled = weight * values[i];
      if (scaled === 0) continue;
      for (let j = 0; j < count; j++) rows[i][j] += scaled * values[j];
      rows[i][count + 1] += scaled * target;
    }
  }
  rows.forEach((row, i) => {
    row[i] += RIDGE;
    row[count] = 1;
  });
  rows.push([...new Array(count).fill(1), 0, 1]);
  return eliminate(rows).slice(0, count);
}

/** The solution of a linear system whose rows end with the right-hand side (partial pivoting). */
function eliminate(rows) {
  const n = rows.length;
  for (let k = 0; k < n; k++) {
    let pivot = k;
    for (let i = k + 1; i < n; i++) if (Math.abs(rows[i][k]) > Math.abs(rows[pivot][k])) pivot = i;
    [rows[k], rows[pivot]] = [rows[pivot], rows[k]];
    for (let i = k + 1; i < n; i++) {
      const factor = rows[i][k] / rows[k][k];
      for (let j = k; j <= n; j++) rows[i][j] -= factor * rows[k][j];
    }
  }
  const solution = new Array(n);
  for (let k = n - 1; k >= 0; k--) {
    let sum = rows[k][n];
    for (let j = k + 1; j < n; j++) sum -= rows[k][j] * solution[j];
    solution[k] = sum / rows[k][k];
  }
  return solution;
}
