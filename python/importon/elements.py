# SPDX-License-Identifier: Apache-2.0
"""The deterministic solver: finite elements with directional importance.

Its results have no noise, and a bias by mesh and directional order. It takes rectangles,
cubes and meshes, area lights, and smooth isotropic materials without textures.
"""
from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any, Optional

import numpy as np

from . import _c
from ._array import copy_doubles, numbers
from ._context import Handle, failure
from ._elements_read import ElementsRead, Sensitivity
from ._guide import Guide, guide
from ._library import choice, explained, integer, lib, make, rows_of, text
from ._picture import Picture, from_film
from ._problem import Problem, check_scene
from ._run import not_inside, run
from ._scene import Scene
from ._struct import structs_of
from ._values import Values


class Elements(ElementsRead):
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
        self._kept = [structs_of(_c.imp_elements_source, sources, "a source", {"kind": "imp_elements_source_kind"}),
                      structs_of(_c.imp_elements_phong, phong, "phong"), structs_of(_c.imp_elements_beam, beams, "a beam")]
        arrays = [ctypes.addressof(k[0]) for k in self._kept]
        self._options = make(_c.imp_elements_options, n_sources=len(sources), sources=arrays[0] if sources else None,
                             n_phong=len(phong), phong=arrays[1] if phong else None, n_beams=len(beams),
                             beams=arrays[2] if beams else None, progress_payload=id(self), **values)
        self._context = scene._context
        self._handle = None
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


for _thing in (Guide, Sensitivity, guide):
    _thing.__module__ = __name__  # known by the name that users import
del _thing

__all__ = ["Elements", "ElementsFit", "Guide", "Sensitivity", "guide"]
