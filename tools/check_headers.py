#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Can a host use every public function from its comment alone?

Every IMP_API declaration has a comment right above it that

  - has @return where the function returns enum imp_status: IMP_OK and each failure by its
    name, or `as` another function of the headers whose comment does;
  - gives the shape, [n] or the like, of each pointer to numbers (but out parameters of one
    value of another type are given by the prototype);
  - has no word that is used in its private sense (told, asks, stands for, rests, knows),
    and no sentence that begins with "Of".

A comment that groups several declarations, as in a list without blank lines, serves those
below it which are named in GROUPS with the reason.

    tools/check_headers.py [HEADER...]; default all of include/importon but kinds.h
"""
import os
import re
import sys

TOP = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
HEADERS = ["importon", "clip", "until", "walks", "report", "rooms", "design", "plan", "measure", "elements", "bend", "mpi"]
GROUPS = {"imp_elements_fit": "its comment is inside clang-format off, for the formula"}
# One value that is set, of a type that the prototype has.
ONE = {"n", "n_rows", "index", "length", "spp", "code", "n_points", "objective", "value", "param"}
WORDS = re.compile(r"\b(told|tells|asks|stands for|stood for|rests on|knows|nobody|fate)\b")
DECLARATION = re.compile(r"(/\*\*(?:(?!\*/).)*\*/\n)?(IMP_API\s+(?:IMP_MUST_CHECK\s+)?([\w\s*]*?)\b(imp_\w+)"
                         r"\(((?:[^()]|\((?:[^()]|\([^()]*\))*\))*)\);)", re.S)
NUMBERS = re.compile(r"(?:double|float|int|u?int\d+_t) \*(\w+)$")


def flat(comment):
    return re.sub(r"\s*\n\s*\*(?:/$)? ?", " ", comment.strip()[3:])


def main():
    wrong, read = [], {}
    for name in sys.argv[1:] or [os.path.join(TOP, "include", "importon", h + ".h") for h in HEADERS]:
        with open(name, encoding="utf-8") as f:
            read[os.path.basename(name)] = f.read()
    known = {m[4]: flat(m[1] or "") for text in read.values() for m in DECLARATION.finditer(text)}
    for header, text in read.items():
        def bad(function, what):
            wrong.append("%s: %s: %s" % (header, function, what))
        for m in DECLARATION.finditer(text):
            result, function, arguments = m[3].strip(), m[4], " ".join(m[5].split())
            if function in GROUPS:
                continue
            comment = known[function]
            if not comment:
                bad(function, "no comment right above it")
                continue
            if result == "enum imp_status":
                returns = comment.partition("@return")[2]
                other = re.match(r" as (?:\w+ )?(imp_\w+)", returns)
                if not returns:
                    bad(function, "no @return")
                elif other and other[1] not in known:
                    bad(function, "@return as %s, which is not there" % other[1])
                elif not other and "IMP_" not in returns and " as gather" not in returns:
                    bad(function, "@return names no status")
            for argument in re.split(r",(?![^()]*\))", arguments):
                pointer = NUMBERS.search(argument.strip())
                if pointer and pointer[1] not in ONE and not re.search(r"\b%s\b[^;]*?\[" % pointer[1], comment):
                    bad(function, "no shape of %s" % pointer[1])
        for m in re.finditer(r"/\*.*?\*/", text, re.S):
            line = text.count("\n", 0, m.start()) + 1
            comment = flat("  " + m[0])
            for word in WORDS.findall(comment):
                wrong.append("%s:%d: '%s'" % (header, line, word))
            if re.search(r"(?:^\W*|[.:] )Of\b", comment):
                wrong.append("%s:%d: a sentence begins with 'Of'" % (header, line))
    if wrong:
        print("\n".join(wrong))
        sys.exit("%d places" % len(wrong))
    print("%d functions" % len(known))


if __name__ == "__main__":
    main()
