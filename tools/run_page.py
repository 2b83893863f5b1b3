#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Does a page print what the program prints?

    tools/run_page.py [--update] PAGE...

Each page is worked through in an empty folder that has `scenes` in it, as a reader would:
  - after a line "Save this as `NAME`:" the next fenced block becomes the file NAME;
  - in blocks ```console, lines `$ COMMAND` (continued by a backslash) are run, and what follows is
    compared with what the command prints on both streams. A line `...` stands for any lines,
    and the word ... inside a line for any characters.
BUILD, where it is set, is the build folder whose Python package is used.
--update writes the output into the page where it differs; outputs with `...` are left to the author.
Exit 1: a page differs, or a command fails.
"""
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

BUILD = os.environ.get("BUILD")
ENVIRONMENT = dict(os.environ, PYTHONDONTWRITEBYTECODE="1", **({"PYTHONPATH": BUILD + "/python"} if BUILD else {}))
TOP = Path(__file__).resolve().parent.parent
PART = re.compile(r"Save this as `([\w.-]+)`:\n\n```\w*\n(.*?)^```$|^```console\n(.*?)^```$", re.M | re.S)


def commands(block):
    """(command, output) of a console block."""
    found, continued = [], False
    for line in block.splitlines(keepends=True):
        if continued:
            found[-1][0] += line
        elif line.startswith("$ "):
            found.append([line[2:], ""])
        else:
            found[-1][1] += line
        continued = line.endswith("\\\n") and (continued or line.startswith("$ "))
    return found


def matches(shown, printed):
    lines = [r"(?:.*\n)*?" if line == "...\n" else re.escape(line).replace(r"\.\.\.", ".*")
             for line in shown.splitlines(keepends=True)]
    return re.fullmatch("".join(lines), printed) is not None


def run_page(page, update):
    text, good = page.read_text(encoding="utf-8"), True
    new = text
    with tempfile.TemporaryDirectory() as folder:
        os.symlink(TOP / "scenes", Path(folder) / "scenes")
        for name, content, block in PART.findall(text):
            if name:
                (Path(folder) / name).write_text(content, encoding="utf-8")
                continue
            fresh = ""
            for command, shown in commands(block):
                ran = subprocess.run(["bash", "-c", command], cwd=folder, env=ENVIRONMENT, text=True, stdin=subprocess.DEVNULL,
                                     stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
                printed = re.sub(r"[ \t]+$", "", ran.stdout, flags=re.M)
                same = matches(shown, printed)
                if ran.returncode or not same:
                    good = False
                    print(f"{page.name}: $ {command}exit {ran.returncode}, prints\n{printed}")
                fresh += "$ " + command + (shown if same or ran.returncode or "..." in shown else printed)
            new = new.replace(block, fresh)
    if update and new != text:
        page.write_text(new, encoding="utf-8")
    return good


if __name__ == "__main__":
    pages = [Path(a).resolve() for a in sys.argv[1:] if a != "--update"]
    results = [run_page(page, "--update" in sys.argv) for page in pages]
    sys.exit(0 if pages and all(results) else 1)
