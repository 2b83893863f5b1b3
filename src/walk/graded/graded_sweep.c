/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives with respect to the index of a medium that walks go through. From the first
 * boundary on, where a walk goes depends on the field; the vertices between are all
 * specular, so with lobes, densities and random numbers fixed the walk is a chain
 *
 *     (x, d) -> turn at a surface -> ride, or straight way, to the next -> ... -> E(x)
 *
 * and its value a product of Fresnel's factors, ratios of n^2 and the radiance E at the
 * end, all differentiable in x, d and the field. The choice of a lobe has probability F
 * or 1 - F, taken as fixed: the factor's derivative divided by it is the unbiased part of
 * that choice (docs/estimators.md 3). What the chain may not end on is in
 * imp__graded_obstacle; edges are looked for by the survey. */
#include "graded.h"
#include "kind/bsdf/fresnel.h"
#include "walk/core/vertex.h"

/* ---- One boundary -------------------------------------------------------------- */

/* Indices on the near and the far side of vertex v for the ray of direction d; `inner`:
 * the field's value and gradient where one of them is a field's. */
struct sides {
    double near, far;
    bool entering;
    const struct imp_body *medium; /* inside */
    struct imp__jet inner;
};

static void sides_of(const struct imp_vertex *v, imp_v3 x, imp_v3 ng, imp_v3 d,
                     struct sides *s)
{
    double in = 1, out = 1;
    *s = (struct sides){.entering = imp__dot(ng, d) < 0, .medium = v->shape->body};
    if (s->medium) {
        imp__field_eval1(imp__graded_field(s->medium->graded), &x, 1, &s->inner);
        in = s->inner.eta;
        out = s->medium->outside;
    } else if (v->bsdf->index_input >= 0) {
        in = v->in[v->bsdf->index_input][0];
    }
    s->near = s->entering ? out : in;
    s->far = s->entering ? in : out;
}

static bool passes(const struct imp_vertex *v) /* as if nothing were there */
{
    return v->bsdf->flags & IMP_BSDF_NULL;
}
static bool reflects(const struct imp_vertex *v) { return v->d.lobe == 0; }
static bool scatters(const struct imp_vertex *v) { return v->d.lobe == IMP_SMOOTH; }

static imp_v3 normal_of(const struct imp__surface *l, imp_v3 x, double *inv_length)
{
    struct imp__surface_at sa;
    const imp_v3 none = {0};
    imp__surface_eval(l, &x, &none, &sa);
    *inv_length = 1 / imp__length(sa.gx);
    return sa.gx * *inv_length;
}

/* (x, d) before the boundary -> direction after it; the logarithm's factor of the lobe is
 * F, or (1 - F)/eta^2 with eta = far/near. */
static imp_v3 turned(const struct imp_vertex *v, const struct imp__surface *l, imp_v3 x,
                     imp_v3 ng, imp_v3 d)
{
    struct sides s;
    struct imp__bend_turn t;
    double inv;
    if (passes(v)) return d;
    sides_of(v, x, ng, d, &s);
    const imp_v3 n = normal_of(l, x, &inv), p = s.near * d;
    imp__bend_turn(&n, &p, s.far, reflects(v), &t);
    return t.v * (1 / (t.reflected ? s.near : s.far));
}

/* Derivatives of the logarithm of the lobe's factor by the cosine and by eta. */
static void factor_d(const struct imp_vertex *v, double c, double eta, double *d_c,
                     double *d_eta)
{
    const double F = imp__fresnel_dielectric_d(c, eta, d_c, d_eta);
    const double scale = reflects(v) ? 1 / F : -1 / (1 - F);
    *d_c *= scale;
    *d_eta *= scale;
    if (F == 0 && reflects(v)) *d_c = *d_eta = 0;
    if (!reflects(v)) *d_eta -= 2 / eta;
}

/* Reverse. In: lam, mu of (x, direction after); A = adjoint times what arrives through
 * this vertex. Out: of (x, direction before). */
static void turn_back(const struct imp_vertex *v, const struct imp__surface *l, imp_v3 d,
                      double A, const struct imp__graded_active *to, imp_v3 *lam,
                      imp_v3 *mu)
{
    struct sides s;
    struct imp__bend_turn t;
    double inv, d_c, d_eta;
    if (passes(v)) return;
    const imp_v3 x = imp__graded_kept(v)->end.at.p, zero = {0};
    sides_of(v, x, v->ng, d, &s);
    const imp_v3 n = normal_of(l, x, &inv), p = s.near * d;
    imp__bend_turn(&n, &p, s.far, reflects(v), &t);
    const double after = t.reflected ? s.near : s.far;
    const imp_v3 out = t.v * (1 / after), v_bar = *mu * (1 / after);
    imp_v3 p_bar, n_bar;
    double near_bar = 0, far_bar = 0, e2_bar;
    *(t.reflected ? &near_bar : &far_bar) -= imp__dot(v_bar, out);
    imp__bend_turn_vjp(&t, &n, &p, s.far, &v_bar, &p_bar, &n_bar, &e2_bar);
    far_bar += e2_bar;
    near_bar += imp__dot(p_bar, d);
    imp_v3 d_bar = s.near * p_bar;

    const double c = imp__dot(n, d), eta = s.far / s.near;
    factor_d(v, fabs(c), eta, &d_c, &d_eta);
    if (c < 0) d_c = -d_c;
    d_bar += n * (A * d_c);
    n_bar += d * (A * d_c);
    far_bar += A * d_eta / s.near;
    near_bar -= A * d_eta * eta / s.near;

    imp_v3 curved;
    const imp_v3 m = (n_bar - n * imp__dot(n, n_bar)) * inv;
    imp__surface_hess(l, &x, &m, &curved);
    *lam += curved;
    if (s.medium) {
        const double bar = s.entering ? far_bar : near_bar;
        *lam += bar * s.inner.g;
        struct imp__graded_active at = *to;
        at.medium = s.medium;
        imp__graded_splat(&at, &x, bar, &zero);
    }
    *mu = d_bar;
}

/* Forward: x_dot, d_dot before -> d_dot after, and the motion of the factor's logarithm.
 */
static double turn_tangent(const struct imp_vertex *v, const struct imp__surface *l,
                           imp_v3 d, const struct imp__graded_active *along,
                           const imp_v3 *x_dot, imp_v3 *d_dot)
{
    struct sides s;
    struct imp__bend_turn t;
    double inv, d_c, d_eta;
    if (passes(v)) return 0;
    const imp_v3 x = imp__graded_kept(v)->end.at.p;
    sides_of(v, x, v->ng, d, &s);
    double near_dot = 0, far_dot = 0;
    if (s.medium) {
        struct imp__graded_active at = *along;
        at.medium = s.medium;
        *(s.entering ? &far_dot : &near_dot) =
            imp__graded_tangent(&at, &x) + imp__dot(s.inner.g, *x_dot);
    }
    imp_v3 curved, p_dot, v_dot;
    const imp_v3 n = normal_of(l, x, &inv), p = s.near * d;
    imp__surface_hess(l, &x, x_dot, &curved);
    const imp_v3 n_dot = (curved - n * imp__dot(n, curved)) * inv;
    p_dot = near_dot * d + s.near * *d_dot;
    imp__bend_turn(&n, &p, s.far, reflects(v), &t);
    imp__bend_turn_jvp(&t, &n, &p, s.far, &p_dot, &n_dot, far_dot, &v_dot);
    const double c = imp__dot(n, d), eta = s.far / s.near;
    const double c_dot = imp__dot(n_dot, d) + imp__dot(n, *d_dot);
    const double eta_dot = (far_dot - eta * near_dot) / s.near;
    const double after = t.reflected ? s.near : s.far;
    const double after_dot = t.reflected ? near_dot : far_dot;
    *d_dot = (v_dot - t.v * (after_dot / after)) * (1 / after);
    factor_d(v, fabs(c), eta, &d_c, &d_eta);
    return (c < 0 ? -d_c : d_c) * c_dot + d_eta * eta_dot;
}

/* ---- The end: radiance that varies over a light -------------------------------- */

/* dE_c = (slope[0][c] a + slope[1][c] b) . dx over the light's surface. */
static void radiance_slope(const struct imp_tracer *tracer, const struct imp_vertex *v,
                           imp_spec slope[2], imp_v3 grad[2])
{
    const struct imp_emitter *e = tracer->scene->emitters[v->d.met.emitter];
    const struct imp_texcoord at = imp__vertex_at(v);
    const struct imp_emission met = imp__vertex_met(v);
    imp_spec in[IMP_INPUTS_MAX], d[IMP_INPUTS_MAX];
    slope[0] = slope[1] = (imp_spec){0};
    imp__inputs_eval(e->input, e->n_in, &at, in);
    e->ops->eval_d(e, in, &met, d);
    for (int j = 0; j < e->n_in; j++) {
        const struct imp_texture *t = e->input[j]->texture;
        imp_spec d_uv[2];
        if (!t || !t->ops->slope || !t->ops->slope(t, &at, e->input[j]->scalar, d_uv))
            continue;
        for (int k = 0; k < 2; k++) slope[k] += d[j] * d_uv[k] * v->d.met.weight;
    }
    const imp_v3 a = imp__graded_kept(v)->dp_du, b = imp__graded_kept(v)->dp_dv;
    const double aa = imp__dot(a, a), ab = imp__dot(a, b), bb = imp__dot(b, b);
    const double det = aa * bb - ab * ab;
    grad[0] = grad[1] = (imp_v3){0};
    if (!(det > 0)) return;
    grad[0] = (bb * a - ab * b) * (1 / det);
    grad[1] = (aa * b - ab * a) * (1 / det);
}

/* ---- Sweep --------------------------------------------------------------------- */

static double over(imp_spec s, int first, int last)
{
    double sum = 0;
    for (int c = first; c < last; c++) sum += s[c];
    return sum;
}

static void chain_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                        int first, int last, struct imp_sink *sink)
{
    imp_v3 lam = {0}, mu = {0};
    struct imp__graded_active to = {
        .base = tracer->active->base, .sink = sink, .lane = sink->apart ? first : 0};
    for (const struct imp_vertex *v = walk->last; v; v = v->prev) {
        const struct imp_graded_segment *leg = imp__graded_kept(v);
        struct imp__surface level;
        if (!leg) {
            if (v->prev && imp__graded_kept(v->prev)) continue; /* the environment */
            break;
        }
        imp__level(v->shape, leg->end.at.p, v->ng, &level);
        if (v->d.goes_on) {
            if (scatters(v)) lam = mu = (imp_v3){0};
            else
                turn_back(v, &level, leg->d, over(leg->P * v->w * v->beyond, first, last),
                          &to, &lam, &mu);
        }
        if (!leg->moved) {
            lam = mu = (imp_v3){0};
            continue;
        }
        if (v->d.met.emitter >= 0) {
            imp_spec slope[2];
            imp_v3 grad[2];
            radiance_slope(tracer, v, slope, grad);
            for (int k = 0; k < 2; k++)
                lam += grad[k] * over(leg->P * slope[k], first, last);
        }
        if (!leg->medium) { /* x = x0 + t d on the surface */
            struct imp__surface_at sa;
            imp__surface_eval(&level, &leg->end.at.p, &leg->d, &sa);
            const double t =
                imp__length(leg->end.at.p - imp__graded_kept(v->prev)->end.at.p);
            lam -= sa.gx * (imp__dot(lam, leg->d) / imp__dot(sa.gx, leg->d));
            mu += t * lam;
            continue;
        }
        /* n^2 at the start over that at the end */
        const struct imp_vertex *u = v->prev;
        const imp_v3 zero = {0};
        const double A = over(imp__graded_kept(u)->P * u->w * u->beyond, first, last);
        const struct imp__ride *r = &leg->ride;
        to.medium = leg->medium;
        lam -= r->k.g * (2 * A / r->k.eta);
        imp__graded_splat(&to, &r->at.x, -2 * A / r->k.eta, &zero);
        imp__ride_back(&to, r, &lam, &mu);
        lam += r->j.g * (2 * A / r->j.eta);
        imp__graded_splat(&to, &r->x, 2 * A / r->j.eta, &zero);
    }
}

void imp__graded_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                       imp_spec adjoint, struct imp_sink *sink)
{
    if (!tracer->active->body) return;
    const int lanes = tracer->scene->lanes;
    imp_spec P = adjoint;
    bool any = false;
    for (const struct imp_vertex *v = walk->first; v; v = v->next) {
        struct imp_graded_segment *leg = imp__graded_kept(v);
        if (leg) leg->P = P, any = true;
        P *= v->w;
    }
    if (!any) return;
    if (!sink->apart) chain_sweep(tracer, walk, 0, lanes, sink);
    else
        for (int c = 0; c < lanes; c++) chain_sweep(tracer, walk, c, c + 1, sink);
}

/* ---- Tangent ------------------------------------------------------------------- */

imp_spec imp__graded_chain_tangent(const struct imp_tracer *tracer,
                                   const struct imp_walk *walk, const double *x_dot)
{
    struct imp__graded_active along = {.base = tracer->active->base, .x_dot = x_dot};
    imp_spec P = imp__spec(1), before = {0}, L_dot = {0};
    imp_v3 p_dot = {0}, d_dot = {0};
    if (!tracer->active->body) return L_dot;
    for (const struct imp_vertex *v = walk->first; v; P *= v->w, v = v->next) {
        const struct imp_graded_segment *leg = imp__graded_kept(v);
        struct imp__surface level;
        if (!leg) continue;
        imp__level(v->shape, leg->end.at.p, v->ng, &level);
        if (!leg->moved) {
            p_dot = d_dot = (imp_v3){0};
        } else if (leg->medium) {
            const struct imp__ride *r = &leg->ride;
            along.medium = leg->medium;
            double log_dot =
                2 * (imp__graded_tangent(&along, &r->x) + imp__dot(r->j.g, p_dot)) /
                r->j.eta;
            imp__ride_tangent(&along, r, &p_dot, &d_dot);
            log_dot -= 2 *
                       (imp__graded_tangent(&along, &r->at.x) + imp__dot(r->k.g, p_dot)) /
                       r->k.eta;
            L_dot += before * log_dot;
        } else {
            struct imp__surface_at sa;
            imp__surface_eval(&level, &leg->end.at.p, &leg->d, &sa);
            p_dot +=
                imp__length(leg->end.at.p - imp__graded_kept(v->prev)->end.at.p) * d_dot;
            p_dot -= leg->d * (imp__dot(sa.gx, p_dot) / imp__dot(sa.gx, leg->d));
        }
        if (leg->moved && v->d.met.emitter >= 0) {
            imp_spec slope[2];
            imp_v3 grad[2];
            radiance_slope(tracer, v, slope, grad);
            for (int k = 0; k < 2; k++) L_dot += P * slope[k] * imp__dot(grad[k], p_dot);
        }
        if (!v->d.goes_on) break;
        before = P * v->w * v->beyond;
        if (!scatters(v))
            L_dot += before * turn_tangent(v, &level, leg->d, &along, &p_dot, &d_dot);
    }
    return L_dot;
}

/* ---- Elsewhere: where the vertices are when the field has changed ---------------- */

/* Where the ray from x along d meets the shape of v now. */
static bool meet(const struct imp_tracer *tracer, const struct imp_vertex *v, imp_v3 x,
                 imp_v3 d, double *ratio, imp_v3 *arriving, struct imp_surface *at)
{
    const struct imp_graded_segment *leg = imp__graded_kept(v);
    const struct imp_scene *scene = tracer->scene;
    struct imp_hit hit = leg->hit;
    double far;
    if (leg->medium) {
        struct imp__ride r;
        if (!imp__ride(leg->medium, scene, x, v->prev->ng, d, &r, &hit) ||
            hit.shape != v->shape->index)
            return false;
        *ratio = (r.j.eta / r.k.eta) / (leg->ride.j.eta / leg->ride.k.eta);
        x = r.at.x, d = r.end, far = r.length;
    } else {
        struct imp__surface level;
        imp__level(v->shape, leg->end.at.p, v->ng, &level);
        far = imp__graded_straight(leg->end.at.p, &level, x, d);
        x += far * d;
        *ratio = 1;
    }
    const imp_v3 o = x - d * far;
    imp__hit_at(v->shape, x, d, far, &hit);
    v->shape->ops->surface(v->shape, &hit, &o, &d, at);
    at->p = x;
    *arriving = d;
    return true;
}

bool imp__graded_place(const struct imp_tracer *tracer, const struct imp_vertex *v,
                       struct imp_moving *m, struct imp_place *p)
{
    const struct imp_graded_segment *leg = imp__graded_kept(v);
    if (!leg || !tracer->active || !tracer->active->body) return true;
    imp_v3 x = leg->end.at.p, ng = v->ng, d = leg->d;
    if (leg->moved) {
        /* The direction that the last vertex sends the ray in now. */
        const struct imp_vertex *u = v->prev;
        struct imp__surface level;
        struct imp_surface at;
        imp_v3 out = m->d;
        if (!scatters(u)) {
            imp__level(u->shape, m->x, m->ng, &level);
            out = turned(u, &level, m->x, m->ng, m->d);
        }
        if (!meet(tracer, v, m->x, out, &p->ratio, &d, &at)) return false;
        x = at.p;
        ng = at.ng;
        p->dirs.wo[2] = -imp__dot(at.n, d);
        p->at = (struct imp_texcoord){
            .uv = {at.uv[0], at.uv[1]}, .p = x, .carried = v->carried, .shape = v->shape};
        p->met.uv[0] = at.uv[0];
        p->met.uv[1] = at.uv[1];
    }
    *m = (struct imp_moving){x, ng, d};
    return true;
}
