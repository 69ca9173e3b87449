// The scene: every mesh with its exact material and its glTF material.

import {Box3, MeshPhysicalMaterial, Sphere, Vector3} from 'three';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {MeshoptDecoder} from 'three/addons/libs/meshopt_decoder.module.js';
import {EXTENSION, SGDMaterialsPlugin} from '../src/index.js';

/** The scene of a GLB; of its root nodes only those of these numbers, if any are given. */
export async function loadSubject(glb, roots) {
  const loader = new GLTFLoader().register(parser => new SGDMaterialsPlugin(parser));
  if (roots) loader.register(parser => ({name: 'roots', beforeRoot: () => { parser.json.scenes[0].nodes = roots; }}));
  loader.setMeshoptDecoder(MeshoptDecoder);
  return new Subject(await loader.parseAsync(glb, ''));
}

class Subject {
  constructor({scene, parser}) {
    this.root = scene;
    this.roots = [...scene.children];
    removeLights(scene);
    this.parts = [];
    scene.traverse(mesh => { if (mesh.material) this.parts.push(partOf(mesh, parser)); });
    this.slots = slotsOf(parser.json, this.parts);
  }

  /** Puts on the materials called `exact` or `gltf`. */
  show(name) {
    for (const part of this.parts) part.mesh.material = part[name];
  }
}

/** The page has lights of its own. */
function removeLights(scene) {
  const lights = [];
  scene.traverse(node => { if (node.isLight) lights.push(node); });
  for (const light of lights) light.removeFromParent();
}

/** A sphere about the middle of an object's box that holds its vertices. */
export function boundsOf(object) {
  const center = new Box3().setFromObject(object, true).getCenter(new Vector3());
  const point = new Vector3();
  let square = 0;
  object.traverse(mesh => {
    const count = mesh.isMesh ? mesh.geometry.attributes.position.count : 0;
    for (let k = 0; k < count; k++) {
      square = Math.max(square, mesh.getVertexPosition(k, point).applyMatrix4(mesh.matrixWorld).distanceToSquared(center));
    }
  });
  return new Sphere(center, Math.sqrt(square));
}

function partOf(mesh, parser) {
  const exact = mesh.material;
  const index = parser.associations.get(exact)?.materials ?? null;
  return {mesh, exact, gltf: exact.isMeshSGDMaterial ? plain(exact) : exact, index};
}

/** The material that a loader without the plugin builds. */
function plain(exact) {
  const {defines} = new MeshPhysicalMaterial();
  const material = MeshPhysicalMaterial.prototype.copy.call(new MeshPhysicalMaterial(), exact);
  material.defines = defines;
  return material;
}

/** The file's materials: what is exact of them, and what is drawn with them. */
function slotsOf({materials = []}, parts) {
  return materials.map((definition, index) => {
    const drawn = parts.filter(part => part.index === index);
    return {
      index,
      name: definition.name ?? `material ${index}`,
      carries: definition.extensions?.[EXTENSION] !== undefined,
      parameters: drawn.find(({exact}) => exact.isMeshSGDMaterial)?.exact.parameters ?? null,
      gltf: drawn[0]?.gltf ?? null,
      note: drawn.length ? `${drawn.reduce((sum, {mesh}) => sum + triangles(mesh.geometry), 0).toLocaleString('en')} triangles` : 'unused',
    };
  });
}

const triangles = ({index, attributes}) => Math.floor((index ?? attributes.position).count / 3);
