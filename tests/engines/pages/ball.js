// A ball as the comparison sees it: one flat patch of two by two pixels per pixel of the picture, with the ball's
// normal at the pixel's centre. All directions are exact, and screen derivatives of the normal are 0, so that no
// engine widens the lobe for antialiasing.

export const PATCH = 2; // pixels across: derivatives are taken over blocks of two by two
export const DISTANCE = 20000; // of the camera: engines without a case for parallel views take the direction to it

/** Positions, normals and indices of a ball `size` patches wide, radius 1, seen along -z. */
function patches(size) {
  const positions = [], normals = [], indices = [];
  for (let row = 0; row < size; row++) {
    for (let column = 0; column < size; column++) {
      const x = ((column + 0.5) / size) * 2 - 1, y = ((row + 0.5) / size) * 2 - 1;
      if (x * x + y * y >= 1) continue;
      const first = positions.length / 3, half = 1 / size;
      for (const [dx, dy] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
        positions.push(x + dx * half, y + dy * half, 0);
        normals.push(x, y, Math.sqrt(1 - x * x - y * y));
      }
      indices.push(first, first + 1, first + 2, first, first + 2, first + 3);
    }
  }
  return { positions: new Float32Array(positions), normals: new Float32Array(normals), indices: new Uint32Array(indices) };
}

/** Rotation (x, y, z, w) that turns -z, the direction a light of the file shines to, away from a sun at `angle` to +z. */
function sunRotation(angle) {
  return [0, Math.sin(angle / 2), 0, Math.cos(angle / 2)];
}

/**
 * A .glb of the ball with one glTF material, a parallel camera and, if `sun` is given, a directional light of
 * irradiance pi at that angle [radians] from the view, towards +x.
 */
export function ballGlb(material, size, sun) {
  const { positions, normals, indices } = patches(size);
  const count = positions.length / 3;
  const json = {
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [0, 1] }],
    nodes: [{ mesh: 0 }, { camera: 0, translation: [0, 0, DISTANCE] }],
    cameras: [{ type: "orthographic", orthographic: { xmag: 1, ymag: 1, znear: DISTANCE - 10, zfar: DISTANCE + 10 } }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1 }, indices: 2, material: 0 }] }],
    materials: [material],
    accessors: [
      { bufferView: 0, componentType: 5126, count, type: "VEC3", min: [-1, -1, 0], max: [1, 1, 0] },
      { bufferView: 1, componentType: 5126, count, type: "VEC3" },
      { bufferView: 2, componentType: 5125, count: indices.length, type: "SCALAR" },
    ],
    bufferViews: [
      { buffer: 0, byteOffset: 0, byteLength: positions.byteLength },
      { buffer: 0, byteOffset: positions.byteLength, byteLength: normals.byteLength },
      { buffer: 0, byteOffset: 2 * positions.byteLength, byteLength: indices.byteLength },
    ],
    buffers: [{ byteLength: 2 * positions.byteLength + indices.byteLength }],
    extensionsUsed: Object.keys(material.extensions ?? {}),
  };
  if (sun !== undefined) {
    json.extensionsUsed.push("KHR_lights_punctual");
    json.extensions = { KHR_lights_punctual: { lights: [{ type: "directional", intensity: Math.PI }] } };
    json.scenes[0].nodes.push(2);
    json.nodes.push({ rotation: sunRotation(sun), extensions: { KHR_lights_punctual: { light: 0 } } });
  }
  if (!json.extensionsUsed.length) delete json.extensionsUsed;
  return pack(json, [positions, normals, indices]);
}

function pack(json, arrays) {
  let text = JSON.stringify(json);
  text = new TextEncoder().encode(text + " ".repeat((4 - (new TextEncoder().encode(text).length % 4)) % 4));
  const binary = arrays.reduce((sum, a) => sum + a.byteLength, 0);
  const glb = new Uint8Array(12 + 8 + text.length + 8 + binary), view = new DataView(glb.buffer);
  [0x46546c67, 2, glb.length, text.length, 0x4e4f534a].forEach((word, k) => view.setUint32(4 * k, word, true));
  glb.set(text, 20);
  view.setUint32(20 + text.length, binary, true);
  view.setUint32(24 + text.length, 0x004e4942, true);
  let at = 28 + text.length;
  for (const a of arrays) {
    glb.set(new Uint8Array(a.buffer), at);
    at += a.byteLength;
  }
  return glb.buffer;
}

/** r, g, b of one pixel of each patch, rows upwards, of RGBA floats read from a target of size · PATCH pixels. */
export function onePerPatch(rgba, size) {
  const out = new Float32Array(size * size * 3), width = size * PATCH;
  for (let row = 0; row < size; row++) {
    for (let column = 0; column < size; column++) {
      const from = 4 * (row * PATCH * width + column * PATCH), to = 3 * (row * size + column);
      for (let c = 0; c < 3; c++) out[to + c] = rgba[from + c];
    }
  }
  return out;
}
