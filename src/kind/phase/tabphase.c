/* SPDX-License-Identifier: Apache-2.0
 *
 * tabphase: a phase function of the cosine c of the turn, linear between `values` at n
 * places from c = -1 (straight back) to 1 (straight on), equally far apart,
 *
 *     p(c) = v(c)/(2 pi Int v dc)
 *
 * so that only their ratios count. The values are no parameters. */
#include "base/number.h"
#include "kind/build.h"
#include "turn.h"
#include <string.h>

enum { VALUES_MAX = 1 << 16 };

struct tabphase {
    int n;
    double *density; /* [n] of c, at the places */
    double *below;   /* [n] its integral from -1 */
};

static const struct imp_input_desc inputs[] = {{0}};

/* Numbers apart by commas or blanks. *n: how many; -1: something else is there. */
static void read(const char *text, double *to, int *n)
{
    *n = 0;
    const char *end = text + strlen(text);
    for (;;) {
        double v;
        text += strspn(text, ", \t\r\n");
        if (text == end) return;
        if (!imp__number(&text, end, &v) || *n == VALUES_MAX) {
            *n = -1;
            return;
        }
        if (to) to[*n] = v;
        ++*n;
    }
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_phase *p)
{
    enum imp_status st = IMP_OK;
    struct tabphase *t = self;
    const char *text;
    (void)p;
    IMP_TRY(imp_build_string(b, "values", NULL, &text));
    if (!text) IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE, "'values' is required"));
    read(text, NULL, &t->n);
    if (t->n < 2)
        IMP_TRY(imp_build_error(b, "values", IMP_E_SCENE,
                                "values is not a row of 2 to %d numbers", VALUES_MAX));
    t->density = imp_build_alloc(b, (size_t)t->n, sizeof *t->density);
    t->below = imp_build_alloc(b, (size_t)t->n, sizeof *t->below);
    if (!t->density || !t->below)
        IMP_TRY(imp_build_error(b, "values", IMP_E_NOMEM, "no memory for its values"));
    read(text, t->density, &t->n);
    const double step = 2. / (t->n - 1);
    for (int i = 0; i < t->n; i++) {
        if (!(t->density[i] >= 0) || !isfinite(t->density[i]))
            IMP_TRY(imp_build_error(b, "values", IMP_E_SCENE,
                                    "value %d, %g, is negative or not finite", i,
                                    t->density[i]));
        if (i > 0)
            t->below[i] =
                t->below[i - 1] + step * (t->density[i - 1] / 2 + t->density[i] / 2);
    }
    const double all = t->below[t->n - 1];
    if (!(all > 0) || !isfinite(all))
        IMP_TRY(imp_build_error(b, "values", IMP_E_SCENE,
                                "the integral of its values is %g", all));
    for (int i = 0; i < t->n; i++) {
        t->density[i] /= all;
        t->below[i] /= all;
    }
out:
    return st;
}

/* The inverse of the cumulative density, a quadratic on each interval. */
static void sample(const struct imp_phase *p, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    const struct tabphase *t = p->self;
    int i = 0, above = t->n - 1;
    (void)in;
    while (above - i > 1) {
        const int middle = (i + above) / 2;
        if (t->below[middle] <= u[1]) i = middle;
        else above = middle;
    }
    const double step = 2. / (t->n - 1), a = t->density[i], b = t->density[i + 1],
                 rest = (u[1] - t->below[i]) / step; /* a x + (b - a) x^2/2 */
    const double root = sqrt(imp_max(0.0, a * a + 2 * (b - a) * rest));
    const double x = a + root > 0 ? imp_clamp(2 * rest / (a + root), 0.0, 1.0) : 0;
    d->wi = imp__turn(d->wo, imp_clamp(-1 + (i + x) * step, -1.0, 1.0), u[2]);
}
static double pdf(const struct imp_phase *p, const imp_spec *in, const struct imp_dirs *d)
{
    const struct tabphase *t = p->self;
    const double at = (imp_clamp(imp_phase_cos(d), -1.0, 1.0) + 1) / 2 * (t->n - 1);
    const int i = imp_min((int)at, t->n - 2);
    (void)in;
    return ((1 - (at - i)) * t->density[i] + (at - i) * t->density[i + 1]) * IMP_INV_PI /
           2;
}
static void eval(const struct imp_phase *p, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    *f = imp__spec(pdf(p, in, d));
}
static void eval_d(const struct imp_phase *p, const imp_spec *in,
                   const struct imp_dirs *d, imp_spec *df)
{
    (void)p, (void)in, (void)d, (void)df; /* it has no inputs */
}

const struct imp_phase_ops imp__tabphase = {.size = sizeof(struct imp_phase_ops),
                                            .name = "tabphase",
                                            .object_size = sizeof(struct tabphase),
                                            .inputs = inputs,
                                            .build = build,
                                            .sample = sample,
                                            .eval = eval,
                                            .pdf = pdf,
                                            .eval_d = eval_d};
