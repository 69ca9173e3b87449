// Runs in the page: draws a ball in a material and hands back linear floats.

import {
  DataTexture, DirectionalLight, EquirectangularReflectionMapping, FloatType, Mesh, MeshPhysicalMaterial,
  NearestFilter, OrthographicCamera, PMREMGenerator, RGBAFormat, Scene, ShaderMaterial, SphereGeometry,
  Vector3, WebGLRenderTarget, WebGLRenderer, LinearFilter, RepeatWrapping,
} from 'three';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {SGDMaterialsPlugin} from '../../src/index.js';

const renderer = new WebGLRenderer({antialias: false});
const camera = new OrthographicCamera(-1, 1, 1, -1, 0.1, 10);
camera.position.z = 5;
const ball = new Mesh(new SphereGeometry(1, 256, 128));
const scene = new Scene().add(ball);

/** The materials of a glTF, as GLTFLoader with the plugin builds them. */
export async function loadMaterials(json) {
  const loader = new GLTFLoader().register(parser => new SGDMaterialsPlugin(parser));
  const {parser} = await loader.parseAsync(JSON.stringify(json), '');
  return Promise.all(json.materials.map((_, index) => parser.getDependency('material', index)));
}

/** The scene as base64 of RGBA floats, rows from the bottom. */
export function draw(material, size) {
  const target = new WebGLRenderTarget(size, size, {type: FloatType, minFilter: NearestFilter, magFilter: NearestFilter});
  ball.material = material;
  renderer.setRenderTarget(target);
  renderer.setClearColor(0, 0);
  renderer.clear();
  renderer.render(scene, camera);
  const pixels = new Float32Array(4 * size * size);
  renderer.readRenderTargetPixels(target, 0, 0, size, size, pixels);
  renderer.setRenderTarget(null);
  target.dispose();
  return base64(pixels.buffer);
}

function base64(buffer) {
  const bytes = new Uint8Array(buffer);
  let text = '';
  for (let start = 0; start < bytes.length; start += 32768) {
    text += String.fromCharCode(...bytes.subarray(start, start + 32768));
  }
  return btoa(text);
}

/** The ball's interpolated normals in view space. */
export function drawNormals(size) {
  return draw(new ShaderMaterial({
    vertexShader: 'varying vec3 vNormal; void main() { vNormal = normalize(normalMatrix * normal); gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }',
    fragmentShader: 'varying vec3 vNormal; void main() { gl_FragColor = vec4(normalize(vNormal), 1.0); }',
  }), size);
}

export function lightWithSun(direction) {
  for (const light of scene.children.filter(child => child.isLight)) scene.remove(light);
  scene.environment = null;
  if (!direction) return;
  const sun = new DirectionalLight(0xffffff, Math.PI);
  sun.position.copy(new Vector3(...direction));
  scene.add(sun);
}

/** Lights the scene with an equirectangular image: base64 of RGBA floats, rows from the top. */
export function lightWithEnvironment(width, height, data) {
  lightWithSun(null);
  const bytes = Uint8Array.from(atob(data), c => c.charCodeAt(0));
  const texture = new DataTexture(new Float32Array(bytes.buffer), width, height, RGBAFormat, FloatType);
  texture.mapping = EquirectangularReflectionMapping;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = RepeatWrapping;
  texture.flipY = false;
  texture.needsUpdate = true;
  const generator = new PMREMGenerator(renderer);
  scene.environment = generator.fromEquirectangular(texture).texture;
  generator.dispose();
  texture.dispose();
}

/** Milliseconds a frame of `frames` frames, each finished before the next. */
export function frameTime(material, size, frames) {
  const target = new WebGLRenderTarget(size, size, {type: FloatType});
  const pixel = new Float32Array(4);
  ball.material = material;
  renderer.setRenderTarget(target);
  const frame = () => {
    renderer.render(scene, camera);
    renderer.readRenderTargetPixels(target, 0, 0, 1, 1, pixel);
  };
  frame();
  const start = performance.now();
  for (let k = 0; k < frames; k++) frame();
  renderer.setRenderTarget(null);
  target.dispose();
  return (performance.now() - start) / frames;
}

export {MeshPhysicalMaterial, renderer, scene};

/** What the materials of a glTF became. */
export async function describe(json) {
  return (await loadMaterials(json)).map(describeMaterial);
}

/** The same of a GLB, base64. */
export async function describeGlb(data) {
  const bytes = Uint8Array.from(atob(data), c => c.charCodeAt(0));
  const loader = new GLTFLoader().register(parser => new SGDMaterialsPlugin(parser));
  const gltf = await loader.parseAsync(bytes.buffer, '');
  const found = [];
  gltf.scene.traverse(({material}) => { if (material) found.push(describeMaterial(material)); });
  return found;
}

const describeMaterial = material => ({
  exact: material.isMeshSGDMaterial === true,
  type: material.type,
  colour: material.color.toArray(),
  parameters: material.parameters ?? null,
});
