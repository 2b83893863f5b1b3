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
from tap import SCENES, TOP, Skip, needs, run

MODULES = sorted(f[:-3] for f in os.listdir(os.path.dirname(importon.__file__))
                 if f.endswith(".py") and f not in ("__init__.py", "_c.py", "_torch_ops.py", "torch.py", "jax.py"))


def examples(module, **more):
    """Run the examples of a module's docstrings; how many there were."""
    tests = doctest.DocTestFinder(exclude_empty=True).find(
        module, globs={"importon": importon, "np": np, **more})
    out = io.StringIO()
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL)
    done = 0
    for test in tests:
        done += runner.run(test, out=out.write).attempted
    assert runner.failures == 0, out.getvalue()[-8000:]
    return done


def beside_scenes():
    for name in ("cornell.xml", "cornell", "bend/rod.xml", "lamps/opal.ldt"):
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


def members(thing, known):
    """Of a class, and of classes that hold a part of it."""
    parts = [c for c in reversed(thing.__mro__) if c is thing or (
        c.__module__.startswith("importon") and c.__name__ not in (*importon.__all__, *known))]
    return {name: value for c in parts for name, value in vars(c).items()}


def public():
    """Everything public with its name: functions, classes, their methods and properties, of the
    package and of its modules."""
    modules = [importon, importon.ad, importon.bend, importon.elements]
    for name in ("torch", "jax"):
        try:
            needs(name)
            modules.append(getattr(importon, name))
        except Skip:
            pass
    for module in modules:
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.ismodule(thing) or not callable(thing):
                continue
            yield "%s.%s" % (module.__name__, name), thing
            if inspect.isclass(thing):
                for method, value in members(thing, module.__all__).items():
                    if not method.startswith("_") and method != "pointer" and (
                            inspect.isfunction(value) or isinstance(value, (classmethod, staticmethod, property))):
                        yield "%s.%s.%s" % (module.__name__, name, method), getattr(thing, method) if not isinstance(
                            value, property) else value


def is_record(thing):
    """What calls return or raise, and users do not make."""
    return inspect.isclass(thing) and (issubclass(thing, (BaseException, tuple)) or thing.__name__ in RETURNED)


RETURNED = {"Check", "Field", "Picture", "Progress", "CheckRow", "Comparison", "ElementsFit", "Estimate", "Fit", "Gradient", "Guide", "Jacobian", "Loss",
            "Design", "Measurement", "Missing", "Optimizer", "Plan", "PlanRow", "Scene", "SceneParameters", "SelfTestRow", "Values"}
UNDERSTOOD = {"self", "cls"}


def sections(doc):
    """Title -> lines of a numpydoc docstring."""
    found, title = {"": []}, ""
    lines = doc.splitlines()
    for i, line in enumerate(lines):
        if i + 1 < len(lines) and re.fullmatch("-{3,}", lines[i + 1]) and len(lines[i + 1]) == len(line):
            title = line
            found[title] = []
        elif not re.fullmatch("-{3,}", line):
            found[title].append(line)
    return found


def test_docstrings():
    """Everything public has a docstring in numpydoc form: its own parameters, what it returns, errors, an example"""
    bad, n = [], 0
    for name, thing in public():
        n += 1
        parts = sections(inspect.getdoc(thing) or "")
        if not "".join(parts[""]).strip():
            bad.append(name + ": no docstring")
            continue
        unknown = set(parts) - {"", "Parameters", "Attributes", "Returns", "Raises", "Examples"}
        if unknown:
            bad.append("%s: sections %s" % (name, unknown))
        if isinstance(thing, property) or is_record(thing):
            continue
        if ">>> " not in "\n".join(parts.get("Examples", [])):
            bad.append(name + ": no example")
        told = {w.lstrip("*") for line in parts.get("Parameters", []) if line and not line.startswith(" ")
                for w in re.split(r", *", line.split(" : ")[0])}
        signature = inspect.signature(thing)
        wanted = {p for p in signature.parameters if p not in UNDERSTOOD and not p.startswith("_")}
        if wanted != told:
            bad.append("%s: parameters %s are told, it has %s" % (name, sorted(told - wanted), sorted(wanted - told)))
        if not inspect.isclass(thing) and "Returns" not in parts and signature.return_annotation not in (
                "None", inspect.Signature.empty, "Any"):
            bad.append("%s: what it returns is not told (%s)" % (name, signature.return_annotation))
    assert not bad, "%d of %d\n" % (len(bad), n) + "\n".join(bad)
    return "%d names" % n


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
    class Alone:  # mpi4py's communicator, of one rank
        rank, size = 0, 1

        def allgather(self, message):
            return [message]

    return "%d snippets%s" % (run_snippets("docs/python.md", {"comm": Alone()}, without),
                              ", without " + " and ".join(without) if without else "")


def test_from_mitsuba():
    """The snippet of docs/from-mitsuba.md finds the red wall"""
    beside_scenes()
    space = {}
    n = run_snippets("docs/from-mitsuba.md", space)
    value = space["fit"]["red.reflectance.value"].value
    assert abs(value[0] - 0.4913) < 0.05 and value[1] < 0.2, value
    return "%d snippet" % n


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
