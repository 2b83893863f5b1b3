# SPDX-License-Identifier: Apache-2.0
"""Scenes: loaded from files, strings and dictionaries."""
from __future__ import annotations

import ctypes
import threading
from typing import Any, NamedTuple

import numpy as np

from . import _c
from ._context import Handle
from ._errors import ArgumentError
from ._library import decode, integer, lib, make, text, word
from ._run import not_inside, register_lock

class Sensor(NamedTuple):
    """A sensor of a scene: what `struct imp_sensor_info` has."""

    name: str
    type: str
    width: int
    height: int
    spp: int
    filter: str
    filter_radius: float
    file_format: str


class Scene:
    """A scene, ready to render. Made by `load_file`, `load_string` and `load_dict`.

    Calls from several threads are made one after the other. `close`, or the end of a `with`
    block, frees its memory; pictures made from it stay.

    Attributes
    ----------
    mode : str
        "rgb", "mono", ...
    channels : int
        Of pictures.
    integrator : str
    max_depth : int
        -1: unlimited.
    n_shapes, n_emitters, n_bsdfs, n_textures, n_triangles, memory_bytes : int
    bounds : tuple
        Lowest and highest corner, in scene units.
    sensors : tuple of Sensor

    Examples
    --------
    >>> with importon.load_dict(importon.cornell_box(res=8)) as scene:
    ...     scene.n_emitters, scene.sensors[0].width
    (1, 8)
    """

    def __init__(self, handle: Handle, ctx: Any, name: str) -> None:
        self._handle, self._context, self.name = handle, ctx, name
        self.lock = threading.RLock()
        register_lock(self)
        info = make(_c.imp_scene_info)
        lib.imp_scene_get_info(handle.pointer, ctypes.byref(info))
        self.mode = word("imp_color_mode", info.mode)
        self.channels: int = info.channels
        self.integrator: str = (info.integrator or b"").decode()
        self.max_depth: int = info.max_depth
        self.n_shapes: int = info.n_shapes
        self.n_emitters: int = info.n_emitters
        self.n_bsdfs: int = info.n_bsdfs
        self.n_textures: int = info.n_textures
        self.n_triangles: int = info.n_triangles
        self.memory_bytes: int = info.memory_bytes
        self.bounds = (tuple(info.bounds_min), tuple(info.bounds_max))
        self.sensors = tuple(self._sensor(i) for i in range(info.n_sensors))
        self._table: Any = None

    def _sensor(self, index: int) -> Sensor:
        s = make(_c.imp_sensor_info)
        self._context.check(lib.imp_scene_get_sensor(self._handle.pointer, index, ctypes.byref(s)))
        return Sensor(decode(s.name), decode(s.type), s.width, s.height, s.spp, decode(s.filter),
                      s.filter_radius, decode(s.file_format))

    def sensor_index(self, sensor: Any) -> int:
        """The number of a sensor.

        Parameters
        ----------
        sensor : int or str
            Its number or name.

        Returns
        -------
        int

        Raises
        ------
        ArgumentError
            There is no such sensor; the message has those that there are.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> scene.sensor_index(scene.sensors[0].name)
        0
        """
        if isinstance(sensor, str):
            for at, s in enumerate(self.sensors):
                if s.name == sensor:
                    return at
            raise ArgumentError("there is no sensor '%s'; there are: %s" % (
                sensor, ", ".join(s.name for s in self.sensors)))
        try:
            i: int = sensor.__index__()
        except AttributeError:
            raise TypeError("sensor is %r: a number or a name is wanted" % (sensor,)) from None
        if not 0 <= i < len(self.sensors):
            raise ArgumentError("there is no sensor %d (there are %d)" % (i, len(self.sensors)))
        return i

    def add_pose(self, name: str) -> str:
        """Make the pose of a shape, an instance or a camera a parameter.

        It is six numbers away from where the scene file has the object: a translation in scene
        units, and a rotation vector in radians about the middle of the shape's box or the
        camera's own place. Setting them moves the object; gradients, losses, derivative
        pictures and fits know them, where the parameter is named. To be called before anything has
        been computed from the scene, and before `traverse`.

        Parameters
        ----------
        name : str
            Of a shape, an instance or a camera.

        Returns
        -------
        str
            Of the parameter.

        Raises
        ------
        ArgumentError
            There is no such object, or the scene has been used.
        UnsupportedError
            It cannot be moved, with the reason.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> name = scene.add_pose("light")
        >>> params = importon.traverse(scene)
        >>> params["light.pose"]
        array([0., 0., 0., 0., 0., 0.])
        >>> params["light.pose"] = [0.2, 0, 0, 0, 0, 0.1]
        """
        not_inside()
        with self.lock:
            self._context.check(lib.imp_scene_add_pose(self.pointer, text(name, "name")))
            self._table = None
        return name + ".pose"

    def add_geometry(self, name: str) -> str:
        """Make a number of geometry a parameter.

        `NAME.pose` as `add_pose`; `NAME.pose_end` of an instance that moves in time, likewise of where it
        is at last; `NAME.scale` of a shape, instance, group or gridvolume; `NAME.to_world` of a shape,
        instance, gridvolume, camera, spot or projector, the upper three rows of its matrix; `NAME.vertex_positions` and `NAME.vertex_normals` of a mesh;
        `NAME.control_points` of a bsplinecurve, x, y, z and radius of each;
        `NAME.center` and `NAME.radius` of a sphere; `NAME.p0`, `NAME.p1` and `NAME.radius` of a circular
        cylinder; `NAME.x_fov`, `NAME.principal_point_offset_x` and `_y`, `NAME.opencv_k1`,
        `_k2`, `_p1`, `_p2` and `_k3` of a perspective camera or thin lens;
        `NAME.x_fov` of a projector; `NAME.aperture_radius` and `NAME.focus_distance` of a thin lens; `NAME.position` of a point, spot,
        projector or ies light; `NAME.direction` of a directional, sun, spot, projector or ies light; `NAME.turn` of a sky or a distant sensor;
        `NAME.sun_direction` of a sunsky, ciesky or perezsky, `NAME.sun_radius` of a sun or sunsky. Otherwise as `add_pose`.

        Parameters
        ----------
        name : str
            Such a name.

        Returns
        -------
        str
            Of the parameter: the same.

        Raises
        ------
        ArgumentError
            There is no such object or number, or the scene has been used.
        UnsupportedError
            It cannot be moved, with the reason.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> name = scene.add_geometry("sensor.x_fov")
        """
        not_inside()
        with self.lock:
            self._context.check(
                lib.imp_scene_add_geometry(self.pointer, text(name, "name")))
            self._table = None
        return name

    def set_text(self, settings: str) -> None:
        """Set parameters by lines `NAME=V` or `NAME=V,V,..`, such as those of a fit's recovered.txt.

        Names of geometry (`NAME.pose`) become parameters first, as by `add_geometry`. Empty lines and
        lines that begin with # are skipped. Lines before a wrong one are set.

        Parameters
        ----------
        settings : str
            The lines.

        Raises
        ------
        ArgumentError
            A line is malformed, or there is no such parameter or value.
        UnsupportedError
            Something cannot be moved, with the reason.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> scene.set_text("red.reflectance.value=0.5,0.1,0.1")
        """
        not_inside()
        lines = text(settings, "settings")
        with self.lock:
            self._context.check(lib.imp_scene_set_text(self.pointer, lines, len(lines), b"settings"))
            self._table = None

    @property
    def geometry_names(self) -> list[str]:
        """What `add_geometry` accepts: numbers of geometry of this scene's shapes, sensors, lights, instances and volumes."""
        names: list[str] = []
        buffer = ctypes.create_string_buffer(256)
        with self.lock:
            while lib.imp_scene_geometry_name(self.pointer, len(names), len(buffer), buffer) == 0:
                names.append(buffer.value.decode())
        return names

    def place(self, name: str) -> tuple[Any, float]:
        """Where what a number of geometry moves is now: its middle and its radius.

        The middle is the point that a pose turns about, a light's or camera's own place, else the
        middle of the box of the shape; the radius is half the diagonal of that box, of what has no
        size a twentieth of the scene's.

        Parameters
        ----------
        name : str
            A parameter of geometry (`add_geometry`).

        Returns
        -------
        numpy.ndarray [3], float

        Raises
        ------
        ParameterError
            There is no such parameter.
        ArgumentError
            It moves nothing that has a place.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> middle, radius = scene.place(scene.add_geometry("small-box.pose"))
        """
        from . import _params

        not_inside()
        index = _params.find(self, name).position
        middle, radius = (ctypes.c_double * 3)(), ctypes.c_double()
        with self.lock:
            self._context.check(lib.imp_scene_place(self.pointer, index, middle, ctypes.byref(radius)))
        return np.array(middle), radius.value

    def film_points(self, points: Any, sensor: int = 0) -> Any:
        """Where a sensor sees points, in pixels from the upper left corner of its picture.

        Parameters
        ----------
        points : array_like [..., 3]
            In the scene's units.
        sensor : int
            Its number, as of `render`.

        Returns
        -------
        numpy.ndarray [..., 2]
            NaN where a point is not in the picture; what hides a point does not count.

        Raises
        ------
        ArgumentError
            There is no such sensor, or points have other shapes or are not finite.
        UnsupportedError
            It has no picture in which a point is seen.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> scene.film_points([0, 0, 0]).round(6).tolist()
        [4.0, 4.0]
        """
        not_inside()
        p = np.ascontiguousarray(points, dtype=np.float64)
        if p.ndim < 1 or p.shape[-1] != 3:
            raise ArgumentError("points have a shape [..., 3], not %r" % (p.shape,))
        number = integer(sensor, "sensor")
        film = np.empty(p.shape[:-1] + (2,))
        flat, out = p.reshape(-1, 3), (ctypes.c_double * 2)()
        with self.lock:
            for row, to in zip(flat, film.reshape(-1, 2)):
                self._context.check(lib.imp_scene_film_point(self.pointer, number, (ctypes.c_double * 3)(*row), out))
                to[:] = out
        return film

    @property
    def pointer(self) -> int:
        if self._handle.closed:
            raise ArgumentError("the scene is closed")
        return self._handle.pointer

    def close(self) -> None:
        """Free the scene; pictures made from it stay. Using it afterwards is an ArgumentError.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> scene.close()
        >>> importon.render(scene)
        Traceback (most recent call last):
        ...
        importon.ArgumentError: the scene is closed
        """
        not_inside()
        with self.lock:
            self._handle.close()

    def __enter__(self) -> Scene:
        return self

    def __exit__(self, *error: Any) -> None:
        self.close()

    def __reduce__(self) -> Any:
        raise TypeError("a scene cannot be copied to another process: load it there")

    def __repr__(self) -> str:
        if self._handle.closed:
            return "<importon.Scene '%s', closed>" % self.name
        return "<importon.Scene '%s': %s, %d shapes, %d emitters, %d sensors>" % (
            self.name, self.mode, self.n_shapes, self.n_emitters, len(self.sensors))

    def _repr_html_(self) -> str:
        from ._html import scene
        return scene(self)
