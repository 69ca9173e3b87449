# SPDX-License-Identifier: GPL-3.0-or-later
"""Decoding a lookup texture in shader nodes, as its description says (docs/lut-format.md)."""

from .manifest import FormatError

# Whether neighbouring texels are mixed.
FILTERS = {"linear": True, "nearest": False}


def fetch(graph, image, entry, description, row, x):
    """The RGB value of a row of a texture at the variable `x` of its first axis."""
    u = _coordinate(graph, entry, row, x)
    encoding = entry["encoding"]
    decode = _known(ENCODINGS, encoding.get("kind"), "encoding", entry)
    return decode(graph, encoding, description, u, _texel(graph, image, entry, row, u))


def _texel(graph, image, entry, row, u):
    """The row's texels at u, mixed as the filter says.

    Two fetches of one texel each: Eevee's own filter mixes rows and sizes where x jumps between pixels.
    """
    columns, rows = entry["size"][:2]
    linear = _known(FILTERS, entry.get("filter"), "filter", entry)
    position = graph.math("MULTIPLY", u, float(columns - 1))
    left = graph.math("FLOOR", position if linear else graph.math("ADD", position, 0.5))

    def at(column):
        node = graph.node("ShaderNodeTexImage", image=image, extension="EXTEND", interpolation="Closest")
        s = graph.math("MULTIPLY_ADD", column, 1.0 / columns, 0.5 / columns)
        graph.connect(node.inputs["Vector"], graph.combine(s, 1.0 - (row + 0.5) / rows, 0.0))
        return node.outputs["Color"]

    if not linear:
        return at(left)
    return graph.mix(graph.math("SUBTRACT", position, left), at(left), at(graph.math("ADD", left, 1.0)))


def _coordinate(graph, entry, row, x):
    """u of the row: 0 at the centre of the first texel, 1 at that of the last."""
    warp = entry["axes"][0].get("warp", {})
    constants = {key: warp[key][row] for key in ("scale", "max") if key in warp}
    return _known(WARPS, warp.get("kind"), "warp", entry)(graph, x, **constants)


def _identity(graph, x):
    return x


def _log1p(graph, x, scale, max):
    """ln(1 + min(x, max)/scale) / ln(1 + max/scale), the logarithm to the base 1 + max/scale."""
    ratio = graph.math("DIVIDE", graph.math("MINIMUM", x, max), scale)
    return graph.math("LOGARITHM", graph.math("ADD", ratio, 1.0), 1.0 + max / scale)


def _rational(graph, x, scale):
    return graph.math("DIVIDE", x, graph.math("ADD", x, scale))


def _plain(graph, encoding, description, u, texel):
    return texel


def _exp_times(graph, encoding, description, u, texel):
    exponential = graph.each_channel("EXPONENT", texel)
    if encoding["factor"] == "u":
        return graph.scale(exponential, u)
    of_lobes = [*description[encoding["factor"]], 0.0, 0.0][:3]  # a material has one to three lobes
    return graph.vector("MULTIPLY", exponential, tuple(of_lobes))


WARPS = {"identity": _identity, "log1p": _log1p, "rational": _rational}
ENCODINGS = {"identity": _plain, "exp_times": _exp_times}


def _known(table, key, what, entry):
    if key not in table:
        raise FormatError(f"texture {entry['quantity']}: {what} is {key!r}; this extension decodes {', '.join(table)}")
    return table[key]
