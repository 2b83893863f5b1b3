# SPDX-License-Identifier: Apache-2.0
"""Adjoint and differentiable light transport.

A scene is loaded (`load_file`, `load_string`, `load_dict`), its parameters are seen and set
(`traverse`), pictures and derivatives are made from it (`render`, `render_forward`,
`render_backward`, `jacobian`, `functional`, `loss`), and its parameters are fitted to pictures
(`fit`). Every number has its standard error. `part` and `merge` cut a run into parts for many
machines. Names are Mitsuba 3's where both have the thing.

`importon.torch` and `importon.jax` put pictures and losses into those frameworks,
`importon.bend` traces rays in graded indices, `importon.elements` solves by finite elements.

Examples
--------
>>> import importon as im
>>> scene = im.load_dict(im.cornell_box(res=8))
>>> picture = im.render(scene, spp=4)
>>> picture.shape
(8, 8, 3)
"""
from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from ._c import VERSION as __version__
from ._check import Check, CheckRow, Comparison, SelfTestRow, check, compare, selftest
from ._context import set_threads, threads
from ._daylight import Weather, Year, annual, weather
from ._design import Design, Want, design
from ._dictionary import cornell_box, load_dict
from ._errors import (ArgumentError, BiasError, Cancelled, Error, FileError, ImportonWarning, NumericError, Part,
                      OutOfMemoryError, ParameterError, PathsError, SceneError, UnsupportedError)
from ._fit import Fit, FitVariable, fit
from ._gradient import Estimate, Loss, functional, loss, render_backward, render_forward
from ._jacobian import Jacobian, jacobian
from ._library import explained, library_path
from ._load import load_file, load_string, set_variant, variant
from ._measure import MeasuredPhoto, Measurement, MeasureStage, measure
from ._missing import Missing, missing
from ._params import ParameterInfo, SceneParameters, traverse
from ._parts import PartsInfo, join_parts, merge, part, parts_info, team
from ._picture import DroppedWalk, Picture, project, read, reduce, write
from ._plan import Plan, PlanRow, lamps, plan, plan_improve, plan_map
from ._progress import set_progress
from ._render import denoise, render, walk
from ._report import report
from ._rooms import GlareTable, Grid, Interval, Luminaire, Share, daylight_glare, glare, glare_table, grid, luminaires, shares
from ._run import Progress
from ._scene import Scene, Sensor
from ._transform import ScalarTransform4f, Transform4f
from ._until import Reached, functional_until, render_until
from ._values import Gradient, Values
from ._walks import Walks, keep, read_walks

if TYPE_CHECKING:
    from . import ad, bend, elements
    from .elements import guide

__all__ = [
    "ArgumentError", "BiasError", "Cancelled", "Check", "CheckRow", "Color3f", "Comparison", "Design", "DroppedWalk", "Error",
    "Estimate", "FileError", "Fit", "FitVariable", "GlareTable", "Gradient", "Grid", "ImportonWarning", "Interval", "Jacobian", "Loss",
    "Luminaire", "MeasureStage", "MeasuredPhoto", "Measurement", "Missing",
    "NumericError", "OutOfMemoryError", "ParameterError", "ParameterInfo", "Part", "PartsInfo", "PathsError",
    "Picture", "Plan", "PlanRow", "Progress", "Reached", "ScalarTransform4f", "Scene", "SceneError", "SceneParameters", "SelfTestRow", "Sensor", "Share",
    "Transform4f", "UnsupportedError", "Values", "Walks", "Want", "Weather", "Year", "__version__", "ad", "annual", "bend", "check", "compare", "cornell_box", "daylight_glare", "denoise", "design",
    "elements", "fit", "functional", "functional_until", "glare", "glare_table", "grid", "guide", "jacobian", "join_parts", "keep", "lamps", "library_path", "load_dict", "load_file",
    "load_string", "loss", "luminaires", "measure", "merge", "missing", "part", "parts_info", "plan", "plan_improve", "plan_map", "project", "read", "read_walks", "reduce", "render", "render_backward",
    "render_forward", "render_until", "report", "selftest", "set_progress", "set_threads", "set_variant", "shares", "team", "threads",
    "traverse", "variant", "walk", "weather", "write",
]

for _name in __all__:  # errors and objects are known by the name that users import
    _object = globals().get(_name)
    if getattr(_object, "__module__", "").startswith("importon."):
        _object.__module__ = "importon"
        if type(_object) is type(explained):
            globals()[_name] = explained(_object)
del _name, _object


def Color3f(*values: Any) -> Any:
    """Three numbers, as Mitsuba's type of this name.

    Parameters
    ----------
    *values : float or array
        Three numbers, one for all, or an array of them.

    Returns
    -------
    ndarray
        [3]

    Examples
    --------
    >>> importon.Color3f(0.01, 0.2, 0.9)
    array([0.01, 0.2 , 0.9 ])
    """
    import numpy as np
    v = np.asarray(values[0] if len(values) == 1 else values, dtype=np.float64)
    return np.array(np.broadcast_to(v, (3,)))


# Names that Mitsuba has, and what does the same here.
_ELSEWHERE = {
    "Bitmap": "importon.read and importon.write read and write pictures",
    "load_integrator": "the scene's own integrator is used",
    "util": "importon.write writes pictures",
    "xml": "load_dict takes a dictionary, load_string a text",
    "TensorXf": "arrays are NumPy's", "Float": "numbers are Python's",
    "Properties": "load_dict takes a dictionary",
    "integrator": "render, render_forward and render_backward take a scene",
}


def __getattr__(name: str) -> Any:
    if name in ("ad", "bend", "elements", "jax", "torch"):
        return importlib.import_module("." + name, __name__)
    if name == "guide":
        return importlib.import_module(".elements", __name__).guide
    hint = ": " + _ELSEWHERE[name] if name in _ELSEWHERE else ""
    raise AttributeError("module 'importon' has no attribute '%s'%s" % (name, hint))


def __dir__() -> list[str]:
    return sorted(__all__)
