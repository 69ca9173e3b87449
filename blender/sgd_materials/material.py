# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender material that keeps its SGD description and shows it in one of four modes."""

import json

import bpy

from . import groups, images
from .manifest import FormatError, Material, Texture

MODES = (
    ("FIT", "glTF Fit", "Principled BSDF with the best-fit glTF material: any engine, and what glTF exports"),
    ("LOBES", "Lobes (OSL)", "Path-traced Beckmann lobes: Cycles on the CPU with Open Shading Language"),
    ("PLAIN", "Lobes (Nodes)", "The lobes as Glossy nodes, Fresnel at the shading normal: any engine, GPU too"),
    ("SUN", "Exact Under a Sun", "The baked textures evaluated for one sun, shown as emission"),
)
BUILDERS = {"LOBES": groups.osl_lobes, "PLAIN": groups.plain_lobes, "SUN": groups.under_a_sun}
LABELS = {identifier: label for identifier, label, _ in MODES}
FIT_NODE = "SGD glTF Fit"
PROPERTY = "sgd_material"


class SGDTexture(bpy.types.PropertyGroup):
    """One lookup texture of a material: its image and its description as JSON."""

    image: bpy.props.PointerProperty(type=bpy.types.Image)
    entry: bpy.props.StringProperty()


class SGDMaterial(bpy.types.PropertyGroup):
    """What a Blender material knows of the SGD material that it shows."""

    description: bpy.props.StringProperty(description="The material as JSON; empty for any other material")
    textures: bpy.props.CollectionProperty(type=SGDTexture)
    mode: bpy.props.EnumProperty(name="Mode", items=MODES, update=lambda self, context: show(self.id_data))
    problem: bpy.props.StringProperty(description="Why the chosen mode cannot be shown; empty when it is")
    sun: bpy.props.PointerProperty(
        name="Sun", type=bpy.types.Object, description="The sun that lights the material in Exact Under a Sun",
        poll=lambda self, thing: thing.type == "LIGHT" and thing.data.type == "SUN",
        update=lambda self, context: show(self.id_data))


def is_sgd(material):
    return material is not None and bool(getattr(material, PROPERTY).description)


def description(material):
    return json.loads(getattr(material, PROPERTY).description)


def create(source, mode):
    """A new Blender material from a manifest's material, or none and FormatError."""
    material = bpy.data.materials.new(source.name)
    if material.node_tree is None:
        material.use_nodes = True
    try:
        attach(material, source)
        _write_fit(_fit_node(material), source.gltf)
        set_mode(material, mode)
    except FormatError:
        bpy.data.materials.remove(material)
        raise
    return material


def attach(material, source):
    """Gives a Blender material, with its Principled fit, the SGD description and textures."""
    _fit_node(material).name = FIT_NODE
    # The correction bends normals that the measured lobes already account for.
    material.cycles.use_bump_map_correction = False
    state = getattr(material, PROPERTY)
    state.textures.clear()
    for texture in source.textures:
        item = state.textures.add()
        item.name, item.image, item.entry = texture.quantity, images.load(texture), json.dumps(texture.entry)
    state.description = json.dumps(source.description)


def detach_source(material):
    """The SGD material as it was read, its textures as bytes."""
    textures = tuple(Texture(item.name, json.loads(item.entry), data=images.image_bytes(item.image))
                     for item in getattr(material, PROPERTY).textures)
    return Material(description(material), textures)


def set_mode(material, mode):
    """Chooses a mode, or raises FormatError and shows the fit."""
    state = getattr(material, PROPERTY)
    state.mode = mode
    if state.problem:
        raise FormatError(state.problem)


def show(material):
    """Shows the chosen mode; one that cannot be built leaves its reason and shows the fit."""
    state = getattr(material, PROPERTY)
    if not state.description:
        return
    state.problem = ""
    try:
        link(material, state.mode)
        if state.mode == "SUN":
            _follow(_mode_node(material, "SUN"), state.sun or _first_sun())
    except FormatError as error:
        state.problem = str(error)
        link(material, "FIT")


def link(material, mode):
    """Links a mode's node to the material's output without choosing that mode."""
    node = _fit_node(material) if mode == "FIT" else _mode_node(material, mode)
    tree = material.node_tree
    tree.links.new(node.outputs[0], tree.get_output_node("ALL").inputs["Surface"])


def _fit_node(material):
    nodes = material.node_tree.nodes
    return nodes.get(FIT_NODE) or next(node for node in nodes if node.type == "BSDF_PRINCIPLED")


def _mode_node(material, mode):
    nodes, label = material.node_tree.nodes, f"SGD {LABELS[mode]}"
    if label in nodes:
        return nodes[label]
    state = getattr(material, PROPERTY)
    textures = {item.name: (item.image, json.loads(item.entry)) for item in state.textures}
    about = json.loads(state.description)
    tree = BUILDERS[mode](f"SGD {about['name']} {LABELS[mode]}", about, textures)
    node = nodes.new("ShaderNodeGroup")
    node.name = node.label = label
    node.node_tree, node.location = tree, (0, -700 - 150 * list(BUILDERS).index(mode))
    return node


def _write_fit(node, gltf):
    """glTF metallic-roughness with KHR_materials_specular and clearcoat, as the Principled BSDF has them."""
    values = {
        "Base Color": (*gltf["base_color"], 1.0),
        "Metallic": gltf["metallic"],
        "Roughness": gltf["roughness"],
        "IOR": 1.5,
        "Specular IOR Level": 0.5 * gltf["specular_factor"],
        "Specular Tint": (*gltf["specular_color"], 1.0),
        "Coat Weight": gltf.get("clearcoat") or 0.0,
        "Coat Roughness": gltf.get("clearcoat_roughness") or 0.0,
    }
    for name, value in values.items():
        node.inputs[name].default_value = value


def _first_sun():
    return next((thing for thing in bpy.data.objects if thing.type == "LIGHT" and thing.data.type == "SUN"), None)


def _follow(node, sun):
    """Drives the group's inputs by the sun: its +z axis, and its strength times its colour."""
    direction, irradiance = node.inputs["Sun Direction"], node.inputs["Irradiance"]
    if sun is None:
        direction.default_value, irradiance.default_value = (0.0, 0.0, 1.0), (1.0, 1.0, 1.0)
        return
    for axis in range(3):
        _drive(direction, axis, sun, "z", {"z": f"matrix_world[2][{axis}]"})
        _drive(irradiance, axis, sun, "e * c", {"e": "data.energy", "c": f"data.color[{axis}]"})


def _drive(socket, index, sun, expression, paths):
    socket.driver_remove("default_value", index)
    driver = socket.driver_add("default_value", index).driver
    for name, path in paths.items():
        variable = driver.variables.new()
        variable.name = name
        variable.targets[0].id, variable.targets[0].data_path = sun, path
    driver.expression = expression


CLASSES = (SGDTexture, SGDMaterial)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    setattr(bpy.types.Material, PROPERTY, bpy.props.PointerProperty(type=SGDMaterial))


def unregister():
    delattr(bpy.types.Material, PROPERTY)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
