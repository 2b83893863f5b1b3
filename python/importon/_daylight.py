# SPDX-License-Identifier: Apache-2.0
"""Daylight of a year: weather files, and what the points of a grid get over their hours."""
from __future__ import annotations

import ctypes
import os
from typing import Any, NamedTuple

import numpy as np

from . import _c
from ._array import address
from ._context import context
from ._library import lib, make
from ._problem import check_scene, run_options
from ._rooms import call
from ._scene import Scene


class Weather(NamedTuple):
    """The hours of a year, from an EPW file (`weather`) or your own: arrays of one number an hour."""

    hour: Any
    """[n], the middle of each, 0.5 to 23.5 of the place's standard time."""
    sun: Any
    """[n][3], unit, towards the sun then: z up, x south, y west."""
    diffuse: Any
    """[n], irradiance of level ground by the sky, W/m^2."""
    direct: Any
    """[n], irradiance across the sun's rays by the sun, W/m^2."""
    diffuse_illuminance: Any
    """[n], the same in lx."""
    direct_illuminance: Any
    date: Any = None
    """[n][3], year, month and day."""
    latitude: float = float("nan")
    longitude: float = float("nan")
    timezone: float = float("nan")
    elevation: float = float("nan")
    modelled: bool = False
    """Illuminances are made of irradiances and dew points, as the file has none."""


class Year(NamedTuple):
    """Daylight of a year at the points of a grid; errors `..._se` are standard errors with 15 degrees of freedom."""

    autonomy: Any
    """[height][width], daylight autonomy: part of the hours of use with the wanted illuminance."""
    autonomy_se: Any
    continuous: Any
    continuous_se: Any
    useful: Any
    """[4][height][width], parts of the hours of use between the bounds of useful daylight."""
    useful_se: Any
    mean: Any
    """Over the hours of use, lx."""
    mean_se: Any
    exposure: Any
    """Over all hours, lx h."""
    exposure_se: Any
    sunlit_hours: Any
    """Hours of use with too much direct sun."""
    sunlit_hours_se: Any
    points: Any
    """[height][width][3], scene units."""
    average: dict[str, Any]
    """Of the points: number -> (value, standard error); `useful` has four of these."""
    spatial_autonomy: tuple[float, float]
    """sDA: part of the points with daylight for the part `part` of the hours, and its error."""
    sun_exposure: tuple[float, float]
    """ASE: part of the points with too many sunlit hours, and its error."""
    hours: int
    """Of use."""
    reading: Any
    """[height][width][n] illuminances of the hours, lx; None where they are not wanted."""
    reading_se: Any


def weather(path: Any) -> Weather:
    """The hours of a year from an EnergyPlus weather file (EPW).

    Parameters
    ----------
    path : str or path-like

    Returns
    -------
    Weather

    Examples
    --------
    >>> w = importon.weather("town.epw")  # doctest: +SKIP
    >>> w.diffuse.shape  # doctest: +SKIP
    (8760,)
    """
    own = context()
    info = make(_c.imp_weather_info)
    name = os.fsencode(path)
    rows = (_c.imp_weather_hour * 8784)()  # a leap year; read once, so that warnings come once
    own.check(lib.imp_weather_read(own.pointer, name, ctypes.byref(info), rows, len(rows)))
    table = np.frombuffer(rows, dtype=_WEATHER)[:info.n].copy()
    return Weather(hour=table["hour"], sun=table["sun"],
                   date=np.stack([table["year"], table["month"], table["day"]], 1),
                   **{k: table[k] for k in ("diffuse", "direct", "diffuse_illuminance", "direct_illuminance")},
                   **{k: getattr(info, k) for k in ("latitude", "longitude", "timezone", "elevation")},
                   modelled=bool(info.modelled))


_WEATHER = np.dtype([("year", "i4"), ("month", "i4"), ("day", "i4"), ("hour", "f8"), ("sun", "f8", 3), ("diffuse", "f8"),
                     ("direct", "f8"), ("diffuse_illuminance", "f8"), ("direct_illuminance", "f8")], align=True)
_YEAR = np.dtype([("value", "f8"), ("se", "f8"), ("bias_order", "i4")], align=True)
_NUMBERS = ("autonomy", "continuous", "mean", "exposure", "sunlit_hours")

_read = weather  # which an argument hides


def annual(scene: Scene, weather: Any, sensor: Any = 0, *, opens: float = 8, closes: float = 18, wanted: float = 300,
           useful: Any = (100, 300, 3000), sunlit: float = 1000, sunlit_hours: float = 250, part: float = 0.5,
           readings: bool = False, params: Any = None, seed: int = 0, spp: int = 0, points: str = "scene",
           progress: Any = None) -> Year:
    """Daylight of a year at the points of a grid: autonomy, useful daylight, exposure, from one set of walks.

    Parameters
    ----------
    scene : Scene
        With an emitter `perezsky` or `ciesky`, which says where up and south are.
    weather : Weather, str or path-like
        The hours, or an EPW file.
    sensor : int or str
        An irradiancemeter on a rectangle or, at points, on a disk or a flat mesh.
    opens, closes : float
        Hours of use of every day, standard time.
    wanted : float
        Illuminance of the autonomy, lx.
    useful : three float
        Between the four parts of useful daylight, lx.
    sunlit, sunlit_hours : float
        Illuminance by direct sun that is too much, and for how many hours a year.
    part : float
        Of the hours, at which a point has daylight enough.
    readings : bool
        Keep the illuminances of the hours?
    params, seed, spp, points, progress
        As `render`'s.

    Returns
    -------
    Year

    Examples
    --------
    >>> scene = importon.load_string('''<scene version="3.0.0"><integrator type="path"/><emitter type="ciesky"/>
    ... <shape type="rectangle"><sensor type="irradiancemeter"><film type="hdrfilm"><integer name="width" value="8"/>
    ... <integer name="height" value="8"/></film></sensor></shape></scene>''', mode="mono")
    >>> hours = importon.Weather(hour=[12.5], sun=[[.6, 0, .8]], diffuse=[100], direct=[0], diffuse_illuminance=[12000],
    ...                          direct_illuminance=[0])
    >>> year = importon.annual(scene, hours, spp=64)
    >>> bool(abs(year.average["mean"][0] / 12000 - 1) < .02)
    True
    """
    scene = check_scene(scene)
    if not isinstance(weather, Weather):
        weather = _read(weather)
    n = len(np.atleast_1d(weather.hour))
    table = np.zeros(n, dtype=_WEATHER)
    table["year"], table["month"], table["day"] = 2000, 1, 1
    if weather.date is not None:
        table["year"], table["month"], table["day"] = np.asarray(weather.date).T
    for name in ("hour", "sun", "diffuse", "direct", "diffuse_illuminance", "direct_illuminance"):
        table[name] = getattr(weather, name)
    number = scene.sensor_index(sensor)
    s = scene.sensors[number]
    shape = (s.height, s.width)
    o = make(_c.imp_annual_options)
    o.opens, o.closes, o.wanted, o.sunlit, o.sunlit_hours, o.part = opens, closes, wanted, sunlit, sunlit_hours, part
    o.useful[:] = useful
    places = np.zeros((*shape, 3))
    scene._context.check(lib.imp_grid_points(scene.pointer, number, address(places), None))
    rows = np.zeros((*shape, len(_NUMBERS) + 4), dtype=_YEAR)
    light = np.zeros((2, *shape, n)) if readings else None
    summary = make(_c.imp_annual_summary)
    options = run_options(scene, sensor=number, seed=seed, spp=spp, points=points, walks_from="scene")
    call(scene, params, options, progress, lib.imp_annual_read, scene.pointer, ctypes.byref(options), n,
          address(table), ctypes.byref(o), address(rows), ctypes.byref(summary),
          address(light[0]) if readings else None, address(light[1]) if readings else None)
    order = ("autonomy", "continuous", "useful", "useful", "useful", "useful", "mean", "exposure", "sunlit_hours")
    found = {}
    for k in _NUMBERS:
        at = order.index(k)
        found[k], found[k + "_se"] = rows[..., at]["value"].copy(), rows[..., at]["se"].copy()
    four = np.moveaxis(rows[..., 2:6], -1, 0)
    pair = lambda e: (e.value, e.se)
    average = {k: pair(getattr(summary.average, k)) for k in _NUMBERS}
    average["useful"] = [pair(e) for e in summary.average.useful]
    return Year(useful=four["value"].copy(), useful_se=four["se"].copy(), points=places, average=average,
                spatial_autonomy=pair(summary.spatial_autonomy), sun_exposure=pair(summary.sun_exposure),
                hours=summary.hours, reading=light[0] if readings else None,
                reading_se=light[1] if readings else None, **found)
