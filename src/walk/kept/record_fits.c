/* SPDX-License-Identifier: Apache-2.0
 *
 * Are the decisions of a walk that was read from a file such as the scene allows? Then
 * evaluating it is safe, whatever the bytes of the file are. */
#include "record.h"
#include "scene/located.h"
#include <math.h>

static bool all_finite(const imp_decided *x, int n)
{
    for (int k = 0; k < n; k++)
        if (!isfinite(x[k])) return false;
    return true;
}
/* Components of a unit vector, as it was rounded. */
static bool unit(const imp_decided *x)
{
    const double l2 = (double)x[0] * x[0] + (double)x[1] * x[1] + (double)x[2] * x[2];
    return fabs(l2 - 1) < 1e-3;
}
static bool weight(imp_decided x) { return isfinite(x) && x >= 0; }

static bool met_fits(const struct imp_scene *scene, const struct imp_decision *d)
{
    const struct imp_met *m = &d->met;
    if (m->emitter < 0) return m->emitter == -1;
    if (m->emitter >= scene->n_emitters) return false;
    const bool here =
        d->shape < 0 ? scene->emitters[m->emitter]->ops->flags & IMP_EMITTER_ENVIRONMENT
                     : m->emitter == scene->shapes[d->shape]->emitter;
    return here && weight(m->weight) && m->dist >= 0 && isfinite(m->cos_light) &&
           unit(m->d);
}

/* shape NULL: there is none to have a point. */
static bool located_fits(const struct imp_scene *scene, const struct imp_shape *shape,
                         const struct imp_located *x, uint32_t place)
{
    if (!shape) return x->prim == -1 && place == 0;
    return imp__located_fits(scene, shape, x, place == IMP_PLACE_MOST ? 0 : place);
}

static bool light_fits(const struct imp_scene *scene, const struct imp_bsdf *b,
                       const struct imp_decision *d)
{
    const struct imp_light *l = &d->light;
    if (d->connection == IMP_NOT_CONNECTED) return true;
    return d->connection <= IMP_CONNECTED && (b->flags & IMP_BSDF_SMOOTH) &&
           l->emitter >= 0 && l->emitter < scene->n_emitters && weight(l->weight) &&
           located_fits(scene, scene->emitters[l->emitter]->shape, &l->located, 0) &&
           all_finite(l->uv, 2) && all_finite(l->p, 3) && l->dist >= 0 &&
           isfinite(l->cos_light) && unit(l->d) && unit(l->wi);
}

static bool continuation_fits(const struct imp_bsdf *b, const struct imp_decision *d)
{
    if (!d->goes_on) return true;
    const unsigned needs = d->lobe == IMP_SMOOTH ? IMP_BSDF_SMOOTH : IMP_BSDF_DELTA;
    return d->lobe >= IMP_SMOOTH && (b->flags & (needs | IMP_BSDF_NULL)) && unit(d->wi) &&
           isfinite(d->pdf) && d->pdf > 0 && weight(d->share) && weight(d->rest) &&
           isfinite(d->survive) && d->survive > 0;
}

static bool goes_straight(const struct imp_decision *d)
{
    return d->goes_on && d->lobe == IMP_SMOOTH && unit(d->wi) && d->pdf == 1 &&
           d->survive == 1;
}
/* Where the camera is, if the first segment crosses media. */
static bool sensor_fits(const struct imp_decision *d)
{
    return goes_straight(d) && !d->glows && d->met.emitter == -1 &&
           d->connection == IMP_NOT_CONNECTED;
}
/* Past an environment the walk comes to the next one. */
static bool sky_fits(const struct imp_scene *scene, const struct imp_decision *d,
                     bool last)
{
    return (last ? !d->goes_on : goes_straight(d)) && !d->glows &&
           d->connection == IMP_NOT_CONNECTED && d->met.emitter >= 0 &&
           met_fits(scene, d);
}

static bool vertex_fits(const struct imp_scene *scene, const struct imp_decision *d,
                        bool first, bool last)
{
    if (!all_finite(d->uv, 2) || !all_finite(d->p, 3) || !isfinite(d->passes) ||
        !weight(d->glow_weight) || (!d->goes_on && !last))
        return false;
    if (d->shape == -1 && d->scatterer == IMP_AT_SENSOR) return first && sensor_fits(d);
    if (d->shape == -1) return d->scatterer == IMP_AT_SKY && sky_fits(scene, d, last);
    const bool inside = d->scatterer == IMP_IN_MEDIUM;
    if (d->shape < 0 || d->shape >= (inside ? scene->n_media : scene->n_all_shapes))
        return false;
    const struct imp_bsdf *b = inside ? scene->media[d->shape]->scatterer
                                      : imp__shape_bsdf(scene, scene->shapes[d->shape]);
    const bool null = b->flags & IMP_BSDF_NULL;
    return located_fits(scene, inside ? NULL : scene->shapes[d->shape], &d->located,
                        d->place) &&
           (inside || d->scatterer == (null ? IMP_AT_BOUNDARY : IMP_AT_SURFACE)) &&
           unit(d->wo) && (!d->glows || (b->flags & IMP_BSDF_EMIT)) &&
           (inside ? d->met.emitter == -1 : met_fits(scene, d)) &&
           light_fits(scene, b, d) && continuation_fits(b, d);
}

/* `before`: kind of the event before it, -1: none. A surface that is passed has two. */
static bool event_fits(const struct imp_scene *scene, const struct imp_event *e,
                       int before)
{
    if ((e->kind == IMP_PASSES_UV) != (before == IMP_PASSES)) return false;
    if ((e->kind == IMP_RESIDUAL_OF) != (before == IMP_RESIDUAL_AT)) return false;
    if (e->kind == IMP_PASSES_UV)
        return e->medium >= 0 && isfinite(e->t) && isfinite(e->bound);
    if (e->kind == IMP_RESIDUAL_OF || e->kind == IMP_CONTROL)
        return isfinite(e->t) && e->t >= 0;
    if (e->kind == IMP_PASSES)
        return e->medium >= 0 && e->medium < scene->n_all_shapes && isfinite(e->t) &&
               isfinite(e->bound);
    if (e->medium < 0 || e->medium >= scene->n_media || !(e->t >= 0)) return false;
    if (e->kind == IMP_CROSSES || e->kind == IMP_COLLIDES)
        return !scene->media[e->medium]->majorants;
    return (e->kind == IMP_NULL_AT || e->kind == IMP_REAL_AT ||
            e->kind == IMP_RESIDUAL_AT) &&
           isfinite(e->t) && isfinite(e->bound) && e->bound > 0;
}

/* A walk while its items are looked at: the walks that the item at hand may belong to,
 * each of which hangs on the one before it. */
struct fitting {
    const struct imp_scene *scene;
    const struct imp_record *record;
    const struct imp_record_walk *walk;
    uint32_t item, end; /* vertices that items before this one speak of */
    struct {
        uint32_t first, n;
    } of[IMP_RECORD_NESTS + 1];
    int nest;
};

static const union imp_kept *item_at(struct fitting *f)
{
    return f->item == f->walk->n_items
               ? NULL
               : imp__record_item(f->record, f->walk->first_item + f->item++);
}

/* Vertices that follow those before, of which each but the last goes on. */
static bool chain_fits(struct fitting *f, uint32_t first, uint32_t n, bool side)
{
    if (first != f->end || n == 0 || n > IMP_WALK_MAX || n > f->walk->n_vertices - first)
        return false;
    bool sky = false;
    for (uint32_t k = 0; k < n; k++) {
        struct imp_decision d;
        imp__record_vertex(f->record, f->walk->first + first + k, &d);
        if (!vertex_fits(f->scene, &d, k == 0 && !side, k + 1 == n)) return false;
        if (sky && d.scatterer != IMP_AT_SKY) return false;
        sky = d.scatterer == IMP_AT_SKY;
    }
    f->end = first + n;
    return true;
}

static bool track_fits(struct fitting *f, const union imp_kept *head)
{
    const union imp_kept *way = item_at(f);
    if (!way || !all_finite(head->head.o, 3) || !unit(way->way.d) ||
        way->way.n > INT32_MAX || way->way.n > f->walk->n_items - f->item)
        return false;
    int before = -1;
    for (uint32_t i = 0; i < way->way.n; i++) {
        const struct imp_event *e = &item_at(f)->event;
        if (!event_fits(f->scene, e, before)) return false;
        before = e->kind;
    }
    return before != IMP_PASSES && before != IMP_RESIDUAL_AT;
}

static bool items_fit(struct fitting *f)
{
    const union imp_kept *head;
    while ((head = item_at(f)) != NULL) {
        const uint32_t at = head->head.at;
        while (at < f->of[f->nest].first || at - f->of[f->nest].first >= f->of[f->nest].n)
            if (f->nest-- == 0) return false;
        if (head->head.kind != IMP_KEPT_SIDE) {
            if (head->head.kind > IMP_KEPT_SIDE || !track_fits(f, head)) return false;
            continue;
        }
        const uint32_t first = head->head.side.first, n = head->head.side.n;
        if (f->nest == IMP_RECORD_NESTS || head->head.side.depth < 0 ||
            head->head.side.depth > IMP_WALK_MAX || !chain_fits(f, first, n, true))
            return false;
        f->nest++;
        f->of[f->nest].first = first;
        f->of[f->nest].n = n;
    }
    return f->end == f->walk->n_vertices;
}

bool imp__record_walk_fits(const struct imp_scene *scene, const struct imp_record *r,
                           const struct imp_record_walk *w, uint64_t first,
                           uint64_t first_item)
{
    const bool counts = w->valid == 1 && w->dropped == IMP_DROP_NONE;
    struct fitting f = {.scene = scene, .record = r, .walk = w, .of = {{0, w->n}}};
    if (w->first != first || w->n_vertices > r->n_vertices - first ||
        w->first_item != first_item || w->n_items > r->n_items - first_item ||
        w->valid > 1 || w->absorbed > 1 || w->dropped >= IMP_DROP_CAUSES ||
        (w->n_vertices > 0 && !counts) || (w->n == 0 && w->n_vertices > 0) ||
        !isfinite(w->px) || !isfinite(w->py) || !isfinite(w->time) ||
        !(w->wave >= 0 && w->wave < 1))
        return false;
    if (w->n > 0 && !chain_fits(&f, 0, w->n, false)) return false;
    return items_fit(&f);
}
