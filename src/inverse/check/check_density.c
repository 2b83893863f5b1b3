/* SPDX-License-Identifier: Apache-2.0
 *
 * Densities of directions. A density p' that is not the one that `sample` draws with
 * makes pictures and their derivatives wrong alike, so differences see little of it, or
 * nothing. With a second density q that can be drawn too,
 *
 *     E_p[ q/(q + p') ] = int p q/(q + p')   and   E_q[ p'/(q + p') ] = int q p'/(q + p')
 *
 * are equal if p' = p; if p' = a p their ratio is a. The averaged fractions are between 0
 * and 1, so their variances are bounded. q is a mixture of a uniform density and lobes
 * about the mirror direction, so that it is not small where p is large. The test is made
 * at vertices of the recorded walks. */
#include "check_walks.h"
#include "math/rng.h"
#include "math/warp.h"
#include "walk/core/vertex.h"
#include <math.h>
#include <string.h>

#define DRAWS   16 /* pairs of directions at a vertex, in the first round */
#define MORE    4  /* factor from round to round, while the result is noisy */
#define ROUNDS  3  /* at most */
#define DEPTH   4  /* vertices of a walk tested */
#define Z_LIMIT 5  /* 6e-7 by chance */
/* An SE above this part of the averages decides nothing: 5 SE are then 10 %. */
#define RESOLVED 0.02

/* Concentrations of the lobes of q, from a half sphere to half a degree. */
#define LOBES 5
static const double lobe[LOBES] = {2, 20, 200, 2000, 20000};

/* Von Mises and Fisher's density about an axis at cosine c, kappa = lobe[k]:
 * peak[k] exp(kappa (c - 1)). */
static void peaks_set(double peak[LOBES])
{
    for (int k = 0; k < LOBES; k++) peak[k] = lobe[k] / (IMP_2PI * -expm1(-2 * lobe[k]));
}

static double q_pdf(const double peak[LOBES], imp_v3 axis, imp_v3 w)
{
    const double c = imp__dot(axis, w);
    double p = 1 / (2 * IMP_2PI);
    for (int k = 0; k < LOBES; k++) /* below e^-80 it does not count */
        if (lobe[k] * (1 - c) < 80) p += peak[k] * exp(lobe[k] * (c - 1));
    return p / (LOBES + 1);
}

static imp_v3 q_sample(imp_v3 axis, const double u[3])
{
    const int k = imp_min((int)(u[0] * (LOBES + 1)), LOBES);
    if (k == LOBES) return imp__uniform_sphere(&u[1]);
    const double c = 1 + log1p(u[1] * expm1(-2 * lobe[k])) / lobe[k];
    const double s = sqrt(fmax(0, 1 - c * c)), phi = IMP_2PI * u[2];
    const struct imp_frame f = imp__frame_from_normal(axis);
    return imp__to_world(&f, (imp_v3){s * cos(phi), s * sin(phi), c});
}

/* Sums over the vertices of one material; each vertex adds its two averages. */
struct density {
    double n, drawn, given; /* vertices, averages over p and over q */
    double square;          /* (given - drawn)^2 */
};

static void vertex_add(const struct imp_vertex *v, struct imp_key key, int draws,
                       struct density *d)
{
    const struct imp_bsdf *b = v->bsdf;
    const imp_v3 wo = imp__vertex_wo(v), mirror = {-wo[0], -wo[1], wo[2]};
    double drawn = 0, given = 0, peak[LOBES];
    peaks_set(peak);
    for (int i = 0; i < draws; i++) {
        double u[6];
        struct imp_dirs at = {.wo = wo, .lobe = IMP_SMOOTH};
        for (int k = 0; k < 6; k++) u[k] = imp__u01(key, (uint32_t)(6 * i + k));
        if (b->ops->sample(b, v->in, u, &at) && at.lobe == IMP_SMOOTH) {
            const double p = b->ops->pdf(b, v->in, &at), q = q_pdf(peak, mirror, at.wi);
            if (p > 0) drawn += q / (q + p);
        }
        at = (struct imp_dirs){.wo = wo, .lobe = IMP_SMOOTH};
        at.wi = q_sample(mirror, u + 3);
        const double p = b->ops->pdf(b, v->in, &at);
        if (p > 0) given += p / (q_pdf(peak, mirror, at.wi) + p);
    }
    drawn /= draws, given /= draws;
    d->n += 1;
    d->drawn += drawn;
    d->given += given;
    d->square += imp__sqr(given - drawn);
}

static struct imp_check_row judge(const struct density *d)
{
    const double a = d->drawn / d->n, b = d->given / d->n;
    struct imp_check_row row = {.limit = Z_LIMIT, .value = b, .reference = a};
    row.se = sqrt(fmax(d->square / d->n - imp__sqr(b - a), 0) / (d->n - 1));
    row.error = b == a ? 0 : fabs(b - a) / row.se;
    row.ok = !(row.error <= row.limit) ? 0 : row.se > RESOLVED * fmax(a, b) ? -1 : 1;
    return row;
}

/* Material `only`, or all of them (-1), at the recorded walks' vertices. d [n_bsdfs] */
static void vertices_add(const struct imp__kept *k, int only, int draws,
                         struct density *d)
{
    for (size_t i = 0; i < k->n; i++) {
        const struct imp_vertex *v = k->walks[i].walk.first;
        for (int depth = 0; v && depth < DEPTH; v = v->next, depth++) {
            const struct imp_bsdf *b = v->bsdf;
            if (!b || b->index < 0 || !(b->flags & IMP_BSDF_SMOOTH)) continue;
            if (only >= 0 && b->index != only) continue;
            const struct imp_key key =
                imp__key(k->check->outer.seed, 0xde4517 + i, (uint64_t)depth);
            vertex_add(v, key, draws, &d[b->index]);
        }
    }
}

enum imp_status imp__check_density(struct imp__kept *k)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = k->check;
    const struct imp_scene *scene = c->problem->scene;
    struct density *d = imp__alloc(c->ctx, (size_t)scene->n_bsdfs + 1, sizeof *d);
    if (!d) return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check");
    vertices_add(k, -1, DRAWS, d);
    for (int b = 0; b < scene->n_bsdfs; b++) {
        if (d[b].n < 32) continue; /* too few for a standard error */
        struct imp_check_row row = judge(&d[b]);
        for (int round = 1, draws = DRAWS; row.ok < 0 && round < ROUNDS; round++) {
            d[b] = (struct density){0};
            vertices_add(k, b, draws *= MORE, d);
            row = judge(&d[b]);
        }
        const struct imp_bsdf *bsdf = scene->bsdfs[b];
        IMP_TRY(imp__check_row(c, "density", bsdf->name ? bsdf->name : bsdf->ops->name,
                               -1, &row));
    }
out:
    imp__release(c->ctx, d);
    return st;
}
