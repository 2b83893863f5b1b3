/* SPDX-License-Identifier: Apache-2.0
 *
 * The table of intensities by direction (ies.h), as the types of LM-63 lay it out (ies.c): its
 * interpolation, its integral, and where it jumps. */
#include "ies.h"
#include "kind/build.h"
#include "math/trig.h"

#define DEGREE (IMP_PI / 180)

int imp__ies_place(const double *x, int n, double v, double *fraction)
{
    int lo = 0, hi = n - 1;
    while (hi - lo > 1) {
        const int middle = (lo + hi) / 2;
        if (v < x[middle]) hi = middle;
        else lo = middle;
    }
    *fraction = imp_clamp((v - x[lo]) / (x[lo + 1] - x[lo]), 0.0, 1.0);
    return lo;
}

/* Into the part of the circle that the table has, by its symmetry. */
static double folded(const struct imp_ies_data *d, double h)
{
    const double last = d->horizontal[d->n_horizontal - 1];
    if (h < 0) h += 360;
    if (d->horizontal[0] == 90) return h < 90 ? 180 - h : h > 270 ? 540 - h : h;
    if (last < 360 && h > 180) h = 360 - h;
    if (last < 180 && h > 90) h = 180 - h;
    return h;
}

/* Vertical and horizontal angle of a direction, by the table's type. False: beyond it. */
static bool angles_of(const struct imp__ies *x, imp_v3 w, double *v, double *h)
{
    const struct imp_ies_data *d = x->data;
    const double a = imp__dot(w, x->c0), b = imp__dot(w, x->c90),
                 c = imp__dot(w, x->nadir);
    imp_v3 cosine = {1, 1, 1, 1}, sine = {0}; /* of v and of h */
    if (d->type == IMP_PHOTOMETRY_C) {
        cosine[0] = c, sine[0] = sqrt(a * a + b * b);
        cosine[1] = a, sine[1] = b;
    } else if (d->type == IMP_PHOTOMETRY_B) {
        cosine[0] = c, sine[0] = a;
        cosine[1] = sqrt(a * a + c * c), sine[1] = -b;
    } else {
        cosine[0] = sqrt(a * a + b * b), sine[0] = -c;
        cosine[1] = a, sine[1] = -b;
    }
    const imp_v3 angle = imp__angles_signed_4(cosine, sine) * (1 / DEGREE);
    *v = angle[0];
    *h = angle[1];
    if (d->type == IMP_PHOTOMETRY_C) {
        *h = d->n_horizontal > 1 ? folded(d, *h) : 0;
        return true;
    }
    if (d->horizontal[0] == 0) *h = fabs(*h);
    return fabs(*h) <= 90 + 1e-9;
}

double imp__ies_intensity(const struct imp__ies *x, imp_v3 w)
{
    const struct imp_ies_data *d = x->data;
    const int n = d->n_vertical;
    double f, g, v, h;
    /* Rounding does not take light away at the last angle. */
    if (!angles_of(x, w, &v, &h) || v < d->vertical[0] - 1e-9 ||
        v > d->vertical[n - 1] + 1e-9)
        return 0;
    const double *cd = d->candela + imp__ies_place(d->vertical, n, v, &f);
    if (d->n_horizontal > 1) {
        cd += (size_t)imp__ies_place(d->horizontal, d->n_horizontal, h, &g) * (size_t)n;
        const double one = cd[0] + f * (cd[1] - cd[0]);
        return x->factor * (one + g * (cd[n] + f * (cd[n + 1] - cd[n]) - one));
    }
    return x->factor * (cd[0] + f * (cd[1] - cd[0]));
}

static double most_of(const double *x, size_t n, size_t stride)
{
    double most = 0;
    for (size_t k = 0; k < n; k++) most = imp_max(most, x[k * stride]);
    return most;
}

const char *imp__ies_jump(const struct imp_ies_data *d)
{
    const size_t n = (size_t)d->n_vertical, m = (size_t)d->n_horizontal;
    const double *first = d->candela, *last = d->candela + (m - 1) * n;
    const bool turns = d->type == IMP_PHOTOMETRY_C;
    const bool around = d->type == IMP_PHOTOMETRY_B; /* v goes on behind 90 degrees */
    const double small = 1e-6 * most_of(d->candela, n * m, 1); /* what files round */
    const double from = turns ? 0 : -90, till = turns ? 180 : 90;
    if (((around || d->vertical[0] > from) && most_of(first, m, n) > small) ||
        ((around || d->vertical[n - 1] < till) && most_of(first + n - 1, m, n) > small))
        return "ends at a vertical angle at which it still has light";
    if (d->type == IMP_PHOTOMETRY_A && m > 1 &&
        (most_of(last, n, 1) > small ||
         (d->horizontal[0] < 0 && most_of(first, n, 1) > small)))
        return "ends at a horizontal angle at which it still has light";
    if (turns && m > 1 && d->horizontal[m - 1] == 360)
        for (size_t k = 0; k < n; k++)
            if (fabs(first[k] - last[k]) > small)
                return "has two planes at the horizontal angles 0 and 360";
    return NULL;
}

/* I is linear in each angle of a cell; Gauss-Legendre of two points takes its square root's worth of
 * the sphere's area element to 1e-6 for cells of 5 degrees. */
double imp__ies_flux(const struct imp__ies *x)
{
    const struct imp_ies_data *d = x->data;
    static const double node[2] = {0.21132486540518712, 0.78867513459481288};
    const int n = d->n_vertical, m = d->n_horizontal;
    const bool turns = d->type == IMP_PHOTOMETRY_C, b = d->type == IMP_PHOTOMETRY_B;
    double sum = 0, span = m > 1   ? d->horizontal[m - 1] - d->horizontal[0]
                           : turns ? 360
                                   : 180;
    for (int j = 0; j < imp_max(m - 1, 1); j++)
        for (int i = 0; i + 1 < n; i++)
            for (int q = 0; q < 4; q++) {
                const double f = node[q & 1], g = node[q >> 1];
                const double *p = d->candela + (size_t)j * (size_t)n + (size_t)i;
                const double *o = m > 1 ? p + n : p;
                const double dv = d->vertical[i + 1] - d->vertical[i];
                const double dh = m > 1 ? d->horizontal[j + 1] - d->horizontal[j] : span;
                const double v = (d->vertical[i] + f * dv) * DEGREE;
                const double h = m > 1 ? (d->horizontal[j] + g * dh) * DEGREE
                                       : (turns ? 0 : (g - 0.5) * IMP_PI);
                const double one = p[0] + f * (p[1] - p[0]);
                const double value = one + g * (o[0] + f * (o[1] - o[0]) - one);
                const double element = turns ? sin(v) : b ? cos(h) : cos(v);
                sum += 0.25 * value * element * dv * dh * (DEGREE * DEGREE);
            }
    const double whole = turns ? 360 : 180;
    return x->factor * sum * whole / span;
}
