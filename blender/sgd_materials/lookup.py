# SPDX-License-Identifier: GPL-3.0-or-later
"""Decoding a lookup texture in shader nodes, as its description says (docs/lut-format.md)."""

from .manifest import FormatError

INTERPOLATION = {"linear": "Linear", "nearest": "Closest"}


def fetch(graph, image, entry, description, x):
    """The RGB value of a texture at the variable `x` of its first axis, in the material's row."""
    texel = graph.node("ShaderNodeTexImage", image=image, extension="EXTEND",
                       interpolation=_known(INTERPOLATION, entry.get("filter"), "filter", entry))
    graph.connect(texel.inputs["Vector"], _coordinate(graph, entry, description["row"], x))
    encoding = entry["encoding"]
    decode = _known(ENCODINGS, encoding.get("kind"), "encoding", entry)
    return decode(graph, encoding, description, texel.outputs["Color"])


def _coordinate(graph, entry, row, x):
    """u between texel centres; v of the row's centre, counted from the bottom."""
    columns, rows = entry["size"][:2]
    warp = entry["axes"][0].get("warp", {})
    u = _known(WARPS, warp.get("kind"), "warp", entry)(graph, warp, x)
    s = graph.math("MULTIPLY_ADD", u, (columns - 1) / columns, 0.5 / columns)
    return graph.combine(s, 1.0 - (row + 0.5) / rows, 0.0)


def _identity(graph, warp, x):
    return x


def _log1p(graph, warp, x):
    """ln(1 + min(x, m)/s) / ln(1 + m/s), the logarithm to the base 1 + m/s."""
    ratio = graph.math("DIVIDE", graph.math("MINIMUM", x, warp["max"]), warp["scale"])
    return graph.math("LOGARITHM", graph.math("ADD", ratio, 1.0), 1.0 + warp["max"] / warp["scale"])


def _rational(graph, warp, x):
    return graph.math("DIVIDE", x, graph.math("ADD", x, warp["scale"]))


def _plain(graph, encoding, description, texel):
    return texel


def _exp_times(graph, encoding, description, texel):
    return graph.vector("MULTIPLY", graph.each_channel("EXPONENT", texel), tuple(description[encoding["factor"]]))


WARPS = {"identity": _identity, "log1p": _log1p, "rational": _rational}
ENCODINGS = {"identity": _plain, "exp_times": _exp_times}


def _known(table, key, what, entry):
    if key not in table:
        raise FormatError(f"texture {entry['quantity']}: {what} is {key!r}; this extension decodes {', '.join(table)}")
    return table[key]
