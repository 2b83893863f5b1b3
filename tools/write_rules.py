#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The page on what goes with what, from the table that decides (src/walk/rules/).

    tools/write_rules.py            prints the page
    tools/write_rules.py --write    writes docs/what-goes-with-what.md
    tools/write_rules.py --check    fails if that page is another one"""
import pathlib
import re
import sys
import textwrap

PAGE = pathlib.Path("docs/what-goes-with-what.md")
HEAD = """# What goes with what

For everybody who reads a refusal, or plans a run. Each line is a rule: jobs that have the first
feature (and the second, where two are named) may not have the last one, or need it. The sentence is
the message that the library gives, with names in place of the braces. One table decides, and this
page is made from it by `tools/write_rules.py --write`.
"""


def features():
    text = pathlib.Path("src/walk/rules/features.h").read_text().replace("\\\n", "\n")
    return dict(re.findall(r'X\((\w+),\s*"([^"]*)"\)', text))


def rules():
    text = pathlib.Path("src/walk/rules/rules.def").read_text()
    heads = [(m.start(), m.group(1)) for m in re.finditer(r"/\* ---- (.*?) ---- \*/", text)]
    found = re.finditer(r'RULE\((\w+), (\w+), (\w+), (\w+), (\w+),\s*((?:"[^"]*"\s*)+)\)', text)
    for m in found:
        head = [h for at, h in heads if at < m.start()][-1]
        sentence = "".join(re.findall(r'"([^"]*)"', m.group(6)))
        yield head, *m.groups()[:5], sentence


def page():
    name, out, last = features(), HEAD, None
    for head, feature, other, relation, what, status, sentence in rules():
        if head != last:
            out += f"\n## {head}\n\n"
        last = head
        both = name[feature] + (f" with {name[other]}" if other != "ANY" else "")
        verb = {"EXCLUDES": "not with", "NEEDS": "only with"}[relation]
        line = f"- **{both}**, {verb} **{name[what]}** (`IMP_E_{status}`): {sentence}."
        out += textwrap.fill(line, 100, subsequent_indent="  ", break_on_hyphens=False) + "\n"
    return out


def main():
    if "--write" in sys.argv:
        PAGE.write_text(page())
    elif "--check" in sys.argv:
        if not PAGE.exists() or PAGE.read_text() != page():
            sys.exit(f"{PAGE} is not what the rules make: run tools/write_rules.py --write")
    else:
        print(page(), end="")


if __name__ == "__main__":
    main()
