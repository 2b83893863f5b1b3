# SPDX-License-Identifier: Apache-2.0
"""Pictures, grids, meshes and transforms of other libraries, as the arrays that they hold.

Nothing is imported: an object is taken for what its attributes and its array interface say.
Bitmaps, tensors, meshes and transforms of Mitsuba 3, pictures of Pillow and imageio, meshes
of trimesh, arrays of PyTorch, JAX and NumPy are among them."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Optional

import numpy as np

from ._array import _import, numbers
from ._errors import ArgumentError

_MESH = {"positions": ("vertex_positions", "positions", "vertices"), "normals": ("vertex_normals", "normals"),
         "uvs": ("vertex_texcoords", "uvs"), "indices": ("faces", "indices")}
_MESH_WIDTH = {"positions": 3, "normals": 3, "uvs": 2, "indices": 3}
# What a mesh of Mitsuba's scatters by if nobody gave it a BSDF.
_NO_BSDF = "SmoothDiffuse"


def is_array(value: Any) -> bool:
    """Has it numbers inside? Strings, paths, mappings and single numbers have not."""
    if isinstance(value, (str, bytes, Mapping)) or hasattr(value, "__fspath__"):
        return False
    if isinstance(value, (list, tuple, np.ndarray)):
        return True
    return any(hasattr(value, name) for name in ("__array_interface__", "__array__", "__dlpack__"))


def matrix_of(value: Any, name: str) -> Optional[Any]:
    """The [4][4] matrix of a transform: an object with `.matrix`, or such an array; else None."""
    matrix = value if is_array(value) else getattr(value, "matrix", value)
    if matrix is value and not is_array(value):
        return None
    array = np.asarray(_import(matrix, name))
    if array.ndim == 3 and array.shape[2] == 1:  # a batch of one
        array = array[..., 0]
    if array.shape != (4, 4):
        if matrix is not value:
            raise ArgumentError("%s: the transform's matrix has shape %s, not (4, 4)" % (name, array.shape))
        return None
    return numbers(array, name, shape=(4, 4))


def _srgb_decode(x: Any) -> Any:
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def pixels_of(value: Any, name: str, raw: bool) -> Any:
    """Linear float32 [height][width][1 or 3] of a picture.

    Whole numbers of 8 or 16 bits are those of a file: parts of 255 or 65535, sRGB unless
    `raw`, or unless the object says otherwise (`srgb_gamma()` of Mitsuba's bitmaps). Other
    whole numbers are refused; floats are linear. Alpha is left out."""
    encoded = True
    if hasattr(value, "srgb_gamma"):
        encoded = bool(value.srgb_gamma())
    elif getattr(value, "mode", None) in ("1", "P", "PA", "CMYK", "YCbCr", "LAB", "HSV") and hasattr(value, "convert"):
        value = value.convert("RGB")  # Pillow's: a palette's numbers are no colours
    p = np.asarray(_import(value, name))
    p = p[..., None] if p.ndim == 2 else p
    if p.ndim != 3 or p.shape[2] not in (1, 2, 3, 4) or 0 in p.shape:
        raise ArgumentError("%s has shape %s: a picture is (height, width) or (height, width, channels) with 1 or "
                            "3 channels, or 2 or 4 with alpha" % (name, p.shape))
    p = p[..., :3 if p.shape[2] >= 3 else 1]
    if p.dtype in (np.uint8, np.uint16):
        p = p / float(np.iinfo(p.dtype).max)
        if encoded and not raw:
            p = _srgb_decode(p)
    elif p.dtype.kind != "f":
        raise ArgumentError("%s has dtype %s: whole numbers of pictures are uint8 or uint16; give others as floats, "
                            "which are linear" % (name, p.dtype))
    elif hasattr(value, "srgb_gamma") and encoded and not raw:
        p = _srgb_decode(p.astype(np.float64))
    return numbers(p, name, np.float32)


def grid_of(value: Any, name: str) -> Any:
    """float32 [nz][ny][nx][1 or 3] of a grid's cells."""
    g = np.asarray(_import(value, name))
    g = g[..., None] if g.ndim == 3 else g
    if g.ndim != 4 or g.shape[3] not in (1, 3) or 0 in g.shape:
        raise ArgumentError("%s has shape %s: a grid is (nz, ny, nx), or (nz, ny, nx, channels) with 1 or 3 channels"
                            % (name, g.shape))
    return numbers(g, name, np.float32)


def is_mesh(value: Any) -> bool:
    """An object with vertices and faces, of Mitsuba's or trimesh's names."""
    return (hasattr(value, "vertex_positions_buffer") and hasattr(value, "faces_buffer")
            or hasattr(value, "vertices") and hasattr(value, "faces"))


def _mesh_object(mesh: Any, name: str, has_bsdf: bool) -> dict[str, Any]:
    if not hasattr(mesh, "vertex_positions_buffer"):
        given = {"positions": mesh.vertices, "indices": mesh.faces}
        uv = getattr(getattr(mesh, "visual", None), "uv", None)
        return given if uv is None else {**given, "uvs": uv}
    bsdf = mesh.bsdf() if hasattr(mesh, "bsdf") and not has_bsdf else None
    kind = getattr(bsdf, "class_name", None)
    kind = kind() if callable(kind) else kind
    if bsdf is not None and (kind != _NO_BSDF or "value=0.5" not in str(bsdf).replace(" ", "")):
        raise ArgumentError("%s: the mesh's BSDF (%s) cannot be read from it: write {'type': 'mesh', 'mesh': object, "
                            "'bsdf': {...}}" % (name, kind))
    given = {"positions": mesh.vertex_positions_buffer(), "indices": mesh.faces_buffer()}
    if mesh.has_vertex_normals():
        given["normals"] = mesh.vertex_normals_buffer()
    if mesh.has_vertex_texcoords():
        given["uvs"] = mesh.vertex_texcoords_buffer()
    return given


def mesh_of(d: dict[str, Any], name: str) -> dict[str, Any]:
    """Arrays of a mesh, which are taken out of d: positions, normals, uvs float32, indices uint32."""
    given: dict[str, Any] = {}
    if "mesh" in d:
        given = _mesh_object(d.pop("mesh"), name, "bsdf" in d)
    for key, names in _MESH.items():
        for n in names:
            if n in d:
                given[key] = d.pop(n)
    if "positions" not in given or "indices" not in given:
        raise ArgumentError("%s: a mesh needs 'vertex_positions' [n][3] and 'faces' [m][3], or 'mesh', an object that "
                            "has them" % name)
    out = {}
    for key, value in given.items():
        width = _MESH_WIDTH[key]
        array = numbers(value, "%s: %s" % (name, key))
        if array.size % width:
            raise ArgumentError("%s: %s has %d numbers, which are no rows of %d" % (name, key, array.size, width))
        out[key] = np.reshape(array, (-1, width))
    n, faces = len(out["positions"]), out["indices"]
    if faces.size and (faces.min() < 0 or faces.max() >= n or np.any(faces != np.floor(faces))):
        raise ArgumentError("%s: faces are numbers of vertices, 0 to %d" % (name, n - 1))
    for key in ("normals", "uvs"):
        if key in out and len(out[key]) != n:
            raise ArgumentError("%s: %d %s for %d vertices" % (name, len(out[key]), key, n))
    return {key: np.ascontiguousarray(a, dtype=np.uint32 if key == "indices" else np.float32)
            for key, a in out.items()}
