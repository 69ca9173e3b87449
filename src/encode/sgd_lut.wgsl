// Written by sgdbake (its shader version 2): evaluates a baked SGD material. Directions are unit vectors in the
// shading frame (normal +z). Texels are fetched and mixed in f32; a filtering sampler keeps the promised
// error too. Fill SgdRow from manifest.json. A material has up to three lobes; leave rho_s and ndf_peak of the
// others 0, and give them any of its Fresnel rows.

struct SgdRow {
    rho_d: vec3f,           // diffuse
    ndf_scale: f32,         // axes[0].warp.scale[row] of `ndf`
    ndf_peak: vec3f,        // one per lobe
    ndf_max: f32,           // axes[0].warp.max[row] of `ndf`
    rho_s: mat3x3f,         // one column per lobe, RGB
    fresnel_rows: vec3u,    // one per lobe
    masking_scale: f32,     // axes[0].warp.scale[row] of `masking`
    row: u32,
}

const SGD_INV_PI: f32 = 0.318309886;

// The texel at coordinate u between the centres of a row.
fn sgd_fetch(lut: texture_2d<f32>, row: u32, u: f32) -> vec3f {
    let last = textureDimensions(lut).x - 1u;
    let position = clamp(u, 0.0, 1.0) * f32(last);
    let left = min(u32(position), last - 1u);
    let a = textureLoad(lut, vec2u(left, row), 0).rgb;
    let b = textureLoad(lut, vec2u(left + 1u, row), 0).rgb;
    return mix(a, b, position - f32(left));
}

// ln(1 + x), exact to the last digits for small x, where the sum rounds.
fn sgd_ln_1p(x: f32) -> f32 {
    if (x < 1e-3) { return x * (1.0 - x * (0.5 - x * (1.0 / 3.0))); }
    return log(1.0 + x);
}

// D(h) of each lobe for tan^2(theta_h) = x.
fn sgd_ndf(lut: texture_2d<f32>, m: SgdRow, x: f32) -> vec3f {
    if (x >= m.ndf_max) { return vec3f(0.0); }
    let u = sgd_ln_1p(x / m.ndf_scale) / sgd_ln_1p(m.ndf_max / m.ndf_scale);
    return m.ndf_peak * exp(max(sgd_fetch(lut, m.row, u), vec3f(-80.0))) * (1.0 + x) * (1.0 + x);
}

// G1(w)/cos(theta) of each lobe: finite down to the horizon.
fn sgd_visibility(lut: texture_2d<f32>, m: SgdRow, w: vec3f) -> vec3f {
    // u = cot/(cot + s) = cos/(cos + s sin), so u/cos = 1/(cos + s sin).
    let inv = 1.0 / (w.z + m.masking_scale * length(w.xy));
    return exp(sgd_fetch(lut, m.row, w.z * inv)) * inv;
}

// rho_s F/pi: a column per lobe, RGB. Lobes that share a row share the lookup.
fn sgd_color(lut: texture_2d<f32>, m: SgdRow, cos_d: f32) -> mat3x3f {
    let rows = m.fresnel_rows;
    let a = sgd_fetch(lut, rows.x, cos_d);
    var b = a;
    if (rows.y != rows.x) { b = sgd_fetch(lut, rows.y, cos_d); }
    var c = a;
    if (rows.z != rows.x) { c = sgd_fetch(lut, rows.z, cos_d); }
    return SGD_INV_PI * mat3x3f(m.rho_s[0] * a, m.rho_s[1] * b, m.rho_s[2] * c);
}

// f(wi, wo) [1/sr].
fn sgd_brdf(ndf: texture_2d<f32>, masking: texture_2d<f32>, fresnel: texture_2d<f32>,
            m: SgdRow, wi: vec3f, wo: vec3f) -> vec3f {
    if (min(wi.z, wo.z) <= 0.0) { return vec3f(0.0); }
    let h = wi + wo;
    let slope = h.xy / h.z;
    let d = sgd_ndf(ndf, m, dot(slope, slope));
    let v = sgd_visibility(masking, m, wi) * sgd_visibility(masking, m, wo);
    return SGD_INV_PI * m.rho_d + sgd_color(fresnel, m, 0.5 * length(h)) * (d * v);
}

// f(wi, wo) [1/sr] from the 3D texture alone: SgdVolume holds the constants of its three axes.
struct SgdVolume {
    rho_d: vec3f,
    half_scale: f32,        // axes[0].warp.scale[0]
    rho_s: vec3f,           // the sum over the lobes
    half_max: f32,          // axes[0].warp.max[0]
    factor: vec3f,          // encoding.factor
    difference_scale: f32,  // axes[1].warp.scale[0]
}

// The texel of a 3D texture at coordinates u between the centres.
fn sgd_fetch_3d(lut: texture_3d<f32>, u: vec3f) -> vec3f {
    let last = textureDimensions(lut) - vec3u(1u);
    let position = clamp(u, vec3f(0.0), vec3f(1.0)) * vec3f(last);
    let low = min(vec3u(position), last - vec3u(1u));
    let weight = position - vec3f(low);
    var planes: array<vec3f, 2>;
    for (var z = 0u; z < 2u; z++) {
        var rows: array<vec3f, 2>;
        for (var y = 0u; y < 2u; y++) {
            let a = textureLoad(lut, low + vec3u(0u, y, z), 0).rgb;
            let b = textureLoad(lut, low + vec3u(1u, y, z), 0).rgb;
            rows[y] = mix(a, b, weight.x);
        }
        planes[z] = mix(rows[0], rows[1], weight.y);
    }
    return mix(planes[0], planes[1], weight.z);
}

fn sgd_brdf_3d(lut: texture_3d<f32>, m: SgdVolume, wi: vec3f, wo: vec3f) -> vec3f {
    if (min(wi.z, wo.z) <= 0.0) { return vec3f(0.0); }
    let h = wi + wo;
    let slope = h.xy / h.z;
    let x = dot(slope, slope);
    let cos_d = min(0.5 * length(h), 1.0);
    // 2 sin(theta_d) = |wi - wo|, and 2 sin(theta_h) sin(theta_d) |cos(phi_d)| = |cos_i - cos_o|.
    let swing = sqrt(x / (1.0 + x)) * length(wi - wo);
    let cos_phi = select(min(abs(wi.z - wo.z) / swing, 1.0), 0.0, swing == 0.0);
    let u = vec3f(
        sgd_ln_1p(min(x, m.half_max) / m.half_scale) / sgd_ln_1p(m.half_max / m.half_scale),
        sgd_ln_1p(cos_d / m.difference_scale) / sgd_ln_1p(1.0 / m.difference_scale),
        cos_phi);
    return SGD_INV_PI * (m.rho_d + m.rho_s * m.factor * sgd_fetch_3d(lut, u));
}
