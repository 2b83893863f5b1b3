# SPDX-License-Identifier: Apache-2.0
"""Tests in Python: functions test_* of a program, each one line of TAP."""
import inspect
import os
import sys
import tempfile
import time
import traceback

import numpy as np

TOP = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
SCENES = os.path.join(TOP, "scenes")


class Skip(Exception):
    """This cannot be tested here."""


def needs(*modules):
    """The modules, or Skip with the first that is not there."""
    import importlib
    found = []
    for name in modules:
        try:
            found.append(importlib.import_module(name))
        except ImportError:
            raise Skip("no module " + name) from None
    return found[0] if len(found) == 1 else found


def raises(error, call, *words):
    """`call` raises `error`, and the message has all the words."""
    try:
        call()
    except error as e:
        for word in words:
            assert word in str(e), "'%s' is not in: %s" % (word, e)
        return e
    raise AssertionError("no %s" % getattr(error, "__name__", error))


def z(value, truth, se, limit=4.5, most_se=None, what=""):
    """|value - truth| <= limit standard errors, everywhere (1 in 150,000 by chance), and the
    error is no larger than most_se."""
    value, truth, se = (np.asarray(x, float) for x in (value, truth, se))
    assert np.all(np.isfinite(value)) and np.all(np.isfinite(se)), "not finite %s" % what
    if most_se is not None:
        assert np.all(se <= most_se), "%s: se %g is more than %g" % (what, se.max(), most_se)
    worst = np.max(np.abs(value - truth) / np.where(se > 0, se, np.inf)) if np.any(se > 0) else 0
    assert np.all(np.abs(value - truth)[se == 0] == 0), "%s: no error, and another number" % what
    assert worst <= limit, "%s: z = %g" % (what, worst)
    return worst


def spread(errors, values, limit=4.5, most=.5):
    """Do repeats [n] spread as their standard errors [n] say? The ratio of mean se^2 and the
    variance, within `limit` of its own errors, which are no larger than `most`: (kurtosis - 1) / n
    of the variance, and the spread of se^2."""
    square, values = np.asarray(errors, float)**2, np.asarray(values, float)
    n, d = len(values), values - values.mean()
    variance = np.sum(d**2) / (n - 1)
    kurtosis = np.mean(d**4) / np.mean(d**2)**2
    ratio = square.mean() / variance
    se = np.sqrt((kurtosis - 1) / n + square.var() / square.mean()**2 / n)
    assert se <= most / limit, "the ratio is known to %.2g only" % se
    assert abs(np.log(ratio)) <= limit * se, "reported / seen variance %.3f +- %.2f" % (ratio, se * ratio)
    return "reported / seen variance %.3f +- %.3f" % (ratio, se * ratio)


def run(namespace):
    """Run the tests of a program, in order of their lines; in a scratch folder."""
    tests = [(n, f) for n, f in namespace.items() if n.startswith("test_") and inspect.isfunction(f)]
    wanted = sys.argv[1:]
    failed = 0
    print("1..%d" % len(tests))
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for i, (name, f) in enumerate(tests, 1):
            if wanted and name not in wanted:
                continue
            start, bad, note = time.time(), "", ""
            try:
                said = f()
                note = " # %s" % said if said else ""
            except Skip as reason:
                note = " # SKIP %s" % reason
            except BaseException:
                bad = "not "
                failed += 1
                note = "\n" + "".join("# " + x for x in traceback.format_exc().splitlines(True)[-60:]).rstrip()
            title = (f.__doc__ or name[5:]).strip().split("\n")[0].rstrip(".")
            took = "" if note.startswith(" # SKIP") else " # %.1f s" % (time.time() - start)
            print("%sok %d - %s%s%s" % (bad, i, title, note, took if not note else ""), flush=True)
        os.chdir(TOP)
    sys.exit(failed > 0)
