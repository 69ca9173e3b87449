// The Khronos sample viewer, with its own define for linear output.
import { GltfView, GltfState } from "@khronosgroup/gltf-viewer";
import { ballGlb, onePerPatch, PATCH } from "./ball.js";
import { floatCanvas } from "./canvas.js";

let view, loader, canvas, size, lit, environment, turn;

export async function init(options) {
  size = options.size;
  turn = (options.turn * 180) / Math.PI;
  canvas = floatCanvas(size * PATCH);
  const source = canvas.gl.shaderSource.bind(canvas.gl);
  canvas.gl.shaderSource = (shader, text) => source(shader, text.replace(/(#version.*\n)/, "$1#define LINEAR_OUTPUT 1\n"));
  view = new GltfView(canvas.gl);
  loader = view.createResourceLoader(undefined, undefined, "/khronos-libs/");
  lit = Boolean(options.environment);
  environment = await loader.loadEnvironment(options.environment ?? darkPanorama(), { lut_sheen_E_file: "/lut_sheen_E.png" });
  return "Khronos glTF Sample Viewer 1.1.0";
}

/** The ball under a sun at each angle [radians], then under the environment if there is one. */
export async function draw(material, suns) {
  const pictures = [];
  for (const angle of suns) pictures.push(await picture(ballGlb(material, size, angle), true));
  if (lit) pictures.push(await picture(ballGlb(material, size), false));
  return pictures;
}

async function picture(glb, sun) {
  const state = view.createState();
  state.gltf = await loader.loadGltf(glb);
  state.sceneIndex = 0;
  state.cameraIndex = 0;
  state.environment = environment;
  Object.assign(state.renderingParameters, {
    usePunctual: sun, useIBL: !sun, toneMap: GltfState.ToneMaps.NONE, exposure: 1,
    environmentRotation: turn, renderEnvironmentMap: false, clearColor: [0, 0, 0, 0], useDirectionalLightsWithDisabledIBL: false,
  });
  view.renderFrame(state, canvas.canvas.width, canvas.canvas.height);
  return onePerPatch(canvas.read(), size);
}

/** A black panorama (RGBE, run lengths): the viewer needs an environment even where none lights. */
function darkPanorama() {
  const width = 16, height = 8, head = new TextEncoder().encode(`#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y ${height} +X ${width}\n`);
  const line = [2, 2, 0, width, ...[0, 0, 0, 0].flatMap((value) => [128 + width, value])];
  return new Uint8Array([...head, ...Array(height).fill(line).flat()]).buffer;
}
