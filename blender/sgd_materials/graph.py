# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing shader node trees as expressions.

A value is a socket, a number or a tuple; every method adds one node and gives its output.
"""

import bpy

SPACING = (190, 170)
PER_ROW = 12


class Graph:
    """Adds nodes to a node tree, laid out in reading order."""

    def __init__(self, tree):
        self.tree = tree
        self.count = 0

    def node(self, kind, **properties):
        node = self.tree.nodes.new(kind)
        row, column = divmod(self.count, PER_ROW)
        node.location = (column * SPACING[0], -row * SPACING[1])
        self.count += 1
        for name, value in properties.items():
            setattr(node, name, value)
        return node

    def connect(self, socket, value):
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def math(self, operation, *values):
        node = self.node("ShaderNodeMath", operation=operation)
        for socket, value in zip(node.inputs, values):
            self.connect(socket, value)
        return node.outputs[0]

    def vector(self, operation, *values):
        node = self.node("ShaderNodeVectorMath", operation=operation)
        for socket, value in zip(node.inputs, values):
            self.connect(socket, (value, value, value) if isinstance(value, float) else value)
        scalar = operation in {"DOT_PRODUCT", "LENGTH", "DISTANCE"}
        return node.outputs["Value" if scalar else "Vector"]

    def scale(self, vector, factor):
        node = self.node("ShaderNodeVectorMath", operation="SCALE")
        self.connect(node.inputs[0], vector)
        self.connect(node.inputs["Scale"], factor)
        return node.outputs["Vector"]

    def combine(self, x, y, z):
        node = self.node("ShaderNodeCombineXYZ")
        for socket, value in zip(node.inputs, (x, y, z)):
            self.connect(socket, value)
        return node.outputs[0]

    def each_channel(self, operation, vector):
        """The scalar operation on x, y and z."""
        separate = self.node("ShaderNodeSeparateXYZ")
        self.connect(separate.inputs[0], vector)
        return self.combine(*(self.math(operation, output) for output in separate.outputs))

    def mix(self, factor, first, second):
        """first + factor (second - first)."""
        return self.vector("ADD", first, self.scale(self.vector("SUBTRACT", second, first), factor))

    def add_shaders(self, shaders):
        """The sum of the shader outputs, of which there is at least one."""
        total, *rest = shaders
        for shader in rest:
            node = self.node("ShaderNodeAddShader")
            self.tree.links.new(total, node.inputs[0])
            self.tree.links.new(shader, node.inputs[1])
            total = node.outputs[0]
        return total

    def mix_shaders(self, factor, first, second):
        node = self.node("ShaderNodeMixShader")
        for socket, value in zip(node.inputs, (factor, first, second)):
            self.connect(socket, value)
        return node.outputs[0]
