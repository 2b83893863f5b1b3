/* SPDX-License-Identifier: Apache-2.0
 *
 * Lines among shapes that are met from outside alone (boundary_one_sided.h). */
#include "boundary_one_sided.h"
#include "moved_mirror.h"
#include "scene/instances.h"

extern const struct imp_emitter_ops imp__projector;

bool imp__one_sided_sees(const struct imp__edge_draw *d, const struct imp_surface *at,
                         imp_v3 o)
{
    const imp_v3 from = imp__offset(at->p, at->ng, o - at->p), back = o - from;
    struct imp_hit between;
    return !imp__intersect_at(d->b->tracer->scene, d->time, &from, &back, 0,
                              1 - IMP_BESIDE, &between);
}

#define BEHIND                                                                           \
    0.05 /* probability of what lies behind a wall that sees the line's beginning */

bool imp__one_sided_follow(const struct imp__edge_draw *d, imp_v3 o, imp_v3 w,
                           double from, unsigned dim, struct imp_hit *hit,
                           struct imp_surface *at, struct imp__line *line)
{
    enum { WALLS = 16 };
    const struct imp_scene *scene = d->b->tracer->scene;
    const imp_v3 start = o + w * from;
    for (unsigned k = 0; k < WALLS; k++) {
        if (!imp__intersect_at(scene, d->time, &o, &w, from, INFINITY, hit)) return false;
        imp__hit_surface(scene, hit, &o, &w, at);
        const bool sees = imp__one_sided_sees(d, at, start);
        if (scene->shapes[hit->shape]->geometry != IMP_CURVES) return sees;
        if (sees && imp__u01(d->key, dim + k) >= BEHIND) {
            line->times *= 1 / (1 - BEHIND);
            return true;
        }
        if (sees) line->times *= 1 / BEHIND;
        from = (double)hit->t + IMP_CONTACT * d->b->size;
    }
    return false;
}

bool imp__one_sided_line(const struct imp__edge_draw *d, imp_v3 o, imp_v3 r, double till)
{
    const double far = isfinite(till) ? till : 4 * d->b->size / imp__length(r);
    const imp_v3 end = o + r * far, back = r * -far;
    struct imp_hit between;
    return !imp__intersect_at(d->b->tracer->scene, d->time, &end, &back, 0,
                              1 - IMP_BESIDE, &between);
}

static const char *shape_why(const struct imp__boundary *b, const struct imp__body *body)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_hit hit = {.shape = body->shape, .place = body->place};
    const struct imp_bsdf *own = imp__hit_bsdf(scene, &hit);
    return imp__moves_smooth(scene, body->shape)
               ? "has vertex normals (face_normals makes it flat)"
           : own->straight          ? "lets light go straight on"
           : imp__mirror_lobes(own) ? "is a mirror, or bends light"
                                    : NULL;
}

enum imp_status imp__one_sided_allowed(const struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    if (!b->one_sided) return IMP_OK;
    if (b->fog || b->media)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "derivatives by what moves: there are media, in a scene with "
                          "curves, which are met from outside alone");
    for (int k = 0; k < scene->n_emitters; k++)
        if (scene->emitters[k]->ops == &imp__projector)
            return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                              "derivatives by what moves: light '%s' (%s) shines in a "
                              "scene with curves, which are met from outside alone",
                              scene->emitters[k]->name ? scene->emitters[k]->name : "",
                              scene->emitters[k]->ops->name);
    for (size_t k = 0; k < b->edges->n_bodies; k++) {
        const char *why = shape_why(b, &b->edges->body[k]);
        if (why)
            return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                              "derivatives by what moves: shape '%s' %s, in a scene with "
                              "curves, which are met from outside alone",
                              scene->shapes[b->edges->body[k].shape]->name, why);
    }
    return IMP_OK;
}
