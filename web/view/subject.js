// The scene: every mesh with its exact material and its glTF material.

import {Box3, MeshPhysicalMaterial, Sphere} from 'three';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {MeshoptDecoder} from 'three/addons/libs/meshopt_decoder.module.js';
import {EXTENSION, SGDMaterialsPlugin} from '../src/index.js';

/** A scene of a GLB. */
export async function loadSubject(glb) {
  const loader = new GLTFLoader().register(parser => new SGDMaterialsPlugin(parser));
  loader.setMeshoptDecoder(MeshoptDecoder);
  return new Subject(await loader.parseAsync(glb, ''));
}

class Subject {
  constructor({scene, parser}) {
    this.root = scene;
    this.parts = [];
    scene.traverse(mesh => { if (mesh.material) this.parts.push(partOf(mesh, parser)); });
    this.slots = slotsOf(parser.json, this.parts);
  }

  /** Puts on the materials called `exact` or `gltf`. */
  show(name) {
    for (const part of this.parts) part.mesh.material = part[name];
  }

  /** The smallest sphere around `object` that its box tells. */
  static bounds(object) {
    return new Box3().setFromObject(object, true).getBoundingSphere(new Sphere());
  }
}

export const boundsOf = object => Subject.bounds(object);

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
      triangles: drawn.reduce((sum, {mesh}) => sum + triangles(mesh.geometry), 0),
    };
  });
}

const triangles = ({index, attributes}) => Math.floor((index ?? attributes.position).count / 3);
