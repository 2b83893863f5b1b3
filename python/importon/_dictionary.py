# SPDX-License-Identifier: Apache-2.0
"""Scenes as dictionaries, Mitsuba's way, through the library's building calls."""
from __future__ import annotations

import builtins
import ctypes
import os
import tempfile
from collections.abc import Mapping, Sequence
from typing import Any, Optional

import numpy as np

from ._array import address, numbers
from ._context import Handle, context, warn_said
from ._errors import ArgumentError, FileError, SceneError
from ._library import lib, text
from ._load import _load_options
from ._objects import grid_of, is_array, is_mesh, matrix_of, mesh_of, pixels_of
from ._run import not_inside
from ._scene import Scene
from ._tables import TABLES
from ._transform import Transform4f

# Keys under which an object takes what would be in a file, by its type.
_PICTURE = {"bitmap": ("bitmap", "data", "filename"), "envmap": ("bitmap", "data", "filename")}
_GRID = ("grid", "data", "filename")


def _entries(value: Mapping[str, Any], name: str) -> dict[str, Any]:
    """A copy of a mapping, which may be of another package."""
    try:
        return dict(value)
    except Exception as error:
        raise ArgumentError("%s: its entries cannot be read: %r" % (name, error)) from error


def _spectrum_file(value: Any, name: str) -> Any:
    """Pairs of wavelength in nm and value of a file."""
    path = os.fsdecode(text(value, name))
    if not os.path.isfile(path):  # nor is a device read, which may never end
        raise ArgumentError("%s: '%s' is no number, list of wavelength:value or file" % (name, path))
    try:
        return np.loadtxt(path, ndmin=2, comments="#")
    except OSError as error:
        raise FileError("%s: %s" % (path, error.strerror)) from error
    except ValueError as error:
        raise SceneError("%s: %s" % (path, error)) from None


def _flag(value: Any, name: str) -> bool:
    if not isinstance(value, (bool, int, np.bool_, np.integer)):
        raise ArgumentError("%s is a %s, not a boolean" % (name, builtins.type(value).__name__))
    return bool(value)


class _Builder:
    def __init__(self, scene: int, ids: Mapping[str, str], folder: str) -> None:
        self.scene = scene
        self.ids = ids  # by the keys of objects at the top that have an id of their own
        self.folder = folder  # for the files of arrays, until the scene is made
        self.files = 0

    def number(self, name: str, value: Any) -> None:
        key = text(name, "name")
        if isinstance(value, (bool, np.bool_)):
            lib.imp_scene_bool(self.scene, key, bool(value))
        elif isinstance(value, (int, np.integer)):
            if not -2**63 <= value < 2**63:
                raise ArgumentError("%s is no 64-bit integer" % name)  # and may be too long to print
            lib.imp_scene_integer(self.scene, key, int(value))
        else:
            lib.imp_scene_float(self.scene, key, float(value))

    def three(self, function: Any, name: str, value: Any) -> None:
        v = numbers(value, name)
        v = np.full(3, float(v)) if v.ndim == 0 or v.shape == (1,) else numbers(v, name, shape=(3,))
        function(self.scene, text(name, "name"), address(v))

    def transform(self, name: str, value: Any) -> None:
        lib.imp_scene_transform(self.scene, text(name, "name"), address(value))

    def spectrum(self, name: str, value: Any) -> None:
        """A number; pairs of wavelength in nm and value; a string or file of them."""
        key = text(name, "name")
        if isinstance(value, str) and ":" in value:
            value = [pair.split(":") for pair in value.replace(",", " ").split()]
        elif isinstance(value, str) or hasattr(value, "__fspath__"):
            value = _spectrum_file(value, name)
        if isinstance(value, list) and value and isinstance(value[0], list):
            try:
                value = [[float(x) for x in pair] for pair in value]
            except (TypeError, ValueError, OverflowError) as error:
                raise ArgumentError("%s: %s" % (name, error)) from None
        samples = numbers(value, name)
        if samples.ndim == 0:
            lib.imp_scene_spectrum(self.scene, key, 1, None, address(samples))
            return
        samples = numbers(samples, name, shape=(-1, 2))
        nm, values = np.ascontiguousarray(samples[:, 0]), np.ascontiguousarray(samples[:, 1])
        lib.imp_scene_spectrum(self.scene, key, len(nm), address(nm), address(values))

    def begin(self, type: str, id: Optional[str], name: Optional[str]) -> None:
        # Checked at once: a dictionary may contain itself, and the library limits the depth.
        context().check(lib.imp_scene_begin(self.scene, None, text(type, "type"), text(id, "id") if id else None,
                                            text(name, "name") if name else None))

    def end(self) -> None:
        lib.imp_scene_end(self.scene)

    def mesh(self, name: str, d: dict[str, Any]) -> None:
        m = mesh_of(d, name)
        lib.imp_scene_mesh(self.scene, len(m["positions"]), len(m["indices"]), address(m["positions"]),
                           address(m.get("normals")), address(m.get("uvs")), address(m["indices"]))

    def bulk(self, type: str, name: str, d: dict[str, Any]) -> None:
        """Arrays in place of files, taken out of d."""
        if type == "mesh":
            self.mesh(name, d)
        for key in _PICTURE.get(type, ()):
            if is_array(d.get(key)) or hasattr(d.get(key), "srgb_gamma"):
                p = pixels_of(d.pop(key), "%s: %s" % (name, key), _flag(d.get("raw", False), "%s: raw" % name))
                lib.imp_scene_image(self.scene, p.shape[1], p.shape[0], p.shape[2], address(p))
        make, ending = TABLES.get(type, (None, ""))
        content = make(d, name) if make else None
        if content is not None:
            if "filename" in d:
                raise ArgumentError("%s: arrays and a filename: one of them is wanted" % name)
            self.files += 1
            d["filename"] = os.path.join(self.folder, "%d%s" % (self.files, ending))
            with open(d["filename"], "wb") as file:
                file.write(content)
        for key in _GRID if type == "gridvolume" else ():
            if is_array(d.get(key)):
                g = grid_of(d.pop(key), "%s: %s" % (name, key))
                lib.imp_scene_grid(self.scene, g.shape[2], g.shape[1], g.shape[0], g.shape[3], address(g))

    def value(self, name: str, value: Any, top: bool, of: str = "scene") -> None:
        matrix = None
        if not isinstance(name, str):
            raise TypeError("%s: a key is a %s, which is no string" % (of, builtins.type(name).__name__))
        if isinstance(value, Mapping):
            self.object(name, _entries(value, name), top)
        elif is_mesh(value):
            self.object(name, {"type": "mesh", "mesh": value}, top)
        elif isinstance(value, str) or hasattr(value, "__fspath__"):
            lib.imp_scene_string(self.scene, text(name, "name"), text(value, name))
        elif isinstance(value, (bool, int, float, np.bool_, np.integer, np.floating)):
            self.number(name, value)
        elif hasattr(value, "matrix") or is_array(value):
            matrix = matrix_of(value, name)
            if matrix is not None:
                self.transform(name, matrix)
            elif np.size(v := numbers(value, name)) == 1 and not isinstance(value, (list, tuple)):
                self.number(name, float(v.reshape(())))
            elif v.size == 3:
                self.three(lib.imp_scene_vector, name, v.reshape(3))
            else:
                raise ArgumentError("%s: %s is an array of shape %s: a number, three numbers or a [4][4] matrix are "
                                    "values here; pictures, grids and meshes are given to objects of type 'bitmap', "
                                    "'envmap', 'gridvolume' and 'mesh'" % (of, name, v.shape))
        else:
            raise ArgumentError("%s: %s is a %s: numbers, strings, arrays, transforms and dictionaries are values; for "
                                "an object of another program give the dictionary that it was made from"
                                % (of, name, builtins.type(value).__name__))

    def object(self, name: str, d: dict[str, Any], top: bool) -> None:
        type = d.pop("type", None)
        if not isinstance(type, str):
            raise ArgumentError("'%s' is a dictionary without a 'type'" % name)
        if type == "ref":
            id = d.pop("id", "")
            if not isinstance(id, str):
                raise ArgumentError("%s: the id of a 'ref' is a string, not a %s" % (name, builtins.type(id).__name__))
            lib.imp_scene_ref(self.scene, text(self.ids.get(id, id), "id"), None if top else text(name, "name"))
        elif type == "rgb":
            self.three(lib.imp_scene_rgb, name, d.pop("value", None))
        elif type == "spectrum":
            self.spectrum(name, d.pop("value") if "value" in d else d.pop("filename", None))
        else:
            # At the top a key is the object's id; below, its slot, unless it has an id too.
            id = d.pop("id", name if top else None)
            if id is not None and not isinstance(id, str):
                raise ArgumentError("'%s' (%s): an id is a string, not a %s" % (name, type, builtins.type(id).__name__))
            self.begin(type, id, None if top else name)
            self.bulk(type, name, d)
            for key, v in d.items():
                self.value(key, v, False, "'%s' (%s)" % (name, type))
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
        their keys are their ids, beside an "id" of their own. Values are numbers, strings, three numbers (points and
        vectors), transforms (`ScalarTransform4f`, any object with a `matrix`, or [4][4]),
        colours ``{"type": "rgb", "value": ...}``, spectra ``{"type": "spectrum", "value":
        number or pairs}`` and references ``{"type": "ref", "id": ...}``. Arrays are taken
        where files are, from NumPy and anything with an array interface: a "bitmap" or
        "envmap" takes "bitmap" or "data", [height][width] or [height][width][channels],
        of which uint8 and uint16 are those of a file (sRGB unless "raw"), floats linear,
        and alpha is left out; a "gridvolume" takes "grid" or "data", [nz][ny][nx] or
        [nz][ny][nx][1 or 3]; a "mesh" takes "vertex_positions" [n][3], "faces" [m][3],
        "vertex_normals" and "vertex_texcoords", or "mesh", an object that has them; curves take
        "control_points" [n][4] (x, y, z, radius) or a list of these; "ies" takes "candela"
        [horizontal][vertical] with "vertical_angles" and "horizontal_angles" in degrees;
        "merl" takes "data" [half angles][difference angles][azimuths][3] in 1/sr.
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
    TypeError
        `dictionary` is no mapping, or a key is no string.

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
    d = _entries(dictionary, "scene")
    kind = d.pop("type", None)
    if not isinstance(kind, str) or kind != "scene":
        said = repr(kind) if isinstance(kind, str) else "a " + type(kind).__name__
        raise ArgumentError("the dictionary's type is %s: 'scene' is wanted" % said)
    ctx = context()
    options, kept = _load_options(mode, search, {}, None, upsampling)
    out = ctypes.c_void_p()
    ctx.check(lib.imp_scene_create(ctx.pointer, ctypes.byref(options), ctypes.byref(out)))
    handle = Handle(out.value or 0, lib.imp_scene_destroy)
    own = {k: v["id"] for k, v in d.items() if isinstance(v, Mapping) and isinstance(v.get("id"), str)}
    with tempfile.TemporaryDirectory(prefix="importon-") as folder:
        builder = _Builder(handle.pointer, {k: id for k, id in own.items() if k not in own.values()}, folder)
        for name, value in d.items():
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
