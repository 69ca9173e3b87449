// A .glb's JSON and BIN chunk.
import { readFileSync } from "node:fs";

export function open(path) {
  const bytes = readFileSync(path);
  const length = bytes.readUInt32LE(12);
  const bin = bytes.subarray(20 + length + 8);
  return { json: JSON.parse(bytes.toString("utf8", 20, 20 + length)), bin };
}

/** The bytes of a buffer view of the first buffer; null where there is none. */
export function view({ json, bin }, index) {
  const { buffer, byteOffset = 0, byteLength } = json.bufferViews?.[index] ?? {};
  return buffer === 0 ? bin.subarray(byteOffset, byteOffset + byteLength) : null;
}
