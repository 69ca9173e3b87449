// Runs in the page: the picture of a GLB by three.js alone, with the plugin and without.

import {DirectionalLight, Group, LinearToneMapping, Matrix4, PMREMGenerator, PerspectiveCamera, Scene, WebGLRenderer} from 'three';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {SGDMaterialsPlugin} from '../../src/index.js';
import {studio} from '../../view/studio.js';

const renderer = new WebGLRenderer({antialias: true, alpha: true});
renderer.setClearColor(0, 0);
renderer.toneMapping = LinearToneMapping;
const environment = new PMREMGenerator(renderer).fromEquirectangular(studio()).texture;

/** Both pictures as base64 of RGBA bytes, rows from the bottom, of what the page says that it shows. */
export async function draw(data, {size: [width, height], camera, origin, toSun, irradiance}) {
  renderer.setSize(width, height);
  const view = new PerspectiveCamera(camera.fov, width / height, camera.near, camera.far);
  new Matrix4().fromArray(camera.matrix).decompose(view.position, view.quaternion, view.scale);
  const pictures = [];
  for (const plugin of [true, false]) {
    const loader = new GLTFLoader();
    if (plugin) loader.register(parser => new SGDMaterialsPlugin(parser));
    const gltf = await loader.parseAsync(Uint8Array.from(atob(data), c => c.charCodeAt(0)).buffer, '');
    const sun = new DirectionalLight(0xffffff, irradiance);
    sun.position.set(...toSun);
    const subject = new Group().add(gltf.scene);
    subject.position.set(...origin);
    const scene = new Scene().add(subject, sun);
    scene.environment = environment;
    renderer.render(scene, view);
    pictures.push(pixels(renderer.getContext(), width, height));
  }
  return pictures;
}

function pixels(gl, width, height) {
  const bytes = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  let text = '';
  for (let start = 0; start < bytes.length; start += 32768) text += String.fromCharCode(...bytes.subarray(start, start + 32768));
  return btoa(text);
}
