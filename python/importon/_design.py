# SPDX-License-Identifier: Apache-2.0
"""Which luminaires of a room are used, and how far they are dimmed."""
from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Optional, Union

from . import _c
from ._errors import ArgumentError
from ._library import choice, decode, integer, lib, make, rows_of, text
from ._plan import lamps as lamp_names
from ._problem import check_scene, run_options
from ._rooms import call, luminaires
from ._scene import Scene

_WANTS = ("average", "minimum", "maximum", "uniformity", "ugr")
_KEYS = {"lamp", "place", "needed", "watts", "cost", "least", "most"}


class Want(NamedTuple):
    """What is wanted of a grid, and what a design has of it."""

    sensor: str
    of: str
    """average, minimum, maximum, uniformity or ugr."""
    wanted: float
    value: float
    """By fresh walks."""
    sure: float
    """The bound that holds with the confidence asked for."""
    holds: bool
    binding: bool
    price: float
    """d objective / d wanted, with the same lamps."""
    attainable: float
    """Without an answer: the best value with all other wants; NaN: with these none has an answer."""
    alone: float
    """Without an answer: the best value that it can have alone."""


class Design:
    """The best combination of lamps.

    Attributes
    ----------
    found : bool
        Some combination has what is wanted, with margins for the errors of walks.
    holds : bool
        Fresh walks show it, with the confidence.
    proven : bool
        The search ended by itself: nothing is better, or nothing has what is wanted.
    levels : dict of str to float
        Of each lamp; 0: not used.
    objective, bound : float
        No combination has less than `bound`.
    objective_se, margin : float
        Its error at most; and what of it is margin.
    watts, flux, cost : float
    wants : list of Want
    others : list of (float, dict)
        Objectives and levels of other sets of lamps.
    rounds, nodes : int
    moves : dict of str to list of (float, float)
        What has moved, by name: from and to, for each of its numbers that may move.
    steps : int
        Of the search for places.
    starts : list of float
        The objective at the end of the search from each start, before fresh walks; inf: nothing there has what is wanted.
    """

    def __init__(self, answer: Any, names: list[str], sensors: list[str]) -> None:
        n = len(names)
        self.found, self.holds, self.proven = bool(answer.found), bool(answer.holds), bool(answer.proven)
        for key in ("objective", "bound", "objective_se", "margin", "watts", "flux", "cost"):
            setattr(self, key, float(getattr(answer, key)))
        self.rounds, self.nodes, self.steps = int(answer.rounds), int(answer.nodes), int(answer.steps)
        self.starts = _doubles(answer.start_objective, int(answer.n_starts))
        self.moves: dict[str, list[tuple[float, float]]] = {}
        self.levels = dict(zip(names, _doubles(answer.level, n)))
        self.wants = [Want(s, "", f.wanted, f.value, f.sure, bool(f.holds), bool(f.binding), f.price, f.attainable,
                           f.alone) for s, f in zip(sensors, rows_of(_c.imp_design_finding, _pointer(answer.wants),
                                                                     answer.n_wants))]
        at = _doubles(answer.other_level, n * answer.n_others)
        objectives = _doubles(answer.other_objective, answer.n_others)
        self.others = [(o, dict(zip(names, at[k * n:(k + 1) * n]))) for k, o in enumerate(objectives)]

    def __repr__(self) -> str:
        if not self.found:
            return "\n".join(["no combination has all that is wanted"] + [
                "%s %s: wanted %g, at best %g, with the others %g" % (w.sensor, w.of, w.wanted, w.alone, w.attainable)
                for w in self.wants])
        lines = ["%s: %.3g" % (name, x) for name, x in self.levels.items() if x > 0]
        lines += ["%s %s: wanted %g, sure %.4g%s" % (w.sensor, w.of, w.wanted, w.sure, "" if w.holds else " (not shown)")
                  for w in self.wants]
        return "\n".join(["%.4g W, %.5g lm" % (self.watts, self.flux), *lines])


def _pointer(p: Any) -> Any:
    return p if isinstance(p, int) or p is None else ctypes.cast(p, ctypes.c_void_p).value


def _doubles(p: Any, n: int) -> list[float]:
    at = _pointer(p)
    return [float(v) for v in (ctypes.c_double * n).from_address(at)] if n and at else []


def _lamp(value: Any, keep: list[Any]) -> Any:
    """imp_design_lamp."""
    given = {"lamp": value} if isinstance(value, str) else dict(value)
    for key in given:
        if key not in _KEYS:
            raise ArgumentError("a lamp has no %r; it has %s" % (key, ", ".join(sorted(_KEYS))))
    if "lamp" not in given:
        raise ArgumentError("a lamp has its name as 'lamp'")
    row = make(_c.imp_design_lamp, needed=bool(given.get("needed", False)))
    for key in ("watts", "cost", "least", "most"):
        setattr(row, key, float(given.get(key, 0)))
    for key in ("lamp", "place"):
        if given.get(key) is not None:
            keep.append(text(given[key], key))
            setattr(row, key, keep[-1])
    return row


def _moves(moves: Any, keep: list[Any]) -> list[Any]:
    """imp_design_move of names, or of a mapping of names to bounds (None, or a pair for each number; None: it stays)."""
    listed = []
    for name in moves or ():
        bounds = moves[name] if isinstance(moves, Mapping) else None
        if bounds is None:
            bounds = [(0, 0)] * (6 if str(name).endswith(".pose") else 3)
        keep.append(text(name, "moves"))
        for component, pair in enumerate(bounds):
            if pair is None:
                continue
            try:
                lo, hi = (float(x) for x in pair)
            except (TypeError, ValueError) as e:
                raise ArgumentError("moves: bounds of %r are pairs (lo, hi), or None for a number that stays" % name) from e
            listed.append(make(_c.imp_design_move, component=component, lo=lo, hi=hi))
            listed[-1].name = keep[-1]
    return listed


def _wants(scene: Scene, wants: Mapping[Any, Mapping[str, float]]) -> list[Any]:
    if not isinstance(wants, Mapping):
        raise ArgumentError("wants maps grids to what is wanted of them, as {'work': {'average': 500}}")
    listed = []
    for sensor, of in wants.items():
        for key, value in of.items():
            if key not in _WANTS:
                raise ArgumentError("wants has no %r; it has %s" % (key, ", ".join(_WANTS)))
            listed.append(make(_c.imp_design_want, sensor=scene.sensor_index(sensor), of=_WANTS.index(key),
                               value=float(value)))
    return listed


def design(scene: Scene, wants: Mapping[Any, Mapping[str, float]],
           lamps: Optional[Sequence[Union[str, Mapping[str, Any]]]] = None, *, least: str = "watts",
           confidence: float = 0.95, rounds: int = 0, others: int = 0, within: float = 0, nodes: int = 0,
           moves: Any = None, clearance: float = 0.1, steps: int = 0, starts: int = 0, params: Any = None, seed: int = 0, spp: int = 0, points: str = "scene", walks_from: str = "scene",
           progress: Any = None) -> Design:
    """Which lamps are used, and how far dimmed, so that what is wanted of grids holds with the fewest watts.

    Parameters
    ----------
    scene : Scene
    wants : mapping
        Of grids (irradiancemeters, by name or number), of `average`, `minimum`, `uniformity` (at least), `maximum`,
        `ugr` (at most): ``{"work": {"average": 500, "uniformity": 0.6}}``.
    lamps : list, optional
        Names of emitters, or mappings with `lamp`, `place` (at most one lamp of a place is used), `needed`, `watts` at
        level 1, `cost`, and the levels `least` and `most` of a lamp that is used (.1 and 1). By default all luminaires.
    least : str
        "watts", "flux" or "cost".
    confidence : float
        With which all of it holds, by fresh walks.
    rounds, nodes : int
        Of fresh walks, and branches of a search, at most.
    moves : list of str or mapping, optional
        Places and aims that may change: names as of `Scene.add_geometry` ("lamp.position", "lamp.direction",
        "shape.pose"), or a mapping of them to bounds, ``{"lamp.position": [(0, 4), (0, 6), None]}``; None: a number that
        stays. The scene has the places found afterwards.
    clearance : float
        Of what moves without bounds, from the box of all shapes.
    steps : int
        Of a search for places, at most (60).
    starts : int
        Searches for places (1): the first from the present ones, others from places that are drawn within the bounds.
    others, within
        Other sets of lamps to be listed, at most, and by what part of the objective they may be above it.
    params, seed, spp, points, walks_from, progress
        As `render`'s; spp with one lamp at a time.

    Returns
    -------
    Design

    Examples
    --------
    >>> scene = importon.load_string('''<scene version="3.0.0"><integrator type="path"/>
    ... <emitter type="point" id="lamp"><point name="position" x="0" y="0" z="2"/>
    ... <rgb name="intensity" value="400"/></emitter>
    ... <shape type="rectangle"><sensor type="irradiancemeter" id="desk"><string name="at" value="points"/></sensor></shape>
    ... </scene>''')
    >>> d = importon.design(scene, {"desk": {"minimum": 40}}, [{"lamp": "lamp", "watts": 10}])
    >>> d.holds, round(d.levels["lamp"], 3)
    (True, 0.625)
    """
    scene = check_scene(scene)
    keep: list[Any] = []
    if lamps is None:
        known = {x.name for x in luminaires(scene)}
        lamps = [name for name in lamp_names(scene) if name in known]
    listed = [_lamp(x, keep) for x in lamps]
    wanted = _wants(scene, wants)
    rows = (_c.imp_design_lamp * max(len(listed), 1))(*listed)
    of = (_c.imp_design_want * max(len(wanted), 1))(*wanted)
    o = make(_c.imp_design_options, least=choice("imp_design_least", least, "least"), confidence=float(confidence),
             rounds=integer(rounds, "rounds"), others=integer(others, "others"), within=float(within),
             nodes=integer(nodes, "nodes"), clearance=float(clearance), steps=integer(steps, "steps"),
             starts=integer(starts, "starts"))
    options = run_options(scene, sensor=0, seed=seed, spp=spp, points=points, walks_from=walks_from)
    out = ctypes.c_void_p()
    moved = _moves(moves, keep)
    if moved:
        rows_moved = (_c.imp_design_move * len(moved))(*moved)
        call(scene, params, options, progress, lib.imp_design_move, scene.pointer, rows, len(listed), of, len(wanted),
              rows_moved, len(moved), ctypes.byref(o), ctypes.byref(options), ctypes.byref(out))
    else:
        call(scene, params, options, progress, lib.imp_design_find, scene.pointer, rows, len(listed), of, len(wanted),
              ctypes.byref(o), ctypes.byref(options), ctypes.byref(out))
    try:
        answer = rows_of(_c.imp_design_answer, _pointer(lib.imp_design_result(out)), 1)[0]
        d = Design(answer, [decode(x.lamp) for x in listed], [scene.sensors[w.sensor].name for w in wanted])
        places = zip(_doubles(answer.moved_from, len(moved)), _doubles(answer.moved_to, len(moved)))
        for row, pair in zip(moved, places):
            d.moves.setdefault(decode(row.name), []).append(pair)
        d.wants = [w._replace(of=_WANTS[x.of]) for w, x in zip(d.wants, wanted)]
        return d
    finally:
        lib.imp_design_destroy(out)
