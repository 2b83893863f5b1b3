#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prose of the documents is wrapped at 100 columns.

    tools/check_prose.py [--fix] [FILE...]      default: docs/ and the pages at the top

Tables, code, headings and what cannot be broken (a link, a code span) may be longer. --fix fills
paragraphs and list items that have a longer line.
"""
import re
import sys
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent
WIDTH = 100
ITEM = re.compile(r"^(\s*)([-*+]|\d+\.)(\s+)")
# What cannot begin a line of a paragraph without becoming something else.
OPENS = re.compile(r"^([-*+]|\d+[.)]|#+|>|\||=+|-+|~+|`{3,})$")
# A code span, with what hangs on it, is one word.
WORD = re.compile(r"(?:`[^`]*`|[^\s`])+")


def fill(words, first, rest):
    """Lines of the words; what cannot begin a line stays with the word before it."""
    parts = []
    for word in words:
        if parts and OPENS.match(word):
            parts[-1] += " " + word
        else:
            parts.append(word)
    lines, line = [], first + parts[0]
    for part in parts[1:]:
        if len(line) + 1 + len(part) > WIDTH:
            lines.append(line)
            line = rest + part
        else:
            line += " " + part
    return lines + [line]


def blocks(lines):
    """(is it prose, lines) for each paragraph or list item, and for each line that is neither."""
    block, fence, hang, blank, code = [], "", 0, True, False
    for line in lines:
        bare = line.strip()
        indent = len(line) - len(line.lstrip(" "))
        item = ITEM.match(line)
        mark = re.match(r"```+|~~~+", bare)
        if fence:
            plain = True
            fence = "" if bare.startswith(fence) else fence
        elif mark:
            plain, fence = True, mark.group(0)
        else:
            if bare and indent < hang and not item and blank:
                hang = 0  # the list has ended
            code = bool(bare) and indent >= hang + 4 and (blank or code)
            plain = code or not bare or bare[0] in "|#<!" or bare.startswith("---")
        if (plain or item) and block:
            yield True, block
            block = []
        if plain:
            yield False, [line]
        else:
            hang = len(item.group(0)) if item else hang
            block.append(line)
        blank = not bare
        code = code and not fence
    if block:
        yield True, block


def refill(block):
    item = ITEM.match(block[0])
    first = item.group(0) if item else re.match(r"\s*", block[0]).group(0)
    rest = " " * len(first)
    words = WORD.findall(" ".join([block[0][len(first):]] + [line.strip() for line in block[1:]]))
    return fill(words, first, rest)


def work(path, fix):
    text = path.read_text(encoding="utf-8")
    out, bad, n = [], 0, 0
    for prose, block in blocks(text.split("\n")):
        new = block
        if prose and any(len(line) > WIDTH for line in block):
            new = refill(block)
            if new != block and not fix:
                bad += 1
                print(f"{path.relative_to(TOP)}:{n + 1}: prose beyond {WIDTH} columns (tools/check_prose.py --fix)")
        n += len(block)
        out += new
    if fix and "\n".join(out) != text:
        path.write_text("\n".join(out), encoding="utf-8")
    return bad


def main():
    names = [a for a in sys.argv[1:] if a != "--fix"]
    paths = [Path(a).resolve() for a in names] or sorted((TOP / "docs").rglob("*.md")) + sorted(TOP.glob("*.md"))
    bad = sum(work(path, "--fix" in sys.argv) for path in paths)
    print(f"{len(paths)} documents, {bad} to mend")
    return bad > 0


if __name__ == "__main__":
    sys.exit(main())
