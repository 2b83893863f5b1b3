/* SPDX-License-Identifier: Apache-2.0
 *
 * Edges of curves (boundary.h): outlines, lines that touch them, and the rims of their ends. A segment is
 * chosen by the length of its edges, then one of these, then a place v of its line, evenly. The outline
 * has at v one or two pairs of points, one of which is chosen; along it, by  (n.w)' = 0,
 *
 *     dp/dv = X_v + X_t t',   t' = -(n_v.w)/(n_t.w).  */
#include "base/context.h"
#include "boundary_parts.h"
#include "math/warp.h"
#include "move/strand.h"

static const struct imp_curves *curves_of(const struct imp__edge_draw *d)
{
    return &d->b->tracer->scene->shapes[d->item->shape]->curves;
}

static void line_at(const struct imp__edge_draw *d, struct imp__strand *x)
{
    imp__strand_at(d->b->tracer->scene, d->item->shape, d->item->place, d->prim, d->place,
                   x);
}

/* ---- Choice -------------------------------------------------------------------------- */

/* Lengths of a segment's edges: both outlines, and the rims of its ends. */
struct lengths {
    double outline, rim[2];
};
static struct lengths lengths_of(const struct imp_scene *scene, int shape, int64_t place,
                                 int segment)
{
    enum { CHORDS = 4 };
    struct imp__strand x, before;
    struct lengths out = {0, {0, 0}};
    const int ends = imp__strand_ends(&scene->shapes[shape]->curves, segment);
    imp__strand_at(scene, shape, place, segment, 0, &before);
    if (ends & 1) out.rim[0] = IMP_2PI * before.r;
    for (int k = 1; k <= CHORDS; k++) {
        imp__strand_at(scene, shape, place, segment, (double)k / CHORDS, &x);
        out.outline += 2 * imp__length(x.c - before.c);
        before = x;
    }
    if (ends & 2) out.rim[1] = IMP_2PI * x.r;
    return out;
}

enum imp_status imp__strand_lengths(const struct imp__boundary *b,
                                    struct imp__edge_item *item)
{
    const struct imp_scene *scene = b->tracer->scene;
    const size_t n = scene->shapes[item->shape]->curves.n_segments;
    item->until = imp__alloc(scene->ctx, n + 1, sizeof *item->until);
    if (!item->until) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for curves");
    for (size_t k = 0; k < n; k++) {
        const struct lengths x = lengths_of(scene, item->shape, item->place, (int)k);
        item->until[k + 1] = item->until[k] + x.outline + x.rim[0] + x.rim[1];
    }
    return IMP_OK;
}

/* The segment, of d->u, which becomes uniform again, and of d->chance. False: it has no edges. */
static bool segment_choose(struct imp__edge_draw *d)
{
    const double *until = d->item->until;
    const size_t n = curves_of(d)->n_segments;
    const double x = d->u * until[n];
    size_t lo = 0, hi = n - 1;
    while (lo < hi) {
        const size_t half = lo + (hi - lo) / 2;
        if (x < until[half + 1]) hi = half;
        else lo = half + 1;
    }
    const double own = until[lo + 1] - until[lo];
    if (!(own > 0)) return false;
    d->prim = (int)lo;
    d->chance *= own / until[n];
    d->u = imp_clamp((x - until[lo]) / own, 0.0, 1 - 0x1p-53);
    return true;
}

/* One of a segment's edges: 0 and 1: a rim, 2: the outline; d->u and d->chance likewise. */
static int part_choose(struct imp__edge_draw *d)
{
    const struct lengths x =
        lengths_of(d->b->tracer->scene, d->item->shape, d->item->place, d->prim);
    const double part[3] = {x.rim[0], x.rim[1], x.outline},
                 all = part[0] + part[1] + part[2];
    double u = d->u * all;
    int k = 0;
    for (; k < 2 && u >= part[k]; k++) u -= part[k];
    d->u = imp_clamp(u / part[k], 0.0, 1 - 0x1p-53);
    d->chance *= part[k] / all;
    return k;
}

/* ---- Rims ---------------------------------------------------------------------------- */

static bool rim_set(struct imp__edge_draw *d, int k)
{
    struct imp__strand x;
    d->place = k;
    line_at(d, &x);
    const struct imp__strand_axes axes = imp__strand_axes(&x);
    const double t = IMP_2PI * d->u;
    const imp_v3 e = axes.s * cos(t) + axes.t * sin(t);
    d->rim = true;
    d->p = x.c + e * x.r;
    d->along = axes.t * cos(t) - axes.s * sin(t);
    d->out = k ? axes.a : -axes.a;
    d->inv_pdf = IMP_2PI * x.r / d->chance;
    return true;
}

/* A rim is one where its wall is met from outside. Next to the outline the wall beside an open end, into
 * which a look goes, is thinner than the look is apart from the rim. */
bool imp__strand_merges(const struct imp__edge_draw *d, imp_v3 w, double beside)
{
    struct imp__strand x;
    line_at(d, &x);
    const imp_v3 n = imp__normalize(d->p - x.c);
    const double cosine = imp__dot(n, imp__normalize(w - d->out * imp__dot(d->out, w)));
    return !(cosine < 0) ||
           (imp__dot(w, d->out) < 0 && 0.5 * x.r * cosine * cosine < beside);
}

/* ---- Outlines ------------------------------------------------------------------------ */

bool imp__strand_silhouette(struct imp__edge_draw *d, imp_v3 from, bool parallel)
{
    struct imp__strand x;
    struct imp__strand_point at;
    double turn[IMP_STRAND_OUTLINES];
    if (!segment_choose(d)) return false;
    const int part = part_choose(d);
    if (part < 2) return rim_set(d, part);
    d->place = d->u;
    line_at(d, &x);
    const struct imp__strand_axes axes = imp__strand_axes(&x);
    const int n = imp__strand_outline(&x, &axes, from, parallel, turn);
    if (n == 0) return false;
    const int k = imp_min((int)(imp__u01(d->key, IMP_EDGE_DIR_U) * n), n - 1);
    const imp_v3 e = axes.s * cos(turn[k]) + axes.t * sin(turn[k]);
    if (!imp__strand_point(&x, &axes, e, &at)) return false;
    const imp_v3 w = imp__normalize(parallel ? from : at.p - from);
    if (!(imp__strand_bends(&at, &x, w) > 0)) return false; /* it is inside */
    const imp_v3 along =
        at.along - at.around * (x.r * imp__dot(at.n_v, w) / imp__dot(at.n_t, w));
    const double rate = imp__length(along);
    d->out = at.n;
    d->p = at.p;
    d->along = along * (1 / rate);
    d->inv_pdf = rate * n / d->chance;
    return rate < INFINITY;
}

bool imp__strand_touched(struct imp__edge_draw *d, const double u[2], imp_v3 *w)
{
    struct imp__strand x;
    struct imp__strand_point at;
    if (!segment_choose(d)) return false;
    const int part = part_choose(d);
    if (part < 2) return rim_set(d, part);
    d->place = d->u;
    line_at(d, &x);
    const struct imp__strand_axes axes = imp__strand_axes(&x);
    const double t = IMP_2PI * u[0], psi = IMP_2PI * u[1];
    const imp_v3 e = axes.s * cos(t) + axes.t * sin(t);
    if (!imp__strand_point(&x, &axes, e, &at)) return false;
    *w = imp__normalize(at.along) * cos(psi) + at.around * sin(psi);
    const double bends = imp__strand_bends(&at, &x, *w);
    if (!(bends > 0)) return false; /* it is inside */
    d->touches = true;
    d->out = at.n;
    d->p = at.p;
    d->along = imp__cross(d->out, *w);
    d->inv_pdf = IMP_2PI * IMP_2PI * at.area * bends / d->chance;
    return true;
}
