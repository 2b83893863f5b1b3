/* SPDX-License-Identifier: Apache-2.0
 *
 * eval_d and emit_d of every material against central differences of eval and emit, at
 * random inputs and at inputs that are exactly 0 (one-sided there); a density wherever
 * there is a derivative; sample_d against differences at fixed random numbers; and the
 * checker itself against planted mistakes. */
#include "imp_kinds.h"
#include "imp_tap.h"
#include "inverse/check/selftest.h"
#include "kind/bsdf/fresnel.h"

enum { TRIALS = 60 };

static void emit_value(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d, imp_spec *f)
{
    b->ops->emit(b, in, &d->wo, f);
}
static void eval_value(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d, imp_spec *f)
{
    b->ops->eval(b, in, d, f);
}

struct tally {
    double value, emission; /* largest relative errors */
    long points, nonzero, no_density, numbers, kinks;
    bool lanes_mixed;
};

static double point_error(const struct imp_bsdf *b, imp_spec *in,
                          const struct imp_dirs *d, imp__bsdf_value *value,
                          const imp_spec *df, struct tally *t)
{
    struct imp__derivative_tally own = {0};
    const double worst = imp__bsdf_derivative_error(b, in, d, value, df, 3, &own);
    t->numbers += own.numbers;
    t->kinks += own.kinks;
    t->lanes_mixed |= own.lanes_mixed;
    return worst;
}

static struct tally check_case(const struct imp_bsdf *b, enum kind_set set)
{
    struct tally t = {0};
    imp_spec in[IMP_INPUTS_MAX], df[IMP_INPUTS_MAX];
    for (int i = 0; i < TRIALS; i++) {
        kind_inputs(b, set, 1000 + (uint64_t)i, in);
        struct imp_dirs d = {kind_direction(i, 5), {0}, IMP_SMOOTH, ~UINT64_C(0)};
        struct kind_draw s;
        const struct imp_key key = imp__key(9, (uint64_t)i, 0);
        const double u[3] = {imp__u01(key, 0), imp__u01(key, 1), imp__u01(key, 2)};
        /* Directions that are drawn (every delta lobe is met), and any. */
        if (i % 3 == 0) d.wi = kind_direction(i / 3 + (i % 2), 6);
        else if (!kind_draw(b, in, u, &d, &s)) continue;
        b->ops->eval_d(b, in, &d, df);
        t.value = fmax(t.value, point_error(b, in, &d, eval_value, df, &t));
        t.points++;
        double size = 0;
        for (int j = 0; j < b->n_in; j++) size = fmax(size, imp__max3(df[j] * df[j]));
        if (size > 0) t.nonzero++;
        if (size > 1e-200 && !(b->ops->pdf(b, in, &d) > 0)) t.no_density++;
        if (b->flags & IMP_BSDF_EMIT) {
            b->ops->emit_d(b, in, &d.wo, df);
            t.emission = fmax(t.emission, point_error(b, in, &d, emit_value, df, &t));
        }
    }
    return t;
}

static void visit(const struct kind_case *c, void *payload)
{
    static const char *const names[] = {"fallback", "random", "wide", "lowest"};
    const struct imp_bsdf *b = &c->bsdf;
    bool has_derivative = false;
    for (int j = 0; j < b->n_in; j++) has_derivative |= !imp__bsdf_input_fixed(b, j);
    (void)payload;
    for (int set = 0; set <= KIND_LOWEST; set++) {
        const struct tally t = check_case(b, (enum kind_set)set);
        /* Equal indices: `specular` 0 has, beside its slope, a term of power 3/2. */
        const int most = set == KIND_LOWEST && strstr(c->label, "principled") ? 12 : 50;
        /* Facets of the least roughness, 1e-3, that turn: differences see the rounding of
         * half-vectors. */
        const double limit =
            set == KIND_LOWEST && strstr(c->label, "clamped") ? 1e-3 : 1e-6;
        tap_ok(t.value < limit && t.emission < 1e-6 && t.kinks * most <= t.numbers,
               "%s: derivatives, %s inputs # %.1e %.1e, %ld of %ld at kinks", c->label,
               names[set], t.value, t.emission, t.kinks, t.numbers);
        tap_ok(!t.lanes_mixed, "%s: lanes stay apart, %s inputs", c->label, names[set]);
        tap_ok(t.no_density == 0 && (t.nonzero > t.points / 8 || !has_derivative),
               "%s: a density wherever a derivative is, %s # %ld of %ld points", c->label,
               names[set], t.nonzero, t.points);
    }
    tap_ok((b->ops->emit != NULL) == (b->ops->emit_d != NULL), "%s: emit and emit_d",
           c->label);
}

/* ---- Directions ---------------------------------------------------------------- */

/* The value where the directions have turned by h along the tangents. */
static imp_spec turned_value(const struct imp_bsdf *b, const imp_spec *in,
                             const struct imp_dirs *d, const imp_v3 tangent[2], double h)
{
    const struct imp_dirs e = {imp__normalize(d->wo + tangent[0] * h),
                               imp__normalize(d->wi + tangent[1] * h), IMP_SMOOTH, 0};
    imp_spec f;
    b->ops->eval(b, in, &e, &f);
    return f;
}
/* Fourth-order differences with step h. */
static imp_spec turned_difference(const struct imp_bsdf *b, const imp_spec *in,
                                  const struct imp_dirs *d, const imp_v3 tangent[2],
                                  double h)
{
    const imp_spec near = turned_value(b, in, d, tangent, h) -
                          turned_value(b, in, d, tangent, -h),
                   far = turned_value(b, in, d, tangent, 2 * h) -
                         turned_value(b, in, d, tangent, -2 * h);
    return (near * 8.0 - far) * (1 / (12 * h));
}

static struct tally directions_check(const struct imp_bsdf *b, enum kind_set set)
{
    struct tally t = {0};
    imp_spec in[IMP_INPUTS_MAX];
    for (int i = 0; i < 3 * TRIALS; i++) {
        kind_inputs(b, set, 1000 + (uint64_t)i, in);
        struct imp_dirs d = {kind_direction(i, 5), {0}, IMP_SMOOTH, 0};
        struct kind_draw s;
        const struct imp_key key = imp__key(19, (uint64_t)i, 0);
        const double u[3] = {imp__u01(key, 0), imp__u01(key, 1), imp__u01(key, 2)};
        if (i % 3 == 0) d.wi = kind_direction(i / 3 + (i % 2), 6);
        else if (!kind_draw(b, in, u, &d, &s) || d.lobe != IMP_SMOOTH) continue;
        imp_spec d_wo[3], d_wi[3], f;
        b->ops->eval(b, in, &d, &f);
        b->ops->eval_directions_d(b, in, &d, d_wo, d_wi);
        for (int k = 0; k < 4; k++) { /* wo and wi by turns, each in two directions */
            imp_v3 tangent[2] = {{0}, {0}};
            const imp_v3 w = k % 2 ? d.wi : d.wo, r = kind_direction(4 * i + k, 7);
            tangent[k % 2] = imp__normalize(r - w * imp__dot(r, w));
            imp_spec mine = {0};
            for (int j = 0; j < 3; j++)
                mine += d_wo[j] * tangent[0][j] + d_wi[j] * tangent[1][j];
            const imp_spec fd = turned_difference(b, in, &d, tangent, 2e-5),
                           finer = turned_difference(b, in, &d, tangent, 5e-6);
            bool any = false;
            for (int c = 0; c < 3; c++) {
                const double e = fabs(finer[c] - mine[c]);
                const double scale = fabs(mine[c]) + 1e-3 * fabs(f[c]);
                any |= mine[c] != 0;
                t.numbers++;
                if (e <= 1e-280) continue;
                if (e > 1e-6 * scale && fabs(fd[c] - finer[c]) > 0.2 * e) t.kinks++;
                else t.value = fmax(t.value, isfinite(e) ? e / scale : INFINITY);
            }
            t.points++;
            t.nonzero += any;
        }
    }
    return t;
}

static void visit_directions(const struct kind_case *c, void *payload)
{
    static const char *const names[] = {"fallback", "random", "wide"};
    int *offered = payload;
    if (imp__bsdf_without_directions_d(&c->bsdf)) return;
    ++*offered;
    for (int set = 0; set <= KIND_WIDE; set++) {
        const struct tally t = directions_check(&c->bsdf, (enum kind_set)set);
        tap_ok(
            t.value < 1e-6 && t.kinks * 10 <= t.numbers && t.nonzero > t.points / 8,
            "%s: derivatives by directions, %s inputs # %.1e, %ld of %ld at kinks, %ld "
            "of %ld not 0",
            c->label, names[set], t.value, t.kinks, t.numbers, t.nonzero, t.points);
    }
}

/* ---- sample_d ------------------------------------------------------------------ */

static bool weight_at(const struct imp_bsdf *b, imp_spec *in, int j, double x,
                      const double u[3], imp_v3 wo, imp_spec *w, imp_v3 *wi)
{
    struct imp_dirs d = {wo, {0}, IMP_SMOOTH, 0};
    struct kind_draw s;
    const imp_spec old = in[j];
    in[j] = imp__spec(x);
    const bool ok = kind_draw(b, in, u, &d, &s);
    in[j] = old;
    *w = s.f / s.pdf;
    *wi = d.wi;
    return ok;
}

static void visit_attached(const struct kind_case *c, void *payload)
{
    const struct imp_bsdf *b = &c->bsdf;
    int *offered = payload;
    imp_spec in[IMP_INPUTS_MAX];
    double worst = 0;
    int n = 0;
    if (!b->ops->sample_d) return;
    for (int i = 0; i < 300; i++) {
        kind_inputs(b, KIND_RANDOM, 40 + (uint64_t)i, in);
        const struct imp_key key = imp__key(11, (uint64_t)i, 0);
        const double u[3] = {imp__u01(key, 0), imp__u01(key, 1), imp__u01(key, 2)};
        struct imp_dirs d = {kind_direction(i, 12), {0}, IMP_SMOOTH, 0};
        struct kind_draw s;
        if (!kind_draw(b, in, u, &d, &s)) continue;
        for (int j = 0; j < b->n_in; j++) {
            imp_spec dw, wp, wm;
            imp_v3 dwi, ip, im;
            if (!b->ops->sample_d(b, in, u, &d, j, &dw, &dwi)) continue;
            const double x = in[j][0], h = 1e-5 * x;
            if (!weight_at(b, in, j, x + h, u, d.wo, &wp, &ip) ||
                !weight_at(b, in, j, x - h, u, d.wo, &wm, &im))
                continue;
            /* The kink of min(1, cos_i/cos_o) is not differentiable: step over it. */
            if ((ip[2] < fabs(d.wo[2])) != (im[2] < fabs(d.wo[2]))) continue;
            n++;
            const imp_spec fw = (wp - wm) / (2 * h) - dw;
            const imp_v3 fi = (ip - im) / (2 * h) - dwi;
            for (int k = 0; k < 3; k++) {
                worst =
                    fmax(worst, fabs(fw[k]) / (fabs(dw[k]) + 1e-2 * (wp[k] + 1e-3) / x));
                worst = fmax(worst, fabs(fi[k]) / (imp__length(dwi) + 1e-2 / x));
            }
        }
    }
    *offered += n > 0;
    if (n)
        tap_ok(worst < 1e-6, "%s: attached derivative, %d draws # %.1e", c->label, n,
               worst);
}

/* ---- The checker, checked ------------------------------------------------------ */

static const struct imp_bsdf_ops *honest;
static int mistake;
static void planted(const struct imp_bsdf *b, const imp_spec *in,
                    const struct imp_dirs *d, imp_spec *df)
{
    honest->eval_d(b, in, d, df);
    const imp_spec first = df[0];
    switch (mistake) {
    case 0: df[0] = -df[0]; break;      /* sign */
    case 1: df[0] = df[0] * 2.0; break; /* factor */
    case 2:
        df[0] = df[b->n_in - 1];
        df[b->n_in - 1] = first;
        break;                                                          /* index */
    case 3: df[b->n_in - 1] = df[b->n_in - 1] * (1 + 1e-5); break;      /* small */
    case 4: df[0] = (imp_spec){first[1], first[0], first[2], 0}; break; /* lanes */
    }
}
static void visit_planted(const struct kind_case *c, void *payload)
{
    static const char *const names[] = {"sign", "factor 2", "another index", "1e-5 off",
                                        "lanes swapped"};
    (void)payload;
    if (strcmp(c->label, "stam_m2 variant=reciprocal sampling=cosine absorb=0.3") != 0 &&
        strcmp(c->label, "roughconductor distribution=ggx alpha_u=0.4 alpha_v=0.1") != 0)
        return;
    struct imp_bsdf_ops ops = *c->bsdf.ops;
    struct imp_bsdf b = c->bsdf;
    const bool m2 = strcmp(c->kind, "stam_m2") == 0;
    honest = c->bsdf.ops;
    ops.eval_d = planted;
    b.ops = &ops;
    for (mistake = 0; mistake < 5; mistake++) {
        if (m2 && (mistake < 2 || mistake == 4))
            continue; /* input 0 is emission: eval_d 0 */
        const struct tally t = check_case(&b, KIND_RANDOM);
        tap_ok(t.value > 1e-6, "%s: a planted mistake (%s) is caught # %.1e", c->kind,
               names[mistake], t.value);
    }
}

/* A child whose inputs are not the first. */
static void attached_behind(struct kind_factory *f, int *attached)
{
    struct kind_case c = {.label = "twosided(diffuse, stam_m2)", .kind = "twosided"};
    const struct imp_bsdf_ops *ops[3] = {NULL};
    static const char *const names[] = {"diffuse", "stam_m2", "twosided"};
    for (int k = 0; imp__bsdf_kinds[k]; k++)
        for (int i = 0; i < 3; i++)
            if (strcmp(imp__bsdf_kinds[k]->name, names[i]) == 0)
                ops[i] = imp__bsdf_kinds[k];
    const int before = *attached;
    if (kind_make(f, ops[0], NULL, 0, NULL, 0, &c.child[0]) &&
        kind_make(f, ops[1], NULL, 0, NULL, 0, &c.child[1]) &&
        kind_make(f, ops[2], NULL, 0, c.child, 2, &c.bsdf))
        visit_attached(&c, attached);
    tap_ok(*attached == before + 1, "%s offers it from behind", c.label);
}

/* dF/dc and dF/de of a boundary from both sides, off the critical angle. */
static void fresnel_slopes(void)
{
    double worst = 0;
    for (int i = 0; i < 200; i++) {
        const struct imp_key key = imp__key(13, (uint64_t)i, 0);
        const double c = 0.05 + 0.9 * imp__u01(key, 0), e = 0.5 + 1.5 * imp__u01(key, 1);
        const double h = 1e-6;
        double dc, de, unused[2];
        if (1 - (1 - c * c) / (e * e) < 0.05) continue;
        const double F = imp__fresnel_dielectric_d(c, e, &dc, &de);
        const double by_c =
            (imp__fresnel_dielectric_d(c + h, e, &unused[0], &unused[1]) -
             imp__fresnel_dielectric_d(c - h, e, &unused[0], &unused[1])) /
            (2 * h);
        const double by_e =
            (imp__fresnel_dielectric_d(c, e + h, &unused[0], &unused[1]) -
             imp__fresnel_dielectric_d(c, e - h, &unused[0], &unused[1])) /
            (2 * h);
        worst =
            fmax(worst, fabs(F - imp__fresnel_dielectric(c, e, &unused[0], &unused[1])));
        worst = fmax(worst, fabs(dc - by_c) / (1 + fabs(dc)));
        worst = fmax(worst, fabs(de - by_e) / (1 + fabs(de)));
    }
    tap_ok(worst < 1e-8, "Fresnel by cosine and by index # %.1e", worst);
}

/* A texture may hold less than the smallest roughness: the value is that of the smallest,
 * and its derivative 0. */
static void smallest_roughness(struct kind_factory *f)
{
    const char *props[] = {"alpha=0.3"};
    struct imp_bsdf b;
    imp_spec in[6], at[2], d[6];
    for (int k = 0; imp__bsdf_kinds[k]; k++)
        if (strcmp(imp__bsdf_kinds[k]->name, "roughconductor") == 0)
            kind_make(f, imp__bsdf_kinds[k], props, 1, NULL, 0, &b);
    const struct imp_dirs dirs = {imp__v3(0.6, 0, 0.8), imp__v3(-0.6, 0, 0.8), IMP_SMOOTH,
                                  false};
    kind_inputs(&b, KIND_FALLBACK, 1, in);
    for (int k = 0; k < 2; k++) {
        in[3] = imp__spec(k ? 1e-4 : 1e-6);
        b.ops->eval(&b, in, &dirs, &at[k]);
        b.ops->eval_d(&b, in, &dirs, d);
        tap_ok((d[3][0] != 0) == (k == 1), "roughness %g has a derivative: %s", in[3][0],
               k ? "yes" : "no");
    }
    tap_ok(at[0][0] == at[1][0] && at[0][0] > 0, "and is the smallest # %g", at[0][0]);
}

int main(void)
{
    struct kind_factory f;
    int attached = 0;
    if (!kinds_open(&f)) return 1;
    const int n = kinds_visit(&f, visit, NULL);
    tap_ok(n > 20, "%d materials were visited", n);
    kinds_visit(&f, visit_attached, &attached);
    tap_ok(attached > 0, "sample_d is offered by %d", attached);
    attached_behind(&f, &attached);
    int turned = 0;
    kinds_visit(&f, visit_directions, &turned);
    tap_ok(turned > 10, "eval_directions_d is offered by %d", turned);
    fresnel_slopes();
    smallest_roughness(&f);
    kinds_visit(&f, visit_planted, NULL);
    kinds_close(&f);
    return tap_done();
}
