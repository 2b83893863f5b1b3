#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Write the ctypes declarations of the public headers.

Usage: generate.py OUTPUT.py HEADER...

Structs, enums, functions and initialisers are read from the headers, which are written in
one form (no nested structs, one declaration a line). What is written is the module
importon._c: a class for each struct with its initial values in `initial`, the number of
each enumerator, its word in `WORDS` (IMP_LOSS_L2 of enum imp_loss is "l2"), and the
argument and result types of each function. tests/python/declarations.py compares it with
what a C compiler says of the same headers.
"""
import pprint
import re
import sys

SCALARS = {"size_t": "c_size_t", "int": "c_int", "unsigned": "c_uint", "double": "c_double",
           "float": "c_float", "int64_t": "c_int64", "uint64_t": "c_uint64",
           "int32_t": "c_int32", "uint32_t": "c_uint32", "uint16_t": "c_uint16",
           "uint8_t": "c_uint8", "bool": "c_bool", "char": "c_char"}


def split(text):
    """At commas outside brackets."""
    parts, depth, last = [], 0, 0
    for i, c in enumerate(text + ","):
        depth += (c in "([{") - (c in ")]}")
        if c == "," and depth == 0:
            parts.append(text[last:i].strip())
            last = i + 1
    return [p for p in parts if p]


class Headers:
    def __init__(self, text):
        text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
        text = re.sub(r"//[^\n]*", "", text)
        self.strings = dict(re.findall(r'#define (IMP_\w+)\s+"([^"]*)"', text))
        self.constants = {n: int(v) for n, v in
                          re.findall(r"#define (IMP_\w+)\s+\(?(-?\d+)\)?\s*$", text, re.M)}
        self.initialisers = {name: body.replace("\\\n", " ") for name, body in
                             re.findall(r"#define (IMP_\w+_INIT)\s((?:.*\\\n)*.*)", text)}
        self.enums, self.texts = {}, {}
        self.read_lists(text)
        code = re.sub(r"^[ \t]*#(?:.*\\\n)*.*$", "", text, flags=re.M)
        self.callbacks = {}
        for result, name, arguments in re.findall(
                r"typedef (\w+) \(\*(\w+)\)\(([^()]*)\);", code):
            self.callbacks[name] = (result, arguments)
        self.read_enums(code)
        self.structs = {name: list(self.fields(body)) for name, body in
                        re.findall(r"^struct (\w+) \{(.*?)^\}", code, re.S | re.M)}
        self.functions = list(self.read_functions(code))

    def read_lists(self, text):
        """#define IMP_STATUS_LIST(X) X(IMP_OK, 0, "success") ...: an enum and its sentences."""
        for name, body in re.findall(r"#define IMP_(\w+)_LIST\(X\)((?:.*\\\n)*.*)", text):
            members = re.findall(r'X\((IMP_\w+), (\d+),\s*(?:\\\s*)?"([^"]*)"\)', body)
            self.enums["imp_" + name.lower()] = {n: int(v) for n, v, _ in members}
            self.texts["imp_" + name.lower()] = {n: t for n, _, t in members}

    def read_enums(self, code):
        for name, body in re.findall(r"enum (\w+) \{([^}]*)\}", code):
            members, value = {}, 0
            for item in split(body):
                key, _, given = (s.strip() for s in item.partition("="))
                if "(" in key:
                    continue  # a list, read above
                value = self.number(given, members) if given else value
                members[key] = value
                value += 1
            if members:
                self.enums[name] = members

    def number(self, text, members=None):
        text = text.strip()
        for known in (members or {}, self.constants, *self.enums.values()):
            if text in known:
                return known[text]
        return int(text, 0)

    def fields(self, body):
        for declaration in (d.strip() for d in body.split(";")):
            function = re.match(r"(.*?)\(\*(\w+)\)\s*\(", declaration, re.S)
            if function:
                yield function[2], "c_void_p", []
                continue
            m = re.match(r"((?:const )?(?:struct |enum )?\w+)\s*(.*)$", declaration, re.S)
            for d in split(m[2]) if m else []:
                pointer = "*" in d
                name = re.search(r"\w+", re.sub(r"\bconst\b", "", d))[0]
                sizes = [] if "(*" in d else [self.number(n) for n in re.findall(r"\[(\w+)\]", d)]
                yield name, self.ctype(m[1], pointer, d.count("*")), sizes

    def ctype(self, base, pointer, stars=1):
        base = base.replace("const ", "").strip()
        if pointer:
            return "c_char_p" if base == "char" and stars == 1 else "c_void_p"
        if base in self.callbacks:
            return base
        if base.startswith("enum "):
            return "c_int"
        if base.startswith("struct "):
            return base[7:]
        return SCALARS[base]

    def argument(self, text):
        text = " ".join(text.split())
        if "(" in text or "[" in text:
            return "c_void_p"
        m = re.match(r"(.*?)(\w+)$", text)
        base = m[1].replace("*", "").strip()
        # char ** and a char * to write to are pointers; strings that come in are bytes.
        string = m[1].startswith("const char *") and m[1].count("*") == 1
        if "*" in m[1]:
            return "c_char_p" if string else "c_void_p"
        return self.ctype(base, False)

    def read_functions(self, code):
        pattern = (r"IMP_API\s+(?:IMP_MUST_CHECK\s+)?([\w\s*]*?)\b(imp_\w+)"
                   r"\(((?:[^()]|\((?:[^()]|\([^()]*\))*\))*)\);")
        for result, name, arguments in re.findall(pattern, code):
            result = " ".join(result.split())
            if result == "void":
                restype = "None"
            elif "*" in result:
                restype = "c_char_p" if "char" in result else "c_void_p"
            else:
                restype = self.ctype(result, False)
            given = [] if arguments.strip() == "void" else split(arguments)
            yield name, restype, [self.argument(a) for a in given]

    def initial(self, struct):
        """The fields that an initialiser does not leave 0."""
        body = self.initialisers.get("IMP_" + re.sub("^imp_", "", struct).upper() + "_INIT", "")
        fields = {name: (ctype, sizes) for name, ctype, sizes in self.structs[struct]}
        out = {}
        for name, at, text in re.findall(r"\.(\w+)(?:\[(\d+)\])? = ([^,)]+)", body):
            ctype, sizes = fields[name]
            value = float(text) if ctype in ("c_double", "c_float") else self.number(text)
            if at:
                values = list(out.get(name, (0.0,) * sizes[0]))
                values[int(at)] = value
                value = tuple(values)
            out[name] = value
        return out


def word_of(name, members):
    """The part of an enumerator's name that its neighbours do not share, in lower case."""
    parts = [m.split("_") for m in members]
    shared = 1
    while (len(members) > 1 and all(len(p) > shared + 1 for p in parts)
           and len({p[shared] for p in parts}) == 1):
        shared += 1
    return "_".join(name.split("_")[shared:]).lower()


def write(headers, out):
    put = lambda *lines: out.write("\n".join(lines) + "\n")
    put("# SPDX-License-Identifier: Apache-2.0",
        '"""Declarations of the C library, made from its headers by python/generate.py."""',
        "from __future__ import annotations", "",
        "import ctypes",
        "from ctypes import (CFUNCTYPE, POINTER, Structure, c_bool, c_char, c_char_p, c_double, c_float, c_int, c_int32,",
        "                    c_int64, c_size_t, c_uint, c_uint8, c_uint16, c_uint32, c_uint64, c_void_p)",
        "from typing import Any", "",
        'VERSION = "%s"' % headers.strings["IMP_VERSION_STRING"], "")
    for enum, members in headers.enums.items():
        put("# enum %s" % enum, *("%s = %d" % m for m in members.items()), "")
    for name, value in headers.constants.items():
        put("%s = %d" % (name, value))
    words = {e: {word_of(m, members): v for m, v in members.items()}
             for e, members in headers.enums.items()}
    put("", "# The words of each enum, as users write them.",
        "WORDS: dict[str, dict[str, int]] = " + pprint.pformat(words, sort_dicts=False, width=100),
        "# What a status and a dropped walk's cause mean.",
        "TEXTS: dict[str, dict[str, str]] = " + pprint.pformat(headers.texts, sort_dicts=False, width=100),
        "", "")
    for name, fields in headers.structs.items():
        initial = headers.initial(name)
        put("class %s(Structure):" % name)
        if initial:
            put("    initial = %r" % initial)
        put("    _fields_ = [")
        for field, ctype, sizes in fields:
            for n in reversed(sizes):
                ctype = "%s * %d" % (ctype, n)
            put('        ("%s", %s),' % (field, "c_void_p" if ctype in headers.callbacks else ctype))
        put("    ]", "", "")
    for name, (result, arguments) in headers.callbacks.items():
        types = ["c_int" if result == "int" else "None"]
        for a in split(arguments):
            struct = re.match(r"const struct (\w+) \*", a)
            types.append("POINTER(%s)" % struct[1] if struct else "c_void_p")
        put("%s = CFUNCTYPE(%s)" % (name, ", ".join(types)))
    put("", "_FUNCTIONS: list[tuple[str, Any, list[Any]]] = [")
    for name, restype, arguments in headers.functions:
        arguments = ["c_void_p" if a in headers.callbacks else a for a in arguments]
        put('    ("%s", %s, [%s]),' % (name, restype, ", ".join(arguments)))
    put("]", "", "",
        "def declare(library: ctypes.CDLL) -> None:",
        '    """Set argument and result types of every function."""',
        "    for name, result, arguments in _FUNCTIONS:",
        "        function = getattr(library, name)",
        "        function.argtypes = arguments",
        "        function.restype = result")


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    text = "\n".join(open(path, encoding="utf-8").read() for path in sys.argv[2:])
    headers = Headers(text)
    declared = len(re.findall(r"IMP_API\s", re.sub(r"#define.*", "", text)))
    if declared != len(headers.functions):
        sys.exit("%d functions are declared, %d were understood" % (declared, len(headers.functions)))
    with open(sys.argv[1], "w", encoding="utf-8") as out:
        write(headers, out)
