#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Promises of the public headers, kept by every function in them.

Usage: promises.py LIBRARY HEADER...

Functions and structs are read from the headers, so a new function is called here too; one
with an argument that nothing is known of fails. Of every function, each call in a process
of its own kind (a crash is a failed test, not the end of the test):

  - all arguments good: IMP_OK, except where listed in NOT_OK;
  - each pointer NULL: IMP_E_ARG and a message that has the argument's name, or what the
    header says (NULLABLE); without a status: no crash;
  - each struct with a size: 0, 4, not whole words, 4096 are IMP_E_ARG; of a larger one the
    rest must be 0; a smaller one is read and written within its size (bytes behind it keep
    their values, and it ends where a page ends that may not be touched);
  - each number NaN and +-infinity, in arguments, arrays and structs: IMP_E_ARG with the
    name of the number or of what it is in, except where listed in ANY_NUMBER; then no
    number that comes out with IMP_OK may be not finite.
"""
import ctypes as C, mmap, os, re, sys, tempfile

OK, E_ARG = 0, 10
library, headers = sys.argv[1], sys.argv[2:]
top = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))

# ---- The headers ---------------------------------------------------------------------

text = "\n".join(open(h).read() for h in headers)
text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
defines = {}  # of initialisers
for m in re.finditer(r"#define (IMP_\w+_INIT)\s((?:.*\\\n)*.*)", text):
    defines[m[1]] = m[2].replace("\\\n", " ")
constants = {m[1]: int(m[2]) for m in re.finditer(r"#define (IMP_\w+)\s+\(?(-?\d+)\)?\s*$", text, re.M)}
for name in ("STATUS", "DROP"):
    for m in re.finditer(r"X\((IMP_\w+), (\d+),", text): constants[m[1]] = int(m[2])
code = re.sub(r"^[ \t]*#(?:.*\\\n)*.*$", "", text, flags=re.M)
for m in re.finditer(r"enum \w+ \{([^}]*)\}", code):
    value = 0
    for item in filter(None, (x.strip() for x in m[1].split(","))):
        k, _, v = item.partition("=")
        if "(" in k: continue
        value = int(v) if v else value
        constants[k.strip()] = value
        value += 1

SCALARS = {"size_t": C.c_size_t, "int": C.c_int, "unsigned": C.c_uint, "double": C.c_double,
           "float": C.c_float, "int64_t": C.c_int64, "uint64_t": C.c_uint64, "int32_t": C.c_int32,
           "uint32_t": C.c_uint32, "uint16_t": C.c_uint16, "uint8_t": C.c_uint8,
           "imp_progress_fn": C.c_void_p, "imp_preview_fn": C.c_void_p, "imp_fit_step_fn": C.c_void_p, "imp_measure_say_fn": C.c_void_p, "imp_bend_fit_step_fn": C.c_void_p, "imp_dot_fn": C.c_void_p,
           "bool": C.c_bool, "char": C.c_char, "imp_v3": C.c_double * 4, "imp_spec": C.c_double * 4}
structs = {}

def split(s):
    """At commas outside brackets."""
    out, depth, last = [], 0, 0
    for i, c in enumerate(s + ","):
        depth += (c in "([{") - (c in ")]}")
        if c == "," and depth == 0:
            out.append(s[last:i].strip())
            last = i + 1
    return [x for x in out if x]

def number(s): return constants[s] if s in constants else int(s)

def base_type(s):
    s = s.replace("const ", "").strip()
    if s.startswith("enum "): return C.c_int
    if s.startswith("struct "): return structs.get(s[7:].strip())
    return SCALARS.get(s)

def fields(body):
    for declaration in filter(None, (x.strip() for x in body.split(";"))):
        function = re.search(r"\(\*(\w+)\)\s*\(", declaration)
        if function:
            yield function[1], C.c_void_p
            continue
        m = re.match(r"((?:const )?(?:struct |enum )?\w+)\s*(.*)$", declaration, re.S)
        for d in split(m[2]):
            pointer = "*" in d
            name = re.search(r"\w+", d.replace("const", ""))[0]
            t = C.c_void_p if pointer else base_type(m[1])
            if t is None: sys.exit("what is '%s %s'?" % (m[1], d))
            for n in [] if pointer else reversed(re.findall(r"\[(\w+)\]", d)): t = t * number(n)
            yield name, t

for m in re.finditer(r"^struct (\w+) \{(.*?)^\}", code, re.S | re.M):
    structs[m[1]] = type(m[1], (C.Structure,), {"_fields_": list(fields(m[2]))})

def initial(struct):
    """A struct from its IMP_..._INIT; of one without, zeros and its size."""
    s = struct()
    name = "IMP_" + re.sub("^imp_", "", struct.__name__).upper() + "_INIT"
    if name not in defines:
        if struct._fields_[0][0] == "size": s.size = C.sizeof(s)
        return s
    s.size = C.sizeof(s)  # and zeros, but for what is named
    if not re.search(r"IMP_INIT(_ZERO)?\(struct %s\b" % struct.__name__, defines[name]):
        raise ValueError("%s: %s" % (name, defines[name]))
    for field, at, v in re.findall(r"\.(\w+)(?:\[(\d+)\])? = ([^,)]+)", defines[name]):
        t = dict(struct._fields_)[field]
        if at: getattr(s, field)[int(at)] = float(v)
        else: setattr(s, field, float(v) if t is C.c_double else number(v))
    return s

class Argument:
    def __init__(self, declaration):
        self.text = declaration
        self.array = 0
        m = re.search(r"(\w+)\[(\d+)\]$", declaration)
        if m: self.name, self.array, self.type = m[1], int(m[2]), declaration[:m.start()].strip()
        elif "(" in declaration: self.name, self.type = re.search(r"\(\*+(\w+)\)", declaration)[1], declaration
        else:
            m = re.match(r"(.*?)(\w+)$", declaration)
            self.name, self.type = m[2], m[1].strip()
        self.pointer = "*" in self.type or self.array > 0
        self.const = self.type.startswith("const ")
        m = re.match(r"(?:const )?struct (\w+) \*$", self.type)
        self.struct = structs.get(m[1]) if m and self.type.count("*") == 1 else None
        self.sized = self.struct is not None and self.struct._fields_[0][0] == "size"
        self.ctype = C.c_void_p if self.pointer else base_type(self.type)

functions = []
for m in re.finditer(r"IMP_API\s+(?:IMP_MUST_CHECK\s+)?([\w\s*]*?)\b(imp_\w+)\(((?:[^()]|\((?:[^()]|\([^()]*\))*\))*)\)(?:\s*IMP_FORMAT\([^()]*\))?;", code):
    arguments = [] if m[3].strip() == "void" else [Argument(" ".join(a.split())) for a in split(m[3]) if a != "..."]
    functions.append((" ".join(m[1].split()), m[2], arguments))
# Functions in a header that hand on their arguments to imp_register_kind, one for each table.
registers = {}
for m in re.finditer(r"static inline\s+IMP_MUST_CHECK\s+(enum imp_status)\s+(imp_register_\w+)\(([^()]*)\)\s*\{\s*return imp_register_kind\(context, (\w+),", code):
    functions.append((m[1], m[2], [Argument(" ".join(a.split())) for a in split(m[3])]))
    registers[m[2]] = constants[m[4]]
exported = code.count("IMP_API ") + code.count("IMP_API\n")

# ---- What good arguments are -----------------------------------------------------------

lib = C.CDLL(library)
lib.imp_kinds_of_library.restype = C.c_void_p

class Register:
    """As C's inline function, with the layout of the library: ctypes does not know that of C."""
    def __init__(self, concept): self.concept = concept
    def __call__(self, context, ops): return lib.imp_register_kind(context, self.concept, ops, lib.imp_kinds_of_library())
for name, concept in registers.items(): setattr(lib, name, Register(concept))
for result, name, arguments in functions:
    f = getattr(lib, name)
    f.argtypes = [a.ctype for a in arguments]
    f.restype = {"void": None, "bool": C.c_bool, "double": C.c_double, "size_t": C.c_size_t}.get(
        result, C.c_char_p if result == "const char *" else C.c_void_p if "*" in result else C.c_int)

SCENE = b"""<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="3"/></integrator>
<sensor type="perspective"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0,-4,1" target="0,0,0" up="0,0,1"/></transform>
<film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/>
<rfilter type="box"/></film><sampler type="independent"><integer name="sample_count" value="4"/></sampler></sensor>
<shape type="rectangle" id="floor"><bsdf type="diffuse"><rgb name="reflectance" value="0.5,0.4,0.3"/></bsdf></shape>
<shape type="rectangle" id="lamp"><transform name="to_world"><rotate x="1" angle="180"/><translate z="2"/></transform>
<emitter type="area"><rgb name="radiance" value="1,1,1"/></emitter></shape></scene>"""

PARAM = "floor.bsdf.reflectance.value"

# Functions whose good call is not IMP_OK here, with the reason.
NOT_OK = {
    "imp_scene_commit": "the scene is committed",
    "imp_problem_add_smoothness": "the scene has no texture",
    "imp_problem_get_fit_variable": "there was no fit",
    "imp_scene_write_volume": "the scene has no volume",
    "imp_grid_points": "its sensor is a camera",
    "imp_grid_cells": "the same",
    "imp_scene_get_luminaire": "the scene has no luminaire",
    "imp_luminaire_glare_table": "the scene has no luminaire",
    "imp_grid_glare": "its sensor is a camera",
    "imp_grid_dgp": "the same",
    "imp_dgp": "its sources are zeros",
    "imp_annual_read": "its sensor is a camera",
    "imp_weather_read": "there is no such file",
    "imp_ugr": "its sources are zeros",
    "imp_design_find": "its sensor is a camera",
    "imp_design_move": "its sensor is a camera",
}
try: C.CDLL("libOpenImageDenoise.so.2")
except OSError: NOT_OK["imp_denoise"] = NOT_OK["imp_denoiser_check"] = "there is no Open Image Denoise"
# Pointers that may be NULL, by name, or by function and name.
NULLABLE = {"imp_report_page.length", "imp_scene_set_text.name", "imp_problem_shares.walk_share", "imp_grid_read.sets", "imp_grid_read_until.sets", "imp_grid_read_until.end", "imp_grid_cells.columns", "imp_grid_cells.rows", "imp_grid_cells.cell", "imp_grid_glare.se", "imp_grid_dgp.se", "imp_grid_dgp.illuminance", "imp_weather_read.hour", "imp_annual_read.point", "imp_annual_read.summary", "imp_annual_read.reading", "imp_annual_read.se", "imp_grid_summarise.average", "imp_reading_shares.share", "imp_reading_shares.reading", "imp_render_until.end", "imp_problem_until.end", "imp_problem_until.adjoint",
            "imp_problem_until.value", "imp_problem_until.gradient", "imp_report_data.length", "options", "run", "stats", "id", "objective", "gradient_se", "primal", "normals", "uvs",
            "axis", "hessian", "taps", "tap_bars", "tap_dots", "power", "bundle", "exit", "targets",
            "error", "order", "memory",
            "imp_optimizer_step.rule", "imp_optimizer_step.lo", "imp_optimizer_step.hi",
            "imp_context_set_team.team", "imp_context_set_parts.parts", "imp_context_set_manifest.manifest",
            "imp_scene_begin.name", "imp_scene_begin.tag", "imp_scene_ref.name", "imp_scene_load_string.name",
            "imp_bend_load_string.name",
            "imp_problem_objective.x", "imp_problem_objective.gradient",
            "imp_problem_functional.adjoint", "imp_problem_functional.value",
            "imp_problem_functional.gradient", "imp_problem_jacobian_sums.adjoint",
            "imp_problem_jacobian_sums.group", "imp_problem_jacobian_sums.value",
            "imp_problem_nlopt.gradient", "imp_field_eval.gradient", "imp_bend_objective.gradient",
            "imp_scene_write_volume.values", "imp_walks_weigh.mask", "imp_walks_read.scene", "imp_build_error.name", "imp_build_string.fallback", "imp_field_read.grid", "imp_bend_tangent.theta_dot", "imp_bend_tangent.x_dot",
            "imp_bend_tangent.d_dot", "imp_bend_fit.result", "imp_last_error.context",
            "imp_bend_set_progress.payload", "imp_bend_set_progress.progress",
            "imp_input_tangent.x_dot"}
NOT_NULLABLE = {"imp_bend_set_options.o", "imp_elements_fit.options",
                "imp_problem_jacobian_sums.primal"}
INPUT = {"imp_bend_adjoint.out"}  # structs of pointers to write to, not written themselves
# Numbers that may be anything: a NaN is a documented value, infinity is a bound, or the
# number is not used with the good arguments. What comes out must be finite all the same.
ANY_NUMBER = {"imp_film_reduce.white": "infinite: nothing is clipped",
              "imp_optimizer_step.lo": "infinite: none", "imp_optimizer_step.hi": "infinite: none",
              "imp_bend_set_bounds.lo": "infinite: none", "imp_bend_set_bounds.hi": "infinite: none",
              "imp_bend_adjoint.taps": "there are none", "imp_bend_adjoint.tap_bars": "there are none",
              "imp_course_value.time": "a function of it", "imp_spectrum_value.nm": "a function of it",
              "imp_build_texels.lo": "infinite: none", "imp_build_texels.hi": "infinite: none",
              "imp_field_eval.x": "a function of x", "imp_field_splat.x": "adds a function of x",
              "imp_field_splat.a": "adds a multiple", "imp_field_splat.b": "adds a multiple",
              "imp_field_tangent.x": "a function of x", "imp_field_tangent.theta_dot": "linear in it",
              "imp_bend_hold_rim.value": "NaN: as it is", "imp_bend_hold_outside.value": "NaN: as it is",
              "imp_bend_hold_number.value": "NaN: as it is",
              **{"imp_input_%s.%s" % (f, a): "a function of it" for f, a in
                 (("eval", "input"), ("eval", "at"), ("scatter", "input"), ("scatter", "at"), ("scatter", "bar"),
                  ("tangent", "input"), ("tangent", "at"))}}

# Arguments whose numbers have names of their own in messages.
ALSO = {"imp_scene_spectrum.wavelengths_nm": ["sample 0"], "imp_scene_spectrum.values": ["sample 0"],
        "imp_scene_set_theta.theta": [PARAM], "imp_scene_set_values.values": [PARAM],
        "imp_problem_set_x.x": [PARAM], "imp_problem_objective.x": [PARAM]}

class Fixture:
    """Objects and arrays, fresh for every function."""
    def __init__(self):
        self.keep = []
        self.context = self.make("imp_context_create", None)
        self.folder = tempfile.mkdtemp(prefix="promises")
        self.scene = self.make("imp_scene_load_string", self.context, SCENE, len(SCENE), b"test", None)

    def make(self, name, *arguments):
        out = C.c_void_p()
        status = getattr(lib, name)(*arguments, C.byref(out))
        if status != OK:
            raise RuntimeError("%s: status %d: %s" % (name, status, self.said()))
        return out.value

    def said(self):
        both = [lib.imp_last_error(getattr(self, "context", None)), lib.imp_last_error(None)]
        return " | ".join(x.decode(errors="replace") for x in both)

    def forget(self):
        """Set both messages to something known."""
        lib.imp_scene_find_param(self.scene, b"(marker)", C.byref(C.c_size_t()))
        lib.imp_context_create((C.c_size_t * 8)(12), C.byref(C.c_void_p()))

    def aligned(self, ctype):
        """Zeros at a multiple of 64 bytes, with room behind them: vectors are aligned to 32, and
        the compiler lays structs with vectors out with gaps that ctypes does not know."""
        raw = (C.c_char * (C.sizeof(ctype) + 320))()
        a = ctype.from_buffer(raw, -C.addressof(raw) % 64)
        self.keep += [raw, a]
        return a

    def array(self, ctype, n, values=None):
        if ctype is C.c_double:
            a = self.aligned(ctype * n)
            a[:len(values or [])] = values or []
            return a
        a = (ctype * n)(*(values or []))
        self.keep.append(a)
        return a

    def object(self, kind, function):
        scene, context = self.scene, self.context
        if kind == "imp_context" and function.startswith("imp_register_"):  # without scenes
            self.context = self.make("imp_context_create", None)
            return self.context
        if kind == "imp_context": return context
        if kind == "imp_scene":
            if re.match(r"imp_scene_(begin|end|bool|integer|float|string|vector|rgb|spectrum|transform|ref|mesh|image|grid)$", function):
                s = self.make("imp_scene_create", context, None)
                tag, kind = {"image": (b"texture", b"bitmap"), "grid": (b"volume", b"gridvolume")}.get(
                    function.split("_")[-1], (b"shape", b"mesh"))
                lib.imp_scene_begin(s, tag, kind, None, None)
                return s
            if function == "imp_scene_place":  # with a pose behind its other parameters
                s = self.make("imp_scene_load_string", context, SCENE, len(SCENE), b"test", None)
                if lib.imp_scene_add_pose(s, b"lamp") != OK: raise RuntimeError(self.said())
                return s
            return scene
        if kind == "imp_film" and function == "imp_problem_jacobian_sums":
            return self.jacobian()[0]
        if kind == "imp_film" and function in ("imp_film_merge", "imp_film_add_layer"):
            return self.make("imp_render", scene, None)
        if kind == "imp_film": return self.make("imp_film_create", context, 4, 4, b"R,G,B")
        if kind == "imp_problem":
            p = self.make("imp_problem_create", scene)
            lib.imp_problem_activate(p, PARAM.encode())
            t = initial(structs["imp_target"])
            t.width = t.height = 4
            t.channels = 3
            t.pixels = C.addressof(self.array(C.c_float, 48, [0.25] * 48))
            if lib.imp_problem_add_target(p, C.byref(t)) != OK: raise RuntimeError(self.said())
            return p
        if kind == "imp_elements":
            e = self.make("imp_elements_create", scene, None)
            if lib.imp_elements_solve(e) != OK: raise RuntimeError(self.said())
            return e
        if kind == "imp_field":
            if function in ("imp_field_get_rz",):
                return self.make("imp_field_rz_create", context, C.byref(initial(structs["imp_field_rz"])), 1.5)
            return self.make("imp_field_grid_create", context, C.byref(self.struct("imp_field_grid")), 1.5)
        if kind == "imp_bend":
            path = os.path.join(top, "scenes", "bend", "maxwell.xml")
            o = initial(structs["imp_load_options"])
            names = self.array(C.c_char_p, 2, [b"sources=4", b"count=6"])
            o.defines, o.n_defines = C.addressof(names), 2
            b = self.make("imp_bend_load", context, path.encode(), C.byref(o))
            if function == "imp_bend_image":
                t = initial(structs["imp_bend_target"])
                t.type, t.width, t.height = constants["IMP_BEND_IMAGE"], 4, 4
                t.origin[:], t.u[:], t.v[:] = [-1, -1, 1], [2, 0, 0], [0, 2, 0]
                t.at_plane, t.offset = 1, 1
                t.pixels = C.addressof(self.array(C.c_float, 16, [1.] * 16))
                if lib.imp_bend_add_target(b, C.byref(t)) != OK: raise RuntimeError(self.said())
            return b
        if kind in ("imp_guide", "imp_design"): return None
        if kind == "imp_walks": return self.make("imp_walks_keep", scene, None, None)
        if kind == "imp_manifest": return self.make("imp_manifest_create", context, b"command")
        if kind == "imp_parts": return self.make("imp_parts_create", context, 1, 2, b"command")
        raise KeyError(kind)

    def jacobian(self):
        """A picture of the problem above and its derivatives: [4] films."""
        if not hasattr(self, "pictures"):
            self.pictures = self.array(C.c_void_p, 4)
            status = lib.imp_problem_jacobian(self.object("imp_problem", ""), C.byref(self.struct("imp_run")),
                                              self.pictures, C.byref(self.pictures, C.sizeof(C.c_void_p)))
            if status != OK: raise RuntimeError(self.said())
        return self.pictures

    def build(self):
        """What the build function of a texture gets, kept after its end: all that it points to
        lives as long as the scene."""
        kept = []
        def build(b, own, texture):
            kept.append(C.create_string_buffer(C.string_at(b, 64), 64))
            return OK
        ops = self.struct("imp_texture_ops")
        call = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_void_p, C.c_void_p)(build)
        ops.build = C.cast(call, C.c_void_p)
        self.context = self.make("imp_context_create", None)
        if lib.imp_register_texture(self.context, C.byref(ops)) != OK: raise RuntimeError(self.said())
        scene = SCENE.replace(b'<rgb name="reflectance" value="0.5,0.4,0.3"/>',
                              b'<texture name="reflectance" type="probe"/>')
        self.make("imp_scene_load_string", self.context, scene, len(scene), b"test", None)
        self.keep += [kept, call, ops]
        return C.addressof(kept[0])

    def struct(self, name, function=""):
        s = initial(structs[name])
        if name.endswith("_ops"):
            word = C.create_string_buffer(b"probe")
            nothing = C.CFUNCTYPE(C.c_int)(lambda: 0)
            self.keep += [word, nothing]
            s.name = C.addressof(word)
            for function in ("build", "sample", "eval", "pdf", "eval_d", "scatter", "tangent", "surface", "ray"):
                if hasattr(s, function): setattr(s, function, C.cast(nothing, C.c_void_p))
        doubles = lambda n, v=0.: C.addressof(self.array(C.c_double, n, [v] * n))
        if name == "imp_field_grid":
            s.cells[:] = [2, 2, 2]
            s.lo[:], s.hi[:] = [-1] * 3, [1] * 3
        if name == "imp_bend_rays":
            s.n = 2
            s.x = C.addressof(self.array(C.c_double, 6, [0, 0, -.5, .1, 0, -.5]))
            s.d = C.addressof(self.array(C.c_double, 6, [0, 0, 1, 0, 0, 1]))
            s.group = None
        if name == "imp_target":
            s.width = s.height = 4
            s.channels = 3
            s.pixels = C.addressof(self.array(C.c_float, 48, [0.25] * 48))
        if name == "imp_team": s.gather = C.cast(self.keep.append(C.CFUNCTYPE(C.c_int)(lambda: 0)) or self.keep[-1], C.c_void_p)
        if name == "imp_fit_options": s.max_iterations = 2
        if name == "imp_photo":
            s.width = s.height = 4
            s.channels = 3
            s.pixels = C.addressof(self.array(C.c_float, 48, [.2 + .01 * (k % 7) for k in range(48)]))
        if name == "imp_design_lamp":
            word = C.create_string_buffer(b"lamp.emitter")
            self.keep.append(word)
            s.lamp, s.watts = C.addressof(word), 5
        if name == "imp_design_want": s.value = 1
        if name == "imp_design_move":
            word = C.create_string_buffer(b"lamp.pose")
            self.keep.append(word)
            s.name = C.addressof(word)
        if name == "imp_measure_options":
            word = C.create_string_buffer(b"materials")
            self.keep.append(word)
            s.rounds, s.max_iterations, s.stages = 1, 2, C.addressof(word)
        if name == "imp_plan_candidate" and function == "imp_plan_improve":
            s.placed, s.origin[1], s.origin[2] = True, -4, 1
        if name == "imp_check_options":
            self.keep.append(C.create_string_buffer(b"frozen,dot,euler,fresh,loss,ends,film"))
            s.paths, s.fresh_spp, s.draws_s, s.only = 8, 4, 1e-3, C.addressof(self.keep[-1])
        if name == "imp_selftest_options": s.samples, s.directions = 1000, 1
        if name == "imp_run": s.spp = 2
        if name == "imp_elements_fit_options": s.targets, s.max_iterations = doubles(1, .1), 2
        if name == "imp_bend_fit_options": s.iterations[0] = 2
        if name == "imp_dispersion": s.coefficient[:3] = [1.5, .004, 0]
        if name == "imp_bend_gradient": s.theta = doubles(4096)
        return s

    def good(self, a, function):
        """(value, what it points to: for outputs)"""
        key = function + "." + a.name
        if key == "imp_register_kind.ops": a = Argument("const struct imp_bsdf_ops *ops")
        if key == "imp_register_kind.layout": return lib.imp_kinds_of_library(), None
        if function in ("imp_course_value", "imp_spectrum_value") and a.pointer:
            # A course of one time, or a spectrum that is one number: an int, a count, values.
            one = C.addressof(self.array(C.c_double, 1, [1.]))
            words = [1, one, one] if "course" in function else [1, 1, one] + [0] * 61
            return C.addressof(self.array(C.c_size_t, len(words), words)), None
        name = a.type.replace("const ", "").replace("*", "").strip()
        xml = Argument("const char *xml")
        if function.startswith("imp_build_") and a.ctype in (C.c_int64, C.c_bool, C.c_int):
            return {"lo": 1, "hi": 3, "fallback": 2 if a.ctype is C.c_int64 else 0, "n": 1, "n_dims": 1, "status": 0}[a.name], None
        if a.name == "words": return C.addressof(self.array(C.c_char_p, 1, [b"word"])), None
        if a.name == "dims": return C.addressof(self.array(C.c_size_t, 1, [1])), None
        if not a.pointer:
            scalars = {"fallback": 1., "fraction": 1., "seed": 1, "flags": 0, "size": 64 if function == "imp_scene_geometry_name" else 8, "width": 4, "height": 4, "channels": 3, "length": len(self.good(xml, function)[0]) if "load_string" in function else len(PARAM) + 4 if "set_text" in function else 0, "weight": 1., "order": 1,
                       "index": 1.5 if a.ctype is C.c_double else 0, "cells": 1., "um": .5, "k": 1., "illuminance": 1.0, "background": 1., "confidence": .9, "white": 1., "a": 1., "b": 1.,
                       "radius": 2., "rounds": 1, "bytes": 1 << 20, "hi": 3., "lo": 1., "value": 1.5 if a.ctype is C.c_double else 1,
                       "n_vertices": 3, "n_lamps": 1, "n_wants": 1, "n_moves": 1, "n_triangles": 1, "layers": 1, "nx": 1, "ny": 1, "nz": 1, "a": 1., "pilots": 2, "n_groups": 1, "low": .1, "high": .9,
                       "n": {"imp_scene_set_values": 1, "imp_scene_spectrum": 2, "imp_problem_nlopt": 3}.get(function, 1)}
            zeros = {"scalar", "status", "cause", "sensor", "channel", "x", "y", "sample", "json", "i", "from_here",
                     "kind", "of", "time", "nm", "progress", "rays", "ray", "bundle", "n_walks", "target", "edge", "most", "subject", "from", "to", "luminaire", "lamp", "room", "sets", "stage"}
            if key == "imp_problem_tie.kind": return constants["IMP_TIE_LOG"], None
            if key == "imp_scene_place.param": return lib.imp_scene_n_params(self.scene), None
            if key == "imp_bend_image.target": return 4, None  # the fixture adds it
            if function == "imp_parts_create": return {"index": 1, "count": 2}[a.name], None
            if a.name in scalars: return scalars[a.name], None
            if a.name in zeros: return 0, None
            raise KeyError("no value known for " + a.text)
        if a.type == "const char *" or (a.text.startswith("const char *") and a.type.count("*") == 1):
            paths = {"imp_scene_load": os.path.join(top, "scenes", "furnace.xml"),
                     "imp_bend_load": os.path.join(top, "scenes", "bend", "maxwell.xml"),
                     "imp_film_write": self.folder + "/x.exr", "imp_elements_save": self.folder + "/x.el", "imp_weather_read": self.folder + "/x.epw",
                     "imp_elements_export": self.folder + "/x.ply", "imp_field_write": self.folder + "/x.npy",
                     "imp_parts_write": self.folder + "/x.part", "imp_checkpoint_free": self.folder + "/x.checkpoint", "imp_scene_write_volume": self.folder + "/x.vol", "imp_report_write": self.folder + "/x.html",
                     "imp_manifest_write": self.folder + "/x.proof", "imp_walks_write": self.folder + "/x.walks"}
            if key == "imp_manifest_output.path": return os.path.join(top, "scenes", "furnace.xml").encode(), None
            if key == "imp_manifest_read.path":
                path = (self.folder + "/read.proof").encode()
                if lib.imp_manifest_write(self.object("imp_manifest", ""), path) != OK: raise RuntimeError(self.said())
                return path, None
            if key == "imp_walks_read.path":
                w, path = self.object("imp_walks", ""), (self.folder + "/read.walks").encode()
                if lib.imp_walks_write(w, path) != OK: raise RuntimeError(self.said())
                return path, None
            if key == "imp_film_read.path":
                f, path = self.object("imp_film", ""), self.folder + "/read.exr"
                lib.imp_film_write(f, path.encode(), None)
                return path.encode(), None
            if key == "imp_field_read.path":
                f, path = self.object("imp_field", ""), self.folder + "/read.npy"
                lib.imp_field_write(f, path.encode())
                return path.encode(), None
            if key == "imp_elements_open.path":
                e, path = self.object("imp_elements", ""), self.folder + "/read.el"
                lib.imp_elements_save(e, path.encode())
                return path.encode(), None
            if a.name == "path": return paths[function].encode(), None
            if a.name == "xml":
                bend = open(os.path.join(top, "scenes", "bend", "rod.xml"), "rb").read()
                return (bend if "bend" in function else SCENE), None
            if a.name == "name":
                return {"imp_scene_find_param": PARAM.encode(), "imp_scene_add_geometry": b"lamp.pose"}.get(function, b"name"), None
            if a.name == "command": return b"command", None
            if key == "imp_problem_hold.glob": return (PARAM + "[0]").encode(), None
            if key == "imp_scene_set_text.text": return (PARAM + "=0.5").encode(), None
            words = {"fallback": b"text", "format": b"text", "names": b"R,G,B", "key": b"key", "value": b"value", "tag": b"shape", "type": b"sphere", "id": b"id", "layer": b"layer", "object": b"lamp",
                     "glob": PARAM.encode(), "kind": b"luneburg"}
            return words[a.name], None
        if key == "imp_problem_jacobian_sums.sums":  # [n_groups], or one for each number
            s = self.aligned(a.struct * 64)
            return C.addressof(s), s
        if a.struct is not None and (a.sized or a.struct.__name__ in ("imp_bend_rays", "imp_estimate")):
            s = self.struct(a.struct.__name__, function)
            self.keep.append(s)
            return C.addressof(s), s
        if name in ("imp_spec", "imp_v3"):
            v = self.array(C.c_double, 4)
            return C.addressof(v), None if a.const else v
        if name in ("struct imp_input", "struct imp_sink") or name == "imp_dot_fn":
            nothing = C.CFUNCTYPE(C.c_double)(lambda: 0.)
            s = self.aligned(a.struct) if a.struct is not None else None
            self.keep += [nothing, s]
            if s is None: return C.cast(nothing, C.c_void_p), None
            if name == "struct imp_sink": s.add = C.cast(nothing, C.c_void_p)
            else: s.count = 1  # one number, of parameter 0
            return C.addressof(s), None
        if a.struct is not None:  # arrays: exits, cotangents, arrivals
            s = self.aligned(a.struct * 4096)
            if key == "imp_bend_adjoint.exits":
                lib.imp_bend_trace(self.current_field, None, C.byref(self.struct("imp_bend_rays")), s, None, None)
            return C.addressof(s), None if a.const else s
        if name == "struct imp_build": return self.build(), None
        if name.startswith("imp_") and a.type.count("*") == 1:
            o = self.object(name, function)
            if name == "imp_field": self.current_field = o
            return o, None
        if key == "imp_problem_nlopt.problem": return self.object("imp_problem", function), None
        if a.name == "parts":
            fields = self.array(C.c_void_p, 1, [self.object("imp_field", function)])
            return C.addressof(fields), None
        if a.name == "memory": return None, None
        if key == "imp_parts_read.paths":
            path = (self.folder + "/read.part").encode()
            if lib.imp_parts_write(self.object("imp_parts", ""), path) != OK: raise RuntimeError(self.said())
            return C.addressof(self.array(C.c_char_p, 1, [path])), None
        if key == "imp_problem_jacobian_sums.films":
            return C.addressof(self.jacobian()) + C.sizeof(C.c_void_p), None
        if a.name == "group": return C.addressof(self.array(C.c_int, 3)), None
        doubles = {"theta": [1.5] * 4096, "samples": [1.5] * 4096, "values": [.5] * 4096, "wavelengths_nm": [400., 700.],
                   "params": [1.] * 16, "axis": [0., 0., 1.], "x": [.5] * 64, "value": [1., 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
                   "centre": [0.] * 3, "d": [0., 0., 1.] * 8, "power": [1.] * 8}
        if "double" in a.type:
            if function == "imp_scene_set_theta": values = self.theta()
            else: values = doubles.get(a.name, [0.] * 4096)
            if a.const or a.text.startswith("const"):
                v = self.array(C.c_double, len(values), values)
                return C.addressof(v), None
            v = self.array(C.c_double, 4096)
            return C.addressof(v), v
        if "float" in a.type:
            v = self.array(C.c_float, 4096, [0, 0, 0, 1, 0, 0, 0, 1, 0] + [.5] * 4000)
            return C.addressof(v), None if a.const else v
        if "uint32_t" in a.type: return C.addressof(self.array(C.c_uint32, 3, [0, 1, 2])), None
        if a.type.count("*") >= 1:  # outputs: an object, a row, a count
            v = self.array(C.c_void_p, 64)
            return C.addressof(v), v if name == "imp_film" else None
        raise KeyError("no value known for " + a.text)

    def theta(self):
        v = (C.c_double * 64)()
        lib.imp_scene_get_theta(self.scene, v)
        return list(v)

# ---- The calls -------------------------------------------------------------------------

def finite(values): return all(x == x and abs(x) != float("inf") for x in values)

def out_finite(outputs):
    """All numbers that came out. A film counts by its means."""
    for a, o in outputs:
        if o is None or a.const: continue
        if isinstance(o, C.Structure):
            for field, t in o._fields_:
                v = getattr(o, field)
                # Documented as NaN where there is nothing to say.
                if (a.struct.__name__, field) in {("imp_elements_info", "measure_adjoint")}: continue
                if a.struct.__name__ in ("imp_param_info", "imp_scene_info"): continue  # bounds
                if t is C.c_double and not finite([v]): return "%s.%s is %g" % (a.name, field, v)
        elif o._type_ in (C.c_double, C.c_float):
            if a.name in ("lo", "hi"): continue  # bounds may be infinite
            if not finite(o): return a.name + " is not finite"
        elif o._type_ is C.c_void_p and "imp_film" in a.type:
            for film in o:
                if not film: continue
                info = initial(structs["imp_film_info"])
                info.size = C.sizeof(info)
                lib.imp_film_get_info(film, C.byref(info))
                n = info.width * info.height * info.channels
                if not finite((C.c_float * n).from_address(lib.imp_film_mean(film))):
                    return "a pixel of %s is not finite" % a.name
    return None

class Call:
    def __init__(self, fx, function):
        self.fx, (self.result, self.name, self.arguments) = fx, function
        self.values, self.outputs = [], []
        for a in self.arguments:
            v, o = fx.good(a, self.name)
            if isinstance(v, bytes):
                b = C.create_string_buffer(v)
                fx.keep.append(b)
                v = C.addressof(b)
            self.values.append(v)
            self.outputs.append((a, o))

    def run(self):
        self.fx.forget()
        marker = self.fx.said()
        self.status = getattr(lib, self.name)(*self.values)
        said = self.fx.said()
        self.said = said if said != marker else ""
        return self.status

    def refuses(self, *names):
        """IMP_E_ARG with a message that names one of them; NULL or nothing without status."""
        self.run()
        if self.result == "enum imp_status" and self.status != E_ARG:
            return "status %d: %s" % (self.status, self.said)
        if self.result not in ("enum imp_status", "void") and not self.said: return None
        if not self.said: return "no message"
        if not any(re.search(r"\b%s\b" % re.escape(n), self.said) for n in names):
            return "names none of %s: %s" % (", ".join(names), self.said)
        return None

PAGE = mmap.PAGESIZE
libc = C.CDLL(None)
libc.mprotect.argtypes = [C.c_void_p, C.c_size_t, C.c_int]

def at_page_end(fx, data):
    """The bytes, ending where a page ends that may not be touched."""
    pages = mmap.mmap(-1, 3 * PAGE)
    fx.keep.append(pages)
    base = C.addressof(C.c_char.from_buffer(pages))
    libc.mprotect(base + 2 * PAGE, PAGE, 0)
    C.memmove(base + 2 * PAGE - len(data), data, len(data))
    return base + 2 * PAGE - len(data)

def cases(fx, function):
    """(what, None or what is wrong), one after the other."""
    result, name, arguments = function
    status = result == "enum imp_status"
    if re.search(r"_destroy$|imp_free", name):
        getattr(lib, name)(*[None] * len(arguments))
        yield "NULL", None
        return
    call = Call(fx, function)
    call.run()
    if not status: yield "good arguments", None
    if status:
        bad = None if (call.status == OK) != (name in NOT_OK) else "status %d: %s" % (call.status, call.said)
        yield "good arguments", bad or (out_finite(call.outputs) if call.status == OK else None)
    takes_field = name in ("imp_field_tie_create", "imp_field_scaled_create", "imp_field_sum_create", "imp_bend_create")
    for i, a in enumerate(arguments):
        key = name + "." + a.name
        if not a.pointer: continue
        call = Call(fx, function)
        call.values[i] = None
        if key in NULLABLE or (a.name in NULLABLE and key not in NOT_NULLABLE):
            call.run()
            yield a.name + " NULL is allowed", out_finite(call.outputs) if call.status == OK else None
        elif status or (result == "void" and "destroy" not in name):
            yield a.name + " NULL", call.refuses(a.name, "name" if a.name == "name" else a.name)
        else:
            call.run()
            yield a.name + " NULL", None
    for i, a in enumerate(arguments):
        if not a.sized: continue
        key = name + "." + a.name
        known = C.sizeof(a.struct)
        given = bytes(Call(fx, function).outputs[i][1] or initial(a.struct))
        for size in (0, 4, known - 1, known + 4096, 4096 * 8, 2**63):
            call = Call(fx, function)
            buffer = C.create_string_buffer(given, 8192)
            C.c_size_t.from_buffer(buffer).value = size
            call.values[i] = C.addressof(buffer)
            if name == "imp_dispersion_index":  # returns a number: NaN
                yield "%s of size %d" % (a.name, size), "a number" if call.run() == call.status else None
                continue
            yield "%s of size %d" % (a.name, size), call.refuses(a.name)
        for size in range(8, known + 25, 8):
            call = Call(fx, function)
            kept = (given + bytes(64))[:size]
            kept = size.to_bytes(8, "little") + kept[8:]
            guard = b"\xa5" * 64
            buffer = C.create_string_buffer(kept + guard, size + 64)
            call.values[i] = C.addressof(buffer)
            call.run()
            bad = None if buffer.raw[size:] == guard else "bytes behind it were written"
            newer_kind = a.struct.__name__.endswith("_ops") and size > known  # refused, kinds.h
            if status and size >= known and not newer_kind and not bad and (call.status == OK) == (name in NOT_OK):
                bad = "status %d: %s" % (call.status, call.said)
            if not a.const and key not in INPUT and status and call.status == OK and not bad and \
                    C.c_size_t.from_buffer(buffer).value != min(size, known):
                bad = "size is not what was written"
            if not bad:  # the same where nothing behind it can be read
                call = Call(fx, function)
                call.values[i] = at_page_end(fx, kept)
                call.run()
            yield "%s of size %d" % (a.name, size), bad
        if a.const and status:
            call = Call(fx, function)
            newer = (known + 8).to_bytes(8, "little") + given[8:] + b"\1" + bytes(7)
            buffer = C.create_string_buffer(newer, known + 8)
            call.values[i] = C.addressof(buffer)
            yield a.name + " with a newer field", call.refuses(a.name)
    for i, a in enumerate(arguments):
        key = name + "." + a.name
        for bad_number in (float("nan"), float("inf"), -float("inf")):
            places = []  # (what, names in the message, how to put it there)
            if a.ctype is C.c_double:
                def put(call, i=i): call.values[i] = bad_number
                places.append((a.name, [a.name], put))
            elif ("double" in a.type or "float" in a.type) and a.text.startswith("const"):
                t = C.c_double if "double" in a.type else C.c_float
                def put(call, i=i, t=t): t.from_address(call.values[i]).value = bad_number
                places.append((a.name + "[0]", [a.name], put))
            elif a.const and a.struct is not None and a.struct.__name__ != "imp_bend_rays":
                for field, t in a.struct._fields_:
                    if t is not C.c_double and getattr(t, "_type_", None) is not C.c_double: continue
                    at = getattr(a.struct, field).offset
                    def put(call, i=i, at=at): C.c_double.from_address(call.values[i] + at).value = bad_number
                    places.append(("%s.%s" % (a.struct.__name__, field), [a.name, field], put))
            for what, names, put in places:
                call = Call(fx, function)
                put(call)
                if key in ANY_NUMBER: what = key
                place = key if a.ctype is C.c_double or "." not in what else what
                why = ANY_NUMBER.get(place, ANY_NUMBER.get(key, ""))
                if (why and not (why.startswith("infinite") and bad_number != bad_number)) or not (status or call.result == "void"):
                    call.run()
                    bad = out_finite(call.outputs) if status and call.status == OK else None
                    yield "%s %g" % (what, bad_number), bad
                else:
                    yield "%s %g" % (what, bad_number), call.refuses(*names, *ALSO.get(key, []))

# ---- TAP -------------------------------------------------------------------------------

count = failed = 0

def tap(ok, what):
    global count, failed
    count += 1
    failed += not ok
    print("%sok %d - %s" % ("" if ok else "not ", count, what.replace("#", "")), flush=True)

tap(len(functions) - len(registers) == exported and len(registers) == 9,
    "every function of the headers was read: %d of %d" % (len(functions) - len(registers), exported))
for function in functions:
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        out = os.fdopen(writer, "w")
        n = 0
        try:
            fx = Fixture()
            for what, wrong in cases(fx, function):
                n += 1
                out.write("%s\t%s\n" % (what, (wrong or "").replace("\n", " ")))
                out.flush()
        except Exception as e:
            out.write("after %d cases\t%s: %s\n" % (n, type(e).__name__, e))
        out.flush()
        os._exit(0)
    os.close(writer)
    lines = os.fdopen(reader).read().splitlines()
    _, code = os.waitpid(child, 0)
    wrong = [x.split("\t") for x in lines if x.split("\t")[1]]
    for what, why in wrong: print("  # %s: %s: %s" % (function[1], what, why))
    if code: print("  # %s: ended with %d after %s" % (function[1], code, lines[-1] if lines else "nothing"))
    tap(not wrong and code == 0 and lines, "%s  %d calls" % (function[1], len(lines)))
print("1..%d" % count)
sys.exit(failed > 0)
