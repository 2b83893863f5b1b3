/* SPDX-License-Identifier: Apache-2.0
 *
 * A bent ray inside a body: the chord of each step is intersected with the scene, and the
 * step that hits a shape is shortened to end on it. Same steps and transposes as in
 * bend_trace.c and bend_adjoint.c, for one ray without reflections. */
#include "inside.h"
#include "kind/shape/shape.h"
#include "math/hash.h"

#define STEPS_DEFAULT 100 /* across a body whose field has no cells */

enum imp_status imp__graded_create(imp_bend *bend, struct imp_graded **out)
{
    struct imp_graded *g = imp__alloc(bend->ctx, 1, sizeof *g);
    if (!g) {
        imp_context *ctx = bend->ctx;
        imp_bend_destroy(bend);
        return imp__error(ctx, IMP_E_NOMEM, "no memory for a graded medium");
    }
    g->bend = bend;
    *out = g;
    return IMP_OK;
}

void imp__graded_destroy(struct imp_graded *g)
{
    if (!g) return;
    imp_context *ctx = g->bend->ctx;
    if (g->ready) imp__plan_destroy(&g->plan);
    imp_bend_destroy(g->bend);
    imp__release(ctx, g);
}

uint64_t imp__graded_hash(uint64_t h, const struct imp_body *m)
{
    enum { SIDE = 3 };
    if (!m->graded || m->index < 0) return h;
    for (int k = 0; k < SIDE * SIDE * SIDE; k++) {
        const int at[3] = {k % SIDE, k / SIDE % SIDE, k / (SIDE * SIDE)};
        imp_v3 x = m->lo;
        for (int c = 0; c < 3; c++) x[c] += (m->hi[c] - m->lo[c]) * (at[c] + 0.6) / SIDE;
        const double index = imp__graded_index(m->graded, &x);
        h = imp__hash(h, &index, sizeof index);
    }
    return h;
}

enum imp_status imp__graded_ready(struct imp_graded *g, imp_v3 lo, imp_v3 hi)
{
    enum imp_status st = IMP_OK;
    const imp_field *f = g->bend->field;
    struct imp_bend_options o;
    double size = 0;
    for (int k = 0; k < 3; k++) size = fmax(size, hi[k] - lo[k]);
    for (int k = 0; k < 3; k++)
        if (lo[k] < f->lo[k] - 1e-6 * size || hi[k] > f->hi[k] + 1e-6 * size)
            IMP_TRY(imp__error(g->bend->ctx, IMP_E_SCENE,
                               "the field ends at %g .. %g along axis %d (world "
                               "coordinates), the shape at %g .. %g",
                               f->lo[k], f->hi[k], k, lo[k], hi[k]));
    imp__bend_options(g->bend, &o);
    double corner[2][3];
    imp__v3_store(lo, corner[0]);
    imp__v3_store(hi, corner[1]);
    const struct imp_bend_rays box = {.size = sizeof(struct imp_bend_rays),
                                      .n = 2,
                                      .x = (const double(*)[3])corner,
                                      .d = (const double(*)[3])corner,
                                      .group = NULL};
    if (!(o.step > 0)) {
        double most = 0; /* the greatest index on a diagonal */
        for (int i = 0; i <= 64; i++) {
            const imp_v3 x = lo + (hi - lo) * (i / 64.0);
            const double eta = imp__graded_index(g, &x);
            if (isfinite(eta)) most = fmax(most, eta);
        }
        o.step = size / (STEPS_DEFAULT * fmax(most, 1e-3));
    }
    struct imp_bend_surface end = IMP_BEND_SURFACE_INIT; /* not used: shapes end rays */
    o.surfaces = &end;
    o.n_surfaces = 1;
    o.n_taps = 0;
    if (g->ready) imp__plan_destroy(&g->plan);
    g->ready = false;
    IMP_TRY(imp__plan_create(f, &o, &box, &g->plan));
    g->ready = true;
    const double margin = 0.01 * size + 2 * g->plan.t;
    for (int k = 0; k < 3; k++) {
        g->plan.lo[k] = lo[k] - margin;
        g->plan.hi[k] = hi[k] + margin;
    }
    g->plan.size = size;
out:
    return st;
}

/* ---- Shapes -------------------------------------------------------------------- */

void imp__level(const struct imp_shape *s, imp_v3 p, imp_v3 ng, struct imp__surface *l)
{
    *l = (struct imp__surface){.kind = IMP__PLANE, .n = ng, .offset = imp__dot(ng, p)};
    struct imp_round r;
    if (!imp__shape_round(s, &r)) return;
    const bool sphere = imp__dot(r.axis, r.axis) == 0;
    *l = (struct imp__surface){.kind = sphere ? IMP__SPHERE : IMP__CYLINDER,
                               .n = r.axis,
                               .c = r.centre,
                               .radius = r.radius};
}

static inline imp_v3 vertex(const struct imp_triangles *t, uint32_t i)
{
    const float *p = t->positions + 3 * (size_t)i;
    return imp__v3(p[0], p[1], p[2]);
}

/* Triangles: barycentric coordinates of x in double. Analytic shapes are intersected
 * again, with a ray limited to the neighbourhood of x, so that it misses their far side.
 */
void imp__hit_at(const struct imp_shape *s, imp_v3 x, imp_v3 d, double far,
                 struct imp_hit *hit)
{
    struct imp_hit found = *hit;
    hit->t = far;
    if (s->geometry == IMP_ANALYTIC) {
        const imp_v3 o = x - d * far;
        if (s->ops->intersect(s, &o, &d, far * (1 - 1e-3), far * (1 + 1e-3), &found)) {
            found.shape = hit->shape;
            *hit = found;
        }
        return;
    }
    const uint32_t *i = s->triangles.indices + 3 * (size_t)hit->prim;
    const imp_v3 p = vertex(&s->triangles, i[0]);
    const imp_v3 a = vertex(&s->triangles, i[1]) - p, b = vertex(&s->triangles, i[2]) - p;
    const imp_v3 y = x - p;
    const double aa = imp__dot(a, a), ab = imp__dot(a, b), bb = imp__dot(b, b);
    const double ya = imp__dot(y, a), yb = imp__dot(y, b), det = aa * bb - ab * ab;
    if (!(det > 0)) return;
    hit->u = (bb * ya - ab * yb) / det;
    hit->v = (aa * yb - ab * ya) / det;
}

/* ---- Forwards ------------------------------------------------------------------ */

/* Shorten the step from `from` to end on the surface, by Newton's method started at the
 * crossing of the chord. False: it did not converge. */
static bool land(const struct imp__plan *p, const struct imp__surface *s,
                 const struct imp__state *from, double first, double *tau,
                 struct imp__state *at)
{
    double t = first;
    for (int i = 0; i < 50; i++) {
        struct imp__state rate;
        struct imp__surface_at sa;
        *at = *from;
        imp__step_rate(p->scheme, p->field, t, at, &rate);
        imp__surface_eval(s, &at->x, &at->v, &sa);
        const double slope = imp__dot(sa.gx, rate.x) + imp__dot(sa.gv, rate.v);
        const double move = sa.g / slope;
        if (!(fabs(t - move - first) <= 0.5 * p->t)) return false;
        t -= move;
        if (fabs(move) <= 1e-7 * p->t) { /* quadratic: the rest is rounding */
            *tau = t;
            *at = *from;
            imp__step(p->scheme, p->field, t, 1, &at->x, &at->v, &at->path);
            return true;
        }
    }
    return false;
}

static bool end_ride(const struct imp_graded *g, const struct imp_scene *scene,
                     const struct imp__state *from, imp_v3 way, double first,
                     struct imp__ride *r, struct imp_hit *hit)
{
    const struct imp_shape *shape = scene->shapes[hit->shape];
    struct imp_surface at;
    const imp_v3 o = from->x;
    shape->ops->surface(shape, hit, &o, &way, &at);
    imp__level(shape, at.p, at.ng, &r->level);
    if (!land(&g->plan, &r->level, from, first, &r->tau, &r->at)) return false;
    r->from = *from;
    imp__field_eval1(g->plan.field, &r->at.x, 1, &r->k);
    const double v2 = imp__dot(r->at.v, r->at.v), eta2 = r->k.eta * r->k.eta;
    if (!(r->k.eta > 0) || !(fabs(v2 - eta2) <= 0.1 * eta2)) return false;
    r->end = r->at.v * (1 / sqrt(v2));
    r->length += imp__length(r->at.x - from->x);
    imp__hit_at(shape, r->at.x, r->end, r->length, hit);
    return true;
}

bool imp__ride(const struct imp_body *m, const struct imp_scene *scene, imp_v3 x,
               imp_v3 ng, imp_v3 d, struct imp__ride *r, struct imp_hit *hit)
{
    const struct imp_graded *g = m->graded;
    struct imp_round ball = {.radius = 0};
    if (m->ball) m->ball->ops->round(m->ball, &ball);
    const double inside2 = imp__sqr(ball.radius) * (1 - 1e-9);
    const struct imp__plan *p = &g->plan;
    /* Each chord is lengthened at both ends by the intersector's rounding, so that no
     * surface is missed between two chords. */
    const double overlap = IMP_RAY_EPSILON * (p->size + imp__length(x));
    struct imp__state s = {x, d, 0};
    *r = (struct imp__ride){.x = x, .d = d};
    imp__field_eval1(p->field, &x, 1, &r->j);
    if (!(r->j.eta > 0) || !isfinite(r->j.eta) || !imp__is_finite(r->j.g)) return false;
    s.v = r->j.eta * d;
    for (; r->steps < p->max_steps; r->steps++) {
        const struct imp__state from = s;
        imp__step(p->scheme, p->field, p->t, 1, &s.x, &s.v, &s.path);
        const imp_v3 chord = s.x - from.x, y = s.x - ball.centre;
        if (imp__dot(y, y) < inside2) {
            r->length += imp__length(chord);
            continue;
        }
        const double length = imp__length(chord);
        if (!(length > 0) || !isfinite(length)) return false;
        const imp_v3 along = chord * (1 / length);
        imp_v3 o = r->steps == 0 ? imp__offset(x, ng, along) : from.x - along * overlap;
        const double before = imp__dot(from.x - o, along);
        if (imp__intersect(scene, &o, &along, 0, before + length + overlap, hit)) {
            const double first = p->t * (hit->t - before) / length;
            hit->t -= before;
            return end_ride(g, scene, &from, along, first, r, hit);
        }
        if (!imp__inside(&s.x, &p->lo, &p->hi)) return false;
        r->length += length;
    }
    return false;
}
