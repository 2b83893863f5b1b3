/* SPDX-License-Identifier: Apache-2.0
 *
 * Nests of overlapping shapes along a ray, and the materials of pairs of dielectrics, whose index
 * is the ratio of the two (priorities.h). */
#include "priorities.h"
#include "instances.h"
#include "scene_build.h"

#define MATERIALS_MAX 64
#define HITS_MAX      4096 /* boundaries that a ray is followed through */

/* ---- Nests ------------------------------------------------------------------------ */

static bool above(const struct imp_shape *a, const struct imp_shape *b)
{
    return !b || a->priority > b->priority ||
           (a->priority == b->priority && a->index > b->index);
}

const struct imp_shape *imp__nest_top(const struct imp_scene *scene,
                                      const struct imp_nest *nest)
{
    const struct imp_shape *top = NULL;
    for (int k = 0; k < nest->n; k++) {
        const struct imp_shape *s = scene->shapes[nest->shape[k]];
        if (above(s, top)) top = s;
    }
    return top;
}

const struct imp_medium *imp__nest_medium(const struct imp_scene *scene,
                                          const struct imp_nest *nest)
{
    const struct imp_shape *top = imp__nest_top(scene, nest);
    return top ? top->interior : nest->around;
}

bool imp__nest_has(const struct imp_nest *nest, int shape)
{
    for (int k = 0; k < nest->n; k++)
        if (nest->shape[k] == shape) return true;
    return false;
}
bool imp__nest_enter(struct imp_nest *nest, int shape)
{
    if (nest->n == IMP_NEST_MAX) return false;
    nest->shape[nest->n++] = shape;
    return true;
}
bool imp__nest_leave(struct imp_nest *nest, int shape)
{
    for (int k = 0; k < nest->n; k++) {
        if (nest->shape[k] != shape) continue;
        nest->shape[k] = nest->shape[--nest->n];
        return true;
    }
    return false;
}

bool imp__nest_sees(const struct imp_scene *scene, const struct imp_nest *nest,
                    const struct imp_shape *shape)
{
    return above(shape, imp__nest_top(scene, nest));
}

static int material_of(const struct imp_priorities *p, int bsdf)
{
    for (int k = 0; k < p->n; k++)
        if (p->material[k] == bsdf) return k;
    return -1;
}
const struct imp_bsdf *imp__nest_bsdf(const struct imp_scene *scene,
                                      const struct imp_nest *nest,
                                      const struct imp_shape *shape)
{
    const struct imp_priorities *p = scene->priorities;
    const struct imp_bsdf *own = imp__shape_bsdf(scene, shape);
    const struct imp_shape *top = imp__nest_top(scene, nest);
    if (!top || shape->priority == 0) return own;
    const int i = material_of(p, own->index),
              j = material_of(p, imp__shape_bsdf(scene, top)->index);
    return i < 0 || j < 0 ? own : &p->between[i * p->n + j];
}

bool imp__nest_at(const struct imp_scene *scene, double time, imp_v3 p, imp_v3 d,
                  struct imp_nest *nest)
{
    struct imp_nest ahead = {.n = 0}; /* entered on the way */
    imp_v3 o = p;
    nest->n = 0;
    for (int k = 0; k < HITS_MAX; k++) {
        struct imp_hit hit;
        struct imp_surface at;
        if (!imp__intersect_at(scene, time, &o, &d, 0, INFINITY, &hit)) return true;
        const struct imp_shape *s = scene->shapes[hit.shape];
        imp__hit_surface(scene, &hit, &o, &d, &at);
        o = imp__offset(at.p, at.ng, d);
        if (s->priority == 0) continue;
        if (imp__dot(at.ng, d) < 0) {
            if (!imp__nest_enter(&ahead, s->index)) return false;
        } else if (!imp__nest_leave(&ahead, s->index)) {
            if (!imp__nest_enter(nest, s->index)) return false;
        }
    }
    return false;
}

/* ---- Building --------------------------------------------------------------------- */

/* Indices of pairs, from those of the materials. */
static void fill(void *payload)
{
    const struct imp_priorities *p = payload;
    for (int i = 0; i < p->n; i++)
        for (int j = 0; j < p->n; j++) {
            const struct imp_bsdf *a = p->scene->bsdfs[p->material[i]],
                                  *b = p->scene->bsdfs[p->material[j]];
            const double ratio =
                a->input[a->index_input]->value[0] / b->input[b->index_input]->value[0];
            p->index[i * p->n + j].value = imp__spec(ratio);
        }
}

static enum imp_status shape_check(struct imp_scene *scene, const struct imp_shape *s)
{
    imp_context *ctx = scene->ctx;
    const struct imp_bsdf *b = imp__shape_bsdf(scene, s);
    if (s->emitter >= 0 || s->sensor || s->body)
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "shape '%s' has a priority, and can be no %s: parts of it may "
                          "not be there",
                          s->name,
                          s->sensor         ? "sensor"
                          : s->emitter >= 0 ? "light"
                                            : "body of graded index");
    if (s->exterior)
        return imp__error(ctx, IMP_E_SCENE,
                          "shape '%s' has a priority and an exterior: what lies around "
                          "it follows from the other shapes there",
                          s->name);
    if (b->flags & IMP_BSDF_TRANSMIT && b->index_input < 0 && !(b->flags & IMP_BSDF_NULL))
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "shape '%s' has a priority, and its bsdf is of type %s: a "
                          "boundary that light passes is null or dielectric then",
                          s->name, b->ops->name);
    return IMP_OK;
}

/* The material of a pair: that of the inside with the other index. */
static enum imp_status pair_make(struct imp_scene *scene, struct imp_priorities *p, int i,
                                 int j)
{
    const struct imp_bsdf *own = scene->bsdfs[p->material[i]];
    struct imp_bsdf *b = &p->between[i * p->n + j];
    struct imp_input *index = &p->index[i * p->n + j];
    *b = *own;
    b->input = imp__arena_array(&scene->arena, (size_t)own->n_in, sizeof *b->input);
    if (!b->input) return imp__build_no_memory(scene);
    memcpy(b->input, own->input, (size_t)own->n_in * sizeof *b->input);
    *index = *own->input[own->index_input];
    index->param = -1;
    b->input[own->index_input] = index;
    return IMP_OK;
}

static enum imp_status materials_list(struct imp_scene *scene, struct imp_priorities *p)
{
    enum imp_status st = IMP_OK;
    for (int k = 0; k < scene->n_all_shapes; k++) {
        const struct imp_shape *s = scene->shapes[k];
        const struct imp_bsdf *b = imp__shape_bsdf(scene, s);
        if (s->priority == 0 || b->index_input < 0 || material_of(p, b->index) >= 0)
            continue;
        if (p->n == MATERIALS_MAX)
            IMP_TRY(imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                               "shapes with a priority have more than %d materials with "
                               "an index",
                               MATERIALS_MAX));
        p->material[p->n++] = b->index;
    }
    for (int i = 0; i < p->n && p->n > 1; i++) {
        const struct imp_bsdf *b = scene->bsdfs[p->material[i]];
        const struct imp_input *in = b->input[b->index_input];
        if (in->texture || in->spectrum)
            IMP_TRY(imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                               "bsdf '%s': the index of a shape with a priority is one "
                               "number, the same at all wavelengths, where another has "
                               "one, too",
                               b->name));
    }
out:
    return st;
}

enum imp_status imp__priorities_build(struct imp_scene *scene)
{
    enum imp_status st = IMP_OK;
    bool any = false;
    for (int k = 0; k < scene->n_all_shapes; k++) {
        const struct imp_shape *s = scene->shapes[k];
        if (s->priority == 0) continue;
        any = true;
        IMP_TRY(shape_check(scene, s));
    }
    if (!any) return IMP_OK;
    struct imp_priorities *p = imp__arena_array(&scene->arena, 1, sizeof *p);
    if (!p) return imp__build_no_memory(scene);
    *p = (struct imp_priorities){
        .scene = scene,
        .material = imp__arena_array(&scene->arena, MATERIALS_MAX, sizeof *p->material)};
    if (!p->material) return imp__build_no_memory(scene);
    IMP_TRY(materials_list(scene, p));
    const size_t pairs = (size_t)p->n * (size_t)p->n;
    p->between = imp__arena_array(&scene->arena, pairs + 1, sizeof *p->between);
    p->index = imp__arena_array(&scene->arena, pairs + 1, sizeof *p->index);
    if (!p->between || !p->index) return imp__build_no_memory(scene);
    for (int i = 0; i < p->n; i++)
        for (int j = 0; j < p->n; j++) IMP_TRY(pair_make(scene, p, i, j));
    fill(p);
    for (int i = 0; i < p->n; i++) {
        const struct imp_bsdf *b = scene->bsdfs[p->material[i]];
        IMP_TRY(imp__build_watch(scene, &b->input[b->index_input], 1, fill, p));
    }
    scene->priorities = p;
out:
    return st;
}
