/* SPDX-License-Identifier: Apache-2.0
 *
 * Values of a MERL table, by Rusinkiewicz's angles of half vector and difference, and densities of
 * half vectors made from it, by direction wo: cells weighted by the table plus a cosine part. */
#include "color/rgb.h"
#include "merl.h"

static int clamped(double x, int n) { return x < n ? (int)x : n - 1; }

/* Angle of h to the normal, and its row. */
static double half_angle(imp_v3 h)
{
    return atan2(sqrt(h[0] * h[0] + h[1] * h[1]), h[2]);
}
static int row_of(const struct imp_merl_data *t, double theta_h)
{
    return clamped(t->n_half * sqrt(theta_h * (2 * IMP_INV_PI)), t->n_half);
}
/* Cosine of theta_h at the upper border of a row. */
static double border(const struct imp_merl_data *t, int row)
{
    const double x = (double)row / t->n_half;
    return row == t->n_half ? 0 : cos(x * x * IMP_PI / 2);
}

void imp__merl_rho(const struct imp_merl_data *t, imp_v3 wo, imp_v3 wi, double rho[3])
{
    const imp_v3 sum = wi + wo, h = imp__normalize(sum), e = wi - wo;
    const double theta_d = atan2(imp__length(e), imp__length(sum));
    /* The basis of h: up against the normal's plane, and across it. */
    const double s = sqrt(h[0] * h[0] + h[1] * h[1]);
    const imp_v3 across = s > 0 ? imp__v3(-h[1] / s, h[0] / s, 0) : imp__v3(0, 1, 0);
    const imp_v3 along = imp__cross(across, h);
    double y = imp__dot(e, across), x = imp__dot(e, along);
    if (y < 0 || (y == 0 && x < 0)) y = -y, x = -x; /* mod pi, the same both ways */
    const double phi_d = atan2(y, x);

    const size_t i = (size_t)row_of(t, half_angle(h));
    const size_t j =
        (size_t)clamped(t->n_difference * theta_d * (2 * IMP_INV_PI), t->n_difference);
    const size_t k = (size_t)clamped(t->n_azimuth * phi_d * IMP_INV_PI, t->n_azimuth);
    const float *p =
        t->rho + 3 * ((i * (size_t)t->n_difference + j) * (size_t)t->n_azimuth + k);
    for (int c = 0; c < 3; c++) rho[c] = p[c];
}

/* ---- Half-vectors ---------------------------------------------------------------- */

size_t imp__merl_lobes_rows(const struct imp_merl_data *t)
{
    return (size_t)IMP_MERL_WO * (size_t)t->n_half;
}

static struct imp__weight_table lobe(const struct imp_merl_data *t,
                                     const struct imp__merl_lobes *l, int m)
{
    const size_t first = (size_t)m * (size_t)t->n_half;
    return (struct imp__weight_table){IMP_MERL_TURNS, t->n_half, l->row + first,
                                      l->column + first * IMP_MERL_TURNS};
}

static imp_v3 half_vector(double cos_h, double turn)
{
    const double s = sqrt(imp_max((1 - cos_h) * (1 + cos_h), 0.0));
    return imp__v3(s * cos(turn), s * sin(turn), cos_h);
}

/* Weight of cell n: rho cos(theta_i) dwi = rho cos(theta_i) 4 (wo.h) dwh, luminance, at
 * some half-vectors of it on both sides of wo; or the same with rho = 1. */
static double cell_weight(const struct imp_merl_data *t, imp_v3 wo, int cell,
                          bool measured)
{
    const int i = cell / IMP_MERL_TURNS, k = cell % IMP_MERL_TURNS;
    enum { UP = 2, AROUND = 2 };
    const double c1 = border(t, i), c0 = border(t, i + 1);
    double sum = 0;
    for (int n = 0; n < UP * AROUND * 2; n++) {
        const double turn = (k + (n / 2 % AROUND + 0.5) / AROUND) / IMP_MERL_TURNS;
        const imp_v3 h = half_vector(c0 + (c1 - c0) * (n / 2 / AROUND + 0.5) / UP,
                                     (n % 2 ? -1 : 1) * IMP_PI * turn);
        const double c = imp__dot(wo, h);
        const imp_v3 wi = h * (2 * c) - wo;
        double rho[3] = {1, 1, 1};
        if (!(c > 0) || !(wi[2] > 0)) continue;
        if (measured) imp__merl_rho(t, wo, imp__normalize(wi), rho);
        sum += imp__luminance(rho[0], rho[1], rho[2]) * wi[2] * 4 * c * (c1 - c0);
    }
    return sum;
}

/* As much of the lobe as a cosine makes up: the largest share of which no more than 2 %
 * lies above the lobe. The table keeps the rest. */
static double cosine_take(struct imp__weight_table *w, imp_v3 wo,
                          const struct imp_merl_data *t)
{
    const int n = t->n_half * IMP_MERL_TURNS;
    double all = 0, cosines = 0, lo = IMP_MERL_SHARE, hi = 0.95, rest = 0;
    for (int k = 0; k < n; k++) {
        w->column[k] = cell_weight(t, wo, k, true);
        all += w->column[k];
        cosines += cell_weight(t, wo, k, false);
    }
    if (!(all > 0)) return 1; /* black */
    for (int step = 0; step < 6; step++) {
        const double share = 0.5 * (lo + hi);
        double above = 0;
        for (int k = 0; k < n; k++)
            above += imp_max(
                share / cosines * cell_weight(t, wo, k, false) - w->column[k] / all, 0.0);
        if (above > 0.02 * share) hi = share;
        else lo = share;
    }
    for (int k = 0; k < n; k++) {
        const double taken = lo / cosines * cell_weight(t, wo, k, false);
        w->column[k] = imp_max(w->column[k] / all - taken, 0.0);
        rest += w->column[k];
    }
    return rest > 0 ? lo : 1;
}

void imp__merl_lobes_fill(const struct imp_merl_data *t, struct imp__merl_lobes *l)
{
    for (int m = 0; m < IMP_MERL_WO; m++) {
        const double theta = (m + 0.5) / IMP_MERL_WO * IMP_PI / 2;
        struct imp__weight_table w = lobe(t, l, m);
        l->share[m] = cosine_take(&w, imp__v3(sin(theta), 0, cos(theta)), t);
        imp__weight_table_sum(&w, NULL);
    }
}

static int lobe_index(imp_v3 wo)
{
    return clamped(half_angle(wo) * IMP_MERL_WO * (2 * IMP_INV_PI), IMP_MERL_WO);
}
double imp__merl_share(const struct imp__merl_lobes *l, imp_v3 wo)
{
    return l->share[lobe_index(wo)];
}
static struct imp__weight_table lobe_for(const struct imp_merl_data *t,
                                         const struct imp__merl_lobes *l, imp_v3 wo)
{
    return lobe(t, l, lobe_index(wo));
}
/* Where azimuths count from: wo, across the normal. */
static imp_v3 across(imp_v3 wo)
{
    const double s = sqrt(wo[0] * wo[0] + wo[1] * wo[1]);
    return s > 0 ? imp__v3(wo[0] / s, wo[1] / s, 0) : imp__v3(1, 0, 0);
}

imp_v3 imp__merl_half_draw(const struct imp_merl_data *t, const struct imp__merl_lobes *l,
                           imp_v3 wo, const double u[2])
{
    const struct imp__weight_table w = lobe_for(t, l, wo);
    const double side = u[0] < 0.5 ? 1 : -1;
    const double v[2] = {u[0] < 0.5 ? 2 * u[0] : 2 * u[0] - 1, u[1]};
    double r[2];
    int i, k;
    if (!(imp__weight_table_total(&w) > 0)) return imp__v3(0, 0, 1);
    imp__weight_table_draw(&w, v, &i, &k, r);
    const double c1 = border(t, i), c0 = border(t, i + 1);
    const imp_v3 h =
        half_vector(c1 + (c0 - c1) * r[1], side * IMP_PI * (k + r[0]) / IMP_MERL_TURNS);
    const imp_v3 x = across(wo);
    return imp__v3(x[0] * h[0] - x[1] * h[1], x[1] * h[0] + x[0] * h[1], h[2]);
}

double imp__merl_half_pdf(const struct imp_merl_data *t, const struct imp__merl_lobes *l,
                          imp_v3 wo, imp_v3 h)
{
    const struct imp__weight_table w = lobe_for(t, l, wo);
    const double total = imp__weight_table_total(&w);
    if (!(total > 0)) return 0;
    const imp_v3 x = across(wo);
    const double turn = fabs(atan2(x[0] * h[1] - x[1] * h[0], x[0] * h[0] + x[1] * h[1]));
    const int i = row_of(t, half_angle(h));
    const int k = clamped(turn * IMP_INV_PI * IMP_MERL_TURNS, IMP_MERL_TURNS);
    const double *c = w.column + i * IMP_MERL_TURNS;
    const double chance = (c[k] - (k ? c[k - 1] : 0)) / total;
    return chance / ((border(t, i) - border(t, i + 1)) * IMP_2PI / IMP_MERL_TURNS);
}
