/** What a squared weight costs, as a share of the target's norm: keeps alike kernels from fighting. */
const RIDGE = 3e-4;

/**
 * The weights w of Σ w = 1 that minimise wᵀ G w − 2 tᵀ w + λ |w|², by Lagrange's multiplier; G is the
 * Gram matrix of the kernels, t their products with the target, whose product with itself is `norm`.
 */
export function solveConstrained(gram, target, norm) {
  const n = target.length;
  const sharpest = gram.reduce((most, row, k) => Math.max(most, row[k]), 0);
  const ridge = RIDGE * Math.min(norm, sharpest);
  const rows = gram.map((row, i) => [...row.map((value, j) => value + (i === j ? ridge : 0)), 1, target[i]]);
  rows.push([...new Array(n).fill(1), 0, 1]);
  return eliminate(rows).slice(0, n);
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
