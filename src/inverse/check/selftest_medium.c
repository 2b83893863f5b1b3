/* SPDX-License-Identifier: Apache-2.0
 *
 * Phase functions are tested as materials of albedo 1 on the whole sphere. Coefficients
 * of media at random places of their box are tested against each other and against the
 * majorants of free flights, and their derivatives against differences. */
#include "color/convert.h"
#include "scene/in_medium.h"
#include "scene/majorants.h"
#include "selftest.h"
#include <math.h>

#define PLACES 2000

enum imp_status imp__selftest_phases(struct imp__selftest *t)
{
    enum imp_status st = IMP_OK;
    t->level = imp__sidak(0.01, (1.0 + t->options.directions) * t->scene->n_media);
    for (int k = 0; k < t->scene->n_media; k++) {
        t->part = (double)k / t->scene->n_media;
        const struct imp_medium *m = t->scene->media[k];
        IMP_TRY(imp__selftest_bsdf(t, m->pure, m->phase->name, m->phase->ops->name));
    }
out:
    return st;
}

/* Values at one place: eval of the medium, number by number. */
struct tally {
    double n, bad, above, unbounded, error;
};

static double number_of(const struct imp_coefficients *c, int which, int lane)
{
    return which == 0   ? c->extinction[lane]
           : which == 1 ? c->scattering[lane]
                        : c->emission[lane];
}

/* Coefficients of one medium, number by number, at inputs of which one is x. */
static void moved(const struct imp_medium *m, imp_spec *in, int j, imp_spec x,
                  struct imp_coefficients *c)
{
    const imp_spec kept = in[j];
    in[j] = x;
    m->ops->eval(m, in, c);
    in[j] = kept;
}

/* Fourth-order differences: exact to rounding for products and sums, and within 4e-12 for
 * an extinction that falls as 1/x, whose step is a part of x. */
static void derivative_take(const struct imp_medium *m, imp_spec *in, int lanes,
                            struct tally *a)
{
    struct imp_coefficients dc[IMP_INPUTS_MAX], c[4];
    m->ops->eval_d(m, in, dc);
    for (int j = 0; j < m->n_own; j++) {
        const imp_spec x = in[j];
        const bool falls = m->ops->inputs[j].flags & IMP_INPUT_FALLS;
        const double h = 1e-3 * ((falls ? 0 : 1) + fabs(x[0]));
        for (int k = 0; k < 4; k++)
            moved(m, in, j, x + h * (k < 2 ? k - 2 : k - 1), &c[k]);
        for (int which = 0; which < 3; which++)
            for (int l = 0; l < lanes; l++) {
                const double d = number_of(&dc[j], which, l);
                const double near =
                                 number_of(&c[2], which, l) - number_of(&c[1], which, l),
                             far =
                                 number_of(&c[3], which, l) - number_of(&c[0], which, l);
                const double q = (8 * near - far) / (12 * h);
                a->error = fmax(a->error, fabs(d - q) / (1 + fabs(q)));
            }
    }
}

static void place_take(const struct imp__selftest *t, const struct imp_medium *m, int k,
                       struct tally *a)
{
    const struct imp_key key = imp__key(t->options.seed, 41, (uint64_t)k);
    const int lanes = imp__is_spectral(t->scene->mode) ? 4 : t->scene->channels;
    imp_v3 p = {imp__u01(key, 0), imp__u01(key, 1), imp__u01(key, 2), 0};
    struct imp_carried carried = {4, {0}};
    double most = INFINITY;
    if (m->majorants) {
        const struct imp_majorants *g = m->majorants;
        int cell[3];
        for (int d = 0; d < 3; d++) cell[d] = imp_min((int)(p[d] * g->n[d]), g->n[d] - 1);
        most = g->bound[((size_t)cell[2] * (size_t)g->n[1] + (size_t)cell[1]) *
                            (size_t)g->n[0] +
                        (size_t)cell[0]];
        p = imp__point(&g->to_world, p);
    }
    for (int j = 0; j < 4; j++)
        carried.nm[j] = 360 + 470 * imp__u01(key, 3 + (uint32_t)j);
    const struct imp_texcoord at = {
        .p = p, .carried = imp__is_spectral(t->scene->mode) ? &carried : NULL};
    imp_spec in[IMP_INPUTS_MAX];
    struct imp_coefficients c;
    imp__inputs_eval(m->input, m->n_own, &at, in);
    m->ops->eval(m, in, &c);
    bool sane = true, part = true, bounded = true;
    for (int l = 0; l < lanes; l++) {
        for (int which = 0; which < 3; which++)
            sane &= isfinite(number_of(&c, which, l)) && number_of(&c, which, l) >= 0;
        part &= c.scattering[l] <= c.extinction[l] * (1 + 1e-12);
        bounded &= c.extinction[l] <= most;
    }
    a->n++;
    a->bad += !sane;
    a->above += sane && !part;
    a->unbounded += sane && !bounded;
    if (sane) derivative_take(m, in, lanes, a);
}

enum imp_status imp__selftest_media(struct imp__selftest *t)
{
    enum imp_status st = IMP_OK;
    t->level = 0.01;
    for (int k = 0; k < t->scene->n_media; k++) {
        t->part = (double)k / t->scene->n_media;
        const struct imp_medium *m = t->scene->media[k];
        const char *name = m->name, *kind = m->ops->name;
        struct tally a = {0};
        for (int i = 0; i < PLACES; i++) place_take(t, m, i, &a);
        IMP_TRY(imp__selftest_count(t, name, kind, "finite", a.bad, a.n));
        IMP_TRY(imp__selftest_count(t, name, kind, "part", a.above, a.n));
        if (m->majorants)
            IMP_TRY(imp__selftest_count(t, name, kind, "bounded", a.unbounded, a.n));
        IMP_TRY(imp__selftest_row(t, &(struct imp_selftest_row){.object = name,
                                                                .kind = kind,
                                                                .contract = "derivative",
                                                                .value = a.error,
                                                                .error = a.error,
                                                                .limit = 1e-9,
                                                                .chance = -1}));
    }
out:
    return st;
}
