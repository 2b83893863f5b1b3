/* SPDX-License-Identifier: Apache-2.0
 *
 * The mixture of a uniform density and lobes. */
#include "check_lobes.h"
#include "math/rng.h"
#include "math/warp.h"
#include <math.h>

#define WIDTHS   5
#define NARROW   0.25
#define PILOTS   4096
#define PEAKED   2000.0 /* kappa of a place that is called small, at least */
#define SHARPEST 1e9
static const double width[WIDTHS] = {2, 20, 200, 2000, 20000};

void imp__lobes_add(struct imp__lobes *q, imp_v3 axis)
{
    if (q->n < IMP_LOBE_AXES) q->axis[q->n++] = imp__normalize(axis);
}

/* Density of a lobe at cosine c to its axis: kappa/(2 pi (1 - exp(-2 kappa))) exp(kappa (c - 1)). */
static double lobe_pdf(double kappa, double c)
{
    const double x = kappa * (1 - c);
    return x < 80 ? kappa * exp(-x) / (-expm1(-2 * kappa) * IMP_2PI) : 0;
}

double imp__lobes_pdf(const struct imp__lobes *q, imp_v3 w)
{
    double sum = 0.5 / IMP_2PI;
    for (int i = 0; i < q->n; i++) {
        const double c = imp__dot(q->axis[i], w);
        for (int k = 0; k < WIDTHS && width[k] * (1 - c) < 80; k++)
            sum += lobe_pdf(width[k], c);
    }
    const double wide = sum / (1 + WIDTHS * q->n);
    if (!(q->narrow > 0)) return wide;
    return (1 - NARROW) * wide + NARROW * lobe_pdf(q->narrow, imp__dot(q->axis[0], w));
}

static imp_v3 lobe_sample(imp_v3 axis, double kappa, const double u[2])
{
    const double away = -log1p(u[0] * expm1(-2 * kappa)) / kappa;
    const double s = sqrt(fmax(0, away * (2 - away))), phi = IMP_2PI * u[1];
    const struct imp_frame f = imp__frame_from_normal(axis);
    return imp__to_world(&f, (imp_v3){s * cos(phi), s * sin(phi), 1 - away});
}

imp_v3 imp__lobes_sample(const struct imp__lobes *q, const double u[3])
{
    const double narrow = q->narrow > 0 ? NARROW : 0;
    if (u[0] < narrow) return lobe_sample(q->axis[0], q->narrow, &u[1]);
    const int lobes = 1 + WIDTHS * q->n,
              k = imp_min((int)((u[0] - narrow) / (1 - narrow) * lobes), lobes - 1);
    if (k == 0) return imp__uniform_sphere(&u[1]);
    return lobe_sample(q->axis[(k - 1) / WIDTHS], width[(k - 1) % WIDTHS], &u[1]);
}

/* ---- Skies ------------------------------------------------------------------------------ */

static bool pilot(const struct imp_emitter *sky, imp_v3 ref, uint32_t k,
                  struct imp_light_sample *out)
{
    const struct imp_key key = imp__key(0x9107, k, 5);
    const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
    return sky->ops->sample(sky, &ref, u, out) && out->pdf > 0;
}

/* Pilots that have at least half of the largest density: their mean, and how far they lie from
 * it. A disk of radius a has a mean of 1 - cos of a^2/4, as the lobe of kappa 4/a^2 has. */
static void narrow_set(struct imp__lobes *q, const struct imp_emitter *sky, imp_v3 ref)
{
    struct imp_light_sample ls;
    imp_v3 sum = {0};
    double most = 0, n = 0, away = 0;
    for (uint32_t k = 0; k < PILOTS; k++)
        if (pilot(sky, ref, k, &ls)) most = fmax(most, ls.pdf);
    for (uint32_t k = 0; k < PILOTS; k++)
        if (pilot(sky, ref, k, &ls) && ls.pdf >= most / 2) sum += ls.wi, n++;
    if (n < 4 || !(imp__length(sum) > 0.5 * n)) return;
    const imp_v3 axis = imp__normalize(sum);
    for (uint32_t k = 0; k < PILOTS; k++)
        if (pilot(sky, ref, k, &ls) && ls.pdf >= most / 2) {
            const imp_v3 off = ls.wi - axis;
            away += imp__dot(off, off) / 2 / n;
        }
    if (!(away > 0) || away > 1 / PEAKED) return;
    imp__lobes_add(q, axis);
    q->narrow = fmin(1 / away, SHARPEST);
}

void imp__lobes_of_sky(struct imp__lobes *q, const struct imp_emitter *sky, imp_v3 ref)
{
    struct imp_light_sample ls;
    narrow_set(q, sky, ref);
    for (uint32_t k = 0; k < IMP_LOBE_AXES; k++)
        if (pilot(sky, ref, k, &ls)) imp__lobes_add(q, ls.wi);
}

/* All of a disk to which the lobe was fitted. */
bool imp__lobes_narrowly(const struct imp__lobes *q, imp_v3 w)
{
    if (!(q->narrow > 0)) return false;
    const imp_v3 off = w - q->axis[0];
    return q->narrow * imp__dot(off, off) < 2 * 2.5;
}
