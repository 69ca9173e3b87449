// Compiles when the types are those that a project needs.

import {Scene} from 'three';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {MeshSGDMaterial, SGDMaterialsPlugin, readParameters} from '../../src/index.js';

const loader = new GLTFLoader().register(parser => new SGDMaterialsPlugin(parser));
const {scene} = await loader.loadAsync('scene.glb');
new Scene().add(scene);

const material = new MeshSGDMaterial(readParameters(JSON.parse('{}')));
material.roughness = 0.5;
const albedo: number = material.parameters.diffuse[0];
// @ts-expect-error a lobe has a shape
material.setParameters({name: '', diffuse: [albedo, 0, 0], lobes: [{}], error: null});
