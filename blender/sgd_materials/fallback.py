# SPDX-License-Identifier: GPL-3.0-or-later
"""The Principled BSDF that glTF reads and writes as pbrMetallicRoughness.

An imported one stays in the material's graph, unlinked: it has the artist's textures. For an
export one is linked to the output in place of what is there, and the graph is put back after.
"""

from dataclasses import dataclass

import bpy

from . import interface, material

FIT_NODE = "SGD glTF Fit"
# Sockets of the Principled BSDF that the SGD group has too.
SHARED = ("Normal", "Emission Color", "Emission Strength", "Alpha")
# Of each material that shows its fallback, what puts its graph back. Names, not references: an
# export that failed leaves them, and the file may change before they are used.
_before = []


@dataclass(frozen=True)
class Before:
    """What the surface of an output was linked to, and which nodes an export muted and added."""

    material: str
    library: str | None
    output: str
    sources: tuple
    muted: tuple
    added: tuple


def adopt(blender_material, source):
    """Gives an imported material the SGD group in place of its Principled BSDF, which stays for export."""
    graph = blender_material.node_tree
    principled = next(node for node in graph.nodes if node.type == "BSDF_PRINCIPLED")
    material.attach(blender_material, source, _read(principled))
    outgoing = [link.to_socket for link in principled.outputs[0].links]
    principled.name = principled.label = FIT_NODE
    for socket in outgoing:
        graph.links.remove(socket.links[0])
    material.show(blender_material)
    group = material.nodes(blender_material)[0]
    group.location = principled.location[0], principled.location[1] + 400
    for socket in outgoing:
        graph.links.new(group.outputs["Shader"], socket)
    for name in SHARED:
        _copy(graph, principled.inputs[name], group.inputs[name])


def show_all():
    """Links the fallback of every SGD material. One that cannot be is left as it is."""
    restore_all()
    for each in material.sgd_materials():
        if each.node_tree is not None:
            _show(each)
    if _before and not bpy.app.background:
        bpy.app.timers.register(restore_all, first_interval=0.0)  # after an export that failed, too


@bpy.app.handlers.persistent
def restore_all(*_):
    """Puts every graph back."""
    while _before:
        _restore(_before.pop())


def _show(shown):
    graph, added = shown.node_tree, []
    principled = graph.nodes.get(FIT_NODE)
    if principled is None or principled.type != "BSDF_PRINCIPLED":
        principled = _principled(graph, shown)
        added.append(principled.name)
    output = next((node for node in graph.nodes if node.type == "OUTPUT_MATERIAL" and node.is_active_output), None)
    if output is None:
        output = graph.nodes.new("ShaderNodeOutputMaterial")
        output.is_active_output = True
        added.append(output.name)
    surface = output.inputs["Surface"]
    sources = tuple((link.from_node.name, link.from_socket.identifier) for link in surface.links)
    library = shown.library.filepath if shown.library else None
    muted = _groups(graph)
    _before.append(Before(shown.name, library, output.name, sources, tuple(node.name for node in muted), tuple(added)))
    for node in muted:
        node.mute = True
    graph.links.new(principled.outputs[0], surface)


def _restore(before):
    shown = bpy.data.materials.get((before.material, before.library))
    if shown is None or shown.node_tree is None:
        return
    graph = shown.node_tree
    output = graph.nodes.get(before.output)
    for link in list(output.inputs["Surface"].links) if output else ():
        graph.links.remove(link)
    for name, identifier in before.sources if output else ():
        if (socket := _output(graph.nodes.get(name), identifier)) is not None:
            graph.links.new(socket, output.inputs["Surface"])
    for name in before.muted:
        if name in graph.nodes:
            graph.nodes[name].mute = False
    for name in before.added:
        if name in graph.nodes:
            graph.nodes.remove(graph.nodes[name])


def _groups(graph):
    """The nodes that are or hold an SGD group: the exporter looks into groups that are not muted."""
    return [node for node in graph.nodes if node.type == "GROUP" and not node.mute
            and (interface.is_group(node) or interface.groups_in(node.node_tree))]


def _output(node, identifier):
    return next((each for each in node.outputs if each.identifier == identifier), None) if node else None


@bpy.app.handlers.persistent
def forget(*_):
    """Another file is open: there is nothing to put back."""
    _before.clear()


def _principled(graph, shown):
    """A Principled BSDF of the material's fit, with the group's normal, emission and opacity."""
    node, fit = graph.nodes.new("ShaderNodeBsdfPrincipled"), material.fit_of(shown)
    for name, value in _sockets(fit).items():
        node.inputs[name].default_value = value
    group = next((each for each in material.nodes(shown) if each.id_data == graph), None)
    for name in SHARED if group else ():
        _copy(graph, group.inputs[name], node.inputs[name])
    return node


def _copy(graph, source, target):
    """The link or else the value of a socket, for another one."""
    if source.is_linked:
        graph.links.new(source.links[0].from_socket, target)
    elif source.name != "Normal":
        target.default_value = source.default_value


def _sockets(fit):
    return {
        "Base Color": (*fit["base_color"], 1.0),
        "Metallic": fit["metallic"],
        "Roughness": fit["roughness"],
        "IOR": 1.5,
        "Specular IOR Level": 0.5 * fit["specular_factor"],
        "Specular Tint": (*fit["specular_color"], 1.0),
        "Coat Weight": fit.get("clearcoat") or 0.0,
        "Coat Roughness": fit.get("clearcoat_roughness") or 0.0,
    }


def _read(node):
    """The fit that a Principled BSDF of Blender's glTF importer holds."""
    def value(name):
        return node.inputs[name].default_value

    return {
        "base_color": list(value("Base Color"))[:3],
        "metallic": value("Metallic"),
        "roughness": value("Roughness"),
        "specular_factor": 2.0 * value("Specular IOR Level"),
        "specular_color": list(value("Specular Tint"))[:3],
        "clearcoat": value("Coat Weight"),
        "clearcoat_roughness": value("Coat Roughness"),
    }


def register():
    bpy.app.handlers.save_pre.append(restore_all)
    bpy.app.handlers.load_post.append(forget)


def unregister():
    restore_all()
    bpy.app.handlers.load_post.remove(forget)
    bpy.app.handlers.save_pre.remove(restore_all)
