/* SPDX-License-Identifier: Apache-2.0
 *
 * A sum of fields. Its theta is that of the parts, one after the other; each part's theta
 * points into it. */
#include "bend_problem.h"
#include <string.h>

#define PARTS_MAX 1024

struct sum {
    imp_field base;
    size_t n;
    imp_field **part;
};

static void sum_eval(const imp_field *f, int n, const imp_v3 *x, int order,
                     struct imp__jet *jet)
{
    const struct sum *s = (const struct sum *)f;
    struct imp__jet more[IMP_LANES];
    s->part[0]->ops->eval(s->part[0], n, x, order, jet);
    for (size_t p = 1; p < s->n; p++) {
        s->part[p]->ops->eval(s->part[p], n, x, order, more);
        for (int i = 0; i < n; i++) {
            jet[i].eta += more[i].eta;
            jet[i].g += more[i].g;
            if (order > 1)
                for (int k = 0; k < 3; k++) jet[i].h[k] += more[i].h[k];
        }
    }
}
static void sum_splat(const imp_field *f, const imp_v3 *x, double a, const imp_v3 *b,
                      struct imp__bar *bar)
{
    const struct sum *s = (const struct sum *)f;
    struct imp__bar own = *bar;
    for (size_t p = 0; p < s->n; p++) {
        s->part[p]->ops->splat(s->part[p], x, a, b, &own);
        own.first += s->part[p]->n_theta;
    }
}
static void sum_tangent(const imp_field *f, const imp_v3 *x, const double *theta_dot,
                        double *eta_dot, imp_v3 *g_dot)
{
    const struct sum *s = (const struct sum *)f;
    *eta_dot = 0;
    *g_dot = (imp_v3){0};
    for (size_t p = 0; p < s->n; p++) {
        double e;
        imp_v3 g;
        s->part[p]->ops->tangent(s->part[p], x, theta_dot, &e, &g);
        *eta_dot += e;
        *g_dot += g;
        theta_dot += s->part[p]->n_theta;
    }
}
static void sum_changed(imp_field *f)
{
    struct sum *s = (struct sum *)f;
    for (size_t p = 0; p < s->n; p++)
        if (s->part[p]->ops->changed) s->part[p]->ops->changed(s->part[p]);
}
static void sum_moved(imp_field *f)
{
    struct sum *s = (struct sum *)f;
    double *theta = f->theta;
    for (size_t p = 0; p < s->n; p++) {
        s->part[p]->theta = theta;
        if (s->part[p]->ops->moved) s->part[p]->ops->moved(s->part[p]);
        theta += s->part[p]->n_theta;
    }
}
static void sum_destroy(imp_field *f)
{
    struct sum *s = (struct sum *)f;
    for (size_t p = 0; p < s->n; p++) imp_field_destroy(s->part[p]);
    imp__release(f->ctx, s->part);
}
static const char *sum_param_name(const imp_field *f, size_t i)
{
    const struct sum *s = (const struct sum *)f;
    for (size_t p = 0; p < s->n; i -= s->part[p]->n_theta, p++)
        if (i < s->part[p]->n_theta) return imp_field_param_name(s->part[p], i);
    return NULL;
}

const struct imp__field_ops imp__field_sum = {.name = "sum",
                                              .eval = sum_eval,
                                              .splat = sum_splat,
                                              .tangent = sum_tangent,
                                              .changed = sum_changed,
                                              .moved = sum_moved,
                                              .destroy = sum_destroy,
                                              .param_name = sum_param_name};

enum imp_status imp_field_sum_create(imp_context *ctx, size_t n, imp_field **parts,
                                     imp_field **out)
{
    enum imp_status st = IMP_OK;
    imp_field *f = NULL;
    size_t n_theta = 0;
    IMP_REQUIRE(ctx, parts, "parts");
    if (!ctx || !out)
        IMP_TRY(imp__argument_missing(ctx, __func__, ctx ? "out" : "context"));
    for (size_t p = 0; p < n; p++)
        if (!parts[p])
            IMP_TRY(imp__error(ctx, IMP_E_ARG, "%s: parts[%zu] is NULL", __func__, p));
    if (n < 1 || n > PARTS_MAX)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "a sum of %zu index fields", n));
    for (size_t p = 0; p < n; p++) n_theta += parts[p]->n_theta;
    if (n_theta > IMP_FIELD_THETA_MAX)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "a sum of index fields with %zu numbers",
                           n_theta));
    IMP_TRY(imp__field_new(ctx, &imp__field_sum, sizeof(struct sum), n_theta, &f));
    struct sum *s = (struct sum *)f;
    s->part = imp__alloc(ctx, n, sizeof(imp_field *));
    if (!s->part) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a sum of fields"));

    double *theta = f->theta;
    for (size_t p = 0; p < n; p++) {
        imp_field *part = parts[p];
        memcpy(theta, part->theta, part->n_theta * sizeof *theta);
        imp__release(ctx, part->theta);
        part->borrowed = true;
        theta += part->n_theta;
        s->part[p] = part;
        for (int k = 0; k < 3; k++) { /* defined where all parts are */
            f->lo[k] = fmax(f->lo[k], part->lo[k]);
            f->hi[k] = fmin(f->hi[k], part->hi[k]);
        }
        if (part->spacing > 0 && (f->spacing == 0 || part->spacing < f->spacing))
            f->spacing = part->spacing;
    }
    s->n = n;
    sum_moved(f);
    *out = f;
    return IMP_OK;
out:
    imp_field_destroy(f);
    for (size_t p = 0; p < n; p++) imp_field_destroy(parts[p]);
    return st;
}

void imp__field_leaves(imp_field *f, size_t offset,
                       void (*each)(imp_field *leaf, size_t offset, void *payload),
                       void *payload)
{
    if (f->ops != &imp__field_sum) {
        each(f, offset, payload);
        return;
    }
    const struct sum *s = (const struct sum *)f;
    for (size_t p = 0; p < s->n; offset += s->part[p]->n_theta, p++)
        imp__field_leaves(s->part[p], offset, each, payload);
}
