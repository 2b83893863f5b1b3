# SPDX-License-Identifier: Apache-2.0
"""Parameters of a scene: a mapping of names to numbers."""
from __future__ import annotations

import ctypes
import fnmatch
import re
import weakref
from collections.abc import Iterable, Iterator, MutableMapping
from typing import Any, NamedTuple, Optional

import numpy as np

from . import _c
from ._array import address, numbers
from ._errors import ArgumentError, ParameterError
from ._library import lib, make, text
from ._run import not_inside
from ._scene import Scene


class ParameterInfo(NamedTuple):
    """What a parameter is.

    `shape` is () for a single number; `lo` and `hi` bound each number; `why` says why there
    is no gradient, where more can be said."""

    name: str
    unit: str
    shape: tuple[int, ...]
    lo: float
    hi: float
    differentiable: bool
    discontinuous: bool
    integer: bool
    color: bool
    why: str
    position: int  # among the scene's parameters
    size: int  # how many numbers


def table(scene: Scene) -> dict[str, ParameterInfo]:
    """All parameters of a scene, in its order."""
    if scene._table is None:
        found = {}
        for i in range(lib.imp_scene_n_params(scene.pointer)):
            p = make(_c.imp_param_info)
            scene._context.check(lib.imp_scene_get_param(scene.pointer, i, ctypes.byref(p)))
            name = p.name.decode(errors="replace")
            found[name] = ParameterInfo(
                name, (p.unit or b"").decode(errors="replace"), tuple(p.dims[:p.n_dims]), p.lo, p.hi,
                bool(p.flags & _c.IMP_PARAM_DIFFERENTIABLE), bool(p.flags & _c.IMP_PARAM_DISCONTINUOUS),
                bool(p.flags & _c.IMP_PARAM_INTEGER), bool(p.flags & _c.IMP_PARAM_COLOR),
                (p.why or b"").decode(errors="replace"), i, p.count)
        scene._table = found
    table: dict[str, ParameterInfo] = scene._table
    return table


def find(scene: Scene, name: Any) -> ParameterInfo:
    """A parameter by its name, or by what the library takes for it."""
    known = table(scene)
    if name in known:
        return known[name]
    if not isinstance(name, str):
        raise TypeError("a parameter's name is a string, not %r" % (name,))
    index = ctypes.c_size_t()
    if lib.imp_scene_find_param(scene.pointer, text(name, "name"), ctypes.byref(index)):
        raise ParameterError(scene._context.message())
    return list(known.values())[index.value]


class SceneParameters(MutableMapping):  # type: ignore[type-arg]
    """Names and values of a scene's parameters, as `traverse` gives them.

    Reading an item gives a number, or an array [shape] of float64; setting one sets the
    scene at once, after a check of bounds. An array that was read may be changed in place:
    `update` then passes it on.

    Examples
    --------
    >>> params = importon.traverse(importon.load_dict(importon.cornell_box(res=8)))
    >>> params.keep("red.*")
    >>> params["red.reflectance.value"] = 0.01, 0.2, 0.9
    >>> params.update()
    []
    >>> params["red.reflectance.value"]
    array([0.01, 0.2 , 0.9 ])
    >>> params["red.reflectance.value"] = 1.5
    Traceback (most recent call last):
    ...
    importon.ArgumentError: red.reflectance.value = 1.5 is outside [0, 1]
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._kept: dict[str, ParameterInfo] = dict(table(scene))
        self._patterns: Optional[list[str]] = None  # what makes them active; None: "*"
        self._handed: dict[str, list[tuple[Any, Any]]] = {}  # arrays read, and what they held

    @property
    def scene(self) -> Scene:
        """The scene whose parameters they are."""
        return self._scene

    def _find(self, name: Any) -> ParameterInfo:
        info = self._kept.get(name)
        if info is None:
            info = find(self._scene, name)
            if info.name not in self._kept:
                raise ParameterError("%s is not among the parameters that were kept" % info.name)
        return info

    def info(self, name: str) -> ParameterInfo:
        """Shape, bounds, unit and flags of a parameter.

        Parameters
        ----------
        name : str

        Returns
        -------
        ParameterInfo

        Raises
        ------
        ParameterError
            There is no such parameter.

        Examples
        --------
        >>> params = importon.traverse(importon.load_dict(importon.cornell_box(res=8)))
        >>> info = params.info("red.reflectance.value")
        >>> info.shape, info.lo, info.hi, info.differentiable
        ((3,), 0.0, 1.0, True)
        """
        return self._find(name)

    def flags(self, name: str) -> set[str]:
        """The flags of a parameter, as words.

        Parameters
        ----------
        name : str

        Returns
        -------
        set of str
            Of "differentiable", "discontinuous" (it moves edges of the picture), "integer" and
            "color".

        Examples
        --------
        >>> params = importon.traverse(importon.load_dict(importon.cornell_box(res=8)))
        >>> sorted(params.flags("red.reflectance.value"))
        ['color', 'differentiable']
        """
        info = self._find(name)
        return {f for f in ("differentiable", "discontinuous", "integer", "color") if getattr(info, f)}

    def __getitem__(self, name: str) -> Any:
        info = self._find(name)
        with self._scene.lock:
            if not info.shape:
                number = ctypes.c_double()
                self._scene._context.check(
                    lib.imp_scene_get_values(self._scene.pointer, info.position, ctypes.byref(number)))
                return number.value
            values = np.empty(info.shape)
            self._scene._context.check(
                lib.imp_scene_get_values(self._scene.pointer, info.position, address(values)))
        alive = [h for h in self._handed.get(info.name, ()) if h[0]() is not None]
        self._handed[info.name] = [*alive, (weakref.ref(values), values.copy())]
        return values

    def write_volume(self, name: str, path: Any) -> None:
        """Write a grid in space as a .vol file, with the box of the file it was read from.

        Parameters
        ----------
        name : str
        path : path

        Raises
        ------
        ArgumentError
            The parameter is no volume.

        Examples
        --------
        >>> params = importon.traverse(importon.load_dict(importon.cornell_box(res=8)))
        >>> params.write_volume("red.reflectance", "red.vol")
        Traceback (most recent call last):
        importon.ArgumentError: red.reflectance.value is no volume
        """
        info = self._find(name)
        with self._scene.lock:
            self._scene._context.check(lib.imp_scene_write_volume(
                self._scene.pointer, info.position, None, text(path, "path")))

    def __setitem__(self, name: str, value: Any) -> None:
        not_inside()
        info = self._find(name)
        if not info.shape and type(value) is float:
            self._set(info, 1, ctypes.byref(ctypes.c_double(value)))
            return
        v = numbers(value, info.name)
        if v.shape != info.shape and not (v.size == 1 and v.ndim <= 1) and v.shape != (info.size,):
            raise ArgumentError("%s has shape %s, and the value given %s" % (info.name, info.shape, v.shape))
        self._set(info, v.size, address(v))

    def _set(self, info: ParameterInfo, n: int, values: Any) -> None:
        with self._scene.lock:
            self._scene._context.check(lib.imp_scene_set_values(self._scene.pointer, info.position, n, values))
        self._handed.pop(info.name, None)

    def __delitem__(self, name: str) -> None:
        """Keep this parameter no longer; the scene is as it was."""
        self._keep([k for k in self._kept if k != self._find(name).name])

    def __iter__(self) -> Iterator[str]:
        return iter(self._kept)

    def __len__(self) -> int:
        return len(self._kept)

    def __contains__(self, name: object) -> bool:
        return name in self._kept

    def _keep(self, names: list[str]) -> None:
        self._kept = {k: v for k, v in self._kept.items() if k in set(names)}
        self._patterns = list(self._kept)

    def keep(self, keys: Any) -> None:
        """Leave out all but these: what is active in gradients and fits.

        Parameters
        ----------
        keys : str, compiled regular expression, or iterable of them
            Names; patterns as the command line's (``"red.*"``); or, as in Mitsuba, regular
            expressions. A pattern makes those active that have a gradient; a name that has
            none is refused when a gradient is asked for, with the reason.

        Raises
        ------
        ParameterError
            Nothing matches.

        Examples
        --------
        >>> params = importon.traverse(importon.load_dict(importon.cornell_box(res=8)))
        >>> params.keep(["red.*", "light.emitter.radiance"])
        >>> list(params)
        ['light.emitter.radiance.value', 'red.reflectance.value']
        """
        kept: list[str] = []
        active: list[str] = []
        for key in [keys] if isinstance(keys, (str, re.Pattern)) else keys:
            found = self._matching(key)
            kept += found
            usable = [n for n in found if self._kept[n].differentiable]
            active += usable or found
        self._kept = {k: v for k, v in self._kept.items() if k in set(kept)}
        self._patterns = [k for k in self._kept if k in set(active)]

    def _matching(self, key: Any) -> list[str]:
        if isinstance(key, re.Pattern):
            found = [n for n in self._kept if key.fullmatch(n)]
        elif not isinstance(key, str):
            raise TypeError("keep takes names and patterns, not %r" % (key,))
        else:
            found = [n for n in self._kept if n == key or fnmatch.fnmatchcase(n, key)]
            if not found and not any(c in key for c in "*?[\\^$("):
                return [self._find(key).name]
            if not found:
                try:
                    found = [n for n in self._kept if re.fullmatch(key, n)]
                except re.error:
                    found = []
        if not found:
            raise ParameterError("no parameter matches '%s' (there are %d)" % (
                getattr(key, "pattern", key), len(self._kept)))
        return found

    def update(self, values: Any = None, **more: Any) -> list[tuple[str, set[str]]]:  # type: ignore[override]
        """Pass on what was changed in place, and then `values`.

        Parameters
        ----------
        values : mapping, optional
            Names and values; an optimiser of `importon.ad` is one.
        **more
            Further names and values.

        Returns
        -------
        list of (str, set of str)
            Objects that were changed, and their parameters, as in Mitsuba.

        Examples
        --------
        >>> params = importon.traverse(importon.load_dict(importon.cornell_box(res=8)))
        >>> red = params["red.reflectance.value"]
        >>> red[2] = 0.5
        >>> params.update()
        [('red', {'red.reflectance.value'})]
        """
        changed: dict[str, set[str]] = {}
        for name, arrays in list(self._handed.items()):
            alive = [(h(), before) for h, before in arrays]
            for array, before in alive:
                if array is not None and not np.array_equal(array, before):
                    self[name] = array
                    changed.setdefault(name.split(".")[0], set()).add(name)
            self._handed[name] = [(weakref.ref(a), a.copy()) for a, _ in alive if a is not None]
        for name, value in {**dict(values or {}), **more}.items():
            self[name] = value
            full = self._find(name).name
            changed.setdefault(full.split(".")[0], set()).add(full)
        return list(changed.items())

    def __repr__(self) -> str:
        rows = [("name", "value", "bounds", "unit", "gradient")]
        rows += [(i.name, self._value_text(i.name), "[%g, %g]" % (i.lo, i.hi), i.unit,
                  ("yes" if i.differentiable else "no") + (", moves edges" if i.discontinuous else "")
                  + (": " + i.why if i.why else "")) for i in self._kept.values()]
        widths = [max(len(r[c]) for r in rows) for c in range(4)]
        return "\n".join("  ".join([*(t.ljust(w) for t, w in zip(r, widths)), r[4]]) for r in rows)

    def _value_text(self, name: str) -> str:
        """The value in a table: all of a few numbers, or the extremes of many."""
        v = np.atleast_1d(np.asarray(self[name]))
        if v.size > 4:
            return "%d numbers in %.4g .. %.4g" % (v.size, v.min(), v.max())
        return ", ".join("%.6g" % x for x in v.ravel())

    def _repr_html_(self) -> str:
        from ._html import parameters
        return parameters(self)


def traverse(scene: Scene) -> SceneParameters:
    """The parameters of a scene: names, values, shapes, bounds, units, flags.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    SceneParameters

    Examples
    --------
    >>> params = importon.traverse(importon.load_dict(importon.cornell_box(res=8)))
    >>> params["white.reflectance.value"]
    array([0.885809, 0.698859, 0.666422])
    """
    if not isinstance(scene, Scene):
        raise TypeError("traverse takes a scene, not a %s" % type(scene).__name__)
    with scene.lock:
        scene.pointer  # refuses a closed one
        return SceneParameters(scene)


def names_of(params: Any) -> Iterable[str]:
    """What to make active: everything with a gradient, or what is named."""
    if params is None:
        return ["*"]
    if isinstance(params, SceneParameters):
        return ["*"] if params._patterns is None else params._patterns
    if isinstance(params, str):
        return [params]
    try:
        names = list(params)
    except TypeError:
        raise TypeError("params is a %s: traverse(scene), names or patterns are wanted"
                        % type(params).__name__) from None
    return names
