// three.js: GLTFLoader and WebGLRenderer, into a float target.
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { HDRLoader } from "three/addons/loaders/HDRLoader.js";
import { ballGlb, onePerPatch, DISTANCE, PATCH } from "./ball.js";

let renderer, target, size, environment, turn;
const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, DISTANCE - 10, DISTANCE + 10);
camera.position.z = DISTANCE;

export async function init(options) {
  size = options.size;
  turn = options.turn;
  renderer = new THREE.WebGLRenderer();
  target = new THREE.WebGLRenderTarget(size * PATCH, size * PATCH, { type: THREE.FloatType });
  if (options.environment) {
    const panorama = await new HDRLoader().setDataType(THREE.FloatType).loadAsync(options.environment);
    panorama.mapping = THREE.EquirectangularReflectionMapping;
    environment = new THREE.PMREMGenerator(renderer).fromEquirectangular(panorama).texture;
  }
  return `three.js r${THREE.REVISION}`;
}

/** The ball under a sun at each angle [radians], then under the environment if there is one. */
export async function draw(material, suns) {
  const { scene } = await new GLTFLoader().parseAsync(ballGlb(material, size), "");
  const world = new THREE.Scene().add(scene), sun = new THREE.DirectionalLight(0xffffff, Math.PI), pictures = [];
  world.add(sun);
  for (const angle of suns) {
    sun.position.set(Math.sin(angle), 0, Math.cos(angle));
    pictures.push(picture(world));
  }
  if (environment) {
    sun.intensity = 0;
    world.environment = environment;
    world.environmentRotation.set(0, turn, 0);
    pictures.push(picture(world));
  }
  scene.traverse((o) => o.isMesh && (o.geometry.dispose(), o.material.dispose()));
  return pictures;
}

function picture(world) {
  const rgba = new Float32Array(4 * target.width * target.height);
  renderer.setRenderTarget(target);
  renderer.render(world, camera);
  renderer.readRenderTargetPixels(target, 0, 0, target.width, target.height, rgba);
  return onePerPatch(rgba, size);
}
