/* SPDX-License-Identifier: Apache-2.0
 *
 * Smooth steps of fits of bent rays (imp_bend_fit_options.smooth_length): the metric is the
 * inverse of the matrix that sobolev.h states, and Maxwell's profile is found from its foci,
 * which leave a valley of other profiles (docs/bend.md). */
#include "bend/sobolev.h"
#include "bend_kit.h"
#include <math.h>
#include <unistd.h>

/* Node (i, j, k) and its neighbours that exist: sum of (l/h)^2 (x - neighbour). */
static double stated(const int m[3], const double weight[3], const double *x, int i,
                     int j, int k)
{
    const int at[3] = {i, j, k};
    const size_t stride[3] = {1, (size_t)m[0], (size_t)(m[0] * m[1])};
    const size_t here = (size_t)i + stride[1] * (size_t)j + stride[2] * (size_t)k;
    double sum = x[here];
    for (int axis = 0; axis < 3; axis++) {
        if (at[axis] > 0) sum += weight[axis] * (x[here] - x[here - stride[axis]]);
        if (at[axis] + 1 < m[axis])
            sum += weight[axis] * (x[here] - x[here + stride[axis]]);
    }
    return sum;
}

static void metric(double length)
{
    struct imp_field_grid desc = IMP_FIELD_GRID_INIT;
    imp_field *f;
    imp_bend *b;
    struct imp__sobolev M;
    for (int a = 0; a < 3; a++)
        desc.cells[a] = 3 + a, desc.lo[a] = -1, desc.hi[a] = 1 + 0.5 * a;
    KIT_CHECK(imp_field_grid_create(kit_ctx, &desc, 1.3, &f));
    KIT_CHECK(imp_bend_create(kit_ctx, f, &b));
    const size_t n = b->field->n_theta;
    const struct imp__grid *g = (const struct imp__grid *)b->field;
    uint8_t *held = calloc(n, 1);
    double *x = malloc(n * sizeof *x), *y = malloc(n * sizeof *y),
           *z = malloc(n * sizeof *z);
    double weight[3], worst = 0, xMz = 0, zMx = 0, moved = 0;
    for (int a = 0; a < 3; a++) {
        const double h = (desc.hi[a] - desc.lo[a]) / desc.cells[a];
        weight[a] = length * length / (h * h);
    }
    for (size_t i = 0; i < n; i++) {
        held[i] = kit_u(3, i) < 0.2;
        x[i] = y[i] = kit_pm(1, i), z[i] = kit_pm(2, i);
    }
    KIT_CHECK(imp__sobolev_create(b, held, length, &M));
    imp__sobolev_apply(&M, y);
    size_t at = 0;
    for (int k = 0; k < g->nodes[2]; k++)
        for (int j = 0; j < g->nodes[1]; j++)
            for (int i = 0; i < g->nodes[0]; i++, at++)
                if (held[at]) moved = fmax(moved, fabs(y[at]));
                else
                    worst =
                        fmax(worst, fabs(stated(g->nodes, weight, y, i, j, k) - x[at]));
    tap_ok(at == n && worst < 1e-8 && moved == 0,
           "length %g: the inverse of the stated matrix # %.1e", length, worst);
    for (size_t i = 0; i < n; i++) zMx += z[i] * y[i];
    memcpy(y, z, n * sizeof *y);
    imp__sobolev_apply(&M, y);
    for (size_t i = 0; i < n; i++) xMz += x[i] * y[i];
    tap_ok(fabs(xMz - zMx) < 1e-8, "length %g: symmetric # %.1e", length, xMz - zMx);
    imp__sobolev_destroy(&M);
    imp_bend_destroy(b);
    free(held), free(x), free(y), free(z);
}

/* Rms error of the index within 0.9 of the radius, after 50 iterations on 6 cells. */
static double maxwell(double smooth_length)
{
    struct imp_bend_fit_options o = IMP_BEND_FIT_OPTIONS_INIT;
    struct imp_bend_fit_result r = {.size = sizeof r};
    imp_bend *b;
    double sum = 0, n = 0;
    KIT_CHECK(imp_bend_load(kit_ctx, IMP_SCENES "/bend/maxwell.xml", NULL, &b));
    o.iterations[0] = 50;
    o.smooth_length = smooth_length;
    KIT_CHECK(imp_bend_fit(b, &o, &r));
    for (int k = -9; k <= 9; k++)
        for (int j = -9; j <= 9; j++)
            for (int i = -9; i <= 9; i++) {
                const double x[3] = {0.1 * i, 0.1 * j, 0.1 * k};
                const double r2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
                double eta;
                if (r2 > 0.81) continue;
                imp_field_eval(imp_bend_field(b), x, &eta, NULL, NULL);
                eta -= 2 / (1 + r2);
                sum += eta * eta, n++;
            }
    imp_bend_destroy(b);
    return sqrt(sum / n);
}

/* A fit that was stopped goes on with its own metric only; Adam has none. */
static void refused(void)
{
    struct imp_bend_fit_options o = IMP_BEND_FIT_OPTIONS_INIT;
    imp_bend *b;
    char path[] = "/tmp/imp-bend-smooth-XXXXXX";
    close(mkstemp(path));
    unlink(path);
    KIT_CHECK(imp_bend_load(kit_ctx, IMP_SCENES "/bend/focus.xml", NULL, &b));
    o.iterations[0] = 3, o.checkpoint = path, o.smooth_length = 0.1;
    KIT_CHECK(imp_bend_fit(b, &o, NULL));
    o.resume = true, o.iterations[0] = 5;
    tap_ok(imp_bend_fit(b, &o, NULL) == IMP_OK, "a fit goes on with its length");
    o.smooth_length = 0.2;
    tap_ok(imp_bend_fit(b, &o, NULL) == IMP_E_ARG, "not with another one");
    o = (struct imp_bend_fit_options)IMP_BEND_FIT_OPTIONS_INIT;
    o.smooth_length = NAN;
    tap_ok(imp_bend_fit(b, &o, NULL) == IMP_E_ARG, "a length is a number");
    o.smooth_length = 0.1, o.optimizer = IMP_ADAM;
    tap_ok(imp_bend_fit(b, &o, NULL) == IMP_E_UNSUPPORTED, "Adam has no metric");
    imp_bend_destroy(b);
    unlink(path);
}

int main(void)
{
    kit_begin(2);
    metric(0.1);
    metric(2);
    const double smooth = maxwell(0.1), rough = maxwell(0);
    tap_ok(smooth < 0.012, "Maxwell's index from smooth steps # rms %.4f, rough %.4f",
           smooth, rough);
    tap_ok(smooth < 0.7 * rough, "which is nearer than from rough ones");
    refused();
    imp_context_destroy(kit_ctx);
    return tap_done();
}
