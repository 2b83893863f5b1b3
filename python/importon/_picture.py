# SPDX-License-Identifier: Apache-2.0
"""Pictures: NumPy arrays with their standard errors beside them."""
from __future__ import annotations

import ctypes
import os
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Optional

import numpy as np

from . import _c
from ._array import numbers, view
from ._context import Context, Handle, context, warn_said
from ._errors import ArgumentError
from ._library import choice, decode, integer, lib, make, rows_of, text, word


class DroppedWalk(NamedTuple):
    """Where a walk was dropped: `importon.walk` with the same scene, sensor, seed, pixel and
    sample is that walk, vertex by vertex."""

    seed: int
    sample: int
    x: int
    y: int
    sensor: int
    cause: str


class Picture(np.ndarray):  # type: ignore[type-arg,unused-ignore]
    """A picture: float32 [height][width][channels], linear, row 0 at the top.

    It is an array over the library's memory, which lives as long as the array does, whatever
    happens to the scene. What is computed from it is a plain array; a part of it keeps its
    part of `se`.

    Attributes
    ----------
    se : ndarray or None
        One standard error of each number, in the same shape; None: not known.
    channels : tuple of str
        Names of the channels, as in EXR files.
    spp : int
        Samples per pixel.
    dropped : dict
        How many walks were dropped (their value counts as 0), by cause.
    dropped_walks : tuple of DroppedWalk
        The first of them, at most eight.
    signed : bool
        A derivative: shown in blue and red.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8, spp=4))
    >>> picture = importon.render(scene)
    >>> picture.shape, picture.se.shape, picture.channels
    ((8, 8, 3), (8, 8, 3), ('R', 'G', 'B'))
    >>> picture[..., 0].se.shape
    (8, 8)
    """

    se: Any
    channels: tuple[str, ...]
    spp: int
    dropped: dict[str, int]
    dropped_walks: tuple[DroppedWalk, ...]
    signed: bool
    _film: Optional[Handle]

    def __array_finalize__(self, source: Any) -> None:
        self.se = None
        self.channels = ()
        self.spp = getattr(source, "spp", 0)
        self.dropped = getattr(source, "dropped", {})
        self.dropped_walks = getattr(source, "dropped_walks", ())
        self.signed = getattr(source, "signed", False)
        self._film = None

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, out: Any = None, **kw: Any) -> Any:
        plain = [np.asarray(x) if isinstance(x, Picture) else x for x in inputs]
        if out is not None:
            kw["out"] = tuple(np.asarray(x) if isinstance(x, Picture) else x for x in out)
        made = getattr(ufunc, method)(*plain, **kw)
        return made if out is None else out[0] if len(out) == 1 else out

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        def plain(x: Any) -> Any:
            if isinstance(x, Picture):
                return x.view(np.ndarray)
            if type(x) in (list, tuple):
                return type(x)(plain(y) for y in x)
            return x

        return func(*plain(args), **{k: plain(v) for k, v in kwargs.items()})

    def __getitem__(self, key: Any) -> Any:
        part = super().__getitem__(key)
        if isinstance(part, Picture) and self.se is not None:
            part.se = self.se[key]
            if part.ndim == 3 and part.shape[2] == len(self.channels):
                part.channels = self.channels
        return part

    def __reduce__(self) -> Any:
        state = (self.se, self.channels, self.spp, self.dropped, self.dropped_walks, self.signed)
        return _rebuild, (np.array(self.view(np.ndarray)), state)

    def write(self, path: Any, **options: Any) -> None:
        """Write this picture.

        Parameters
        ----------
        path : str or PathLike
        **options
            As `importon.write`'s.

        Examples
        --------
        >>> importon.render(importon.load_dict(importon.cornell_box(res=8)), spp=4).write("box.exr")
        >>> importon.read("box.exr").se.shape
        (8, 8, 3)
        """
        write(path, self, **options)

    def attribute(self, key: str) -> Optional[str]:
        """A text that belongs to the picture, such as how it was made.

        Parameters
        ----------
        key : str
            As given to `importon.write`, or read from an EXR file.

        Returns
        -------
        str or None
            None: there is none.

        Examples
        --------
        >>> importon.write("grey.exr", np.full((2, 3, 3), 0.5), attributes={"comment": "grey"})
        >>> importon.read("grey.exr").attribute("comment")
        'grey'
        """
        found = None if self._film is None else lib.imp_film_text(self._film.pointer, text(key, "key"))
        return None if found is None else decode(found)

    def _repr_png_(self) -> Optional[bytes]:
        if self.ndim not in (2, 3) or not self.size:
            return None
        return png(self)

    def _repr_html_(self) -> Optional[str]:
        from ._html import picture
        shown: Optional[str] = picture(self)
        return shown


def _rebuild(array: Any, state: Any) -> Picture:
    made: Picture = array.view(Picture)
    made.se, made.channels, made.spp, made.dropped, made.dropped_walks, made.signed = state
    return made


def from_film(pointer: Optional[int], signed: bool = False) -> Picture:
    """The picture of a film, which it now owns."""
    film = Handle(pointer or 0, lib.imp_film_destroy)
    info = make(_c.imp_film_info)
    lib.imp_film_get_info(film.pointer, ctypes.byref(info))
    shape = (info.height, info.width, info.channels)
    made: Picture = view(film, lib.imp_film_mean(film.pointer), shape).view(Picture)
    se = lib.imp_film_se(film.pointer)
    made.se = view(film, se, shape) if se else None
    made.channels = tuple(lib.imp_film_channel(film.pointer, c).decode() for c in range(info.channels))
    made.spp = info.spp
    counted = {word("imp_drop", c): int(n) for c, n in enumerate(info.dropped_by_cause) if n}
    made.dropped = counted or ({"unknown": int(info.dropped)} if info.dropped else {})
    made.dropped_walks = tuple(DroppedWalk(k.seed, k.sample, k.x, k.y, k.sensor, word("imp_drop", k.cause))
                               for k in rows_of(_c.imp_drop_key, info.drop_keys, info.n_drop_keys))
    made.signed = signed
    made._film = film
    return made


def _default_channels(n: int) -> tuple[str, ...]:
    known = {1: ("Y",), 2: ("Y", "A"), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}
    return known.get(n) or tuple("c%d" % i for i in range(n))


def to_film(picture: Any, ctx: Optional[Context] = None, name: str = "picture",
            channels: Optional[Sequence[str]] = None) -> Handle:
    """A film with these numbers: the picture's own, or a copy."""
    if isinstance(picture, Picture) and picture._film is not None and channels is None:
        return picture._film
    pixels = numbers(picture, name, np.float32)
    if pixels.ndim == 2:
        pixels = pixels[..., None]
    if pixels.ndim != 3 or not pixels.size:
        raise ArgumentError("%s has shape %s: a picture is (height, width) or (height, width, channels)"
                            % (name, pixels.shape))
    names = tuple(channels or getattr(picture, "channels", ()) or _default_channels(pixels.shape[2]))
    if len(names) != pixels.shape[2]:
        raise ArgumentError("%s has %d channels, and %d names" % (name, pixels.shape[2], len(names)))
    ctx = ctx or context()
    out = ctypes.c_void_p()
    ctx.check(lib.imp_film_create(ctx.pointer, pixels.shape[1], pixels.shape[0],
                                  text(",".join(names), "channels"), ctypes.byref(out)))
    film = Handle(out.value or 0, lib.imp_film_destroy)
    view(film, lib.imp_film_mean(film.pointer), pixels.shape)[...] = pixels
    return film


def read(path: Any) -> Picture:
    """Read a picture.

    Parameters
    ----------
    path : str or PathLike
        .exr, .pfm, .hdr, .npy, .png or .jpg; files of 8 and 16 bits are taken to be sRGB
        and made linear.

    Returns
    -------
    Picture
        float32 [height][width][channels], with `se` where the file has standard errors.

    Raises
    ------
    FileError
        It cannot be read.
    SceneError
        It is no such file, or damaged.

    Examples
    --------
    >>> importon.write("grey.exr", np.full((2, 3, 3), 0.5))
    >>> importon.read("grey.exr").shape
    (2, 3, 3)
    """
    ctx = context()
    out = ctypes.c_void_p()
    ctx.check(lib.imp_film_read(ctx.pointer, text(path, "path"), ctypes.byref(out)))
    warn_said()
    return from_film(out.value)


def write(path: Any, picture: Any, *, half: bool = False, standard_error: bool = True,
          exposure: float = 0, diverging: Optional[bool] = None, range: float = 0,
          attributes: Optional[Mapping[str, str]] = None) -> None:
    """Write a picture by extension: .exr, .pfm, .hdr, .png (sRGB), .npy.

    The file appears whole or not at all, in the place of an older one.

    Parameters
    ----------
    path : str or PathLike
    picture : Picture or array
        (height, width) or (height, width, channels).
    half : bool
        16-bit floats (EXR).
    standard_error : bool
        With channels se.R, se.G ... (EXR), if the picture has standard errors.
    exposure : float
        In stops (PNG).
    diverging : bool or None
        Of a signed picture: blue, white, red (PNG). None: of derivatives.
    range : float
        The value drawn in full red; 0: the 99.5 percentile.
    attributes : mapping of str to str, optional
        Texts that are kept in the file (EXR), such as how the picture was made.

    Raises
    ------
    ArgumentError
        Another extension, or channels that do not go together.
    FileError
        The file cannot be written.

    Examples
    --------
    >>> importon.write("grey.png", np.full((2, 3, 3), 0.5))
    """
    film = to_film(picture)
    for key, value in dict(attributes or {}).items():
        context().check(lib.imp_film_set_text(film.pointer, text(key, "attributes"), text(value, "attributes")))
    signed = getattr(picture, "signed", False) if diverging is None else diverging
    options = make(_c.imp_write_options, half=bool(half), exposure=float(exposure), diverging=bool(signed),
                   range=float(range), standard_error=bool(standard_error and getattr(picture, "se", None) is not None))
    context().check(lib.imp_film_write(film.pointer, text(path, "path"), ctypes.byref(options)))


def project(map: Any, source: str = "latlong", target: str = "equal_area", *, width: int = 0,
            height: int = 0) -> Picture:
    """A map of the sky in another projection or size, with its light kept.

    Parameters
    ----------
    map : Picture, array or path
        (height, width, channels) of all directions.
    source, target : str
        "latlong": rows at equal angles from up to down, the first and the last at the poles;
        "equal_area": rows at equal cosines, all texels of one solid angle.
    width, height : int
        Of the result; 0: the map's.

    Returns
    -------
    Picture
        Its light as an `envmap` interpolates it, the integral over all directions, is the
        map's.

    Raises
    ------
    ArgumentError
        A map below 2 x 2, or no such projection.

    Examples
    --------
    >>> sky = importon.project(np.full((8, 16, 3), 0.5), "latlong", "equal_area", width=8, height=4)
    >>> sky.shape, bool(abs(sky - 0.5).max() < 1e-6)
    ((4, 8, 3), True)
    """
    if isinstance(map, (str, bytes)) or hasattr(map, "__fspath__"):
        map = read(map)
    film, shape, out = to_film(map, name="map"), np.shape(map), ctypes.c_void_p()
    context().check(lib.imp_film_project(
        film.pointer, choice("imp_sky_projection", source, "source"), choice("imp_sky_projection", target, "target"),
        integer(width, "width") or shape[1], integer(height, "height") or shape[0], ctypes.byref(out)))
    return from_film(out.value)


def reduce(picture: Any, width: int, height: int, white: float = float("inf")) -> Picture:
    """A picture of fewer pixels: means of blocks, as a photograph for a film of this size.

    Parameters
    ----------
    picture : Picture, array or path
        Its width and height are whole multiples of the new ones.
    width, height : int
    white : float
        Values at or above it are clipped: a block of these alone has `white`, and one with some of them is nan, as its
        mean is not known. A DNG is clipped at 1.

    Returns
    -------
    Picture

    Raises
    ------
    ArgumentError
        That is not a whole number of pixels.

    Examples
    --------
    >>> small = importon.reduce(np.array([[0.0, 0.5, 1.0, 1.0], [0.5, 1.0, 1.0, 1.0]]), 2, 1, white=1)
    >>> small.tolist()
    [[[nan], [1.0]]]
    """
    if isinstance(picture, (str, bytes)) or hasattr(picture, "__fspath__"):
        picture = read(picture)
    film, out = to_film(picture), ctypes.c_void_p()
    context().check(lib.imp_film_reduce(film.pointer, integer(width, "width"), integer(height, "height"), float(white),
                                        ctypes.byref(out)))
    return from_film(out.value)


def png(picture: Any) -> bytes:
    """The picture as a PNG file in memory."""
    import tempfile  # late: it takes as long to load as the rest of the package
    with tempfile.TemporaryDirectory(prefix="importon") as folder:
        path = os.path.join(folder, "picture.png")
        write(path, picture, standard_error=False)
        with open(path, "rb") as file:
            return file.read()
