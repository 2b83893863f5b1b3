# SPDX-License-Identifier: Apache-2.0
"""Checks of gradients, of sampling and of kinds; comparisons of pictures."""
from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from typing import Any, Optional

from . import _c
from ._context import context, failure
from ._library import choice, integer, lib, make, rows_of
from ._picture import read, to_film
from ._problem import Problem, check_scene, run_options
from ._run import not_inside, run
from ._scene import Scene


class Row:
    """A line of a check: two numbers that must agree, and whether they do."""

    FIELDS: tuple[str, ...] = ()
    value: float
    reference: float
    se: float
    error: float
    limit: float
    ok: int

    def __init__(self, row: Any) -> None:
        for name in self.FIELDS:
            value = getattr(row, name)
            setattr(self, name, value.decode(errors="replace") if isinstance(value, bytes) else value)


class CheckRow(Row):
    """One line of `check`: a method, a parameter, two numbers that must agree.

    Attributes
    ----------
    method, param : str
        How, and of what.
    step : float
        Of a difference; 0: none.
    value, reference, se : float
        se of their difference; 0: deterministic.
    error, limit : float
        Relative; where se > 0, |z|. Limit 0: a row for information.
    ok : int
        1: they agree; 0: they do not; -1: too noisy to tell.
    kinks : int
        Frozen walks that stand on a kink, and agree with one of its sides.
    sees : float
        Of a row that compares draws with a density: the smallest relative error of the density
        that it would have found; 0: of other rows.
    why : str or None
        Why a row without a reference decides nothing, as where a shape has no room to move.
    verdict : str
        "ok", "FAIL", "noisy" or "open".
    """

    FIELDS = ("method", "param", "step", "value", "reference", "se", "error", "limit", "ok", "kinks", "sees", "why")
    method: str
    param: str
    step: float
    kinks: int
    sees: float
    why: Optional[str]

    @property
    def verdict(self) -> str:
        """"ok", "FAIL", "noisy" or "open"."""
        return {1: "ok", 0: "FAIL"}.get(self.ok, "open" if self.why else "noisy")

    def __repr__(self) -> str:
        return "%-9s %-32s %12.6g %12.6g +- %-9.2g error %-9.2g %s" % (
            self.method, self.param, self.value, self.reference, self.se, self.error, self.verdict)


class SelfTestRow(Row):
    """One line of `selftest`: a contract of an object of the scene.

    Attributes
    ----------
    object, kind, contract : str
        The object's name, its type, and "finite", "covers", "normalised", "draws", "albedo",
        "energy", "reciprocal", "derivative", "density", "light", "unit", "smooth", "filter",
        "part" or "bounded"; of shapes "hits", "normal", "uv", "sides", "box", "met", "moves",
        "area", "drawn", "points", "towards", "density" or "angle".
    value, reference, se : float
        se of their difference; 0: none.
    answers : float
        Of a count: how many were looked at.
    error, limit : float
        A count of failures, a relative error, or |z|.
    chance : float
        Of a value so far off, if all is right; -1: not statistical.
    ok : int
        1: it holds; 0: it does not; -1: not promised, and not so, or too few draws to tell.
    sees : float
        Of a row that draws: the relative error that it would have found with a probability of
        0.95; 0: of other rows. Above 0.02 the row does not decide, unless it fails.
    verdict : str
        "ok", "FAILED", "too few draws" or "no, not promised".
    """

    FIELDS = ("object", "kind", "contract", "value", "reference", "se", "answers", "error", "limit", "chance", "ok", "sees")
    object: str
    kind: str
    contract: str
    answers: float
    chance: float
    sees: float

    @property
    def verdict(self) -> str:
        """"ok", "FAILED", "too few draws" or "no, not promised"."""
        return {1: "ok", 0: "FAILED"}.get(self.ok, "too few draws" if self.sees > 0 else "no, not promised")

    def __repr__(self) -> str:
        return "%-24s %-16s %-10s %12.6g %12.6g error %-9.2g %s" % (
            self.object, self.kind, self.contract, self.value, self.reference, self.error, self.verdict)


class Check(Sequence):  # type: ignore[type-arg]
    """The rows of a check or a self-test; true if none of them failed.

    Attributes
    ----------
    ok : bool
    failed : list of rows
    """

    def __init__(self, rows: Sequence[Any]) -> None:
        self.rows = list(rows)

    def __getitem__(self, i: Any) -> Any:
        return self.rows[i]

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Any]:
        return iter(self.rows)

    @property
    def ok(self) -> bool:
        """No row failed."""
        return not self.failed

    @property
    def failed(self) -> list[Any]:
        """The rows that failed."""
        return [r for r in self.rows if r.ok == 0]

    def __bool__(self) -> bool:
        return self.ok

    def __repr__(self) -> str:
        return "\n".join(map(repr, self.rows))

    def _repr_html_(self) -> str:
        from ._html import check
        return check(self)


def check_rows(address: Optional[int], n: int, struct: Any = _c.imp_check_row, row: Any = CheckRow) -> Check:
    return Check([row(r) for r in rows_of(struct, address, n)])


def check(scene: Scene, params: Any = None, target: Any = None, *, spp: int = 0, seed: int = 0, sensor: Any = 0,
          loss: str = "l2", epsilon: float = 0, paths: int = 0, fresh_spp: int = 0, sampling: bool = False,
          only: Any = None, draws_time: float = 0, drop_budget: float = 0, wavelengths: str = "stratified", wavelength_set: int = 0, points: str = "scene", walks_from: str = "scene",
          progress: Any = None) -> Check:
    """Check gradients: each walk against differences with its decisions frozen, pictures
    against differences with fresh random numbers, forward against reverse, densities
    against the directions drawn, losses against direct computation.

    Parameters
    ----------
    scene : Scene
    params : SceneParameters, names or patterns
        The active parameters; None: all that have a gradient.
    target : optional
        As `loss`'s; checks its gradient too.
    spp, seed, sensor, loss, epsilon, drop_budget, wavelengths, wavelength_set, points, walks_from, progress
        As `loss`'s.
    paths : int
        Frozen walks looked at; 0: 1000.
    fresh_spp : int
        Samples per pixel of fresh differences; 0: `spp`.
    sampling : bool
        Check sampling in place of gradients: the picture against one whose directions are
        drawn uniformly and whose lights are met by chance, in blocks of 8 x 8 pixels
        ("uniform"); the part of the light that each density brought ("energy"); the part of
        the directions towards a proxy in which anything lies ("aim").
    only : str or list of str, optional
        Methods of the rows that are wanted, as "frozen" or ["fresh", "directions"]; None: all.
    draws_time : float
        Seconds that all rows together may take that compare draws with densities; 0: 20.

    Returns
    -------
    Check
        Rows; false if one of them failed.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> bool(importon.check(scene, "red.*", spp=64, paths=50))
    True
    """
    with Problem(scene, params) as p:
        options = run_options(p.scene, sensor=sensor, seed=seed, spp=spp, drop_budget=drop_budget,
                              wavelengths=wavelengths, wavelength_set=wavelength_set, points=points, walks_from=walks_from)
        if target is not None:
            p.add_targets(target, sensor=sensor, loss=loss, epsilon=epsilon)
        wanted = make(_c.imp_check_options, paths=integer(paths, "paths"), fresh_spp=integer(fresh_spp, "fresh_spp"),
                      sampling=bool(sampling), draws_s=float(draws_time))
        if only is not None:
            wanted.only = (only if isinstance(only, str) else ",".join(only)).encode()
        rows, n = ctypes.c_void_p(), ctypes.c_size_t()
        p.run(options, progress, lib.imp_check, p.pointer, ctypes.byref(wanted), ctypes.byref(options),
              ctypes.byref(rows), ctypes.byref(n))
        return check_rows(rows.value, n.value)


def selftest(scene: Scene, subject: str = "material", *, samples: int = 0, directions: int = 0,
             seed: int = 0, progress: Any = None) -> Check:
    """Test the contracts of kinds on the scene's own objects: densities against draws,
    albedos against quadrature, derivatives against differences, ...

    Parameters
    ----------
    scene : Scene
    subject : str
        "material", "light", "camera", "phase", "medium" or "shape".
    samples : int
        Draws of an object; 0: 200,000, and up to 16 times as many until rows that draw would
        see an error of 2 %.
    directions : int
        Directions of sight, or places, of an object; 0: 12.
    seed : int
    progress : bool or callable, optional
        As `render`'s.

    Returns
    -------
    Check
        Rows are `SelfTestRow`; false if one of them failed.

    Raises
    ------
    ArgumentError
        An unknown subject, or too few samples.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> rows = importon.selftest(scene, "light", samples=20000, directions=2)
    >>> bool(rows), rows[0].object, rows[0].kind, rows[0].contract
    (True, 'light.emitter', 'area', 'finite')
    """
    scene = check_scene(scene)
    not_inside()
    options = make(_c.imp_selftest_options, samples=integer(samples, "samples"),
                   directions=integer(directions, "directions"), seed=integer(seed, "seed", 0, 2**64 - 1))
    with scene.lock:
        rows, n = ctypes.c_void_p(), ctypes.c_size_t()
        status, message = run(scene._context, options, progress, lib.imp_selftest, scene.pointer,
                              choice("imp_selftest_subject", subject, "subject"), ctypes.byref(options),
                              ctypes.byref(rows), ctypes.byref(n))
        if status:
            raise failure(status, message)
        return check_rows(rows.value, n.value, _c.imp_selftest_row, SelfTestRow)


class Comparison:
    """Whether two pictures show the same, within their noise: what `compare` returns.

    Attributes
    ----------
    rmse, relative_rmse, max_abs : float
        Of all channels; relative to the reference.
    mean_a, mean_b : float
        Of test and reference.
    p_fail_fraction : float
        Part of the pixels whose z-test fails at 1 % over the whole picture.
    mean_z, over2 : float
        |z| of the mean, worst channel; part of the pixels with |z| > 2 (0.0455 expected).
    has_z, agree : bool
    """

    rmse: float
    relative_rmse: float
    max_abs: float
    mean_a: float
    mean_b: float
    p_fail_fraction: float
    mean_z: float
    over2: float
    has_z: bool
    agree: bool

    def __init__(self, result: Any) -> None:
        for name, _ in result._fields_[1:]:
            value = getattr(result, name)
            setattr(self, name, bool(value) if name in ("has_z", "agree") else value)

    def __bool__(self) -> bool:
        return self.agree

    def __repr__(self) -> str:
        z = ", mean z %.2f, |z| > 2 at %.2g %%" % (self.mean_z, 100 * self.over2) if self.has_z else ""
        return "%s: rmse %.4g (relative %.4g), means %.6g and %.6g%s" % (
            "agree" if self.agree else "differ", self.rmse, self.relative_rmse, self.mean_a, self.mean_b, z)


def compare(test: Any, reference: Any, *, variance: Any = None, n_test: float = 0, n_reference: float = 0,
            floor: float = 0, xyz: bool = False) -> Comparison:
    """Do two pictures of one size show the same, within their noise?

    Parameters
    ----------
    test, reference : Picture, array or path
        With standard errors on either side, pixels are compared by z-tests.
    variance : Picture, array or path, optional
        Per sample, of `reference`.
    n_test, n_reference : float
        Samples per pixel; 0: unknown, or exact.
    floor : float
        Of the variance; 0: 1e-4 of the squared mean of the channel.
    xyz : bool
        Compare X, Y, Z, made from R, G, B.

    Returns
    -------
    Comparison
        True where they agree.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> a, b = (importon.render(scene, spp=64, seed=s) for s in (1, 2))
    >>> bool(importon.compare(a, b))
    True
    """
    def load(p: Any) -> Any:
        return read(p) if isinstance(p, (str, bytes)) or hasattr(p, "__fspath__") else p

    ctx = context()
    films = [None if p is None else to_film(load(p), ctx, n)
             for p, n in ((test, "test"), (reference, "reference"), (variance, "variance"))]
    assert films[0] and films[1]
    options = make(_c.imp_compare_options, variance=films[2].pointer if films[2] else None, n_test=float(n_test),
                   n_reference=float(n_reference), floor=float(floor), xyz=bool(xyz))
    result = make(_c.imp_compare_result)
    ctx.check(lib.imp_compare(ctx.pointer, films[0].pointer, films[1].pointer, ctypes.byref(options),
                              ctypes.byref(result)))
    return Comparison(result)
