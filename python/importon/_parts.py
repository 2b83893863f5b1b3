# SPDX-License-Identifier: Apache-2.0
"""Many machines: parts of a run that merge to the bits of one run, and teams of processes."""
from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, Optional, Union

from . import _c
from ._context import Context, Handle, own_context
from ._errors import ArgumentError, Part
from ._library import decode, integer, lib, make, text


class PartsInfo(NamedTuple):
    """What parts are there.

    Attributes
    ----------
    n : int
        Parts that are there.
    missing : int
        Holes between them; 0: they are a whole.
    holes : str
        Which: "2/4, 4/4".
    command : str
        What they are parts of.
    """

    n: int
    missing: int
    holes: str
    command: str


def _command(function: Any) -> str:
    """What the parts are parts of: the function's name. That scene, parameters, targets, seed and
    samples are the same is checked by the library."""
    while isinstance(function, functools.partial):
        function = function.func
    return "python %s" % getattr(function, "__qualname__", type(function).__qualname__)


def part(function: Callable[..., Any], index: int, count: int, *arguments: Any, path: Any = None,
         **keywords: Any) -> Union[bytes, str]:
    """Part `index` of `count` of what a function computes, to be merged by `merge`.

    It is a plain function of plain arguments, so `concurrent.futures`, Dask and Ray can map it over
    processes and machines.

    Parameters
    ----------
    function : callable
        Loads its scene, and ends with one call of `render`, `render_forward`,
        `render_backward`, `functional`, `jacobian`, `loss` or `plan`, of which the part is computed.
        Fits and checks choose what to compute by what they found, so they have no parts.
    index, count : int
        From 1: parts 1 to `count` make a whole. Parts of different cuts go together where
        their borders meet (1/2, 3/4, 4/4).
    *arguments, **keywords
        Of the function.
    path : path, optional
        Write the part to this file, which appears whole or not at all.

    Returns
    -------
    bytes or str
        The part, or its path.

    Raises
    ------
    ArgumentError
        The index is outside 1 .. count, or the function computed nothing that has parts.

    Examples
    --------
    >>> def picture(res):
    ...     return importon.render(importon.load_dict(importon.cornell_box(res=res)), spp=16, seed=3)
    >>> parts = [importon.part(picture, i, 3, 8) for i in (1, 2, 3)]
    >>> whole = importon.merge(picture, parts, 8)
    >>> np.array_equal(whole, picture(8)), np.array_equal(whole.se, picture(8).se)
    (True, True)
    """
    index, count = integer(index, "index"), integer(count, "count")
    with own_context() as ctx:
        out = ctypes.c_void_p()
        ctx.check(lib.imp_parts_create(ctx.pointer, index, count, text(_command(function), "function"), ctypes.byref(out)))
        parts = Handle(out.value or 0, lib.imp_parts_destroy)
        with _joined(ctx, parts):
            try:
                function(*arguments, **keywords)
            except Part:
                pass
            else:
                raise ArgumentError("function: %s computed nothing that has parts" % _command(function)[7:])
        return _written(ctx, parts, path)


@contextlib.contextmanager
def _joined(ctx: Context, parts: Handle) -> Iterator[None]:
    ctx.check(lib.imp_context_set_parts(ctx.pointer, parts.pointer))
    try:
        yield
    finally:
        lib.imp_context_set_parts(ctx.pointer, None)


def _written(ctx: Context, parts: Handle, path: Any) -> Union[bytes, str]:
    if path is not None:
        ctx.check(lib.imp_parts_write(parts.pointer, text(path, "path")))
        return str(os.fspath(path))
    with tempfile.TemporaryDirectory(prefix="importon") as folder:
        file = os.path.join(folder, "part")
        ctx.check(lib.imp_parts_write(parts.pointer, text(file, "path")))
        with open(file, "rb") as f:
            return f.read()


@contextlib.contextmanager
def _read(ctx: Context, parts: Sequence[Any]) -> Iterator[Handle]:
    if isinstance(parts, (str, bytes)) or hasattr(parts, "__fspath__"):
        parts = [parts]
    with tempfile.TemporaryDirectory(prefix="importon") as folder:
        paths = []
        for i, p in enumerate(parts):
            if isinstance(p, bytes):
                paths.append(os.path.join(folder, "part%d" % i))
                with open(paths[-1], "wb") as f:
                    f.write(p)
            else:
                paths.append(p)
        names = (ctypes.c_char_p * max(len(paths), 1))(*[text(p, "parts") for p in paths])
        out = ctypes.c_void_p()
        ctx.check(lib.imp_parts_read(ctx.pointer, names, len(paths), ctypes.byref(out)))
    yield Handle(out.value or 0, lib.imp_parts_destroy)


def _info(ctx: Context, parts: Handle) -> PartsInfo:
    i = make(_c.imp_parts_info)
    ctx.check(lib.imp_parts_get_info(parts.pointer, ctypes.byref(i)))
    return PartsInfo(i.n, i.missing, decode(i.holes), decode(i.command))


def merge(function: Callable[..., Any], parts: Sequence[Any], *arguments: Any, **keywords: Any) -> Any:
    """What a function returns, from its parts: the bits of one run, without its walks.

    Parameters
    ----------
    function : callable
        That of `part`.
    parts : sequence of bytes or path
        What `part` returned, in any order.
    *arguments, **keywords
        Of the function, as in `part`.

    Returns
    -------
    object
        The function's result.

    Raises
    ------
    ArgumentError
        Parts are missing (the message says which), overlap, or do not belong together: of
        another function, scene, target, number of samples, version or kind of processor.
    FileError
        A part is damaged.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> def gradient():
    ...     scene = importon.load_dict(importon.cornell_box(res=8))
    ...     return importon.functional(scene, "red.*", spp=16)
    >>> with ThreadPoolExecutor() as pool:
    ...     parts = list(pool.map(lambda i: importon.part(gradient, i, 4), range(1, 5)))
    >>> importon.merge(gradient, parts).value == gradient().value
    True
    """
    with own_context() as ctx, _read(ctx, parts) as read:
        info = _info(ctx, read)
        if info.command != _command(function):
            raise ArgumentError("parts: these are parts of '%s', not of '%s'" % (info.command, _command(function)))
        with _joined(ctx, read):
            return function(*arguments, **keywords)


def join_parts(parts: Sequence[Any], path: Any = None) -> Union[bytes, str]:
    """Several parts as one, to be merged with the others later.

    Parameters
    ----------
    parts : sequence of bytes or path
    path : path, optional
        Write them to this file.

    Returns
    -------
    bytes or str
        As `part`.

    Raises
    ------
    ArgumentError
        They overlap, or do not belong together.

    Examples
    --------
    >>> def picture():
    ...     return importon.render(importon.load_dict(importon.cornell_box(res=8)), spp=8)
    >>> half = importon.join_parts([importon.part(picture, i, 4) for i in (1, 2)])
    >>> importon.parts_info([half]).holes
    '3/4 to 4/4'
    """
    with own_context() as ctx, _read(ctx, parts) as read:
        return _written(ctx, read, path)


def parts_info(parts: Sequence[Any]) -> PartsInfo:
    """Which parts there are, and which are missing.

    Parameters
    ----------
    parts : sequence of bytes or path

    Returns
    -------
    PartsInfo

    Raises
    ------
    ArgumentError
        They overlap, or do not belong together.

    Examples
    --------
    >>> def picture():
    ...     return importon.render(importon.load_dict(importon.cornell_box(res=8)), spp=8)
    >>> importon.parts_info([importon.part(picture, 1, 2)]).missing
    1
    """
    with own_context() as ctx, _read(ctx, parts) as read:
        return _info(ctx, read)


# ---- Teams -------------------------------------------------------------------------

_RECEIVE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p, ctypes.c_size_t)
_GATHER = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
_ALL_TAKEN = 2**40  # beyond the items of any run: nothing is left for this rank
_NEXT = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_uint64, ctypes.c_void_p)


@contextlib.contextmanager
def team(rank: int, ranks: int, gather: Callable[[bytes], Sequence[bytes]],
         next: Optional[Callable[[int], int]] = None, broadcast: bool = False) -> Iterator[None]:
    """In this block, calls on scenes that are loaded in it are shared by a team of processes.

    Each rank makes the same calls in the same order with the same arguments, computes a share of
    the walks, and gets the whole result, with the bits that one process gives. Fits and checks
    work, too.

    Parameters
    ----------
    rank, ranks : int
        This process, of how many.
    gather : callable
        Takes this rank's message (bytes) and returns those of all ranks in their order, its own
        too: `allgather` of mpi4py's communicators.
    next : callable, optional
        Takes the number of a round and returns the next of 0, 1, 2, ...: each number goes to one
        rank. None: ranks have equal shares.
    broadcast : bool
        Rank 0 reads files and gives their bytes to all; else each rank reads them.

    Returns
    -------
    context manager

    Raises
    ------
    ArgumentError
        A rank runs another version, or on another kind of processor.

    Examples
    --------
    >>> with importon.team(0, 1, lambda message: [message]):
    ...     scene = importon.load_dict(importon.cornell_box(res=8))
    ...     picture = importon.render(scene, spp=4)
    >>> picture.shape
    (8, 8, 3)
    """
    failed: list[BaseException] = []

    def gathered(message: Any, n: int, receive: Any, receiver: Any, payload: Any) -> int:
        if failed:
            return int(_c.IMP_CANCELLED)
        try:
            everybody = list(gather(ctypes.string_at(message, n) if n else b""))
            if len(everybody) != ranks:
                raise ArgumentError("gather returned %d messages for %d ranks" % (len(everybody), ranks))
            give = _RECEIVE(receive)
            for i, m in enumerate(everybody):
                data = bytes(m)
                give(receiver, i, ctypes.cast(ctypes.c_char_p(data), ctypes.c_void_p), len(data))
            return int(_c.IMP_OK)
        except BaseException as error:
            failed.append(error)
            return int(_c.IMP_CANCELLED)

    def numbered(round: int, payload: Any) -> int:
        try:
            assert next is not None
            return integer(next(round), "next", 0, _ALL_TAKEN)
        except BaseException as error:
            failed.append(error)
            return _ALL_TAKEN

    with own_context() as ctx:
        kept = _GATHER(gathered), _NEXT(numbered)
        t = make(_c.imp_team, rank=integer(rank, "rank"), ranks=integer(ranks, "ranks"), broadcast=bool(broadcast),
                 gather=ctypes.cast(kept[0], ctypes.c_void_p),
                 next=ctypes.cast(kept[1], ctypes.c_void_p) if next is not None else None)

        def check(status: int) -> None:
            if failed:
                raise failed[0]
            ctx.check(status)

        check(lib.imp_context_set_team(ctx.pointer, ctypes.byref(t)))
        try:
            yield
        except Exception:
            if failed:
                raise failed[0] from None
            raise
        finally:
            lib.imp_context_set_team(ctx.pointer, None)
        check(_c.IMP_OK)
