/* SPDX-License-Identifier: Apache-2.0
 *
 * Materials with the inputs that they have in the scene, at random places of their
 * textures and for random directions of sight. */
#include "math/warp.h"
#include "scene/in_medium.h"
#include "selftest.h"

struct point {
    const struct imp_bsdf *b;
    imp_spec in[IMP_INPUTS_MAX];
    imp_v3 wo;
    int lane;
    struct imp_dirs lobe[IMP_DRAWS_LOBES];
};

static double index_ratio(const struct point *p, const struct imp_dirs *d)
{
    return p->b->ops->index_ratio ? p->b->ops->index_ratio(p->b, p->in, d) : 1;
}

/* Power that leaves for light of power 1: radiance that passes a refraction is divided by
 * the squared index ratio. */
static double power(const struct point *p, const struct imp_dirs *d, int lane)
{
    imp_spec f;
    p->b->ops->eval(p->b, p->in, d, &f);
    return f[lane] * imp__sqr(index_ratio(p, d));
}
static double power_towards(imp_v3 wi, void *payload)
{
    const struct point *p = payload;
    return power(p, &(struct imp_dirs){p->wo, wi, IMP_SMOOTH, 0}, p->lane);
}

static double density(imp_v3 wi, void *payload)
{
    const struct point *p = payload;
    const struct imp_dirs d = {p->wo, wi, IMP_SMOOTH, 0};
    return p->b->ops->pdf(p->b, p->in, &d);
}
static bool draw(void *payload, const double u[3], imp_v3 *w, int *lobe)
{
    struct point *p = payload;
    struct imp_dirs d = {p->wo, {0}, IMP_SMOOTH, 0};
    if (!p->b->ops->sample(p->b, p->in, u, &d)) return false;
    if (d.lobe >= 0 && d.lobe < IMP_DRAWS_LOBES) p->lobe[d.lobe] = d;
    *w = d.wi;
    *lobe = d.lobe;
    return p->b->ops->pdf(p->b, p->in, &d) > 0;
}
static double chance(void *payload, int lobe)
{
    const struct point *p = payload;
    return p->b->ops->pdf(p->b, p->in, &p->lobe[lobe]);
}

static void place(const struct imp__selftest *t, const struct imp_bsdf *b, int i,
                  struct point *p)
{
    const struct imp_key key = imp__key(t->options.seed, 11, (uint64_t)i);
    const struct imp_texcoord at = {.uv = {imp__u01(key, 0), imp__u01(key, 1)}};
    p->b = b;
    p->wo = imp__selftest_direction(i % 4 == 3 ? 2 * i + 1 : 2 * i, t->options.seed);
    imp__inputs_eval(b->input, b->n_in, &at, p->in);
    for (int j = 0; j < b->n_in && t->scene->mode == IMP_MONO; j++)
        for (int c = 1; c < 3; c++) p->in[j][c] = p->in[j][0];
}

/* ---- Answers for any direction --------------------------------------------------- */

struct answers {
    double n, bad, uncovered, mirrored; /* the last: worst relative difference */
    double error, emission;             /* of derivatives */
    struct imp__derivative_tally tally;
};

static void eval_value(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d, imp_spec *f)
{
    b->ops->eval(b, in, d, f);
}
static void emit_value(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d, imp_spec *f)
{
    b->ops->emit(b, in, &d->wo, f);
}

/* Any direction: uniform ones, and those where formulas divide by 0. */
static imp_v3 any_direction(const struct point *p, int k, struct imp_key key)
{
    switch (k) {
    case 0: return p->wo;
    case 1: return -p->wo;
    case 2: return imp__v3(-p->wo[0], -p->wo[1], p->wo[2]); /* the mirror */
    case 3: return imp__v3(0, 0, 1);
    case 4: return imp__v3(0, 0, -1);
    case 5: return imp__v3(1, 0, 0);
    case 6: return imp__v3(0.6, -0.8, 0);
    }
    return imp__uniform_sphere((double[2]){imp__u01(key, 0), imp__u01(key, 1)});
}

static void smooth_answer(const struct imp__selftest *t, struct point *p,
                          struct imp_dirs d, struct answers *a)
{
    const struct imp_bsdf *b = p->b;
    imp_spec f, df[IMP_INPUTS_MAX];
    bool needs = false, sane = true;
    b->ops->eval(b, p->in, &d, &f);
    b->ops->eval_d(b, p->in, &d, df);
    const double density = b->ops->pdf(b, p->in, &d);
    for (int c = 0; c < t->scene->channels; c++) {
        sane &= isfinite(f[c]) && f[c] >= 0;
        needs |= f[c] > 0;
        for (int j = 0; j < b->n_in; j++) {
            sane &= isfinite(df[j][c]);
            needs |= fabs(df[j][c]) > 1e-200;
        }
    }
    sane &= isfinite(density) && density >= 0;
    a->n++;
    a->bad += !sane;
    a->uncovered += sane && needs && !(density > 0);
    if (!sane || fabs(d.wi[2]) < 1e-3 || fabs(d.wo[2]) < 1e-3) return;

    /* Radiance over n^2 is the same with the directions exchanged. */
    imp_spec g;
    const struct imp_dirs e = {d.wi, d.wo, IMP_SMOOTH, 0};
    b->ops->eval(b, p->in, &e, &g);
    const bool cosine = !imp__is_in_medium(b); /* is in the value */
    for (int c = 0; c < t->scene->channels; c++) {
        const double x = f[c] / (cosine ? fabs(d.wi[2]) : 1) * index_ratio(p, &d),
                     y = g[c] / (cosine ? fabs(d.wo[2]) : 1) * index_ratio(p, &e);
        a->mirrored = fmax(a->mirrored, fabs(x - y) / (fmax(x, y) + 1e-3));
    }
    a->error = fmax(a->error, imp__bsdf_derivative_error(b, p->in, &d, eval_value, df,
                                                         t->scene->channels, &a->tally));
}

static void answers_take(const struct imp__selftest *t, struct point *p, int i,
                         struct answers *a)
{
    const struct imp_bsdf *b = p->b;
    imp_spec df[IMP_INPUTS_MAX];
    for (int k = 0; k < 200 && b->flags & IMP_BSDF_SMOOTH; k++) {
        const struct imp_key key =
            imp__key(t->options.seed, 100 + (uint64_t)i, (uint64_t)k);
        struct imp_dirs d = {p->wo, any_direction(p, k, key), IMP_SMOOTH, 0};
        smooth_answer(t, p, d, a);
        if (k < 7) { /* seen from the horizon and the normal, too */
            d.wo = any_direction(p, k, key);
            d.wi = imp__selftest_direction(k, t->options.seed + 3);
            smooth_answer(t, p, d, a);
        }
    }
    for (int k = 0; k < 50; k++) { /* what is drawn */
        const struct imp_key key =
            imp__key(t->options.seed, 200 + (uint64_t)i, (uint64_t)k);
        const double u[3] = {imp__u01(key, 0), imp__u01(key, 1), imp__u01(key, 2)};
        struct imp_dirs d = {p->wo, {0}, IMP_SMOOTH, 0};
        if (!b->ops->sample(b, p->in, u, &d)) continue;
        if (d.lobe < 0) {
            a->n++;
            a->bad += !(fabs(imp__length(d.wi) - 1) < 1e-9);
            smooth_answer(t, p, d, a);
            continue;
        }
        b->ops->eval_d(b, p->in, &d, df);
        a->error =
            fmax(a->error, imp__bsdf_derivative_error(b, p->in, &d, eval_value, df,
                                                      t->scene->channels, &a->tally));
    }
    if (!(b->flags & IMP_BSDF_EMIT)) return;
    const struct imp_dirs d = {p->wo, p->wo, IMP_SMOOTH, 0};
    b->ops->emit_d(b, p->in, &p->wo, df);
    a->emission =
        fmax(a->emission, imp__bsdf_derivative_error(b, p->in, &d, emit_value, df,
                                                     t->scene->channels, &a->tally));
}

/* ---- Draws ----------------------------------------------------------------------- */

struct drawn {
    struct imp__chances chances;
    double seen;               /* by the chi-squares together */
    struct imp__scores total;  /* density and missing draws: 1 */
    struct imp__scores albedo; /* by draws against quadrature */
    double most, most_se;      /* albedo: power that leaves */
};

/* Albedo by draws, smooth lobes and all. */
static void albedo_take(struct imp__selftest *t, struct point *p, int i, int n,
                        struct drawn *r)
{
    struct imp__mean smooth[3] = {{0}}, all[3] = {{0}};
    for (int k = 0; k < n; k++) {
        if (k % 1000 == 0 && imp__selftest_stopped(t)) return;
        const struct imp_key key =
            imp__key(t->options.seed, 300 + (uint64_t)i, (uint64_t)k);
        const double u[3] = {imp__u01(key, 0), imp__u01(key, 1), imp__u01(key, 2)};
        struct imp_dirs d = {p->wo, {0}, IMP_SMOOTH, 0};
        const bool ok = p->b->ops->sample(p->b, p->in, u, &d);
        const double pdf = ok ? p->b->ops->pdf(p->b, p->in, &d) : 0;
        for (int c = 0; c < t->scene->channels; c++) {
            const double x = pdf > 0 ? power(p, &d, c) / pdf : 0;
            imp__mean_add(&all[c], x);
            imp__mean_add(&smooth[c], d.lobe < 0 ? x : 0);
        }
    }
    for (int c = 0; c < t->scene->channels; c++) {
        const double se = sqrt(imp__mean_variance(&all[c]));
        if (all[c].mean - 4.5 * se > r->most - 4.5 * r->most_se)
            r->most = all[c].mean, r->most_se = se;
    }
    if (!(p->b->flags & IMP_BSDF_SMOOTH)) return;
    double exact = 0;
    p->lane = t->scene->channels - 1;
    for (int k = 0; k < t->tree->n; k++)
        if (!t->tree->cell[k].child)
            exact += imp__sphere_cell_integral(&t->tree->cell[k], power_towards, p, 1e-6,
                                               IMP_SPHERE_STEPS);
    const struct imp__mean *s = &smooth[p->lane];
    imp__scores_add(&r->albedo, s->mean, exact,
                    hypot(sqrt(imp__mean_variance(s)), 1e-3 * exact + 1e-9));
}

/* Draws for the directions of sight, n for each. The albedo is integrated over the cells that
 * the draws of the same direction were counted in. */
static void draws_take(struct imp__selftest *t, const struct imp_bsdf *b, int n,
                       struct drawn *r)
{
    *r = (struct drawn){.chances = IMP_CHANCES_INIT, .most = -1};
    for (int i = 0; i < t->options.directions; i++) {
        struct point p = {.lane = 0};
        place(t, b, i, &p);
        const struct imp__drawn d = {draw,   b->flags & IMP_BSDF_SMOOTH ? density : NULL,
                                     chance, &p,
                                     0,      imp__selftest_watch,
                                     t};
        const struct imp__draws test = imp__draws_test(
            &d, n, t->options.seed + 900 + (uint64_t)i, IMP_SPHERE_STEPS, t->tree);
        imp__chances_add(&r->chances, &test, n);
        imp__scores_add(&r->total, test.total + test.none, 1,
                        sqrt(fmax(test.none * (1 - test.none), 0) / n) + 1e-3);
        albedo_take(t, &p, i, n, r);
    }
    r->seen = imp__chances_end(&r->chances, t->level);
    imp__scores_end(&r->total);
    imp__scores_end(&r->albedo);
}

enum imp_status imp__selftest_bsdf(struct imp__selftest *t, const struct imp_bsdf *b,
                                   const char *name, const char *kind)
{
    enum imp_status st = IMP_OK;
    struct answers a = {0};
    struct drawn r = {0};
    const int n = t->options.samples / t->options.directions + 1;
    for (int i = 0; i < t->options.directions; i++) {
        struct point p = {.lane = 0};
        place(t, b, i, &p);
        answers_take(t, &p, i, &a);
    }
    IMP_TRY(imp__selftest_count(t, name, kind, "finite", a.bad, a.n));
    if (a.bad > 0 || !(b->flags & (IMP_BSDF_SMOOTH | IMP_BSDF_DELTA))) return IMP_OK;
    for (int m = n; m > 0;
         m = imp__selftest_more(t, m, fmax(r.seen, fmax(r.total.sees, r.albedo.sees))))
        draws_take(t, b, m, &r);
    if (b->flags & IMP_BSDF_SMOOTH)
        IMP_TRY(imp__selftest_count(t, name, kind, "covers", a.uncovered, a.n));
    IMP_TRY(imp__selftest_z(t, name, kind, "normalised", &r.total));
    IMP_TRY(imp__selftest_draws(t, name, kind, r.chances.least, r.seen));
    if (b->flags & IMP_BSDF_SMOOTH)
        IMP_TRY(imp__selftest_z(t, name, kind, "albedo", &r.albedo));
    IMP_TRY(imp__selftest_row(
        t, &(struct imp_selftest_row){.object = name,
                                      .kind = kind,
                                      .contract = "energy",
                                      .value = r.most,
                                      .reference = 1,
                                      .se = r.most_se,
                                      .error = fmax(0, r.most - 4.5 * r.most_se - 1),
                                      .limit = 2e-4,
                                      .chance = -1}));
    if (b->flags & IMP_BSDF_SMOOTH)
        IMP_TRY(imp__selftest_row(
            t, &(struct imp_selftest_row){.object = name,
                                          .kind = kind,
                                          .contract = "reciprocal",
                                          .value = a.mirrored,
                                          .error = a.mirrored,
                                          .limit = 1e-6,
                                          .chance = -1,
                                          .ok = a.mirrored > 1e-6 ? -1 : 1}));
    IMP_TRY(imp__selftest_row(
        t, &(struct imp_selftest_row){
               .object = name,
               .kind = kind,
               .contract = "derivative",
               .value = fmax(a.error, a.emission),
               .error = a.tally.lanes_mixed ? INFINITY : fmax(a.error, a.emission),
               .limit = 1e-6,
               .chance = -1}));
out:
    return st;
}

enum imp_status imp__selftest_materials(struct imp__selftest *t)
{
    enum imp_status st = IMP_OK;
    t->level = imp__sidak(0.01, (1.0 + t->options.directions) * t->scene->n_bsdfs);
    for (int k = 0; k < t->scene->n_bsdfs; k++) {
        t->part = (double)k / t->scene->n_bsdfs;
        const struct imp_bsdf *b = t->scene->bsdfs[k];
        if (imp__is_in_medium(b)) continue; /* phase functions have tests of their own */
        IMP_TRY(imp__selftest_bsdf(t, b, b->name, b->ops->name));
    }
out:
    return st;
}
