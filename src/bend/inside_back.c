/* SPDX-License-Identifier: Apache-2.0
 *
 * Adjoint and tangent of a bent segment (inside.c), exact for its steps, with respect to
 * the medium's parameters in the scene. */
#include "inside.h"
#include <string.h>

/* ---- The medium's numbers ------------------------------------------------------ */

#define LEAF_MAX 4096 /* numbers of a field that is not a grid */

struct splat_job {
    const struct imp__graded_active *to;
    imp_v3 x, b;
    double a;
};

static const struct imp_body_numbers *numbers_at(const struct imp_body *m, size_t k)
{
    for (int i = 0; i < m->n_numbers; i++)
        if (k - m->numbers[i].first < m->numbers[i].count) return &m->numbers[i];
    return NULL;
}

static void number_add(const struct imp__graded_active *to, size_t k, double bar)
{
    const struct imp_body_numbers *n = numbers_at(to->medium, k);
    imp_spec s = {0};
    s[to->lane] = bar;
    if (n && to->base[n->param] >= 0)
        to->sink->add(to->sink, n->param, k - n->first, 1, &s);
}

/* Gradient of the grid cell that a ray is in, gathered over its steps there. */
struct imp__block {
    const imp_field *grid; /* NULL: nothing yet */
    size_t offset, corner[3];
    double bar[64];
};

static void block_flush(const struct imp__graded_active *to, struct imp__block *b)
{
    if (!b->grid) return;
    const struct imp__grid *g = (const struct imp__grid *)b->grid;
    const size_t side = g->desc.interp == IMP_FIELD_SPLINE ? 4 : 2;
    const size_t nx = (size_t)g->nodes[0], ny = (size_t)g->nodes[1];
    const struct imp_body_numbers *n = numbers_at(to->medium, b->offset);
    const size_t from = b->offset - n->first;
    imp_spec s = {0};
    for (size_t k = 0, at = 0; k < side; k++)
        for (size_t j = 0; j < side; j++)
            for (size_t i = 0; i < side; i++, at++) {
                const size_t row = b->corner[1] + j + ny * (b->corner[2] + k);
                s[to->lane] = b->bar[at];
                to->sink->add(to->sink, n->param, from + b->corner[0] + i + nx * row, 1,
                              &s);
            }
    b->grid = NULL;
}

/* Splat into the coefficients of one cell, by the splat of a grid of the same kind that
 * consists of that cell. */
static void grid_splat(const struct splat_job *j, imp_field *f, size_t offset)
{
    const struct imp__grid *g = (const struct imp__grid *)f;
    double unused[64] = {0}; /* coefficients, which weights do not depend on */
    struct imp__block own = {0}, *block = j->to->block ? j->to->block : &own;
    double a = j->a;
    imp_v3 b = j->b;
    size_t corner[3];
    if (g->desc.param == IMP_FIELD_ETA2) {
        struct imp__jet at;
        imp__field_eval1(f, &j->x, 1, &at);
        imp__eta2_vjp(&at, &a, &b);
    }
    struct imp__grid cell = imp__grid_cell(g, j->x, unused, corner);
    cell.desc.param = IMP_FIELD_ETA;
    if (block->grid != f || memcmp(block->corner, corner, sizeof corner) != 0) {
        block_flush(j->to, block);
        *block = (struct imp__block){.grid = f, .offset = offset};
        memcpy(block->corner, corner, sizeof corner);
    }
    f->ops->splat(&cell.base, &j->x, a, &b, &(struct imp__bar){.theta = block->bar});
    if (block == &own) block_flush(j->to, block);
}

static void leaf_splat(imp_field *f, size_t offset, void *payload)
{
    const struct splat_job *j = payload;
    const struct imp_body_numbers *n = numbers_at(j->to->medium, offset);
    if (imp__field_is_grid(f)) {
        if (n && j->to->base[n->param] >= 0) grid_splat(j, f, offset);
        return;
    }
    double bar[LEAF_MAX];
    const size_t count = imp_min(f->n_theta, (size_t)LEAF_MAX);
    memset(bar, 0, count * sizeof *bar);
    f->ops->splat(f, &j->x, j->a, &j->b, &(struct imp__bar){.theta = bar});
    for (size_t k = 0; k < count; k++)
        if (bar[k] != 0) number_add(j->to, offset + k, bar[k]);
}

void imp__graded_splat(const struct imp__graded_active *to, const imp_v3 *x, double a,
                       const imp_v3 *b)
{
    struct splat_job j = {to, *x, *b, a};
    if (a == 0 && imp__dot(*b, *b) == 0) return;
    imp__field_leaves(to->medium->graded->bend->field, 0, leaf_splat, &j);
}

struct tangent_job {
    const struct imp__graded_active *along;
    imp_v3 x, g_dot;
    double eta_dot;
};

static void leaf_tangent(imp_field *f, size_t offset, void *payload)
{
    struct tangent_job *j = payload;
    const struct imp__graded_active *a = j->along;
    const struct imp_body_numbers *n = numbers_at(a->medium, offset);
    double dot[64] = {0}, eta_dot;
    const double *theta_dot = dot;
    imp_v3 g_dot;
    if (n && n->count == f->n_theta) { /* one parameter: its numbers lie in a row */
        if (a->base[n->param] < 0) return;
        theta_dot = a->x_dot + a->base[n->param];
    } else {
        for (size_t k = 0; k < f->n_theta && k < imp_count(dot); k++) {
            n = numbers_at(a->medium, offset + k);
            if (n && a->base[n->param] >= 0) dot[k] = a->x_dot[a->base[n->param]];
        }
    }
    f->ops->tangent(f, &j->x, theta_dot, &eta_dot, &g_dot);
    j->eta_dot += eta_dot;
    j->g_dot += g_dot;
}

static void tangent_at(struct tangent_job *j)
{
    imp__field_leaves(j->along->medium->graded->bend->field, 0, leaf_tangent, j);
}

double imp__graded_tangent(const struct imp__graded_active *along, const imp_v3 *x)
{
    struct tangent_job j = {.along = along, .x = *x};
    tangent_at(&j);
    return j.eta_dot;
}

/* A field for the steps of scheme.c whose splats go to the sink and whose tangents come
 * from the scene's parameters, so that no array of the grid's size is needed. */
struct view {
    imp_field base;
    const struct imp__graded_active *active;
};
static void view_eval(const imp_field *f, int n, const imp_v3 *x, int order,
                      struct imp__jet *jet)
{
    const imp_field *of =
        imp__graded_field(((const struct view *)f)->active->medium->graded);
    of->ops->eval(of, n, x, order, jet);
}
static void view_splat(const imp_field *f, const imp_v3 *x, double a, const imp_v3 *b,
                       struct imp__bar *bar)
{
    (void)bar;
    imp__graded_splat(((const struct view *)f)->active, x, a, b);
}
static void view_tangent(const imp_field *f, const imp_v3 *x, const double *theta_dot,
                         double *eta_dot, imp_v3 *g_dot)
{
    (void)theta_dot;
    struct tangent_job j = {.along = ((const struct view *)f)->active, .x = *x};
    tangent_at(&j);
    *eta_dot = j.eta_dot;
    *g_dot = j.g_dot;
}
static const struct imp__field_ops view_ops = {
    .name = "view", .eval = view_eval, .splat = view_splat, .tangent = view_tangent};

/* ---- Derivatives --------------------------------------------------------------- */

void imp__ride_back(const struct imp__graded_active *to, const struct imp__ride *r,
                    imp_v3 *lam, imp_v3 *mu)
{
    const struct imp__plan *p = &to->medium->graded->plan;
    struct imp__block block = {0};
    struct imp__graded_active gather = *to;
    gather.block = &block;
    const struct view view = {{.ops = &view_ops}, &gather};
    struct imp__bar yes = {0}; /* not NULL, so that steps splat; the view ignores it */
    struct imp__state at = r->from, rate;
    struct imp__surface_at sa;
    struct imp__back b;

    /* end = v/|v| */
    const imp_v3 v_bar =
        (*mu - r->end * imp__dot(r->end, *mu)) * (1 / imp__length(r->at.v));
    imp__step_rate(p->scheme, p->field, r->tau, &at, &rate);
    imp__surface_eval(&r->level, &r->at.x, &r->at.v, &sa);
    const double rho =
        (imp__dot(*lam, rate.x) + imp__dot(v_bar, rate.v)) / imp__dot(sa.gx, rate.x);
    b.x[0] = r->at.x, b.v[0] = r->at.v;
    b.lam[0] = *lam - rho * sa.gx;
    b.mu[0] = v_bar;
    b.path_bar[0] = 0;
    imp__step_adjoint(p->scheme, &view.base, r->tau, 1, &b, NULL, &yes);
    b.x[0] = r->from.x, b.v[0] = r->from.v;
    for (uint32_t k = 0; k < r->steps; k++)
        imp__step_adjoint(p->scheme, &view.base, p->t, 1, &b, NULL, &yes);
    /* v0 = eta(x0) d0 */
    const double eta_bar = imp__dot(b.mu[0], r->d);
    const imp_v3 zero = {0};
    imp__graded_splat(&gather, &r->x, eta_bar, &zero);
    block_flush(to, &block);
    *lam = b.lam[0] + eta_bar * r->j.g;
    *mu = r->j.eta * b.mu[0];
}

void imp__ride_tangent(const struct imp__graded_active *along, const struct imp__ride *r,
                       imp_v3 *x_dot, imp_v3 *d_dot)
{
    const struct imp__plan *p = &along->medium->graded->plan;
    const struct view view = {{.ops = &view_ops}, along};
    const double yes = 0; /* not NULL, so that steps call the view's tangent */
    struct imp__state s = {r->x, r->j.eta * r->d, 0}, dot = {*x_dot, {0}, 0}, rate;
    struct imp__surface_at sa;
    const double eta_dot = imp__graded_tangent(along, &r->x) + imp__dot(r->j.g, *x_dot);
    dot.v = eta_dot * r->d + r->j.eta * *d_dot;
    for (uint32_t k = 0; k < r->steps; k++)
        imp__step_tangent(p->scheme, &view.base, p->t, &yes, &s, &dot);
    struct imp__state at = r->from;
    imp__step_rate(p->scheme, p->field, r->tau, &at, &rate);
    imp__step_tangent(p->scheme, &view.base, r->tau, &yes, &s, &dot);
    imp__surface_eval(&r->level, &r->at.x, &r->at.v, &sa);
    const double tau_dot = -imp__dot(sa.gx, dot.x) / imp__dot(sa.gx, rate.x);
    *x_dot = dot.x + tau_dot * rate.x;
    const imp_v3 v_dot = dot.v + tau_dot * rate.v;
    *d_dot = (v_dot - r->end * imp__dot(r->end, v_dot)) * (1 / imp__length(r->at.v));
}
