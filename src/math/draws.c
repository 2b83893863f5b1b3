/* SPDX-License-Identifier: Apache-2.0
 *
 * Chi-square test of drawn directions against their density: cells by a pilot run, expected counts
 * by quadrature, one cell for each delta lobe and one for "no draw". */
#include "draws.h"
#include "rng.h"
#include "stat.h"

enum {
    PILOT = 1500,
    PILOT_LIMIT = 25,
    MIN_EXPECTED = 10 /* cells below are pooled: chi-square is an approximation */
};

#define TOTAL 1e-3
#define FAR   2.5 /* of a count from its expectation, in its standard errors */
#define CUTS  4

struct sum {
    double chi2, pool_expected, pool_count;
    int cells;
};
static void cell(struct sum *s, double expected, double observed)
{
    if (expected < MIN_EXPECTED) {
        s->pool_expected += expected;
        s->pool_count += observed;
        return;
    }
    s->chi2 += imp__sqr(observed - expected) / expected;
    s->cells++;
}

static bool draw(const struct imp__drawn *d, struct imp_key key, uint32_t i, imp_v3 *w,
                 int *lobe)
{
    const double u[3] = {imp__u01(key, 3 * i), imp__u01(key, 3 * i + 1),
                         imp__u01(key, 3 * i + 2)};
    *lobe = -1;
    return d->draw(d->payload, u, w, lobe);
}

struct imp__draws imp__draws_test(const struct imp__drawn *d, int samples, uint64_t seed,
                                  int depth, struct imp__sphere_tree *tree)
{
    struct imp__draws r = {0};
    struct sum sum = {0};
    double count[IMP_DRAWS_LOBES] = {0}, none = 0;
    imp_v3 w;
    int lobe;

    imp__sphere_tree_init(tree);
    /* Enough of those with a density, however rare they are. */
    const uint32_t pilot = d->pilot ? d->pilot : PILOT;
    for (uint32_t i = 0, n = 0; n < pilot && i < (n ? 100 : 1) * pilot; i++)
        if (draw(d, imp__key(seed, 1, 0), i, &w, &lobe) && lobe < 0) {
            imp__sphere_tree_pilot(tree, w, PILOT_LIMIT);
            n++;
        }
    imp__sphere_tree_reset(tree);
    for (int i = 0; i < samples; i++) {
        if (i % 1000 == 0 && d->stopped && d->stopped(d->watch)) return r;
        const struct imp_key key = imp__key(seed, 2, (uint64_t)i / 1000);
        if (!draw(d, key, (uint32_t)(i % 1000), &w, &lobe)) none++;
        else if (lobe < 0) imp__sphere_tree_find(tree, w)->count++;
        else if (lobe < IMP_DRAWS_LOBES) count[lobe]++;
        else r.overflow = true;
    }

    for (int i = 0; i < tree->n && d->density; i++) {
        const struct imp__sphere_cell *c = &tree->cell[i];
        if (c->child) continue;
        if (d->stopped && d->stopped(d->watch)) return r;
        double mass =
            imp__sphere_cell_integral(c, d->density, d->payload, 0.02 / samples, depth);
        /* Where draws and quadrature differ, a peak may lie between the nodes. */
        const double expected = samples * mass, off = c->count - expected;
        if (off * off > FAR * FAR * fmax(expected, 1))
            mass = imp__sphere_cell_integral_cut(c, d->density, d->payload,
                                                 0.02 / samples, depth, CUTS);
        r.total += mass;
        cell(&sum, samples * mass, c->count);
    }
    for (int l = 0; l < IMP_DRAWS_LOBES; l++) {
        if (!(count[l] > 0)) continue;
        const double chance = d->chance(d->payload, l);
        r.total += chance;
        cell(&sum, samples * chance, count[l]);
    }
    /* The quadrature of the whole is off by up to TOTAL, which would be many times the root of
     * a few missing draws. Whether all adds up to 1 is for the caller to see (total, none). */
    const double missing = samples * fmax(0, 1 - r.total), slack = samples * TOTAL;
    cell(&sum, missing + imp_clamp(none - missing, -slack, slack), none);
    if (sum.pool_expected >= 1 || sum.pool_count >= 1) {
        /* At least one expected, so that the pool's term cannot explode. */
        const double expected = fmax(sum.pool_expected, 1);
        sum.chi2 += imp__sqr(sum.pool_count - expected) / expected;
        sum.cells++;
    }
    r.cells = sum.cells;
    r.none = none / samples;
    r.chi2 = r.cells > 1 ? sum.chi2 : 0;
    r.chance = r.cells > 1 ? imp__chi2_tail(sum.chi2, r.cells - 1) : 1;
    return r;
}
