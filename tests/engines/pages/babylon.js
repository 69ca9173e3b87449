// Babylon.js: its glTF loader and PBRMaterial, into a float target; no image processing.
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { Scene } from "@babylonjs/core/scene.js";
import { Camera } from "@babylonjs/core/Cameras/camera.js";
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { DirectionalLight } from "@babylonjs/core/Lights/directionalLight.js";
import { Constants } from "@babylonjs/core/Engines/constants.js";
import { LoadAssetContainerAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { HDRCubeTexture } from "@babylonjs/core/Materials/Textures/hdrCubeTexture.js";
import { RenderTargetTexture } from "@babylonjs/core/Materials/Textures/renderTargetTexture.js";
import { Color4 } from "@babylonjs/core/Maths/math.color.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import "@babylonjs/loaders/glTF/2.0/index.js";
import { ballGlb, onePerPatch, DISTANCE, PATCH } from "./ball.js";

let engine, scene, target, sun, size, environment;

export async function init(options) {
  size = options.size;
  engine = new Engine(document.createElement("canvas"), false);
  scene = new Scene(engine);
  scene.useRightHandedSystem = true;
  scene.clearColor = new Color4(0, 0, 0, 0);
  scene.imageProcessingConfiguration.applyByPostProcess = true; // materials write linear radiance
  const camera = new FreeCamera("camera", new Vector3(0, 0, DISTANCE), scene);
  camera.setTarget(Vector3.Zero());
  camera.mode = Camera.ORTHOGRAPHIC_CAMERA;
  [camera.orthoLeft, camera.orthoRight, camera.orthoBottom, camera.orthoTop] = [-1, 1, -1, 1];
  [camera.minZ, camera.maxZ] = [DISTANCE - 10, DISTANCE + 10];
  target = new RenderTargetTexture("target", size * PATCH, scene, {
    type: Constants.TEXTURETYPE_FLOAT, generateMipMaps: false, samplingMode: Constants.TEXTURE_NEAREST_SAMPLINGMODE,
  });
  target.clearColor = scene.clearColor;
  camera.outputRenderTarget = target;
  sun = new DirectionalLight("sun", new Vector3(0, 0, -1), scene);
  sun.intensity = Math.PI;
  if (options.environment) {
    // As Babylon.js' own viewer loads an .hdr file: irradiance too is integrated on the GPU, by importance.
    environment = new HDRCubeTexture(options.environment, scene, 256, false, true, false, true, null, null, false, true, true);
    environment.rotationY = options.turn;
    await new Promise((done, failed) => {
      if (environment.isReady()) return done();
      environment.onLoadObservable.addOnce(done);
      setTimeout(() => failed(new Error("HDRCubeTexture did not load in 120 s")), 120000);
    });
  }
  return `Babylon.js ${Engine.Version}`;
}

/** The ball under a sun at each angle [radians], then under the environment if there is one. */
export async function draw(material, suns) {
  const file = new File([ballGlb(material, size)], "ball.glb");
  const container = await LoadAssetContainerAsync(file, scene);
  container.addAllToScene();
  for (const mesh of container.meshes) if (mesh.material) mesh.material.backFaceCulling = false;
  const pictures = [];
  scene.environmentTexture = null;
  sun.setEnabled(true);
  for (const angle of suns) {
    sun.direction = new Vector3(-Math.sin(angle), 0, -Math.cos(angle));
    pictures.push(await picture());
  }
  if (environment) {
    sun.setEnabled(false);
    scene.environmentTexture = environment;
    pictures.push(await picture());
  }
  container.removeAllFromScene();
  container.dispose();
  return pictures;
}

async function picture() {
  await scene.whenReadyAsync();
  scene.render();
  return onePerPatch(await target.readPixels(), size);
}
