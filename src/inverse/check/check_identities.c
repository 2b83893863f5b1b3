/* SPDX-License-Identifier: Apache-2.0
 *
 * Identities that hold on every walk, to rounding (docs/estimators.md 12):
 *
 *   dot     <J v, w> = <v, J^T w>: tangent against sweep
 *   euler   sum theta dL/dtheta = L over all emission; on Stam's walks
 *           sum theta dL/dtheta = n L over the reflectances of one material met n times
 */
#include "check_walks.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- Dot product --------------------------------------------------------------- */

static enum imp_status check_dot(struct imp__kept *k)
{
    struct imp__check *c = k->check;
    const size_t n = c->problem->n;
    struct imp_check_row row = {.limit = IMP_EXACT_LIMIT, .ok = 1};
    double *v = imp__alloc(c->ctx, n, sizeof *v);

    if (!v) return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check");
    for (size_t i = 0; i < n; i++)
        v[i] = 2 * imp__u01(imp__key(3, i >> 31, 3), (uint32_t)i) - 1;
    for (size_t i = 0; i < k->n; i++) {
        const struct imp__kept_walk *w = &k->walks[i];
        const double forward =
            imp__kept_fold(c, imp__walk_tangent(&c->tracer, &w->walk, v));
        double reverse = 0, size = 0;
        for (size_t q = 0; q < w->n; q++) {
            reverse += w->gradient[q].g * v[w->gradient[q].i];
            size += fabs(w->gradient[q].g * v[w->gradient[q].i]);
        }
        const double error = forward == reverse ? 0 : fabs(forward - reverse) / size;
        if (error <= row.error) continue;
        row.error = error;
        row.value = reverse;
        row.reference = forward;
    }
    row.ok = row.error <= row.limit;
    imp__release(c->ctx, v);
    return imp__check_row(c, "dot", NULL, -1, &row);
}

/* ---- Euler --------------------------------------------------------------------- */

/* Mark the parameters behind an input. */
static void mark(const struct imp_scene *s, const struct imp_input *in, uint8_t *chosen)
{
    if (!in->texture) {
        if (in->param >= 0) chosen[in->param] = 1;
        return;
    }
    if (in->texture->param >= 0) chosen[in->texture->param] = 1;
    for (int j = 0; j < in->texture->n_in; j++) mark(s, in->texture->input[j], chosen);
}

static bool any_chosen(const struct imp_scene *s, const uint8_t *chosen)
{
    for (size_t k = 0; k < s->n_params; k++)
        if (chosen[k]) return true;
    return false;
}

/* Is a chosen parameter behind another input too (a texture that is light and paint)? */
static bool used_otherwise(const struct imp_scene *s, const uint8_t *chosen,
                           uint8_t *others)
{
    memset(others, 0, s->n_params);
    for (int i = 0; i < s->n_emitters; i++)
        for (int j = 0; j < s->emitters[i]->n_in; j++)
            if (s->emitters[i]->ops->inputs[j].role != IMP_EMISSION)
                mark(s, s->emitters[i]->input[j], others);
    for (int i = 0; i < s->n_bsdfs; i++)
        for (int j = 0; j < s->bsdfs[i]->n_own; j++)
            if (s->bsdfs[i]->ops->inputs[j].role != IMP_EMISSION)
                mark(s, s->bsdfs[i]->input[j], others);
    for (int i = 0; i < s->n_media; i++)
        for (int j = 0; j < s->media[i]->n_in; j++)
            if (j >= s->media[i]->n_own ||
                s->media[i]->ops->inputs[j].role != IMP_EMISSION)
                mark(s, s->media[i]->input[j], others);
    for (size_t k = 0; k < s->n_params; k++)
        if (chosen[k] && others[k]) return true;
    return false;
}

/* Sum of theta dL/dtheta over the chosen parameters against n(walk) L, worst walk.
 * Numbers without a parameter (fixed inputs) make the identity fail, so `chosen` must be
 * complete. */
static enum imp_status euler(struct imp__kept *k, const uint8_t *chosen,
                             const struct imp_bsdf *counted, const char *name)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = k->check;
    const struct imp_scene *s = c->problem->scene;
    struct imp_active active = {0};
    struct imp_tracer tracer = c->tracer;
    struct imp__kept_list list = {
        {.add = imp__kept_add}, &active, c->ctx, s->lanes, NULL, 0, 0, false};
    struct imp_check_row row = {.limit = IMP_EXACT_LIMIT, .ok = 1};
    double *theta = NULL;

    IMP_TRY(imp__active_create(s, chosen, &active));
    theta = imp__alloc(c->ctx, imp_max(active.n, (size_t)1), sizeof *theta);
    if (!theta) IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
    for (size_t p = 0; p < s->n_params; p++)
        for (size_t e = 0; active.base[p] >= 0 && e < s->params[p].info.count; e++)
            theta[(size_t)active.base[p] + e] = imp__param_get(&s->params[p], e);
    tracer.active = &active;
    for (size_t i = 0; i < k->n; i++) {
        const struct imp__kept_walk *w = &k->walks[i];
        double n = 1, sum = 0;
        if (counted) {
            n = 0;
            for (const struct imp_vertex *v = w->walk.first; v && v->next; v = v->next)
                /* Emission before the last vertex: L is a sum of products, not one
                 * product. */
                n = imp__is_zero(v->e) ? n + (v->bsdf == counted) : -INFINITY;
        }
        if (fabs(w->L) <= IMP_KEPT_NOTHING || n <= 0) continue;
        list.n = 0;
        imp__walk_sweep(&tracer, &w->walk, imp__kept_fold_bar(c), &list.sink);
        if (list.failed)
            IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
        for (size_t q = 0; q < list.n; q++) sum += theta[list.at[q].i] * list.at[q].g;
        const double error = fabs(sum - n * w->L) / fabs(n * w->L);
        if (error <= row.error && row.reference != 0) continue;
        row.error = error;
        row.value = sum;
        row.reference = n * w->L;
    }
    row.ok = row.error <= row.limit;
    if (row.reference != 0) IMP_TRY(imp__check_row(c, "euler", name, -1, &row));
out:
    imp__active_destroy(c->ctx, &active);
    imp__release(c->ctx, list.at);
    imp__release(c->ctx, theta);
    return st;
}

/* Are the values of first degree in all chosen numbers? */
static bool first_degree(const struct imp_scene *s, const uint8_t *chosen)
{
    for (size_t p = 0; p < s->n_params; p++)
        if (chosen[p] && s->params[p].degree == IMP_DEGREE_OTHER) return false;
    return true;
}

static enum imp_status check_emission(struct imp__kept *k, uint8_t *chosen)
{
    const struct imp_scene *s = k->check->problem->scene;
    bool all = true; /* has every light an input that is its radiance? */
    memset(chosen, 0, s->n_params);
    for (int i = 0; i < s->n_emitters; i++) {
        bool any = false;
        for (int j = 0; j < s->emitters[i]->n_in; j++) {
            if (s->emitters[i]->ops->inputs[j].role != IMP_EMISSION) continue;
            mark(s, s->emitters[i]->input[j], chosen);
            any = true;
        }
        all &= any;
    }
    for (int i = 0; i < s->n_bsdfs; i++)
        for (int j = 0; j < s->bsdfs[i]->n_own; j++)
            if (s->bsdfs[i]->ops->inputs[j].role == IMP_EMISSION)
                mark(s, s->bsdfs[i]->input[j], chosen);
    for (int i = 0; i < s->n_media; i++)
        for (int j = 0; j < s->media[i]->n_own; j++)
            if (s->media[i]->ops->inputs[j].role == IMP_EMISSION)
                mark(s, s->media[i]->input[j], chosen);
    if (!all || !any_chosen(s, chosen) || !first_degree(s, chosen) ||
        used_otherwise(s, chosen, chosen + s->n_params))
        return IMP_OK; /* L is not of first degree then */
    return euler(k, chosen, NULL, "all emission");
}

/* Stam's integrator collects light at the end only, so L is a product over the vertices.
 */
static enum imp_status check_reflectance(struct imp__kept *k, uint8_t *chosen)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *s = k->check->problem->scene;
    if (k->check->tracer.integrator->ends_by != IMP_ENDS_BY_ABSORPTION) return IMP_OK;
    for (int i = 0; i < s->n_bsdfs; i++) {
        const struct imp_bsdf *b = s->bsdfs[i];
        if (!(b->flags & IMP_BSDF_LINEAR)) continue;
        memset(chosen, 0, s->n_params);
        for (int j = 0; j < b->n_own; j++)
            if (b->ops->inputs[j].role == IMP_REFLECTANCE) mark(s, b->input[j], chosen);
        char name[256];
        snprintf(name, sizeof name, "%s: reflectances", b->name ? b->name : b->ops->name);
        if (any_chosen(s, chosen) && first_degree(s, chosen))
            IMP_TRY(euler(k, chosen, b, name));
    }
out:
    return st;
}

enum imp_status imp__check_identities(struct imp__kept *k)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = k->check;
    uint8_t *chosen =
        imp__alloc(c->ctx, imp_max(2 * c->problem->scene->n_params, (size_t)1), 1);

    if (!chosen) return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check");
    IMP_TRY(check_dot(k));
    IMP_TRY(check_emission(k, chosen));
    IMP_TRY(check_reflectance(k, chosen));
out:
    imp__release(c->ctx, chosen);
    return st;
}
