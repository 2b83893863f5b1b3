# SPDX-License-Identifier: Apache-2.0
"""Scenes from files and strings, and what they compute with."""
from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any, Optional

from . import _c
from ._context import Handle, context, warn_said
from ._errors import ArgumentError
from ._library import choice, lib, make, text
from ._run import not_inside
from ._scene import Scene

_mode = "rgb"


def set_variant(*names: str) -> None:
    """What scenes loaded from now on compute with, by Mitsuba's names.

    Parameters
    ----------
    *names : str
        The first that there is, as in Mitsuba: its word for colours counts ("llvm_ad_rgb":
        "rgb", "scalar_mono": "mono").

    Examples
    --------
    >>> importon.set_variant("llvm_ad_mono")
    >>> importon.variant()
    'mono'
    >>> importon.set_variant("scalar_rgb")
    """
    global _mode
    for name in names:
        for part in name.split("_"):
            if part in _c.WORDS["imp_color_mode"]:
                _mode = part
                return
    raise ArgumentError("there is no variant %s; one names a colour mode: %s" % (
        " or ".join(map(repr, names)), ", ".join(_c.WORDS["imp_color_mode"])))


def variant() -> str:
    """The colour mode of scenes loaded now.

    Returns
    -------
    str

    Examples
    --------
    >>> importon.variant()
    'rgb'
    """
    return _mode


def _load_options(mode: Optional[str], search: Sequence[Any], defines: dict[str, Any],
                  weights: Optional[str] = None, upsampling: str = "sigmoid",
                  lenient: bool = False, bins: Optional[str] = None,
                  luminaires: Any = None) -> tuple[Any, Any]:
    """imp_load_options, and what it points to."""
    if isinstance(search, (str, bytes)) or hasattr(search, "__fspath__"):
        search = [search]
    pairs = [text("%s=%s" % (k, _define(k, v)), k) for k, v in defines.items()]
    folders = [text(f, "search") for f in search]
    files = [text("%s=%s" % (name, f if isinstance(f, str) else ",".join(map(str, f))), "luminaires")
             for name, f in dict(luminaires or {}).items()]
    lamps = (ctypes.c_char_p * (len(files) + 1))(*files)
    names = (ctypes.c_char_p * (len(pairs) + 1))(*pairs)
    paths = (ctypes.c_char_p * (len(folders) + 1))(*folders)
    options = make(_c.imp_load_options, mode=choice("imp_color_mode", mode or _mode, "mode"),
                   defines=ctypes.addressof(names), n_defines=len(pairs),
                   search=ctypes.addressof(paths), n_search=len(folders),
                   luminaires=ctypes.addressof(lamps), n_luminaires=len(files),
                   weights=None if weights is None else text(weights, "weights"),
                   bins=None if bins is None else text(bins, "bins"),
                   upsampling=choice("imp_upsampling", upsampling, "upsampling"), lenient=int(bool(lenient)))
    return options, (names, paths, lamps)


def _define(name: str, value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float, str)) or hasattr(value, "__fspath__"):
        return str(value)
    try:
        return ", ".join(repr(float(v)) for v in value)
    except (TypeError, ValueError):
        raise TypeError("%s is a %s, which no $%s can be" % (name, type(value).__name__, name)) from None


def _load(function: Any, arguments: tuple[Any, ...], name: str, mode: Optional[str], search: Sequence[Any],
          weights: Any, upsampling: str, lenient: bool, bins: Any, luminaires: Any, defines: dict[str, Any]) -> Scene:
    not_inside()
    ctx = context()
    options, kept = _load_options(mode, search, defines, _weights(weights), upsampling, lenient, _bins(bins), luminaires)
    out = ctypes.c_void_p()
    status = function(ctx.pointer, *arguments, ctypes.byref(options), ctypes.byref(out))
    del kept
    if status and "was given, but nothing uses $" in ctx.message():
        raise TypeError(ctx.message().replace("parameter", "keyword", 1))
    ctx.check(status)
    warn_said()
    return Scene(Handle(out.value or 0, lib.imp_scene_destroy), ctx, name)


def _weights(weights: Any) -> Optional[str]:
    """Weights of densities as the scene format has them: "kernel=1, emitters=0.5"."""
    if weights is None or isinstance(weights, str):
        return weights
    if not isinstance(weights, Mapping):
        raise TypeError("weights is a %s: densities and their weights are wanted" % type(weights).__name__)
    return ", ".join("%s=%r" % (k, float(v)) for k, v in weights.items())


def _bins(bins: Any) -> Optional[str]:
    """Bins of wavelengths as the scene format has them: "400, 700, 30"."""
    if bins is None or isinstance(bins, str):
        return bins
    lo, hi, n = bins
    return "%r, %r, %d" % (float(lo), float(hi), int(n))


def load_file(path: Any, *, mode: Optional[str] = None, search: Sequence[Any] = (), weights: Any = None,
              upsampling: str = "sigmoid", lenient: bool = False, bins: Any = None, luminaires: Any = None, parallel: bool = True,
              optimize: bool = True, **defaults: Any) -> Scene:
    """Load a scene file (Mitsuba 3 XML).

    Parameters
    ----------
    path : str or PathLike
    mode : str, optional
        What walks carry: "rgb", "mono", "spectral" (four wavelengths) or "single" (one).
        Default: that of `set_variant`.
    search : sequence of path, optional
        Folders in which files that the scene names are searched for, too.
    weights : mapping or str, optional
        Densities that directions are drawn from, and their weights, in place of the
        integrator's own: ``{"kernel": 1, "emitters": 0.5}`` ("kernel", "emitters",
        "environment", "proxies", "guide", "uniform").
    upsampling : str
        Of spectral modes: how colours become spectra, "sigmoid" (Jakob and Hanika) or "linear".
    lenient : bool
        Go on without plugins and properties that this version does not have, with warnings.
    bins : sequence of three numbers, optional
        Of spectral modes: (from, to, n) in nm; pictures have n bins of wavelengths for
        channels, in place of the film's.
    luminaires : mapping, optional
        Photometric files in place of those of emitters `ies`, by name or pattern: {"lamp_*": "opal.ldt"}; of
        several, ["opal.ldt", "spot.ies"], each is a luminaire "NAME:opal" of its own at the same place (`design`).
    parallel, optimize : bool
        Taken as Mitsuba's are; without effect.
    **defaults
        Values of the file's `<default>`s: ``res=128`` is ``$res``.

    Returns
    -------
    Scene

    Raises
    ------
    FileError
        The file cannot be read.
    SceneError
        It is not valid: `file`, `line` and `column` tell the place.
    UnsupportedError
        It has a plugin that this version does not have.
    TypeError
        A keyword that the file does not use.

    Examples
    --------
    >>> scene = importon.load_file("cornell.xml", res=16, spp=4)
    >>> scene.sensors[0].width
    16
    """
    return _load(lib.imp_scene_load, (text(path, "path"),), str(path), mode, search, weights,
                 upsampling, lenient, bins, luminaires, defaults)


def load_string(xml: str, *, name: str = "string", mode: Optional[str] = None, search: Sequence[Any] = (),
                weights: Any = None, upsampling: str = "sigmoid", lenient: bool = False, bins: Any = None, luminaires: Any = None,
                parallel: bool = True, optimize: bool = True, **defaults: Any) -> Scene:
    """Load a scene from text, as `load_file` does from a file.

    Parameters
    ----------
    xml : str
    name : str
        Stands for the file in messages.
    mode, search, weights, upsampling, lenient, bins, luminaires, parallel, optimize, **defaults
        As `load_file`'s. Files are searched for in the working folder.

    Returns
    -------
    Scene

    Raises
    ------
    SceneError, UnsupportedError, TypeError
        As `load_file`.

    Examples
    --------
    >>> importon.load_string("<scene version='3.0.0'><shape type='spher'/></scene>")
    Traceback (most recent call last):
    ...
    importon.UnsupportedError: string:1:24: ...
    """
    data = xml.encode() if isinstance(xml, str) else bytes(xml)
    return _load(lib.imp_scene_load_string, (data, len(data), text(name, "name")), name, mode, search,
                 weights, upsampling, lenient, bins, luminaires, defaults)
