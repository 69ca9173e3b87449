# SPDX-License-Identifier: GPL-3.0-or-later
"""The sockets of an SGD group node: the same in every mode, so that links survive a change of mode."""

from dataclasses import dataclass

import bpy

from .graph import Graph

# Changes with what the groups contain: groups of an older revision are built again.
REVISION = 1
KEY, MODE = "sgd_key", "sgd_mode"


@dataclass(frozen=True)
class Input:
    name: str
    kind: str
    value: object
    about: str
    subtype: str = "NONE"
    range: tuple = ()


INPUTS = (
    Input("Normal", "NodeSocketVector", (0.0, 0.0, 0.0), "Shading normal, from a Bump or Normal Map node"),
    Input("Tint", "NodeSocketColor", (1.0, 1.0, 1.0, 1.0), "Multiplies the reflection. Any but white is not measured"),
    Input("Specular", "NodeSocketFloat", 1.0, "Scales the specular part. Any but 1 is not measured", range=(0.0, 10.0)),
    Input("Diffuse", "NodeSocketFloat", 1.0, "Scales the diffuse part. Any but 1 is not measured", range=(0.0, 10.0)),
    Input("Roughness Scale", "NodeSocketFloat", 1.0,
          "Stretches the slopes of the microfacets. Any but 1 is not measured", range=(0.01, 100.0)),
    Input("Emission Color", "NodeSocketColor", (1.0, 1.0, 1.0, 1.0), "Colour of light that is added"),
    Input("Emission Strength", "NodeSocketFloat", 0.0, "Strength of light that is added", range=(0.0, 1e6)),
    Input("Alpha", "NodeSocketFloat", 1.0, "Opacity: 0 is transparent", "FACTOR", (0.0, 1.0)),
)
MEASURED = ("Tint", "Specular", "Diffuse", "Roughness Scale")
OUTPUTS = (("Shader", "For Cycles, and any output that has no engine of its own"),
           ("Eevee", "For a Material Output with target Eevee"))


class Shell:
    """A new group with the common sockets; the inputs as values for the graph within."""

    def __init__(self, name, mode, key):
        self.tree = bpy.data.node_groups.new(name, "ShaderNodeTree")
        self.tree[KEY], self.tree[MODE] = key, mode
        for name, about in OUTPUTS:
            self.tree.interface.new_socket(name, description=about, in_out="OUTPUT", socket_type="NodeSocketShader")
        for each in INPUTS:
            _declare(self.tree, each)
        self.graph = Graph(self.tree)
        self.inputs = self.graph.node("NodeGroupInput").outputs
        self.normal = self._normal()

    def __getitem__(self, name):
        return self.inputs[name]

    def finish(self, cycles, eevee=None):
        """Adds emission and transparency to the reflection, and links it to the outputs."""
        output = self.graph.node("NodeGroupOutput")
        whole = self._whole(cycles)
        self.graph.connect(output.inputs["Shader"], whole)
        self.graph.connect(output.inputs["Eevee"], whole if eevee is None else self._whole(eevee))
        return self.tree

    def _normal(self):
        """The linked normal; an input without a link is 0, and stands for the surface's own."""
        graph, given = self.graph, self["Normal"]
        own = graph.node("ShaderNodeNewGeometry").outputs["Normal"]
        unlinked = graph.math("LESS_THAN", graph.vector("LENGTH", given), 1e-6)
        return graph.vector("NORMALIZE", graph.vector("ADD", given, graph.scale(own, unlinked)))

    def _whole(self, reflection):
        graph = self.graph
        emission = graph.node("ShaderNodeEmission")
        graph.connect(emission.inputs["Color"], self["Emission Color"])
        graph.connect(emission.inputs["Strength"], self["Emission Strength"])
        opaque = graph.add_shaders([reflection, emission.outputs[0]])
        return graph.mix_shaders(self["Alpha"], graph.node("ShaderNodeBsdfTransparent").outputs[0], opaque)


def _declare(tree, each):
    socket = tree.interface.new_socket(each.name, description=each.about, in_out="INPUT", socket_type=each.kind)
    socket.default_value = each.value
    socket.hide_value = each.name == "Normal"
    if each.kind == "NodeSocketFloat":
        socket.subtype = each.subtype
        socket.min_value, socket.max_value = each.range


def is_group(node):
    return node.type == "GROUP" and node.node_tree is not None and KEY in node.node_tree


def groups_in(tree, seen=None):
    """Every SGD group node of a node tree, within the artist's own groups too."""
    seen = set() if seen is None else seen
    if tree is None or tree.name_full in seen:
        return []
    seen.add(tree.name_full)
    found = []
    for node in tree.nodes:
        if is_group(node):
            found.append(node)
        elif node.type == "GROUP":
            found += groups_in(node.node_tree, seen)
    return found


def changed(node):
    """The measured inputs that are linked or set to another value: what is shown is then not as measured."""
    defaults = {each.name: each.value for each in INPUTS}
    return [name for name in MEASURED if name in node.inputs and _differs(node.inputs[name], defaults[name])]


def _differs(socket, default):
    value = socket.default_value
    value = tuple(value) if isinstance(default, tuple) else value
    return socket.is_linked or value != default
