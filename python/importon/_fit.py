# SPDX-License-Identifier: Apache-2.0
"""Fits: parameters back from pictures."""
from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any, NamedTuple, Optional

import numpy as np

from . import _c
from ._array import copy_doubles
from ._context import failure
from ._library import choice, decode, integer, lib, make, memory_bytes, rows_of, text
from ._picture import read
from ._problem import Problem, run_options, target_list
from ._run import run
from ._scene import Scene
from ._values import Values


class FitVariable(NamedTuple):
    """A fitted parameter; every field has the parameter's shape.

    `se` is one standard error, of measurement and Monte Carlo together; `interval` is the
    95 % interval, NaN where neither the picture nor a prior determines the number; `at_bound` is -1
    at the lower bound, 1 at the upper."""

    value: Any
    se: Any
    interval: tuple[Any, Any]
    start: Any
    at_bound: Any
    determined: Any


class Fit(Values):
    """A fit's answer: name -> `FitVariable`.

    Attributes
    ----------
    iterations : int
    loss, loss_se : float
        At the answer.
    history, history_se : ndarray
        Loss of each iteration.
    history_x : ndarray or None
        [iterations][n], the numbers at which these were computed; of up to 64 numbers.
    covariance : ndarray or None
        [n][n] of all numbers (`names` lists them), measurement and Monte Carlo together,
        in the directions that the pictures determine and no bound holds.
    condition : float
        Of the scaled J^T J; 0: not computed.
    chi2, chi2_se : float
        Per degree of freedom; NaN where the targets' noise is not known.
    residual, residual_hi : float
        Of the targets, our own noise taken off; and two standard errors higher.
    shift : float
        How far four times the samples would move an answer, in standard errors, where the
        loss leaves a bias; else NaN.
    own_part : float
        Chi-square that our own noise in the answer adds, over what the targets' noise takes from it, in their
        number of values; NaN without intervals.
    reason, warning : str
    clipped : dict or None
        With `clip`: how many "numbers" there are, how many are "clipped", how many have no
        weight ("silent"), and in how many the scene disagrees ("against").
    walks : str
        Which evaluations of lbfgs, mma and slsqp were of recorded walks, or why none were.
    control_variate : str
        Of adam: what it brought, or why there was none.
    """

    def __init__(self, scene: Scene, values: dict[str, Any], result: Any, names: list[str], infos: Mapping[str, Any],
                 targets: list[Any], optimizer: str, loss: str) -> None:
        super().__init__(scene, values)
        self._infos, self._targets, self._optimizer, self._loss_word = infos, targets, optimizer, loss
        self.iterations: int = result.iterations
        self.clipped: Optional[dict[str, int]] = None
        self.loss: float = result.objective.value
        self.loss_se: float = result.objective.se
        self.bias_order: int = result.objective.bias_order
        self.history = copy_doubles(result.history, (result.n_history,))
        self.history_se = copy_doubles(result.history_se, (result.n_history,))
        self.history_x = copy_doubles(result.history_x, (result.n_history, result.n))
        self.covariance = copy_doubles(result.covariance, (result.n, result.n))
        self.names = names
        self.condition: float = result.condition
        self.chi2: float = result.chi2
        self.chi2_se: float = result.chi2_se
        self.residual: float = result.residual
        self.residual_hi: float = result.residual_hi
        self.shift: float = result.shift
        self.own_part: float = result.own_part
        self.reason: str = decode(result.reason)
        self.warning: str = decode(result.warning)
        self.walks: str = decode(result.walks)
        self.control_variate: str = decode(result.control_variate)

    def report(self, path: Any, *, title: Optional[str] = None, command: Optional[str] = None, spp: int = 0) -> None:
        """Write the fit as one HTML page that opens anywhere: the target beside the picture that was
        recovered, whether it is explained, numbers with their intervals, correlations, losses.

        Parameters
        ----------
        path : str or PathLike
        title, command : str, optional
            What stands above; how the fit was made, to be copied.
        spp : int
            Samples per pixel of the recovered pictures, rendered now, with the scene as it is; 0: the
            scene's.

        Raises
        ------
        FileError
            The file cannot be written.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> target = importon.render(scene, spp=64, seed=1)
        >>> fit = importon.fit(scene, target, "red.*", optimizer="lm", spp=16)
        >>> fit.report("fit.html", spp=16)
        >>> "red.reflectance.value[0]" in open("fit.html").read()
        True
        """
        from ._render import render
        from ._report import report
        items: list[Any] = []
        for view, (sensor, target) in enumerate(self._targets):
            if isinstance(target, (str, bytes)) or hasattr(target, "__fspath__"):
                target = read(target)
            items.append({"picture": target, "name": "target", "role": "target", "view": view})
            items.append({"picture": render(self._scene, sensor=sensor, spp=spp), "name": "recovered", "role": "picture",
                          "view": view})
        rows: list[dict[str, Any]] = []
        for name, v in self.items():
            info, flat = self._infos.get(name), [np.atleast_1d(x).ravel() for x in (
                v.start, v.value, v.se, *v.interval, v.at_bound, v.determined)]
            about = {"unit": info.unit, "min": info.lo, "max": info.hi} if info else {"unit": "1"}
            if flat[0].size > 12:
                half = (np.asarray(v.interval[1], float) - np.asarray(v.interval[0], float)) / 2
                rows.append({"name": name, "count": flat[0].size, "file": "the layer " + name,
                             "n_intervals": int(np.count_nonzero(np.isfinite(half))), **about})
                field = np.asarray(v.value, float)
                if field.ndim in (2, 3) and field.shape[-1] in (1, 3) or field.ndim == 2:
                    items.append({"picture": field, "name": name, "view": len(self._targets)})
                    if np.isfinite(half).any():
                        items.append({"picture": half, "name": name + ".interval", "view": len(self._targets)})
                continue
            label = info.name if info else name
            for k, (start, value, se, lo, hi, at_bound, determined) in enumerate(zip(*flat)):
                rows.append({"name": "%s[%d]" % (label, k) if flat[0].size > 1 else label, **about, "start": start, "value": value,
                             "se": se, "lo95": lo, "hi95": hi, "at_bound": int(at_bound), "determined": bool(determined)})
        history: dict[str, Any] = {"loss": self.history, "se": self.history_se}
        if self.history_x is not None:
            history.update(names=self.names, x=self.history_x)
        answer = {"optimizer": self._optimizer, "loss": self._loss_word, "iterations": self.iterations, "value": self.loss,
                  "se": self.loss_se, "residual": self.residual, "residual_hi": self.residual_hi, "chi2_per_freedom": self.chi2,
                  "chi2_se": self.chi2_se, "shift": self.shift, "condition": self.condition, "reason": self.reason,
                  "warning": self.warning or None, "params": rows, "history": history}
        if self.covariance is not None and len(self.covariance) <= 64:
            answer["covariance"] = self.covariance
        items.append({"kind": "fit", "json": _plain(answer)})
        report(path, items, title=title, command=command)

    def __repr__(self) -> str:
        lines = ["%d iterations, loss %.4g +- %.2g: %s" % (self.iterations, self.loss, self.loss_se, self.reason)]
        for name, v in self.items():
            flat = [np.atleast_1d(x).ravel() for x in (v.value, v.se, *v.interval)]
            if flat[0].size > 12:
                lines.append("%-32s %d numbers in %.4g .. %.4g" % (name, flat[0].size, flat[0].min(), flat[0].max()))
                continue
            for k, (x, se, lo, hi) in enumerate(zip(*flat)):
                label = "%s[%d]" % (name, k) if flat[0].size > 1 else name
                lines.append("%-32s %10.6g +- %-9.2g [%.6g, %.6g]" % (label, x, se, lo, hi))
        if self.warning:
            lines.append("warning: " + self.warning)
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        from ._html import fit
        return fit(self)


def _plain(value: Any) -> Any:
    """As JSON has it: NaN and infinities become null."""
    if isinstance(value, Mapping):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(v) for v in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value


def variables(result: Any, blocks: Any, start: Any, value: Any) -> dict[str, FitVariable]:
    """imp_fit_variables [n] by parameter. Of more than 1024 there are no rows, and no
    errors either."""
    if result.variables:
        rows = rows_of(_c.imp_fit_variable, result.variables, result.n)
        column = {f: np.array([getattr(r, f) for r in rows]) for f in (q[0] for q in _c.imp_fit_variable._fields_)}
    else:
        lo, hi = (np.concatenate([np.full(i.size, b) for i, b in pairs]) for pairs in (
            [(i, i.lo) for i, _ in blocks], [(i, i.hi) for i, _ in blocks]))
        unknown = np.full(len(value), np.nan)
        column = {"start": start, "value": value, "se": unknown, "lo95": unknown, "hi95": unknown,
                  "at_bound": (value >= hi).astype(int) - (value <= lo), "determined": np.ones(len(value))}
    made = {}
    for info, at in blocks:
        part = {f: c[at].reshape(info.shape)[()] for f, c in column.items()}
        made[info.name] = FitVariable(part["value"], part["se"], (part["lo95"], part["hi95"]), part["start"],
                                      part["at_bound"], part["determined"] != 0)
    return made


def fit(scene: Scene, target: Any, params: Any = None, *, optimizer: str = "adam", max_iterations: int = 0,
        learning_rate: float = 0, tolerance: float = 0, intervals: bool = True, checkpoint: Any = None,
        resume: bool = False, spp: int = 0, seed: int = 0, sensor: Any = 0, loss: str = "l2", epsilon: float = 0,
        weights: Any = None, clip: Any = None, noise_se: Any = None, tikhonov: Optional[Mapping[str, float]] = None,
        stay: Optional[Mapping[str, float]] = None, smooth: Optional[Mapping[str, float]] = None,
        same: Any = None, factor: Any = None, log: Any = None, hold: Any = None, time_limit: float = 0, drop_budget: float = 0, guide: Any = None, wavelengths: str = "stratified",
        wavelength_set: int = 0, points: str = "scene", walks_from: str = "scene", levels: int = 0, memory: float = 0,
         headroom: float = 0, control_variate: str = "auto", allocation: str = "default", momentum: float = 0,
         mesh_lambda: Optional[float] = None, progress: Any = None) -> Fit:
    """Fit parameters to target pictures; the scene ends at the best estimate.

    Parameters
    ----------
    scene : Scene
    target : array, Picture, path; list, or dictionary by sensor
        As `loss`'s. The standard errors of a `Picture` are its noise.
    params : SceneParameters, names or patterns
        The active parameters; None: all that have a gradient.
    optimizer : str
        "adam", "lm" (at most 262144 numbers), "lbfgs", "mma" or "slsqp".
    max_iterations : int
        0: 200 (adam), 30 (others).
    learning_rate : float
        Of adam, as a part of each variable's scale; 0: 0.05. With control variates and more than 64
        numbers, that of numbers between two bounds falls as (1 + i/10)^-1/2 with iterations i.
    momentum : float
        Of adam: the part of the mean gradient that stays from iteration to iteration, its beta1;
        0: 0.9, and 0.5 for numbers between two bounds in fits of more than 64 numbers with control
        variates.
    tolerance : float
        Stop when relative steps stay below; 0: 1e-4.
    levels : int
        Of adam: fit textures and volumes from coarse to fine, first with one number for
        2^(levels - 1) cells along each axis; 0: as they are.
    allocation : str
        Of adam's samples to tiles of 8 x 8 pixels: "variance" gives them where the gradient's
        variance comes from, at the same cost; "even": all pixels have the same; "default":
        "variance" where that can be, but for control variates of more than 64 numbers.
    memory : float
        Bytes for the walks that lbfgs, mma and slsqp keep, since they evaluate one draw;
        0: 2^30; negative: walks are traced each time. `Fit.walks` says what was kept.
    headroom : float
        By which factor extinctions of grids may grow while such walks are kept, also from 0;
        0 or 1: none, and walks are traced where these are fitted.
    control_variate : str
        Of adam, "auto", "on" or "off": walks are evaluated at the last iteration's numbers, too, which
        makes gradients less noisy; "auto" for more than 64 numbers, where that is possible. `Fit.control_variate` says what it brought.
    mesh_lambda : float, optional
        Of adam: `vertex_positions` of meshes move in smooth steps, those of (1 + mesh_lambda L) x with L the
        uniform Laplacian of the mesh ("large steps"), and vertices at one place together; 0: each vertex
        for itself; default: a 64th of the number of vertices.
    intervals : bool
        Estimate covariance and 95 % intervals at the end.
    checkpoint : path, optional
        Rewritten every few seconds.
    resume : bool
        Continue from the checkpoint, if it is there.
    spp, seed, sensor, loss, epsilon, weights, clip, tikhonov, stay, smooth, drop_budget, guide, wavelengths, wavelength_set, points, walks_from
        As `loss`'s; `spp` is that of each iteration.
    noise_se : array, optional
        [height][width][channels]: one standard error of the target's noise; default: that
        of the target, else estimated from what is left over.
    same : pattern, or list of them, optional
        Parameters that are equal numbers, from the first's: "left.*,right.*".
    factor : pattern, or list of them, optional
        Parameters that keep their ratios: one factor multiplies them, `fit["factor(lamp.*)"]`.
    log : pattern, or list of them, optional
        Parameters that move as logarithms, and stay positive. Values are in their own unit.
    hold : pattern, with indices or without, or list of them, optional
        Numbers that stay as they are: "block.pose[2-4]", of a block that stands on a floor.
    time_limit : float
        In seconds; 0: none.
    progress : bool or callable, optional
        See `set_progress`.

    Returns
    -------
    Fit

    Raises
    ------
    Cancelled
        By the callback; `result` is the state reached, which the scene has.
    ArgumentError
        Nothing is active, an option is out of its range, or the checkpoint is another fit's.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=16))
    >>> target = importon.render(scene, spp=256, seed=1)
    >>> params = importon.traverse(scene)
    >>> params.keep("red.*")
    >>> truth = params["red.reflectance"]
    >>> params["red.reflectance"] = 0.5
    >>> fit = importon.fit(scene, target, params, optimizer="lm", spp=64)
    >>> bool(np.all(abs(fit["red.reflectance"].value - truth) < 5 * fit["red.reflectance"].se))
    True
    """
    with Problem(scene, params, same, factor, log, hold) as p:
        options = run_options(p.scene, seed=seed, spp=spp, time_limit=time_limit, drop_budget=drop_budget, guide=guide,
                              wavelengths=wavelengths, wavelength_set=wavelength_set, points=points, walks_from=walks_from)
        p.add_targets(target, clip, sensor=sensor, weights=weights, loss=loss, epsilon=epsilon, noise_se=noise_se)
        p.add_regularisers(tikhonov, stay, smooth)
        path = text(checkpoint, "checkpoint") if checkpoint is not None else None
        wanted = make(_c.imp_fit_options, optimizer=choice("imp_optimizer", optimizer, "optimizer"),
                      max_iterations=integer(max_iterations, "max_iterations"), learning_rate=float(learning_rate),
                      tolerance=float(tolerance), intervals=bool(intervals), checkpoint=path, resume=bool(resume),
                      levels=integer(levels, "levels"), memory=memory_bytes(max(memory, 0)), no_recording=memory < 0,
                      headroom=float(headroom), control_variate=choice("imp_variates", control_variate, "control_variate"),
                      allocation=choice("imp_allocation", allocation, "allocation"), momentum=float(momentum),
                      mesh_lambda=0 if mesh_lambda is None else float(mesh_lambda) or -1)
        out, start = ctypes.c_void_p(), p.x()
        status, message = run(p.context, options, progress, lib.imp_fit, p.pointer, ctypes.byref(wanted),
                              ctypes.byref(options), ctypes.byref(out))
        answer = None
        if out.value and status in (_c.IMP_OK, _c.IMP_CANCELLED):
            result = _c.imp_fit_result.from_address(out.value)
            names = [info.name + ("[%d]" % k if info.size > 1 else "") for info, _ in p.blocks
                     for k in range(info.size)] if p.n <= 1024 else []
            answer = Fit(p.scene, variables(result, p.blocks, p.natural(start), p.natural(p.x())), result, names,
                         {info.name: info for info, _ in p.blocks}, target_list(p.scene, target, sensor), optimizer, loss)
            answer.clipped = p.clipped()
        if status == _c.IMP_CANCELLED and answer and answer.reason == "time limit reached":
            return answer
        if status:
            raise failure(status, message, answer)
        assert answer is not None
        return answer
