# SPDX-License-Identifier: Apache-2.0
"""What objects show of themselves in notebooks: tables and pictures, plain HTML."""
from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

import numpy as np


def _table(head: Sequence[str], rows: Iterable[Sequence[Any]], caption: str = "") -> str:
    def cells(tag: str, row: Iterable[str]) -> str:
        return "".join("<%s style='text-align:left'>%s</%s>" % (tag, c, tag) for c in row)

    body = "".join("<tr>%s</tr>" % cells("td", [escape(str(c)) for c in row]) for row in rows)
    return "<table>%s<thead><tr>%s</tr></thead><tbody>%s</tbody></table>" % (
        "<caption style='text-align:left'>%s</caption>" % escape(caption) if caption else "",
        cells("th", map(escape, head)), body)


def _image(png: bytes, title: str, width: int) -> str:
    return ("<figure style='display:inline-block;margin:4px'><img style='image-rendering:pixelated' "
            "width='%d' src='data:image/png;base64,%s'><figcaption>%s</figcaption></figure>"
            % (width, base64.b64encode(png).decode(), escape(title)))


def picture(p: Any) -> Any:
    """The picture, and beside it its standard error, eight times as bright."""
    if p.ndim not in (2, 3) or not p.size:
        return None
    from ._picture import png
    width = min(max(p.shape[1], 256), 512)
    title = "%d x %d, %s" % (p.shape[1], p.shape[0], " ".join(p.channels) or "picture")
    if p.spp:
        title += ", %d spp" % p.spp
    if p.dropped:
        title += ", %d walks dropped" % sum(p.dropped.values())
    shown = _image(png(p), title, width)
    if p.se is not None:
        shown += _image(png(8 * np.asarray(p.se)), "standard error x 8, mean %.3g" % np.mean(p.se), width)
    return shown


def scene(s: Any) -> str:
    if s._handle.closed:
        return escape(repr(s))
    rows = [("shapes", "%d (%d triangles)" % (s.n_shapes, s.n_triangles)), ("emitters", s.n_emitters),
            ("bsdfs", s.n_bsdfs), ("textures", s.n_textures),
            ("integrator", s.integrator + (", max_depth %d" % s.max_depth if s.max_depth >= 0 else "")),
            ("bounds", "%s to %s" % tuple("(%g, %g, %g)" % c for c in s.bounds))]
    rows += [("sensor %d" % i, "%s (%s), %d x %d, %d sample%s per pixel, %s filter of radius %g" % (
        c.name, c.type, c.width, c.height, c.spp, "s" * (c.spp != 1), c.filter, c.filter_radius)) for i, c in enumerate(s.sensors)]
    return _table(("scene", s.mode), rows, s.name)


def parameters(p: Any) -> str:
    return _table(("name", "value", "bounds", "unit", "gradient"), [
        (i.name, p._value_text(i.name), "[%g, %g]" % (i.lo, i.hi), i.unit,
         ("yes" if i.differentiable else "no") + (", moves edges" if i.discontinuous else "")
         + (": " + i.why if i.why else "")) for i in map(p.info, p)])


def gradient(e: Any) -> str:
    rows = []
    for name, g in e.grad.items():
        flat, se = np.ravel(g), np.ravel(e.grad_se[name])
        if flat.size > 12:
            rows.append((name, "%d numbers in %.4g .. %.4g" % (flat.size, flat.min(), flat.max()), "%.2g" % se.mean()))
        else:
            rows += [("%s[%d]" % (name, k) if flat.size > 1 else name, "%.6g" % flat[k], "%.2g" % se[k])
                     for k in range(flat.size)]
    return _table(("d / d parameter", "value", "+-"), rows, "loss " + repr(e))


def _curve(y: Any, width: int = 320, height: int = 120) -> str:
    """A loss curve, logarithmic where it can be, as SVG."""
    y = np.asarray(y, dtype=float)
    y = y[np.isfinite(y)]
    if y.size < 2:
        return ""
    logarithmic = bool(np.all(y > 0))
    v = np.log10(y) if logarithmic else y
    lo, hi = v.min(), v.max()
    t = (v - lo) / (hi - lo if hi > lo else 1)
    points = " ".join("%.1f,%.1f" % (4 + (width - 8) * k / (len(t) - 1), height - 4 - (height - 8) * u)
                      for k, u in enumerate(t))
    return ("<figure style='margin:4px'><svg width='%d' height='%d' style='background:#fff;border:1px solid #bbb'>"
            "<polyline fill='none' stroke='#1f4e9c' stroke-width='1.5' points='%s'/></svg><figcaption>loss, %d "
            "iterations: %.3g to %.3g%s</figcaption></figure>"
            % (width, height, points, y.size, y[0], y[-1], " (logarithmic)" if logarithmic else ""))


def fit(f: Any) -> str:
    rows = []
    for name, v in f.items():
        flat = [np.ravel(x) for x in (v.start, v.value, v.se, *v.interval)]
        n = flat[0].size
        if n > 12:
            rows.append((name, "", "%d numbers in %.4g .. %.4g" % (n, flat[1].min(), flat[1].max()), "", ""))
            continue
        for k in range(n):
            s, x, se, lo, hi = (c[k] for c in flat)
            rows.append(("%s[%d]" % (name, k) if n > 1 else name, "%.6g" % s, "%.6g" % x, "%.2g" % se,
                         "[%.6g, %.6g]" % (lo, hi)))
    said = "%d iterations, loss %.4g +- %.2g: %s" % (f.iterations, f.loss, f.loss_se, f.reason)
    if np.isfinite(f.chi2):
        said += "; chi-square per degree of freedom %.3g +- %.2g" % (f.chi2, f.chi2_se)
    shown = _table(("parameter", "start", "value", "+-", "95 % interval"), rows, said)
    if f.warning:
        shown += "<p>warning: %s</p>" % escape(f.warning)
    return shown + _curve(f.history)


def check(c: Any) -> str:
    rows = list(c)
    selftest = bool(rows) and hasattr(rows[0], "contract")
    names = ("object", "kind", "contract") if selftest else ("method", "param")
    return _table([*names, "value", "reference", "+-", "error", "verdict"], [
        [getattr(r, n) for n in names] + ["%.6g" % r.value, "%.6g" % r.reference, "%.2g" % r.se, "%.2g" % r.error, r.verdict]
        for r in rows], "%s: %s" % ("self-test" if selftest else "check",
                                    "ok" if c.ok else "%d rows FAIL" % len(c.failed)))
