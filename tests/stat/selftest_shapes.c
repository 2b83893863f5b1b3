/* SPDX-License-Identifier: Apache-2.0
 *
 * imp_selftest of shapes: all that is built in keeps its contracts, and spheres that break one,
 * registered as a host would, fail the rows that say so. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/shape/shape.h"

static const struct imp_shape_ops *sphere(void)
{
    for (int k = 0; imp__shape_kinds[k]; k++)
        if (strcmp(imp__shape_kinds[k]->name, "sphere") == 0) return imp__shape_kinds[k];
    return NULL;
}

/* ---- Broken spheres ---------------------------------------------------------------- */

static enum imp_status half_build(const struct imp_build *b, void *self,
                                  struct imp_shape *s)
{
    const enum imp_status st = sphere()->build(b, self, s);
    s->hi[0] = 0.5 * (s->lo[0] + s->hi[0]);
    return st;
}
static enum imp_status large_build(const struct imp_build *b, void *self,
                                   struct imp_shape *s)
{
    const enum imp_status st = sphere()->build(b, self, s);
    s->area *= 1.1;
    return st;
}
static enum imp_status deaf_build(const struct imp_build *b, void *self,
                                  struct imp_shape *s)
{
    const enum imp_status st = sphere()->build(b, self, s);
    s->flip_normals = true; /* as it should have been built by */
    return st;
}
static void inward_surface(const struct imp_shape *s, const struct imp_hit *hit,
                           const imp_v3 *o, const imp_v3 *d, struct imp_surface *out)
{
    sphere()->surface(s, hit, o, d, out);
    out->ng = -out->ng;
    out->n = -out->n;
}
static void long_surface(const struct imp_shape *s, const struct imp_hit *hit,
                         const imp_v3 *o, const imp_v3 *d, struct imp_surface *out)
{
    sphere()->surface(s, hit, o, d, out);
    out->ng *= 1.00001;
}
static void leaning_surface(const struct imp_shape *s, const struct imp_hit *hit,
                            const imp_v3 *o, const imp_v3 *d, struct imp_surface *out)
{
    sphere()->surface(s, hit, o, d, out);
    out->ng = imp__normalize(out->ng + out->s * 0.02);
}
static void mirrored_surface(const struct imp_shape *s, const struct imp_hit *hit,
                             const imp_v3 *o, const imp_v3 *d, struct imp_surface *out)
{
    sphere()->surface(s, hit, o, d, out);
    out->uv[0] = 1 - out->uv[0];
}
static void steep_surface(const struct imp_shape *s, const struct imp_hit *hit,
                          const imp_v3 *o, const imp_v3 *d, struct imp_surface *out)
{
    sphere()->surface(s, hit, o, d, out);
    out->dp_dv *= 1.05;
}
static bool late_intersect(const struct imp_shape *s, const imp_v3 *o, const imp_v3 *d,
                           double tmin, double tmax, struct imp_hit *hit)
{
    if (!sphere()->intersect(s, o, d, tmin, tmax, hit)) return false;
    hit->t *= 1.0001;
    return true;
}
/* Hits behind tmax, too. */
static bool beyond_intersect(const struct imp_shape *s, const imp_v3 *o, const imp_v3 *d,
                             double tmin, double tmax, struct imp_hit *hit)
{
    return sphere()->intersect(s, o, d, tmin, tmax * 1.01, hit);
}
static bool small_toward(const struct imp_shape *s, const imp_v3 *ref, const double u[2],
                         struct imp_light_sample *out)
{
    if (!sphere()->sample_toward(s, ref, u, out)) return false;
    out->pdf *= 1.01;
    return true;
}
static bool dense_toward(const struct imp_shape *s, const imp_v3 *ref, const double u[2],
                         struct imp_light_sample *out)
{
    if (!sphere()->sample_toward(s, ref, u, out)) return false;
    out->pdf *= 1.1;
    return true;
}
static double dense_pdf(const struct imp_shape *s, const imp_v3 *ref,
                        const struct imp_hit *hit, const struct imp_surface *at)
{
    return 1.1 * sphere()->pdf_toward(s, ref, hit, at);
}
static void polar_area(const struct imp_shape *s, const double u[2],
                       struct imp_surface *out)
{
    sphere()->sample_area(s, (double[2]){u[0] * sqrt(u[0]), u[1]}, out);
}
static void shifted_area(const struct imp_shape *s, const double u[2],
                         struct imp_surface *out)
{
    sphere()->sample_area(s, u, out);
    out->p[0] += 1e-3;
}
static void back_move(struct imp_shape *s, const double to_world[12])
{
    double m[12];
    memcpy(m, to_world, sizeof m);
    for (int i = 0; i < 3; i++) m[4 * i + 3] = -m[4 * i + 3];
    sphere()->move(s, m);
}
/* The transpose: turns to the other side. */
static void other_move(struct imp_shape *s, const double to_world[12])
{
    double m[12];
    for (int k = 0; k < 12; k++)
        m[k] = k % 4 == 3 ? to_world[k] : to_world[4 * (k % 4) + k / 4];
    sphere()->move(s, m);
}

/* What fails; rows that may fail by the same mistake, in brackets. */
struct broken {
    const char *name, *fails, *may;
};
static const struct broken broken[] = {
    {"half", "box met drawn", "towards area points moves"},
    {"large", "area points", "moves"},
    {"deaf", "sides", ""},
    {"inward", "sides uv drawn", "towards"},
    {"long", "normal", ""},
    {"leaning", "normal", "uv drawn sides"},
    {"mirrored", "uv", "drawn"},
    {"steep", "uv", ""},
    {"late", "hits", ""},
    {"beyond", "hits", ""},
    {"small", "density", ""},
    {"dense", "angle", ""},
    {"polar", "points", ""},
    {"shifted", "drawn", "points"},
    {"back", "moves", ""},
    {"other", "moves", ""},
    {"right", "", ""}};

static void broken_register(imp_context *ctx)
{
    for (size_t k = 0; k < imp_count(broken); k++) {
        struct imp_shape_ops ops = *sphere();
        const char *name = ops.name = broken[k].name;
        if (strcmp(name, "half") == 0) ops.build = half_build;
        if (strcmp(name, "large") == 0) ops.build = large_build;
        if (strcmp(name, "deaf") == 0) ops.build = deaf_build;
        if (strcmp(name, "inward") == 0) ops.surface = inward_surface;
        if (strcmp(name, "long") == 0) ops.surface = long_surface;
        if (strcmp(name, "leaning") == 0) ops.surface = leaning_surface;
        if (strcmp(name, "mirrored") == 0) ops.surface = mirrored_surface;
        if (strcmp(name, "steep") == 0) ops.surface = steep_surface;
        if (strcmp(name, "late") == 0) ops.intersect = late_intersect;
        if (strcmp(name, "beyond") == 0) ops.intersect = beyond_intersect;
        if (strcmp(name, "small") == 0) ops.sample_toward = small_toward;
        if (strcmp(name, "dense") == 0) ops.sample_toward = dense_toward;
        if (strcmp(name, "dense") == 0) ops.pdf_toward = dense_pdf;
        if (strcmp(name, "polar") == 0) ops.sample_area = polar_area;
        if (strcmp(name, "shifted") == 0) ops.sample_area = shifted_area;
        if (strcmp(name, "back") == 0) ops.move = back_move;
        if (strcmp(name, "other") == 0) ops.move = other_move;
        test_must(ctx, imp_register_shape(ctx, &ops));
    }
}

static bool listed(const char *list, const char *word)
{
    const size_t n = strlen(word);
    for (const char *at = strstr(list, word); at; at = strstr(at + n, word))
        if ((at == list || at[-1] == ' ') && (at[n] == ' ' || at[n] == 0)) return true;
    return false;
}

/* All of `fails` are there, and none but `may` beside them. */
static void caught(const struct imp_selftest_row *rows, size_t n, const struct broken *b)
{
    size_t seen = 0, wanted = *b->fails ? 1 : 0, told = 0;
    bool right = true;
    char found[200] = "";
    for (const char *c = b->fails; *c; c++) wanted += *c == ' ';
    for (size_t k = 0; k < n; k++) {
        if (strcmp(rows[k].object, b->name) != 0) continue;
        seen++;
        if (rows[k].ok != 0) continue;
        const size_t used = strlen(found);
        snprintf(found + used, sizeof found - used, "%s%s", used ? " " : "",
                 rows[k].contract);
        told += listed(b->fails, rows[k].contract);
        right &= listed(b->fails, rows[k].contract) || listed(b->may, rows[k].contract);
    }
    tap_ok(right && seen > 0 && told == wanted, "%s: %s # found: %s", b->name,
           *b->fails ? b->fails : "nothing", *found ? found : "nothing");
}

static void planted(void)
{
    imp_context *ctx = test_context(1);
    imp_scene *s;
    const struct imp_selftest_row *rows;
    struct imp_selftest_options o = IMP_SELFTEST_OPTIONS_INIT;
    size_t n;
    broken_register(ctx);
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    for (size_t k = 0; k < imp_count(broken); k++) {
        imp_scene_begin(s, "shape", broken[k].name, broken[k].name, NULL);
        imp_scene_vector(s, "center", (double[3]){4. * (double)k, 1, 2});
        imp_scene_end(s);
    }
    test_must(ctx, imp_scene_commit(s));
    o.samples = 60000;
    test_must(ctx, imp_selftest(s, IMP_SELFTEST_SHAPE, &o, &rows, &n));
    for (size_t k = 0; k < imp_count(broken); k++) caught(rows, n, &broken[k]);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

/* ---- Honest scenes ----------------------------------------------------------------- */

#define PLACED(map) "<transform name='to_world'>" map "</transform>"
#define STRETCH     "<rotate x='1' angle='33'/><scale x='2' y='.5' z='1'/><translate x='9'/>"
#define MIRROR      "<scale x='-1' y='1' z='1'/><translate x='4'/>"
#define LIGHT       "<emitter type='area'><rgb name='radiance' value='1,1,1'/></emitter>"
#define FLIP        "<boolean name='flip_normals' value='true'/>"

static const char all[] =
    "<scene version='3.0.0'>"
    "<shape type='sphere'><float name='radius' value='.7'/>"
    "<vector name='center' x='100' y='-40' z='3'/></shape>"
    "<shape type='sphere'>" PLACED(
        MIRROR) "</shape>"
                "<shape type='sphere'>" FLIP PLACED(
                    MIRROR) "</shape>"
                            "<shape type='rectangle'>" PLACED(
                                STRETCH) "</shape>"
                                         "<shape type='rectangle'>" FLIP "</shape>"
                                         "<shape type='disk'>" PLACED(
                                             STRETCH) "</shape>"
                                                      "<shape type='cylinder'><vector "
                                                      "name='p1' x='0' y='1' z='5'/>"
                                                      "<float name='radius' "
                                                      "value='.1'/></shape>"
                                                      "<shape type='cylinder'>" PLACED(
                                                          STRETCH) "</shape>"
                                                                   "<shape "
                                                                   "type='cylinder'>" FLIP PLACED(
                                                                       MIRROR) "</shape>"
                                                                               "<shape "
                                                                               "type='"
                                                                               "cube'"
                                                                               ">" LIGHT PLACED(
                                                                                   STRETCH) "</shape>"
                                                                                            "<shape type='cube'>" FLIP
                                                                                            "</shape></scene>";

static void passes(imp_scene *s, imp_context *ctx, const char *what)
{
    const struct imp_selftest_row *rows;
    struct imp_selftest_options o = IMP_SELFTEST_OPTIONS_INIT;
    size_t n, failed = 0;
    o.samples = 60000;
    test_must(ctx, imp_selftest(s, IMP_SELFTEST_SHAPE, &o, &rows, &n));
    for (size_t k = 0; k < n; k++) {
        if (rows[k].ok != 0) continue;
        failed++;
        printf("# %s (%s) %s: %g, %g +- %g, error %g, limit %g\n", rows[k].object,
               rows[k].kind, rows[k].contract, rows[k].value, rows[k].reference,
               rows[k].se, rows[k].error, rows[k].limit);
    }
    tap_ok(failed == 0 && n > 0, "%s # %zu rows", what, n);
    imp_scene_destroy(s);
}

/* Each kind that can be made of nothing but its defaults: a new one is tested by existing. */
static void every_kind(imp_context *ctx)
{
    static const char *const of_files[] = {"mesh",       "obj",          "ply",
                                           "serialized", "bsplinecurve", "linearcurve"};
    for (int k = 0; imp__shape_kinds[k]; k++) {
        const char *name = imp__shape_kinds[k]->name;
        bool file = false;
        for (size_t i = 0; i < imp_count(of_files); i++)
            file |= strcmp(of_files[i], name) == 0;
        if (file) continue;
        char text[200];
        snprintf(text, sizeof text,
                 "<scene version='3.0.0'><shape type='%s'>" LIGHT "</shape></scene>",
                 name);
        passes(test_scene_text(ctx, text, IMP_RGB), ctx, name);
    }
}

int main(void)
{
    planted();
    imp_context *ctx = test_context(1);
    every_kind(ctx);
    passes(test_scene_text(ctx, all, IMP_RGB), ctx, "all kinds, placed in many ways");
    static const char *const files[] = {"cornell.xml",
                                        "orchard.xml",
                                        "office.xml",
                                        "../tests/render/peer/meshes.xml",
                                        "../tests/render/peer/curves.xml",
                                        "../tests/render/peer/room_things.xml"};
    for (size_t k = 0; k < imp_count(files); k++)
        passes(test_scene(ctx, files[k], IMP_RGB, NULL), ctx, files[k]);
    imp_context_destroy(ctx);
    return tap_done();
}
