/* SPDX-License-Identifier: Apache-2.0
 *
 * Instances beside copies of the same shapes: ray by ray the same shape, place, surface and
 * material; the same pictures and gradients. Sheared, mirrored, nested and moving ones, of
 * meshes and of analytic shapes; bump maps in all of these. */
#include "scene/instances.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include <unistd.h>

#define RAYS 20000

static imp_context *ctx;

struct text {
    char *at;
    size_t n, size;
};
__attribute__((format(printf, 2, 3))) static void put(struct text *t, const char *format,
                                                      ...)
{
    char line[4096];
    va_list args;
    va_start(args, format);
    const int n = vsnprintf(line, sizeof line, format, args);
    va_end(args);
    if (t->n + (size_t)n + 1 > t->size) {
        t->size = 2 * (t->n + (size_t)n + 1);
        t->at = realloc(t->at, t->size);
    }
    memcpy(t->at + t->n, line, (size_t)n + 1);
    t->n += (size_t)n;
}

static void put_matrix(struct text *t, const char *name, const struct imp_mat4 *m)
{
    put(t, "<transform name='%s'><matrix value='", name);
    for (int k = 0; k < 16; k++) put(t, "%.17g ", m->m[k]);
    put(t, "'/></transform>");
}

/* ---- What stands in a group: kinds, and where they are in it ------------------------- */

struct member {
    const char *type, *bsdf;
};
static const struct member flat[] = {
    {"cube", "red"}, {"rectangle", "blue"}, {"disk", "red"}, {"mesh", "blue"}};
static const struct member round_ones[] = {
    {"sphere", "red"}, {"cylinder", "blue"}, {"cube", "red"}};

static struct imp_mat4 times(struct imp_mat4 a, struct imp_mat4 b)
{
    return imp__mat4_multiply(&a, &b);
}
static struct imp_mat4 turned(double x, double y, double z, double angle, double scale)
{
    return times(imp__translate(imp__v3(x, y, z)),
                 times(imp__rotate(imp__normalize(imp__v3(1, 2, -1)), angle),
                       imp__scale(imp__v3(scale, scale, scale))));
}
static struct imp_mat4 of_member(int k) { return turned(2.5 * k, 0, 0.5 * k, 40 * k, 1); }

/* A bent square with vertex normals. Between its vertices they are interpolated in the
 * group, and of a copy where it stands: the same unless the placement shears. */
static void mesh_write(const char *path)
{
    FILE *f = fopen(path, "w");
    for (int i = 0; i < 25; i++) {
        const double x = i % 5 / 2. - 1, y = i / 5 / 2. - 1;
        fprintf(f, "v %g %g %g\nvt %g %g\nvn %g 0.2 1\n", x, y, 0.3 * x * x - 0.2 * y,
                x * x, y, -0.6 * x);
    }
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++) {
            const int a = 5 * j + i + 1;
            for (int t = 0; t < 2; t++) {
                const int b = t ? a + 6 : a + 1, c = t ? a + 5 : a + 6;
                fprintf(f, "f %d/%d/%d %d/%d/%d %d/%d/%d\n", a, a, a, b, b, b, c, c, c);
            }
        }
    fclose(f);
}
static char mesh_path[64];

static void put_member(struct text *t, const struct member *m, const struct imp_mat4 *at,
                       const char *bsdf)
{
    const bool mesh = strcmp(m->type, "mesh") == 0;
    put(t, "<shape type='%s'>", mesh ? "obj" : m->type);
    if (mesh) put(t, "<string name='filename' value='%s'/>", mesh_path);
    put_matrix(t, "to_world", at);
    put(t, "<ref id='%s'/></shape>", bsdf ? bsdf : m->bsdf);
}

static void put_head(struct text *t)
{
    put(t,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='4'/></integrator><sensor type='perspective'><float name='fov' "
        "value='60'/><transform name='to_world'><lookat origin='3,5,-14' "
        "target='3,0,3' up='0,1,0'/></transform><film type='hdrfilm'><integer "
        "name='width' value='24'/><integer name='height' value='16'/><rfilter "
        "type='box'/></film></sensor><emitter type='constant' id='sky'/>"
        "<bsdf type='twosided' id='red'><bsdf type='diffuse' id='red_paint'><rgb "
        "name='reflectance' value='.7,.3,.2'/></bsdf></bsdf>"
        "<bsdf type='twosided' id='blue'><bsdf type='diffuse' id='blue_paint'><texture "
        "type='checkerboard' name='reflectance'><rgb name='color0' value='.2,.3,.8'/>"
        "<rgb name='color1' value='.6,.6,.3'/></texture></bsdf></bsdf>"
        "<bsdf type='twosided' id='green'><bsdf type='diffuse' id='green_paint'><rgb "
        "name='reflectance' value='.2,.7,.3'/></bsdf></bsdf>");
}

/* ---- Comparison ------------------------------------------------------------------- */

static double apart(imp_v3 a, imp_v3 b) { return imp__length(a - b); }

struct expected { /* of shape k of the copies */
    int shape;
    int64_t place;
};

static void rays_compare(const char *what, const imp_scene *a, const imp_scene *b,
                         const struct expected *of, double time)
{
    int met = 0, others = 0, blocked = 0;
    double worst = 0;
    const imp_v3 centre = (b->lo + b->hi) * 0.5;
    const double size = imp__length(b->hi - b->lo) / 2;
    const struct imp_key key = imp__key(7, 1, 2);
    for (unsigned i = 0; i < RAYS; i++) {
        double u[6];
        for (unsigned k = 0; k < 6; k++) u[k] = imp__u01(key, 6 * i + k);
        const imp_v3 from =
            centre + size * (imp__v3(u[0], u[1], u[2]) * 2 - imp__v3(1, 1, 1));
        const imp_v3 to = b->lo + (b->hi - b->lo) * imp__v3(u[3], u[4], u[5]);
        const imp_v3 d = imp__normalize(to - from);
        struct imp_hit x, y;
        const bool found = imp__intersect_at(a, time, &from, &d, 0, INFINITY, &x);
        const bool copy = imp__intersect_at(b, time, &from, &d, 0, INFINITY, &y);
        blocked += found != imp__occluded_at(a, time, &from, &d, 0, INFINITY);
        if (!found && !copy) continue;
        const struct expected *e = &of[copy ? y.shape : 0];
        if (!found || !copy || x.shape != e->shape || x.place != e->place ||
            x.prim != y.prim) {
            others++; /* an edge within rounding */
            continue;
        }
        met++;
        struct imp_surface p, q;
        imp__hit_surface(a, &x, &from, &d, &p);
        imp__hit_surface(b, &y, &from, &d, &q);
        worst = fmax(worst, fabs(x.t - y.t) / (1 + y.t));
        worst = fmax(worst, apart(p.p, q.p) / (1 + imp__length(q.p)));
        worst = fmax(worst, apart(p.ng, q.ng));
        worst = fmax(worst, apart(p.n, q.n));
        worst = fmax(worst, apart(p.s, q.s));
        worst = fmax(worst, apart(p.t, q.t));
        worst = fmax(worst, apart(p.dp_du, q.dp_du) / imp__length(q.dp_du));
        worst = fmax(worst, apart(p.dp_dv, q.dp_dv) / imp__length(q.dp_dv));
        worst = fmax(worst, fabs(p.uv[0] - q.uv[0]) + fabs(p.uv[1] - q.uv[1]));
        if (imp__shape_bsdf(a, a->shapes[x.shape])->name[0] !=
            imp__shape_bsdf(b, b->shapes[y.shape])->name[0])
            worst = INFINITY;
    }
    tap_ok(
        met > RAYS / 20 && others <= 2 && worst < 5e-5 && blocked == 0,
        "%s: %d rays meet the same, surfaces within %.1e; %d others, at edges; any-hit "
        "queries agree",
        what, met, worst, others);
}

static void outputs_compare(const char *what, imp_scene *a, imp_scene *b)
{
    imp_film *film[2];
    imp_scene *scene[2] = {a, b};
    double mean[2] = {0}, apart_most = 0, g[2][16] = {{0}}, worst = 0;
    size_t n[2];
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 16;
    for (int k = 0; k < 2; k++) {
        test_must(ctx, imp_render(scene[k], &run, &film[k]));
        imp_problem *p = test_problem(ctx, scene[k], "*_paint.*");
        struct imp_estimate value;
        double se[16];
        n[k] = imp_problem_n_variables(p);
        test_must(ctx, imp_problem_functional(p, NULL, &run, &value, g[k], se));
        imp_problem_destroy(p);
    }
    const float *x = imp_film_mean(film[0]), *y = imp_film_mean(film[1]);
    int off = 0;
    for (int i = 0; i < 24 * 16 * 3; i++) {
        const double d = fabs((double)x[i] - y[i]);
        mean[0] += x[i], mean[1] += y[i];
        off += d > 1e-5;
        apart_most = fmax(apart_most, d);
    }
    for (size_t k = 0; k < n[0] && k < 16; k++)
        worst = fmax(worst, fabs(g[0][k] - g[1][k]) / (1e-3 + fabs(g[1][k])));
    tap_ok(off <= 6 && fabs(mean[0] / mean[1] - 1) < 1e-4,
           "%s: pictures agree but at %d of 1152 numbers, and by %.1e in the mean", what,
           off, fabs(mean[0] / mean[1] - 1));
    tap_ok(n[0] == n[1] && n[0] >= 6 && worst < 1e-3,
           "%s: so do %zu derivatives of shared materials, within %.1e", what, n[0],
           worst);
    for (int k = 0; k < 2; k++) imp_film_destroy(film[k]);
}

/* ---- Cases ------------------------------------------------------------------------ */

static void placed(const char *what, const struct member *m, int n,
                   const struct imp_mat4 *at, int n_at, bool own)
{
    struct text a = {0}, b = {0};
    struct expected *of = calloc((size_t)(n * n_at), sizeof *of);
    put_head(&a), put_head(&b);
    put(&a, "<shape type='shapegroup' id='group'>");
    for (int k = 0; k < n; k++) {
        const struct imp_mat4 in = of_member(k);
        put_member(&a, &m[k], &in, NULL);
    }
    put(&a, "</shape>");
    for (int i = 0; i < n_at; i++) {
        const bool green = own && i % 2 == 1;
        put(&a, "<shape type='instance'><ref id='group'/>");
        put_matrix(&a, "to_world", &at[i]);
        put(&a, "%s</shape>", green ? "<ref id='green'/>" : "");
        for (int k = 0; k < n; k++) {
            const struct imp_mat4 there = times(at[i], of_member(k));
            put_member(&b, &m[k], &there, green ? "green" : NULL);
            of[n * i + k] = (struct expected){k + (green ? n : 0), i + 1};
        }
    }
    put(&a, "</scene>"), put(&b, "</scene>");
    imp_scene *with = test_scene_text(ctx, a.at, IMP_RGB),
              *copies = test_scene_text(ctx, b.at, IMP_RGB);
    rays_compare(what, with, copies, of, 0);
    outputs_compare(what, with, copies);
    struct imp_scene_info info = {.size = sizeof info}, info_b = info;
    imp_scene_get_info(with, &info);
    imp_scene_get_info(copies, &info_b);
    tap_ok(info.n_shapes == n && info.n_instances == n_at &&
               info.triangles_met == (double)info_b.n_triangles,
           "%s: %d shapes, %d instances, %.0f triangles are met", what, info.n_shapes,
           info.n_instances, info.triangles_met);
    imp_scene_destroy(with);
    imp_scene_destroy(copies);
    free(a.at), free(b.at), free(of);
}

/* ---- Bump maps -------------------------------------------------------------------- */

static char heights_path[64];
static void heights_write(void)
{
    snprintf(heights_path, sizeof heights_path, "instances_%ld.pfm", (long)getpid());
    FILE *f = fopen(heights_path, "wb");
    fprintf(f, "Pf\n8 8\n-1\n");
    for (int k = 0; k < 64; k++)
        fwrite(&(float){.3f * (float)(k * 29 % 13) / 13}, sizeof(float), 1, f);
    fclose(f);
}
static void put_rough(struct text *t)
{
    put(t,
        "<bsdf type='twosided' id='rough'><bsdf type='bumpmap'><texture "
        "type='bitmap' name='height'><string name='filename' value='%s'/><boolean "
        "name='raw' value='true'/></texture><bsdf type='diffuse' id='rough_paint'>"
        "<rgb name='reflectance' value='.5,.4,.7'/></bsdf></bsdf></bsdf>",
        heights_path);
}
static void put_instance(struct text *t, const char *group, bool own,
                         const struct imp_mat4 *at)
{
    put(t, "<shape type='instance'><ref id='%s'/>%s", group,
        own ? "<ref id='rough'/>" : "");
    put_matrix(t, "to_world", at);
    put(t, "</shape>");
}

/* Beside copies where the instances are; of a group whose material is bumped, or which gets
 * it by instance. */
static void bumped(const char *what, const struct member *m, int n,
                   const struct imp_mat4 *at, int n_at, bool own)
{
    struct text a = {0}, b = {0};
    put_head(&a), put_head(&b);
    put_rough(&a), put_rough(&b);
    put(&a, "<shape type='shapegroup' id='group'>");
    for (int k = 0; k < n; k++) {
        const struct imp_mat4 in = of_member(k);
        put_member(&a, &m[k], &in, own ? NULL : "rough");
    }
    put(&a, "</shape>");
    for (int i = 0; i < n_at; i++) {
        put_instance(&a, "group", own, &at[i]);
        for (int k = 0; k < n; k++) {
            const struct imp_mat4 there = times(at[i], of_member(k));
            put_member(&b, &m[k], &there, "rough");
        }
    }
    put(&a, "</scene>"), put(&b, "</scene>");
    imp_scene *with = test_scene_text(ctx, a.at, IMP_RGB),
              *copies = test_scene_text(ctx, b.at, IMP_RGB);
    outputs_compare(what, with, copies);
    imp_scene_destroy(with);
    imp_scene_destroy(copies);
    free(a.at), free(b.at);
}

/* Stretched instances in stretched instances, the second of which may have its bumps from
 * outside. `wanted` places are stretched in different ways, and have copies of shapes. */
static void bumped_nested(const struct imp_mat4 inner[2], const struct imp_mat4 outer[2],
                          bool own, int wanted)
{
    struct text a = {0}, b = {0};
    put_head(&a), put_head(&b);
    put_rough(&a), put_rough(&b);
    put(&a, "<shape type='shapegroup' id='outer'>");
    for (int j = 0; j < 2; j++) put_instance(&a, "inner", j == 0, &inner[j]);
    put(&a, "</shape><shape type='shapegroup' id='inner'>");
    for (int k = 0; k < 3; k++) {
        const struct imp_mat4 in = of_member(k);
        put_member(&a, &flat[k], &in, k == 0 ? "rough" : NULL);
    }
    put(&a, "</shape>");
    for (int i = 0; i < 2; i++) {
        put_instance(&a, "outer", own && i == 1, &outer[i]);
        for (int j = 0; j < 2; j++)
            for (int k = 0; k < 3; k++) {
                const struct imp_mat4 there =
                    times(outer[i], times(inner[j], of_member(k)));
                put_member(&b, &flat[k], &there,
                           (own && i == 1) || j == 0 || k == 0 ? "rough" : NULL);
            }
    }
    put(&a, "</scene>"), put(&b, "</scene>");
    imp_scene *with = test_scene_text(ctx, a.at, IMP_RGB),
              *copies = test_scene_text(ctx, b.at, IMP_RGB);
    outputs_compare("nested bumps", with, copies);
    const int raised = with->n_all_shapes - 3 - 3 * (1 + own);
    tap_ok(raised == 3 * wanted, "nested bumps: %d copies of shapes # wanted 3 * %d",
           raised, wanted);
    imp_scene_destroy(with);
    imp_scene_destroy(copies);
    free(a.at), free(b.at);
}

/* One that moves keeps its stretch, or is refused; its picture from before it begins. */
static void bumped_moving(struct imp_mat4 from)
{
    for (int changes = 0; changes < 2; changes++) {
        const struct imp_mat4 to = times(turned(4, 1, 0, 50, changes ? 1.1 : 1), from),
                              in = of_member(0);
        struct text a = {0}, b = {0};
        put_head(&a), put_head(&b);
        put_rough(&a), put_rough(&b);
        put(&a, "<shape type='shapegroup' id='group'>");
        put_member(&a, &flat[0], &in, "rough");
        put(&a, "</shape><shape type='instance'><ref id='group'/><float "
                "name='time_start' value='2'/><float name='time_end' value='3'/>");
        put_matrix(&a, "to_world", &from);
        put_matrix(&a, "to_world_end", &to);
        put(&a, "</shape></scene>");
        const struct imp_mat4 there = times(from, in);
        put_member(&b, &flat[0], &there, "rough");
        put(&b, "</scene>");
        struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
        imp_scene *with = NULL;
        const enum imp_status st =
            imp_scene_load_string(ctx, a.at, strlen(a.at), "test", &o, &with);
        if (changes) {
            tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), "that moves"),
                   "bumps that are stretched more and more are refused # %s",
                   imp_last_error(ctx));
        } else {
            test_must(ctx, st);
            imp_scene *copies = test_scene_text(ctx, b.at, IMP_RGB);
            outputs_compare("moving bumps", with, copies);
            imp_scene_destroy(copies);
        }
        imp_scene_destroy(with);
        free(a.at), free(b.at);
    }
}

/* Two instances of a group of two instances and a shape. */
static void nested(void)
{
    const struct imp_mat4 inner[2] = {turned(0, 0, 0, 10, 1), turned(1, 6, 0, 100, 0.7)};
    const struct imp_mat4 outer[2] = {turned(-6, 0, 0, 20, 1), turned(9, 1, 3, 70, 1.2)};
    const struct imp_mat4 extra = turned(0, -4, 0, 0, 0.8);
    struct text a = {0}, b = {0};
    struct expected of[32];
    int n = 0;
    put_head(&a), put_head(&b);
    /* The outer group is written first: what is inside it is made before it. */
    put(&a, "<shape type='shapegroup' id='outer'>");
    for (int j = 0; j < 2; j++) {
        put(&a, "<shape type='instance'><ref id='inner'/>");
        put_matrix(&a, "to_world", &inner[j]);
        put(&a, "</shape>");
    }
    put_member(&a, &round_ones[0], &extra, NULL);
    put(&a, "</shape><shape type='shapegroup' id='inner'>");
    for (int k = 0; k < 3; k++) {
        const struct imp_mat4 in = of_member(k);
        put_member(&a, &round_ones[k], &in, NULL);
    }
    put(&a, "</shape>");
    for (int i = 0; i < 2; i++) {
        const char *own = i == 1 ? "green" : NULL;
        put(&a, "<shape type='instance'><ref id='outer'/>");
        put_matrix(&a, "to_world", &outer[i]);
        put(&a, "%s</shape>", own ? "<ref id='green'/>" : "");
        for (int j = 0; j < 2; j++)
            for (int k = 0; k < 3; k++) {
                const struct imp_mat4 there =
                    times(outer[i], times(inner[j], of_member(k)));
                put_member(&b, &round_ones[k], &there, own);
                of[n++] = (struct expected){k + (own ? 4 : 0), 1 + 3 * i + 1 + j};
            }
        const struct imp_mat4 there = times(outer[i], extra);
        put_member(&b, &round_ones[0], &there, own);
        of[n++] = (struct expected){3 + (own ? 4 : 0), 1 + 3 * i};
    }
    put(&a, "</scene>"), put(&b, "</scene>");
    imp_scene *with = test_scene_text(ctx, a.at, IMP_RGB),
              *copies = test_scene_text(ctx, b.at, IMP_RGB);
    rays_compare("nested", with, copies, of, 0);
    outputs_compare("nested", with, copies);
    imp_scene_destroy(with);
    imp_scene_destroy(copies);
    free(a.at), free(b.at);
}

/* At a time, beside copies where the motion is then. */
static void moving(double time)
{
    struct imp_mat4 from = turned(-2, 0, 0, 10, 1), to = turned(2, 3, 1, 130, 1.5);
    struct imp_mat4 then = imp__mat4_identity();
    struct imp_map a_map = imp__map_of(&from), b_map = imp__map_of(&to), at, inverse;
    struct imp_motion motion;
    imp__motion_make(&a_map, &b_map, 1, 3, &motion);
    imp__motion_at(&motion, time, &at, &inverse);
    memcpy(then.m, at.m, sizeof at.m);
    struct text a = {0}, b = {0};
    struct expected of[3];
    put_head(&a), put_head(&b);
    put(&a, "<shape type='shapegroup' id='group'>");
    for (int k = 0; k < 3; k++) {
        const struct imp_mat4 in = of_member(k), there = times(then, in);
        put_member(&a, &round_ones[k], &in, NULL);
        put_member(&b, &round_ones[k], &there, NULL);
        of[k] = (struct expected){k, 1};
    }
    put(&a, "</shape><shape type='instance'><ref id='group'/><float name='time_start' "
            "value='1'/><float name='time_end' value='3'/>");
    put_matrix(&a, "to_world", &from);
    put_matrix(&a, "to_world_end", &to);
    put(&a, "</shape></scene>"), put(&b, "</scene>");
    imp_scene *with = test_scene_text(ctx, a.at, IMP_RGB),
              *copies = test_scene_text(ctx, b.at, IMP_RGB);
    char what[64];
    snprintf(what, sizeof what, "moving, time %g", time);
    rays_compare(what, with, copies, of, time);
    imp_scene_destroy(with);
    imp_scene_destroy(copies);
    free(a.at), free(b.at);
}

/* The motion itself: both ends, one axis and constant speed, boxes. */
static void motions(void)
{
    double ends = 0, speed = 0, inverses = 0;
    int outside = 0;
    for (unsigned i = 0; i < 200; i++) {
        const struct imp_key key = imp__key(3, i, 0);
        double u[16];
        for (unsigned k = 0; k < 16; k++) u[k] = 2 * imp__u01(key, k) - 1;
        const struct imp_mat4 a = times(turned(u[0], u[1], u[2], 180 * u[3], exp(u[4])),
                                        imp__scale(imp__v3(1 + u[5] / 2, 1, 1)));
        const struct imp_mat4 b = times(
            times(imp__translate(imp__v3(u[6], u[7], u[8])),
                  imp__rotate(imp__normalize(imp__v3(u[9], u[10], 1)), 170 * u[11])),
            imp__scale(imp__v3(1, 1 + u[12] / 2, 1)));
        const struct imp_map from = imp__map_of(&a), to = imp__map_of(&b);
        struct imp_motion m;
        struct imp_map at, inverse;
        if (!imp__motion_make(&from, &to, 0, 1, &m)) {
            tap_ok(0, "motion %u is made", i);
            return;
        }
        imp_v3 lo = {-1, -2, 0.5, 0}, hi = {1, 1, 3, 0}, box[2] = {lo, hi};
        imp__motion_box(&m, &box[0], &box[1]);
        for (int t = 0; t <= 32; t++) {
            imp__motion_at(&m, t / 32., &at, &inverse);
            for (int k = 0; k < 8; k++) {
                const imp_v3 corner = imp__v3((k & 1 ? hi : lo)[0], (k & 2 ? hi : lo)[1],
                                              (k & 4 ? hi : lo)[2]);
                const imp_v3 p = imp__map_point(&at, corner);
                for (int c = 0; c < 3; c++)
                    outside += p[c] < box[0][c] || p[c] > box[1][c];
                inverses = fmax(inverses, apart(imp__map_point(&inverse, p), corner));
            }
            const struct imp_map *end = t == 0 ? &from : t == 32 ? &to : NULL;
            for (int k = 0; end && k < 12; k++)
                ends = fmax(ends, fabs(at.m[k] - end->m[k]));
        }
    }
    /* A quarter turn, of a body twice as long as wide: 22.5 degrees after a quarter. */
    const struct imp_mat4 a = imp__scale(imp__v3(2, 1, 1)),
                          b = times(imp__rotate(imp__v3(0, 0, 1), 90), a);
    const struct imp_map from = imp__map_of(&a), to = imp__map_of(&b);
    struct imp_motion m;
    struct imp_map at, inverse;
    imp__motion_make(&from, &to, 10, 14, &m);
    imp__motion_at(&m, 11, &at, &inverse);
    speed =
        fmax(fabs(at.m[0] - 2 * cos(IMP_PI / 8)), fabs(at.m[4] - 2 * sin(IMP_PI / 8)));
    tap_ok(ends < 1e-12, "motions begin and end where they should, within %.1e", ends);
    tap_ok(inverses < 1e-11, "their inverses are theirs, within %.1e", inverses);
    tap_ok(speed < 1e-14, "a quarter turn keeps shape and speed, within %.1e", speed);
    tap_ok(outside == 0, "boxes hold what moves: %d corners outside", outside);
}

/* What a place costs, of all that a scene holds. */
static void memory(void)
{
    size_t bytes[2];
    for (int k = 0; k < 2; k++) {
        struct text a = {0};
        put_head(&a);
        put(&a, "<shape type='shapegroup' id='g'><shape type='sphere'/></shape>");
        for (int i = 0; i < 10000 + 30000 * k; i++)
            put(&a,
                "<shape type='instance'><ref id='g'/><transform name='to_world'>"
                "<translate x='%d' y='%d'/></transform></shape>",
                3 * (i % 200), 3 * (i / 200));
        put(&a, "</scene>");
        imp_scene *scene = test_scene_text(ctx, a.at, IMP_RGB);
        struct imp_scene_info info = {.size = sizeof info};
        imp_scene_get_info(scene, &info);
        bytes[k] = info.memory_bytes;
        imp_scene_destroy(scene);
        free(a.at);
    }
    const double each = (double)(bytes[1] - bytes[0]) / 30000;
    tap_ok(each > 200 && each < 600, "an instance takes %.0f bytes", each);
}

int main(void)
{
    ctx = test_context(1);
    snprintf(mesh_path, sizeof mesh_path, "instances_%ld.obj", (long)getpid());
    mesh_write(mesh_path);
    const struct imp_mat4 even[3] = {turned(-4, 0, 0, 20, 1), turned(8, 1, 3, 70, 2),
                                     turned(2, 7, 4, -50, 0.5)};
    struct imp_mat4 sheared[3], mirrored[3];
    for (int k = 0; k < 3; k++) {
        struct imp_mat4 shear = imp__scale(imp__v3(1.3, 0.6, 1));
        shear.m[1] = 0.4, shear.m[6] = -0.3;
        sheared[k] = times(even[k], shear);
        mirrored[k] = times(even[k], imp__scale(imp__v3(1, 1, k == 1 ? -1 : 1)));
    }
    placed("flat shapes", flat, 4, even, 3, false);
    placed("round shapes", round_ones, 3, even, 3, false);
    placed("sheared", flat, 3, sheared, 3, false);
    placed("mirrored cubes", flat, 1, mirrored, 3, false);
    placed("materials by instance", flat, 4, even, 3, true);
    heights_write();
    static const struct member smooth[] = {
        {"rectangle", "red"}, {"mesh", "blue"}, {"sphere", "red"}, {"cylinder", "blue"}};
    static const struct member slanted[] = {
        {"rectangle", "red"}, {"cube", "blue"}, {"cylinder", "red"}, {"disk", "red"}};
    const struct imp_mat4 rigid[2] = {turned(-2, 0, 0, 20, 1), turned(4, 1, 1, 50, 1)};
    bumped("bumps", smooth, 4, rigid, 2, false);
    bumped("bumps by instance", smooth, 4, rigid, 2, true);
    bumped("bumps, other sizes", smooth, 4, even, 3, false);
    bumped("bumps, other sizes, by instance", smooth, 4, even, 3, true);
    bumped("bumps, sheared", slanted, 4, sheared, 3, false);
    bumped("bumps, mirrored", &slanted[1], 1, mirrored, 3, false);
    const struct imp_mat4 outer[2] = {sheared[0],
                                      times(turned(9, 1, 0, 35, 1), sheared[0])};
    bumped_nested(mirrored, outer, true, 4);
    bumped_nested(mirrored, outer, false, 2);
    bumped_nested(rigid, rigid, true, 0);
    bumped_moving(sheared[0]);
    remove(heights_path);
    nested();
    motions();
    memory();
    for (int t = 0; t < 4; t++) moving(0.5 + t * 0.83);
    remove(mesh_path);
    imp_context_destroy(ctx);
    return tap_done();
}
