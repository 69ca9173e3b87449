"""python blender.py IN.glb OUT.glb [extras]: a scene through Blender's own glTF importer and exporter."""
import os
import sys

import bpy

source, target, *extras = sys.argv[1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=source)
bpy.ops.export_scene.gltf(filepath=target, export_format="GLB", export_extras=bool(extras))
os._exit(0)  # Blender 4.2 crashes where Python ends it
