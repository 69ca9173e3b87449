// Filament in WebAssembly (a global of filament.js), its glTF loader, without post-processing.
import { ballGlb, onePerPatch, DISTANCE, PATCH } from "./ball.js";
import { floatCanvas } from "./canvas.js";

let Filament, canvas, engine, scene, view, sun, renderer, swapChain, loader, size;

export async function init(options) {
  size = options.size;
  if (options.environment) throw new Error("npm filament reads environments prefiltered by cmgen (KTX) only");
  await new Promise((done) => globalThis.Filament.init([], done));
  ({ Filament } = globalThis); // init replaces the global
  canvas = floatCanvas(size * PATCH);
  engine = Filament.Engine.create(canvas.canvas);
  scene = engine.createScene();
  swapChain = engine.createSwapChain();
  renderer = engine.createRenderer();
  renderer.setClearOptions({ clearColor: [0, 0, 0, 0], clear: true });
  const camera = engine.createCamera(Filament.EntityManager.get().create());
  camera.setProjection(Filament.Camera$Projection.ORTHO, -1, 1, -1, 1, DISTANCE - 10, DISTANCE + 10);
  camera.lookAt([0, 0, DISTANCE], [0, 0, 0], [0, 1, 0]);
  camera.setExposureDirect(1);
  view = engine.createView();
  view.setCamera(camera);
  view.setScene(scene);
  view.setViewport([0, 0, size * PATCH, size * PATCH]);
  view.setPostProcessingEnabled(false);
  loader = engine.createAssetLoader();
  sun = Filament.EntityManager.get().create();
  Filament.LightManager.Builder(Filament.LightManager$Type.DIRECTIONAL)
    .direction([0, 0, -1]).color([1, 1, 1]).intensity(Math.PI).build(engine, sun);
  scene.addEntity(sun);
  return "Filament 1.53.4";
}

/** The ball under a sun at each angle [radians]. */
export async function draw(material, suns) {
  const asset = loader.createAsset(new Uint8Array(ballGlb(material, size)));
  await new Promise((done) => asset.loadResources(done, () => {}, "", 10));
  scene.addEntities(asset.getEntities());
  const pictures = [], lights = engine.getLightManager();
  for (const angle of suns) {
    const light = lights.getInstance(sun);
    lights.setDirection(light, [-Math.sin(angle), 0, -Math.cos(angle)]);
    light.delete();
    await frames(2);
    pictures.push(onePerPatch(canvas.read(), size));
  }
  scene.removeEntities(asset.getEntities());
  return pictures;
}

/** Renders until `count` frames were not skipped: Filament paces them. */
async function frames(count) {
  for (let tries = 0; count > 0 && tries < 200; tries++) {
    if (renderer.beginFrame(swapChain)) {
      renderer.renderView(view);
      renderer.endFrame();
      count--;
    }
    engine.execute();
    canvas.gl.finish();
    await new Promise((done) => setTimeout(done, 1));
  }
  if (count > 0) throw new Error("Filament skipped 200 frames");
}
