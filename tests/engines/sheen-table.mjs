// The directional albedo of the Khronos viewer's sheen: its package leaves out the picture lut_sheen_E.png.
import { crc32, deflateSync } from "node:zlib";

const SIZE = 64, STEPS = 64;

function lambda(cos, alpha) {
  const t = (1 - alpha) ** 2, mix = (x, y) => x + (y - x) * t;
  const curve = (x) => mix(21.5473, 25.3245) / (1 + mix(3.82987, 3.32435) * x ** mix(0.19823, 0.16801)) + mix(-1.9776, -1.27393) * x + mix(-4.32054, -4.85967);
  return Math.exp(cos < 0.5 ? curve(cos) : 2 * curve(0.5) - curve(1 - cos));
}

function albedo(o, roughness) {
  const alpha = Math.max(roughness, 1e-6) ** 2, so = Math.sqrt(1 - o * o);
  let sum = 0;
  for (let a = 0; a < STEPS; a++) {
    const i = (a + 0.5) / STEPS, si = Math.sqrt(1 - i * i);
    const visible = Math.min(1, 1 / ((1 + lambda(o, alpha) + lambda(i, alpha)) * 4 * i * o));
    for (let b = 0; b < STEPS; b++) {
      const phi = (Math.PI * (b + 0.5)) / STEPS, x = si * Math.cos(phi) + so, y = si * Math.sin(phi), z = i + o;
      const sin2 = 1 - (z * z) / (x * x + y * y + z * z);
      sum += ((2 + 1 / alpha) * sin2 ** (0.5 / alpha) * visible * i) / (2 * Math.PI);
    }
  }
  return (2 * Math.PI * sum) / STEPS ** 2;
}

function chunk(type, data) {
  const body = Buffer.concat([Buffer.from(type), data]), out = Buffer.alloc(body.length + 8);
  out.writeUInt32BE(data.length, 0);
  body.copy(out, 4);
  out.writeUInt32BE(crc32(body), body.length + 4);
  return out;
}

/** A PNG of 64 by 64 greys: columns cosθo, rows roughness, texel centres. */
export function sheenTable() {
  const rows = Buffer.alloc(SIZE * (SIZE + 1));
  for (let r = 0; r < SIZE; r++)
    for (let o = 0; o < SIZE; o++) rows[r * (SIZE + 1) + 1 + o] = Math.round(255 * Math.min(1, albedo((o + 0.5) / SIZE, (r + 0.5) / SIZE)));
  const head = Buffer.alloc(13);
  head.writeUInt32BE(SIZE, 0);
  head.writeUInt32BE(SIZE, 4);
  head.set([8, 0, 0, 0, 0], 8);
  return Buffer.concat([Buffer.from([137, 80, 78, 71, 13, 10, 26, 10]), chunk("IHDR", head), chunk("IDAT", deflateSync(rows)), chunk("IEND", Buffer.alloc(0))]);
}
