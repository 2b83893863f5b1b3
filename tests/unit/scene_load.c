/* SPDX-License-Identifier: Apache-2.0
 *
 * Scenes from text, from files and by calls: the same scene either way; failures keep
 * their place and lose nothing. */
#include "imp_fail_alloc.h"
#include "imp_tap.h"
#include <importon/importon.h>
#include <limits.h>
#include <stdbool.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static imp_context *ctx;
static char folder[] = "/tmp/importon-load-XXXXXX";

static const char *put(const char *name, const char *text, size_t n)
{
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(text, 1, n, f) != n) exit(1);
    fclose(f);
    return path;
}

static const char scene_xml[] =
    "<scene version='3.0.0'>\n"
    " <integrator type='path'><integer name='max_depth' value='4'/></integrator>\n"
    " <sensor type='perspective'><float name='fov' value='40'/>\n"
    "  <transform name='to_world'><lookat origin='0 0 -5' target='0 0 0'/></transform>\n"
    "  <film type='hdrfilm'><integer name='width' value='8'/><integer name='height' "
    "value='6'/>"
    "<rfilter type='box'/></film><sampler type='independent'>"
    "<integer name='sample_count' value='2'/></sampler></sensor>\n"
    " <bsdf type='diffuse' id='red'><rgb name='reflectance' value='.5 .1 .2'/></bsdf>\n"
    " <shape type='sphere' id='ball'><point name='center' value='0 0 1'/><ref "
    "id='red'/></shape>\n"
    " <shape type='rectangle' id='lamp'><emitter type='area' id='light'>"
    "<spectrum name='radiance' value='400:1, 700:3'/></emitter></shape>\n"
    "</scene>\n";

/* The scene of scene_xml. */
static void build(imp_scene *s)
{
    static const double look[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -5, 0, 0, 0, 1};
    static const double red[] = {.5, .1, .2}, center[] = {0, 0, 1}, nm[] = {400, 700},
                        power[] = {1, 3};
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_integer(s, "max_depth", 4);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_float(s, "fov", 40);
    imp_scene_transform(s, "to_world", look);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", 8);
    imp_scene_integer(s, "height", 6);
    imp_scene_begin(s, "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "sampler", "independent", NULL, NULL);
    imp_scene_integer(s, "sample_count", 2);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "bsdf", "diffuse", "red", NULL);
    imp_scene_rgb(s, "reflectance", red);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "sphere", "ball", NULL);
    imp_scene_vector(s, "center", center);
    imp_scene_ref(s, "red", NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", "lamp", NULL);
    imp_scene_begin(s, "emitter", "area", "light", NULL);
    imp_scene_spectrum(s, "radiance", 2, nm, power);
    imp_scene_end(s);
    imp_scene_end(s);
}

/* The same by types alone, and a spectrum that is one value. */
static void build_by_types(imp_scene *s, bool by_types, const char *xml, imp_scene **file)
{
    const double value = 0.25;
    imp_scene_begin(s, by_types ? NULL : "sensor", "perspective", NULL, NULL);
    imp_scene_begin(s, by_types ? NULL : "film", "hdrfilm", NULL, NULL);
    imp_scene_begin(s, by_types ? NULL : "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, by_types ? NULL : "integrator", "path", NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, by_types ? NULL : "emitter", "constant", "sky", NULL);
    imp_scene_spectrum(s, "radiance", 1, NULL, &value);
    imp_scene_end(s);
    if (imp_scene_load_string(ctx, xml, strlen(xml), NULL, NULL, file) != IMP_OK)
        printf("# %s\n", imp_last_error(ctx));
}

static bool same_theta(const imp_scene *a, const imp_scene *b)
{
    if (imp_scene_n_params(a) != imp_scene_n_params(b) || imp_scene_n_params(a) == 0)
        return false;
    for (size_t i = 0; i < imp_scene_n_params(a); i++) {
        struct imp_param_info p = {.size = sizeof p}, q = {.size = sizeof q};
        if (imp_scene_get_param(a, i, &p) != IMP_OK ||
            imp_scene_get_param(b, i, &q) != IMP_OK || strcmp(p.name, q.name) != 0 ||
            p.count != q.count)
            return false;
        double x[16], y[16];
        if (p.count > 16 || imp_scene_get_values(a, i, x) != IMP_OK ||
            imp_scene_get_values(b, i, y) != IMP_OK ||
            memcmp(x, y, p.count * sizeof *x) != 0)
            return false;
    }
    return true;
}

static void check_same(void)
{
    imp_scene *a = NULL, *b = NULL;
    enum imp_status st =
        imp_scene_load_string(ctx, scene_xml, sizeof scene_xml - 1, "s.xml", NULL, &a);
    tap_ok(st == IMP_OK, "from text # %s", st ? imp_last_error(ctx) : "");
    st = imp_scene_create(ctx, NULL, &b);
    if (st == IMP_OK) {
        build(b);
        st = imp_scene_commit(b);
    }
    tap_ok(st == IMP_OK, "by calls # %s", st ? imp_last_error(ctx) : "");
    if (a && st == IMP_OK) {
        struct imp_scene_info i = {.size = sizeof i}, k = {.size = sizeof k};
        imp_scene_get_info(a, &i);
        imp_scene_get_info(b, &k);
        tap_ok(i.n_shapes == 2 && k.n_shapes == 2 && i.n_emitters == 1 &&
                   k.n_emitters == 1 && i.max_depth == 4 && k.max_depth == 4,
               "the same objects");
        tap_ok(same_theta(a, b), "the same parameters");
        struct imp_run run = IMP_RUN_INIT;
        imp_film *p = NULL, *q = NULL;
        if (imp_render(a, &run, &p) == IMP_OK && imp_render(b, &run, &q) == IMP_OK)
            tap_ok(memcmp(imp_film_mean(p), imp_film_mean(q),
                          8 * 6 * 3 * sizeof(float)) == 0,
                   "the same picture");
        imp_film_destroy(p);
        imp_film_destroy(q);
        tap_ok(imp_scene_commit(b) == IMP_E_ARG, "a scene is committed once # %s",
               imp_last_error(ctx));
    }
    imp_scene_destroy(a);
    imp_scene_destroy(b);
    imp_scene_destroy(NULL);
}

static void check_types(void)
{
    static const char xml[] =
        "<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'>"
        "<rfilter type='box'/></film></sensor><integrator type='path'/>"
        "<emitter type='constant' id='sky'><spectrum name='radiance' value='0.25'/>"
        "</emitter></scene>";
    for (int by_types = 0; by_types < 2; by_types++) {
        imp_scene *s = NULL, *file = NULL;
        if (imp_scene_create(ctx, NULL, &s) != IMP_OK) return;
        build_by_types(s, by_types, xml, &file);
        const enum imp_status st = imp_scene_commit(s);
        tap_ok(st == IMP_OK && file && same_theta(s, file), "%s, one value # %s",
               by_types ? "types without tags" : "tags and types",
               st ? imp_last_error(ctx) : "");
        imp_scene_destroy(s);
        imp_scene_destroy(file);
    }
    static const char *const unknown[][2] = {{"spere", "did you mean 'sphere'?"},
                                             {"hdrfilmm", "did you mean 'hdrfilm'?"},
                                             {"prbb", "did you mean 'prb'?"},
                                             {"zzzzzzzz", "no plugin 'zzzzzzzz'"}};
    for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++) {
        imp_scene *s = NULL;
        if (imp_scene_create(ctx, NULL, &s) != IMP_OK) return;
        imp_scene_begin(s, NULL, unknown[i][0], NULL, NULL);
        tap_ok(imp_scene_commit(s) == IMP_E_UNSUPPORTED &&
                   strstr(imp_last_error(ctx), unknown[i][1]),
               "no such type # %s", imp_last_error(ctx));
        imp_scene_destroy(s);
    }
}

/* ---- Building calls that fail ---------------------------------------------------------
 */

enum fault {
    F_END,
    F_OPEN,
    F_TAG,
    F_TWICE,
    F_ID,
    F_REF,
    F_CYCLE,
    F_NAN,
    F_NULL,
    F_SPECTRUM,
    F_MESH_PLACE,
    F_MESH_EMPTY,
    F_MESH_INDEX,
    F_MESH_NAN,
    F_IMAGE,
    F_GRID_PLACE,
    F_GRID_SIZE,
    F_GRID_HUGE,
    F_GRID_CHANNELS,
    F_GRID_NAN,
    F_UNUSED,
    F_TYPE,
    N_FAULTS
};
static const struct {
    const char *message;
    enum imp_status st;
} faults[N_FAULTS] = {
    [F_END] = {"scene: end without begin", IMP_E_ARG},
    [F_OPEN] = {"scene: shape (sphere): begin without end", IMP_E_ARG},
    [F_TAG] = {"scene: 'banana' of type 'x' is no object", IMP_E_ARG},
    [F_TWICE] = {"scene: shape: 'radius' is given twice (first at scene)", IMP_E_SCENE},
    [F_ID] = {"scene: id 'a' is used twice (first at scene)", IMP_E_SCENE},
    [F_REF] = {"scene: reference to unknown id 'nobody'", IMP_E_SCENE},
    [F_CYCLE] = {"scene: reference to 'a' makes a cycle", IMP_E_SCENE},
    [F_NAN] = {"scene: value of shape 'radius' is nan", IMP_E_ARG},
    [F_NULL] = {"scene: a property's name is NULL", IMP_E_ARG},
    [F_SPECTRUM] =
        {"scene: spectrum 'radiance': a spectrum needs at least two wavelengths",
         IMP_E_ARG},
    [F_MESH_PLACE] =
        {"scene: shape (sphere): triangles are for a shape of type 'mesh', once",
         IMP_E_ARG},
    [F_MESH_EMPTY] =
        {"scene: shape (mesh): needs between 1 and 2^31 vertices and triangles",
         IMP_E_ARG},
    [F_MESH_INDEX] = {"scene: shape (mesh): triangle 0 names vertex 3; there are 3",
                      IMP_E_SCENE},
    [F_MESH_NAN] = {"scene: shape (mesh): positions[3] is nan", IMP_E_ARG},
    [F_IMAGE] = {"scene: texture (bitmap): a picture of 2 x 0 with 3 channels",
                 IMP_E_ARG},
    [F_GRID_PLACE] =
        {"scene: volume (constvolume): cells are for a volume of type 'gridvolume', once",
         IMP_E_ARG},
    [F_GRID_SIZE] = {"scene: volume (gridvolume): a grid of 3 x 0 x 1 cells", IMP_E_ARG},
    [F_GRID_HUGE] =
        {"scene: volume (gridvolume): a grid of 2147483647 x 2147483647 x 9 cells",
         IMP_E_ARG},
    [F_GRID_CHANNELS] =
        {"scene: volume (gridvolume): a grid with 2 channels; 1 or 3 are possible",
         IMP_E_ARG},
    [F_GRID_NAN] = {"scene: volume (gridvolume): values[3] is nan", IMP_E_ARG},
    [F_UNUSED] = {"scene: shape (sphere): not a property of this plugin: 'colour'",
                  IMP_E_SCENE},
    [F_TYPE] = {"scene: shape (sphere): property 'radius' must be a float, not a string",
                IMP_E_SCENE},
};

static void fault_make(imp_scene *s, enum fault f)
{
    static const float xyz[] = {0, 0, 0, 1, 0, 0, 0, 1, 0},
                       nan_xyz[] = {0, 0, 0, NAN, 0, 0, 0, 1, 0};
    static const uint32_t tri[] = {0, 1, 2}, bad[] = {0, 1, 3};
    static const double one[] = {500};
    const bool meshes = f == F_MESH_EMPTY || f == F_MESH_INDEX || f == F_MESH_NAN;
    switch (f) {
    case F_END: imp_scene_end(s); return;
    case F_TAG: imp_scene_begin(s, "banana", "x", NULL, NULL); return;
    case F_ID:
        imp_scene_begin(s, "bsdf", "diffuse", "a", NULL);
        imp_scene_end(s);
        imp_scene_begin(s, "bsdf", "diffuse", "a", NULL);
        imp_scene_end(s);
        return;
    case F_REF: imp_scene_ref(s, "nobody", NULL); return;
    case F_CYCLE:
        imp_scene_begin(s, "bsdf", "twosided", "a", NULL);
        imp_scene_ref(s, "a", NULL);
        imp_scene_end(s);
        return;
    case F_SPECTRUM:
        imp_scene_begin(s, "emitter", "constant", NULL, NULL);
        imp_scene_spectrum(s, "radiance", 1, one, one);
        imp_scene_end(s);
        return;
    case F_IMAGE:
        imp_scene_begin(s, "texture", "bitmap", NULL, NULL);
        imp_scene_image(s, 2, 0, 3, xyz);
        imp_scene_end(s);
        return;
    case F_GRID_PLACE:
        imp_scene_begin(s, "volume", "constvolume", NULL, NULL);
        imp_scene_grid(s, 3, 1, 1, 1, xyz);
        imp_scene_end(s);
        return;
    case F_GRID_SIZE:
    case F_GRID_HUGE:
    case F_GRID_CHANNELS:
    case F_GRID_NAN:
        imp_scene_begin(s, "volume", "gridvolume", NULL, NULL);
        if (f == F_GRID_SIZE) imp_scene_grid(s, 3, 0, 1, 1, xyz);
        if (f == F_GRID_HUGE) imp_scene_grid(s, INT_MAX, INT_MAX, 9, 3, xyz);
        if (f == F_GRID_CHANNELS) imp_scene_grid(s, 2, 2, 1, 2, xyz);
        if (f == F_GRID_NAN) imp_scene_grid(s, 3, 1, 1, 3, nan_xyz);
        imp_scene_end(s);
        return;
    default: break;
    }
    imp_scene_begin(s, "shape", meshes ? "mesh" : "sphere", NULL, NULL);
    if (f == F_TWICE || f == F_TYPE) imp_scene_string(s, "radius", "1");
    if (f == F_TWICE) imp_scene_float(s, "radius", 1);
    if (f == F_NAN) imp_scene_float(s, "radius", NAN);
    if (f == F_NULL) imp_scene_float(s, NULL, 1);
    if (f == F_UNUSED) imp_scene_float(s, "colour", 1);
    if (f == F_MESH_PLACE) imp_scene_mesh(s, 3, 1, xyz, NULL, NULL, tri);
    if (f == F_MESH_EMPTY) imp_scene_mesh(s, 3, 0, xyz, NULL, NULL, tri);
    if (f == F_MESH_INDEX) imp_scene_mesh(s, 3, 1, xyz, NULL, NULL, bad);
    if (f == F_MESH_NAN) imp_scene_mesh(s, 3, 1, nan_xyz, NULL, NULL, tri);
    if (f != F_OPEN) imp_scene_end(s);
}

static void check_faults(void)
{
    for (int f = 0; f < N_FAULTS; f++) {
        imp_scene *s = NULL;
        if (imp_scene_create(ctx, NULL, &s) != IMP_OK) continue;
        fault_make(s, (enum fault)f);
        imp_scene_begin(s, "bsdf", "diffuse", NULL, NULL); /* ignored, or harmless */
        imp_scene_end(s);
        const enum imp_status st = imp_scene_commit(s), again = imp_scene_commit(s);
        const bool ok = st == faults[f].st && again == st &&
                        strncmp(imp_last_error(ctx), faults[f].message,
                                strlen(faults[f].message)) == 0;
        tap_ok(ok, "%s", faults[f].message);
        if (!ok) printf("# %d %d %s\n", st, again, imp_last_error(ctx));
        imp_scene_destroy(s);
    }
    imp_scene *s = NULL;
    static const char *const nonsense[] = {"x"};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    o.mode = (enum imp_color_mode)7;
    tap_ok(imp_scene_create(ctx, &o, &s) == IMP_E_ARG && !s, "an unknown colour mode");
    o.mode = IMP_RGB;
    o.n_search = 1;
    tap_ok(imp_scene_create(ctx, &o, &s) == IMP_E_ARG && !s,
           "search folders that are NULL");
    o.n_search = 0;
    o.n_defines = 1;
    o.defines = nonsense;
    tap_ok(imp_scene_load_string(ctx, scene_xml, sizeof scene_xml - 1, NULL, &o, &s) ==
                   IMP_E_ARG &&
               !s,
           "a definition without a value");
    imp_scene_float(NULL, "a", 1);
    tap_ok(imp_scene_commit(NULL) == IMP_E_ARG &&
               imp_scene_load(ctx, NULL, NULL, &s) == IMP_E_ARG &&
               imp_scene_load(ctx, "x.xml", NULL, NULL) == IMP_E_ARG,
           "NULL arguments");
}

/* ---- Files ----------------------------------------------------------------------------
 */

static void check_files(void)
{
    static const char obj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt .25 .25\nf 1/1 2/1 3/1\n";
    static const char pfm[] = "PF\n1 1\n-1\n\0\0\x80\x3f\0\0\0\x3f\0\0\0\0";
    put("tri.obj", obj, sizeof obj - 1);
    put("bad.obj", "v 0 0 nan\n", 10);
    put("red.pfm", pfm, sizeof pfm - 1);
    put("cut.pfm", pfm, sizeof pfm - 5);
    static const struct {
        const char *body, *message;
        enum imp_status st;
    } cases[] = {
        {"<shape type='obj'><string name='filename' value='tri.obj'/></shape>", NULL,
         IMP_OK},
        {"<shape type='obj'><string name='filename' value='tri.obj'/>"
         "<boolean name='flip_tex_coords' value='false'/><bsdf type='diffuse'>"
         "<texture name='reflectance' type='bitmap'><string name='filename' "
         "value='red.pfm'/>"
         "</texture></bsdf></shape>",
         NULL, IMP_OK},
        {"<shape type='obj'><string name='filename' value='bad.obj'/></shape>",
         "D/m.xml:2:19: shape (obj): D/bad.obj:1: vertex 1 is not finite", IMP_E_SCENE},
        {"<shape type='ply'><string name='filename' value='tri.obj'/></shape>",
         "D/m.xml:2:19: shape (ply): D/tri.obj: not a PLY file", IMP_E_SCENE},
        {"<shape type='obj'><string name='filename' value='none.obj'/></shape>",
         "D/m.xml:2:19: shape (obj): filename: cannot find 'none.obj' (looked in: ., D)",
         IMP_E_IO},
        {"<shape type='obj'/>",
         "D/m.xml:2:1: shape (obj): property 'filename' is missing", IMP_E_SCENE},
        {"<shape type='obj'>\n<string name='file_name' value='tri.obj'/></shape>",
         "D/m.xml:2:1: shape (obj): property 'filename' is missing; did you mean it by "
         "'file_name' (D/m.xml:3:1)?",
         IMP_E_SCENE},
        {"<bsdf type='blendbsdf'><bsdf type='diffuse'/><bsdf type='diffuse'/>\n<texture "
         "type='checkerboard' name='wieght'/></bsdf>",
         "D/m.xml:2:1: bsdf 'bsdf0' (blendbsdf): property 'weight' is missing; did you "
         "mean "
         "it by 'wieght' (D/m.xml:3:1)?",
         IMP_E_SCENE},
        {"<shape type='obj'><integer name='filename' value='1'/></shape>",
         "D/m.xml:2:19: shape (obj): property 'filename' must be a string, not an "
         "integer",
         IMP_E_SCENE},
        {"<bsdf type='diffuse' id='a'><texture name='reflectance' type='bitmap' id='t'>"
         "<string name='filename' value='cut.pfm'/></texture></bsdf>",
         "D/m.xml:2:78: texture 't' (bitmap): D/cut.pfm: cut off", IMP_E_SCENE},
        {"<shape type='teapot'/>",
         "D/m.xml:2:1: shape (teapot): this version has no such shape",
         IMP_E_UNSUPPORTED},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[1024], want[512];
        const int n = snprintf(text, sizeof text, "<scene version='3.0.0'>\n%s</scene>",
                               cases[i].body);
        const char *path = put("m.xml", text, (size_t)n);
        imp_scene *s = NULL;
        const enum imp_status st = imp_scene_load(ctx, path, NULL, &s);
        size_t m = 0;
        for (const char *c = cases[i].message ? cases[i].message : ""; *c; c++)
            if (*c == 'D') m += (size_t)sprintf(want + m, "%s", folder);
            else want[m++] = *c;
        want[m] = 0;
        const bool ok = st == cases[i].st && (st == IMP_OK) == (s != NULL) &&
                        (st == IMP_OK || strncmp(imp_last_error(ctx), want, m) == 0);
        tap_ok(ok, "%s", cases[i].message ? cases[i].message : "files are read");
        if (!ok) printf("# %d %s\n", st, imp_last_error(ctx));
        imp_scene_destroy(s);
    }
    imp_scene *s = NULL;
    tap_ok(imp_scene_load(ctx, "no/such.xml", NULL, &s) == IMP_E_IO && !s,
           "no such scene # %s", imp_last_error(ctx));
    static const char here[] =
        "<scene version='3.0.0'><shape type='obj'>"
        "<string name='filename' value='tri.obj'/></shape></scene>";
    const char *search[] = {folder};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    o.search = search;
    o.n_search = 1;
    tap_ok(imp_scene_load_string(ctx, here, sizeof here - 1, "x", &o, &s) == IMP_OK,
           "files are found in the caller's folders # %s", s ? "" : imp_last_error(ctx));
    imp_scene_destroy(s);
}

/* ---- Memory ---------------------------------------------------------------------------
 */

static void check_memory(void)
{
    struct fail_alloc heap = {0};
    imp_context *fragile = fail_alloc_context(&heap);
    static const char xml[] =
        "<scene version='3.0.0'><bsdf type='diffuse' id='a'><rgb name='reflectance' "
        "value='.5'/></bsdf>"
        "<shape type='sphere'><ref id='a'/></shape><shape type='obj'>"
        "<string name='filename' value='tri.obj'/><bsdf type='diffuse'><texture "
        "type='bitmap' "
        "name='reflectance'><string name='filename' "
        "value='red.pfm'/></texture></bsdf></shape></scene>";
    const char *search[] = {folder};
    struct imp_load_options load = IMP_LOAD_OPTIONS_INIT;
    load.search = search;
    load.n_search = 1;
    int steps = 0, wrong = 0;
    for (enum imp_status st = IMP_E_NOMEM; st != IMP_OK && steps < 5000; steps++) {
        imp_scene *s = NULL;
        heap.calls = 0;
        heap.fail_at = steps + 1;
        st = imp_scene_load_string(fragile, xml, sizeof xml - 1, "x", &load, &s);
        heap.fail_at = 0;
        wrong += st != IMP_OK && st != IMP_E_NOMEM;
        if (st != IMP_OK && st != IMP_E_NOMEM)
            printf("# step %d: %s\n", steps, imp_last_error(fragile));
        wrong += (st == IMP_OK) != (s != NULL);
        imp_scene_destroy(s);
    }
    for (enum imp_status st = IMP_E_NOMEM; st != IMP_OK && steps < 5000; steps++) {
        imp_scene *s = NULL;
        heap.calls = 0;
        heap.fail_at = steps + 1;
        st = imp_scene_create(fragile, NULL, &s);
        if (st == IMP_OK) build(s);
        if (st == IMP_OK) st = imp_scene_commit(s);
        heap.fail_at = 0;
        wrong += st != IMP_OK && st != IMP_E_NOMEM;
        imp_scene_destroy(s);
    }
    imp_context_destroy(fragile);
    tap_ok(steps > 10 && steps < 5000 && wrong == 0 && heap.live == 0,
           "no memory at the n-th allocation # %d allocations, %d wrong, %ld leaked",
           steps, wrong, heap.live);
}

int main(void)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    o.threads = 1;
    if (imp_context_create(&o, &ctx) != IMP_OK || !mkdtemp(folder)) return 1;
    check_same();
    check_types();
    check_faults();
    check_files();
    check_memory();
    char command[300];
    snprintf(command, sizeof command, "rm -r %s", folder);
    if (system(command) != 0) printf("# %s stays\n", folder);
    imp_context_destroy(ctx);
    return tap_done();
}
