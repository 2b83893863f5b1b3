/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks that are kept, on every scene of this repository, through media, and with walks
 * that hang on them: kept, written, read and evaluated they have the value and the pieces
 * of gradient of the traced walk, to the bit. At other parameters they have the value of the frozen walk, whose differences are
 * the sweep's. Files of another scene, version or byte order, and damaged ones, are
 * refused. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "scene/guide.h"
#include "vol_write.h"
#include "walk/kept/reduced.h"
#include "walk/rules/features.h"
#include <importon/elements.h>
#include <math.h>
#include <stdbool.h>

#define PLENTY ((size_t)256 << 20)

static imp_context *ctx;
static enum imp_color_mode mode = IMP_RGB;
static const char *const path = "kept_walks.tmp";

/* ---- Walks of a scene ------------------------------------------------------------ */

struct traced {
    imp_scene *scene;
    uint8_t *chosen;
    struct imp_active active;
    struct imp_walk_integrator integrator;
    struct imp_tracer tracer;
    struct imp_arena arena;
    int width, height;
};

/* All parameters with a derivative are active, but those of media if `held`. */
static void begin(struct traced *t, const char *file, const char *defines, bool held)
{
    imp_scene *scene = file[0] == '<' ? test_scene_text(ctx, file, mode)
                                      : test_scene(ctx, file, mode, defines);
    *t = (struct traced){.scene = scene};
    t->chosen = calloc(scene->n_params + 1, 1);
    for (size_t k = 0; k < scene->n_params; k++)
        t->chosen[k] = (scene->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE) != 0;
    for (int m = 0; held && m < scene->n_bodies; m++)
        for (int k = 0; k < scene->bodies[m]->n_numbers; k++)
            t->chosen[scene->bodies[m]->numbers[k].param] = 0;
    test_must(ctx, imp__active_create(scene, t->chosen, &t->active));
    const struct imp_walk_integrator *own = imp__walk_integrator(scene);
    t->integrator = own ? *own
                        : (struct imp_walk_integrator){/* path, for finite elements */
                                                       .max_depth = -1,
                                                       .rr_depth = 5,
                                                       .lights = true,
                                                       .directions = true,
                                                       .guided = true};
    if (t->integrator.rr_depth > 2) t->integrator.rr_depth = 2; /* let roulette decide */
    const struct imp_sensor *sensor = scene->sensors[0];
    t->width = sensor->film.crop_w;
    t->height = sensor->film.crop_h;
    t->tracer = (struct imp_tracer){.scene = scene,
                                    .integrator = &t->integrator,
                                    .sensor = sensor,
                                    .active = &t->active,
                                    .collisions_fixed = true,
                                    .seed = 11};
    imp__arena_init(&t->arena, ctx);
}
static void end(struct traced *t)
{
    imp__arena_free(&t->arena);
    imp__active_destroy(ctx, &t->active);
    free(t->chosen);
    imp_scene_destroy(t->scene);
}
static void trace(struct traced *t, int i, struct imp_walk *w)
{
    imp__walk_trace(&t->tracer, &t->arena, i * 7 % t->width, i * 13 % t->height, i, w);
}

/* ---- Pieces of gradient, in the order they fall off ------------------------------ */

#define PIECES 4096
struct pieces {
    struct imp_sink sink; /* first */
    size_t n;
    struct piece {
        int param, channels;
        size_t element;
        imp_spec bar;
    } at[PIECES];
};
static void piece_add(struct imp_sink *sink, int param, size_t element, int channels,
                      const imp_spec *bar)
{
    struct pieces *p = (struct pieces *)sink;
    if (p->n == PIECES) return;
    p->at[p->n++] = (struct piece){param, channels, element, *bar};
}
static void sweep(const struct traced *t, const struct imp_walk *w, struct pieces *p)
{
    p->sink.add = piece_add;
    p->n = 0;
    imp__walk_sweep(&t->tracer, w, (imp_spec){1, 0.7, 1.3, 0}, &p->sink);
}
static bool same_bits(imp_spec a, imp_spec b) { return memcmp(&a, &b, 24) == 0; }
static bool same_pieces(const struct pieces *a, const struct pieces *b)
{
    if (a->n != b->n) return false;
    for (size_t k = 0; k < a->n; k++)
        if (a->at[k].param != b->at[k].param || a->at[k].channels != b->at[k].channels ||
            a->at[k].element != b->at[k].element ||
            !same_bits(a->at[k].bar, b->at[k].bar))
            return false;
    return true;
}

static double dot(const struct pieces *p, const struct imp_active *a, const double *x_dot)
{
    double sum = 0;
    for (size_t k = 0; k < p->n; k++) {
        const int64_t base = a->base[p->at[k].param];
        if (base < 0) continue;
        const size_t e = (size_t)base + p->at[k].element;
        for (int c = 0; c < 3; c++)
            sum += p->at[k].bar[c] * x_dot[p->at[k].channels == 3 ? e + (size_t)c : e];
    }
    return sum;
}

static void gradient_add(const struct pieces *p, const struct imp_active *a, double *g)
{
    for (size_t k = 0; k < p->n; k++) {
        const int64_t base = a->base[p->at[k].param];
        if (base < 0) continue;
        const size_t e = (size_t)base + p->at[k].element;
        for (int c = 0; c < 3; c++)
            g[p->at[k].channels == 3 ? e + (size_t)c : e] += p->at[k].bar[c];
    }
}

/* ---- theta moves ----------------------------------------------------------------- */

static double unit_noise(size_t k)
{
    return (double)(imp__mix64(k + 77) >> 11) * 0x1p-53;
}

/* Every active number by up to `step` of itself, inwards at a bound; x_dot [n]. */
static void direction(const struct traced *t, double *x_dot)
{
    for (size_t k = 0; k < t->scene->n_params; k++) {
        const struct imp_param *p = &t->scene->params[k];
        for (size_t e = 0; t->active.base[k] >= 0 && e < p->info.count; e++) {
            const double v = imp__param_get(p, e);
            x_dot[(size_t)t->active.base[k] + e] = -v * unit_noise(97 * k + e);
        }
    }
}
static void move(const struct traced *t, const double *theta, const double *x_dot,
                 double step)
{
    for (size_t k = 0; k < t->scene->n_params; k++) {
        struct imp_param *p = &t->scene->params[k];
        for (size_t e = 0; t->active.base[k] >= 0 && e < p->info.count; e++) {
            const size_t i = (size_t)t->active.base[k] + e;
            imp__param_set(p, e, theta[i] + step * x_dot[i]);
        }
    }
}
static void theta_get(const struct traced *t, double *theta)
{
    for (size_t k = 0; k < t->scene->n_params; k++)
        for (size_t e = 0; t->active.base[k] >= 0 && e < t->scene->params[k].info.count;
             e++)
            theta[(size_t)t->active.base[k] + e] =
                imp__param_get(&t->scene->params[k], e);
}

static double weighed(imp_spec L) { return L[0] + 0.7 * L[1] + 1.3 * L[2]; }

/* ---- Every scene ----------------------------------------------------------------- */

static const struct scene_case {
    const char *file, *defines;
    bool lanes_only; /* texels are floats: differences of them are too coarse */
    int split;       /* continuations of the first vertex */
} cases[] = {
    {"cornell.xml", "res=32", false, 0},
    {"cornell.xml", "res=32 max_depth=-1", false, 0},
    {"textured.xml", NULL, true, 0},
    {"lamps.xml", NULL, false, 0},
    {"furnace.xml", NULL, false, 0},
    {"stam.xml", "integrator=stam", false, 0},
    {"stam.xml", "integrator=path", false, 0},
    {"elements/a.xml", NULL, false, 0},
    {"elements/b.xml", NULL, false, 0},
    {"elements/d.xml", NULL, false, 0},
    {"elements/d_lamps.xml", NULL, false, 0},
    {"elements/glossy.xml", NULL, false, 0},
    {"bend/seen.xml", "cells=1 width=8", true, 0},
    {"cornell.xml", "res=32", false, 3},
    {"fog.xml", "res=32", false, 0},
    {"photons/sky.xml", NULL, true, 0},
    {"<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
     "value='6'/></integrator><sensor type='perspective'><float name='fov' value='60'/>"
     "<transform name='to_world'><lookat origin='0,1,5' target='0,1,0' up='0,1,0'/>"
     "</transform><film type='hdrfilm'><integer name='width' value='32'/><integer "
     "name='height' value='32'/><rfilter type='box'/></film></sensor>"
     "<emitter type='spot' id='spot'><rgb name='intensity' value='9,8,7'/><transform "
     "name='to_world'><lookat origin='0,4,0' target='0,0,0' up='1,0,0'/></transform>"
     "</emitter><emitter type='envmap' id='sky'><string name='filename' "
     "value='" IMP_SCENES "/textured/waves.png'/></emitter>"
     "<shape type='sphere'><point name='center' x='-1' y='1' z='0'/>"
     "<bsdf type='dielectric' id='glass'/></shape>"
     "<shape type='sphere'><point name='center' x='1' y='1' z='0'/>"
     "<bsdf type='twosided' id='both'><bsdf type='diffuse'><rgb name='reflectance' "
     "value='.2,.5,.8'/></bsdf></bsdf></shape>"
     "<shape type='sphere'><point name='center' x='0' y='1' z='-2'/>"
     "<bsdf type='blendbsdf' id='blend'><float name='weight' value='.4'/><bsdf "
     "type='diffuse'/><bsdf type='plastic'/></bsdf></shape>"
     "<shape type='rectangle'><transform name='to_world'><scale value='5'/><rotate x='1' "
     "angle='-90'/></transform><bsdf type='phong' id='floor'/></shape></scene>",
     NULL, true, 0},
    {"photons/reflector.xml", "weights=kernel=1,emitters=1,proxies=1,uniform=.3", false,
     0},
    {"../tests/render/attributes_lamp.xml", "res=32", true, 0},
    {"../tests/render/attributes_lamp.xml", "res=32 integrator=volpath", true, 0},
};

enum { N = 3000 };

/* Keeps N walks, through a file: the walks that tracing gives, to the bit, at the
 * parameters they were drawn at. A guide is not there when they are read. */
static void kept_same(struct traced *t, const char *name, struct imp_record *read)
{
    struct imp_record kept;
    static struct pieces one, two;
    struct imp_tracer alone = t->tracer;
    alone.guide = NULL;
    test_must(ctx, imp__record_create(&t->tracer, PLENTY, &kept));
    const struct imp_arena_mark mark = imp__arena_mark(&t->arena);
    for (int i = 0; i < N; i++) {
        struct imp_walk w;
        trace(t, i, &w);
        test_must(ctx, imp__record_keep(&kept, &w, i));
        imp__arena_rewind(&t->arena, mark);
    }
    test_must(ctx, imp__record_write(&kept, path));
    test_must(ctx, imp__record_read(&alone, path, PLENTY, read));
    const double vertex = (double)(4 * read->n_words) / (double)read->n_vertices + 2;
    tap_ok(
        read->n_walks == N && read->n_vertices == kept.n_vertices && vertex <= 160 &&
            imp__record_bytes(read) <=
                160 * read->n_vertices + 16 * read->n_items + 80 * N,
        "%s: %zu walks of %zu vertices and %zu items, %.1f bytes a vertex, %.0f a walk",
        name, read->n_walks, read->n_vertices, read->n_items, vertex,
        (double)imp__record_bytes(read) / N);
    imp__record_destroy(&kept);

    int values = 0, gradients = 0, lit = 0;
    size_t n_pieces = 0;
    for (int i = 0; i < N; i++) {
        struct imp_walk w, k;
        trace(t, i, &w);
        imp__record_walk(read, (size_t)i, &alone, &t->arena, &k);
        sweep(t, &w, &one);
        sweep(t, &k, &two);
        values += same_bits(w.L, k.L) && w.px == k.px && w.py == k.py &&
                  w.valid == k.valid && w.dropped == k.dropped &&
                  imp__record_at(read, (size_t)i)->sample == i;
        gradients += same_pieces(&one, &two);
        lit += weighed(w.L) > 0;
        n_pieces += one.n;
        imp__arena_rewind(&t->arena, mark);
    }
    tap_ok(values == N && lit > N / 20,
           "%s: values to the bit, through a file # %d of %d, %d lit", name, values, N,
           lit);
    tap_ok(gradients == N && n_pieces > N / 20,
           "%s: pieces of gradient to the bit, in order # %d of %d, %zu pieces", name,
           gradients, N, n_pieces);
}

/* Walks that are reduced have the values, the gradients and the tangents of their vertices
 * at other parameters, where each `every`-th parameter may change and no other. */
static void reduced_same(struct traced *t, const char *name,
                         const struct imp_record *read, size_t every)
{
    struct imp_reduction *reduction;
    struct imp_reduced reduced = {.of = NULL};
    const struct imp_active all = t->active;
    static struct pieces one, two;
    uint8_t *free_ones = calloc(t->scene->n_params + 1, 1);
    for (size_t k = 0, i = 0; k < t->scene->n_params; k++)
        free_ones[k] = t->chosen[k] && i++ % every == every / 2;
    test_must(ctx, imp__active_create(t->scene, free_ones, &t->active));
    test_must(ctx,
              imp__reduction_create(t->scene, &t->integrator, free_ones, &reduction));
    if (reduction) imp__reduced_make(reduction, read, &reduced);
    const size_t n = t->active.n;
    double *theta = malloc((n + 1) * sizeof *theta),
           *x_dot = calloc(n + 1, sizeof *x_dot);
    double *g = calloc(2 * n + 2, sizeof *g);
    const struct imp_arena_mark mark = imp__arena_mark(&t->arena);
    double value = 0, gradient = 0, tangent = 0;
    int whole = 0;
    theta_get(t, theta);
    direction(t, x_dot);
    move(t, theta, x_dot, 0.25);
    for (size_t i = 0; i < read->n_walks && reduced.of; i++) {
        struct imp_walk a, b;
        imp__record_walk(read, i, &t->tracer, &t->arena, &a);
        if (imp__reduced_walk(&reduced, read, i, &t->tracer, &t->arena, &b)) {
            whole++;
            const double size = weighed(a.L);
            value = fmax(value, fabs(weighed(b.L) - size) / fmax(fabs(size), 1e-12));
            sweep(t, &a, &one);
            sweep(t, &b, &two);
            memset(g, 0, 2 * n * sizeof *g);
            gradient_add(&one, &t->active, g);
            gradient_add(&two, &t->active, g + n);
            double most = 1e-12;
            for (size_t k = 0; k < n; k++) most = fmax(most, fabs(g[k]));
            for (size_t k = 0; k < n; k++)
                gradient = fmax(gradient, fabs(g[k] - g[n + k]) / most);
            const double d = weighed(imp__walk_tangent(&t->tracer, &a, x_dot));
            const double e = weighed(imp__walk_tangent(&t->tracer, &b, x_dot));
            tangent = fmax(tangent, fabs(d - e) / fmax(fabs(d), 1e-9 * most + 1e-12));
        }
        imp__arena_rewind(&t->arena, mark);
    }
    if (reduced.of)
        tap_ok(value < 1e-11 && gradient < 1e-11 && tangent < 1e-7,
               "%s: reduced, each parameter of %zu may change # %d of %zu walks, %.0f "
               "bytes a walk; %.1e %.1e %.1e",
               name, every, whole, read->n_walks,
               (double)imp__reduced_bytes(&reduced) / (double)read->n_walks, value,
               gradient, tangent);
    move(t, theta, x_dot, 0);
    imp__reduced_free(&reduced);
    imp__reduction_destroy(reduction);
    imp__active_destroy(ctx, &t->active);
    t->active = all;
    free(g);
    free(theta);
    free(x_dot);
    free(free_ones);
}

static void scene_test(const struct scene_case *c)
{
    struct traced t;
    struct imp_record read;
    static struct pieces two;
    char name[96];
    snprintf(name, sizeof name, "%s %s%s", c->file[0] == '<' ? "" : c->file,
             c->defines ? c->defines : "", c->split ? " split" : "");
    begin(&t, c->file, c->defines, true);
    t.tracer.split = c->split;
    kept_same(&t, name, &read);
    reduced_same(&t, name, &read, 1);
    reduced_same(&t, name, &read, 3);

    /* At others: against the walks traced at the first ones, frozen. */
    const size_t n = t.active.n;
    double *theta = malloc(n * sizeof *theta), *x_dot = malloc(n * sizeof *x_dot);
    struct imp_walk *frozen = aligned_alloc(64, (N * sizeof *frozen + 63) / 64 * 64);
    double worst = 0, difference = 0, moved = 0, size = 0;
    for (int i = 0; i < N; i++) trace(&t, i, &frozen[i]);
    theta_get(&t, theta);
    direction(&t, x_dot);
    const struct imp_arena_mark after = imp__arena_mark(&t.arena);
    move(&t, theta, x_dot, 0.25);
    for (int i = 0; i < N; i++) {
        struct imp_walk k;
        imp__record_walk(&read, (size_t)i, &t.tracer, &t.arena, &k);
        const double a = weighed(imp__walk_frozen(&t.tracer, &frozen[i]));
        worst = fmax(worst, fabs(weighed(k.L) - a) / fmax(fabs(a), 1e-300));
        moved = fmax(moved, fabs(weighed(k.L) - weighed(frozen[i].L)));
        imp__arena_rewind(&t.arena, after);
    }
    tap_ok(worst < 1e-13 && moved > 0,
           "%s: at other parameters as the frozen walk # %.1e, moved %.2g", name, worst,
           moved);
    /* Central differences there, all walks together: what they err by is the step's
     * square, and rounding over the step. Texels are stored as floats. */
    const double h = c->lanes_only ? 2e-3 : 1e-4;
    double plus = 0, minus = 0, slope = 0;
    for (int side = -1; side <= 1; side++) {
        move(&t, theta, x_dot, 0.25 + side * h);
        for (int i = 0; i < N; i++) {
            struct imp_walk k;
            imp__record_walk(&read, (size_t)i, &t.tracer, &t.arena, &k);
            if (side < 0) minus += weighed(k.L);
            else if (side > 0) plus += weighed(k.L);
            else {
                sweep(&t, &k, &two);
                const double d = dot(&two, &t.active, x_dot);
                slope += d;
                size += fabs(d);
            }
            imp__arena_rewind(&t.arena, after);
        }
    }
    difference = (plus - minus) / (2 * h);
    tap_ok(fabs(difference - slope) < (c->lanes_only ? 2e-4 : 2e-6) * size && size > 0,
           "%s: differences there are the sweep's # %.9g, %.9g", name, difference, slope);
    move(&t, theta, x_dot, 0);

    /* Control: a density that differs in its last bit is seen, unless next to nothing
     * arrives along its step. */
    int seen = 0, tried = 0;
    for (int i = 0; i < N && tried < 100; i++) {
        struct imp_walk w, k;
        const struct imp_record_walk *head = imp__record_at(&read, (size_t)i);
        trace(&t, i, &w);
        if (w.n > 0 && w.first->d.goes_on && weighed(w.first->beyond * w.first->w) > 0) {
            struct imp_decision d;
            imp__record_vertex(&read, head->first, &d);
            d.pdf = nextafterf(d.pdf, INFINITY);
            imp__packed_put(&d, imp__record_words(&read, head->first));
            imp__record_walk(&read, (size_t)i, &t.tracer, &t.arena, &k);
            seen += !same_bits(w.L, k.L);
            tried++;
        }
        imp__arena_rewind(&t.arena, after);
    }
    tap_ok(10 * seen >= 9 * tried && tried > 0,
           "%s: control: one bit of a density # %d of %d", name, seen, tried);

    free(frozen);
    free(theta);
    free(x_dot);
    imp__record_destroy(&read);
    end(&t);
}

/* ---- A guide, wavelengths ---------------------------------------------------------- */

static void guided(void)
{
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    struct imp_elements_guide_options go = IMP_ELEMENTS_GUIDE_OPTIONS_INIT;
    struct imp_record read;
    struct traced t;
    imp_elements *e;
    imp_guide *guide;
    begin(&t, "elements/b.xml", NULL, true);
    o.stop = -1;
    o.eps_last = 3e-3;
    test_must(ctx, imp_elements_create(t.scene, &o, &e));
    test_must(ctx, imp_elements_solve(e));
    test_must(ctx, imp_elements_guide(e, &go, &guide));
    const struct imp_guide *follows = imp__guide_of(t.scene, &t.integrator, guide);
    int differ = 0;
    for (int i = 0; i < 100; i++) {
        struct imp_walk with, without;
        trace(&t, i, &without);
        t.tracer.guide = follows;
        trace(&t, i, &with);
        t.tracer.guide = NULL;
        differ += !same_bits(with.L, without.L);
    }
    tap_ok(differ > 20, "a guide makes other walks # %d of 100", differ);
    t.tracer.guide = follows;
    kept_same(&t, "guided", &read);
    imp__record_destroy(&read);
    imp_guide_destroy(guide);
    imp_elements_destroy(e);
    end(&t);
}

static void wavelengths(void)
{
    struct imp_record read;
    struct traced t;
    mode = IMP_SPECTRAL;
    begin(&t, "cornell.xml", "res=32", true);
    mode = IMP_RGB;
    struct imp_wavelengths other = t.scene->wavelengths[0];
    other.hi -= 1;
    t.tracer.wavelengths = t.scene->wavelengths;
    kept_same(&t, "four wavelengths", &read);
    t.tracer.wavelengths = &other;
    const enum imp_status st = imp__record_check(&read, &t.tracer);
    tap_ok(st == IMP_E_ARG, "walks of other wavelengths are refused # %s",
           imp_last_error(ctx));
    t.tracer.wavelengths = NULL;
    tap_ok(imp__record_check(&read, &t.tracer) == IMP_E_ARG, "and walks of colours");
    imp__record_destroy(&read);
    end(&t);
}

/* ---- Media whose extinction varies, branches of every vertex ---------------------- */

#define ROOM                                                                             \
    "<sensor type='perspective'><float name='fov' value='40'/><transform "               \
    "name='to_world'><lookat origin='0,1,6' target='0,.3,0' up='0,1,0'/></transform>"    \
    "<film type='hdrfilm'><integer name='width' value='16'/><integer name='height' "     \
    "value='16'/><rfilter type='box'/></film></sensor><emitter type='constant'>"         \
    "<rgb name='radiance' value='.3,.4,.5'/></emitter><shape type='rectangle'>"          \
    "<transform name='to_world'><rotate x='1' angle='-90'/><scale value='4'/>"           \
    "<translate y='-1'/></transform><bsdf type='diffuse'/></shape><shape "               \
    "type='sphere'><point name='center' x='1' y='3' z='0'/><float name='radius' "        \
    "value='.5'/><emitter type='area'><float name='radiance' value='4'/></emitter>"      \
    "</shape>"

static void cloud(void)
{
    enum { N_CELLS = 4 * 4 * 4 };
    float value[3 * N_CELLS];
    char vol[64], xml[4096];
    for (int k = 0; k < 3 * N_CELLS; k++) value[k] = (float)(4 * unit_noise((size_t)k));
    vol_write(vol, 4, 4, 4, 3, value);
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='volpath'><integer name='rr_depth' "
             "value='6'/></integrator>" ROOM
             "<shape type='cube'><bsdf type='null'/><medium name='interior' "
             "type='heterogeneous'><volume name='sigma_t' type='gridvolume'><string "
             "name='filename' value='%s'/><transform name='to_world'><scale value='2'/>"
             "<translate x='-1' y='-1' z='-1'/></transform></volume><rgb name='albedo' "
             "value='.9,.7,.5'/><phase type='hg'><float name='g' value='.4'/></phase>"
             "</medium></shape></scene>",
             vol);
    const struct scene_case c = {xml, "a coloured cloud", true, 0};
    scene_test(&c);
    remove(vol);
}

static void tree(void)
{
    const struct scene_case c = {
        "<scene version='3.0.0'><integrator type='path'><string name='weights' "
        "value='kernel=1,emitters=1,environment=1'/><integer name='split' value='2'/>"
        "<integer name='max_depth' value='5'/></integrator>" ROOM
        "<shape type='sphere'><bsdf type='phong'><float name='exponent' value='6'/>"
        "</bsdf></shape></scene>",
        "two vertices that branch", false, 0};
    scene_test(&c);
}

/* ---- Refused --------------------------------------------------------------------- */

static struct imp_record some(struct traced *t, int n, size_t budget, enum imp_status *st)
{
    struct imp_record r;
    *st = IMP_OK;
    test_must(ctx, imp__record_create(&t->tracer, budget, &r));
    for (int i = 0; i < n && *st == IMP_OK; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&t->arena);
        struct imp_walk w;
        trace(t, i, &w);
        *st = imp__record_keep(&r, &w, i);
        imp__arena_rewind(&t->arena, mark);
    }
    return r;
}

static void refused_by(const char *other, const char *defines, int change,
                       const char *word)
{
    struct traced t;
    struct imp_record r;
    begin(&t, other, defines, true);
    if (change == 1) t.integrator.max_depth = 3;
    if (change == 2) t.integrator.rr_depth = 4;
    const enum imp_status st = imp__record_read(&t.tracer, path, PLENTY, &r);
    tap_ok(st == IMP_E_ARG && strstr(imp_last_error(ctx), word),
           "walks of another scene are refused # %s",
           st == IMP_OK ? "read" : imp_last_error(ctx));
    if (st == IMP_OK) imp__record_destroy(&r);
    end(&t);
}

static void other_scenes(void)
{
    struct traced t;
    struct imp_record r;
    enum imp_status st;
    begin(&t, "cornell.xml", "res=32", true);
    struct imp_record kept = some(&t, 50, PLENTY, &st);
    test_must(ctx, imp__record_write(&kept, path));

    /* Control: the same scene, loaded again, with another theta. */
    struct traced again;
    begin(&again, "cornell.xml", "res=32", true);
    imp__param_set(&again.scene->params[0], 0,
                   0.5 * imp__param_get(&again.scene->params[0], 0));
    st = imp__record_read(&again.tracer, path, PLENTY, &r);
    tap_ok(st == IMP_OK, "the same scene at other parameters reads them # %s",
           st == IMP_OK ? "" : imp_last_error(ctx));
    if (st == IMP_OK) imp__record_destroy(&r);
    end(&again);

    refused_by("cornell.xml", "res=33", 0, "sensor");
    refused_by("cornell.xml", "res=32", 1, "integrator");
    refused_by("cornell.xml", "res=32", 2, "integrator");
    refused_by("furnace.xml", NULL, 0, "objects");
    test_must(ctx, imp__record_check(&kept, &t.tracer));
    t.integrator.max_depth = 2;
    tap_ok(imp__record_check(&kept, &t.tracer) == IMP_E_ARG, "before evaluating too # %s",
           imp_last_error(ctx));
    imp__record_destroy(&kept);
    end(&t);

    /* Numbers that bend rays. */
    begin(&t, "bend/seen.xml", "cells=1 width=8", true);
    kept = some(&t, 50, PLENTY, &st);
    struct imp_param *index = &t.scene->params[t.scene->bodies[0]->numbers[0].param];
    imp__param_set(index, 0, imp__param_get(index, 0) + 1e-6);
    tap_ok(imp__record_check(&kept, &t.tracer) == IMP_E_ARG,
           "with another index of a medium # %s", imp_last_error(ctx));
    imp__record_destroy(&kept);
    end(&t);
}

static void not_kept(void)
{
    struct traced t;
    enum imp_status st;
    begin(&t, "bend/seen.xml", "cells=1 width=8", false);
    struct imp_record r = some(&t, 500, PLENTY, &st);
    tap_ok(st == IMP_E_UNSUPPORTED, "walks that move with a field are refused # %s",
           imp_last_error(ctx));
    imp__record_destroy(&r);
    end(&t);

    begin(&t, "stam.xml", "integrator=stam", true);
    t.integrator.alpha_gradient = IMP_ALPHA_ATTACHED;
    struct imp_job job = imp__job(t.tracer.scene, t.tracer.sensor, NULL, NULL);
    job.walks = &t.integrator;
    imp__job_state(&job, IMP_HAS_RECORDING, NULL);
    tap_ok(imp__job_allowed(&job) == IMP_E_UNSUPPORTED, "and attached derivatives # %s",
           imp_last_error(ctx));
    t.integrator.alpha_gradient = IMP_ALPHA_DETACHED;
    end(&t);

    begin(&t, "fog.xml", "res=32", true);
    t.tracer.collisions_fixed = false;
    r = some(&t, 100, PLENTY, &st);
    tap_ok(st == IMP_E_UNSUPPORTED, "and probes of extinctions # %s",
           imp_last_error(ctx));
    imp__record_destroy(&r);
    end(&t);

    begin(&t, "cornell.xml", "res=32", true);
    const struct imp_entry one = {.e = {1, 1, 1, 1}, .b = {1, 1, 1, 1}};
    struct imp_walk w;
    for (int i = 0; trace(&t, i, &w), !w.first; i++) {}
    test_must(ctx, imp__record_create(&t.tracer, PLENTY, &r));
    w.entry = &one;
    tap_ok(imp__record_keep(&r, &w, 0) == IMP_E_UNSUPPORTED && r.n_walks == 0,
           "and walks whose light enters at their vertices # %s", imp_last_error(ctx));
    w.entry = NULL;
    tap_ok(imp__record_keep(&r, &w, 0) == IMP_OK && r.n_walks == 1, "and none else");
    imp__record_destroy(&r);
    end(&t);

    /* The budget, to the byte. */
    begin(&t, "cornell.xml", "res=32", true);
    r = some(&t, 500, PLENTY, &st);
    const size_t bytes = imp__record_bytes(&r);
    char needed[32];
    snprintf(needed, sizeof needed, "%zu bytes", bytes);
    test_must(ctx, imp__record_write(&r, path));
    imp__record_destroy(&r);
    r = some(&t, 500, bytes, &st);
    tap_ok(st == IMP_OK && r.n_walks == 500, "500 walks in a budget of %zu bytes", bytes);
    imp__record_destroy(&r);
    r = some(&t, 500, bytes - 1, &st);
    tap_ok(st == IMP_E_NOMEM && r.n_walks == 499 && strstr(imp_last_error(ctx), needed),
           "and not in one less # %s", imp_last_error(ctx));
    imp__record_destroy(&r);
    tap_ok(imp__record_read(&t.tracer, path, bytes - 1, &r) == IMP_E_NOMEM &&
               strstr(imp_last_error(ctx), needed),
           "nor from a file # %s", imp_last_error(ctx));
    end(&t);
}

/* ---- Files ----------------------------------------------------------------------- */

static unsigned char *bytes_read(size_t *n)
{
    FILE *f = fopen(path, "rb");
    static unsigned char all[1 << 20];
    *n = f ? fread(all, 1, sizeof all, f) : 0;
    if (f) fclose(f);
    return all;
}
static void bytes_write(const unsigned char *b, size_t n)
{
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(b, 1, n, f) != n || fclose(f) != 0) {
        printf("Bail out! cannot write %s\n", path);
        exit(99);
    }
}
static enum imp_status file_read(struct traced *t)
{
    struct imp_record r;
    const enum imp_status st = imp__record_read(&t->tracer, path, PLENTY, &r);
    if (st == IMP_OK) imp__record_destroy(&r);
    return st;
}

static void files(void)
{
    struct traced t;
    enum imp_status st;
    size_t n;
    begin(&t, "cornell.xml", "res=32", true);
    struct imp_record kept = some(&t, 20, PLENTY, &st);
    test_must(ctx, imp__record_write(&kept, path));
    unsigned char *b = bytes_read(&n);
    const size_t pages = (kept.n_vertices + IMP_RECORD_PAGE - 1) / IMP_RECORD_PAGE;
    tap_ok(n == 96 + imp__record_bytes(&kept) - 2 * kept.n_vertices + 4 * pages + 8 &&
               file_read(&t) == IMP_OK,
           "a head of 96 bytes, the walks, a checksum # %zu", n);
    b[12] = 6;
    bytes_write(b, n);
    tap_ok(file_read(&t) == IMP_E_SCENE &&
               strstr(imp_last_error(ctx),
                      "recorded walks of version 6; this program reads 7"),
           "the version before: refused # %s", imp_last_error(ctx));
    b[12] = 7;

    static const struct {
        size_t at;
        const char *word;
    } parts[] = {{0, "not a file"}, {8, "byte order"}, {12, "version"}, {20, "build"}};
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) {
        unsigned char old[4];
        memcpy(old, b + parts[k].at, 4);
        for (int j = 0; j < 4; j++) b[parts[k].at + (size_t)j] = old[3 - j];
        bytes_write(b, n);
        st = file_read(&t);
        tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), parts[k].word),
               "refused # %s", imp_last_error(ctx));
        memcpy(b + parts[k].at, old, 4);
    }
    int read = 0;
    for (size_t k = 0; k < n; k += 1 + k / 40) { /* every byte of the head */
        b[k] ^= (unsigned char)(1u << k % 8);
        bytes_write(b, n);
        read += file_read(&t) == IMP_OK;
        b[k] ^= (unsigned char)(1u << k % 8);
    }
    tap_ok(read == 0, "one bit flipped: refused # %d read", read);
    for (size_t k = 0; k < n; k += 1 + k / 20) {
        bytes_write(b, k);
        read += file_read(&t) == IMP_OK;
    }
    tap_ok(read == 0, "cut short: refused # %s", imp_last_error(ctx));
    b[n] = 0;
    bytes_write(b, n + 1);
    tap_ok(file_read(&t) == IMP_E_IO, "a byte too much: refused # %s",
           imp_last_error(ctx));
    bytes_write(b, n);
    tap_ok(file_read(&t) == IMP_OK, "control: unchanged it is read");
    remove(path);
    tap_ok(file_read(&t) == IMP_E_IO, "no file # %s", imp_last_error(ctx));
    tap_ok(imp__record_write(&kept, "no/such/folder/file") == IMP_E_IO, "unwritable # %s",
           imp_last_error(ctx));
    imp__record_destroy(&kept);
    kept = some(&t, 0, PLENTY, &st);
    test_must(ctx, imp__record_write(&kept, path));
    tap_ok(file_read(&t) == IMP_OK, "no walks are a file too");
    imp__record_destroy(&kept);
    end(&t);
}

/* Decisions and items that no walk of the scene has, with a checksum that fits. */
static void impossible(void)
{
    static const char *const what[] = {"a vertex beyond the walk's",
                                       "more events than there are",
                                       "another medium",
                                       "an unknown event",
                                       "a negative length",
                                       "no direction",
                                       "a vertex in no medium",
                                       "a sensor twice",
                                       "a point on a surface in a medium"};
    enum { CASES = sizeof what / sizeof *what };
    struct traced t;
    enum imp_status st;
    begin(&t, "fog.xml", "res=32", true);
    struct imp_record r = some(&t, 200, PLENTY, &st);
    size_t i = 0; /* a walk that scatters in the fog first */
    struct imp_decision second = {.scatterer = IMP_AT_SKY};
    for (; i < r.n_walks; i++) {
        const struct imp_record_walk *w = imp__record_at(&r, i);
        if (w->n <= 2) continue;
        imp__record_vertex(&r, w->first + 1, &second);
        if (second.scatterer == IMP_IN_MEDIUM) break;
    }
    const struct imp_record_walk *w = imp__record_at(&r, i);
    union imp_kept *head = imp__record_item(&r, w->first_item), *way = head + 1,
                   *event = head + 2;
    uint32_t *words = imp__record_words(&r, w->first + 1), good_words[IMP_PACKED_MOST];
    const size_t n_words = imp__packed_put(&second, good_words);
    const union imp_kept good[3] = {*head, *way, *event};
    int refused = 0;
    for (int k = 0; k < CASES; k++) {
        if (k == 0) head->head.at = w->n_vertices;
        if (k == 1) way->way.n = w->n_items;
        if (k == 2) event->event.medium = 1;
        if (k == 3) event->event.kind = 4;
        if (k == 4) event->event.t = -1;
        if (k == 5) memset(way->way.d, 0, sizeof way->way.d);
        struct imp_packed_head h;
        memcpy(&h, words, sizeof h);
        if (k == 6) h.shape = 7;
        if (k == 7) h.shape = -1, h.scatterer = IMP_AT_SENSOR;
        if (k == 8) h.located = IMP_LOCATED_UV;
        memcpy(words, &h, sizeof h);
        test_must(ctx, imp__record_write(&r, path));
        st = file_read(&t);
        refused += st == IMP_E_IO && strstr(imp_last_error(ctx), "cannot have");
        if (st == IMP_OK) printf("# read: %s\n", what[k]);
        *head = good[0];
        *way = good[1];
        *event = good[2];
        memcpy(words, good_words, 4 * n_words);
    }
    tap_ok(refused == CASES, "what no walk has is refused # %d of %d", refused, CASES);
    test_must(ctx, imp__record_write(&r, path));
    tap_ok(file_read(&t) == IMP_OK, "control: as they were they are read");
    imp__record_destroy(&r);
    end(&t);

    /* Side walks that hang on nothing, or have vertices of others. */
    begin(&t, "cornell.xml", "res=32", true);
    t.tracer.split = 3;
    r = some(&t, 50, PLENTY, &st);
    for (i = 0; imp__record_at(&r, i)->n_items == 0; i++) {}
    head = imp__record_item(&r, imp__record_at(&r, i)->first_item);
    const union imp_kept side = *head;
    refused = 0;
    for (int k = 0; k < 5; k++) {
        if (k == 0) head->head.side.n = 0;
        if (k == 1) head->head.side.n += 1;
        if (k == 2) head->head.side.first = 0;
        if (k == 3) head->head.side.depth = -1;
        if (k == 4) head->head.at = head->head.side.first;
        test_must(ctx, imp__record_write(&r, path));
        st = file_read(&t);
        refused += st == IMP_E_IO && strstr(imp_last_error(ctx), "cannot have");
        *head = side;
    }
    tap_ok(refused == 5, "and side walks that are none # %d of 5", refused);
    imp__record_destroy(&r);
    end(&t);
}

int main(void)
{
    ctx = test_context(1);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) scene_test(&cases[k]);
    guided();
    wavelengths();
    other_scenes();
    not_kept();
    cloud();
    tree();
    files();
    impossible();
    remove(path);
    imp_context_destroy(ctx);
    return tap_done();
}
