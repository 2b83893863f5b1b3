# SPDX-License-Identifier: Apache-2.0
"""Scenes as dictionaries, Mitsuba's way, through the library's building calls."""
from __future__ import annotations

import ctypes
import os
from collections.abc import Mapping, Sequence
from typing import Any, Optional

import numpy as np

from ._array import address, numbers
from ._library import ArgumentError, Handle, context, lib, not_inside, text, warn_said
from ._scene import Scene, _load_options
from ._transform import Transform4f

_MESH = {"positions": ("vertex_positions", "positions"), "normals": ("vertex_normals", "normals"),
         "uvs": ("vertex_texcoords", "uvs"), "indices": ("faces", "indices")}


class _Builder:
    def __init__(self, scene: int) -> None:
        self.scene = scene

    def number(self, name: str, value: Any) -> None:
        key = text(name, "name")
        if isinstance(value, (bool, np.bool_)):
            lib.imp_scene_bool(self.scene, key, bool(value))
        elif isinstance(value, (int, np.integer)):
            if not -2**63 <= value < 2**63:
                raise ArgumentError("%s = %d is no 64-bit integer" % (name, value))
            lib.imp_scene_integer(self.scene, key, int(value))
        else:
            lib.imp_scene_float(self.scene, key, float(value))

    def three(self, function: Any, name: str, value: Any) -> None:
        v = numbers(value, name)
        v = np.full(3, float(v)) if v.ndim == 0 or v.shape == (1,) else numbers(v, name, shape=(3,))
        function(self.scene, text(name, "name"), address(v))

    def transform(self, name: str, value: Any) -> None:
        m = numbers(value.matrix if isinstance(value, Transform4f) else value, name, shape=(4, 4))
        lib.imp_scene_transform(self.scene, text(name, "name"), address(m))

    def spectrum(self, name: str, value: Any) -> None:
        """A number; pairs of wavelength in nm and value; a string or file of them."""
        key = text(name, "name")
        if isinstance(value, str) and ":" in value:
            value = [pair.split(":") for pair in value.replace(",", " ").split()]
        elif isinstance(value, str) or hasattr(value, "__fspath__"):
            path = os.fspath(value)
            if not os.path.exists(path):
                raise ArgumentError("%s: '%s' is no number, list of wavelength:value or file" % (name, path))
            value = np.loadtxt(path, ndmin=2, comments="#")
        if isinstance(value, list) and value and isinstance(value[0], list):
            try:
                value = [[float(x) for x in pair] for pair in value]
            except ValueError as error:
                raise ArgumentError("%s: %s" % (name, error)) from None
        samples = numbers(value, name)
        if samples.ndim == 0:
            lib.imp_scene_spectrum(self.scene, key, 1, None, address(samples))
            return
        samples = numbers(samples, name, shape=(-1, 2))
        nm, values = np.ascontiguousarray(samples[:, 0]), np.ascontiguousarray(samples[:, 1])
        lib.imp_scene_spectrum(self.scene, key, len(nm), address(nm), address(values))

    def begin(self, type: str, id: Optional[str], name: Optional[str]) -> None:
        lib.imp_scene_begin(self.scene, None, text(type, "type"), text(id, "id") if id else None,
                            text(name, "name") if name else None)

    def end(self) -> None:
        lib.imp_scene_end(self.scene)

    def mesh(self, d: dict[str, Any]) -> None:
        given: dict[str, Any] = {}
        for key, names in _MESH.items():
            for n in names:
                if n in d:
                    given[key] = d.pop(n)
        if "positions" not in given or "indices" not in given:
            raise ArgumentError("a mesh needs 'vertex_positions' and 'faces'")

        def wide(key: str, n: int) -> Any:
            return None if key not in given else numbers(
                np.reshape(numbers(given[key], key, np.float32), (-1, n)), key, np.float32)

        positions, normals, uvs = wide("positions", 3), wide("normals", 3), wide("uvs", 2)
        faces = np.reshape(numbers(given["indices"], "faces"), (-1, 3))
        if faces.size and (faces.min() < 0 or faces.max() >= len(positions) or np.any(faces != np.floor(faces))):
            raise ArgumentError("faces are numbers of vertices, 0 to %d" % (len(positions) - 1))
        indices = np.ascontiguousarray(faces, dtype=np.uint32)
        for key, array in (("normals", normals), ("uvs", uvs)):
            if array is not None and len(array) != len(positions):
                raise ArgumentError("%d %s for %d vertices" % (len(array), key, len(positions)))
        lib.imp_scene_mesh(self.scene, len(positions), len(indices), address(positions), address(normals),
                           address(uvs), address(indices))

    def image(self, pixels: Any) -> None:
        p = numbers(pixels, "bitmap", np.float32)
        p = p[..., None] if p.ndim == 2 else p
        if p.ndim != 3 or p.shape[2] not in (1, 3):
            raise ArgumentError("bitmap has shape %s: (height, width) or (height, width, 1 or 3) is wanted" % (p.shape,))
        lib.imp_scene_image(self.scene, p.shape[1], p.shape[0], p.shape[2], address(p))

    def value(self, name: str, value: Any, top: bool) -> None:
        if isinstance(value, Mapping):
            self.object(name, dict(value), top)
        elif isinstance(value, Transform4f):
            self.transform(name, value)
        elif isinstance(value, str) or hasattr(value, "__fspath__"):
            lib.imp_scene_string(self.scene, text(name, "name"), text(value, name))
        elif isinstance(value, (bool, int, float, np.bool_, np.integer, np.floating)):
            self.number(name, value)
        elif np.shape(value) == (4, 4):
            self.transform(name, value)
        else:
            self.three(lib.imp_scene_vector, name, value)

    def object(self, name: str, d: dict[str, Any], top: bool) -> None:
        type = d.pop("type", None)
        if not isinstance(type, str):
            raise ArgumentError("'%s' is a dictionary without a 'type'" % name)
        if type == "ref":
            lib.imp_scene_ref(self.scene, text(d.pop("id", ""), "id"), None if top else text(name, "name"))
        elif type == "rgb":
            self.three(lib.imp_scene_rgb, name, d.pop("value", None))
        elif type == "spectrum":
            self.spectrum(name, d.pop("value") if "value" in d else d.pop("filename", None))
        else:
            # At the top a key is the object's id; below, its slot, unless it has an id too.
            self.begin(type, d.pop("id", name if top else None), None if top else name)
            if type == "mesh":
                self.mesh(d)
            for key in ("bitmap", "data"):
                if type == "bitmap" and key in d:
                    self.image(d.pop(key))
            for key, v in d.items():
                self.value(key, v, False)
            self.end()
            return
        if d:
            raise ArgumentError("'%s' of type '%s' has no '%s'" % (name, type, next(iter(d))))


def load_dict(dictionary: Mapping[str, Any], *, mode: Optional[str] = None, search: Sequence[Any] = (),
              upsampling: str = "sigmoid", parallel: bool = True, optimize: bool = True) -> Scene:
    """Make a scene from a dictionary, as Mitsuba does.

    Parameters
    ----------
    dictionary : mapping
        ``{"type": "scene", ...}``. Objects are dictionaries with a "type"; at the top
        their keys are their ids. Values are numbers, strings, three numbers (points and
        vectors), transforms (`ScalarTransform4f`, or [4][4]), colours ``{"type": "rgb",
        "value": ...}``, spectra ``{"type": "spectrum", "value": number or pairs}`` and
        references ``{"type": "ref", "id": ...}``. A "mesh" takes arrays:
        "vertex_positions" [n][3], "faces" [m][3], "vertex_normals" and
        "vertex_texcoords"; a "bitmap" takes "bitmap", linear [height][width][1 or 3].
    mode, search, upsampling, parallel, optimize
        As `load_file`'s.

    Returns
    -------
    Scene

    Raises
    ------
    SceneError, UnsupportedError
        As `load_file`; the message names object and property.
    ArgumentError
        A value that is none of these.

    Examples
    --------
    >>> scene = importon.load_dict({
    ...     "type": "scene",
    ...     "integrator": {"type": "path"},
    ...     "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8},
    ...                "to_world": importon.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])},
    ...     "sky": {"type": "constant"},
    ...     "ball": {"type": "sphere", "bsdf": {"type": "diffuse", "id": "paint"}}})
    >>> list(importon.traverse(scene))
    ['sky.radiance.value', 'paint.reflectance.value']
    """
    not_inside()
    if not isinstance(dictionary, Mapping):
        raise TypeError("a scene is a dictionary, not a %s" % type(dictionary).__name__)
    d = dict(dictionary)
    kind = d.pop("type", None)
    if kind != "scene":
        raise ArgumentError("the dictionary's type is %r: 'scene' is wanted" % (kind,))
    ctx = context()
    options, kept = _load_options(mode, search, {}, None, upsampling)
    out = ctypes.c_void_p()
    ctx.check(lib.imp_scene_create(ctx.pointer, ctypes.byref(options), ctypes.byref(out)))
    handle = Handle(out.value or 0, lib.imp_scene_destroy)
    builder = _Builder(handle.pointer)
    for name, value in d.items():
        if not isinstance(name, str):
            raise TypeError("the key %r is no string" % (name,))
        builder.value(name, value, True)
    ctx.check(lib.imp_scene_commit(handle.pointer))
    del kept
    warn_said()
    return Scene(handle, ctx, "dictionary")


def cornell_box(res: int = 256, spp: int = 64) -> dict[str, Any]:
    """The Cornell box of Mitsuba's tutorials as a dictionary: `load_dict` makes a scene of it.

    Parameters
    ----------
    res : int
        Pixels along a side of the picture.
    spp : int
        Samples per pixel.

    Returns
    -------
    dict

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> list(importon.traverse(scene))[:2]
    ['white.reflectance.value', 'green.reflectance.value']
    """
    T = Transform4f
    wall = {"type": "rectangle", "bsdf": {"type": "ref", "id": "white"}}

    def colour(*rgb: float) -> dict[str, Any]:
        return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(rgb)}}

    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 8},
        "sensor": {"type": "perspective", "fov_axis": "smaller", "near_clip": 0.001, "far_clip": 100.0,
                   "focus_distance": 1000.0, "fov": 39.3077,
                   "to_world": T().look_at(origin=[0, 0, 4], target=[0, 0, 0], up=[0, 1, 0]),
                   "sampler": {"type": "independent", "sample_count": spp},
                   "film": {"type": "hdrfilm", "width": res, "height": res, "rfilter": {"type": "box"}}},
        "white": colour(0.885809, 0.698859, 0.666422),
        "green": colour(0.105421, 0.37798, 0.076425),
        "red": colour(0.570068, 0.0430135, 0.0443706),
        "light": {"type": "rectangle", "to_world": T().translate([0, 0.99, 0.01]).rotate([1, 0, 0], 90)
                  .scale([0.23, 0.19, 0.19]), "bsdf": {"type": "ref", "id": "white"},
                  "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [18.387, 13.9873, 6.75357]}}},
        "floor": {**wall, "to_world": T().translate([0, -1, 0]).rotate([1, 0, 0], -90)},
        "ceiling": {**wall, "to_world": T().translate([0, 1, 0]).rotate([1, 0, 0], 90)},
        "back": {**wall, "to_world": T().translate([0, 0, -1])},
        "green-wall": {**wall, "to_world": T().translate([1, 0, 0]).rotate([0, 1, 0], -90),
                       "bsdf": {"type": "ref", "id": "green"}},
        "red-wall": {**wall, "to_world": T().translate([-1, 0, 0]).rotate([0, 1, 0], 90),
                     "bsdf": {"type": "ref", "id": "red"}},
        "small-box": {"type": "cube", "to_world": T().translate([0.335, -0.7, 0.38]).rotate([0, 1, 0], -17)
                      .scale(0.3), "bsdf": {"type": "ref", "id": "white"}},
        "large-box": {"type": "cube", "to_world": T().translate([-0.33, -0.4, -0.28]).rotate([0, 1, 0], 18.25)
                      .scale([0.3, 0.61, 0.3]), "bsdf": {"type": "ref", "id": "white"}},
    }


