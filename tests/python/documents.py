# SPDX-License-Identifier: Apache-2.0
"""Docstrings: every public name has one in numpydoc form with a running example; every
snippet of the documentation runs."""
import contextlib
import doctest
import inspect
import io
import os
import re
import shutil
import warnings

import importon
import numpy as np
from tap import SCENES, TOP, Skip, needs, raises, run

MODULES = ["_array", "_dictionary", "_fit", "_library", "_params", "_picture", "_progress", "_render", "_scene",
           "_transform", "ad", "bend", "elements"]


def examples(module, **more):
    """Run the examples of a module's docstrings; how many there were."""
    tests = doctest.DocTestFinder(exclude_empty=True).find(
        module, globs={"importon": importon, "np": np, **more})
    out = io.StringIO()
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL)
    done = 0
    for test in tests:
        done += runner.run(test, out=out.write).attempted
    assert runner.failures == 0, out.getvalue()[-3000:]
    return done


def beside_scenes():
    for name in ("cornell.xml", "cornell", "bend/rod.xml"):
        source = os.path.join(SCENES, name)
        target = os.path.basename(name)
        if not os.path.exists(target):
            (shutil.copytree if os.path.isdir(source) else shutil.copy)(source, target)


def test_examples():
    """All examples of the docstrings"""
    import importlib
    beside_scenes()
    n = examples(importon)
    for name in MODULES:
        n += examples(importlib.import_module("importon." + name))
    assert n > 80
    return "%d lines" % n


def test_torch_examples():
    """Those of importon.torch"""
    torch = needs("torch")
    return "%d lines" % examples(importon.torch, torch=torch)


def test_jax_examples():
    """Those of importon.jax"""
    jax = needs("jax")
    import jax.numpy as jnp
    return "%d lines" % examples(importon.jax, jax=jax, jnp=jnp)


def test_docstrings():
    """Every public function has parameters, returns and an example, and they are its own"""
    bad = []
    for name in importon.__all__:
        if name in ("jax", "torch", "__version__", "ad", "bend", "elements"):
            continue
        thing = getattr(importon, name)
        doc = inspect.getdoc(thing) or ""
        if not doc:
            bad.append(name + ": no docstring")
        if not inspect.isfunction(thing) or name in ("Color3f", "threads", "variant", "library_path"):
            continue
        for section in ("Parameters", "Examples"):
            if section + "\n---" not in doc:
                bad.append("%s: no %s" % (name, section))
        told = set(re.findall(r"^(?:\*{0,2})(\w+)(?:, (?:\*{0,2}\w+))* :|^((?:\*{0,2}\w+, )*\*{0,2}\w+)$", doc, re.M) and
                   re.findall(r"\w+", " ".join(line.split(":")[0] for line in doc.split("Parameters\n")[1].split("\n\n")[0].splitlines()
                                               if line and not line.startswith(" "))))
        for p in inspect.signature(thing).parameters:
            if p not in told:
                bad.append("%s: %s is not told" % (name, p))
    assert not bad, bad


def snippets(path):
    """Python blocks of a document, in order."""
    with open(os.path.join(TOP, path), encoding="utf-8") as f:
        return re.findall(r"```python\n(.*?)```", f.read(), re.S)


def run_snippets(path, space, without=()):
    blocks = snippets(path)
    assert blocks, path
    done = 0
    for code in blocks:
        if any("import " + w in code or w + "." in code for w in without):
            continue
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore", importon.ImportonWarning)
            exec(compile(code, path, "exec"), space)
        done += 1
    return done


def test_tour():
    """Every snippet of docs/python.md, one after the other"""
    beside_scenes()
    without = []
    for module in ("torch", "jax"):
        try:
            needs(module)
        except Skip:
            without.append(module)
    return "%d snippets%s" % (run_snippets("docs/python.md", {}, without),
                              ", without " + " and ".join(without) if without else "")


def test_readme():
    """The README's lines of Python"""
    shutil.rmtree("cornell", ignore_errors=True)
    beside_scenes()
    with open("cornell.xml") as f:
        small = f.read().replace('name="res" value="256"', 'name="res" value="32"')
    with open("cornell.xml", "w") as f:
        f.write(small)
    importon.render(importon.load_file("cornell.xml"), spp=16, seed=1).write("target.exr")
    assert run_snippets("README.md", {}) == 1


run(globals())
