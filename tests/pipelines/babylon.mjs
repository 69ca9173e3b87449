// node babylon.mjs IN.glb OUT.glb: a scene through Babylon.js.
import { readFileSync, writeFileSync } from "node:fs";
import { NullEngine } from "@babylonjs/core/Engines/nullEngine.js";
import { LoadSceneAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { Logger } from "@babylonjs/core/Misc/logger.js";
import "@babylonjs/core/Materials/PBR/pbrMaterial.js";
import "@babylonjs/loaders/glTF/index.js";
import { GLTF2Export } from "@babylonjs/serializers/glTF/index.js";

const [input, output] = process.argv.slice(2);
Logger.LogLevels = Logger.NoneLogLevel;
const scene = await LoadSceneAsync(new Uint8Array(readFileSync(input)), new NullEngine(), { pluginExtension: ".glb" });
const { files } = await GLTF2Export.GLBAsync(scene, "out");
writeFileSync(output, Buffer.from(await files["out.glb"].arrayBuffer()));
process.exit(0);
