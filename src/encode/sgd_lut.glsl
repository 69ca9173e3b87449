// Written by sgdbake (its shader version 2): evaluates a baked SGD material. Directions are unit vectors in the
// shading frame (normal +z). Texels are fetched and mixed in f32; a filtering sampler keeps the promised
// error too. Fill SgdRow from manifest.json. A material has up to three lobes; leave rho_s and ndf_peak of the
// others 0, and give them any of its Fresnel rows.

struct SgdRow {
    vec3 rho_d;             // diffuse
    float ndf_scale;        // axes[0].warp.scale[row] of `ndf`
    vec3 ndf_peak;          // one per lobe
    float ndf_max;          // axes[0].warp.max[row] of `ndf`
    mat3 rho_s;             // one column per lobe, RGB
    ivec3 fresnel_rows;     // one per lobe
    float masking_scale;    // axes[0].warp.scale[row] of `masking`
    int row;
};

const float SGD_INV_PI = 0.318309886;

// The texel at coordinate u between the centres of a row.
vec3 sgd_fetch(sampler2D lut, int row, float u) {
    int last = textureSize(lut, 0).x - 1;
    float position = clamp(u, 0.0, 1.0) * float(last);
    int left = min(int(position), last - 1);
    vec3 a = texelFetch(lut, ivec2(left, row), 0).rgb;
    vec3 b = texelFetch(lut, ivec2(left + 1, row), 0).rgb;
    return mix(a, b, position - float(left));
}

// ln(1 + x), exact to the last digits for small x, where the sum rounds.
float sgd_ln_1p(float x) {
    return x < 1e-3 ? x * (1.0 - x * (0.5 - x * (1.0 / 3.0))) : log(1.0 + x);
}

// D(h) of each lobe for tan^2(theta_h) = x.
vec3 sgd_ndf(sampler2D lut, SgdRow m, float x) {
    if (x >= m.ndf_max) return vec3(0.0);
    float u = sgd_ln_1p(x / m.ndf_scale) / sgd_ln_1p(m.ndf_max / m.ndf_scale);
    return m.ndf_peak * exp(max(sgd_fetch(lut, m.row, u), vec3(-80.0))) * (1.0 + x) * (1.0 + x);
}

// G1(w)/cos(theta) of each lobe: finite down to the horizon.
vec3 sgd_visibility(sampler2D lut, SgdRow m, vec3 w) {
    // u = cot/(cot + s) = cos/(cos + s sin), so u/cos = 1/(cos + s sin).
    float inv = 1.0 / (w.z + m.masking_scale * length(w.xy));
    return exp(sgd_fetch(lut, m.row, w.z * inv)) * inv;
}

// rho_s F/pi: a column per lobe, RGB. Lobes that share a row share the lookup.
mat3 sgd_color(sampler2D lut, SgdRow m, float cos_d) {
    ivec3 rows = m.fresnel_rows;
    vec3 a = sgd_fetch(lut, rows.x, cos_d);
    vec3 b = rows.y == rows.x ? a : sgd_fetch(lut, rows.y, cos_d);
    vec3 c = rows.z == rows.x ? a : sgd_fetch(lut, rows.z, cos_d);
    return SGD_INV_PI * mat3(m.rho_s[0] * a, m.rho_s[1] * b, m.rho_s[2] * c);
}

// f(wi, wo) [1/sr].
vec3 sgd_brdf(sampler2D ndf, sampler2D masking, sampler2D fresnel, SgdRow m, vec3 wi, vec3 wo) {
    if (min(wi.z, wo.z) <= 0.0) return vec3(0.0);
    vec3 h = wi + wo;
    vec2 slope = h.xy / h.z;
    vec3 d = sgd_ndf(ndf, m, dot(slope, slope));
    vec3 v = sgd_visibility(masking, m, wi) * sgd_visibility(masking, m, wo);
    return SGD_INV_PI * m.rho_d + sgd_color(fresnel, m, 0.5 * length(h)) * (d * v);
}

// f(wi, wo) [1/sr] from the 3D texture alone: SgdVolume holds the constants of its three axes.
struct SgdVolume {
    vec3 rho_d;
    float half_scale;       // axes[0].warp.scale[0]
    vec3 rho_s;             // the sum over the lobes
    float half_max;         // axes[0].warp.max[0]
    vec3 factor;            // encoding.factor
    float difference_scale; // axes[1].warp.scale[0]
};

// The texel of a 3D texture at coordinates u between the centres.
vec3 sgd_fetch_3d(sampler3D lut, vec3 u) {
    ivec3 last = textureSize(lut, 0) - 1;
    vec3 position = clamp(u, 0.0, 1.0) * vec3(last);
    ivec3 low = min(ivec3(position), last - 1);
    vec3 weight = position - vec3(low);
    vec3 planes[2];
    for (int z = 0; z < 2; z++) {
        vec3 rows[2];
        for (int y = 0; y < 2; y++) {
            vec3 a = texelFetch(lut, low + ivec3(0, y, z), 0).rgb;
            vec3 b = texelFetch(lut, low + ivec3(1, y, z), 0).rgb;
            rows[y] = mix(a, b, weight.x);
        }
        planes[z] = mix(rows[0], rows[1], weight.y);
    }
    return mix(planes[0], planes[1], weight.z);
}

vec3 sgd_brdf_3d(sampler3D lut, SgdVolume m, vec3 wi, vec3 wo) {
    if (min(wi.z, wo.z) <= 0.0) return vec3(0.0);
    vec3 h = wi + wo;
    vec2 slope = h.xy / h.z;
    float x = dot(slope, slope);
    float cos_d = min(0.5 * length(h), 1.0);
    // 2 sin(theta_d) = |wi - wo|, and 2 sin(theta_h) sin(theta_d) |cos(phi_d)| = |cos_i - cos_o|.
    float swing = sqrt(x / (1.0 + x)) * length(wi - wo);
    float cos_phi = swing == 0.0 ? 0.0 : min(abs(wi.z - wo.z) / swing, 1.0);
    vec3 u = vec3(
        sgd_ln_1p(min(x, m.half_max) / m.half_scale) / sgd_ln_1p(m.half_max / m.half_scale),
        sgd_ln_1p(cos_d / m.difference_scale) / sgd_ln_1p(1.0 / m.difference_scale),
        cos_phi);
    return SGD_INV_PI * (m.rho_d + m.rho_s * m.factor * sgd_fetch_3d(lut, u));
}
