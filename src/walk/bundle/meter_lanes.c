/* SPDX-License-Identifier: Apache-2.0
 *
 * First vertices and light samples of points of a grid. */
#include "meter_lanes.h"
#include "kind/sensor/receiver.h"
#include "lanes_leave.h"
#include "lanes_record.h"
#include "math/trig.h"
#include "reuse.h"
#include <string.h>

#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "math/warp_text.h"
#include "math/lane_text.h"

/* Light samples of a walk, at most. */
enum { MOST = 4 };

/* ---- Walks of one point ------------------------------------------------------------------ */

bool imp__meter_in_lanes(const struct imp_tracer *t)
{
    const struct imp_receiver *r = t->sensor->receiver;
    return t->together > 0 && t->points && t->integrator->rr_depth > 0 && r &&
           r->kind == IMP_PLANAR && !r->turned && r->points;
}

static bool in_set(const int64_t *samples, int k)
{
    return k > 0 && samples[k] / IMP_SET_POINTS == samples[k - 1] / IMP_SET_POINTS;
}

/* Points of a set, at most. */
static int set_of(const struct imp_meter_others *o)
{
    int most = 1, n = 0;
    for (int k = 0; k < o->n; k++) {
        n = in_set(o->samples, k) ? n + 1 : 1;
        most = imp_max(most, n);
    }
    return most;
}

/* As imp__begin_alone and imp__meter_begin make them; set: points of one. */
static void numbers_set(struct imp_bundle *b, const struct imp_meter_others *o, int k,
                        int set)
{
    const int walk = o->from + k, fit = IMP_SET_POINTS / set;
    if (in_set(o->samples, k)) {
        b->set[walk] = b->set[walk - 1];
    } else {
        struct imp_walk own;
        const int64_t further = (int64_t)(o->copy / fit) << 40;
        imp__walk_numbers(b->tracer, o->at[0], o->at[1], o->samples[k] + further, &own);
        b->set[walk] = imp__key_branch((struct imp_key){own.point.set}, 0, 1).state;
    }
    b->index[walk] = (uint32_t)(o->samples[k] + o->copy % fit * set) % IMP_SET_POINTS;
}

/* What walk `to` has of walk `from`. */
static void walk_copy(struct imp_depth *d, int from, int to)
{
    struct imp_bundle *b = d->bundle;
    struct imp_reuse *r = d->reuse;
    struct imp_bundle_values *v = d->values;
    b->px[to] = b->px[from];
    b->py[to] = b->py[from];
    b->time[to] = b->time[from];
    b->valid[to] = b->valid[from];
    for (int c = 0; c < b->colors; c++) {
        v->e[c][to] = v->e[c][from];
        v->b[c][to] = v->beyond[c][to] = 0;
        v->w[c][to] = v->w[c][from];
    }
    v->up[to] = to;
    for (int c = 0; c < 3; c++) {
        r->from[c][to] = r->from[c][from];
        r->normal[c][to] = r->normal[c][from];
        r->facing[c][to] = r->facing[c][from];
    }
    r->begun[to] = true;
}

void imp__meter_others(struct imp_depth *d, const struct imp_meter_others *o)
{
    struct imp_bundle *b = d->bundle;
    struct imp_flights *to = d->next;
    const int like = o->ray, n = o->n, set = o->copy > 0 ? set_of(o) : 1;
    const imp_v3 p = imp__column_v3(d->reuse->from, o->first),
                 normal = imp__column_v3(d->reuse->normal, o->first);
    const struct imp_frame own = imp__frame_from_normal(normal);
    const imp_wide3 ng = imp__wide3_of(normal), x = imp__wide3_of(p);
    const imp_wide_frame frame = {imp__wide3_of(own.s), imp__wide3_of(own.t), ng};
    for (int k = 0; k < n; k++) {
        numbers_set(b, o, k, set);
        walk_copy(d, o->first, o->from + k);
    }
    for (int k = 0; k < n; k += IMP_WIDE_LANES) {
        int32_t walk[IMP_WIDE_LANES];
        for (int j = 0; j < IMP_WIDE_LANES; j++)
            walk[j] = o->from + imp_min(k + j, n - 1);
        const struct imp_wide_block numbers =
            imp__wide_block(b->tracer->points, b->set, b->index, walk, imp__block(-1));
        const imp_wide3 wi = IMP_WIDE_OF(imp__cosine_directions)(
            imp__wide_number(&numbers, (uint32_t)imp__slot(IMP_DIM_DIR_U)),
            imp__wide_number(&numbers, (uint32_t)imp__slot(IMP_DIM_DIR_V)));
        const imp_wide3 world = imp__out_of_wide_frame(&frame, wi);
        const unsigned on = imp__bits_first(n - k) & imp__wide_bits(wi.z > imp__wide(0));
        const int at_ray = to->ray.n;
        imp__lanes_ray_append(&to->ray, on, x, ng, world);
        imp__wide3_append(to->from, at_ray, on, x);
        imp__wide_append(&to->pdf[at_ray], on, imp__wide_decide(wi.z * IMP_INV_PI));
        for (int c = 0; c < b->colors; c++)
            imp__wide_append(&to->beta[c][at_ray], on, imp__wide(to->beta[c][like]));
        imp__wide_append(&to->eta[at_ray], on, imp__wide(to->eta[like]));
        for (unsigned left = on; left; left &= left - 1) {
            const int i = to->ray.n++;
            to->walk[i] = to->up[i] = walk[__builtin_ctz(left)];
            if (to->left) to->left[i] = to->left[like];
        }
    }
}

/* ---- Light samples ----------------------------------------------------------------------- */

/* By which a receiver weighs light from wi, and walks leave it (receiver.h). */
static imp_wide receives(const struct imp_reuse *r, imp_wide3 wi, imp_wide3 facing,
                         imp_wide3 normal)
{
    const imp_wide zero = imp__wide(0);
    imp_wide seen = imp__wide3_inner(wi, facing);
    if (!r->across) return imp__wide_larger(seen, zero) * IMP_INV_PI;
    const imp_wide up = imp__wide3_inner(wi, normal);
    seen += imp__wide_root(imp__wide_larger(1 - up * up, zero));
    return imp__wide_larger(seen, zero) * (IMP_INV_PI * IMP_INV_PI);
}

/* Sample l of `samples` of the walks [lanes]. */
static void light_draw(const struct imp_depth *d, const int32_t *walk, unsigned on, int l,
                       int samples, struct imp_lanes_light *out)
{
    const struct imp_bundle *b = d->bundle;
    const struct imp_tracer *t = b->tracer;
    const struct imp_receiver *receiver = t->sensor->receiver;
    const bool faces = !receiver || imp__is_faced(&receiver->bsdf),
               one = t->points != NULL;
    struct imp_lanes_vertices v; /* what lights in colours ask of it */
    v.x.p = imp__wide3_taken(d->reuse->from, walk);
    v.points = one;
    v.on = on;
    memcpy(v.walk, walk, sizeof v.walk);
    const imp_wide3 normal = imp__wide3_taken(d->reuse->normal, walk);
    const struct imp_wide_block numbers =
        imp__wide_block(t->points, b->set, b->index, walk, imp__block(-1));
    imp_wide u[3];
    static const int uses[] = {IMP_DIM_LIGHT_U, IMP_DIM_LIGHT_V, IMP_DIM_LIGHT};
    for (int k = 0; k < 3; k++)
        u[k] = imp__wide_number(&numbers, one ? (uint32_t)imp__slot(uses[k])
                                              : imp__dim(-1, uses[k]));
    const imp_wide which = imp__wide_lesser(((one ? u[0] : u[2]) + l) / samples,
                                            imp__wide(0x1.fffffffffffffp-1));
    if (one) u[0] = which;
    out->at.recorded = false;
    if (d->next->left) imp__lanes_tree_draw(b, &v, faces ? &normal : NULL, u, which, out);
    else imp__lanes_light_draw(b, &v, u, which, out);
}

/* The same of the walks from i on: their shadow rays, and what they bring. */
static void light_add(struct imp_depth *d, int i, int l, int samples)
{
    const struct imp_bundle *b = d->bundle;
    struct imp_reuse *r = d->reuse;
    struct imp_shadows *to = d->shadows;
    struct imp_lanes_light light;
    int32_t walk[IMP_WIDE_LANES];
    unsigned on = imp__bits_first(b->n - i);
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        walk[k] = imp_min(i + k, b->n - 1);
        if (!r->begun[walk[k]]) on &= ~(1u << k);
    }
    if (!on) return;
    light_draw(d, walk, on, l, samples, &light);
    const imp_wide3 p = imp__wide3_taken(r->from, walk),
                    normal = imp__wide3_taken(r->normal, walk);
    const imp_wide by = receives(r, light.at.wi, imp__wide3_taken(r->facing, walk),
                                 normal),
                   density = light.at.pdf * light.pmf;
    const imp_wide weight =
        by / samples *
        imp__wide_choose(light.delta, 1 / density, imp__wide_power_over(density, by));
    on &= imp__wide_bits(light.at.drawn & (by > imp__wide(0)));
    if (!on) return;
    imp__lanes_shadow_append(&to->ray, on, p, normal, &light);
    for (int c = 0; c < b->colors; c++)
        imp__wide_append(&r->sent[c][to->ray.n], on, light.radiance.c[c] * weight);
    for (unsigned left = on; left; left &= left - 1)
        to->at[to->ray.n++] = walk[__builtin_ctz(left)];
}

void imp__meter_lights(struct imp_depth *d, bool *hidden)
{
    const struct imp_bundle *b = d->bundle;
    const struct imp_tracer *t = b->tracer;
    struct imp_shadows *rays = d->shadows;
    const int samples = imp_min(t->scene->n_emitters, (int)MOST);
    if (!t->integrator->lights || t->integrator->max_depth == 0) return;
    for (int l = 0; l < samples; l++) {
        rays->ray.n = 0;
        for (int i = 0; i < b->n; i += IMP_WIDE_LANES) light_add(d, i, l, samples);
        imp__occluded_columns(t->scene, &rays->ray, hidden);
        for (int c = 0; c < b->colors; c++)
            for (int k = 0; k < rays->ray.n; k++)
                if (!hidden[k]) d->values->b[c][rays->at[k]] += d->reuse->sent[c][k];
    }
    rays->ray.n = 0;
}
