/* SPDX-License-Identifier: Apache-2.0
 *
 * The view of an observer in cells of equal solid angle. */
#include "base/arguments.h"
#include "dgp.h"
#include "math/warp.h"
#include <math.h>

#define DEGREE (IMP_PI / 180)
/* Points by which means of position indices are found: a side of the square; at least of a cell. */
enum { FINE = 256, LEAST = 2 };

/* The square's point (a, b) in [-1, 1]^2 has z = 1 - m^2 with m = max(|a|, |b|). Mean of z over
 * the cell from (i, j) to (i + 1, j + 1) times h; by symmetry a and b are not negative. */
static double mean_cosine(int i, int j, double h)
{
    const double lo = imp_max(i, j) * h;
    /* Off the diagonal m is uniform on its interval; on it, m - lo has the density 2x/h^2. */
    const double square =
        i == j ? lo * lo + lo * h * 4 / 3 + h * h / 2 : lo * lo + lo * h + h * h / 3;
    return 1 - square;
}

double imp__view_position(imp_v3 w)
{
    const double b = acos(imp_clamp(w[2], 0.0, 1.0)) / DEGREE;
    if (w[1] < 0) return imp_iwata_position(fmin(b, 90));
    const double side = hypot(w[0], w[1]);
    const double a = side > 0 ? acos(imp_clamp(w[1] / side, 0.0, 1.0)) / DEGREE : 0;
    return fmin(imp__levin_position(fmin(a, 90), fmin(b, 90)), 16);
}

int imp__view_cell(const struct imp__view *v, imp_v3 w)
{
    if (!(w[2] > 0)) return -1;
    const double k = 1 / sqrt(1 + w[2]), disk[2] = {w[0] * k, w[1] * k};
    double u[2];
    imp__concentric_disk_inverse(disk, u);
    const int x = imp_clamp((int)(u[0] * v->side), 0, v->side - 1);
    const int y = imp_clamp((int)(u[1] * v->side), 0, v->side - 1);
    return y * v->side + x;
}

/* Direction of a point of the cell, (.5, .5) its middle. */
static imp_v3 direction(const struct imp__view *v, int cell, double x, double y)
{
    const double u[2] = {(cell % v->side + x) / v->side, (cell / v->side + y) / v->side};
    double d[2];
    imp__concentric_disk(u, d);
    const double square = d[0] * d[0] + d[1] * d[1], k = sqrt(2 - square);
    return imp__v3(d[0] * k, d[1] * k, 1 - square);
}

imp_v3 imp__view_middle(const struct imp__view *v, int cell)
{
    return direction(v, cell, 0.5, 0.5);
}

enum imp_status imp__view_make(imp_context *ctx, int side, struct imp__view *out)
{
    const int half = side / 2, finer = imp_max(FINE / side, LEAST),
              points = finer * finer;
    *out = (struct imp__view){.side = side, .n = (size_t)side * (size_t)side};
    out->size = IMP_2PI / (double)out->n;
    out->cosine = imp__alloc(ctx, 2 * out->n, sizeof *out->cosine);
    if (!out->cosine) return imp__error(ctx, IMP_E_NOMEM, "no memory for a view");
    out->weight = out->cosine + out->n;
    for (int c = 0; c < (int)out->n; c++) {
        const int x = c % side, y = c / side;
        out->cosine[c] = mean_cosine(x < half ? half - 1 - x : x - half,
                                     y < half ? half - 1 - y : y - half, 1.0 / half);
        out->weight[c] = 0;
        for (int k = 0; k < points; k++) {
            const double x = (k % finer + 0.5) / finer, y = (k / finer + 0.5) / finer;
            const double p = imp__view_position(direction(out, c, x, y));
            out->weight[c] += out->size / (p * p * points);
        }
    }
    return IMP_OK;
}

void imp__view_free(imp_context *ctx, struct imp__view *v)
{
    imp__release(ctx, v->cosine);
    v->cosine = v->weight = NULL;
}
