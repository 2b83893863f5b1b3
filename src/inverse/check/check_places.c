/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertices of recorded walks, sorted by what scatters there. */
#include "check_places.h"
#include "base/arguments.h"
#include "inverse/estimate/problem_tracer.h"
#include "math/rng.h"
#include "scene/in_medium.h"
#include "walk/core/vertex.h"

#define PER_KIND 48     /* places of a scatterer */
#define WALKS    40000  /* at most */
#define VERTICES 200000 /* of these walks, at most */
#define DEPTH    16     /* vertices of a walk that are looked at */
#define MEMORY   ((size_t)256 << 20)

static int kind_of(const struct imp_scene *scene, const struct imp_vertex *v)
{
    if (!v->bsdf) return -1;
    if (v->d.scatterer == IMP_IN_MEDIUM)
        return v->d.shape >= 0 ? scene->n_bsdfs + v->d.shape : -1;
    if (v->d.scatterer != IMP_AT_SURFACE) return -1;
    return v->bsdf->index;
}

/* The vertices of a walk, of scatterers that want more. Returns how many. */
static int walk_take(struct imp__places *p, const struct imp_walk *walk)
{
    const struct imp_scene *scene = p->tracer.scene;
    int taken = 0, depth = walk->depth;
    for (const struct imp_vertex *v = walk->first; v && depth < DEPTH;
         v = v->next, depth++) {
        const int k = kind_of(scene, v);
        if (k < 0 || p->kind[k].n == PER_KIND) continue;
        struct imp__place *x = &p->kind[k].place[p->kind[k].n++];
        *x = (struct imp__place){.walk = *walk, .v = v, .depth = depth};
        if (v->d.scatterer == IMP_IN_MEDIUM) {
            x->at = (struct imp_surface){.p = imp__decided_v3(v->d.p)};
            x->frame = (struct imp_frame){{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
            x->located = true;
        } else if (imp__decided_surface(scene, &v->d, walk->time, &x->at)) {
            x->frame = (struct imp_frame){x->at.s, x->at.t, x->at.n};
            x->located = true;
        }
        taken++;
    }
    return taken;
}

static enum imp_status tracer_make(struct imp__places *p, bool *any)
{
    const struct imp__check *c = p->check;
    struct imp_run run = c->run;
    p->tracer = c->tracer;
    *any = true;
    if (c->tracer.integrator->from_lights) {
        run.from = IMP_FROM_SENSOR;
        if (!imp__walks_from(c->tracer.integrator, IMP_FROM_SENSOR)) {
            *any = false;
            return IMP_OK;
        }
        IMP_CHECKED(imp__problem_tracer_of_any_end(c->problem, &run, NULL, &p->tracer));
    }
    *any = !p->tracer.kept && !p->tracer.integrator->both;
    p->tracer.value_only = false;
    p->tracer.collisions_fixed = true; /* no probes: their walks are not looked at */
    return IMP_OK;
}

static bool full(const struct imp__places *p)
{
    for (int k = 0; k < p->n_kinds; k++)
        if (p->kind[k].n < PER_KIND) return false;
    return true;
}

static void list_all(struct imp__places *p)
{
    for (int i = 0; i < PER_KIND; i++)
        for (int k = 0; k < p->n_kinds; k++)
            if (i < p->kind[k].n) p->all[p->n_all++] = &p->kind[k].place[i];
}

enum imp_status imp__places_find(struct imp__places *p)
{
    enum imp_status st = IMP_OK;
    const struct imp__check *c = p->check;
    const struct imp_scene *scene = c->problem->scene;
    bool any;
    imp__arena_init(&p->arena, c->ctx);
    p->n_kinds = scene->n_bsdfs + scene->n_media;
    const size_t most = (size_t)p->n_kinds * PER_KIND + 1;
    p->kind = imp__arena_array(&p->arena, (size_t)p->n_kinds + 1, sizeof *p->kind);
    p->all = imp__arena_array(&p->arena, most, sizeof(struct imp__place *));
    struct imp__place *room = imp__arena_array(&p->arena, most, sizeof *room);
    if (!p->kind || !p->all || !room)
        IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
    for (int k = 0; k < p->n_kinds; k++) {
        const bool medium = k >= scene->n_bsdfs;
        p->kind[k].place = room + (size_t)k * PER_KIND;
        p->kind[k].name = medium                  ? scene->media[k - scene->n_bsdfs]->name
                          : scene->bsdfs[k]->name ? scene->bsdfs[k]->name
                                                  : scene->bsdfs[k]->ops->name;
    }
    IMP_TRY(tracer_make(p, &any));
    const struct imp_film_desc *film = &p->tracer.sensor->film;
    const uint64_t pixels = (uint64_t)film->crop_w * (uint64_t)film->crop_h;
    int64_t vertices = 0;
    for (int64_t t = 0;
         any && t < WALKS && vertices < VERTICES && !full(p) && p->arena.total < MEMORY;
         t++) {
        const uint64_t pixel = imp__mix64((uint64_t)t + 0x7c159d3b) % pixels;
        const struct imp_arena_mark mark = imp__arena_mark(&p->arena);
        struct imp_walk walk;
        imp__walk_trace(&p->tracer, &p->arena, (int)(pixel % (uint64_t)film->crop_w),
                        (int)(pixel / (uint64_t)film->crop_w), t, &walk);
        vertices += walk.n;
        if (walk.dropped == IMP_DROP_MEMORY)
            IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
        if (walk.dropped || walk_take(p, &walk) == 0) imp__arena_rewind(&p->arena, mark);
    }
    list_all(p);
out:
    return st;
}

void imp__places_destroy(struct imp__places *p) { imp__arena_free(&p->arena); }

void imp__place_step(const struct imp__places *p, const struct imp__place *place,
                     struct imp_walk *walk, imp_spec *scratch, struct imp_step *s)
{
    const struct imp_vertex *v = place->v;
    *walk = place->walk;
    walk->first = walk->last = NULL;
    walk->n = 0;
    imp__step_begin(&p->tracer, NULL, walk, scratch, s);
    s->recorded = false;
    s->depth = place->depth;
    s->at = imp__vertex_at(v);
    s->wo = s->wo_drawn = imp__vertex_wo(v);
    s->in = v->in;
    const struct imp_guide *guide = s->guided.guide;
    if (guide && place->located && v->d.scatterer == IMP_AT_SURFACE) {
        const struct imp_hit hit = {.shape = v->d.shape, .prim = v->d.located.prim};
        const imp_v3 d = -imp__to_world(&place->frame, s->wo);
        s->guided.here =
            guide->find(guide, IMP_GUIDE_LIGHT, &hit, &place->at, d, &s->guided.at);
    }
    if ((s->mixed.all || s->guided.here) && place->located)
        imp__mixture_prepare(s, v->bsdf, place->at.p);
    s->mixed.only = -1;
}
