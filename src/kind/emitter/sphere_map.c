/* SPDX-License-Identifier: Apache-2.0
 *
 * Directions of texels, solid angles of rows, and draws inside a texel, for both projections of a
 * picture of all directions. */
#include "sphere_map.h"
#include "math/trig.h"

void imp__sphere_map_place(const struct imp__sphere_map *m, imp_v3 d, double *u,
                           double *row)
{
    const double out = sqrt(d[0] * d[0] + d[2] * d[2]), last = m->height - 1;
    const imp_v3 angle =
        imp__angles_signed_4((imp_v3){-d[2], d[1], 1, 1}, (imp_v3){d[0], out, 0, 0});
    const double turns = angle[0] * (IMP_INV_PI / 2);
    *u = turns < 0 ? turns + 1 : turns;
    if (m->projection == IMP_LATLONG) *row = angle[1] * IMP_INV_PI * last;
    else *row = (1 - d[1]) * 0.5 * m->height - 0.5;
    *row = imp_clamp(*row, 0.0, last);
}

imp_v3 imp__sphere_direction(double u, double cos_theta, double sin_theta)
{
    const double phi = IMP_2PI * u;
    return imp__v3(sin(phi) * sin_theta, cos_theta, -cos(phi) * sin_theta);
}

double imp__sphere_map_cosine(const struct imp__sphere_map *m, double row)
{
    if (m->projection == IMP_LATLONG) return cos(IMP_PI * row / (m->height - 1));
    return 1 - 2 * (row + 0.5) / m->height;
}

/* 1 - sin(x)/x without cancellation. */
static double sinc_missing(double x)
{
    const double x2 = x * x;
    if (x > 0.3) return 1 - sin(x) / x;
    return x2 / 6 * (1 - x2 / 20 * (1 - x2 / 42 * (1 - x2 / 72 * (1 - x2 / 110))));
}

/* Int_0^delta (1 - t/delta) sin(theta + t) dt, half the hat of a row at theta. */
static double half_hat(double theta, double delta)
{
    const double s = sin(delta / 2);
    return cos(theta) * sinc_missing(delta) + sin(theta) * 2 * s * s / delta;
}

static double row_step(const struct imp__sphere_map *m)
{
    return IMP_PI / (m->height - 1);
}

double imp__sphere_map_weight(const struct imp__sphere_map *m, int i)
{
    const double column = IMP_2PI / m->width;
    if (m->projection == IMP_EQUAL_AREA) return column * 2 / m->height;
    const double delta = row_step(m), theta = i * delta;
    double sum = 0;
    if (i < m->height - 1) sum += half_hat(theta, delta);
    if (i > 0) sum += half_hat(IMP_PI - theta, delta);
    return column * sum;
}

/* t in [0, delta] with density (1 - t/delta) sin(theta + t): Newton's method on the
 * integral, kept inside an interval that holds the root. */
static double half_hat_draw(const struct imp__sphere_row *row, int side, double theta,
                            double delta, double r)
{
    const double sine = row->sine[side], cosine = row->cosine[side];
    const double goal = r * row->hat[side];
    double lo = 0, hi = delta, t = delta * (1 - sqrt(1 - r)); /* were the sine constant */
    for (int k = 0; k < 30 && hi - lo > 1e-13 * delta; k++) {
        const double s = sin(theta + t), c = cos(theta + t), left = 1 - t / delta;
        const double excess = cosine - left * c - (s - sine) / delta - goal;
        if (excess > 0) hi = t;
        else lo = t;
        const double next = t - excess / (left * s);
        const double before = t;
        t = next > lo && next < hi ? next : 0.5 * (lo + hi);
        if (fabs(t - before) < 1e-12 * delta) break;
    }
    return t;
}

struct imp__sphere_row imp__sphere_map_row(const struct imp__sphere_map *m, int i)
{
    const double delta = row_step(m), theta[2] = {i * delta, IMP_PI - i * delta};
    struct imp__sphere_row row;
    for (int k = 0; k < 2; k++) {
        row.sine[k] = sin(theta[k]);
        row.cosine[k] = cos(theta[k]);
        row.hat[k] = half_hat(theta[k], delta);
    }
    if (i == m->height - 1) row.hat[0] = 0;
    if (i == 0) row.hat[1] = 0;
    return row;
}

static void latlong_draw(const struct imp__sphere_map *m,
                         const struct imp__sphere_row *row, int i, double r,
                         double *cos_theta, double *sin_theta)
{
    const double delta = row_step(m), theta = i * delta;
    const double below = row->hat[0], above = row->hat[1];
    const double at = r * (above + below);
    double t;
    if (at < above || below == 0)
        t = theta -
            half_hat_draw(row, 1, IMP_PI - theta, delta, imp_max(1 - at / above, 0.0));
    else
        t = theta +
            half_hat_draw(row, 0, theta, delta, imp_min((at - above) / below, 1.0));
    *cos_theta = cos(t);
    *sin_theta = sin(t);
}

void imp__sphere_map_draw(const struct imp__sphere_map *m,
                          const struct imp__sphere_row *row, int i, double r,
                          double *cos_theta, double *sin_theta)
{
    if (m->projection == IMP_LATLONG) {
        latlong_draw(m, row, i, r, cos_theta, sin_theta);
        return;
    }
    double x = imp__hat_draw(r);
    /* Beyond the first and the last row the map is constant: half a row of it. */
    if (i == 0 && r < 0.5) x = r - 0.5;
    if (i == m->height - 1 && r >= 0.5) x = r - 0.5;
    const double z = imp_clamp(1 - 2 * (i + 0.5 + x) / m->height, -1.0, 1.0);
    *cos_theta = z;
    *sin_theta = sqrt((1 - z) * (1 + z));
}
