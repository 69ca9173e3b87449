"""Runs sgd_lut.wgsl (Vulkan, through wgpu) and sgd_lut.glsl (OpenGL) on thousands of pairs of
directions and checks what they return against `sgdbake eval`, within the bake's tolerance.

    python run_shaders.py SGDBAKE BAKE_DIR [--viewers N] [--lights N]

A software device will do: Debian's mesa-vulkan-drivers and libgl1-mesa-dri bring one.
"""

import argparse
import pathlib
import sys

import moderngl
import numpy as np
import wgpu

import lut_reader

WGSL_2D = """
@group(0) @binding(0) var<storage, read> directions: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> result: array<vec4f>;
@group(0) @binding(2) var<uniform> material: SgdRow;
@group(0) @binding(3) var ndf: texture_2d<f32>;
@group(0) @binding(4) var masking: texture_2d<f32>;
@group(0) @binding(5) var fresnel: texture_2d<f32>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= arrayLength(&result)) { return; }
    let wi = directions[2u * id.x].xyz;
    let wo = directions[2u * id.x + 1u].xyz;
    result[id.x] = vec4f(sgd_brdf(ndf, masking, fresnel, material, wi, wo), 1.0);
}
"""

WGSL_3D = """
@group(0) @binding(0) var<storage, read> directions: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> result: array<vec4f>;
@group(0) @binding(2) var<uniform> material: SgdVolume;
@group(0) @binding(3) var volume: texture_3d<f32>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= arrayLength(&result)) { return; }
    let wi = directions[2u * id.x].xyz;
    let wo = directions[2u * id.x + 1u].xyz;
    result[id.x] = vec4f(sgd_brdf_3d(volume, material, wi, wo), 1.0);
}
"""

GLSL_HEAD = """#version 450
in vec3 in_wi; in vec3 in_wo; out vec3 result;
"""
ROW = ("rho_d", "ndf_scale", "ndf_peak", "ndf_max", "rho_s", "fresnel_rows", "masking_scale", "row")
VOLUME = ("rho_d", "half_scale", "rho_s", "half_max", "factor", "difference_scale")


class Bake:
    """A bake as textures and the numbers that a shader takes for one of its materials."""

    def __init__(self, folder):
        self.decoder = lut_reader.Decoder(folder)
        self.wgsl = (folder / "sgd_lut.wgsl").read_text()
        self.glsl = (folder / "sgd_lut.glsl").read_text()

    def inputs(self, material):
        """Texels as float32 RGBA, shaped depth x height x width x 4, and the constants."""
        row = material["row"]
        rho_s = np.zeros((3, 3))
        rho_s[: len(material["lobes"])] = [lobe["rho_s"] for lobe in material["lobes"]]
        if not self.decoder.entries:
            entry = self.decoder.volumes[row]
            half, difference = (axis["warp"] for axis in entry["axes"][:2])
            constants = {"rho_d": material["diffuse"], "rho_s": rho_s.sum(axis=0), "half_scale": half["scale"][0], "half_max": half["max"][0],
                         "factor": entry["encoding"]["factor"],
                         "difference_scale": difference["scale"][0]}
            return [self.rgba(entry)], {key: constants[key] for key in VOLUME}
        entries = [self.decoder.entries[q] for q in ("ndf", "masking", "fresnel")]
        ndf, masking = (entry["axes"][0]["warp"] for entry in entries[:2])
        rows = material["fresnel_rows"]
        constants = {"rho_d": material["diffuse"], "ndf_scale": ndf["scale"][row],
                     "ndf_peak": lut_reader.three(material["ndf_peak"]), "ndf_max": ndf["max"][row],
                     "rho_s": rho_s, "fresnel_rows": np.int32(rows + rows[:1] * (3 - len(rows))),
                     "masking_scale": masking["scale"][row], "row": np.int32(row)}
        return [self.rgba(entry) for entry in entries], {key: constants[key] for key in ROW}

    def rgba(self, entry):
        texels = self.decoder.texels[entry["file"]].astype(np.float32)
        depth = entry["size"][2] if len(entry["size"]) == 3 else 1
        rgba = np.ones((*texels.shape[:2], 4), np.float32)
        rgba[..., :3] = texels
        return rgba.reshape(depth, -1, entry["size"][0], 4)


def words(constant):
    """A constant as bytes of a uniform: the columns of a matrix start at multiples of sixteen bytes."""
    constant = np.asarray(constant)
    if constant.ndim == 2:
        constant = np.pad(constant, ((0, 0), (0, 1)))
    integer = np.issubdtype(constant.dtype, np.integer)
    return constant.astype(np.int32 if integer else np.float32).tobytes()


def packed(constants):
    """The uniform as WGSL lays it out: a vec3 and a scalar fill sixteen bytes."""
    bytes = b"".join(words(constant) for constant in constants.values())
    return bytes + b"\0" * (-len(bytes) % 16)


def run_wgsl(device, bake, material, wi, wo):
    textures, constants = bake.inputs(material)
    code = bake.wgsl + (WGSL_2D if "row" in constants else WGSL_3D)
    pairs = np.ones((2 * len(wi), 4), np.float32)
    pairs[0::2, :3], pairs[1::2, :3] = wi, wo
    usage = wgpu.BufferUsage
    result = device.create_buffer(size=16 * len(wi), usage=usage.STORAGE | usage.COPY_SRC)
    resources = [
        {"buffer": device.create_buffer_with_data(data=pairs, usage=usage.STORAGE)},
        {"buffer": result},
        {"buffer": device.create_buffer_with_data(data=packed(constants), usage=usage.UNIFORM)},
    ]
    resources += [upload(device, texels, "2d" if "row" in constants else "3d") for texels in textures]
    module = device.create_shader_module(code=code)
    pipeline = device.create_compute_pipeline(layout="auto", compute={"module": module, "entry_point": "main"})
    entries = [{"binding": i, "resource": resource} for i, resource in enumerate(resources)]
    group = device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries)
    encoder = device.create_command_encoder()
    compute = encoder.begin_compute_pass()
    compute.set_pipeline(pipeline)
    compute.set_bind_group(0, group)
    compute.dispatch_workgroups((len(wi) + 63) // 64)
    compute.end()
    device.queue.submit([encoder.finish()])
    return np.frombuffer(device.queue.read_buffer(result), np.float32).reshape(-1, 4)[:, :3]


def upload(device, texels, dimension):
    depth, height, width, _ = texels.shape
    usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
    texture = device.create_texture(size=(width, height, depth), dimension=dimension,
                                    format="rgba32float", usage=usage)
    layout = {"bytes_per_row": 16 * width, "rows_per_image": height}
    device.queue.write_texture({"texture": texture}, texels, layout, (width, height, depth))
    return texture.create_view()


def run_glsl(context, bake, material, wi, wo):
    textures, constants = bake.inputs(material)
    flat = "row" in constants
    if flat:
        names, struct = ["ndf", "masking", "fresnel"], "SgdRow"
        call = "sgd_brdf(ndf, masking, fresnel, material, in_wi, in_wo)"
        uniforms = "uniform sampler2D ndf, masking, fresnel;"
    else:
        names, struct, call = ["volume"], "SgdVolume", "sgd_brdf_3d(volume, material, in_wi, in_wo)"
        uniforms = "uniform sampler3D volume;"
    code = f"{GLSL_HEAD}{uniforms}\n{bake.glsl}\nuniform {struct} material;\nvoid main() {{ result = {call}; }}"
    program = context.program(vertex_shader=code, varyings=["result"])
    for key, value in constants.items():
        value = np.ravel(value).tolist()
        program[f"material.{key}"].value = tuple(value) if len(value) > 1 else value[0]
    for unit, (name, texels) in enumerate(zip(names, textures)):
        depth, height, width, _ = texels.shape
        make = context.texture if flat else context.texture3d
        size = (width, height) if flat else (width, height, depth)
        texture = make(size, 4, texels.tobytes(), dtype="f4")
        texture.use(unit)
        program[name].value = unit
    pairs = context.buffer(np.hstack([wi, wo]).astype(np.float32).tobytes())
    result = context.buffer(reserve=12 * len(wi))
    vertices = context.vertex_array(program, [(pairs, "3f 3f", "in_wi", "in_wo")])
    vertices.transform(result, moderngl.POINTS, len(wi))
    return np.frombuffer(result.read(), np.float32).reshape(-1, 3)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("sgdbake")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--viewers", type=int, default=60)
    parser.add_argument("--lights", type=int, default=100)
    arguments = parser.parse_args()
    bake = Bake(arguments.folder)
    tolerance = max(t["error"]["tolerance"] for t in bake.decoder.manifest["textures"])
    adapter = wgpu.gpu.request_adapter_sync()
    device = adapter.request_device_sync()
    context = moderngl.create_standalone_context(backend="egl")
    # Without a window there is no framebuffer, and OpenGL draws nothing without one.
    context.simple_framebuffer((1, 1)).use()
    print(f"wgsl on {adapter.info['device']}, glsl on {context.info['GL_RENDERER']}")
    rng = np.random.default_rng(3)
    broken = False
    for material in bake.decoder.manifest["materials"]:
        if material["row"] is None:
            print(f"{material['name']}: no visible lobe, so nothing to look up")
            continue
        wi, wo = lut_reader.pairs(rng, material, arguments.viewers, arguments.lights)
        wi, wo = (w.astype(np.float32).astype(np.float64) for w in (wi, wo))
        unit = [w / np.linalg.norm(w, axis=1, keepdims=True) for w in (wi, wo)]
        f = lut_reader.exact(arguments.sgdbake, material["name"], "exact", wi, wo)
        reflected = np.abs(f) * wi[:, 2:]
        most = reflected.reshape(arguments.viewers, arguments.lights, 3).max(axis=1)
        bound = np.repeat(most, arguments.lights, axis=0) + reflected
        # What it costs that single-precision directions are not quite of unit length: much for a
        # lobe a quarter of a degree wide seen at grazing, nothing elsewhere.
        decode = bake.decoder.brdf
        rounding = np.abs(decode(material, wi, wo, False) - decode(material, *unit, False))
        for language, run, on in (("wgsl", run_wgsl, device), ("glsl", run_glsl, context)):
            decoded = run(on, bake, material, wi, wo)
            assert np.isfinite(decoded).all(), (material["name"], language)
            off = np.maximum(np.abs(decoded - f) - 2 * rounding, 0)
            error = (off * wi[:, 2:] / bound).max()
            print(f"{material['name']} {language}: {len(wi)} pairs, largest error {error:.3e}, "
                  f"promised {tolerance:.0e}")
            broken |= error > tolerance
    sys.exit(int(broken))


if __name__ == "__main__":
    main()
