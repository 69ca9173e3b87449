// GLSL that replaces the reflection of a MeshPhysicalMaterial; all else of its shader stays.

import {MASKING_TERMS} from './distribution.js';
import {ROWS, VIEWS} from './environment.js';
import {LEVELS} from './prefiltered.js';

/** Reflections that the measured one takes the place of. */
const REPLACED = ['USE_CLEARCOAT', 'USE_SHEEN', 'USE_IRIDESCENCE', 'USE_ANISOTROPY', 'USE_TRANSMISSION',
  'USE_DISPERSION', 'USE_RETROREFLECTION', 'USE_DIFFUSE_ROUGHNESS'];

/** The fragment shader of a MeshPhysicalMaterial with the reflection of `lobes` lobes. */
export function patchFragmentShader(source, lobes) {
  const undefined = REPLACED.map(name => `#undef ${name}\n`).join('');
  const patches = [
    // The fit's base colour gives way to white: textures and vertex colours tint the reflection.
    ['#include <map_fragment>', chunk => `diffuseColor.rgb = vec3(1.0);\n${chunk}`],
    ['#include <lights_physical_pars_fragment>', chunk => `${chunk}\n${reflection(lobes)}`],
    ['#include <lights_physical_fragment>', chunk => `${chunk}\nsgdSetView(normal, isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(vViewPosition), diffuseColor.rgb);`],
  ];
  return undefined + patches.reduce((text, [include, patched]) => {
    if (!text.includes(include)) throw new Error(`three.js's physical shader has no ${include}: this release is not supported`);
    return text.replace(include, patched(include));
  }, source);
}

/** Σ coefficients[k] x^k, written out: not every compiler unrolls the loop. */
function horner(coefficients, x, count) {
  const inner = Array.from({length: count - 1}, (_, k) => `${coefficients}[${k}] + ${x} * (`).join('');
  return `(${inner}${coefficients}[${count - 1}]${')'.repeat(count - 1)})`;
}

const reflection = lobes => /* glsl */`
#define SGD_LOBES ${lobes}
#define SGD_LEVELS ${LEVELS.length}
#define SGD_ROWS ${ROWS}
#define SGD_VIEWS ${VIEWS}
#define SGD_MASKING_TERMS ${MASKING_TERMS}

uniform vec3 sgdDiffuse;

// The tint of the surface's own colours, and the view.
vec3 sgdTint;
float sgdCosO;

#if SGD_LOBES > 0

// A number of every lobe, and the colours of lobes weighted by such numbers.
#if SGD_LOBES == 1
#define SgdLobes float
#define sgdMix(colours, numbers) (colours[0] * (numbers))
#elif SGD_LOBES == 2
#define SgdLobes vec2
#define sgdMix(colours, numbers) (mat2x3(colours[0], colours[1]) * (numbers))
#else
#define SgdLobes vec3
#define sgdMix(colours, numbers) (mat3(colours[0], colours[1], colours[2]) * (numbers))
#endif

uniform SgdLobes sgdAlpha;
uniform SgdLobes sgdP;
uniform SgdLobes sgdPeak;
uniform SgdLobes sgdScale;
uniform SgdLobes sgdStretch;
uniform SgdLobes sgdMasking[SGD_MASKING_TERMS];
// What a lobe's ρs F is made of: constant + schlick (1 − cosθd)⁵ + cosine cosθd.
uniform vec3 sgdConstant[SGD_LOBES];
uniform vec3 sgdSchlick[SGD_LOBES];
uniform vec3 sgdCosine[SGD_LOBES];
uniform float sgdViewScale[SGD_LOBES];
uniform float sgdRoughness[SGD_LOBES];
uniform highp sampler2D sgdEnvironment;

// G1(wo)/cosθo of each lobe, and the coordinate of cosθo in its table, in [0, 1].
SgdLobes sgdVisibilityO;
float sgdCoordinateO[SGD_LOBES];

// G1/cosθ, exact Smith masking, finite at grazing.
SgdLobes sgdVisibility(const in float cosTheta) {
  SgdLobes inverse = 1.0 / (cosTheta + sgdScale);
  SgdLobes t = sgdStretch * cosTheta * inverse - 1.0;
  return ${horner('sgdMasking', 't', MASKING_TERMS)} * inverse;
}

// D at tan²θ = x: D(0) e^{−x/α} (1 + x/α²)^{−p}/cos⁴θ.
SgdLobes sgdNdf(const in float x) {
  SgdLobes y = x / sgdAlpha;
  return sgdPeak * exp(-y - sgdP * log(1.0 + y / sgdAlpha)) * ((1.0 + x) * (1.0 + x));
}

// ρs F of lobes that weigh so much at cosθd.
vec3 sgdFresnel(const in float cosD, const in SgdLobes weights) {
  float m = 1.0 - cosD;
  float m5 = m * m * m * m * m;
  return sgdMix(sgdConstant, weights) + m5 * sgdMix(sgdSchlick, weights) + cosD * sgdMix(sgdCosine, weights);
}

// The albedo of a lobe: its moments for F = 1, (1 − cosθd)⁵ and cosθd.
vec3 sgdAlbedo(const in int lobe, const in vec3 moments) {
  return 4.0 * RECIPROCAL_PI * (sgdConstant[lobe] * moments.x + sgdSchlick[lobe] * moments.y + sgdCosine[lobe] * moments.z);
}

vec4 sgdTable(const in int row, const in float coordinate) {
  float column = coordinate * float(SGD_VIEWS - 1);
  int left = min(int(column), SGD_VIEWS - 2);
  vec4 low = texelFetch(sgdEnvironment, ivec2(left, row), 0);
  vec4 high = texelFetch(sgdEnvironment, ivec2(left + 1, row), 0);
  return mix(low, high, column - float(left));
}

#endif

void sgdSetView(const in vec3 normal, const in vec3 viewDir, const in vec3 tint) {
  sgdTint = tint;
  sgdCosO = saturate(dot(normal, viewDir));
  #if SGD_LOBES > 0
  sgdVisibilityO = sgdVisibility(sgdCosO);
  for (int j = 0; j < SGD_LOBES; j++) {
    sgdCoordinateO[j] = log(1.0 + sgdCosO / sgdViewScale[j]) / log(1.0 + 1.0 / sgdViewScale[j]);
  }
  #endif
}

// Σ (ρs/π) F D G1 G1/(cosθi cosθo). tan²θh comes from the half vector's components: 1 − cos² would
// lose a lobe as sharp as chrome's.
vec3 sgdSpecular(const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in float cosI) {
  #if SGD_LOBES > 0
  vec3 h = lightDir + viewDir;
  vec3 across = cross(normal, h);
  float along = dot(normal, h);
  float x = min(dot(across, across) / (along * along), 1e12);
  SgdLobes weights = sgdNdf(x) * sgdVisibilityO * sgdVisibility(cosI);
  return RECIPROCAL_PI * sgdFresnel(0.5 * length(h), weights);
  #else
  return vec3(0.0);
  #endif
}

void RE_Direct_SGD(const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight) {
  float cosI = saturate(dot(geometryNormal, directLight.direction));
  if (cosI == 0.0) return;
  vec3 irradiance = cosI * directLight.color * sgdTint;
  reflectedLight.directDiffuse += irradiance * BRDF_Lambert(sgdDiffuse);
  reflectedLight.directSpecular += irradiance * sgdSpecular(directLight.direction, geometryViewDir, geometryNormal, cosI);
}

void RE_IndirectDiffuse_SGD(const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight) {
  reflectedLight.indirectDiffuse += irradiance * sgdTint * BRDF_Lambert(sgdDiffuse);
}

#if SGD_LOBES > 0 && defined(USE_ENVMAP)

// Σ weight · the prefiltered map about one direction, level by level; absent levels weigh 0.
vec3 sgdLevels(const in int row, const in float coordinate, const in vec3 direction) {
  vec4 sharp = sgdTable(row, coordinate);
  vec4 wide = sgdTable(row + 1, coordinate);
  float weights[SGD_LEVELS] = float[](sharp.x, sharp.y, sharp.z, sharp.w, wide.x, wide.y);
  float levels[SGD_LEVELS] = float[](${LEVELS.map(level => level.toFixed(6)).join(', ')});
  vec3 sum = vec3(0.0);
  for (int level = 0; level < SGD_LEVELS; level++) {
    // The reflection of a direction about itself is itself.
    if (abs(weights[level]) > 1e-4) sum += weights[level] * getIBLRadiance(direction, direction, levels[level]);
  }
  return sum;
}

#endif

void RE_IndirectSpecular_SGD(const in vec3 radiance, const in vec3 irradiance, const in vec3 clearcoatRadiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight) {
  reflectedLight.indirectDiffuse += irradiance * sgdTint * BRDF_Lambert(sgdDiffuse);
  #if SGD_LOBES > 0 && defined(USE_ENVMAP)
  vec3 away = geometryNormal * sgdCosO - geometryViewDir;
  float sinO = length(away);
  vec3 tangent = away / max(sinO, 1e-10);
  float thetaO = atan(sinO, sgdCosO);
  for (int j = 0; j < SGD_LOBES; j++) {
    vec4 moments = sgdTable(SGD_ROWS * j, sgdCoordinateO[j]);
    float mean = sgdTable(SGD_ROWS * j + 2, sgdCoordinateO[j]).z * thetaO;
    vec3 light = vec3(0.0);
    for (int k = 0; k < 3; k++) {
      float angle = mean + (k == 0 ? 0.0 : k == 1 ? moments.w : -moments.w);
      vec3 direction = geometryNormal * cos(angle) + tangent * sin(angle);
      light += sgdLevels(SGD_ROWS * j + 1 + 2 * k, sgdCoordinateO[j], direction);
    }
    reflectedLight.indirectSpecular += sgdTint * sgdAlbedo(j, moments.xyz) * light;
  }
  #endif
}

#if NUM_RECT_AREA_LIGHTS > 0

// A lobe is a linearly transformed cosine, that of the GGX lobe as wide, as bright as the lobe.
void RE_Direct_RectArea_SGD(const in RectAreaLight rectAreaLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight) {
  vec3 lightPos = rectAreaLight.position;
  vec3 halfWidth = rectAreaLight.halfWidth;
  vec3 halfHeight = rectAreaLight.halfHeight;
  vec3 rectCoords[4];
  rectCoords[0] = lightPos + halfWidth - halfHeight;
  rectCoords[1] = lightPos - halfWidth - halfHeight;
  rectCoords[2] = lightPos - halfWidth + halfHeight;
  rectCoords[3] = lightPos + halfWidth + halfHeight;
  vec3 light = rectAreaLight.color * sgdTint;
  reflectedLight.directDiffuse += light * sgdDiffuse * LTC_Evaluate(geometryNormal, geometryViewDir, geometryPosition, mat3(1.0), rectCoords);
  #if SGD_LOBES > 0
  for (int j = 0; j < SGD_LOBES; j++) {
    vec3 albedo = sgdAlbedo(j, sgdTable(SGD_ROWS * j, sgdCoordinateO[j]).xyz);
    vec4 t1 = texture2D(ltc_1, LTC_Uv(geometryNormal, geometryViewDir, sgdRoughness[j]));
    mat3 mInv = mat3(vec3(t1.x, 0.0, t1.y), vec3(0.0, 1.0, 0.0), vec3(t1.z, 0.0, t1.w));
    reflectedLight.directSpecular += light * albedo * LTC_Evaluate(geometryNormal, geometryViewDir, geometryPosition, mInv, rectCoords);
  }
  #endif
}

#undef RE_Direct_RectArea
#define RE_Direct_RectArea RE_Direct_RectArea_SGD
#endif

#undef RE_Direct
#undef RE_IndirectDiffuse
#undef RE_IndirectSpecular
#define RE_Direct RE_Direct_SGD
#define RE_IndirectDiffuse RE_IndirectDiffuse_SGD
#define RE_IndirectSpecular RE_IndirectSpecular_SGD
`;
