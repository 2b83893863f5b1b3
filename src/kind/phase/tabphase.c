/* SPDX-License-Identifier: Apache-2.0
 *
 * tabphase: a phase function of the cosine c of the turn, linear between `values` at n
 * places from c = -1 (straight back) to 1 (straight on), equally far apart,
 *
 *     p(c) = v(c)/(2 pi N),    N = Int v dc = sum_k w_k v_k
 *
 * with w_k the step, half of it at the ends, so that only ratios of the values count. With
 * h_k(c) the hat of value k,
 *
 *     dp/dv_k = (h_k - 2 pi p w_k)/(2 pi N)
 *
 * Up to NUMBERS values are inputs, each with a derivative; longer tables are constant. A
 * value that is 0 has a derivative where p is 0, or so small that h_k^2/p has no
 * integral: if there is one, a fraction e of the directions is drawn uniformly, with the
 * density
 *
 *     q(c) = (1 - e) p(c) + e/(4 pi) */
#include "base/number.h"
#include "base/required.h"
#include "kind/build.h"
#include "turn.h"
#include <string.h>

enum { VALUES_MAX = 1 << 16, NUMBERS = 24 };
#define EVEN 0.1 /* e */

struct tabphase {
    int n;
    /* [n] of a table without parameters; NULL: the inputs are the values. */
    double *value;
    double *below; /* [n] of such a table: the integral from -1 */
};

#define VALUE(k)                                                                         \
    {                                                                                    \
        .name = "value_" #k, .role = IMP_UNBOUNDED,                                      \
        .flags = IMP_INPUT_SCALAR | IMP_INPUT_NUMBER | IMP_INPUT_OPTIONAL, .unit = "1"   \
    }
static const struct imp_input_desc inputs[] = {
    VALUE(0),  VALUE(1),  VALUE(2),  VALUE(3),  VALUE(4),  VALUE(5),  VALUE(6),
    VALUE(7),  VALUE(8),  VALUE(9),  VALUE(10), VALUE(11), VALUE(12), VALUE(13),
    VALUE(14), VALUE(15), VALUE(16), VALUE(17), VALUE(18), VALUE(19), VALUE(20),
    VALUE(21), VALUE(22), VALUE(23), {0}};

/* ---- Building -------------------------------------------------------------------- */

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

static enum imp_status values_read(const struct imp_build *b, int *n, double **value)
{
    enum imp_status st = IMP_OK;
    const char *text;
    IMP_TRY(imp_build_string(b, "values", NULL, &text));
    if (!text) IMP_TRY(imp__node_missing(b->ctx, b->node, "values"));
    read(text, NULL, n);
    if (*n < 2)
        IMP_TRY(imp_build_error(b, "values", IMP_E_SCENE,
                                "values is not a row of 2 to %d numbers", VALUES_MAX));
    *value = imp_build_alloc(b, (size_t)*n, sizeof **value);
    if (!*value)
        IMP_TRY(imp_build_error(b, "values", IMP_E_NOMEM, "no memory for its values"));
    read(text, *value, n);
    for (int i = 0; i < *n; i++)
        if (!((*value)[i] >= 0) || !isfinite((*value)[i]))
            IMP_TRY(imp_build_error(b, "values", IMP_E_SCENE,
                                    "value %d, %g, is negative or not finite", i,
                                    (*value)[i]));
out:
    return st;
}

/* Are the values numbers of the scene? */
static bool are_numbers(int n) { return n <= NUMBERS; }

static enum imp_status prepare(const struct imp_build *b)
{
    double *value;
    int n;
    enum imp_status st = values_read(b, &n, &value);
    for (int i = 0; st == IMP_OK && i < n && are_numbers(n); i++) {
        if (imp_build_has(b, inputs[i].name))
            return imp_build_error(b, inputs[i].name, IMP_E_SCENE,
                                   "give %s or values, not both", inputs[i].name);
        st = imp_build_set(b, inputs[i].name, 1, &value[i]);
    }
    return st;
}

/* Integrals from -1 to each place. */
static void integrate(int n, const double *value, double *below)
{
    below[0] = 0;
    for (int i = 1; i < n; i++)
        below[i] = below[i - 1] + 2. / (n - 1) * (value[i - 1] / 2 + value[i] / 2);
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_phase *p)
{
    enum imp_status st = IMP_OK;
    struct tabphase *t = self;
    double *value;
    (void)p;
    IMP_TRY(values_read(b, &t->n, &value));
    const bool numbers = are_numbers(t->n);
    for (int i = numbers ? t->n : 0; i < NUMBERS; i++)
        if (imp_build_has(b, inputs[i].name))
            IMP_TRY(imp_build_error(b, inputs[i].name, IMP_E_SCENE,
                                    "give %s or values, not both", inputs[i].name));
    double *below = imp_build_alloc(b, (size_t)t->n, sizeof *below);
    if (!below)
        IMP_TRY(imp_build_error(b, "values", IMP_E_NOMEM, "no memory for its values"));
    integrate(t->n, value, below);
    if (!(below[t->n - 1] > 0) || !isfinite(below[t->n - 1]))
        IMP_TRY(imp_build_error(b, "values", IMP_E_SCENE,
                                "the integral of its values is %g", below[t->n - 1]));
    if (numbers) goto out;
    t->value = value;
    t->below = below;
out:
    return st;
}

/* ---- Functions ------------------------------------------------------------------- */

struct table {
    int n;
    const double *value, *below;
    double all;  /* N */
    double even; /* e */
    double room[2][NUMBERS];
};

static void table_of(const struct imp_phase *p, const imp_spec *in, struct table *x)
{
    const struct tabphase *t = p->self;
    x->n = t->n;
    x->value = t->value;
    x->below = t->below;
    x->even = 0;
    if (!t->value) {
        for (int i = 0; i < t->n; i++) {
            x->room[0][i] = in[i][0];
            if (in[i][0] == 0) x->even = EVEN;
        }
        integrate(t->n, x->room[0], x->room[1]);
        x->value = x->room[0];
        x->below = x->room[1];
    }
    x->all = x->below[x->n - 1];
}

/* The inverse of the cumulative density, a quadratic on each interval. */
static void sample(const struct imp_phase *p, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    struct table t;
    table_of(p, in, &t);
    if (!(t.all > 0)) t.even = 1; /* a search went there */
    if (u[1] < t.even) {
        d->wi = imp__turn(d->wo, 2 * u[1] / t.even - 1, u[2]);
        return;
    }
    int i = 0, above = t.n - 1;
    const double target = (u[1] - t.even) / (1 - t.even) * t.all;
    while (above - i > 1) {
        const int middle = (i + above) / 2;
        if (t.below[middle] <= target) i = middle;
        else above = middle;
    }
    const double step = 2. / (t.n - 1), a = t.value[i], b = t.value[i + 1],
                 rest = (target - t.below[i]) / step; /* a x + (b - a) x^2/2 */
    const double root = sqrt(imp_max(0.0, a * a + 2 * (b - a) * rest));
    const double x = a + root > 0 ? imp_clamp(2 * rest / (a + root), 0.0, 1.0) : 0;
    d->wi = imp__turn(d->wo, imp_clamp(-1 + (i + x) * step, -1.0, 1.0), u[2]);
}

/* p(c) between values *i and *i + 1, at the part *part. */
static double density(const struct table *t, const struct imp_dirs *d, int *i,
                      double *part)
{
    const double at = (imp_clamp(imp_phase_cos(d), -1.0, 1.0) + 1) / 2 * (t->n - 1);
    *i = imp_min((int)at, t->n - 2);
    *part = at - *i;
    if (!(t->all > 0)) return IMP_INV_PI / 4; /* all are 0: a search went there */
    return ((1 - *part) * t->value[*i] + *part * t->value[*i + 1]) /
           (2 * IMP_PI * t->all);
}
static double pdf(const struct imp_phase *p, const imp_spec *in, const struct imp_dirs *d)
{
    struct table t;
    double part;
    int i;
    table_of(p, in, &t);
    return (1 - t.even) * density(&t, d, &i, &part) + t.even * IMP_INV_PI / 4;
}
static void eval(const struct imp_phase *p, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    struct table t;
    double part;
    int i;
    table_of(p, in, &t);
    *f = imp__spec(density(&t, d, &i, &part));
}
static void eval_d(const struct imp_phase *p, const imp_spec *in,
                   const struct imp_dirs *d, imp_spec *df)
{
    struct table t;
    double part;
    int i;
    table_of(p, in, &t);
    const double f = density(&t, d, &i, &part), step = 2. / (t.n - 1);
    for (int k = 0; k < NUMBERS; k++) {
        const bool end = k == 0 || k == t.n - 1;
        const double hat = k == i ? 1 - part : k == i + 1 ? part : 0;
        df[k] = imp__spec(0);
        if (k < t.n && t.n <= NUMBERS && t.all > 0)
            df[k] =
                imp__spec((hat * IMP_INV_PI / 2 - f * (end ? step / 2 : step)) / t.all);
    }
}

const struct imp_phase_ops imp__tabphase = {.size = sizeof(struct imp_phase_ops),
                                            .name = "tabphase",
                                            .object_size = sizeof(struct tabphase),
                                            .inputs = inputs,
                                            .prepare = prepare,
                                            .build = build,
                                            .sample = sample,
                                            .eval = eval,
                                            .pdf = pdf,
                                            .eval_d = eval_d};
