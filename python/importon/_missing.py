# SPDX-License-Identifier: Apache-2.0
"""Numbers that are not fitted and may be wrong."""
from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any, Optional

from . import _c
from ._check import Row
from ._library import lib, make, rows_of
from ._problem import Problem, run_options
from ._scene import Scene


class Missing(Row):
    """A number that is not active, and what it would bring to fit it too.

    Attributes
    ----------
    name : str
        Its parameter.
    element : int
        Of the parameter's numbers.
    factor : bool
        It is the common factor of all numbers of a texture, volume or list.
    value : float
        Now.
    step, step_se : float
        By which it would move, the active numbers following, and its standard error.
    chi2, chi2_se : float
        Expected drop of chi-square, and its Monte Carlo error.
    chance : float
        Probability, at most, that some number stands out like this where all are right.
    """

    FIELDS = ("element", "factor", "value", "step", "step_se", "chi2", "chi2_se", "chance")
    name: str
    element: int
    factor: bool
    step: float
    step_se: float
    chi2: float
    chi2_se: float
    chance: float

    def __repr__(self) -> str:
        return "%s[%d]: %g -> %g +- %.2g, chi-square -%.4g +- %.2g, chance %.2g" % (
            self.name, self.element, self.value, self.value + self.step, self.step_se, self.chi2, self.chi2_se,
            self.chance)


def missing(scene: Scene, params: Any = None, target: Any = None, *, spp: int = 0, seed: int = 0, sensor: Any = 0,
            loss: str = "l2", epsilon: float = 0, weights: Any = None, clip: Any = None, noise_se: Any = None,
            tikhonov: Optional[Mapping[str, float]] = None, stay: Optional[Mapping[str, float]] = None,
            smooth: Optional[Mapping[str, float]] = None, same: Any = None, factor: Any = None, log: Any = None, hold: Any = None,
            drop_budget: float = 0, points: str = "scene", progress: Any = None) -> list[Missing]:
    """Which number that is not fitted may be wrong? To be asked after a fit, with its
    parameters, targets, priors and ties: the scores of all other numbers, with the active ones following.

    Parameters
    ----------
    scene : Scene
        As the fit has left it.
    params : SceneParameters, names or patterns
        The active parameters: those of the fit.
    target, spp, seed, sensor, loss, epsilon, weights, clip, tikhonov, smooth, drop_budget, points, progress
        As `loss`'s.
    stay : mapping, optional
        As `loss`'s; of numbers that a fit has moved, that is from where they are now.
    noise_se, same, factor, log, hold
        As `fit`'s.

    Returns
    -------
    list of Missing
        About twenty of them, the largest drop of chi-square first.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> target = importon.render(scene, spp=256)
    >>> importon.traverse(scene)["light.emitter.radiance.value"] = 20, 9, 2
    >>> rows = importon.missing(scene, "white.*", target, spp=64)
    >>> 0 <= rows[0].chance <= 1
    True
    """
    with Problem(scene, params, same, factor, log, hold) as p:
        options = run_options(p.scene, sensor=sensor, seed=seed, spp=spp, drop_budget=drop_budget, points=points)
        p.add_targets(target, clip, sensor=sensor, weights=weights, loss=loss, epsilon=epsilon, noise_se=noise_se)
        p.add_regularisers(tikhonov, stay, smooth)
        if clip is not None:
            p.run(options, None, lib.imp_problem_censor, p.pointer, ctypes.byref(options))
        rows, n = ctypes.c_void_p(), ctypes.c_size_t()
        p.run(options, progress, lib.imp_problem_missing, p.pointer, ctypes.byref(options), ctypes.byref(rows),
              ctypes.byref(n))
        found = rows_of(_c.imp_missing, rows.value, n.value)
        out = []
        for row in found:
            info = make(_c.imp_param_info)
            p.check(lib.imp_scene_get_param(p.scene.pointer, row.param, ctypes.byref(info)))
            one = Missing(row)
            one.name = info.name.decode(errors="replace")
            out.append(one)
        return out
