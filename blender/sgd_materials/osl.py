# SPDX-License-Identifier: GPL-3.0-or-later
"""The lobes of a material as one compiled Script node."""

import importlib.util
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
    try:
        update(node, lambda kind, message: "ERROR" in kind and errors.append(message))
    except ImportError as error:
        raise FormatError(f"Cycles' OSL compiler lacks a part: {error}: choose Lobes (Nodes)") from error
    if errors or "BSDF" not in node.outputs:
        raise FormatError(f"the OSL shader did not compile: {' '.join(errors) or 'it has no output'}")
    return node


def source(description):
    """The shader with a material's numbers before it."""
    lines = [f"#define {name} {value}" for name, value in _constants(description).items()]
    return "\n".join(lines) + "\n" + SHADER.read_text(encoding="utf-8")


def _constants(description):
    visible, blends = lobes.specular(description), lobes.blends(description)
    constants = {
        "COMPONENTS": len(visible),
        "WHOLE": lobes.whole(len(visible)),
        "BLENDS": len(blends),
        "MIN_ALPHA": _number(lobes.MIN_ALPHA),
        "MAX_ALPHA": _number(lobes.MAX_ALPHA),
        "ALPHA": _array(_number(each.alpha) for each in visible),
        "BLEND": _array(str(each.blend) for each in visible),
        "SHARE": _array(_color(each.share) for each in visible),
        "WEIGHT": _array(_color(each.weight) for each in visible),
        "F0": _array(_color(blend.f0) for blend in blends),
        "F1": _array(_color(blend.f1) for blend in blends),
    }
    for prefix, terms in zip(("QUINTIC", "LINEAR"), zip(*(fresnel.split(lobes.curves(blend)) for blend in blends))):
        for field in ("size", "tint", "f0", "f90"):
            constants[f"{prefix}_{field.upper()}"] = _array(_color(asdict(term)[field]) for term in terms)
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
        if block.library is None and block.as_string() == text:
            return block
    block = bpy.data.texts.new(f"SGD {description['name']}.osl")
    block.from_string(text)
    return block


def _updater():
    """Cycles' compiler. As a Python module Blender leaves the oslquery it may need off the path."""
    if importlib.util.find_spec("oslquery") is None:
        own = Path(bpy.utils.resource_path("LOCAL")) / "python"
        sys.path += [str(each.parent) for each in own.rglob("site-packages/oslquery*")][:1]
    import cycles.osl

    return cycles.osl.update_script_node
