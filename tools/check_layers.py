#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Rooms are above each other: arrows of includes and of calls run down only.

    tools/check_layers.py [LIBRARY.a]

A file includes files of its own room and of rooms below, so no two rooms need each other; the
rooms inside a room are in order, too. With the static library, calls are checked as well:
what an object file refers to is defined in its own room or below. Commands include the public
headers alone, and one file includes Embree."""
import os
import pathlib
import re
import subprocess
import sys

# From the ground up.
ROOMS = "base math color kind scene move search bend elements walk film inverse format render report"
INSIDE = {
    "src/walk": "core media graded path bundle lights both moved kept rules run",
    "src/inverse": "problem estimate gradient gauss fit plan measure check design rooms luminaires",
    "cli": "text shared bend elements fit plan measure view read design commands",
}
EMBREE = "src/scene/intersector.h"
# Files of src/walk whose arrows still run up; each goes.
UP_FOR_NOW = "light light_reach light_start light_walk".split()


def floors():
    """{folder: (floor of the room, floor inside it)}"""
    found = {}
    for i, room in enumerate(ROOMS.split()):
        found["src/" + room] = (i, 0)
    for room, inside in INSIDE.items():
        for k, sub in enumerate(inside.split()):
            found[f"{room}/{sub}"] = (*found.get(room, (0, 0))[:1], k + 1)
    return found


FLOORS = floors()


def place(path):
    """Floor of a file: of the deepest folder that has one."""
    for folder in path.parents:
        if str(folder) in FLOORS:
            return FLOORS[str(folder)]
    return None


def runs_up(path, other):
    for_now = path.parts[1] == "walk" and path.stem in UP_FOR_NOW
    return place(other) > place(path) and not (for_now and other.parts[1] == "walk")


def check_folders(complain):
    for folder in pathlib.Path("src").iterdir():
        if folder.is_dir() and str(folder) not in FLOORS:
            complain(f"{folder}/: add it to ROOMS of {sys.argv[0]}")
    for room, inside in INSIDE.items():
        for folder in pathlib.Path(room).iterdir():
            if folder.is_dir() and folder.name not in inside.split():
                complain(f"{folder}/: add it to INSIDE of {sys.argv[0]}")
            if folder.suffix in (".c", ".h") and folder.name != "main.c":
                complain(f"{folder}: belongs into a folder of {room}/: {inside}")


def check_includes(complain):
    for path in sorted(p for top in ("src", "cli") for p in pathlib.Path(top).rglob("*.[ch]")):
        for include in re.findall(r'^#include "([^"]+)"', path.read_text(), re.M):
            top = pathlib.Path("cli" if path.parts[0] == "cli" else "src")
            other = path.parent / include if "/" not in include else top / include
            if path.parts[0] == "cli" and not other.exists():
                complain(f"{path}: {include}: commands use include/importon only")
            elif place(other) and place(path) and runs_up(path, other):
                complain(f"{path}: {include} runs up")
        if str(path) != EMBREE and re.search(r"^#include <embree", path.read_text(), re.M):
            complain(f"{path}: includes Embree")


def check_calls(library, complain):
    # Meson names an object after its path: src_ROOM_FILE.c.o, '/' written as '_'.
    source = {str(p).replace("/", "_"): p for p in pathlib.Path("src").rglob("*.c")}
    home, uses = {}, set()
    symbols = subprocess.run(["nm", "-A", "-g", library], capture_output=True, text=True)
    for line in symbols.stdout.splitlines():
        found = re.match(r"\S*?(src_\S+\.c)\.o:\S*\s+(\w) (\S+)$", line)
        if not found:
            continue
        path = source.get(found[1])
        if path is None:  # generated
            continue
        if found[2] == "U":
            uses.add((path, found[3]))
        else:
            home[found[3]] = path
    for path, symbol in sorted(uses):
        if symbol in home and runs_up(path, home[symbol]):
            complain(f"{path}: refers to {symbol} of {home[symbol]}, which runs up")
    if len(home) < 500:
        complain("too few symbols: is this the static library?")


def main():
    bad = []
    library = [pathlib.Path(a).resolve() for a in sys.argv[1:2]]
    os.chdir(pathlib.Path(__file__).resolve().parent.parent)
    check_folders(bad.append)
    check_includes(bad.append)
    if library:
        check_calls(library[0], bad.append)
    for line in bad:
        print(line, file=sys.stderr)
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main())
