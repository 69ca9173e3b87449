# SPDX-License-Identifier: GPL-3.0-or-later
"""The Principled BSDF that glTF reads and writes as pbrMetallicRoughness.

An imported one stays in the material's graph, unlinked: it has the artist's textures. For an
export one is linked to the output in place of what is there, and the graph is put back after.
"""

import bpy

from . import material

FIT_NODE = "SGD glTF Fit"
# Sockets of the Principled BSDF that the SGD group has too.
SHARED = ("Normal", "Emission Color", "Emission Strength", "Alpha")
# One call for each material that shows its fallback: puts the graph back.
_restores = []


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
    if _restores and not bpy.app.background:
        bpy.app.timers.register(restore_all, first_interval=0.0)  # after an export that failed, too


def restore_all():
    """Puts every graph back. The order is the reverse: nothing is left if one fails."""
    while _restores:
        _restores.pop()()


def _show(shown):
    graph = shown.node_tree
    made = []
    principled = graph.nodes.get(FIT_NODE)
    if principled is None or principled.type != "BSDF_PRINCIPLED":
        principled = _principled(graph, shown)
        made.append(principled.name)
    output = next((node for node in graph.nodes if node.type == "OUTPUT_MATERIAL" and node.is_active_output), None)
    if output is None:
        output = graph.nodes.new("ShaderNodeOutputMaterial")
        output.is_active_output = True
        made.append(output.name)
    surface = output.inputs["Surface"]
    before = [link.from_socket for link in surface.links]
    graph.links.new(principled.outputs[0], surface)
    _restores.append(lambda: _restore(graph, surface, before, made))


def _restore(graph, surface, before, made):
    for link in list(surface.links):
        graph.links.remove(link)
    for socket in before:
        graph.links.new(socket, surface)
    for name in made:
        graph.nodes.remove(graph.nodes[name])


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
