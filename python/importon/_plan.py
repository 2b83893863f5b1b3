# SPDX-License-Identifier: Apache-2.0
"""Which picture next: candidates by the intervals that they would leave."""
from __future__ import annotations

import ctypes
import fnmatch
from collections.abc import Mapping
from typing import Any, Optional

import numpy as np

from . import _c
from ._array import address, numbers
from ._errors import ArgumentError
from ._library import choice, decode, integer, lib, make, rows_of, text
from ._picture import Picture, from_film
from ._problem import Problem, check_scene, run_options
from ._scene import Scene

_Z95 = 1.959963984540054
_KEYS = {"sensor", "name", "origin", "target", "up", "lamps", "time", "cost"}


class PlanRow:
    """A candidate, and what it would bring.

    Attributes
    ----------
    candidate : int
        Index in the list of candidates.
    name : str
    gain, gain_se : float
        Mean logarithm of the variances of the wanted numbers before over those after, and its Monte Carlo error.
    worth, worth_se : float
        Gain over cost, by which rows are ordered.
    intervals : float
        The factor exp(-gain/2) by which intervals shrink.
    group : int
        Candidates of one group cannot be told apart from its first one.
    lit : float
        Fraction of its values that count: neither 0 nor saturated.
    half95 : numpy.ndarray
        [n] half-widths of the 95 % intervals with it; infinite: not determined.
    information, information_se, pull : numpy.ndarray
        [n][n] J^T W J, its standard errors, and the derivative of the gain with respect to it.
    """

    def __init__(self, row: Any, name: str, n: int) -> None:
        self.candidate, self.name = int(row.candidate), name
        self.gain, self.gain_se = row.gain.value, row.gain.se
        self.worth, self.worth_se = row.worth.value, row.worth.se
        self.intervals = float(np.exp(-0.5 * row.gain.value))
        self.group, self.lit = int(row.group), row.lit
        self.half95 = _Z95 * _copy(row.se, n)
        self.information, self.information_se, self.pull = (
            _copy(getattr(row, key), n * n).reshape(n, n) for key in ("information", "information_se", "pull"))

    def __repr__(self) -> str:
        return "%s: gain %.4g +- %.2g, intervals x %.3g" % (self.name, self.gain, self.gain_se, self.intervals)


class Plan:
    """A ranking of candidates, and a set of them.

    Attributes
    ----------
    names : list of str
        The numbers, in the order of all arrays.
    rows : list of PlanRow
        The best first.
    half95_today : numpy.ndarray
        [n] half-widths of the 95 % intervals without new pictures; infinite: not determined.
    chosen : list of int
        Indices of the candidates that go well together.
    chosen_gain, chosen_gain_se : float
    chosen_half95 : numpy.ndarray
        [n] with all of these.
    prior, span : numpy.ndarray
        [n] standard deviations of the priors, and the numbers' ranges or sizes, in units of x.
    not_determined : numpy.ndarray
        [directions][n] unit vectors, numbers in units of `span`: what all candidates together leave open.
    """

    def __init__(self, result: Any, names: list[str], candidates: list[str]) -> None:
        n = int(result.n)
        self.names = names
        self.rows = [PlanRow(r, candidates[r.candidate], n)
                     for r in rows_of(_c.imp_plan_row, _pointer(result.rows), result.n_rows)]
        self.half95_today = _Z95 * _copy(result.today, n)
        self.chosen = [int(k) for k in _copy(result.chosen, result.n_chosen, ctypes.c_size_t)]
        self.chosen_gain, self.chosen_gain_se = result.chosen_gain.value, result.chosen_gain.se
        self.chosen_half95 = _Z95 * _copy(result.chosen_se, n)
        self.prior, self.span = _copy(result.prior, n), _copy(result.span, n)
        self.not_determined = _copy(result.loose, result.n_loose * n).reshape(result.n_loose, n)

    def best(self) -> list[PlanRow]:
        """Those that cannot be told apart from the first.

        Returns
        -------
        list of PlanRow

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> [row.name for row in importon.plan(scene, "red.*", [{"time": 1, "name": "short"}, {"time": 9, "name": "long"}]).best()]
        ['long']
        """
        return [r for r in self.rows if r.group == 0]

    def __repr__(self) -> str:
        return "\n".join(repr(r) for r in self.rows)


def _pointer(p: Any) -> Optional[int]:
    return p if isinstance(p, int) or p is None else ctypes.cast(p, ctypes.c_void_p).value


def _copy(p: Any, n: int, kind: Any = ctypes.c_double) -> Any:
    at = _pointer(p)
    return np.array((kind * n).from_address(at)) if n and at else np.zeros(0)


def _number_names(p: Problem) -> list[str]:
    return [info.name + ("[%d]" % k if info.size > 1 else "") for info, _ in p.blocks for k in range(info.size)]


def _meant(p: Problem, names: list[str], glob: str, what: str) -> list[int]:
    """Indices of the numbers that a name, a number's name or a pattern means."""
    owner = [info.name for info, _ in p.blocks for _ in range(info.size)]
    found = [i for i, name in enumerate(owner)
             if glob in (name, names[i]) or name == glob + ".value" or fnmatch.fnmatchcase(name, glob)]
    if not found:
        raise ArgumentError("%s: none of the active numbers is called %r" % (what, glob))
    return found


def _one(scene: Scene, candidate: Any, keep: list[Any]) -> Any:
    """imp_plan_candidate."""
    given = dict(candidate) if isinstance(candidate, Mapping) else {"sensor": candidate}
    if set(given) - _KEYS:
        raise ArgumentError("a candidate has no %r; it has %s" % (sorted(set(given) - _KEYS)[0], ", ".join(sorted(_KEYS))))
    c = make(_c.imp_plan_candidate, sensor=scene.sensor_index(given.get("sensor", 0)),
             time=float(given.get("time", 0)), cost=float(given.get("cost", 0)))
    if "origin" in given or "target" in given:
        c.placed = True
        for key in ("origin", "target", "up"):
            place = numbers(given.get(key, (0, 0, 0)), key)
            if place.shape != (3,):
                raise ArgumentError("%s of a candidate has shape %s, not (3,)" % (key, place.shape))
            getattr(c, key)[:] = place.tolist()
    for key in ("name", "lamps"):
        if given.get(key) is not None:
            value = given[key] if isinstance(given[key], str) else ",".join(given[key])
            keep.append(text(value, key))
            setattr(c, key, keep[-1])
    return c


def _options(p: Problem, names: list[str], keep: list[Any], of: Any, prior: Any, noise: Any, criterion: str,
             take: int, budget: float) -> Any:
    """imp_plan_options."""
    o = make(_c.imp_plan_options, criterion=choice("imp_plan_criterion", criterion.lower(), "criterion"),
             take=integer(take, "take"), budget=float(budget))
    for key, value in dict(noise or {}).items():
        if key not in ("read", "shot", "relative", "white"):
            raise ArgumentError("noise has no %r; it has read, shot, relative, white" % (key,))
        setattr(o, key, float(value))
    if of is not None:
        wanted = sorted({i for glob in ([of] if isinstance(of, str) else of) for i in _meant(p, names, glob, "of")})
        indices = (ctypes.c_size_t * len(wanted))(*wanted)
        keep.append(indices)
        o.of, o.n_of = ctypes.addressof(indices), len(wanted)
    if prior:
        sigma, unit = np.zeros(p.n), np.ones(p.n)
        x = p.x()
        for (_, at), log in zip(p.blocks, p.logs):
            if log:
                unit[at] = np.exp(x[at])
        for glob, value in dict(prior).items():
            for i in _meant(p, names, glob, "prior"):
                sigma[i] = float(value) / unit[i]
        keep.append(sigma)
        o.prior = address(sigma)
    return o


def lamps(scene: Scene) -> list[str]:
    """Names of the lamps of a scene, as candidates of a plan have them.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    list of str

    Examples
    --------
    >>> importon.lamps(importon.load_dict(importon.cornell_box(res=8)))
    ['light.emitter']
    """
    scene = check_scene(scene)
    found: list[str] = []
    while True:
        name = lib.imp_plan_lamp(scene.pointer, len(found))
        if name is None:
            return found
        found.append(decode(name))


def plan(scene: Scene, params: Any = None, candidates: Any = None, *, have: Any = (), of: Any = None,
         prior: Optional[Mapping[str, float]] = None, noise: Optional[Mapping[str, float]] = None,
         criterion: str = "d", take: int = 0, budget: float = 0, spp: int = 0, seed: int = 0, same: Any = None,
         factor: Any = None, log: Any = None, hold: Any = None, drop_budget: float = 0, points: str = "scene",
         progress: Any = None) -> Plan:
    """Which pictures to take next? Candidates by how much they would shrink the intervals of the active numbers.

    Parameters
    ----------
    scene : Scene
        With its present values as guesses.
    params : SceneParameters, names or patterns
        The active numbers.
    candidates : list, optional
        A sensor (its index or name), or a mapping with the keys `sensor`, `name`, `origin`, `target`, `up` (a
        perspective camera that is placed), `lamps` (names or patterns of those that are on), `time` of exposure
        and `cost`. By default all sensors that `have` does not name.
    have : list
        The same, of pictures that have been taken.
    of : str or list of str, optional
        The wanted numbers: a parameter, one of its numbers "name[k]", or a pattern. By default all.
    prior : mapping, optional
        What is known without pictures: name -> one standard deviation.
    noise : mapping, optional
        `read`, `shot`, `relative`, `white`: a value v has the variance read^2/t^2 + shot v/t + (relative v)^2, and
        values with t v >= white are saturated. By default read is 1 % of each picture's mean.
    criterion : str
        "d": the determinant of the covariance of the wanted numbers; "a": the sum of their variances, in units of
        the priors.
    take : int
        Pictures to choose together; 0: one, or as many as `budget` allows.
    budget : float
        Of the costs of the chosen ones; 0: none, and the gain over the cost counts.
    spp, seed, drop_budget, points, progress
        As `loss`'s.
    same, factor, log, hold
        As `fit`'s.

    Returns
    -------
    Plan

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> p = importon.plan(scene, ["red.*", "green.*"], [0, {"origin": (0.5, 0, 2), "target": (0, 0, 0)}], spp=64)
    >>> len(p.rows), p.names[0]
    (2, 'green.reflectance.value[0]')
    """
    with Problem(scene, params, same, factor, log, hold) as p:
        keep: list[Any] = []
        names = _number_names(p)
        taken = [_one(p.scene, c, keep) for c in have]
        known = {c.sensor for c in taken if not c.placed}
        if candidates is None:
            candidates = [k for k in range(len(p.scene.sensors)) if k not in known]
        listed = [_one(p.scene, c, keep) for c in candidates]
        for c in taken:
            c.have = True
        rows = (_c.imp_plan_candidate * max(len(listed) + len(taken), 1))(*listed, *taken)
        o = _options(p, names, keep, of, prior, noise, criterion, take, budget)
        options = run_options(p.scene, seed=seed, spp=spp, drop_budget=drop_budget, points=points)
        out = ctypes.c_void_p()
        p.run(options, progress, lib.imp_plan, p.pointer, rows, len(listed) + len(taken), ctypes.byref(o),
              ctypes.byref(options), ctypes.byref(out))
        called = [decode(c.name) if c.name else p.scene.sensors[c.sensor].name for c in listed + taken]
        return Plan(rows_of(_c.imp_plan_result, out.value, 1)[0], names, called)


def plan_improve(scene: Scene, params: Any, candidate: Mapping[str, Any], rounds: int = 20, *, have: Any = (),
                 of: Any = None, prior: Optional[Mapping[str, float]] = None,
                 noise: Optional[Mapping[str, float]] = None, criterion: str = "d", spp: int = 0, seed: int = 0,
                 same: Any = None, factor: Any = None, log: Any = None, hold: Any = None, drop_budget: float = 0, points: str = "scene",
                 progress: Any = None) -> tuple[Any, float, float]:
    """The place of a camera, moved along the derivative of its gain at its distance from its target.

    Parameters
    ----------
    scene, params, have, of, prior, noise, criterion, spp, seed, same, factor, log, hold, drop_budget, points, progress
        As `plan`'s.
    candidate : mapping
        As one of `plan`'s, with `origin` and `target`.
    rounds : int
        At most so many, of five places each.

    Returns
    -------
    numpy.ndarray, float, float
        The origin, the gain there, and its standard error.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> place, gain, se = importon.plan_improve(scene, "red.*", {"origin": (0, 0, 3), "target": (0, 0, 0)}, 2, spp=16)
    >>> bool(abs(np.linalg.norm(place) - 3) < 1e-9), gain > 0
    (True, True)
    """
    with Problem(scene, params, same, factor, log, hold) as p:
        keep: list[Any] = []
        taken = [_one(p.scene, c, keep) for c in have]
        for c in taken:
            c.have = True
        rows = (_c.imp_plan_candidate * (len(taken) + 1))(*taken, _one(p.scene, candidate, keep))
        o = _options(p, _number_names(p), keep, of, prior, noise, criterion, 0, 0)
        options = run_options(p.scene, seed=seed, spp=spp, drop_budget=drop_budget, points=points)
        place, gain = np.zeros(3), _c.imp_estimate()
        p.run(options, progress, lib.imp_plan_improve, p.pointer, rows, len(rows), ctypes.byref(o),
              ctypes.byref(options), integer(rounds, "rounds"), address(place), ctypes.byref(gain))
        return place, gain.value, gain.se


def plan_map(scene: Scene, params: Any, candidate: Any, pull: Any, *, noise: Optional[Mapping[str, float]] = None,
             spp: int = 0, seed: int = 0, same: Any = None, factor: Any = None, log: Any = None, hold: Any = None,
             drop_budget: float = 0, points: str = "scene", progress: Any = None) -> list[Picture]:
    """Which pixels of a candidate tell of which number.

    Parameters
    ----------
    scene, params, noise, spp, seed, same, factor, log, hold, drop_budget, points, progress
        As `plan`'s.
    candidate : int, str or mapping
        As one of `plan`'s.
    pull : numpy.ndarray
        [n][n] weights of products of derivatives in the last picture: `PlanRow.pull` makes it the pixels' shares in
        the gain.

    Returns
    -------
    list of Picture
        For each number its information by pixel, w J^2; then the sum of pull_ij w J_i J_j.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> row = importon.plan(scene, "red.*", spp=64).rows[0]
    >>> maps = importon.plan_map(scene, "red.*", 0, row.pull, spp=64)
    >>> len(maps), maps[0].shape
    (4, (8, 8, 3))
    """
    with Problem(scene, params, same, factor, log, hold) as p:
        keep: list[Any] = []
        c = _one(p.scene, candidate, keep)
        o = _options(p, _number_names(p), keep, None, None, noise, "d", 0, 0)
        weights = numbers(pull, "pull", shape=(p.n, p.n))
        options = run_options(p.scene, seed=seed, spp=spp, drop_budget=drop_budget, points=points)
        films = (ctypes.c_void_p * (p.n + 1))()
        p.run(options, progress, lib.imp_plan_map, p.pointer, ctypes.byref(c), ctypes.byref(o), ctypes.byref(options),
              address(weights), films)
        return [from_film(f) for f in films if f]
