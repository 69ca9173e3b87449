// three.js's GLTFLoader over the files named as arguments: one JSON line each, with the triangles
// and the materials that three.js shows. Images and Draco geometry are not decoded, as there is no
// browser here; the latter must start as it should.
import {readFile} from 'node:fs/promises';
import {dirname, join} from 'node:path';
import {pathToFileURL} from 'node:url';
import {BufferAttribute, BufferGeometry, Texture} from 'three';
import {GLTFLoader} from 'three/examples/jsm/loaders/GLTFLoader.js';

globalThis.self = globalThis;
globalThis.ProgressEvent ??= class extends Event {};
// File addresses, which Node's fetch does not read.
const network = globalThis.fetch;
globalThis.fetch = async request => {
  const url = typeof request === 'string' ? request : request.url;
  return url.startsWith('file:') ? new Response(await readFile(new URL(url))) : network(request);
};

// Textures without pixels, so that materials that use them load.
const withoutPixels = parser => ({
  name: 'WITHOUT_PIXELS',
  loadTexture: async index => {
    const texture = new Texture();
    texture.userData.index = index;
    parser.associations.set(texture, {textures: index});
    return texture;
  },
});

const withoutGeometry = {
  preload() {},
  decodeDracoFile(bytes, done) {
    const start = String.fromCharCode(...new Uint8Array(bytes, 0, 5));
    if (start !== 'DRACO') throw new Error(`compressed geometry starts with ${start}`);
    done(new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array(9), 3)));
  },
};

for (const file of process.argv.slice(2)) {
  const loader = new GLTFLoader().register(withoutPixels).setDRACOLoader(withoutGeometry);
  const bytes = await readFile(file);
  const folder = pathToFileURL(join(dirname(file), '/')).href;
  const gltf = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), folder);
  let triangles = 0;
  const materials = {};
  for (const scene of gltf.scenes) {
    scene.traverse(object => {
      if (!object.isMesh) return;
      const {index, attributes} = object.geometry;
      triangles += (index ?? attributes.position).count / 3;
      const {name, color, metalness, roughness, userData} = object.material;
      const sgd = userData.gltfExtensions?.SGD_materials_shifted_gamma;
      materials[name] = {color: color.toArray(), metalness, roughness, sgd: sgd?.name ?? null, extras: userData.sgd?.name ?? null};
    });
  }
  console.log(JSON.stringify({file, triangles, materials}));
}
