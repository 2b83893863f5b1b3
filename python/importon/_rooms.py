# SPDX-License-Identifier: Apache-2.0
"""Grids of illuminances, shares of lamps and materials, luminaires."""
from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any, NamedTuple, Optional

import numpy as np

from . import _c
from ._array import address
from ._context import failure
from ._library import decode, lib, make
from ._params import SceneParameters
from ._problem import check_scene, push, run_options
from ._run import run
from ._scene import Scene
from ._until import Reached, _end, _options


class Interval(NamedTuple):
    """A number, and an interval around what it estimates."""

    value: float
    lo: float
    hi: float


class Grid(NamedTuple):
    """Readings of the pixels of a meter; intervals hold for extremes of noisy values, too."""

    value: Any
    """[height][width], in the sensor's unit."""
    se: Any
    """[height][width], one standard error of each."""
    points: Any
    """[height][width][3], scene units."""
    average: Interval
    minimum: Interval
    maximum: Interval
    uniformity: Interval
    """Minimum over average."""
    diversity: Interval
    """Minimum over maximum."""
    confidence: float
    """With which each interval by itself contains the truth, at least."""
    cells: Any
    """[height][width][2], column and row of each point in the raster: on a disk or a flat mesh the film has one row of
    those points that lie on the shape."""
    raster: tuple[int, int]
    """Columns and rows."""
    reached: Optional[Reached] = None
    """With `until`: how it ended; spp is the mean over the points, pilots included."""


class Share(NamedTuple):
    """What a lamp or a material has to do with a reading: dE/d ln x by a common factor."""

    of: str
    """ "light" or "surface"."""
    name: str
    value: float
    se: float


class Luminaire(NamedTuple):
    """An emitter `ies`: `struct imp_luminaire_info`."""

    name: str
    flux: float
    lamp_flux: float
    watts: float
    efficacy: float
    dimming: float
    maintenance: float
    is_point: bool
    position: tuple[float, float, float]
    opening: tuple[float, float, float]
    level: float
    power: float
    file: str
    """As the scene names it; "": of none."""


def call(scene: Scene, params: Any, options: Any, progress: Any, *call: Any) -> None:
    with scene.lock:
        if isinstance(params, Mapping) and not isinstance(params, SceneParameters):
            SceneParameters(scene).update(params)
        elif params is not None:
            push(scene, params)
        status, message = run(scene._context, options, progress, *call)
    if status:
        raise failure(status, message)


def grid(scene: Scene, sensor: Any = 0, *, params: Any = None, confidence: float = 0.95, seed: int = 0, spp: int = 0,
         until: float = 0, most_spp: int = 0, points: str = "scene", walks_from: str = "scene",
         progress: Any = None) -> Grid:
    """The readings of an irradiancemeter's pixels, with average, extremes and uniformities.

    Parameters
    ----------
    scene : Scene
    sensor : int or str
        An irradiancemeter on a rectangle or, at points, on a disk or a flat mesh, or a radiancemeter with a grid.
    confidence : float
        Of each interval.
    until : float
        Each point gets the samples that it needs to be this close to the truth, as a part of its reading, in 95 of
        100 cases; 0: all get `spp`. With it `spp` is that of the first pilot.
    most_spp : int
        With `until`: samples of a point, at most; 0: 65536.
    params, seed, spp, points, walks_from, progress
        As `render`'s.

    Returns
    -------
    Grid

    Examples
    --------
    >>> scene = importon.load_string('''<scene version="3.0.0"><integrator type="path"/><emitter type="constant"/>
    ... <shape type="rectangle"><sensor type="irradiancemeter"><string name="at" value="points"/></sensor></shape></scene>''')
    >>> g = importon.grid(scene, spp=64)
    >>> g.value.shape, g.minimum.lo <= 3.1416 <= g.minimum.hi
    ((6, 6), True)
    >>> importon.grid(scene, until=0.05).reached.reached
    True
    """
    scene = check_scene(scene)
    number = scene.sensor_index(sensor)
    s = scene.sensors[number]
    value, se = np.zeros((s.height, s.width)), np.zeros((s.height, s.width))
    places, cells = np.zeros((s.height, s.width, 3)), np.zeros((s.height, s.width, 2), np.int32)
    columns, rows = ctypes.c_int(), ctypes.c_int()
    options = run_options(scene, sensor=number, seed=seed, spp=spp, points=points, walks_from=walks_from)
    average, sets, summary = _c.imp_estimate(), ctypes.c_int64(), make(_c.imp_grid_summary)
    scene._context.check(lib.imp_grid_points(scene.pointer, number, address(places), None))
    scene._context.check(lib.imp_grid_cells(scene.pointer, number, ctypes.byref(columns), ctypes.byref(rows),
                                            address(cells)))
    to = (address(value), address(se), ctypes.byref(average), ctypes.byref(sets))
    wanted, end = _options(until, 0, most_spp), make(_c.imp_until_end)
    if until:
        call(scene, params, options, progress, lib.imp_grid_read_until, scene.pointer, ctypes.byref(options),
             ctypes.byref(wanted), *to, ctypes.byref(end))
    else:
        call(scene, params, options, progress, lib.imp_grid_read, scene.pointer, ctypes.byref(options), *to)
    scene._context.check(lib.imp_grid_summarise(scene._context.pointer, value.size, address(value), address(se),
                                                ctypes.byref(average), sets.value, float(confidence),
                                                ctypes.byref(summary)))
    number_of = {k: getattr(summary, k) for k in ("average", "minimum", "maximum", "uniformity", "diversity")}
    return Grid(value, se, places, confidence=summary.confidence, cells=cells, raster=(columns.value, rows.value),
                reached=_end(end) if until else None, **{k: Interval(x.value, x.lo, x.hi) for k, x in number_of.items()})


def shares(scene: Scene, sensor: Any = 0, *, params: Any = None, seed: int = 0, spp: int = 0, points: str = "scene",
           walks_from: str = "scene", progress: Any = None) -> tuple[Interval, list[Share]]:
    """What each lamp and each material has to do with a reading; shares of lamps add up to it.

    Parameters
    ----------
    scene : Scene
    sensor, params, seed, spp, points, walks_from, progress
        As `render`'s.

    Returns
    -------
    Interval, list of Share
        The reading with its 95 % interval; lamps, then materials.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> reading, rows = importon.shares(scene, spp=8)
    >>> bool(abs(sum(r.value for r in rows if r.of == "light") / reading.value - 1) < 1e-5)
    True
    """
    scene = check_scene(scene)
    options = run_options(scene, sensor=sensor, seed=seed, spp=spp, points=points, walks_from=walks_from)
    n, e = ctypes.c_size_t(), _c.imp_estimate()
    scene._context.check(lib.imp_reading_shares(scene.pointer, ctypes.byref(options), None, 0, ctypes.byref(n), None))
    rows = (_c.imp_share * max(n.value, 1))()
    call(scene, params, options, progress, lib.imp_reading_shares, scene.pointer, ctypes.byref(options), rows,
          len(rows), ctypes.byref(n), ctypes.byref(e))
    found = [Share("light" if r.of == 0 else "surface", decode(r.name), r.value, r.se) for r in rows[:n.value]]
    return Interval(e.value, e.value - 1.96 * e.se, e.value + 1.96 * e.se), found


def luminaires(scene: Scene) -> list[Luminaire]:
    """The luminaires of a scene: emitters `ies` with what their files say.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    list of Luminaire
        In the scene's order.

    Examples
    --------
    >>> importon.luminaires(importon.load_dict(importon.cornell_box(res=8)))
    []
    """
    scene = check_scene(scene)
    found = []
    for i in range(lib.imp_scene_n_luminaires(scene.pointer)):
        x = make(_c.imp_luminaire_info)
        scene._context.check(lib.imp_scene_get_luminaire(scene.pointer, i, ctypes.byref(x)))
        found.append(Luminaire(decode(x.name), x.flux, x.lamp_flux, x.watts, x.efficacy, x.dimming, x.maintenance,
                               bool(x.is_point), tuple(x.position), tuple(x.opening), x.level, x.power, decode(x.file)))
    return found


def glare(scene: Scene, sensor: Any = 0, *, params: Any = None, seed: int = 0, spp: int = 0, points: str = "scene",
          walks_from: str = "scene", progress: Any = None) -> tuple[Any, Any]:
    """The unified glare rating (CIE 117) of the observers of a grid.

    Parameters
    ----------
    scene : Scene
    sensor : int or str
        An irradiancemeter with a virtual, horizontal rectangle and a horizontal `facing`, the line of sight.
    params, seed, spp, points, walks_from, progress
        As `render`'s.

    Returns
    -------
    numpy.ndarray, numpy.ndarray
        [height][width], and one standard error each; -inf where no luminaire is seen.

    Examples
    --------
    >>> scene = importon.load_string('''<scene version="3.0.0"><integrator type="path"/><emitter type="constant"/>
    ... <shape type="rectangle"><sensor type="irradiancemeter"><boolean name="virtual" value="true"/>
    ... <vector name="facing" x="1" y="0" z="0"/></sensor></shape></scene>''')
    >>> ugr, se = importon.glare(scene, spp=16)
    >>> bool((ugr == -float("inf")).all())
    True
    """
    scene = check_scene(scene)
    number = scene.sensor_index(sensor)
    s = scene.sensors[number]
    ugr, se = np.zeros((s.height, s.width)), np.zeros((s.height, s.width))
    options = run_options(scene, sensor=number, seed=seed, spp=spp, points=points, walks_from=walks_from)
    call(scene, params, options, progress, lib.imp_grid_glare, scene.pointer, ctypes.byref(options), address(ugr),
          address(se))
    return ugr, se


class GlareTable(NamedTuple):
    """Unified glare ratings of a luminaire in standard rooms: `struct imp_glare_table`."""

    flux: float
    """Of a luminaire, lm."""
    spacing: float
    """Of the luminaires, in parts of their height above the eyes."""
    rooms: Any
    """[19][2], width across the line of sight and depth along it, in those heights."""
    reflectances: Any
    """[5][3], of ceiling, walls and floor."""
    across: Any
    """[19][5], seen across the length of the lamps."""
    along: Any
    """[19][5], seen along it."""


def glare_table(scene: Scene, luminaire: int = 0, *, spacing: float = .25, flux: float = 0) -> GlareTable:
    """The table of glare ratings of a luminaire (CIE 117, CIE 190), from its photometric file.

    Parameters
    ----------
    scene : Scene
        A photometric file alone is a scene: `importon.load_file("lamp.ldt")`.
    luminaire : int
        Its number, as in `luminaires`.
    spacing : float
        Of the luminaires, in parts of their height above the eyes.
    flux : float
        Of a luminaire, lm, in place of that which it has in the scene (0).

    Returns
    -------
    GlareTable

    Examples
    --------
    >>> scene = importon.load_file("opal.ldt")
    >>> table = importon.glare_table(scene, flux=4000)
    >>> table.across.shape, round(float(table.across[10, 0]), 1)
    ((19, 5), 22.3)
    """
    scene = check_scene(scene)
    o, t = make(_c.imp_glare_table_options), make(_c.imp_glare_table)
    o.spacing, o.flux = spacing, flux
    scene._context.check(lib.imp_luminaire_glare_table(scene.pointer, luminaire, ctypes.byref(o), ctypes.byref(t)))
    ugr = np.array([[list(row) for row in room] for room in t.ugr])
    return GlareTable(t.flux, t.spacing, np.array([list(x) for x in t.room]), np.array([list(x) for x in t.reflectance]),
                      ugr[:, 0], ugr[:, 1])


def daylight_glare(scene: Scene, sensor: Any = 0, *, threshold: float = 5, cells: int = 64, params: Any = None,
                   seed: int = 0, spp: int = 0, points: str = "scene", progress: Any = None) -> tuple[Any, Any, Any]:
    """The daylight glare probability (Wienold and Christoffersen 2006) of the observers of a grid.

    Parameters
    ----------
    scene : Scene
    sensor : int or str
        An irradiancemeter with a virtual, horizontal rectangle, `at` points, and a horizontal `facing`, the line of sight.
    threshold : float
        Luminance from which a part of the view is a source of glare: up to 100 a multiple of the mean luminance of the
        view, above that cd/m^2.
    cells : int
        The view has cells x cells parts of equal solid angle, with at least 16 walks for each.
    params, seed, spp, points, progress
        As `render`'s.

    Returns
    -------
    numpy.ndarray, numpy.ndarray, numpy.ndarray
        [height][width]; one standard error each; the vertical illuminance at the eye, lx.

    Examples
    --------
    >>> scene = importon.load_string('''<scene version="3.0.0"><integrator type="path"/><emitter type="constant"/>
    ... <shape type="rectangle"><sensor type="irradiancemeter"><boolean name="virtual" value="true"/>
    ... <string name="at" value="points"/><vector name="facing" x="1" y="0" z="0"/>
    ... <film type="hdrfilm"><integer name="width" value="1"/><integer name="height" value="1"/></film></sensor></shape>
    ... </scene>''', mode="mono")
    >>> dgp, se, lx = importon.daylight_glare(scene, cells=8)
    >>> bool(abs(dgp[0, 0] - .16018) < 1e-4 and abs(lx[0, 0] - 3.1416) < .1)
    True
    """
    scene = check_scene(scene)
    number = scene.sensor_index(sensor)
    s = scene.sensors[number]
    found = np.zeros((3, s.height, s.width))
    o = make(_c.imp_dgp_options)
    o.threshold, o.cells = threshold, cells
    options = run_options(scene, sensor=number, seed=seed, spp=spp, points=points, walks_from="scene")
    call(scene, params, options, progress, lib.imp_grid_dgp, scene.pointer, ctypes.byref(options), ctypes.byref(o),
          address(found[0]), address(found[1]), address(found[2]))
    return found[0], found[1], found[2]
