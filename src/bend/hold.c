/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers that a fit may not change, and the bounds of the others. Both are rules,
 * applied again at each level. */
#include "bend_problem.h"

static enum imp_status hold_add(imp_bend *b, const struct imp__hold *h)
{
    enum imp_status st = IMP_OK;
    struct imp__hold *holds;
    double *theta = imp__alloc(b->ctx, b->field->n_theta + 1, sizeof *theta);
    uint8_t *mask = imp__alloc(b->ctx, b->field->n_theta + 1, 1);
    if (!theta || !mask ||
        !(holds = imp__grow(b->ctx, b->holds, &b->cap_holds, b->n_holds + 1,
                            sizeof *b->holds)))
        IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "no memory for held numbers"));
    b->holds = holds;
    b->holds[b->n_holds++] = *h;
    imp_field_get_theta(b->field, theta);
    imp__bend_hold(b, mask, theta);
    IMP_TRY(imp_field_set_theta(b->field, theta));
out:
    imp__release(b->ctx, theta);
    imp__release(b->ctx, mask);
    return st;
}

enum imp_status imp_bend_hold_rim(imp_bend *b, int layers, double value)
{
    IMP_REQUIRE(NULL, b, "bend");
    if (layers < 1 || layers > 1000)
        return imp__error(b->ctx, IMP_E_ARG, "a rim of %d layers", layers);
    return hold_add(
        b, &(struct imp__hold){.kind = IMP_HOLD_RIM, .layers = layers, .value = value});
}
enum imp_status imp_bend_hold_outside(imp_bend *b, const double centre[3], double radius,
                                      double value)
{
    IMP_REQUIRE(NULL, b, "bend");
    IMP_REQUIRE(b->ctx, centre, "centre");
    IMP_FINITE_ALL(b->ctx, centre, 3, "centre");
    IMP_FINITE(b->ctx, radius, "radius");
    if (!(radius > 0))
        return imp__error(b->ctx, IMP_E_ARG, "a sphere of radius %g", radius);
    return hold_add(b, &(struct imp__hold){.kind = IMP_HOLD_OUTSIDE,
                                           .radius = radius,
                                           .centre = imp__v3_load(centre),
                                           .value = value});
}
enum imp_status imp_bend_hold_number(imp_bend *b, size_t i, double value)
{
    IMP_REQUIRE(NULL, b, "bend");
    if (i >= b->field->n_theta)
        return imp__error(b->ctx, IMP_E_ARG, "number %zu of a field that has %zu", i,
                          b->field->n_theta);
    return hold_add(
        b, &(struct imp__hold){.kind = IMP_HOLD_NUMBER, .number = i, .value = value});
}

struct hold_job {
    const struct imp__hold *hold;
    uint8_t *mask;
    double *theta;
};

/* Hold the outermost layers in r, and the outermost layers at both ends of z. */
static void hold_rz(const imp_field *f, size_t offset, const struct hold_job *j)
{
    const struct imp__rz *r = (const struct imp__rz *)f;
    const int layers = j->hold->layers;
    for (int l = 0; l < r->n_z; l++)
        for (int k = 0; k < r->n_u; k++, offset++) {
            if (k < r->n_u - layers && l >= layers && l < r->n_z - layers) continue;
            j->mask[offset] = 1;
            if (j->theta && isfinite(j->hold->value)) j->theta[offset] = j->hold->value;
        }
}

static void hold_leaf(imp_field *f, size_t offset, void *payload)
{
    const struct hold_job *j = payload;
    const struct imp__hold *h = j->hold;
    const uint32_t *number; /* in a tied grid a held node holds its orbit */
    const struct imp__grid *g = imp__field_nodes(f, &number);
    if (f->ops == &imp__field_rz && h->kind == IMP_HOLD_RIM) hold_rz(f, offset, j);
    if (!g) return;
    const int first = g->desc.interp == IMP_FIELD_SPLINE ? -1 : 0;
    const double value =
        g->desc.param == IMP_FIELD_ETA2 ? h->value * h->value / 2 : h->value;
    size_t at = 0;
    for (int k = 0; k < g->nodes[2]; k++)
        for (int jj = 0; jj < g->nodes[1]; jj++)
            for (int i = 0; i < g->nodes[0]; i++, at++) {
                const int index[3] = {i, jj, k};
                bool held = false;
                if (h->kind == IMP_HOLD_RIM) {
                    for (int a = 0; a < 3; a++)
                        held |=
                            index[a] < h->layers || index[a] >= g->nodes[a] - h->layers;
                } else {
                    imp_v3 x = {0};
                    for (int a = 0; a < 3; a++)
                        x[a] = g->origin[a] + (index[a] + first) / g->inv_h[a];
                    held = imp__length(x - h->centre) > h->radius;
                }
                if (!held) continue;
                const size_t own = offset + (number ? number[at] : at);
                j->mask[own] = 1;
                if (j->theta && isfinite(value)) j->theta[own] = value;
            }
}

void imp__bend_hold(const imp_bend *b, uint8_t *mask, double *theta)
{
    for (size_t i = 0; i < b->n_holds; i++) {
        struct hold_job j = {&b->holds[i], mask, theta};
        if (b->holds[i].kind != IMP_HOLD_NUMBER) {
            imp__field_leaves(b->field, 0, hold_leaf, &j);
        } else if (b->holds[i].number < b->field->n_theta) {
            mask[b->holds[i].number] = 1;
            if (theta && isfinite(b->holds[i].value))
                theta[b->holds[i].number] = b->holds[i].value;
        }
    }
}

struct bounds_job {
    const imp_bend *b;
    double *lo, *hi;
};

/* Bounds of the index are applied to the coefficients of grids and splines: weights are
 * >= 0 and sum to 1, so the index keeps the bounds too. Coefficients of eta^2/2 have the
 * bounds of eta^2/2. Numbers of profiles have none. */
static void bounds_leaf(imp_field *f, size_t offset, void *payload)
{
    const struct bounds_job *j = payload;
    const uint32_t *number;
    const struct imp__grid *g = imp__field_nodes(f, &number);
    double lo = j->b->lo, hi = j->b->hi;
    if (g && g->desc.param == IMP_FIELD_ETA2) lo = lo * fabs(lo) / 2, hi = hi * hi / 2;
    if (!g && f->ops != &imp__field_radial && f->ops != &imp__field_rz)
        lo = -INFINITY, hi = INFINITY;
    for (size_t i = 0; i < f->n_theta; i++)
        j->lo[offset + i] = lo, j->hi[offset + i] = hi;
}
void imp__bend_bounds(const imp_bend *b, double *lo, double *hi)
{
    struct bounds_job j = {b, lo, hi};
    imp__field_leaves(b->field, 0, bounds_leaf, &j);
    /* A part of a sum may lie outside the default bounds, which are those of the whole
     * index: parts are bounded only where the caller set bounds. */
    if (b->field->ops == &imp__field_sum && !b->bounds_set)
        for (size_t i = 0; i < b->field->n_theta; i++)
            lo[i] = -INFINITY, hi[i] = INFINITY;
}
