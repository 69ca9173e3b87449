# SPDX-License-Identifier: GPL-3.0-or-later
"""The node groups of a material: one function per mode."""

import math

from . import lobes, osl
from .graph import Graph, finish, shader_group
from .lookup import fetch
from .manifest import CHANNELS, FormatError


def osl_lobes(name, description, textures):
    """Path-traced lobes as OSL closures: Fresnel at each microfacet, any light."""
    graph = Graph(shader_group(name))
    shaders = [_diffuse(graph, description)]
    if lobes.specular(description):
        shaders.append(osl.script_node(graph, description).outputs["BSDF"])
    finish(graph, graph.add_shaders(shaders))
    return graph.tree


def plain_lobes(name, description, textures):
    """The lobes as Glossy nodes; Fresnel from its texture at the angle to the shading normal."""
    graph = Graph(shader_group(name))
    geometry = graph.node("ShaderNodeNewGeometry")
    cos_o = graph.vector("DOT_PRODUCT", geometry.outputs["Normal"], geometry.outputs["Incoming"])
    shaders, visible = [_diffuse(graph, description)], lobes.specular(description)
    if visible:
        reflectance = _fetch(graph, textures, "fresnel", description, graph.math("MAXIMUM", cos_o, 0.0))
    for lobe in visible:
        glossy = graph.node("ShaderNodeBsdfAnisotropic", distribution="BECKMANN")
        glossy.inputs["Roughness"].default_value = math.sqrt(lobe.alpha)
        graph.connect(glossy.inputs["Color"], graph.vector("MULTIPLY", reflectance, lobe.weight))
        shaders.append(glossy.outputs[0])
    finish(graph, graph.add_shaders(shaders))
    return graph.tree


def under_a_sun(name, description, textures):
    """f cos_i of the baked textures times the sun's irradiance, as emission.

    Inputs: the direction to the sun, and its irradiance on a surface that faces it.
    """
    graph = Graph(shader_group(name, [("Sun Direction", "NodeSocketVector"), ("Irradiance", "NodeSocketVector")]))
    sun = graph.node("NodeGroupInput")
    geometry = graph.node("ShaderNodeNewGeometry")
    n, wo = geometry.outputs["Normal"], geometry.outputs["Incoming"]
    wi = graph.vector("NORMALIZE", sun.outputs["Sun Direction"])
    cos_i, cos_o = graph.vector("DOT_PRODUCT", n, wi), graph.vector("DOT_PRODUCT", n, wo)
    radiance = graph.vector("MULTIPLY", sun.outputs["Irradiance"],
                            _brdf_cos(graph, description, textures, n, wi, wo, cos_i, cos_o))
    lit = graph.math("MULTIPLY", graph.math("GREATER_THAN", cos_i, 0.0), graph.math("GREATER_THAN", cos_o, 0.0))
    emission = graph.node("ShaderNodeEmission")
    graph.connect(emission.inputs["Color"], graph.scale(radiance, lit))
    finish(graph, emission.outputs[0])
    return graph.tree


def _brdf_cos(graph, description, textures, n, wi, wo, cos_i, cos_o):
    """rho_d/pi cos_i + rho_s/pi F D G1(wi) G1(wo) / cos_o, the factors from the textures."""
    diffuse = graph.scale(_over_pi(description, "rho_d"), cos_i)
    if description["row"] is None:
        return diffuse
    h = graph.vector("ADD", wi, wo)
    tan2_h = _tan2(graph, n, h)
    ndf_cos4 = _fetch(graph, textures, "ndf", description, tan2_h)
    sec2_h = graph.math("ADD", tan2_h, 1.0)
    f = _fetch(graph, textures, "fresnel", description, graph.math("MULTIPLY", graph.vector("LENGTH", h), 0.5))
    g1 = [_fetch(graph, textures, "masking", description, _cot(graph, n, w, cos_w))
          for w, cos_w in ((wi, cos_i), (wo, cos_o))]
    geometry = graph.math("DIVIDE", graph.math("MULTIPLY", sec2_h, sec2_h), cos_o)
    factors = graph.vector("MULTIPLY", graph.vector("MULTIPLY", f, ndf_cos4), graph.vector("MULTIPLY", *g1))
    specular = graph.vector("MULTIPLY", graph.scale(factors, geometry), _over_pi(description, "rho_s"))
    return graph.vector("ADD", specular, diffuse)


def _tan2(graph, n, w):
    """tan^2 of the angle between n and w from the cross product: nothing cancels near 0."""
    cross, cos = graph.vector("CROSS_PRODUCT", n, w), graph.vector("DOT_PRODUCT", n, w)
    return graph.math("DIVIDE", graph.vector("DOT_PRODUCT", cross, cross), graph.math("MULTIPLY", cos, cos))


def _cot(graph, n, w, cos):
    sin = graph.vector("LENGTH", graph.vector("CROSS_PRODUCT", n, w))
    return graph.math("DIVIDE", graph.math("MAXIMUM", cos, 0.0), graph.math("MAXIMUM", sin, 1e-12))


def _over_pi(description, key):
    return tuple(description["channels"][name][key] / math.pi for name in CHANNELS)


def _fetch(graph, textures, quantity, description, x):
    if quantity not in textures:
        raise FormatError(f"{description['name']}: no {quantity} texture; "
                          "bake with --quantity ndf,masking,fresnel")
    image, entry = textures[quantity]
    return fetch(graph, image, entry, description, x)


def _diffuse(graph, description):
    node = graph.node("ShaderNodeBsdfDiffuse")
    node.inputs["Color"].default_value = (*lobes.diffuse(description), 1.0)
    return node.outputs[0]
