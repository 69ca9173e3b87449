# SPDX-License-Identifier: GPL-3.0-or-later
"""Lookup textures as Blender images, and back to the bytes they came from."""

import hashlib
import os
import tempfile
from pathlib import Path

import bpy

from .manifest import FormatError

SUFFIX = {"exr": ".exr", "png": ".png"}


def load(texture):
    """The image of a texture, packed: it moves with the .blend. Equal bytes give one image."""
    try:
        data = texture.data if texture.file is None else texture.file.read_bytes()
    except OSError as error:
        raise FormatError(f"{texture.file}: cannot be read: {error.strerror}") from error
    name = f"SGD {texture.quantity} {hashlib.sha256(data).hexdigest()[:8]}"
    image = _present(name) or _new(texture, data, name)
    size = texture.entry["size"][:2]
    if list(image.size) != size:
        raise FormatError(f"texture {texture.quantity}: the picture is {image.size[0]} x {image.size[1]}, "
                          f"its description says {size[0]} x {size[1]}")
    return image


def available(image):
    """Whether the image's file is packed or where it is said to be."""
    return image is not None and (image.packed_file is not None or location(image).is_file())


def location(image):
    """The file that the image names."""
    return Path(bpy.path.abspath(image.filepath, library=image.library)) if image else Path("its image was removed")


def image_bytes(image):
    """The file that the image was loaded from, byte for byte."""
    if not available(image):
        raise FormatError(f"the texture's file is missing: {location(image)}")
    return image.packed_file.data if image.packed_file else location(image).read_bytes()


def _present(name):
    image = bpy.data.images.get((name, None))
    return image if available(image) else None


def _new(texture, data, name):
    image = _packed(texture, data)
    image.name = name
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "NONE"
    return image


def _packed(texture, data):
    """Blender loads images from files alone: through a file that is packed, then removed."""
    suffix = SUFFIX.get(texture.entry.get("format"))
    if suffix is None:
        raise FormatError(f"texture {texture.quantity}: format is {texture.entry.get('format')!r}; "
                          f"Blender reads {', '.join(SUFFIX)}")
    handle, path = tempfile.mkstemp(suffix)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        image = bpy.data.images.load(path)
        image.pack()
        image.filepath_raw = f"//{texture.quantity}{suffix}"  # where an artist's Unpack writes it
        return image
    finally:
        os.unlink(path)
