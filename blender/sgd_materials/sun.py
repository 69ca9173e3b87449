# SPDX-License-Identifier: GPL-3.0-or-later
"""The sun of Exact Under a Sun: which one, and its direction and irradiance as drivers."""

import bpy

from .groups import IRRADIANCE, SUN_DIRECTION

# Where there is no sun: from above, of irradiance 1.
NO_SUN = {SUN_DIRECTION: (0.0, 0.0, 1.0), IRRADIANCE: (1.0, 1.0, 1.0)}


def is_sun(thing):
    return thing is not None and thing.type == "LIGHT" and thing.data.type == "SUN"


def followed(state):
    """The sun of a material's own choice, or the scene's first."""
    return state.sun if is_sun(state.sun) else first()


def first():
    return next((thing for thing in bpy.context.scene.objects if is_sun(thing)), None)


def ignored(scene, light):
    """The names of what else lights the scene."""
    others = [thing.name for thing in scene.objects
              if thing.type == "LIGHT" and thing != light and not thing.hide_render]
    return others + ([scene.world.name] if scene.world is not None else [])


def follow(tree, light):
    """Drives the group's direction by the sun's +z axis, its irradiance by strength, exposure, colour and hiding."""
    for name, values in NO_SUN.items():
        for axis, value in enumerate(values):
            tree.nodes[name].inputs[axis].default_value = value
    if light is None:
        return
    for axis in range(3):
        _drive(tree.nodes[SUN_DIRECTION].inputs[axis], light, "z", {"z": f"matrix_world[2][{axis}]"})
        _drive(tree.nodes[IRRADIANCE].inputs[axis], light, *_irradiance(light.data, axis))


def _irradiance(data, axis):
    """strength 2^exposure colour, times the colour of the temperature where the light has one; 0 where hidden."""
    terms, paths = ["e * c * (1 - h)"], {"e": "data.energy", "c": f"data.color[{axis}]", "h": "hide_render"}
    if hasattr(data, "exposure"):
        terms, paths = [*terms, "pow(2, x)"], paths | {"x": "data.exposure"}
    if hasattr(data, "use_temperature"):
        terms = [*terms, "(1 + u * (t - 1))"]
        paths = paths | {"u": "data.use_temperature", "t": f"data.temperature_color[{axis}]"}
    return " * ".join(terms), paths


def drives(tree, light):
    """Whether a group follows that sun; for none, that it follows nothing, not even one that was removed."""
    drivers = tree.animation_data.drivers if tree.animation_data else ()
    targets = {driver.driver.variables[0].targets[0].id for driver in drivers}
    return targets == (set() if light is None else {light})


def _drive(socket, light, expression, paths):
    driver = socket.driver_add("default_value").driver
    for name, path in paths.items():
        variable = driver.variables.new()
        variable.name = name
        variable.targets[0].id, variable.targets[0].data_path = light, path
    driver.expression = expression
