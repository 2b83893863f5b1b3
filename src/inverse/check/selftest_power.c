/* SPDX-License-Identifier: Apache-2.0
 *
 * What the drawing rows of a self-test would have seen: the relative error that a test of its
 * limit finds with a probability of .95. Directions and places are tested one by one, and all
 * together, since a wrong density is wrong at most of them; what is seen is said of the test of
 * all.
 *
 * A chi-square of n draws whose density is off by the relative error d in their places has the
 * noncentrality n E[d^2]. With the noncentrality that is found (stat.h) the root mean square of
 * d follows. A z-score beyond its limit L is found with probability .95 if its mean is L + 1.645.
 */
#include "selftest.h"
#include <math.h>

#define MOST  16   /* times the draws that are made at first */
#define GROWS 4.0  /* of one try, at most */
#define SPARE 0.95 /* of what is wanted: cells change a little with the draws */

void imp__chances_add(struct imp__chances *c, const struct imp__draws *test, int n)
{
    c->least = fmin(c->least, test->chance);
    if (test->cells < 2) return;
    c->chi2 += test->chi2;
    c->degrees += test->cells - 1;
    c->n += n;
}

double imp__chances_end(struct imp__chances *c, double level)
{
    if (!(c->n > 0)) return 0; /* nothing is drawn by chance */
    c->least = fmin(c->least, imp__chi2_tail(c->chi2, c->degrees));
    return sqrt(imp__chi2_seen(level, c->degrees, IMP_SELFTEST_POWER) / c->n);
}

void imp__scores_add(struct imp__scores *s, double value, double reference, double se)
{
    const double z = (value - reference) / se, relative = reference / se;
    if (!(fabs(z) < fabs(s->z)) || s->se == 0) {
        s->z = z;
        s->value = value;
        s->reference = reference;
        s->se = se;
    }
    if (!(reference != 0) || !isfinite(z)) return;
    s->sum += z * relative;
    s->weight += relative * relative;
}

void imp__scores_end(struct imp__scores *s)
{
    if (!(s->weight > 0)) return; /* no light anywhere */
    const double se = 1 / sqrt(s->weight), error = s->sum / s->weight, z = error / se;
    s->sees = (IMP_SELFTEST_LIMIT + imp__normal_quantile(IMP_SELFTEST_POWER)) * se;
    if (!(fabs(z) > fabs(s->z))) return;
    s->z = z; /* relative to 1 */
    s->value = 1 + error;
    s->reference = 1;
    s->se = se;
}

int imp__selftest_more(const struct imp__selftest *t, int n, double sees)
{
    if (!t->raises || t->stopped) return 0;
    const int most = (t->options.samples / t->options.directions + 1) * MOST;
    if (sees <= IMP_SELFTEST_WANTED || n >= most) return 0;
    const double times = imp__sqr(sees / (SPARE * IMP_SELFTEST_WANTED));
    return (int)fmin((double)n * fmin(times, GROWS) + 1, most);
}
