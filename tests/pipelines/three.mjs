// node three.mjs IN.glb OUT.glb [custom]: a scene through three.js.
import { readFileSync, writeFileSync } from "node:fs";
import { GLTFExporter } from "three/addons/exporters/GLTFExporter.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const [input, output, custom] = process.argv.slice(2);

// Of the browser's, the exporter needs this alone.
globalThis.FileReader = class {
  async readAsArrayBuffer(blob) {
    this.result = await blob.arrayBuffer();
    this.onloadend();
  }
};

console.warn = () => {};
const bytes = readFileSync(input);
const { scene } = await new GLTFLoader().parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), "");
const glb = await new GLTFExporter().parseAsync(scene, { binary: true, includeCustomExtensions: custom === "custom" });
writeFileSync(output, Buffer.from(glb));
