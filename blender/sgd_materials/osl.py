# SPDX-License-Identifier: GPL-3.0-or-later
"""The lobe shader as a compiled Script node."""

import sys
from pathlib import Path

import bpy

from .manifest import FormatError

SOURCE = Path(__file__).with_name("sgd_lobe.osl")


def script_node(graph):
    """A Script node of the lobe shader, its sockets made by Cycles' own compiler."""
    update, errors = _updater(), []
    node = graph.node("ShaderNodeScript", mode="INTERNAL", script=_text())
    update(node, lambda kind, message: "ERROR" in kind and errors.append(message))
    if errors or "BSDF" not in node.outputs:
        raise FormatError(f"the OSL shader did not compile: {' '.join(errors) or 'it has no output'}")
    return node


def _text():
    """The source as a text block, one for all materials of a file."""
    source = SOURCE.read_text(encoding="utf-8")
    for text in bpy.data.texts:
        if text.name.startswith(SOURCE.name) and text.as_string() == source:
            return text
    text = bpy.data.texts.new(SOURCE.name)
    text.from_string(source)
    return text


def _updater():
    """Cycles' compiler. As a Python module Blender leaves the oslquery it needs off the path."""
    packages = Path(bpy.utils.resource_path("LOCAL")) / "python/lib/python3.11/site-packages"
    if packages.is_dir() and str(packages) not in sys.path:
        sys.path.append(str(packages))
    import cycles.osl

    return cycles.osl.update_script_node
