# SPDX-License-Identifier: Apache-2.0
"""The deterministic solver: finite elements with directional importance.

Its results have no noise, and a bias by mesh and directional order. It takes rectangles,
cubes and meshes, area lights, and smooth isotropic materials without textures.
"""
from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Optional

import numpy as np

from . import _c
from ._array import copy_doubles, numbers
from ._library import (ArgumentError, Handle, choice, explained, failure, integer, lib, make, not_inside,
                       rows_of, run, text, warn_said)
from ._params import Values
from ._picture import Picture, from_film
from ._problem import Problem, check_scene
from ._scene import Scene


class Sensitivity(NamedTuple):
    """A derivative of the measurement; `share` is value x derivative / measurement."""

    name: str
    param: int
    element: int
    emission: bool
    value: float
    derivative: float
    share: float
    share_error: float


def _struct(kind: Any, given: Any, what: str, words: Mapping[str, str] = {}) -> tuple[Any, list[Any]]:
    """A struct from a dictionary of its fields, and what it points to."""
    if not isinstance(given, Mapping):
        raise TypeError("%s is a %s: a dictionary is wanted" % (what, type(given).__name__))
    s, kept = make(kind), []
    known = dict((f[0], f[1]) for f in kind._fields_ if f[0] != "size")
    for name, value in given.items():
        if name not in known:
            raise TypeError("%s has no '%s'; it has: %s" % (what, name, ", ".join(known)))
        if name in words:
            value = choice(words[name], value, name)
        elif known[name] is ctypes.c_char_p:
            value = text(value, name)
            kept.append(value)
        elif hasattr(known[name], "_length_"):
            value = known[name](*[known[name]._type_(v) if known[name]._type_ is ctypes.c_int else v for v in (
                [integer(x, name) for x in value] if known[name]._type_ is ctypes.c_int
                else numbers(value, name, shape=(known[name]._length_,)).tolist())])
        elif known[name] is ctypes.c_bool:
            value = bool(value)
        elif known[name] is ctypes.c_int:
            value = integer(int(value) if isinstance(value, bool) else value, name)
        elif known[name] is ctypes.c_double:
            value = float(value)
        setattr(s, name, value)
    return s, kept


def _structs(kind: Any, given: Sequence[Any], what: str, words: Mapping[str, str] = {}) -> tuple[Any, list[Any]]:
    pairs = [_struct(kind, g, what, words) for g in given]
    return (kind * max(len(pairs), 1))(*[p[0] for p in pairs]), [p[1] for p in pairs]


class Elements:
    """A finite-element solution of a scene.

    Parameters
    ----------
    scene : Scene
        Which the solution keeps.
    sources : sequence of dict, optional
        Measurements: ``{"kind": "camera", "sensor": 0, "region": (x0, y0, x1, y1)}``, ``{"kind":
        "plane", "origin": ..., "edge_u": ..., "edge_v": ...}`` (mean illuminance), ``{"kind":
        "shape", "shape": name}``; each may have a "weight". Default: the sensor's picture.
    phong, beams : sequence of dict, optional
        As `struct imp_elements_phong` and `struct imp_elements_beam` of importon/elements.h.
    open : path, optional
        A file that `save` wrote, of the same scene and options; else it is solved.
    progress : bool or callable, optional
        See `importon.set_progress`.
    **options
        order, no_importance, sensor, rays, stop, eps_first, eps_last, sweeps, final_sweeps,
        max_level, max_links, max_bytes, time_limit_s, seed, picture: as in `struct
        imp_elements_options`.

    Raises
    ------
    UnsupportedError
        A shape, material or light that has no place here, by name.
    Cancelled
        The callback stopped it; the solution reached is in `result`, coarser and valid.

    Attributes
    ----------
    measures : ndarray
        Of each source by itself.
    measure : float
        Weighted.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> solution = importon.elements.Elements(scene, stop=0.2)
    >>> solution.image().shape
    (8, 8, 3)
    """

    def __init__(self, scene: Scene, sources: Sequence[Any] = (), *, phong: Sequence[Any] = (),
                 beams: Sequence[Any] = (), open: Any = None, progress: Any = None, **options: Any) -> None:
        not_inside()
        self.scene = check_scene(scene)
        known = {f[0]: f[1] for f in _c.imp_elements_options._fields_}
        allowed = [k for k in known if k not in ("size", "n_sources", "sources", "n_phong", "phong", "n_beams",
                                                 "beams", "progress", "progress_payload")]
        for name in options:
            if name not in allowed:
                raise TypeError("Elements has no option '%s'; it has: %s" % (name, ", ".join(allowed)))
        values = {k: (float(v) if known[k] is ctypes.c_double else
                      integer(int(v) if isinstance(v, bool) else v, k, 0 if known[k] is not ctypes.c_int else -2**31,
                              2**64 - 1 if known[k] is not ctypes.c_int else 2**31 - 1))
                  for k, v in options.items()}
        self._kept = [_structs(_c.imp_elements_source, sources, "a source", {"kind": "imp_elements_source_kind"}),
                      _structs(_c.imp_elements_phong, phong, "phong"), _structs(_c.imp_elements_beam, beams, "a beam")]
        arrays = [ctypes.addressof(k[0]) for k in self._kept]
        self._options = make(_c.imp_elements_options, n_sources=len(sources), sources=arrays[0] if sources else None,
                             n_phong=len(phong), phong=arrays[1] if phong else None, n_beams=len(beams),
                             beams=arrays[2] if beams else None, progress_payload=id(self), **values)
        self._context = scene._context
        self._handle: Optional[Handle] = None
        with scene.lock:
            out = ctypes.c_void_p()
            path = None if open is None else text(open, "open")
            if path is not None:
                status, message = run(self._context, self._options, progress, lib.imp_elements_open, scene.pointer,
                                      ctypes.byref(self._options), path, ctypes.byref(out))
            else:
                status, message = run(self._context, self._options, progress, lib.imp_elements_create, scene.pointer,
                                      ctypes.byref(self._options), ctypes.byref(out))
            if status:
                raise failure(status, message)
            self._handle = Handle(out.value or 0, lib.imp_elements_destroy)
        if path is None:
            self._solve(lib.imp_elements_solve, progress)

    @property
    def pointer(self) -> int:
        self.scene.pointer  # it must be there, too
        if self._handle is None:
            raise ArgumentError("there is no solution")
        return self._handle.pointer

    def _solve(self, function: Any, progress: Any) -> None:
        with self.scene.lock:
            status, message = self._run(progress, function, self.pointer)
            if status:
                raise failure(status, message, self if status == _c.IMP_CANCELLED else None)

    def _run(self, progress: Any, function: Any, *arguments: Any) -> tuple[int, str]:
        return run(self._context, self._options, progress, function, *arguments)

    def update(self, progress: Any = None) -> None:
        """Take the scene's parameters as they are now, and solve on the same links.

        Parameters
        ----------
        progress : bool or callable, optional

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> solution = importon.elements.Elements(scene, stop=0.2)
        >>> before, params = solution.measure, importon.traverse(scene)
        >>> params["light.emitter.radiance"] = 2 * params["light.emitter.radiance"]
        >>> solution.update()
        >>> round(solution.measure / before, 6)
        2.0
        """
        self._solve(lib.imp_elements_update, progress)

    def image(self, sensor: Any = 0, kind: str = "gouraud", rays: int = 0) -> Picture:
        """A picture through a sensor.

        Parameters
        ----------
        sensor : int or str
        kind : str
            "flat", "gouraud", "gather" (last reflection by the true material) or
            "importance".
        rays : int
            For each side of a pixel's grid; 0: as in the options.

        Returns
        -------
        Picture
            Of kind "importance" with one channel; without standard errors: there is no noise.

        Raises
        ------
        ArgumentError
            There is no such sensor or kind.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> importon.elements.Elements(scene, stop=0.2).image(kind="importance").channels
        ('importance',)
        """
        not_inside()
        with self.scene.lock:
            out = ctypes.c_void_p()
            self._context.check(lib.imp_elements_image(
                self.pointer, self.scene.sensor_index(sensor), choice("imp_elements_image", kind, "kind"),
                integer(rays, "rays"), ctypes.byref(out)))
            return from_film(out.value)

    @property
    def info(self) -> dict[str, Any]:
        """Sizes, memory, measurements and the schedule's log: what `struct imp_elements_info` has."""
        with self.scene.lock:
            i = make(_c.imp_elements_info)
            self._context.check(lib.imp_elements_get_info(self.pointer, ctypes.byref(i)))
            made = {f[0]: getattr(i, f[0]) for f in i._fields_ if f[0] not in ("size", "steps", "n_steps")}
            made["measures"] = copy_doubles(i.measures, (i.n_measures,))
            made["reason"] = (i.reason or b"").decode(errors="replace")
            steps = rows_of(_c.imp_elements_step, i.steps, i.n_steps)
            made["steps"] = [{f[0]: getattr(s, f[0]) for f in s._fields_ if f[0] != "size"} for s in steps]
            return made

    @property
    def measures(self) -> Any:
        """[n_sources]: each measurement by itself, without its weight."""
        return self.info["measures"]

    @property
    def measure(self) -> float:
        """The weighted measurements together."""
        return float(self.info["measure"])

    def sensitivity(self, errors: bool = False) -> list[Sensitivity]:
        """Derivatives of the measurement to every light and material number, the largest
        |value x derivative| first.

        Parameters
        ----------
        errors : bool
            Also the error of each share that the directional order makes; takes the time of
            another solution.

        Returns
        -------
        list of Sensitivity

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> rows = importon.elements.Elements(scene, stop=0.2).sensitivity()
        >>> round(sum(r.share for r in rows if r.emission), 6)  # linear in the lights
        1.0
        """
        not_inside()
        function = lib.imp_elements_share_errors if errors else lib.imp_elements_sensitivity
        with self.scene.lock:
            rows, n = ctypes.c_void_p(), ctypes.c_size_t()
            self._context.check(function(self.pointer, ctypes.byref(rows), ctypes.byref(n)))
            found = rows_of(_c.imp_elements_row, rows.value, n.value)
            return [Sensitivity(r.name.decode(errors="replace"), r.param, r.element, bool(r.emission), r.value,
                                r.derivative, r.share, r.share_error) for r in found]

    def element(self, index: int) -> dict[str, Any]:
        """One element of the hierarchy, to be drawn.

        Parameters
        ----------
        index : int
            Below ``info["elements"]``.

        Returns
        -------
        dict
            What `struct imp_elements_element` has; `corner` as an array [corners][3], `parent` None
            for whole polygons, `shape` None for measuring planes.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> solution = importon.elements.Elements(scene, stop=0.2)
        >>> solution.element(0)["level"], solution.element(0)["parent"]
        (0, None)
        """
        not_inside()
        with self.scene.lock:
            x = make(_c.imp_elements_element)
            self._context.check(lib.imp_elements_get_element(self.pointer, integer(index, "index", 0, 2**64 - 1), ctypes.byref(x)))
            made = {f[0]: getattr(x, f[0]) for f in x._fields_ if f[0] != "size"}
            made["shape"] = None if x.shape is None else x.shape.decode(errors="replace")
            made["parent"] = None if x.parent == 2 ** (8 * ctypes.sizeof(ctypes.c_size_t)) - 1 else x.parent
            made["corner"] = np.array(x.corner).reshape(4, 3)[:x.corners].copy()
            for name in ("radiance", "irradiance"):
                made[name] = np.array(made[name])
            made["leaf"] = bool(x.leaf)
            return made

    def arrivals(self, index: int) -> Any:
        """What arrives at an element, link by link, the brightest first.

        Parameters
        ----------
        index : int

        Returns
        -------
        ndarray
            A structured array: `from` (an element), `irradiance` [3], `illuminance`, `measure` (of the
            measurement: what passes here).

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> solution = importon.elements.Elements(scene, stop=0.2)
        >>> rows, element = solution.arrivals(0), solution.element(0)
        >>> bool(abs(rows["illuminance"].sum() - element["illuminance"]) < 1e-3 * element["illuminance"])
        True
        """
        kind = np.dtype([("from", np.uintp), ("irradiance", float, 3), ("illuminance", float), ("measure", float)])
        not_inside()
        with self.scene.lock:
            rows, n = ctypes.c_void_p(), ctypes.c_size_t()
            self._context.check(lib.imp_elements_arrivals(self.pointer, integer(index, "index", 0, 2**64 - 1),
                                                          ctypes.byref(rows), ctypes.byref(n)))
            found = rows_of(_c.imp_elements_arrival, rows.value, n.value)
            made = np.array([(getattr(r, "from"), tuple(r.irradiance), r.illuminance, r.measure) for r in found], kind)
            lib.imp_free(self._context.pointer, rows)
            return made

    def illuminance(self, index: int, width: int, height: int) -> Any:
        """Illuminance at points of the polygon of an element, each with its own visibility.

        Parameters
        ----------
        index : int
        width, height : int
            Of cells along the polygon's first edge and along its last.

        Returns
        -------
        ndarray
            [height][width]; NaN outside a triangle.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> solution = importon.elements.Elements(scene, [{"kind": "shape", "shape": "floor"}], stop=0.2)
        >>> solution.illuminance(0, 4, 4).shape
        (4, 4)
        """
        not_inside()
        cells = (integer(width, "width", 1, 4096), integer(height, "height", 1, 4096))
        out = np.empty((cells[1], cells[0]))
        with self.scene.lock:
            self._context.check(lib.imp_elements_illuminance(self.pointer, integer(index, "index", 0, 2**64 - 1), *cells, out.ctypes.data))
        return out

    @explained
    def fit(self, targets: Any, params: Any = None, *, optimizer: Optional[str] = None, max_iterations: int = 0,
            tolerance: float = 0, rounds: int = 0, bounds: Optional[Mapping[str, Any]] = None,
            tikhonov: Optional[Mapping[str, float]] = None, stay: Optional[Mapping[str, float]] = None,
            progress: Any = None) -> ElementsFit:
        """Lights and reflectances for wanted measurements; scene and solution end at them.

        Parameters
        ----------
        targets : array
            [sources]: the wanted measurement of each.
        params : SceneParameters, names or patterns
            The active parameters; None: all that have a gradient.
        optimizer : str, optional
            Default: "lm" up to 256 numbers, else "lbfgs".
        max_iterations, rounds : int
            0: 100 and 3.
        tolerance : float
            Of steps; 0: 1e-8.
        bounds : mapping, optional
            Pattern -> (lo, hi).
        tikhonov, stay : mapping, optional
            As `importon.loss`'s.
        progress : bool or callable, optional

        Returns
        -------
        ElementsFit

        Raises
        ------
        Cancelled
            By the callback; `result` is the state reached, which the scene has.
        ArgumentError
            A target is negative, or there are not as many as sources.
        UnsupportedError
            Finite elements have no derivative of an active number.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> solution = importon.elements.Elements(scene, stop=0.2)
        >>> fit = solution.fit([1.5 * solution.measure], "light.*", stay={"light.*": 1e-6}, rounds=1)
        >>> target, before, after = fit.goals[0]
        >>> abs(after / target - 1) < 1e-3
        True
        """
        with Problem(self.scene, params) as p:
            n_sources = max(int(self._options.n_sources), 1)
            wanted = numbers(targets, "targets", shape=(n_sources,))
            pairs = [(text(g, "bounds"), *map(float, b)) for g, b in dict(bounds or {}).items()]
            limits = (_c.imp_elements_bounds * max(len(pairs), 1))(*[_c.imp_elements_bounds(*q) for q in pairs])
            p.add_regularisers(tikhonov, stay, None)
            options = make(_c.imp_elements_fit_options, max_iterations=integer(max_iterations, "max_iterations"),
                           tolerance=float(tolerance), rounds=integer(rounds, "rounds"), targets=wanted.ctypes.data,
                           optimizer=choice("imp_optimizer", optimizer, "optimizer") if optimizer else 0,
                           n_bounds=len(pairs), bounds=ctypes.addressof(limits) if pairs else None)
            out = ctypes.c_void_p()
            status, message = self._run(progress, lib.imp_elements_fit, self.pointer, p.pointer, ctypes.byref(options),
                                        ctypes.byref(out))
            answer = None
            if out.value and status in (_c.IMP_OK, _c.IMP_CANCELLED):
                answer = ElementsFit(p, _c.imp_elements_fit_result.from_address(out.value))
            if status:
                raise failure(status, message, answer)
            assert answer is not None
            return answer

    def save(self, path: Any) -> None:
        """Write elements and links to a file, which `Elements(scene, open=path)` reads.

        Parameters
        ----------
        path : str or PathLike

        Raises
        ------
        FileError
            It cannot be written.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> solution = importon.elements.Elements(scene, stop=0.2)
        >>> solution.save("box.el")
        >>> importon.elements.Elements(scene, stop=0.2, open="box.el").measure == solution.measure
        True
        """
        with self.scene.lock:
            self._context.check(lib.imp_elements_save(self.pointer, text(path, "path")))

    def export(self, path: Any) -> None:
        """Write leaves with mean radiance and importance.

        Parameters
        ----------
        path : str or PathLike
            .ply or .json.

        Raises
        ------
        ArgumentError
            Another extension.
        FileError
            It cannot be written.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> importon.elements.Elements(scene, stop=0.2).export("box.ply")
        """
        with self.scene.lock:
            self._context.check(lib.imp_elements_export(self.pointer, text(path, "path")))

    def __repr__(self) -> str:
        i = self.info
        return "<importon.elements.Elements: %d elements, %d links, order %d, measure %.6g: %s>" % (
            i["elements"], i["links"], i["order"], i["measure"], i["reason"])


class ElementsFit(Values):
    """An answer of `Elements.fit`: name -> `FitVariable` (no intervals: there is no noise).

    Attributes
    ----------
    goals : list of (target, before, after)
        Of each source.
    objective : float
    iterations, rounds : int
    linear : bool
        Only lights were active.
    reason : str
    """

    def __init__(self, problem: Any, result: Any) -> None:
        from ._fit import variables
        super().__init__(problem.scene, variables(result, problem.blocks, None, problem.x()))
        goals = rows_of(_c.imp_elements_goal, result.goals, result.n_goals)
        self.goals = [(g.target, g.before, g.after) for g in goals]
        self.objective: float = result.objective
        self.iterations: int = result.iterations
        self.rounds: int = result.rounds
        self.linear = bool(result.linear)
        self.history = copy_doubles(result.history, (result.n_history,))
        self.reason = (result.reason or b"").decode(errors="replace")

    def __repr__(self) -> str:
        lines = ["%d rounds, objective %.4g: %s" % (self.rounds, self.objective, self.reason)]
        lines += ["source %d: %.6g, wanted %.6g, before %.6g" % (i, a, t, b) for i, (t, b, a) in enumerate(self.goals)]
        lines += ["%-32s %s" % (n, np.array2string(np.asarray(v.value), precision=6)) for n, v in self.items()]
        return "\n".join(lines)


class Guide:
    """What walks are told about the light, to draw from: see `guide`."""

    def __init__(self, elements: Elements, handle: Handle) -> None:
        self.elements, self._handle = elements, handle

    def _guide_pointer(self) -> int:
        self.elements.pointer
        return self._handle.pointer


@explained
def guide(elements: Elements, *, lights: bool = True, share: float = 0, roulette: float = 0) -> Guide:
    """A solution as a guide for walks: it changes the noise of pictures and gradients, never
    their mean.

    Parameters
    ----------
    elements : Elements
    lights : bool
        Light samples follow what every light sends to a place; light walks begin by importance.
    share : float
        Of continuations drawn towards indirect light, or importance by light walks, 0 to 1.
    roulette : float
        Russian roulette of walks from the sensor by expected contribution; 0: off.

    Returns
    -------
    Guide
        For the keyword `guide` of `importon.render`, `importon.loss`, ...

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> guide = importon.guide(importon.elements.Elements(scene, stop=0.2))
    >>> importon.render(scene, spp=4, guide=guide).shape
    (8, 8, 3)
    """
    if not isinstance(elements, Elements):
        raise TypeError("a guide is made from Elements, not from a %s" % type(elements).__name__)
    options = make(_c.imp_elements_guide_options, no_lights=not lights, share=float(share), roulette=float(roulette))
    with elements.scene.lock:
        out = ctypes.c_void_p()
        elements._context.check(lib.imp_elements_guide(elements.pointer, ctypes.byref(options), ctypes.byref(out)))
        warn_said()
        return Guide(elements, Handle(out.value or 0, lib.imp_guide_destroy))


__all__ = ["Elements", "ElementsFit", "Guide", "Sensitivity", "guide"]
