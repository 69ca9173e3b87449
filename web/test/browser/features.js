// Runs in the page: small pictures of a MeshSGDMaterial with and without one of three.js's features. Each function hands
// back pictures, rows from the bottom, RGBA floats, that stand in a known relation.

import {
  AmbientLight, Bone, BufferAttribute, Color, DataTexture, DirectionalLight, DoubleSide, EquirectangularReflectionMapping,
  FloatType, Fog, FogExp2, Group, HemisphereLight, InstancedMesh, LightProbe, Matrix4, Mesh, MeshBasicMaterial,
  NearestFilter, NoToneMapping, OrthographicCamera, PlaneGeometry, PMREMGenerator, PointLight, RectAreaLight,
  ReinhardToneMapping, Scene, Skeleton, SkinnedMesh, SphereGeometry, SpotLight, SRGBColorSpace, Vector3, WebGLRenderer,
  WebGLRenderTarget,
} from 'three';
import {RectAreaLightUniformsLib} from 'three/addons/lights/RectAreaLightUniformsLib.js';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {MeshSGDMaterial, readParameters, SGDMaterialsPlugin} from '../../src/index.js';

/** Odd, so that a pixel's centre is the origin. */
const SIZE = 33;
const renderer = new WebGLRenderer({antialias: false, preserveDrawingBuffer: true});
renderer.setSize(SIZE, SIZE);
RectAreaLightUniformsLib.init();
const camera = new OrthographicCamera(-1, 1, 1, -1, 0.1, 10);
camera.position.z = 5;
const target = new WebGLRenderTarget(SIZE, SIZE, {type: FloatType, minFilter: NearestFilter, magFilter: NearestFilter});

let parameters = null;
/** The extension's body of the material that is drawn. */
export function use(body) {
  parameters = readParameters(body);
}

function material(properties = {}) {
  const made = new MeshSGDMaterial(parameters);
  made.setValues(properties);
  return made;
}

const plane = () => new PlaneGeometry(2, 2);
const ball = () => new SphereGeometry(0.9, 48, 32);
const SUN = [0.5, 0.3, 1];

function sun(direction = SUN, intensity = Math.PI) {
  const light = new DirectionalLight(0xffffff, intensity);
  light.position.set(...direction);
  return light;
}

/** A texture of one texel, or of a row of them. */
function texture(...texels) {
  const made = new DataTexture(new Float32Array(texels.flat()), texels.length, 1, undefined, FloatType);
  made.needsUpdate = true;
  return made;
}

/** The picture of these objects and lights. */
function draw(objects, {fog = null, environment = null} = {}) {
  const scene = new Scene().add(...objects);
  scene.fog = fog;
  scene.environment = environment;
  renderer.setRenderTarget(target);
  renderer.setClearColor(0, 0);
  renderer.clear();
  renderer.render(scene, camera);
  const pixels = new Float32Array(4 * SIZE * SIZE);
  renderer.readRenderTargetPixels(target, 0, 0, SIZE, SIZE, pixels);
  renderer.setRenderTarget(null);
  return [...pixels];
}

/** The plane with such a material under the lights. */
const drawPlane = (properties, lights = [sun()], options) => draw([new Mesh(plane(), material(properties)), ...lights], options);

export function normalMap() {
  const tilted = new Vector3(0.3, -0.2, 1).normalize();
  const geometry = plane();
  for (let i = 0; i < 4; i++) geometry.attributes.normal.setXYZ(i, ...tilted);
  return {
    mapped: drawPlane({normalMap: texture([...tilted].map(c => (c + 1) / 2).concat(1))}),
    tilted: draw([new Mesh(geometry, material()), sun()]),
    flat: drawPlane({}),
  };
}

/** An even room of radiance 1. */
function room() {
  const even = new DataTexture(new Float32Array(16 * 8 * 4).fill(1), 16, 8, undefined, FloatType);
  even.mapping = EquirectangularReflectionMapping;
  even.needsUpdate = true;
  return new PMREMGenerator(renderer).fromEquirectangular(even).texture;
}

export function occlusion() {
  const of = value => ({aoMap: texture([value, value, value, 1])});
  const ambient = () => [new AmbientLight(0xffffff, Math.PI)];
  const environment = room();
  return {
    ambient: [1, 0.5].map(value => drawPlane(of(value), ambient())),
    sun: [1, 0.5].map(value => drawPlane(of(value))),
    room: [1, 0.5, 0].map(value => drawPlane(of(value), [], {environment})),
  };
}

export function emissive() {
  const glow = {emissive: new Color(0.5, 0.25, 1), emissiveIntensity: 2, emissiveMap: texture([0.5, 0.5, 0.25, 1])};
  return {dark: drawPlane({}), glowing: drawPlane(glow)};
}

const halves = () => texture([1, 1, 1, 0.2], [1, 1, 1, 0.8]);

export const mask = () => ({whole: drawPlane({}), masked: drawPlane({map: halves(), alphaTest: 0.5})});

export function blend() {
  const [geometry, behind] = [plane(), new Mesh(plane(), new MeshBasicMaterial({color: new Color(0.2, 0.4, 0.8)}))];
  behind.position.z = -1;
  const front = new Mesh(geometry, material({transparent: true, opacity: 0.25}));
  return {front: drawPlane({}), behind: draw([behind]), blended: draw([behind, front, sun()])};
}

export function doubleSide() {
  const turned = side => {
    const mesh = new Mesh(plane(), material(side));
    mesh.rotation.y = Math.PI;
    return draw([mesh, sun()]);
  };
  return {front: drawPlane({}), back: turned({}), both: turned({side: DoubleSide})};
}

/** A plane that a square shades between the sun and it, outside the picture; and the same without shadows or sun. */
export function shadow() {
  const receiver = new Mesh(plane(), material());
  receiver.receiveShadow = true;
  const square = new Mesh(new PlaneGeometry(0.8, 0.8), new MeshBasicMaterial({side: DoubleSide}));
  square.position.set(3, 0, 3);
  square.castShadow = true;
  const light = sun([4, 0, 4]);
  Object.assign(light.shadow.camera, {left: -2, right: 2, top: 2, bottom: -2, near: 0.5, far: 12});
  light.shadow.mapSize.set(256, 256);
  light.shadow.bias = -0.001;
  const ambient = new AmbientLight(0xffffff, 0.3);
  const under = casts => {
    light.castShadow = casts;
    return draw([receiver, square, light, ambient]);
  };
  renderer.shadowMap.enabled = true;
  const pictures = {shaded: under(true), open: under(false), unlit: draw([receiver, ambient])};
  renderer.shadowMap.enabled = false;
  return pictures;
}

/** Rows of a geometry's vertices and normals, moved by the matrix of each. */
function baked(geometry, matrixOf) {
  const made = geometry.clone();
  const {position, normal} = made.attributes;
  for (let i = 0; i < position.count; i++) {
    const matrix = matrixOf(i);
    position.setXYZ(i, ...new Vector3().fromBufferAttribute(position, i).applyMatrix4(matrix));
    const {elements: e} = matrix;
    const [x, y, z] = new Vector3().fromBufferAttribute(normal, i);
    normal.setXYZ(i, ...new Vector3(e[0] * x + e[4] * y + e[8] * z, e[1] * x + e[5] * y + e[9] * z, e[2] * x + e[6] * y + e[10] * z).normalize());
  }
  return made;
}

export function skinning() {
  const geometry = ball();
  const {position} = geometry.attributes;
  const weight = i => position.getY(i) / 1.8 + 0.5;
  const rows = make => Float32Array.from({length: 4 * position.count}, (_, k) => make(Math.floor(k / 4))[k % 4]);
  geometry.setAttribute('skinIndex', new BufferAttribute(Uint16Array.from(rows(() => [0, 1, 0, 0])), 4));
  geometry.setAttribute('skinWeight', new BufferAttribute(rows(i => [1 - weight(i), weight(i), 0, 0]), 4));
  const bones = [new Bone(), new Bone()];
  const mesh = new SkinnedMesh(geometry, material());
  mesh.add(...bones);
  mesh.bind(new Skeleton(bones));
  const rest = draw([mesh, sun()]);
  bones[1].rotation.set(0.3, 0.5, 0.4);
  bones[1].position.x = 0.2;
  mesh.updateMatrixWorld(true);
  const [first, second] = bones.map(({matrixWorld}) => matrixWorld.elements);
  const blended = i => new Matrix4().fromArray(first.map((e, k) => (1 - weight(i)) * e + weight(i) * second[k]));
  return {rest, skinned: draw([mesh, sun()]), baked: draw([new Mesh(baked(geometry, blended), material()), sun()])};
}

export function morph() {
  const geometry = ball();
  const moved = new Matrix4().makeRotationX(0.6).scale(new Vector3(1, 0.5, 0.8));
  const end = baked(geometry, () => moved);
  const difference = name => {
    const [from, to] = [geometry, end].map(({attributes}) => attributes[name].array);
    return new BufferAttribute(Float32Array.from(from, (value, k) => to[k] - value), 3);
  };
  geometry.morphTargetsRelative = true;
  geometry.morphAttributes = {position: [difference('position')], normal: [difference('normal')]};
  const mesh = new Mesh(geometry, material());
  mesh.updateMorphTargets();
  const at = influence => {
    mesh.morphTargetInfluences[0] = influence;
    return draw([mesh, sun()]);
  };
  const half = ball();
  for (const name of ['position', 'normal']) {
    half.attributes[name].array.forEach((value, k, array) => { array[k] = (value + end.attributes[name].array[k]) / 2; });
  }
  return {rest: at(0), morphed: at(0.5), baked: draw([new Mesh(half, material()), sun()])};
}

export function instancing() {
  const matrices = [-0.5, 0.5].map((x, k) => new Matrix4().makeRotationY(k - 0.5).setPosition(x, 0, 0).scale(new Vector3(0.4, 0.4, 0.4)));
  const instances = colours => {
    const mesh = new InstancedMesh(ball(), material(), 2);
    matrices.forEach((matrix, k) => mesh.setMatrixAt(k, matrix));
    colours.forEach((colour, k) => mesh.setColorAt(k, new Color(...colour)));
    return draw([mesh, sun()]);
  };
  const meshes = matrices.map(matrix => new Mesh(ball().applyMatrix4(matrix), material()));
  return {baked: draw([...meshes, sun()]), instanced: instances([]), tinted: instances([[0.5, 0.25, 1], [0.5, 0.25, 1]])};
}

export function fog() {
  const colour = new Color(0.1, 0.6, 0.3);
  return {clear: drawPlane({}), linear: drawPlane({}, [sun()], {fog: new Fog(colour, 3, 8)}), exponential: drawPlane({}, [sun()], {fog: new FogExp2(colour, 0.2)})};
}

/** Bytes of the canvas. */
function drawCanvas(properties, toneMapping, exposure) {
  renderer.toneMapping = toneMapping;
  renderer.toneMappingExposure = exposure;
  renderer.outputColorSpace = SRGBColorSpace;
  renderer.setClearColor(0, 0);
  renderer.render(new Scene().add(new Mesh(plane(), material(properties)), sun()), camera);
  const gl = renderer.getContext();
  const pixels = new Uint8Array(4 * SIZE * SIZE);
  gl.readPixels(0, 0, SIZE, SIZE, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  renderer.toneMapping = NoToneMapping;
  return [...pixels];
}

export const toneMapping = () => ({
  linear: drawPlane({}),
  mapped: drawCanvas({}, ReinhardToneMapping, 2.5),
  plain: drawCanvas({toneMapped: false}, ReinhardToneMapping, 2.5),
});

const along = (direction, distance) => new Vector3(...direction).setLength(distance);

export function point() {
  const at = (distance, decay) => {
    const light = new PointLight(0xffffff, Math.PI, 0, decay);
    light.position.copy(along(SUN, distance));
    return drawPlane({}, [light]);
  };
  return {sun: drawPlane({}), near: at(1.5, 2), far: at(3, 2), undimmed: at(3, 0)};
}

/** A spot at distance 2 that points so many radians past the origin; its edge is at 0.5, its penumbra begins at 0.25. */
export function spot() {
  const turned = angle => {
    const light = new SpotLight(0xffffff, 4 * Math.PI, 0, 0.5, 0.5);
    light.position.copy(along(SUN, 2));
    const towards = along(SUN, -1).applyAxisAngle(new Vector3(0.3, -0.5, 0).normalize(), angle);
    light.target.position.copy(light.position).add(towards);
    light.target.updateMatrixWorld();
    return drawPlane({}, [light, light.target]);
  };
  return {sun: drawPlane({}), within: turned(0.1), edge: turned(0.4), beyond: turned(0.6)};
}

/** Rectangles above and below a plane that leans back by 0.6: three.js divides 0 by 0 where the view is the normal. */
export function rectArea() {
  const lit = (surface, size, height, intensity) => {
    const light = new RectAreaLight(0xffffff, intensity, size, size);
    light.position.z = height;
    light.rotation.y = height > 0 ? 0 : Math.PI;
    const leaning = new Group().add(new Mesh(plane(), surface), light);
    leaning.rotation.x = -0.6;
    return draw([leaning]);
  };
  const matte = new MeshSGDMaterial({...parameters, lobes: []});
  return {ceiling: lit(material(), 2000, 1, 1), behind: lit(material(), 2000, -1, 1), matte: lit(matte, 0.02, 2, 1e4)};
}

export function indirect() {
  const turned = () => {
    const mesh = new Mesh(plane(), material());
    mesh.rotation.x = -0.6;
    return mesh;
  };
  const probe = new LightProbe(undefined, Math.PI);
  probe.sh.coefficients[0].set(1, 0.5, 0.25);
  const lightMap = texture([0.5, 0.25, 1, 1]);
  return {
    ambient: drawPlane({}, [new AmbientLight(new Color(1, 0.5, 0.25), Math.PI)]),
    hemisphere: draw([turned(), new HemisphereLight(new Color(1, 0.5, 0), new Color(0, 0.5, 1), Math.PI)]),
    probe: drawPlane({}, [probe]),
    lightMap: drawPlane({lightMap, lightMapIntensity: 2}, []),
  };
}

export function tint() {
  const geometry = plane();
  geometry.setAttribute('color', new BufferAttribute(Float32Array.from({length: 12}, (_, k) => [0.5, 0.25, 1][k % 3]), 3));
  return {
    plain: drawPlane({}), mapped: drawPlane({map: texture([0.5, 0.25, 1, 1])}),
    coloured: draw([new Mesh(geometry, material({vertexColors: true})), sun()]),
  };
}

/** What the material of a glTF has, by the loader and the plugin. */
export async function loaded(json) {
  const loader = new GLTFLoader().register(parser => new SGDMaterialsPlugin(parser));
  const {parser} = await loader.parseAsync(JSON.stringify(json), '');
  const materials = await Promise.all(json.materials.map((_, index) => parser.getDependency('material', index)));
  return materials.map(made => ({
    exact: made.isMeshSGDMaterial, transparent: made.transparent, opacity: made.opacity, alphaTest: made.alphaTest,
    doubleSided: made.side === DoubleSide, normalScale: made.normalScale.x, aoMapIntensity: made.aoMapIntensity,
    emissive: made.emissive.toArray(), emissiveIntensity: made.emissiveIntensity,
    maps: ['map', 'normalMap', 'aoMap', 'emissiveMap'].filter(name => made[name]),
  }));
}
