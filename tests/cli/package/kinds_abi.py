#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Is kinds.h what plug-ins were compiled with, by the rules of its version?

Usage: kinds_abi.py HEADER RECORD [--write]

RECORD has the version, the size of every struct, the place and size of every field and every
constant, as the version was first released. Of the same version
  - fields of the record are where they were, and as large;
  - structs of the second list (IMP_KINDS_STRUCTS) have the size that they had; those of the
    first, and tables of functions, are not smaller, and what is new in them lies beyond their
    former size;
  - constants have their values.
Another version needs another record (--write). Prints what is broken, a line each.
"""
import os, re, subprocess, sys, tempfile

header, record = sys.argv[1:3]
text = re.sub(r"/\*.*?\*/", "", open(header).read(), flags=re.S)
version = int(re.search(r"#define IMP_KINDS_VERSION (\d+)", text)[1])
first = re.findall(r"\bfirst\((imp_\w+)\)", text)
second = re.findall(r"\bsecond\((imp_\w+)\)", text)
code = re.sub(r"^[ \t]*#(?:.*\\\n)*.*$", "", text, flags=re.M)

def names(body):
    """Of the fields of a struct."""
    for d in filter(None, (" ".join(x.split()) for x in body.split(";"))):
        function = re.search(r"\(\*(\w+)\)\s*\(", d)
        if function: yield function[1]
        else: yield from (re.search(r"(\w+)(?:\[[^]]*\])*$", x.strip())[1] for x in d.split(","))

structs = {m[1]: list(names(m[2])) for m in re.finditer(r"^struct (\w+) \{(.*?)^\}", code, re.S | re.M)}
constants = [x.split("=")[0].strip() for m in re.finditer(r"enum \w+ \{([^}]*)\}", code)
             for x in m[1].split(",") if x.strip()]
constants += ["IMP_INPUTS_MAX", "IMP_RESPONSES_MAX", "IMP_SMOOTH"]

lines = ['printf("version %d\\n", IMP_KINDS_VERSION);']
for s, fields in sorted(structs.items()):
    lines.append('printf("%s %%zu\\n", sizeof(struct %s));' % (s, s))
    lines += ['printf("%s.%s %%zu %%zu\\n", offsetof(struct %s, %s), sizeof(((struct %s *)0)->%s));' % (s, f, s, f, s, f)
              for f in fields]
lines += ['printf("%s = %%d\\n", (int)%s);' % (c, c) for c in sorted(constants)]
with tempfile.TemporaryDirectory() as folder:
    source = os.path.join(folder, "layout.c")
    with open(source, "w") as f:
        f.write("#include <importon/kinds.h>\n#include <stdio.h>\nint main(void)\n{\n%s\nreturn 0;\n}\n" % "\n".join(lines))
    subprocess.run(["cc", "-I" + os.path.dirname(os.path.dirname(header)), source, "-o", folder + "/layout"], check=True)
    now = subprocess.run([folder + "/layout"], check=True, capture_output=True, text=True).stdout

if "--write" in sys.argv:
    open(record, "w").write(now)
    sys.exit()

then = open(record).read()
read = lambda t: dict(x.split(" ", 1) for x in t.splitlines())
a, b = read(then), read(now)
if a["version"] != b["version"]:
    sys.exit("version %s: the record is of version %s; make it anew by --write" % (b["version"], a["version"]))
broken = ["%s is in neither list of IMP_KINDS_STRUCTS" % s for s in structs
          if s not in first + second and not s.endswith("_ops") and s not in ("imp_struct_size", "imp_kinds_layout")]
for name, value in a.items():
    if name not in b: broken.append("%s is gone" % name)
    elif "." in name or "=" in value:
        if b[name] != value: broken.append("%s was %s, and is %s" % (name, value, b[name]))
    elif name != "version" and (int(b[name]) < int(value) or name not in first and not name.endswith("_ops") and b[name] != value):
        broken.append("struct %s had %s bytes, and has %s" % (name, value, b[name]))
for name, value in b.items():
    if "." in name and name not in a and name.split(".")[0] in a and int(value.split()[0]) < int(a[name.split(".")[0]]):
        broken.append("%s is new, and lies within the former size" % name)
print("\n".join(broken), end="\n" if broken else "")
sys.exit(bool(broken))
