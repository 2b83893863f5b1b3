#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Do citations and links lead somewhere?

In code, tests, manual pages and documents:
  - `docs/NAME.md 4.2` and `NAME.md 4.2` cite a document that exists and a numbered heading
    of it; lists (`9.1, 9.2`) and ranges (`2.2 - 2.4`) are followed;
  - any other `NAME.md` is a document that exists;
  - `src/...`, `tests/...` and the like, in comments and documents, are files that exist.
In Markdown also: relative links and pictures exist, and so does the heading after #.
In the README of a room of src/ or cli/ also: `NAME.c`, `NAME.h` and `ROOM/` are in the room.

    tools/check_links.py [FOLDER, default the folder above]
"""
import re
import sys
from pathlib import Path

ROOTS = ("src", "include", "tests", "cli", "bench", "examples", "fuzz", "docs", "man", "tools",
         "scenes", "packaging", "python")
SUFFIXES = {".c", ".h", ".py", ".sh", ".md", ".xml", ".build", ".1", ".3", ".5", ".exact",
            ".txt", ".in"}
# History speaks of files as they were.
HISTORY = ("CHANGELOG.md", "docs/notes/")

SECTION = r"(?:\d+(?:\.\d+)*|A(?:\.\d+)?)"
BREAK = r"(?:[ ]|[ ]*\n[ \t]*(?:\*|#|//|\.\\\")?[ \t]*)"  # a blank, or the end of a comment's line
DOCUMENT = re.compile(r"(?<![\w/.$-])((?:[\w.-]+/)*[\w-]+\.md)\b")
SECTIONS = re.compile(rf"{BREAK}({SECTION}(?:(?:,|[ ]-|[ ]and){BREAK}{SECTION}(?=[).,;:\s]))*)(?![\w%.]*\d)")
FILE = re.compile(r"(?<![\w/.$@{}-])((?:src|include|tests|tools|cli|bench|examples|fuzz|docs|man|"
                  r"scenes|packaging)/[\w./-]*\.(?:c|h|py|sh|xml|png|svg|txt))\b")
LINK = re.compile(r"!?\[[^\]\n]*(?:\n[^\]\n]*)?\]\(([^)\s]+)\)")
BESIDE = re.compile(r"`((?:\w+/)+|(?:\w+/)*\w+\.(?:c|h|js|css|html))`")
HEADING = re.compile(r"^#{1,6}\s+(.*?)\s*#*$", re.M)


def comments(text):
    """C with everything but its comments blanked."""
    kept, at = [], 0
    for m in re.finditer(r"/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\\\n])*\"", text, re.S):
        if m.group(0)[0] == "/":
            kept += [re.sub(r"[^\n]", " ", text[at : m.start()]), m.group(0)]
            at = m.end()
    return "".join(kept) + re.sub(r"[^\n]", " ", text[at:])


def without_code(text):
    """Markdown without its fenced and indented blocks and code spans."""
    text = re.sub(r"^```.*?^```", lambda m: "\n" * m.group(0).count("\n"), text, flags=re.M | re.S)
    text = re.sub(r"^(?: {4}|\t).*$", "", text, flags=re.M)
    return re.sub(r"`[^`\n]*`", "", text)


def headings(text):
    text = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    return [re.sub(r"[`*]", "", h) for h in HEADING.findall(text)]


def anchors(text):
    """As GitHub makes them: lower case, punctuation out, blanks to hyphens, twins numbered."""
    found, seen = set(), {}
    for h in headings(text):
        h = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", h)
        slug = re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-")
        n = seen.get(slug, 0)
        seen[slug] = n + 1
        found.add(f"{slug}-{n}" if n else slug)
    return found


def numbers(text):
    """Sections of a document: `## 4 Title`, `### 4.2 Title`, `## A Tables`."""
    return {m.group(1) for h in headings(text) if (m := re.match(rf"({SECTION})\.?\s", h))}


class Checker:
    def __init__(self, top):
        self.top, self.bad, self.checked, self.texts = top, 0, 0, {}
        self.names = {p.name for p in self.files(only_documents=True)}

    def files(self, only_documents=False):
        found = [p for p in self.top.iterdir() if p.is_file()]
        for root in ROOTS:
            found += (p for p in (self.top / root).rglob("*") if p.is_file())
        for p in sorted(found):
            if p.suffix == ".md" if only_documents else p.suffix in SUFFIXES:
                yield p

    def text(self, path):
        if path not in self.texts:
            self.texts[path] = path.read_text(encoding="utf-8", errors="replace")
        return self.texts[path]

    def complain(self, path, text, at, what):
        self.bad += 1
        print(f"{path.relative_to(self.top)}:{text.count(chr(10), 0, at) + 1}: {what}", file=sys.stderr)

    def find(self, path, name):
        """The document a file speaks of: from the top, beside the file, or in docs/."""
        for base in (self.top, path.parent, self.top / "docs"):
            if (base / name).is_file():
                return base / name
        return None

    def citations(self, path, text):
        for m in DOCUMENT.finditer(text):
            if m.group(1).startswith("share/"):  # where an install puts it
                continue
            self.checked += 1
            target = self.find(path, m.group(1))
            if not target:
                self.complain(path, text, m.start(), f"there is no document {m.group(1)}")
                continue
            cited = SECTIONS.match(text, m.end())
            known = numbers(self.text(target)) if cited else set()
            if not known and target.parent != self.top / "docs":
                continue
            for n in re.findall(SECTION, cited.group(1)) if cited else []:
                if n not in known:
                    self.complain(path, text, m.start(), f"{m.group(1)} has no section {n}")

    def paths(self, path, text):
        for m in FILE.finditer(text):
            if "NAME" in m.group(1):  # of any file
                continue
            self.checked += 1
            if not (self.top / m.group(1)).exists() and not (path.parent / m.group(1)).exists():
                self.complain(path, text, m.start(), f"there is no {m.group(1)}")

    def beside(self, path, text):
        for m in BESIDE.finditer(text):
            self.checked += 1
            if not (self.top / m.group(1)).exists() and not any(path.parent.rglob(m.group(1))):
                self.complain(path, text, m.start(), f"there is no {m.group(1)} in this room")

    def links(self, path, text):
        for m in LINK.finditer(text):
            if re.match(r"[a-z]+:", m.group(1)):
                continue
            self.checked += 1
            name, _, anchor = m.group(1).partition("#")
            target = (path.parent / name).resolve() if name else path
            if not target.exists():
                self.complain(path, text, m.start(), f"link to {m.group(1)}: no such file")
            elif anchor and target.suffix == ".md" and anchor not in anchors(self.text(target)):
                self.complain(path, text, m.start(), f"link to {m.group(1)}: no such heading")

    def run(self):
        me = Path(__file__).resolve()
        for path in self.files():
            name = path.relative_to(self.top).as_posix()
            if path.resolve() == me:
                continue
            text = self.text(path)
            self.citations(path, text)
            if not name.startswith(HISTORY):
                self.paths(path, comments(text) if path.suffix in (".c", ".h") else text)
            if path.suffix == ".md":
                self.links(path, without_code(text))
            if path.name == "README.md" and name.startswith(("src/", "cli/")):
                self.beside(path, text)
        print(f"{self.checked} citations and links, {self.bad} lead nowhere")
        return self.bad


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).resolve().parent.parent)
    sys.exit(1 if Checker(folder.resolve()).run() else 0)
