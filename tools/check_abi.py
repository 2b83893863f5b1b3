#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The binary interface of the public headers against the one that is kept in tests/abi.

Usage: check_abi.py [--update [--break]] [LIBRARY]

A file of each public header in tests/abi has every struct with its size (x86-64, LP64)
and the offset, size and declaration of its members, every enumerator and constant with its
value, every function and callback with its prototype, and what initialisers set. Each has the version since which
it is so. The headers are read here, and a C compiler says sizes and values.

What is of an earlier version than the headers' is released, and may only grow: a struct
that begins with `size` may get members behind its end, an enum or a header new names. All
else that differs is an error here, which --update does not write without --break (a major
version, or before 1.0 a minor one, with CHANGELOG.md saying what to do). What is of the
headers' own version is not released: --update takes it as it is now.

lib/importon.map, the linker's list of exported functions, is made from these files too.
With LIBRARY, what it exports is compared with that list.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

TOP = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
HEADERS = ["importon", "clip", "until", "walks", "report", "rooms", "design", "plan", "measure", "elements", "bend", "kinds", "mpi"]
ELSEWHERE = ["mpi"]  # functions of other libraries
MAP = os.path.join(TOP, "lib", "importon.map")


def words(text):
    """One blank between words, none inside brackets."""
    text = " ".join(text.split())
    return re.sub(r"\s*([(),\[\]])\s*", r"\1", text).replace(",", ", ").replace(" (*", "(*")


def split(text, at=","):
    parts, depth, last = [], 0, 0
    for i, c in enumerate(text + at):
        depth += (c in "([{") - (c in ")]}")
        if c == at and depth == 0:
            parts.append(text[last:i].strip())
            last = i + 1
    return [p for p in parts if p]


class Header:
    """The declarations of one header, in their order."""

    def __init__(self, name):
        with open(os.path.join(TOP, "include", "importon", name + ".h"), encoding="utf-8") as f:
            text = re.sub(r"/\*.*?\*/", " ", f.read(), flags=re.S)
        self.version = re.findall(r'#define IMP_VERSION_STRING "(.*)"', text)
        self.constants = re.findall(r"^#define (IMP_\w+)[ \t]+\(?(?:-?\d+|SIZE_MAX)\)?[ \t]*$", text, re.M)
        self.initialisers = {n: words(body.replace("\\\n", " ")).replace("]=", "] =")
                             for n, body in re.findall(r"#define (IMP_\w+_INIT)\b((?:.*\\\n)*.*)", text)}
        lists = re.findall(r"#define IMP_(\w+)_LIST\(X\)((?:.*\\\n)*.*)", text)
        self.enums = {"imp_" + n.lower(): re.findall(r"X\((IMP_\w+),", body) for n, body in lists}
        code = re.sub(r"^[ \t]*#(?:.*\\\n)*.*$", "", text, flags=re.M)
        for name_, body in re.findall(r"\benum (\w+)\s*\{([^}]*)\}", code):
            members = [m.split("=")[0].strip() for m in split(body)]
            if not any("(" in m for m in members):
                self.enums[name_] = members
        self.structs = {}
        for m in re.finditer(r"^struct (\w+)\s*\{", code, re.M):
            depth, end = 1, m.end()
            while depth:
                depth += {"{": 1, "}": -1}.get(code[end], 0)
                end += 1
            self.structs[m[1]] = [f for d in split(code[m.end():end - 1], ";") for f in self.fields(d)]
        self.callbacks = {n: words("%s (%s)" % (r, a)) for r, n, a in
                          re.findall(r"typedef ([\w ]+?) \(\*(\w+)\)\(([^;]*)\);", code)}
        self.functions = {}
        pattern = (r"IMP_API\s+(?:IMP_MUST_CHECK\s+)?([\w\s*]*?)\b(imp_\w+)"
                   r"\(((?:[^()]|\((?:[^()]|\([^()]*\))*\))*)\)(?:\s*IMP_FORMAT\([^()]*\))?;")
        for result, name_, arguments in re.findall(pattern, code):
            self.functions[name_] = words("%s (%s)" % (result, arguments))
        declared = len(re.findall(r"\bIMP_API\s", code))
        if declared != len(self.functions):
            sys.exit("%s.h: %d functions are declared, %d were understood" % (name, declared, len(self.functions)))

    @staticmethod
    def fields(declaration):
        """(name, declaration) of each member."""
        declaration = words(declaration)
        if "{" in declaration:
            sys.exit("a struct inside a struct: " + declaration)
        call = re.match(r"[^()]*\(\*(\w+)\)\(", declaration)
        if call:
            return [(call[1], declaration)]
        base = re.match(r"((?:const )?(?:(?:struct|enum|union) )?\w+)\s*(.*)$", declaration)
        out = []
        for d in split(base[2]):
            name = re.search(r"\w+", re.sub(r"\bconst\b", "", d))[0]
            out.append((name, words(base[1] + " " + d)))
        return out


def probe(headers):
    """What a C compiler says: {"struct": size, "struct.member": (offset, size), "NAME": value}."""
    lines, keys = [], []
    for h in headers.values():
        for s, members in h.structs.items():
            keys.append(s)
            lines.append("sizeof(struct %s), 0" % s)
            for m, _ in members:
                keys.append(s + "." + m)
                lines.append("offsetof(struct %s, %s), (long long)sizeof(((struct %s *)0)->%s)" % (s, m, s, m))
        for name in [n for e in h.enums.values() for n in e] + h.constants:
            keys.append(name)
            lines.append("%s, 0" % name)
    source = "".join("#include <importon/%s.h>\n" % h for h in headers)
    source += "#include <stdio.h>\nint main(void) {\n"
    source += "".join('printf("%%lld %%lld\\n", (long long)%s);\n' % x for x in lines) + "return 0; }\n"
    cc = shutil.which(os.environ.get("CC", "cc").split()[-1]) or shutil.which("gcc") or shutil.which("clang")
    if not cc:
        print("1..0 # SKIP no C compiler")
        sys.exit(0)
    with tempfile.TemporaryDirectory() as folder:
        c, program = os.path.join(folder, "probe.c"), os.path.join(folder, "probe")
        with open(c, "w", encoding="utf-8") as f:
            f.write(source)
        made = subprocess.run([cc, "-std=gnu11", "-Wno-psabi", "-I" + os.path.join(TOP, "include"), c, "-o", program],
                              capture_output=True, text=True)
        if made.returncode:
            sys.exit("the headers do not compile:\n" + made.stderr[:4000])
        out = subprocess.run([program], capture_output=True, text=True, check=True).stdout.splitlines()
    return {k: tuple(map(int, line.split())) for k, line in zip(keys, out)}


def interface(h, said):
    """{key: text} in order; the key says what it is, the text how it is."""
    out = {}
    for s, members in h.structs.items():
        kind = "sized" if members and members[0][0] == "size" else "closed"
        out["struct " + s] = "%s %d" % (kind, said[s][0])
        for m, declaration in members:
            offset, size = said[s + "." + m]
            out["%s.%s" % (s, m)] = "%d %d %s" % (offset, size, declaration)
    for e, names in h.enums.items():
        for n in names:
            out["%s: %s" % (e, n)] = str(said[n][0])
    for c in h.constants:
        out["constant " + c] = str(said[c][0])
    for n, text in h.initialisers.items():
        out["initialiser " + n] = text
    for n, text in h.callbacks.items():
        out["callback " + n] = text
    for n, text in h.functions.items():
        out["function " + n] = text
    return out


def path_of(name):
    return os.path.join(TOP, "tests", "abi", name + ".txt")


def kept_of(name):
    """{key: (since, text)} of the file."""
    kept = {}
    if os.path.exists(path_of(name)):
        with open(path_of(name), encoding="utf-8") as f:
            for line in f:
                if line[:1].isdigit():
                    since, rest = line.rstrip("\n").split("  ", 1)
                    key, text = rest.split(" = ", 1)
                    kept[key] = (since, text)
    return kept


def numbers(version):
    return tuple(int(x) for x in version.split("."))


def grown(key, old, new):
    """Is the difference one that older programs do not notice?"""
    a, b = old.split(), new.split()
    return key.startswith("struct ") and a[0] == b[0] == "sized" and int(b[1]) > int(a[1])


def compare(name, now, kept, version):
    """Lines that say what differs: (is it an error of a released interface, text)."""
    for key, (since, old) in kept.items():
        released = numbers(since) < numbers(version)
        if key not in now:
            yield released, "%s.h: %s is gone (since %s)" % (name, key, since)
        elif now[key] != old:
            yield released and not grown(key, old, now[key]), "%s.h: %s was '%s', is '%s' (since %s)" % (
                name, key, old, now[key], since)
    for key, text in now.items():
        if key in kept:
            continue
        struct = "struct " + key.split(".")[0]
        bad = False
        if "." in key and struct in kept and numbers(kept[struct][0]) < numbers(version):
            kind, size = kept[struct][1].split()
            bad = kind == "closed" or int(text.split()[0]) < int(size)
        yield bad, "%s.h: %s is new: %s" % (name, key, text)


def map_text(all_kept):
    """The version script: functions under the version that they are since."""
    by = {}
    for name, kept in all_kept.items():
        for key, (since, _) in kept.items():
            if key.startswith("function ") and name not in ELSEWHERE:
                by.setdefault(since, []).append(key.split()[1])
    out = ["/* SPDX-License-Identifier: Apache-2.0", " *",
           " * The functions that the library exports, by the version that they are since. Made by",
           " * tools/check_abi.py --update. */"]
    before = ""
    for since in sorted(by, key=numbers):
        out += ["IMPORTON_%s {" % since, "global:"] + ["    %s;" % f for f in sorted(by[since])]
        out += [] if before else ["local:", "    *;"]
        out += ["}%s;" % before, ""]
        before = " IMPORTON_" + since
    return "\n".join(out).rstrip("\n") + "\n"


def main():
    options = {a for a in sys.argv[1:] if a.startswith("--")}
    libraries = [a for a in sys.argv[1:] if not a.startswith("--")]
    if options - {"--update", "--break"} or len(libraries) > 1:
        sys.exit(__doc__)
    headers = {name: Header(name) for name in HEADERS}
    version = headers["importon"].version[0]
    said = probe(headers)
    all_kept, wrong, different = {}, [], []
    for name, h in headers.items():
        now, kept = interface(h, said), kept_of(name)
        for bad, line in compare(name, now, kept, version):
            (wrong if bad else different).append(line)
        all_kept[name] = {k: (kept[k][0] if k in kept and kept[k][1] == v else version, v) for k, v in now.items()}
        for k, v in now.items():  # a struct that has grown is as old as before
            if k in kept and grown(k, kept[k][1], v):
                all_kept[name][k] = (kept[k][0], v)
    if wrong and "--break" not in options:
        print("\n".join(wrong))
        sys.exit("a released interface may only grow")
    if "--update" in options:
        os.makedirs(os.path.dirname(path_of("x")), exist_ok=True)
        for name, kept in all_kept.items():
            with open(path_of(name), "w", encoding="utf-8") as f:
                f.write("# The binary interface of importon/%s.h, with the version that it is since: made by\n"
                        "# tools/check_abi.py --update, which says what it is for.\n" % name)
                f.writelines("%s  %s = %s\n" % (since, key, text) for key, (since, text) in kept.items())
        with open(MAP, "w", encoding="utf-8") as f:
            f.write(map_text(all_kept))
        different = []
    elif not os.path.exists(MAP) or open(MAP, encoding="utf-8").read() != map_text(all_kept):
        different.append("lib/importon.map is not that of the headers")
    for library in libraries:
        listed = subprocess.run(["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True)
        exported = {line.split()[-1].split("@")[0] for line in listed.stdout.splitlines() if line.split()[-2] in "TDBRWV"}
        wanted = {k.split()[1] for n, kept in all_kept.items() if n not in ELSEWHERE for k in kept if k.startswith("function ")}
        different += ["%s is exported and in no header" % s for s in sorted(exported - wanted)]
        different += ["%s is in a header and not exported" % s for s in sorted(wanted - exported)]
    if different:
        print("\n".join(different))
        sys.exit("the interface is not that of tests/abi: tools/check_abi.py --update, after a look at each line")


if __name__ == "__main__":
    main()
