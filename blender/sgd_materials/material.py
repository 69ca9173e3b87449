# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender material that keeps its SGD description and shows it in one of four modes.

A node group stands for the material in the artist's graph. A mode is another tree in the same
node; every link to and from it stays.
"""

import hashlib
import json
from dataclasses import dataclass

import bpy

from . import groups, images, interface, sun
from .manifest import FormatError, Material, Texture
from .manifest import description as checked

MODES = (
    ("LOBES", "Lobes (OSL)", "Path-traced Beckmann lobes: Cycles with Open Shading Language. Eevee shows the glTF fit"),
    ("PLAIN", "Lobes (Nodes)", "The lobes as Glossy nodes, Fresnel at the shading normal: any engine, GPU too"),
    ("FIT", "glTF Fit", "Principled BSDF with the best-fit glTF material: any engine, and what glTF exports"),
    ("SUN", "Exact Under a Sun", "The baked textures evaluated for one sun, shown as emission"),
)
BUILDERS = {"FIT": groups.fit, "LOBES": groups.osl_lobes, "PLAIN": groups.plain_lobes, "SUN": groups.under_a_sun}
LABELS = {identifier: label for identifier, label, _ in MODES}
EEVEE_OUTPUT = "Material Output (Eevee)"
PROPERTY = "sgd_material"
# Of a material whose fit is not known: Principled's own.
PLAIN_FIT = {"base_color": [0.8, 0.8, 0.8], "metallic": 0.0, "roughness": 0.5, "specular_factor": 1.0,
             "specular_color": [1.0, 1.0, 1.0]}


class SGDTexture(bpy.types.PropertyGroup):
    """One lookup texture of a material: its image and its description as JSON."""

    image: bpy.props.PointerProperty(type=bpy.types.Image)
    entry: bpy.props.StringProperty()


class SGDMaterial(bpy.types.PropertyGroup):
    """What a Blender material knows of the SGD material that it shows."""

    description: bpy.props.StringProperty(description="The material as JSON; empty for any other material")
    fit: bpy.props.StringProperty(description="The best-fit glTF material as JSON")
    textures: bpy.props.CollectionProperty(type=SGDTexture)
    mode: bpy.props.EnumProperty(name="Mode", items=MODES, description="How the measured material is shown",
                                 update=lambda self, context: show(self.id_data))
    problem: bpy.props.StringProperty(description="Why the chosen mode cannot be shown; empty when it is")
    sun: bpy.props.PointerProperty(
        name="Sun", type=bpy.types.Object,
        description="The sun that lights the material in Exact Under a Sun; the scene's first where none is chosen",
        poll=lambda self, thing: sun.is_sun(thing), update=lambda self, context: show(self.id_data))


@dataclass(frozen=True)
class Shown:
    """A material's values for the node groups: `textures` has (image, entry) by quantity."""

    description: dict
    fit: dict
    textures: dict


def is_sgd(material):
    return material is not None and bool(getattr(material, PROPERTY).description)


def description(material):
    about = json.loads(getattr(material, PROPERTY).description)
    return checked(about, about.get("name", material.name))


def sgd_materials():
    return [each for each in bpy.data.materials if is_sgd(each)]


def create(source, mode):
    """A Blender material of a manifest's material, or none and FormatError.

    A material of this file that already has the same description is taken as it is.
    """
    if (present := find(source)) is not None:
        return present
    material = bpy.data.materials.new(source.name)
    if material.node_tree is None:
        material.use_nodes = True
    material.use_fake_user = True  # a material that no object wears yet is saved too
    material.node_tree.nodes.remove(next(each for each in material.node_tree.nodes if each.type == "BSDF_PRINCIPLED"))
    try:
        attach(material, source, source.gltf or PLAIN_FIT)
        set_mode(material, mode)
    except FormatError:
        bpy.data.materials.remove(material)
        raise
    material.diffuse_color = (*fit_of(material)["base_color"], 1.0)
    return material


def fit_of(material):
    return json.loads(getattr(material, PROPERTY).fit or "null") or PLAIN_FIT


def find(source):
    """The material of this file that a source was imported as."""
    text = json.dumps(source.description)
    return next((each for each in sgd_materials()
                 if each.library is None and getattr(each, PROPERTY).description == text), None)


def attach(material, source, fit):
    """Gives a Blender material the SGD description, the fit and the textures."""
    loaded = [(texture, images.load(texture)) for texture in source.textures]
    # The correction bends normals that the measured lobes already account for.
    material.cycles.use_bump_map_correction = False
    state = getattr(material, PROPERTY)
    state.textures.clear()
    for texture, image in loaded:
        item = state.textures.add()
        item.name, item.image, item.entry = texture.quantity, image, json.dumps(texture.entry)
    state.fit, state.description = json.dumps(fit), json.dumps(source.description)


def detach_source(material):
    """The SGD material as it was read, its textures as bytes; FormatError where one is missing."""
    textures = tuple(Texture(item.name, json.loads(item.entry), data=images.image_bytes(item.image))
                     for item in getattr(material, PROPERTY).textures)
    return Material(description(material), textures)


def missing_textures(material):
    return [item.name for item in getattr(material, PROPERTY).textures if not images.available(item.image)]


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
        tree = group(material, state.mode)
    except FormatError as error:
        state.problem = str(error)
        tree = group(material, "FIT")
    for node in nodes(material) or [_place(material, tree)]:
        node.node_tree = tree


def nodes(material):
    """The SGD group nodes of a material's graph."""
    return interface.groups_in(material.node_tree)


def group(material, mode):
    """The node group of a mode, built where this file has none that is the same."""
    state = getattr(material, PROPERTY)
    source = Shown(description(material), fit_of(material),
                   {item.name: (item.image, json.loads(item.entry)) for item in state.textures})
    light = sun.followed(state) if mode == "SUN" else None
    key = _key(source, mode)
    for tree in bpy.data.node_groups:
        if tree.library is None and tree.get(interface.KEY) == key and (mode != "SUN" or sun.drives(tree, light)):
            if mode != "SUN" or not missing_textures(material):
                return tree
    shell = interface.Shell(f"SGD {source.description['name']} {LABELS[mode]}", mode, key)
    try:
        BUILDERS[mode](shell, source)
    except FormatError:
        bpy.data.node_groups.remove(shell.tree)
        raise
    if mode == "SUN":
        sun.follow(shell.tree, light)
    return shell.tree


def _key(source, mode):
    images_used = [image.name for image, _ in source.textures.values() if image] if mode == "SUN" else []
    text = json.dumps([interface.REVISION, mode, source.description, source.fit, images_used], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _place(material, tree):
    """A new group node, linked to every output that shows nothing."""
    graph = material.node_tree
    node = graph.nodes.new("ShaderNodeGroup")
    node.name = node.label = f"SGD {description(material)['name']}"
    node.node_tree, node.width = tree, 220
    _outputs(graph)
    for output in graph.nodes:
        if output.type == "OUTPUT_MATERIAL" and not output.inputs["Surface"].is_linked:
            name = "Eevee" if output.target == "EEVEE" else "Shader"
            graph.links.new(node.outputs[name], output.inputs["Surface"])
    return node


def _outputs(graph):
    """Adds what is missing of an output for any engine and one for Eevee alone."""
    targets = {each.target: each for each in graph.nodes if each.type == "OUTPUT_MATERIAL"}
    if not targets.keys() - {"EEVEE"}:
        targets["ALL"] = graph.nodes.new("ShaderNodeOutputMaterial")
        targets["ALL"].location = (300, 300)
    if "EEVEE" not in targets:
        eevee = graph.nodes.new("ShaderNodeOutputMaterial")
        eevee.target, eevee.name, eevee.label, eevee.location = "EEVEE", EEVEE_OUTPUT, EEVEE_OUTPUT, (300, 100)
        eevee.is_active_output = False


CLASSES = (SGDTexture, SGDMaterial)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    setattr(bpy.types.Material, PROPERTY, bpy.props.PointerProperty(type=SGDMaterial))


def unregister():
    delattr(bpy.types.Material, PROPERTY)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
