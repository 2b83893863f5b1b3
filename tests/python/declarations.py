# SPDX-License-Identifier: Apache-2.0
"""The ctypes declarations against what a C compiler says of the same headers: sizes and
offsets of structs, values of enumerators, initialisers; results and arguments of functions,
which GCC lists (-aux-info)."""
import ctypes
import os
import re
import shutil
import subprocess

import importon
from importon import _c
from importon._errors import ERRORS
from tap import TOP, Skip, run

HEADERS = ["importon.h", "bend.h", "elements.h", "plan.h", "measure.h", "report.h", "rooms.h", "design.h", "walks.h", "until.h", "clip.h"]
INCLUDES = "".join("#include <importon/%s>\n" % h for h in HEADERS) + "#include <stddef.h>\n"
STRUCTS = {n: s for n, s in vars(_c).items() if isinstance(s, type) and issubclass(s, ctypes.Structure)
           and n.startswith("imp_")}


def compiler():
    cc = shutil.which(os.environ.get("CC", "cc").split()[-1]) or shutil.which("gcc")
    if not cc:
        raise Skip("no C compiler")
    return cc


def compile_c(source, *options):
    with open("probe.c", "w") as f:
        f.write(source)
    done = subprocess.run([compiler(), "-std=gnu11", "-I" + os.path.join(TOP, "include"), *options, "probe.c"],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:2000]


def test_structs():
    """Every struct has the compiler's size and offsets"""
    lines = []
    for name, s in STRUCTS.items():
        lines.append('_Static_assert(sizeof(struct %s) == %d, "");' % (name, ctypes.sizeof(s)))
        for field, *_ in s._fields_:
            d = getattr(s, field)
            lines.append('_Static_assert(offsetof(struct %s, %s) == %d, "%s.%s");' % (name, field, d.offset, name, field))
            lines.append('_Static_assert(sizeof(((struct %s *)0)->%s) == %d, "%s.%s");' % (name, field, d.size, name, field))
    compile_c(INCLUDES + "\n".join(lines), "-c", "-o", "probe.o")
    assert len(STRUCTS) >= 35
    return "%d structs" % len(STRUCTS)


def test_constants():
    """Every enumerator and constant has the compiler's value"""
    names = {n: v for n, v in vars(_c).items() if n.startswith("IMP_") and isinstance(v, int)}
    compile_c(INCLUDES + "\n".join('_Static_assert(%s == %d, "%s");' % (n, v, n) for n, v in names.items()),
              "-c", "-o", "probe.o")
    text = "\n".join(open(os.path.join(TOP, "include", "importon", h)).read() for h in HEADERS)
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    for body in re.findall(r"enum \w+ \{([^}]*)\}", text):
        for item in body.split(","):
            name = item.split("=")[0].strip()
            assert not name or "(" in name or name in names, name
    return "%d constants" % len(names)


def test_initialisers():
    """Initial values are those of the headers' initialisers"""
    from importon._library import make
    lines, checked = [], 0
    for name, s in STRUCTS.items():
        macro = "IMP_" + name[4:].upper() + "_INIT"
        lines += ["#ifdef " + macro, "dump(\"%s\", &(struct %s)%s, sizeof(struct %s));" % (name, name, macro, name), "#endif"]
    compile_c(INCLUDES + "#include <stdio.h>\nstatic void dump(const char *n, const void *p, size_t s) {"
              "printf(\"%s \", n); for (size_t i = 0; i < s; i++) printf(\"%02x\", ((const unsigned char *)p)[i]);"
              "puts(\"\"); }\nint main(void) {\n" + "\n".join(lines) + "\nreturn 0; }", "-o", "probe")
    for line in subprocess.run(["./probe"], capture_output=True, text=True, check=True).stdout.splitlines():
        name, data = line.split()
        made, real = make(STRUCTS[name]), STRUCTS[name].from_buffer_copy(bytes.fromhex(data))
        for field, *_ in STRUCTS[name]._fields_:
            a, b = getattr(made, field), getattr(real, field)
            if isinstance(a, ctypes.Structure):
                continue
            assert (bytes(a) if hasattr(a, "_length_") else a) == (bytes(b) if hasattr(b, "_length_") else b), (name, field)
        checked += 1
    assert checked >= 15
    return "%d initialisers" % checked


def test_functions():
    """Every function has the compiler's result and arguments"""
    if "gcc" not in subprocess.run([compiler(), "-v"], capture_output=True, text=True).stderr.lower().split("version")[0]:
        raise Skip("the compiler is not GCC")
    compile_c(INCLUDES, "-c", "-o", "probe.o", "-aux-info", "probe.X")
    listed = dict(re.findall(r"extern (.*?\b(?=imp_\w+ \()(?:imp_\w+) \(.*\));", open("probe.X").read()) and
                  [(re.search(r"\b(imp_\w+) \(", d)[1], d) for d in
                   re.findall(r"extern (.*?\bimp_\w+ \(.*\));", open("probe.X").read())])

    def kind(text):
        text = text.strip()
        if re.search(r"imp_progress_fn|\(\*\)", text) or ("*" in text and "char" not in text):
            return "pointer"
        if "*" in text:
            return "string" if re.match(r"const char \*$", text) else "pointer"
        return {"enum": "int", "_Bool": "bool"}.get(text.split()[0], {"size_t": "long unsigned int", "uint64_t": "long unsigned int",
                "int64_t": "long int", "unsigned": "unsigned int"}.get(text, text))

    names = {ctypes.c_void_p: "pointer", ctypes.c_char_p: "string", ctypes.c_int: "int", ctypes.c_bool: "bool", ctypes.c_double: "double",
             ctypes.c_ulong: "long unsigned int", ctypes.c_long: "long int", ctypes.c_uint: "unsigned int", None: "void"}
    for name, result, arguments in _c._FUNCTIONS:
        declaration = listed.pop(name)
        m = re.match(r"(.*?)\b%s \((.*)\)$" % name, declaration)
        given, depth, last = [], 0, 0
        for i, ch in enumerate(m[2] + ","):
            depth += (ch in "([") - (ch in ")]")
            if ch == "," and not depth:
                given.append(m[2][last:i])
                last = i + 1
        given = [] if given == ["void"] else given
        want = [kind(g) for g in given]
        # A string that may be written to is a pointer here and there.
        assert [names[a] for a in arguments] == want, (name, want, arguments)
        assert names[result] == kind(m[1]), (name, result, m[1])
    assert not listed, "not declared: %s" % ", ".join(listed)
    return "%d functions" % len(_c._FUNCTIONS)


# Public functions that the package does not call, and why.
WITHOUT = {
    "imp_scene_n_theta": "parameters are read and set by name: SceneParameters",
    "imp_scene_get_theta": "the same",
    "imp_scene_set_theta": "the same",
    "imp_denoiser_check": "importon.denoise is called with a picture that is there already, and says so itself",
    "imp_version_number": "the package brings its own library, and compares the text (imp_version)",
    "imp_drop_text": "the header's sentences are in the declarations; Picture.dropped has the words",
    "imp_problem_nlopt": "NLopt's callback in C: importon.loss is a function of Python, for any optimiser",
    "imp_problem_set_run": "of that callback: functions take the run as keywords",
    **{"imp_manifest_" + word: "a manifest says what a command line computed; importon verify reads it"
       for word in ("create", "destroy", "get_info", "output", "read", "result", "set_limit", "write")},
    "imp_context_set_manifest": "the same",
    "imp_checkpoint_free": "it asks before pictures are rendered, importon fit; a fit of Python begins with that question",
    "imp_film_merge": "pictures are arrays, whose means are one line",
    "imp_film_add_layer": "of one file for viewers: arrays are written one by one",
    "imp_report_page": "for servers of a live page: importon view",
    "imp_report_data": "the same",
    "imp_problem_shares": "of one pixel, for pages of walks: importon report --scene; render_backward has its gradient",
    "imp_ugr": "a formula of one line; glare has it of scenes",
    "imp_dgp": "the same, daylight_glare",
    "imp_guth_position": "the same",
    "imp_iwata_position": "the same",
    "imp_problem_get_fit_variable": "one number of a fit: Fit has arrays; numbers beyond 1,024 have no errors",
}


def test_counterparts():
    """Every public function has its counterpart in Python, or is listed with a reason"""
    import glob
    source = "".join(open(f).read() for f in glob.glob(os.path.join(os.path.dirname(importon.__file__), "*.py"))
                     if not f.endswith("_c.py"))
    used = set(re.findall(r"\blib(?:rary)?\.(imp_\w+)", source))
    declared = {name for name, *_ in _c._FUNCTIONS}
    assert used <= declared, "not in the headers: %s" % sorted(used - declared)
    assert declared - used == set(WITHOUT), (sorted(declared - used - set(WITHOUT)), sorted(set(WITHOUT) - (declared - used)))
    return "%d of %d functions; not called: %s" % (len(used), len(declared), ", ".join(sorted(WITHOUT)))


def test_errors():
    """Every status has a class of its own, and every public name is there"""
    for name, value in _c.WORDS["imp_status"].items():
        assert name == "ok" or (value in ERRORS and ERRORS[value].status == name), name
    assert len(set(ERRORS.values())) == len(ERRORS)
    for name in importon.__all__:
        if name not in ("torch", "jax"):
            assert getattr(importon, name) is not None, name


run(globals())
