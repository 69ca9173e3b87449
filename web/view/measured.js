// The measurement itself under the sun, read from a table over half and difference angles.

import {
  Data3DTexture, HalfFloatType, LinearFilter, Mesh, RGBAFormat, ShaderMaterial, SphereGeometry, Vector3,
} from 'three';

const vertexShader = /* glsl */`
varying vec3 vNormal;
varying vec3 vToViewer;
void main() {
  vec4 position4 = modelMatrix * vec4(position, 1.0);
  vNormal = mat3(modelMatrix) * normal;
  vToViewer = cameraPosition - position4.xyz;
  gl_Position = projectionMatrix * viewMatrix * position4;
}`;

// Nodes along θh lie at θh = (π/2) u², those along θd and φd evenly in [0, π/2]: φd + π swaps the
// directions, −φd mirrors them.
const fragmentShader = /* glsl */`
#include <common>
precision highp sampler3D;
uniform sampler3D measurement;
uniform vec3 size;
uniform vec3 toSun;
uniform float irradiance;
varying vec3 vNormal;
varying vec3 vToViewer;

vec3 measured(vec3 n, vec3 wi, vec3 wo) {
  vec3 h = normalize(wi + wo);
  float thetaH = atan(length(cross(n, h)), dot(n, h));
  float thetaD = atan(length(wi - wo), length(wi + wo));
  vec3 across = h - n * dot(n, h);
  // At θh = 0 every azimuth is the same pair.
  vec3 u = length(across) > 1e-6 ? normalize(across) : normalize(wi - n * dot(n, wi) + 1e-6);
  vec3 b = cross(n, u);
  vec3 t = cross(b, h);
  float phiD = abs(atan(dot(wi, b), dot(wi, t)));
  vec3 share = vec3(thetaH, thetaD, min(phiD, PI - phiD)) / (0.5 * PI);
  share.x = sqrt(share.x);
  return texture(measurement, (share * (size - 1.0) + 0.5) / size).rgb;
}

void main() {
  vec3 n = normalize(vNormal);
  float cosI = dot(n, toSun);
  vec3 f = cosI > 0.0 ? measured(n, toSun, normalize(vToViewer)) : vec3(0.0);
  gl_FragColor = vec4(f * max(cosI, 0.0) * irradiance, 1.0);
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
}`;

/** A ball of the measurement whose table has `size` nodes along θh, θd and φd: RGB half floats. */
export function measuredBall(halves, size) {
  const texels = halves.length / 3;
  const data = new Uint16Array(4 * texels);
  for (let k = 0; k < texels; k++) data.set(halves.subarray(3 * k, 3 * k + 3), 4 * k);
  const texture = new Data3DTexture(data, ...size);
  Object.assign(texture, {
    format: RGBAFormat, type: HalfFloatType, minFilter: LinearFilter, magFilter: LinearFilter,
    needsUpdate: true,
  });
  const uniforms = {
    measurement: {value: texture}, size: {value: new Vector3(...size)}, toSun: {value: new Vector3()}, irradiance: {value: 0},
  };
  return new Mesh(new SphereGeometry(1, 128, 64), new ShaderMaterial({vertexShader, fragmentShader, uniforms}));
}
