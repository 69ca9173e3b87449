/** Three digits that count, as short as they get. */
export function short(x) {
  if (x === 0) return '0';
  const size = Math.abs(x);
  return size >= 1e-3 && size < 1e5 ? String(Number(x.toPrecision(3))) : x.toExponential(1).replace('e-', 'e−').replace('e+', 'e');
}

/** Degrees, with a true minus. */
export const degrees = x => `${Math.round(x)}°`.replace('-', '−');
