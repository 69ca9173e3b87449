// Colours as sgdbake shows and compares them.

/** The luminance that the tone curve shows as white. */
const WHITE = 4;

/** c (1 + Y/Y_white²)/(1 + Y), clipped to [0, 1] (Reinhard et al. 2002). */
export function toneMap([r, g, b]) {
  const y = Math.max(0.212639 * r + 0.715169 * g + 0.072192 * b, 0);
  const scale = (1 + y / (WHITE * WHITE)) / (1 + y);
  return [r, g, b].map(c => Math.min(Math.max(c * scale, 0), 1));
}

/** CIE Lab (D65, 2° observer) of a scene colour after the tone curve. */
export function lab(rgb) {
  const [r, g, b] = toneMap(rgb);
  const x = (0.4124564 * r + 0.3575761 * g + 0.1804375 * b) / 0.95047;
  const y = 0.2126729 * r + 0.7151522 * g + 0.0721750 * b;
  const z = (0.0193339 * r + 0.1191920 * g + 0.9503041 * b) / 1.08883;
  const [fx, fy, fz] = [x, y, z].map(t => (t > 216 / 24389 ? Math.cbrt(t) : (t * 24389 / 27 + 16) / 116));
  return [116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)];
}

const DEGREE = Math.PI / 180;

/** ΔE2000 of two Lab colours (Sharma, Wu and Dalal 2005). */
export function labDifference([l1, a1, b1], [l2, a2, b2]) {
  const pow7 = x => x ** 7;
  const chroma = (Math.hypot(a1, b1) + Math.hypot(a2, b2)) / 2;
  const g = 0.5 * (1 - Math.sqrt(pow7(chroma) / (pow7(chroma) + pow7(25))));
  const [x1, x2] = [a1 * (1 + g), a2 * (1 + g)];
  const [c1, c2] = [Math.hypot(x1, b1), Math.hypot(x2, b2)];
  const hue = (x, b) => (x === 0 && b === 0 ? 0 : (Math.atan2(b, x) / DEGREE + 360) % 360);
  const [h1, h2] = [hue(x1, b1), hue(x2, b2)];
  const grey = c1 * c2 === 0;
  let turn = grey ? 0 : h2 - h1;
  if (turn > 180) turn -= 360;
  if (turn < -180) turn += 360;
  let h = grey ? h1 + h2 : (h1 + h2) / 2;
  if (!grey && Math.abs(h1 - h2) > 180) h += h1 + h2 < 360 ? 180 : -180;
  const [l, c] = [(l1 + l2) / 2, (c1 + c2) / 2];
  const cos = degrees => Math.cos(degrees * DEGREE);
  const t = 1 - 0.17 * cos(h - 30) + 0.24 * cos(2 * h) + 0.32 * cos(3 * h + 6) - 0.2 * cos(4 * h - 63);
  const lightness = (l2 - l1) / (1 + 0.015 * (l - 50) ** 2 / Math.sqrt(20 + (l - 50) ** 2));
  const saturation = (c2 - c1) / (1 + 0.045 * c);
  const hueDifference = 2 * Math.sqrt(c1 * c2) * Math.sin(turn / 2 * DEGREE) / (1 + 0.015 * c * t);
  const rotation = -Math.sin(60 * DEGREE * Math.exp(-(((h - 275) / 25) ** 2)))
    * 2 * Math.sqrt(pow7(c) / (pow7(c) + pow7(25)));
  return Math.sqrt(lightness ** 2 + saturation ** 2 + hueDifference ** 2 + rotation * saturation * hueDifference);
}

/** ΔE2000 of two scene colours as displayed; about 1 is just noticeable side by side. */
export const deltaE2000 = (a, b) => labDifference(lab(a), lab(b));
