/* SPDX-License-Identifier: Apache-2.0
 *
 * Every material's sampling against its density: chi-square over directions of wi (cells
 * cut where a pilot run falls densely, expected counts by adaptive quadrature of pdf),
 * with one cell for each delta lobe and one for "no sample". A density that does not
 * integrate to what is drawn fails as surely as one of the wrong shape. Along the way:
 * what sample says about its draw is what eval and pdf say. */
#include "imp_kinds.h"
#include "imp_sphere.h"
#include "imp_tap.h"

enum {
    DIRECTIONS = 24, /* of wo, for every configuration */
    SAMPLES_OF_A_KIND = 2000000,
    PILOT = 5000,
    PILOT_LIMIT = 25,
    MIN_EXPECTED = 10, /* cells below are pooled: chi-square is an approximation */
    LOBES = 16
};
static double level; /* of one chi-square, so that all together fail 1 % (Sidak) */

struct point {
    const struct imp_bsdf *b;
    imp_spec in[KINDS_MAX_INPUTS];
    imp_v3 wo;
};
static double density(imp_v3 wi, void *payload)
{
    const struct point *p = payload;
    const struct imp_dirs d = {p->wo, wi, IMP_SMOOTH};
    return p->b->ops->pdf(p->b, p->in, &d);
}

struct result {
    double p; /* of the chi-square */
    int cells;
    double total; /* of the density and the delta lobes */
    double none;  /* fraction of draws that gave no sample */
    bool sane;
};

static bool draw(const struct point *p, struct imp_key key, uint32_t i,
                 struct imp_dirs *d, struct kind_draw *s)
{
    const double u[3] = {imp__u01(key, 3 * i), imp__u01(key, 3 * i + 1),
                         imp__u01(key, 3 * i + 2)};
    *d = (struct imp_dirs){p->wo, {0}, IMP_SMOOTH};
    return kind_draw(p->b, p->in, u, d, s);
}

/* pdf_eval gives the bits of pdf and eval, on either side. */
static bool at_once(const struct point *p, const struct imp_dirs *d)
{
    const struct imp_bsdf_ops *ops = p->b->ops;
    if (!ops->pdf_eval) return true;
    for (int side = 0; side < 4; side++) {
        struct imp_dirs e = *d;
        imp_spec f, both;
        if (side & 1) e.wo[2] = -e.wo[2];
        if (side & 2) e.wi[2] = -e.wi[2];
        const double density = ops->pdf(p->b, p->in, &e);
        if (ops->pdf_eval(p->b, p->in, &e, &both) != density) return false;
        ops->eval(p->b, p->in, &e, &f);
        if (density > 0 && memcmp(&f, &both, 3 * sizeof(double)) != 0) return false;
    }
    return true;
}

static void draw_check(const struct point *p, const struct imp_dirs *d,
                       const struct kind_draw *s, struct result *r)
{
    for (int c = 0; c < 3; c++) r->sane &= isfinite(s->f[c]) && s->f[c] >= 0;
    r->sane &= isfinite(s->pdf) && s->pdf > 0 && s->eta > 0 && d->lobe < LOBES &&
               fabs(imp__length(d->wi) - 1) < 1e-12 && d->wo[2] == p->wo[2];
    if (d->lobe == IMP_SMOOTH) r->sane &= (p->b->flags & IMP_BSDF_SMOOTH) != 0;
    else r->sane &= (p->b->flags & IMP_BSDF_DELTA) != 0;
    r->sane &= d->wi[2] * d->wo[2] > 0 || (p->b->flags & IMP_BSDF_TRANSMIT);
    r->sane &= at_once(p, d);
}

static struct result check(const struct point *p, int samples, uint64_t seed)
{
    static struct sphere_tree tree;
    struct result r = {.sane = true};
    struct imp_dirs d, lobe_dirs[LOBES];
    struct kind_draw s;
    double lobe_count[LOBES] = {0}, none = 0;
    bool lobe_seen[LOBES] = {0};

    sphere_tree_init(&tree);
    /* Enough of those with a density, however rare they are. */
    for (uint32_t i = 0, n = 0; n < PILOT && i < (n ? 100 : 1) * PILOT; i++)
        if (draw(p, imp__key(seed, 1, 0), i, &d, &s) && d.lobe == IMP_SMOOTH) {
            sphere_tree_pilot(&tree, d.wi, PILOT_LIMIT);
            n++;
        }
    sphere_tree_reset(&tree);
    for (int i = 0; i < samples; i++) {
        if (!draw(p, imp__key(seed, 2, (uint64_t)i / 1000), (uint32_t)(i % 1000), &d,
                  &s)) {
            none++;
            continue;
        }
        if (i % 16 == 0) draw_check(p, &d, &s, &r);
        if (d.lobe == IMP_SMOOTH) {
            sphere_tree_find(&tree, d.wi)->count++;
        } else if (d.lobe < LOBES) {
            lobe_seen[d.lobe] = true;
            lobe_dirs[d.lobe] = d;
            lobe_count[d.lobe]++;
        }
    }

    double chi2 = 0, pool_expected = 0, pool_count = 0;
    int cells = 0;
#define CELL(expected, observed)                                                         \
    do {                                                                                 \
        const double e_ = (expected), o_ = (observed);                                   \
        if (e_ < MIN_EXPECTED) {                                                         \
            pool_expected += e_;                                                         \
            pool_count += o_;                                                            \
        } else {                                                                         \
            chi2 += (o_ - e_) * (o_ - e_) / e_;                                          \
            cells++;                                                                     \
        }                                                                                \
    } while (0)
    for (int i = 0; i < tree.n; i++) {
        struct sphere_cell *c = &tree.cell[i];
        if (c->child || !(p->b->flags & IMP_BSDF_SMOOTH)) continue;
        const double mass =
            sphere_cell_integral(c, sphere_rule(c, density, (void *)p), density,
                                 (void *)p, 0.02 / samples, sphere_depth);
        r.total += mass;
        CELL(samples * mass, c->count);
    }
    for (int l = 0; l < LOBES; l++) {
        if (!lobe_seen[l]) continue;
        const double chance = p->b->ops->pdf(p->b, p->in, &lobe_dirs[l]);
        r.total += chance;
        CELL(samples * chance, lobe_count[l]);
    }
    CELL(samples * fmax(0, 1 - r.total), none);
    if (pool_expected >= 1 || pool_count >= 1) {
        /* At least one expected, so that the pool's term cannot explode. */
        pool_expected = fmax(pool_expected, 1);
        chi2 +=
            (pool_count - pool_expected) * (pool_count - pool_expected) / pool_expected;
        cells++;
    }
#undef CELL
    r.cells = cells;
    r.none = none / samples;
    r.p = cells > 1 ? imp__chi2_tail(chi2, cells - 1) : 1;
    return r;
}

/* How many configurations a kind has: they share the kind's samples. */
struct census {
    const char *kind;
    int n;
};
static void count_visit(const struct kind_case *c, void *payload)
{
    struct census *all = payload;
    for (int i = 0; i < 64; i++)
        if (!all[i].kind || strcmp(all[i].kind, c->kind) == 0) {
            all[i].kind = c->kind;
            all[i].n++;
            return;
        }
}

/* Glass of almost no roughness and almost no index: 2e-5 wide. */
static bool too_narrow(const struct kind_case *c)
{
    return strcmp(c->kind, "principled") == 0 && c->bsdf.flags & IMP_BSDF_TRANSMIT;
}

static void visit(const struct kind_case *c, void *payload)
{
    const struct census *all = payload;
    int configurations = 1, cells = 0;
    for (int i = 0; all[i].kind; i++)
        if (strcmp(all[i].kind, c->kind) == 0) configurations = all[i].n;
    const int samples = SAMPLES_OF_A_KIND / DIRECTIONS / configurations + 1;
    double worst = 1, above = 0;
    bool sane = true;
    sphere_depth = kind_steps(c) ? 5 : 12;
    for (int i = 0; i < DIRECTIONS; i++) {
        struct point p = {.b = &c->bsdf};
        kind_inputs(p.b,
                    i % 6 == 5                 ? KIND_WIDE
                    : i == 0 && !too_narrow(c) ? KIND_LOWEST
                                               : KIND_RANDOM,
                    500 + (uint64_t)i, p.in);
        /* One-sided kinds have nothing below: three of four from above. */
        p.wo = kind_direction(i % 4 == 3 ? 2 * i + 1 : 2 * i, 21);
        const struct result r = check(&p, samples, 900 + (uint64_t)i);
        if (r.p < level)
            printf("# wo %.3f %.3f %.3f: p %.2g, total %.6f, none %.6f\n", p.wo[0],
                   p.wo[1], p.wo[2], r.p, r.total, r.none);
        worst = fmin(worst, r.p);
        above = fmax(above, r.total - 1);
        sane &= r.sane;
        cells += r.cells;
    }
    tap_ok(worst > level,
           "%s: draws follow the density # least p %.2g of %d, %d cells, %d draws",
           c->label, worst, DIRECTIONS, cells, samples * DIRECTIONS);
    tap_ok(above < 1e-4, "%s: no more than 1 in all # %.1e above", c->label, above);
    tap_ok(sane, "%s: draws are unit vectors, finite, on an allowed side", c->label);
    if (!(c->bsdf.flags & IMP_BSDF_DELTA))
        tap_ok(cells >= 1000, "%s: the test looks closely # %d cells", c->label, cells);
}

/* The test, tested: densities that are off by little must be caught. */
static const struct imp_bsdf_ops *honest;
static double pdf_tilted(const struct imp_bsdf *b, const imp_spec *in,
                         const struct imp_dirs *d)
{
    return honest->pdf(b, in, d) * (1 + 0.3 * (d->wi[2] - 2.0 / 3));
}
static double pdf_small(const struct imp_bsdf *b, const imp_spec *in,
                        const struct imp_dirs *d)
{
    return honest->pdf(b, in, d) * 0.98;
}
static void visit_planted(const struct kind_case *c, void *payload)
{
    (void)payload;
    if (strcmp(c->label, "diffuse") != 0) return;
    struct imp_bsdf_ops ops = *c->bsdf.ops;
    struct point p = {.wo = imp__normalize(imp__v3(0.3, 0.2, 0.6))};
    struct imp_bsdf b = c->bsdf;
    honest = c->bsdf.ops;
    b.ops = &ops;
    p.b = &b;
    kind_inputs(&b, KIND_RANDOM, 1, p.in);
    ops.pdf = pdf_tilted;
    tap_ok(check(&p, 40000, 5).p < level, "a density tilted by 30 %% is caught");
    ops.pdf = pdf_small;
    tap_ok(check(&p, 40000, 6).p < level, "a density 2 %% too small is caught");
}

int main(void)
{
    struct kind_factory f;
    struct census all[64] = {{0}};
    if (!kinds_open(&f)) return 1;
    const int n = kinds_visit(&f, count_visit, all);
    level = imp__sidak(0.01, (double)n * DIRECTIONS);
    kinds_visit(&f, visit, all);
    kinds_visit(&f, visit_planted, NULL);
    kinds_close(&f);
    return tap_done();
}
