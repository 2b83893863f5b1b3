/* SPDX-License-Identifier: Apache-2.0
 *
 * Every material's sampling against its density: chi-square over directions of wi (cells
 * cut where a pilot run falls densely, expected counts by adaptive quadrature of pdf),
 * with one cell for each delta lobe and one for "no sample". A density that does not
 * integrate to what is drawn fails as surely as one of the wrong shape. Along the way:
 * what sample says about its draw is what eval and pdf say. */
#include "imp_kinds.h"
#include "imp_tap.h"
#include "math/draws.h"
#include "math/stat.h"

enum { MOST_DIRECTIONS = 24, SAMPLES_OF_A_KIND = 2200000 };
/* Of wo, for every configuration: in the long run all of them. */
static int directions = MOST_DIRECTIONS / 3;
static double level; /* of one chi-square, so that all together fail 1 % (Sidak) */

struct point {
    const struct imp_bsdf *b;
    imp_spec in[IMP_INPUTS_MAX];
    imp_v3 wo;
    struct imp_dirs lobe[IMP_DRAWS_LOBES]; /* as drawn */
    long draws;
    bool sane;
    uint64_t derivative;
};
static double density(imp_v3 wi, void *payload)
{
    const struct point *p = payload;
    const struct imp_dirs d = {p->wo, wi, IMP_SMOOTH, p->derivative};
    return p->b->ops->pdf(p->b, p->in, &d);
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

static void draw_check(struct point *p, const struct imp_dirs *d,
                       const struct kind_draw *s)
{
    bool sane = true;
    for (int c = 0; c < 3; c++) sane &= isfinite(s->f[c]) && s->f[c] >= 0;
    sane &= isfinite(s->pdf) && s->pdf > 0 && s->eta > 0 && d->lobe < IMP_DRAWS_LOBES &&
            fabs(imp__length(d->wi) - 1) < 1e-12 && d->wo[2] == p->wo[2];
    if (d->lobe == IMP_SMOOTH) sane &= (p->b->flags & IMP_BSDF_SMOOTH) != 0;
    else sane &= (p->b->flags & IMP_BSDF_DELTA) != 0;
    sane &= d->wi[2] * d->wo[2] > 0 || (p->b->flags & IMP_BSDF_TRANSMIT);
    p->sane &= sane && at_once(p, d);
}
static bool draw(void *payload, const double u[3], imp_v3 *w, int *lobe)
{
    struct point *p = payload;
    struct imp_dirs d = {p->wo, {0}, IMP_SMOOTH, p->derivative};
    struct kind_draw s;
    if (!kind_draw(p->b, p->in, u, &d, &s)) return false;
    if (p->draws++ % 16 == 0) draw_check(p, &d, &s);
    if (d.lobe >= 0 && d.lobe < IMP_DRAWS_LOBES) p->lobe[d.lobe] = d;
    *w = d.wi;
    *lobe = d.lobe;
    return true;
}
static double chance(void *payload, int lobe)
{
    const struct point *p = payload;
    return p->b->ops->pdf(p->b, p->in, &p->lobe[lobe]);
}

static struct imp__draws check(struct point *p, int samples, uint64_t seed, int depth,
                               bool narrow)
{
    static struct imp__sphere_tree tree;
    const struct imp__drawn d = {.draw = draw,
                                 .density =
                                     p->b->flags & IMP_BSDF_SMOOTH ? density : NULL,
                                 .chance = chance,
                                 .payload = p,
                                 .pilot = narrow ? 12000 : 0};
    p->sane = true;
    const struct imp__draws r = imp__draws_test(&d, samples, seed, depth, &tree);
    p->sane &= !r.overflow;
    return r;
}

/* How many configurations a kind has: they share the kind's samples, but those with clamped
 * normals have as many as those without. */
struct census {
    const char *kind;
    int n;
};
static void count_visit(const struct kind_case *c, void *payload)
{
    struct census *all = payload;
    if (strstr(c->label, " clamped")) return;
    for (int i = 0; i < 64; i++)
        if (!all[i].kind || strcmp(all[i].kind, c->kind) == 0) {
            all[i].kind = c->kind;
            all[i].n++;
            return;
        }
}

/* Glass of almost no roughness and almost no index, alone or in a mixture: 2e-5 wide. */
static bool too_narrow(const struct kind_case *c)
{
    return strstr(c->label, "principled") && c->bsdf.flags & IMP_BSDF_TRANSMIT;
}

static void visit(const struct kind_case *c, void *payload)
{
    const struct census *all = payload;
    int configurations = 1, cells = 0;
    if (directions < MOST_DIRECTIONS && kind_waits(c)) return;
    for (int i = 0; all[i].kind; i++)
        if (strcmp(all[i].kind, c->kind) == 0) configurations = all[i].n;
    const int samples = SAMPLES_OF_A_KIND / MOST_DIRECTIONS / configurations + 1;
    double worst = 1, above = 0;
    bool sane = true;
    /* Clear coats at grazing angles are sharp, whatever else is in the mixture. */
    const bool sharp = strstr(c->label, "principled") != NULL;
    const int depth = kind_steps(c) ? IMP_SPHERE_STEPS : IMP_SPHERE_SMOOTH;
    for (int i = 0; i < directions; i++) {
        struct point p = {.b = &c->bsdf, .derivative = i % 2 == 0 ? ~UINT64_C(0) : 0};
        kind_inputs(p.b,
                    i % 6 == 5                 ? KIND_WIDE
                    : i == 0 && !too_narrow(c) ? KIND_LOWEST
                                               : KIND_RANDOM,
                    500 + (uint64_t)i, p.in);
        /* Facets that one draw in a hundred finds, as narrow as 1e-3: cells follow a pilot
         * run, which does not see them. */
        for (int j = 0; j < p.b->n_in && p.b->n_child && too_narrow(c); j++)
            if (strcmp(kind_input(p.b, j)->name, "roughness") == 0)
                p.in[j] = imp__spec(fmax(p.in[j][0], 0.2));
        /* One-sided kinds have nothing below: three of four from above. */
        p.wo = kind_direction(i % 4 == 3 ? 2 * i + 1 : 2 * i, 21);
        const struct imp__draws r = check(&p, samples, 900 + (uint64_t)i, depth, sharp);
        if (r.chance < level)
            printf("# wo %.3f %.3f %.3f: p %.2g, total %.6f, none %.6f\n", p.wo[0],
                   p.wo[1], p.wo[2], r.chance, r.total, r.none);
        worst = fmin(worst, r.chance);
        above = fmax(above, r.total - 1);
        sane &= p.sane;
        cells += r.cells;
    }
    tap_ok(worst > level,
           "%s: draws follow the density # least p %.2g of %d, %d cells, %d draws",
           c->label, worst, directions, cells, samples * directions);
    tap_ok(above < 1e-4, "%s: no more than 1 in all # %.1e above", c->label, above);
    tap_ok(sane, "%s: draws are unit vectors, finite, on an allowed side", c->label);
    if (!(c->bsdf.flags & IMP_BSDF_DELTA))
        tap_ok(cells >= 42 * directions, "%s: the test looks closely # %d cells",
               c->label, cells);
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
    tap_ok(check(&p, 40000, 5, IMP_SPHERE_SMOOTH, false).chance < level,
           "a density tilted by 30 %% is caught");
    ops.pdf = pdf_small;
    tap_ok(check(&p, 40000, 6, IMP_SPHERE_SMOOTH, false).chance < level,
           "a density 2 %% too small is caught");
}

int main(int argc, char **argv)
{
    struct kind_factory f;
    struct census all[64] = {{0}};
    if (argc > 1 && strcmp(argv[1], "long") == 0) directions = MOST_DIRECTIONS;
    if (!kinds_open(&f)) return 1;
    const int n = kinds_visit(&f, count_visit, all);
    level = imp__sidak(0.01, (double)n * directions);
    kinds_visit(&f, visit, all);
    kinds_visit(&f, visit_planted, NULL);
    kinds_close(&f);
    return tap_done();
}
