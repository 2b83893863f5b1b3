# SPDX-License-Identifier: Apache-2.0
"""The notebooks of examples/, run from their first cell to the last: by Jupyter's client where
it is installed, else cell by cell here."""
import contextlib
import io
import json
import os
import re
import time

from tap import SCENES, TOP, needs, run


def run_here(cells):
    space = {"__name__": "__main__"}
    for i, code in enumerate(cells):
        with contextlib.redirect_stdout(io.StringIO()):
            exec(compile(code, "cell %d" % i, "exec"), space)
    return space


def execute(name, *modules):
    needs(*modules) if modules else None
    path = os.path.join(TOP, "examples", name + ".ipynb")
    with open(path, encoding="utf-8") as f:
        notebook = json.load(f)
    cells = ["".join(c["source"]) for c in notebook["cells"] if c["cell_type"] == "code"]
    assert len(cells) >= 4 and not any(c.get("outputs") for c in notebook["cells"])
    if not os.path.exists("scenes"):
        os.symlink(SCENES, "scenes")
    start = time.time()
    try:
        import nbformat
        from nbclient import NotebookClient
    except ImportError:
        run_here(cells)
        return "%.0f s" % (time.time() - start)
    read = nbformat.read(path, 4)
    nbformat.validate(read)
    NotebookClient(read, timeout=600, kernel_name="python3", resources={"metadata": {"path": os.getcwd()}}).execute()
    shown = [k for c in read.cells if c.cell_type == "code" for o in c.outputs for k in o.get("data", {})]
    assert "text/html" in shown, shown
    said = "".join(o.get("text", "") for c in read.cells if c.cell_type == "code" for o in c.outputs if o.output_type == "stream")
    return "%.0f s, by Jupyter" % (time.time() - start) + "".join("; " + re.sub(r"  +", " ", x) for x in said.splitlines()
                                                                       if "importon" in x or "Mitsuba" in x or "desk" in x or "rms" in x or "hold the truth" in x)


def test_red_wall():
    """The red wall"""
    return execute("red_wall")


def test_texture_four_views():
    """A texture from four views"""
    return execute("texture_four_views", "torch")


def test_graded_optic():
    """An optic in a graded medium"""
    return execute("graded_optic")


def test_lamps_for_lux():
    """Lamps for wanted lux"""
    return execute("lamps_for_lux")


def test_office_table():
    """A room, from its file to the norm's table"""
    return execute("office_table")


def test_measured_room():
    """A box from twelve photographs"""
    return execute("measured_room")


def test_object_pose():
    """Where an object stands"""
    return execute("object_pose")


def test_camera_pose():
    """Where a camera was"""
    return execute("camera_pose")


def test_mesh_shape():
    """A mesh from six pictures"""
    return execute("mesh_shape")


def test_lamp_place():
    """Where to put a lamp"""
    return execute("lamp_place")


run(globals())
