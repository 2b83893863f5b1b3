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

static bool is_strand(const struct imp__edge_draw *d)
{
    return d->b->tracer->scene->shapes[d->item->shape]->geometry == IMP_CURVES;
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

/* A rim is one where its wall is met from outside: how wide that is beside an open end, as far as the
 * outline. A look along w, with the part c along the normal, touches the wall at a distance of c/k from the
 * rim, c^2/2k beside it, where k is the wall's curvature along w. 0: it is no rim. */
static double rim_width(const struct imp__edge_draw *d, imp_v3 w)
{
    struct imp__strand x;
    struct imp__strand_point at;
    imp__strand_end(d->b->tracer->scene, d->item->shape, d->item->place, d->prim,
                    d->place > 0, &x);
    const struct imp__strand_axes axes = imp__strand_axes(&x);
    const imp_v3 q = d->p - x.c, e = imp__normalize(q - axes.a * imp__dot(axes.a, q)),
                 r = imp__normalize(w);
    if (!imp__strand_point(&x, &axes, e, &at)) return 0;
    const double c = imp__dot(at.n, r);
    if (!(c < 0)) return 0;
    const imp_v3 t = imp__normalize(r - at.n * c);
    const double k = imp__strand_bends(&at, &x, t);
    return k * imp__dot(t, d->out) < 0 ? 0.5 * c * c / fabs(k) : INFINITY;
}

bool imp__strand_merges(const struct imp__edge_draw *d, imp_v3 w, double beside)
{
    return !(rim_width(d, w) > beside);
}

#define UNMET                                                                            \
    16 /* of how far looks are apart: rays, in float, miss a wall nearer to its end */

double imp__strand_apart(const struct imp__edge_draw *d, imp_v3 w, double apart)
{
    struct imp__strand x;
    if (!d->rim || !d->item || d->item->arc || d->item->shape < 0 || !is_strand(d))
        return apart;
    line_at(d, &x);
    const double most = imp_min(0.02 * x.r, 0.02 * rim_width(d, w));
    return imp_max(apart, imp_min(UNMET * apart, most));
}

/* ---- Outlines ------------------------------------------------------------------------ */

/* Lines through an open end may touch the wall from inside, and miss what of it they meet from there: these
 * are clear of it on the inner side. Where the end is shut to a line, it meets the wall before. */

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
    const double bends = imp__strand_bends(&at, &x, w);
    const imp_v3 along =
        at.along - at.around * (x.r * imp__dot(at.n_v, w) / imp__dot(at.n_t, w));
    const double rate = imp__length(along);
    d->out = bends < 0 ? -at.n : at.n;
    d->p = at.p;
    d->along = along * (1 / rate);
    d->inv_pdf = rate * n / d->chance;
    return rate < INFINITY && bends != 0;
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
    if (!(fabs(bends) > 0)) return false;
    d->touches = true;
    d->out = bends < 0 ? -at.n : at.n;
    d->p = at.p;
    d->along = imp__cross(d->out, *w);
    d->inv_pdf = IMP_2PI * IMP_2PI * at.area * fabs(bends) / d->chance;
    return true;
}
