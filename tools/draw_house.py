#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The drawing of docs/architecture.md, from the sources, and what keeps that page true.

    tools/draw_house.py | dot -Tsvg >docs/images/house.svg     # Graphviz draws it
    tools/draw_house.py --write      # docs/images/house.dot, and house.svg if dot is there
    tools/draw_house.py --check      # is docs/images/house.dot current, and the page true?

A box is a room: a folder of src/, or one of the places around it. It holds the title of the
room's README.md, its inner rooms, and the steps of the page's "life of one gradient" that
run there. An arrow A -> B: files of A include files of B. Arrows that follow from others are
left out. --check also finds functions that the page and the rooms' pages name where they
are not, files that they name and that do not exist, rooms without a page, and pages of more
than 30 lines."""
import pathlib
import re
import shutil
import subprocess
import sys

TOP = pathlib.Path(__file__).resolve().parent.parent
PAGE = "docs/architecture.md"
DOT = "docs/images/house.dot"
AROUND = {"cli": "the command `importon`", "python": "the Python package",
          "include/importon": "what hosts and authors of kinds include"}


def source_rooms():
    return sorted(p.parent.name for p in (TOP / "src").glob("*/meson.build"))


def files_of(room):
    return sorted(p for p in (TOP / room).rglob("*") if p.suffix in (".c", ".h"))


def title_of(room):
    page = TOP / room / "README.md"
    if not page.exists():
        return AROUND.get(room, "")
    first = page.read_text().splitlines()[0]
    return first.partition(":")[2].strip() or AROUND.get(room, "")


def inner_rooms(room):
    """Folders of a room in the order of the table in its page, else by name."""
    folders = {p.name for p in (TOP / room).iterdir() if p.is_dir() and files_of(str(p))}
    page = TOP / room / "README.md"
    named = re.findall(r"^\| `(\w+)/?`", page.read_text(), re.M) if page.exists() else []
    return [n for n in named if n in folders] + sorted(folders - set(named))


def public_functions():
    text = "".join(p.read_text() for p in (TOP / "include/importon").glob("*.h"))
    return set(re.findall(r"\b(imp_\w+)\(", text))


def arrows():
    """{room: rooms whose files it includes}; of the headers: rooms that hold their functions."""
    rooms = source_rooms()
    found = {"src/" + r: set() for r in rooms}
    public = public_functions()
    found["include/importon"] = set()
    for room in rooms:
        for path in files_of("src/" + room):
            text = path.read_text()
            for other in re.findall(r'^#include "(\w+)/', text, re.M):
                if other in rooms and other != room:
                    found["src/" + room].add("src/" + other)
            defined = re.findall(r"^(?:\w[\w ]*[ *])(imp_[a-z]\w+)\((?:.*[^;])?$", text, re.M)
            if public & set(defined):
                found["include/importon"].add("src/" + room)
    found["cli"] = {"include/importon"}
    found["python"] = {"include/importon"}
    return found


def reduced(graph):
    """Without arrows that follow from others."""
    def reach(a, seen):
        for b in graph.get(a, ()):
            if b not in seen:
                seen.add(b)
                reach(b, seen)
        return seen

    return {a: {b for b in to if not any(b in reach(c, set()) for c in to if c != b)}
            for a, to in graph.items()}


def steps():
    """[(number, function, file)] of the page's table."""
    return re.findall(r"^\| (\d+) \|.*\| `(\w+)` \| `([\w/.]+)` \|$",
                      (TOP / PAGE).read_text(), re.M)


def room_of(path):
    parts = path.split("/")
    return "/".join(parts[:2]) if parts[0] in ("src", "include") else parts[0]


def dot():
    graph = arrows()
    numbers = {}
    for number, _, path in steps():
        numbers.setdefault(room_of(path), []).append(number)
    out = ["// Made by tools/draw_house.py.", "digraph house {",
           '  graph [rankdir=TB, nodesep=.25, ranksep=.4, bgcolor="white"];',
           '  node [shape=box, style="rounded,filled", fillcolor="#f6f3ec", color="#8a8072", '
           'fontname="Helvetica", fontsize=11];', '  edge [color="#8a8072", arrowsize=.7];']
    for room in graph:
        name = room.removeprefix("src/")
        lines = [f"<b>{name}</b>"]
        if title_of(room):
            lines.append(f'<font point-size="9">{wrap(title_of(room))}</font>')
        if room.startswith("src/") or room == "cli":
            inner = inner_rooms(room)
            if inner:
                inside = wrap(" · ".join(inner), 38)
                lines.append(f'<font point-size="8" color="#6a6050"><i>{inside}</i></font>')
        if room in numbers:
            marks = " ".join(numbers[room])
            lines.append(f'<font point-size="9" color="#a03020">gradient: {marks}</font>')
        out.append(f'  "{name}" [label=<{"<br/>".join(lines)}>];')
    for room, to in reduced(graph).items():
        for other in sorted(to):
            out.append(f'  "{room.removeprefix("src/")}" -> "{other.removeprefix("src/")}";')
    return "\n".join(out + ["}"]) + "\n"


def wrap(text, width=30):
    text = text.replace("`", "").replace("&", "&amp;").replace("<", "&lt;")
    lines, line = [], ""
    for word in text.split():
        if line and len(line) + len(word) + 1 > width:
            lines.append(line)
            line = word
        else:
            line = f"{line} {word}".strip()
    return "<br/>".join(lines + [line])


def defines(path, function):
    text = (TOP / path).read_text()
    return re.search(rf"^[\w][^;{{}}=]*\b{function}\(", text, re.M) is not None


def check():
    bad = []
    if (TOP / DOT).read_text() != dot():
        bad.append(f"{DOT} is not current: tools/draw_house.py --write")
    if len(steps()) < 10:
        bad.append(f"{PAGE}: the steps of a gradient are not found")
    pages = [TOP / PAGE] + [TOP / r / "README.md" for r in arrows()
                            if r.startswith("src/") or r == "cli"]
    for page in pages:
        name = page.relative_to(TOP)
        if not page.exists():
            bad.append(f"{name}: this room has no page")
            continue
        text, most = page.read_text(), 120 if str(name) == PAGE else 30
        if text.count("\n") > most:
            bad.append(f"{name}: more than {most} lines")
        for function, path in re.findall(r"`(\w+)` \| `([\w/.]+\.[ch])`", text):
            full = path if (TOP / path).exists() else str(name.parent / path)
            if not (TOP / full).exists():
                bad.append(f"{name}: there is no {path}")
            elif not defines(full, function):
                bad.append(f"{name}: {function} is not defined in {path}")
        for path in re.findall(r"`((?:\w+/)*\w+\.(?:c|h|py|sh))`", text):
            if not (TOP / path).exists() and not (page.parent / path).exists() and not any(
                    page.parent.rglob(path.split("/")[-1])):
                bad.append(f"{name}: there is no {path}")
    for line in bad:
        print(line, file=sys.stderr)
    return bool(bad)


def main():
    if sys.argv[1:] == ["--check"]:
        return check()
    if sys.argv[1:] == ["--write"]:
        (TOP / DOT).write_text(dot())
        if shutil.which("dot"):
            svg = (TOP / DOT).with_suffix(".svg")
            subprocess.run(["dot", "-Tsvg", TOP / DOT, "-o", svg], check=True)
        return 0
    if sys.argv[1:]:
        sys.exit(__doc__)
    print(dot(), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
