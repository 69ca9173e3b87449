// ΔE2000 of two pictures, as colour.js has it.

import {HEAT} from './heat.js';
import {CURVE} from './tone.js';

export const vertexShader = /* glsl */`
varying vec2 vPoint;
void main() {
  vPoint = 0.5 * position.xy + 0.5;
  gl_Position = vec4(position.xy, 0.0, 1.0);
}`;

export const fragmentShader = /* glsl */`
uniform sampler2D first;
uniform sampler2D second;
uniform float exposure;
varying vec2 vPoint;
${CURVE}
${HEAT}

float labCurve(float t) {
  return t > 216.0 / 24389.0 ? pow(t, 1.0 / 3.0) : (t * 24389.0 / 27.0 + 16.0) / 116.0;
}

// CIE Lab of a scene colour after the curve.
vec3 lab(vec3 scene) {
  vec3 c = sgdbakeCurve(scene);
  float x = labCurve(dot(c, vec3(0.4124564, 0.3575761, 0.1804375)) / 0.95047);
  float y = labCurve(dot(c, vec3(0.2126729, 0.7151522, 0.0721750)));
  float z = labCurve(dot(c, vec3(0.0193339, 0.1191920, 0.9503041)) / 1.08883);
  return vec3(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z));
}

// c⁷/(c⁷ + 25⁷)
float chromaShare(float c) {
  return 1.0 / (1.0 + pow(25.0 / max(c, 0.01), 7.0));
}

float hue(float x, float b) {
  return x == 0.0 && b == 0.0 ? 0.0 : mod(degrees(atan(b, x)) + 360.0, 360.0);
}

// ΔE2000 (Sharma, Wu and Dalal 2005).
float deltaE(vec3 p, vec3 q) {
  float g = 0.5 * (1.0 - sqrt(chromaShare(0.5 * (length(p.yz) + length(q.yz)))));
  vec2 a = vec2(p.y, q.y) * (1.0 + g);
  float c1 = length(vec2(a.x, p.z));
  float c2 = length(vec2(a.y, q.z));
  float h1 = hue(a.x, p.z);
  float h2 = hue(a.y, q.z);
  bool grey = c1 * c2 == 0.0;
  float turn = grey ? 0.0 : h2 - h1;
  turn -= turn > 180.0 ? 360.0 : turn < -180.0 ? -360.0 : 0.0;
  float h = grey ? h1 + h2 : 0.5 * (h1 + h2);
  if (!grey && abs(h1 - h2) > 180.0) h += h1 + h2 < 360.0 ? 180.0 : -180.0;
  float l = 0.5 * (p.x + q.x) - 50.0;
  float c = 0.5 * (c1 + c2);
  float t = 1.0 - 0.17 * cos(radians(h - 30.0)) + 0.24 * cos(radians(2.0 * h))
    + 0.32 * cos(radians(3.0 * h + 6.0)) - 0.2 * cos(radians(4.0 * h - 63.0));
  float lightness = (q.x - p.x) / (1.0 + 0.015 * l * l / sqrt(20.0 + l * l));
  float saturation = (c2 - c1) / (1.0 + 0.045 * c);
  float hueDifference = 2.0 * sqrt(c1 * c2) * sin(radians(0.5 * turn)) / (1.0 + 0.015 * c * t);
  float off = (h - 275.0) / 25.0;
  float rotation = -sin(radians(60.0) * exp(-off * off)) * 2.0 * sqrt(chromaShare(c));
  return sqrt(max(lightness * lightness + saturation * saturation + hueDifference * hueDifference
    + rotation * saturation * hueDifference, 0.0));
}

void main() {
  vec4 a = texture2D(first, vPoint);
  vec4 b = texture2D(second, vPoint);
  float covered = min(a.a, b.a);
  if (covered == 0.0) discard;
  float difference = deltaE(lab(exposure * a.rgb / a.a), lab(exposure * b.rgb / b.a));
  gl_FragColor = vec4(heat(difference), covered);
}`;
