# SPDX-License-Identifier: GPL-3.0-or-later
"""The node groups of a material: one function per mode, on the sockets of interface.py."""

import math

from . import images, lobes, osl
from .lookup import fetch
from .manifest import FormatError


def fit(shell, source):
    """The best-fit glTF material as a Principled BSDF."""
    shell.finish(_principled(shell, source.fit))


def osl_lobes(shell, source):
    """Path-traced lobes as OSL closures: Fresnel at each microfacet, any light. Eevee gets the fit."""
    graph, about = shell.graph, source.description
    shaders = [_diffuse(shell, about)]
    if lobes.specular(about):
        node = osl.script_node(graph, about)
        graph.connect(node.inputs["Normal"], shell.normal)
        graph.connect(node.inputs["Scale"], _specular_scale(shell))
        graph.connect(node.inputs["Roughness"], shell["Roughness Scale"])
        shaders.append(node.outputs["BSDF"])
    shell.finish(graph.add_shaders(shaders), _principled(shell, source.fit))


def plain_lobes(shell, source):
    """The lobes as Glossy nodes, Fresnel at the angle to the shading normal."""
    graph, about = shell.graph, source.description
    incoming = graph.node("ShaderNodeNewGeometry").outputs["Incoming"]
    cos_o = graph.math("MAXIMUM", graph.vector("DOT_PRODUCT", shell.normal, incoming), 0.0)
    scale, visible = _specular_scale(shell), lobes.specular(about)
    reflectance = [graph.vector("MULTIPLY", _fresnel(graph, blend, cos_o), scale) for blend in lobes.blends(about)]
    shaders = [_diffuse(shell, about)]
    for each in visible:
        glossy = graph.node("ShaderNodeBsdfAnisotropic", distribution="BECKMANN")
        width = graph.math("MULTIPLY", shell["Roughness Scale"], each.alpha)
        graph.connect(glossy.inputs["Roughness"], graph.math("MINIMUM", graph.math("SQRT", width), 1.0))
        graph.connect(glossy.inputs["Color"], graph.vector("MULTIPLY", reflectance[each.blend], each.weight))
        graph.connect(glossy.inputs["Normal"], shell.normal)
        shaders.append(glossy.outputs[0])
    shell.finish(graph.add_shaders(shaders))


def under_a_sun(shell, source):
    """f cos_i of the baked textures times the sun's irradiance, as emission that lights nothing.

    The nodes "Sun Direction" and "Irradiance" hold the direction to the sun, and its irradiance
    on a surface that faces it.
    """
    graph = shell.graph
    direction, irradiance = (_driven(graph, name) for name in (SUN_DIRECTION, IRRADIANCE))
    n, wo = shell.normal, graph.node("ShaderNodeNewGeometry").outputs["Incoming"]
    wi = graph.vector("NORMALIZE", direction)
    cos_i, cos_o = graph.vector("DOT_PRODUCT", n, wi), graph.vector("DOT_PRODUCT", n, wo)
    radiance = graph.vector("MULTIPLY", irradiance, _brdf_cos(shell, source, n, wi, wo, cos_i, cos_o))
    lit = graph.math("MULTIPLY", graph.math("GREATER_THAN", cos_i, 0.0), graph.math("GREATER_THAN", cos_o, 0.0))
    emission = graph.node("ShaderNodeEmission")
    graph.connect(emission.inputs["Color"], graph.scale(radiance, graph.math("MULTIPLY", lit, _seen(graph))))
    shell.finish(emission.outputs[0])


SUN_DIRECTION, IRRADIANCE = "Sun Direction", "Irradiance"


def _driven(graph, name):
    node = graph.node("ShaderNodeCombineXYZ", name=name, label=name)
    return node.outputs[0]


def _seen(graph):
    """1 for a ray from the camera, or from it by a mirror or a pane; 0 for light on other surfaces."""
    path = graph.node("ShaderNodeLightPath").outputs
    mirrored = graph.math("MAXIMUM", path["Is Camera Ray"], path["Is Singular Ray"])
    return graph.math("MAXIMUM", mirrored, path["Is Transmission Ray"])


def _brdf_cos(shell, source, n, wi, wo, cos_i, cos_o):
    """rho_d/pi cos_i + sum of rho_s/pi F D G1(wi) G1(wo) / cos_o over the lobes, from the textures.

    A roughness scale r stretches slopes: D cos^4(tan^2/r^2)/r^2 and G1(cot/r) in place of these at 1.
    """
    graph, about = shell.graph, source.description
    tinted = graph.vector("MULTIPLY", tuple(rho / math.pi for rho in about["diffuse"]), shell["Tint"])
    diffuse = graph.scale(tinted, graph.math("MULTIPLY", cos_i, shell["Diffuse"]))
    if about["row"] is None:
        return diffuse
    r = shell["Roughness Scale"]
    r2 = graph.math("MULTIPLY", r, r)
    h = graph.vector("ADD", wi, wo)
    tan2_h = _tan2(graph, n, h)
    ndf_cos4 = _fetch(graph, source, "ndf", about["row"], graph.math("DIVIDE", tan2_h, r2))
    sec2_h = graph.math("ADD", tan2_h, 1.0)
    g1 = [_fetch(graph, source, "masking", about["row"], graph.math("DIVIDE", _cot(graph, n, w, cos_w), r))
          for w, cos_w in ((wi, cos_i), (wo, cos_o))]
    geometry = graph.math("DIVIDE", graph.math("MULTIPLY", sec2_h, sec2_h), graph.math("MULTIPLY", cos_o, r2))
    of_lobes = graph.scale(graph.vector("MULTIPLY", ndf_cos4, graph.vector("MULTIPLY", *g1)), geometry)
    cos_d = graph.math("MULTIPLY", graph.vector("LENGTH", h), 0.5)
    specular = graph.vector("MULTIPLY", _coloured(graph, source, of_lobes, cos_d), _specular_scale(shell))
    return graph.vector("ADD", specular, diffuse)


def _coloured(graph, source, of_lobes, cos_d):
    """sum over j of rho_s_j/pi F_j x_j, for x a value per lobe."""
    parts = graph.node("ShaderNodeSeparateXYZ")
    graph.connect(parts.inputs[0], of_lobes)
    fresnel, total = {}, (0.0, 0.0, 0.0)
    for lobe, row, value in zip(source.description["lobes"], source.description["fresnel_rows"], parts.outputs):
        if row not in fresnel:
            fresnel[row] = _fetch(graph, source, "fresnel", row, cos_d)
        rho_s = tuple(rho / math.pi for rho in lobe["rho_s"])
        total = graph.vector("ADD", total, graph.scale(graph.vector("MULTIPLY", fresnel[row], rho_s), value))
    return total


def _fresnel(graph, blend, cos):
    """f0 + (1 - f0) (1 - cos)^5 - f1 cos per channel."""
    rise = graph.scale(tuple(1.0 - f0 for f0 in blend.f0), graph.math("POWER", graph.math("SUBTRACT", 1.0, cos), 5.0))
    return graph.vector("SUBTRACT", graph.vector("ADD", rise, blend.f0), graph.scale(blend.f1, cos))


def _tan2(graph, n, w):
    """tan^2 of the angle between n and w from the cross product: nothing cancels near 0."""
    cross, cos = graph.vector("CROSS_PRODUCT", n, w), graph.vector("DOT_PRODUCT", n, w)
    return graph.math("DIVIDE", graph.vector("DOT_PRODUCT", cross, cross), graph.math("MULTIPLY", cos, cos))


def _cot(graph, n, w, cos):
    sin = graph.vector("LENGTH", graph.vector("CROSS_PRODUCT", n, w))
    return graph.math("DIVIDE", graph.math("MAXIMUM", cos, 0.0), graph.math("MAXIMUM", sin, 1e-12))


def _fetch(graph, source, quantity, row, x):
    if quantity not in source.textures:
        raise FormatError(f"{source.description['name']}: no {quantity} texture; "
                          "bake with --quantity ndf,masking,fresnel")
    image, entry = source.textures[quantity]
    if not images.available(image):
        raise FormatError(f"the {quantity} texture is missing: {images.location(image)}; find it by "
                          "File > External Data > Find Missing Files, or import the material again")
    return fetch(graph, image, entry, source.description, row, x)


def _diffuse(shell, about):
    graph, node = shell.graph, shell.graph.node("ShaderNodeBsdfDiffuse")
    graph.connect(node.inputs["Color"], graph.vector("MULTIPLY", tuple(about["diffuse"]),
                                                     graph.scale(shell["Tint"], shell["Diffuse"])))
    graph.connect(node.inputs["Normal"], shell.normal)
    return node.outputs[0]


def _specular_scale(shell):
    return shell.graph.scale(shell["Tint"], shell["Specular"])


def _principled(shell, gltf):
    """glTF metallic-roughness with KHR_materials_specular and clearcoat, as the Principled BSDF has them.

    A metal's specular part is in its base colour: the scale of that is mixed by the metallic factor.
    """
    graph, node = shell.graph, shell.graph.node("ShaderNodeBsdfPrincipled")
    metallic = gltf["metallic"]
    base = graph.math("ADD", graph.math("MULTIPLY", shell["Diffuse"], 1.0 - metallic),
                      graph.math("MULTIPLY", shell["Specular"], metallic))
    values = {
        "Base Color": graph.vector("MULTIPLY", tuple(gltf["base_color"]), graph.scale(shell["Tint"], base)),
        "Metallic": metallic,
        "Roughness": graph.math("MINIMUM", graph.math("MULTIPLY", graph.math("SQRT", shell["Roughness Scale"]),
                                                      gltf["roughness"]), 1.0),
        "Specular IOR Level": graph.math("MULTIPLY", shell["Specular"], 0.5 * gltf["specular_factor"]),
        "Specular Tint": graph.vector("MULTIPLY", tuple(gltf["specular_color"]), shell["Tint"]),
        "IOR": 1.5,
        "Coat Weight": gltf.get("clearcoat") or 0.0,
        "Coat Roughness": gltf.get("clearcoat_roughness") or 0.0,
        "Normal": shell.normal,
        "Coat Normal": shell.normal,
    }
    for name, value in values.items():
        graph.connect(node.inputs[name], value)
    return node.outputs[0]
