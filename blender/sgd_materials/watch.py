# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials under a sun keep up with a scene whose suns come and go."""

import bpy

from . import interface, material, sun


@bpy.app.handlers.persistent
def follow_suns(scene, depsgraph):
    """Follows a sun that was added, chosen or removed after the material was shown."""
    for each in material.sgd_materials():
        if _astray(each):
            material.show(each)


def _astray(shown):
    state = getattr(shown, material.PROPERTY)
    if state.mode != "SUN" or state.problem or shown.library is not None:
        return False
    light = sun.followed(state)
    return any(node.node_tree[interface.MODE] == "SUN" and not sun.drives(node.node_tree, light)
               for node in material.nodes(shown))


def register():
    bpy.app.handlers.depsgraph_update_post.append(follow_suns)


def unregister():
    bpy.app.handlers.depsgraph_update_post.remove(follow_suns)
