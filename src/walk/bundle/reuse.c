/* SPDX-License-Identifier: Apache-2.0
 *
 * What points of a grid share: who sees whose first surface, and what each takes of it. */
#include "reuse.h"
#include "kind/sensor/receiver.h"
#include "lanes_leave.h"
#include "walk/path/first_segment.h"
#include <float.h>
#include <string.h>

bool imp__reuse_fits(const struct imp_tracer *t)
{
    return t->value_only && !t->active && !t->wavelengths && imp__bundle_fits(t) &&
           imp__segment_first(t) == &imp__straight_ops && imp__lanes_fit(t) &&
           imp__has_grid(t->sensor) && !t->sensor->gain &&
           !(t->sensor->close > t->sensor->open);
}

#define TAKE(p) ((p) = imp__arena_take(arena, n + IMP_COLUMN_SLACK, sizeof *(p)))

/* The samples of a pixel lie side by side, and behind all of these the walks that give only; the last
 * point of a group is followed by the first. */
static void groups_make(struct imp_reuse *r, const int (*xy)[2])
{
    const struct imp_bundle *b = r->bundle;
    const int m = b->tracer->together, pixels = b->n / b->n_samples;
    for (int pixel = 0, k = 0, giver = b->n; pixel < pixels; pixel++) {
        const int first = pixel / m * m, n = imp_min(m, pixels - first),
                  more = imp__reuse_more(b->tracer, xy[pixel]);
        for (int s = 0; s < b->n_samples; s++, k++) {
            for (int next = 0; next < m; next++)
                r->on[next][k] =
                    next < n ? (first + (pixel - first + next) % n) * b->n_samples + s
                             : -1;
            r->times[k] = 1 + more;
        }
        for (int other = 0; other < more * b->n_samples; other++, giver++)
            for (int next = 0; next < m; next++)
                r->on[next][giver] = r->on[next][k - b->n_samples + other % b->n_samples];
    }
}

bool imp__reuse_create(struct imp_arena *arena, const struct imp_bundle *b,
                       const int (*xy)[2], struct imp_reuse *r)
{
    const size_t n = (size_t)b->all;
    *r = (struct imp_reuse){.bundle = b};
    for (int c = 0; c < 3; c++)
        if (!TAKE(r->from[c]) || !TAKE(r->normal[c]) || !TAKE(r->facing[c]) ||
            !TAKE(r->x[c]) || !TAKE(r->ng[c]) || !TAKE(r->n[c]))
            return false;
    for (int c = 0; c < b->colors; c++)
        if (!TAKE(r->sent[c]) || !TAKE(r->taken[c])) return false;
    for (int next = 0; next < b->tracer->together; next++)
        if (!TAKE(r->part[next]) || !TAKE(r->on[next])) return false;
    if (!TAKE(r->begun) || !TAKE(r->even) || !TAKE(r->times) || !TAKE(r->given))
        return false;
    memset(r->begun, 0, n * sizeof *r->begun);
    memset(r->even, 0, n * sizeof *r->even);
    const struct imp_receiver *receiver = b->tracer->sensor->receiver;
    r->across = receiver && receiver->kind != IMP_PLANAR;
    groups_make(r, xy);
    return true;
}

void imp__reuse_point(struct imp_reuse *r, int walk, imp_v3 p, imp_v3 n)
{
    const struct imp_receiver *receiver = r->bundle->tracer->sensor->receiver;
    const struct imp_frame frame = imp__frame_from_normal(n);
    imp_v3 facing = receiver ? imp__to_world(&frame, receiver->facing) : n;
    if (receiver && receiver->kind == IMP_CYLINDRICAL) facing = (imp_v3){0};
    imp__column_put(r->from, walk, p);
    imp__column_put(r->normal, walk, n);
    imp__column_put(r->facing, walk, facing);
    r->begun[walk] = true;
}

/* ---- Who sees what ----------------------------------------------------------------------- */

/* The surfaces at places at[k]. */
struct met {
    imp_wide3 x, ng, n, back; /* back: to the own walk's point */
};
static struct met met_take(const struct imp_reuse *r, const int32_t *at,
                           const int32_t *own)
{
    struct met m = {.x = imp__wide3_taken(r->x, at),
                    .ng = imp__wide3_taken(r->ng, at),
                    .n = imp__wide3_taken(r->n, at)};
    m.back = imp__wide3_minus(imp__wide3_taken(r->from, own), m.x);
    return m;
}

/* p of walks' points there, but for a factor that all have: with d from a point to x, n its normal and f
 * what it faces (receiver.h),
 *
 *     max(0, d . f + |d x n|) |ng . d|/d^4,   planar: without |d x n|. */
static imp_wide density(const struct imp_reuse *r, const struct met *m, imp_wide3 d,
                        const int32_t *walk)
{
    const imp_wide zero = imp__wide(0), d2 = imp__wide3_inner(d, d);
    imp_wide seen = imp__wide3_inner(d, imp__wide3_taken(r->facing, walk));
    if (r->across) {
        const imp_wide up = imp__wide3_inner(d, imp__wide3_taken(r->normal, walk));
        seen += imp__wide_root(imp__wide_larger(d2 - up * up, zero));
    }
    const imp_wide p = imp__wide_larger(seen, zero) *
                       imp__wide_magnitude(imp__wide3_inner(m->ng, d)) / (d2 * d2);
    return imp__wide_choose(d2 > zero, p, zero);
}

/* Are both directions on one side of the surface, and of its shading frame? */
static imp_wide_truth beside(const struct met *m, imp_wide3 a, imp_wide3 b)
{
    const imp_wide zero = imp__wide(0);
    return ((imp__wide3_inner(m->ng, a) > zero) == (imp__wide3_inner(m->ng, b) > zero)) &
           ((imp__wide3_inner(m->n, a) > zero) == (imp__wide3_inner(m->n, b) > zero));
}

/* Rays from the points of the walks `next` places on, where they lie on the side of x that the own one
 * sees, and their densities. */
static void rays_on(struct imp_reuse *r, const struct imp_bundle_values *values, int next,
                    struct imp_shadows *shadows)
{
    for (int i = 0; i < values->n; i += IMP_WIDE_LANES) {
        int32_t at[IMP_WIDE_LANES], own[IMP_WIDE_LANES], walk[IMP_WIDE_LANES];
        unsigned here = 0;
        for (int k = 0; k < IMP_WIDE_LANES; k++) {
            at[k] = imp_min(i + k, values->n - 1);
            own[k] = values->up[at[k]];
            walk[k] = r->on[next][own[k]];
            if (i + k < values->n && r->even[at[k]] && walk[k] >= 0 && r->begun[walk[k]])
                here |= 1u << k;
            else walk[k] = own[k];
        }
        const struct met m = met_take(r, at, own);
        const imp_wide3 from = imp__wide3_taken(r->from, walk),
                        d = imp__wide3_minus(m.x, from);
        const imp_wide p = density(r, &m, d, walk);
        here &= imp__wide_bits((p > imp__wide(0)) &
                               beside(&m, imp__wide3_opposite(d), m.back));
        for (int k = 0; k < IMP_WIDE_LANES && i + k < values->n; k++)
            r->part[next][i + k] = here >> k & 1 ? p[k] : 0;
        if (next == 0 || !here) continue;
        imp__lanes_sight_append(&shadows->ray, here, from,
                                imp__wide3_taken(r->normal, walk), d, m.x,
                                imp__wide(1 - 10 * IMP_RAY_EPSILON));
        for (unsigned left = here; left; left &= left - 1)
            shadows->at[shadows->ray.n++] = at[__builtin_ctz(left)];
    }
}

void imp__reuse_connect(struct imp_reuse *r, const struct imp_bundle_values *values,
                        struct imp_shadows *shadows, bool *hidden)
{
    const int m = r->bundle->tracer->together;
    rays_on(r, values, 0, shadows);
    for (int at = 0; at < values->n; at++)
        r->even[at] &= r->part[0][at] > 0; /* else along the surface, but for rounding */
    for (int next = 1; next < m; next++) {
        shadows->ray.n = 0;
        rays_on(r, values, next, shadows);
        imp__occluded_columns(r->bundle->tracer->scene, &shadows->ray, hidden);
        for (int i = 0; i < shadows->ray.n; i++)
            if (hidden[i]) r->part[next][shadows->at[i]] = 0;
    }
    shadows->ray.n = 0;
    for (int at = 0; at < values->n; at++) {
        double sum = 0;
        if (!r->even[at]) continue;
        double given = 0;
        for (int next = 0; next < m; next++)
            if (r->part[next][at] > 0) {
                sum += r->times[r->on[next][values->up[at]]] * r->part[next][at];
                given += r->part[next][at];
            }
        for (int next = 0; next < m; next++) r->part[next][at] /= sum;
        r->given[at] = given / sum;
    }
}

/* ---- What is sent ------------------------------------------------------------------------ */

/* S of all places, away from the values; 0 where nothing is shared. */
static void sent_take(struct imp_reuse *r, struct imp_bundle_values *values,
                      struct imp_bundle_values *points)
{
    const int colors = r->bundle->colors;
    for (int at = 0; at < values->n; at++) {
        imp_spec s = {0};
        for (int c = 0; r->even[at] && c < colors; c++)
            s[c] = values->b[c][at] + values->w[c][at] * values->beyond[c][at];
        const bool shared =
            r->even[at] &&
            imp__is_within(s, FLT_MAX); /* else the walk alone is dropped */
        const int own = r->on[0][values->up[at]];
        for (int c = 0; c < colors; c++) {
            r->sent[c][at] = shared ? s[c] : 0;
            if (shared) values->b[c][at] = values->w[c][at] = 0;
            else if (r->even[at] && own != values->up[at]) points->b[c][own] += s[c];
        }
    }
}

void imp__reuse_give(struct imp_reuse *r, struct imp_bundle_values *values,
                     struct imp_bundle_values *points)
{
    const struct imp_bundle *b = r->bundle;
    sent_take(r, values, points);
    for (int c = 0; c < b->colors; c++) {
        double *taken = r->taken[c];
        for (int k = 0; k < b->n; k++) taken[k] = 0;
        for (int next = 0; next < b->tracer->together; next++)
            for (int at = 0; at < values->n; at++)
                if (r->even[at] && r->part[next][at] > 0)
                    taken[r->on[next][values->up[at]]] +=
                        r->part[next][at] * r->sent[c][at];
        for (int k = 0; k < b->n; k++) points->b[c][k] += taken[k];
        for (int at = 0; at < values->n; at++) /* what others have more, from now on */
            if (r->even[at])
                taken[r->on[0][values->up[at]]] -= r->given[at] * r->sent[c][at];
    }
}

void imp__reuse_alone(const struct imp_reuse *r, const struct imp_bundle_values *sensor,
                      struct imp_bundle *b)
{
    for (int c = 0; c < 4; c++)
        for (int k = 0; k < b->n; k++)
            b->alone[c][k] =
                c < b->colors ? b->L[c][k] - sensor->w[c][k] * r->taken[c][k] : 0;
}
