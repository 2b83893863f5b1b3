/* SPDX-License-Identifier: Apache-2.0
 *
 * Rows `aim`: of rays from scattering vertices towards a light or a proxy, the fraction
 * that hits anything, surface or environment. A proxy that no ray hits draws directions
 * in vain. */
#include "check.h"
#include "scene/aimed_directions.h"

#define VERTICES 2000 /* from which rays are sent towards lights and proxies */

/* Rays sent from scattering vertices, and how many of them hit something. */
struct ray_count {
    double sent, met;
};
static void rays_send(const struct imp__check *c, struct imp_key key,
                      const struct imp_vertex *v, struct ray_count *count)
{
    const struct imp_scene *scene = c->problem->scene;
    for (int k = 0; k < scene->aims.n; k++) {
        const struct imp_shape *shape = scene->aims.list[k].shape;
        const imp_v3 p = imp__decided_v3(v->d.p);
        const double u[2] = {imp__u01(key, (uint32_t)(2 * k)),
                             imp__u01(key, (uint32_t)(2 * k + 1))};
        struct imp_light_sample ls;
        struct imp_hit hit;
        if (!shape->ops->sample_toward(shape, &p, u, &ls)) continue;
        const imp_v3 o = imp__offset(p, v->ng, ls.wi);
        count[k].sent++;
        count[k].met += scene->environment >= 0 ||
                        imp__intersect(scene, &o, &ls.wi, 0, INFINITY, &hit);
    }
}

enum imp_status imp__check_aims(struct imp__check *c, const struct imp_tracer *tracer)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *scene = c->problem->scene;
    const struct imp_film_desc *film = &tracer->sensor->film;
    const int n = scene->aims.n;
    if (n == 0) return IMP_OK;
    struct imp_arena arena;
    struct ray_count *count = imp__alloc(c->ctx, (size_t)n, sizeof *count);
    imp__arena_init(&arena, c->ctx);
    if (!count) IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
    for (int i = 0; i < VERTICES; i++) {
        const struct imp_key key = imp__key(tracer->seed, 0xa1, (uint64_t)i);
        const struct imp_arena_mark mark = imp__arena_mark(&arena);
        struct imp_walk walk;
        imp__walk_trace(tracer, &arena, (int)(imp__u01(key, 0) * film->crop_w),
                        (int)(imp__u01(key, 1) * film->crop_h), i, &walk);
        for (const struct imp_vertex *v = walk.first; v; v = v->next)
            if (v->bsdf && v->bsdf->flags & IMP_BSDF_SMOOTH) {
                rays_send(c, key, v, count);
                break;
            }
        imp__arena_rewind(&arena, mark);
    }
    for (int k = 0; k < n; k++) {
        if (scene->aims.list[k].light && scene->aims.list[k].shape->index >= 0)
            continue; /* a light is there to be met */
        struct imp_check_row row = {.limit = 1, .reference = 1};
        row.value = count[k].sent > 0 ? count[k].met / count[k].sent : 0;
        row.ok = row.value > 0;
        row.error = 1 - row.value;
        const char *name = scene->aims.list[k].shape->name;
        IMP_TRY(imp__check_row(c, "aim", name ? name : "proxy", -1, &row));
    }
out:
    imp__arena_free(&arena);
    imp__release(c->ctx, count);
    return st;
}
