/* SPDX-License-Identifier: Apache-2.0
 *
 * Records of vertices that were made in lanes: what the steps of a walk alone write
 * (core/vertices.h, core/light.c, core/scatter_with.h). */
#include "lanes_record.h"
#include "walk/core/vertices.h"

static inline void direction_put(imp_decided out[3], const imp_wide3 *v, int k)
{
    out[0] = (imp_decided)v->x[k];
    out[1] = (imp_decided)v->y[k];
    out[2] = (imp_decided)v->z[k];
}

/* The point where it lies. */
static inline void surface_put(const struct imp_depth *d,
                               const struct imp_lanes_vertices *v, int k,
                               struct imp_vertex *out)
{
    const int i = v->order[k];
    struct imp_decision *of = &out->d;
    out->t = d->hits->t[i];
    out->ng = imp__wide3_lane(&v->x.ng, k);
    for (int j = 0; j < 2; j++) of->uv[j] = (imp_decided)v->x.uv[j][k];
    direction_put(of->p, &v->x.p, k);
    direction_put(of->wo, &v->wo, k);
    if (out->shape->geometry == IMP_TRIANGLES)
        of->located = (struct imp_located){d->hits->prim[i],
                                           {(float)d->hits->u[i], (float)d->hits->v[i]}};
    else of->located = (struct imp_located){0, {of->uv[0], of->uv[1]}};
    of->place = imp__place_decided(d->hits->place[i]);
    of->back = imp__dot(out->ng, imp__column_v3(d->rays->ray.d, i)) > 0;
}

/* The connection, until it is seen. */
static inline void light_put(const struct imp_lanes_lit *lit, int colors, int k,
                             struct imp_vertex *out)
{
    const struct imp_wide_light *x = &lit->light.at;
    struct imp_light *l = &out->d.light;
    l->emitter = lit->light.light[k];
    l->weight = (imp_decided)lit->weight[k];
    for (int j = 0; j < 2; j++) l->uv[j] = (imp_decided)x->uv[j][k];
    l->dist = (imp_decided)x->dist[k];
    l->cos_light = (imp_decided)x->cos_light[k];
    imp__store_v3(l->d, -imp__wide3_lane(&x->wi, k));
    imp__store_v3(l->p, lit->light.far[k] ? (imp_v3){0} : imp__wide3_lane(&x->p, k));
    direction_put(l->wi, &lit->wi, k);
    l->located = (struct imp_located){x->prim[k],
                                      {(float)x->located[0][k], (float)x->located[1][k]}};
    out->d.connection = IMP_OCCLUDED;
    out->b = imp__color_lane(&lit->brings, colors, k);
    out->light_f = imp__color_lane(&lit->f, colors, k);
    out->light_e = imp__color_lane(&lit->light.radiance, colors, k);
    out->light_w = imp__spec(lit->weight[k]);
}

/* The step to the next vertex. */
static inline void step_put(const struct imp_lanes_step *step, int colors, int k,
                            struct imp_vertex *out)
{
    struct imp_decision *of = &out->d;
    out->scale = imp__spec(step->scale[k]);
    out->w = imp__color_lane(&step->w, colors, k);
    direction_put(of->wi, &step->wi, k);
    of->lobe = (int8_t)step->lobe[k];
    of->pdf = (imp_decided)step->pdf[k];
    of->survive = (imp_decided)step->survive[k];
    of->goes_on = true;
}

bool imp__lanes_differ(const struct imp_depth *d, const struct imp_bin *bin,
                       const struct imp_lanes_lit *lit)
{
    const struct imp_active *active = d->bundle->tracer->active;
    const int material = bin->bsdf->index;
    const bool by_material = material >= 0 && active->bsdf[material];
    for (unsigned left = lit->dark; left; left &= left - 1)
        if (by_material || active->emitter[lit->light.light[__builtin_ctz(left)]])
            return true;
    return false;
}

void imp__lanes_record(struct imp_depth *d, const struct imp_bin *bin,
                       struct imp_lanes_vertices *v, struct imp_lanes_lit *lit,
                       struct imp_lanes_step *step)
{
    const struct imp_bundle *b = d->bundle;
    struct imp_step *s = &d->lone->step;
    const int n_in = bin->bsdf->n_in;
    for (unsigned left = v->on; left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        const unsigned bit = 1u << k;
        s->walk = &b->walks[v->walk[k]];
        s->at.carried = imp__lanes_carried(b, v, k);
        struct imp_vertex *out = imp__vertex_add_here(s, n_in);
        v->record[k] = out;
        if (!out) { /* the walk is dropped */
            lit->on &= ~bit;
            step->on &= ~bit;
            continue;
        }
        s->walk->valid |= !d->last;
        out->bsdf = bin->bsdf;
        out->shape = b->tracer->scene->shapes[d->hits->shape[v->order[k]]];
        out->d.shape = out->shape->index;
        out->d.scatterer = IMP_AT_SURFACE;
        for (int j = 0; j < n_in; j++)
            out->in[j] = bin->kernel ? imp__color_lane(&v->in[j], 4, k)
                                     : v->each[k * v->stride + j];
        surface_put(d, v, k, out);
        if (lit->on & bit) light_put(lit, b->colors, k, out);
        if (step->on & bit) step_put(step, b->colors, k, out);
    }
}

void imp__lanes_record_sky(struct imp_depth *d, const int32_t *order, int n, int light,
                           const imp_wide3 *wi, const imp_wide *weight,
                           const struct imp_wide_color *met)
{
    const struct imp_bundle *b = d->bundle;
    struct imp_step *s = &d->lone->step;
    for (int k = 0; k < n; k++) {
        s->walk = &b->walks[d->rays->walk[order[k]]];
        s->at.carried = NULL;
        struct imp_vertex *out = imp__vertex_add_here(s, 0);
        if (!out) continue;
        struct imp_decision *of = &out->d;
        s->walk->valid = true;
        out->t = INFINITY;
        out->e = imp__color_lane(met, 3, k);
        of->scatterer = IMP_AT_SKY;
        of->uv[0] = of->uv[1] = 0;
        direction_put(of->p, wi, k);
        of->met = (struct imp_met){.emitter = light,
                                   .weight = (imp_decided)(*weight)[k],
                                   .dist = INFINITY,
                                   .cos_light = 1};
        imp__store_v3(of->met.d, -imp__wide3_lane(wi, k));
    }
}
