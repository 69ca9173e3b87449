# SPDX-License-Identifier: GPL-3.0-or-later
"""The lobes of a material as one compiled Script node."""

import sys
from dataclasses import asdict
from pathlib import Path

import bpy

from . import fresnel, lobes
from .manifest import FormatError

SHADER = Path(__file__).with_name("sgd_lobes.osl")


def supported():
    """Whether this Blender has Open Shading Language; some Linux distributions' have not."""
    return bpy.app.build_options.cycles_osl


def script_node(graph, description):
    """A Script node of the shader for a material, compiled by Cycles' own compiler."""
    if not supported():
        raise FormatError("this Blender is built without Open Shading Language: choose Lobes (Nodes)")
    update, errors = _updater(), []
    node = graph.node("ShaderNodeScript", mode="INTERNAL", script=_text(description))
    update(node, lambda kind, message: "ERROR" in kind and errors.append(message))
    if errors or "BSDF" not in node.outputs:
        raise FormatError(f"the OSL shader did not compile: {' '.join(errors) or 'it has no output'}")
    return node


def source(description):
    """The shader with a material's numbers before it."""
    lines = [f"#define {name} {value}" for name, value in _constants(description).items()]
    return "\n".join(lines) + "\n" + SHADER.read_text(encoding="utf-8")


def _constants(description):
    visible, curves = lobes.specular(description), lobes.curves(description)
    constants = {
        "LOBES": len(visible),
        "WHOLE": lobes.whole(len(visible)),
        "ALPHA": _array(_number(lobe.alpha) for lobe in visible),
        "SHARE": _array(_color(lobe.share) for lobe in visible),
        "WEIGHT": _array(_color(lobe.weight) for lobe in visible),
    }
    constants |= zip(("F0", "F1"), map(_color, zip(*curves)))
    for prefix, term in zip(("QUINTIC", "LINEAR"), fresnel.split(curves)):
        constants |= {f"{prefix}_{field.upper()}": _color(values) for field, values in asdict(term).items()}
    return constants


def _array(items):
    return f"{{{', '.join(items)}}}"


def _color(values):
    return f"color({', '.join(map(_number, values))})"


def _number(value):
    return format(value, ".9g")


def _text(description):
    """The source as a text block, one for all materials of these numbers."""
    text = source(description)
    for block in bpy.data.texts:
        if block.as_string() == text:
            return block
    block = bpy.data.texts.new(f"SGD {description['name']}.osl")
    block.from_string(text)
    return block


def _updater():
    """Cycles' compiler. As a Python module Blender leaves the oslquery it needs off the path."""
    packages = Path(bpy.utils.resource_path("LOCAL")) / "python/lib/python3.11/site-packages"
    if packages.is_dir() and str(packages) not in sys.path:
        sys.path.append(str(packages))
    import cycles.osl

    return cycles.osl.update_script_node
