/* SPDX-License-Identifier: Apache-2.0
 *
 * Inputs, directions and emissions tried at random, to find what kinds do not declare
 * (kind_trials.h). */
#include "kind_trials.h"
#include "math/rng.h"
#include "math/vec.h"
#include <string.h>

#define LINEAR 1e-10 /* relative: rounding */
#define SEEN   4     /* trials in which there was a value */

static struct imp_key key_of(uint64_t k)
{
    return (struct imp_key){0x9e3779b97f4a7c15u * (k + 1)};
}

imp_spec imp__trial_input(const struct imp_input_desc *d, uint64_t k)
{
    if (!d) return imp__spec(0.5);
    const double hi = d->hi > d->lo && isfinite(d->hi) ? d->hi : d->lo + 2;
    const double lo = isfinite(d->lo) ? d->lo : 0;
    imp_spec v = {0};
    for (int c = 0; c < 4; c++)
        v[c] = lo + (hi - lo) * (0.1 + 0.8 * imp__u01((struct imp_key){k}, (uint32_t)c));
    return d->flags & IMP_INPUT_SCALAR ? imp__spec(v[0]) : v;
}

const struct imp_input_desc *imp__trial_desc(const struct imp_bsdf *b, int j)
{
    if (j < b->n_own) {
        for (int k = 0, n = 0; b->ops->inputs && b->ops->inputs[k].name; k++)
            if (n++ == j) return &b->ops->inputs[k];
        return NULL;
    }
    for (int k = b->n_child - 1; k >= 0; k--)
        if (j >= b->child_in[k]) return imp__trial_desc(b->child[k], j - b->child_in[k]);
    return NULL;
}

bool imp__trial_derives(const struct imp_bsdf *b)
{
    if (b->ops->changed) return true;
    for (int k = 0; k < b->n_child; k++)
        if (imp__trial_derives(b->child[k])) return true;
    return false;
}

struct imp_dirs imp__trial_dirs(uint64_t k)
{
    const struct imp_key key = key_of(k);
    double z[2], phi[2];
    for (int i = 0; i < 2; i++) {
        z[i] = 1 - 2 * imp__u01(key, 100 + (uint32_t)i);
        phi[i] = 6.28 * imp__u01(key, 200 + (uint32_t)i);
    }
    if (k % 2) z[1] = copysign(z[1], z[0]); /* reflection too */
    struct imp_dirs dirs = {.lobe = IMP_SMOOTH, .derivative = UINT64_MAX};
    const double r0 = sqrt(1 - z[0] * z[0]), r1 = sqrt(1 - z[1] * z[1]);
    dirs.wo = imp__v3(r0 * cos(phi[0]), r0 * sin(phi[0]), z[0]);
    dirs.wi = k % 3 ? imp__v3(r1 * cos(phi[1]), r1 * sin(phi[1]), z[1])
                    : imp__v3(-dirs.wo[0], -dirs.wo[1], dirs.wo[2]);
    return dirs;
}

/* ---- Linear ---------------------------------------------------------------------- */

/* Inputs of trial k. Those that are free have other values where `other` is set. */
static void inputs_draw(const struct imp_input_desc *const *desc, int n,
                        const uint8_t *free, uint64_t k, bool other, imp_spec *in)
{
    for (int j = 0; j < n; j++)
        in[j] = imp__trial_input(desc[j], key_of(k).state + 64 * (uint64_t)j +
                                              (other && free[j] ? 7777 : 0));
}

static bool is_near(imp_spec a, imp_spec b, int channels)
{
    for (int c = 0; c < channels; c++)
        if (!(fabs(a[c] - b[c]) <= LINEAR * (fabs(a[c]) + fabs(b[c])))) return false;
    return true;
}

/* A value and its derivatives at two sets of inputs: is it their product, and are they the
 * same? */
struct trial {
    imp_spec in[2][IMP_INPUTS_MAX], d[2][IMP_INPUTS_MAX], value[2];
};
static bool is_linear(const struct trial *t, int n, const uint8_t *free, int channels,
                      int *seen)
{
    bool any = false;
    for (int i = 0; i < 2; i++) {
        imp_spec sum = {0};
        for (int j = 0; j < n; j++) {
            if (!free[j]) continue;
            sum += t->in[i][j] * t->d[i][j];
            if (!is_near(t->d[0][j], t->d[1][j], channels)) return false;
        }
        if (!is_near(sum, t->value[i], channels)) return false;
        for (int c = 0; c < channels; c++) any |= sum[c] != 0;
    }
    *seen += any;
    return true;
}

bool imp__trial_bsdf_linear(const struct imp_bsdf *b, const uint8_t *free, int channels)
{
    const struct imp_input_desc *desc[IMP_INPUTS_MAX];
    struct trial t;
    int seen = 0, ignored = 0;
    if (imp__trial_derives(b) || b->shaped) return false;
    for (int j = 0; j < b->n_in; j++) {
        desc[j] = imp__trial_desc(b, j);
        if (free[j] && !desc[j]) return false;
    }
    for (uint64_t k = 0; k < IMP_TRIALS; k++) {
        struct imp_dirs dirs = imp__trial_dirs(k);
        for (int i = 0; i < 2; i++) inputs_draw(desc, b->n_in, free, k, i == 1, t.in[i]);
        for (int lobe = IMP_SMOOTH; lobe < imp__trial_lobes(b); lobe++) {
            dirs.lobe = lobe;
            for (int i = 0; i < 2; i++) {
                b->ops->eval(b, t.in[i], &dirs, &t.value[i]);
                b->ops->eval_d(b, t.in[i], &dirs, t.d[i]);
            }
            if (!is_linear(&t, b->n_in, free, channels, &seen)) return false;
        }
        for (int i = 0; i < 2 && b->ops->emit; i++) {
            b->ops->emit(b, t.in[i], &dirs.wo, &t.value[i]);
            b->ops->emit_d(b, t.in[i], &dirs.wo, t.d[i]);
        }
        if (b->ops->emit && !is_linear(&t, b->n_in, free, channels, &ignored))
            return false;
    }
    return seen >= SEEN;
}

void imp__trial_first_degree(const struct imp_bsdf *b, int channels, uint8_t *of)
{
    const struct imp_input_desc *desc[IMP_INPUTS_MAX];
    struct trial t;
    int seen = 0;
    memset(of, 0, (size_t)b->n_in);
    if (imp__trial_derives(b) || b->shaped) return;
    for (int j = 0; j < b->n_in; j++) {
        desc[j] = imp__trial_desc(b, j);
        of[j] = desc[j] && desc[j]->role == IMP_REFLECTANCE &&
                !(desc[j]->flags & IMP_INPUT_SCALAR);
    }
    for (uint64_t k = 0; k < IMP_TRIALS; k++) {
        struct imp_dirs dirs = imp__trial_dirs(k);
        inputs_draw(desc, b->n_in, of, k, false, t.in[0]);
        for (int lobe = IMP_SMOOTH; lobe < imp__trial_lobes(b); lobe++) {
            imp_spec sum = {0};
            dirs.lobe = lobe;
            b->ops->eval(b, t.in[0], &dirs, &t.value[0]);
            b->ops->eval_d(b, t.in[0], &dirs, t.d[0]);
            for (int j = 0; j < b->n_in; j++)
                if (of[j]) sum += t.in[0][j] * t.d[0][j];
            if (!is_near(sum, t.value[0], channels)) goto none;
            seen += t.value[0][0] != 0;
        }
    }
    if (seen >= SEEN) return;
none:
    memset(of, 0, (size_t)b->n_in);
}

bool imp__trial_emitter_linear(const struct imp_emitter *e, const uint8_t *free,
                               int channels)
{
    const struct imp_input_desc *desc[IMP_INPUTS_MAX];
    struct trial t;
    int seen = 0, n = 0;
    if (e->ops->place_d || e->ops->changed || e->shaped) return false;
    for (int k = 0; e->ops->inputs && e->ops->inputs[k].name && n < e->n_in; k++)
        desc[n++] = &e->ops->inputs[k];
    if (n < e->n_in) return false;
    for (uint64_t k = 0; k < 4 * IMP_TRIALS; k++) {
        const struct imp_dirs dirs = imp__trial_dirs(k);
        const struct imp_emission x = {.uv = {imp__u01(key_of(k), 300), 0.5},
                                       .dist = 0.5 + imp__u01(key_of(k), 301),
                                       .cos_light = dirs.wo[2],
                                       .d = dirs.wo};
        for (int i = 0; i < 2; i++) {
            inputs_draw(desc, n, free, k, i == 1, t.in[i]);
            e->ops->eval(e, t.in[i], &x, &t.value[i]);
            e->ops->eval_d(e, t.in[i], &x, t.d[i]);
        }
        if (!is_linear(&t, n, free, channels, &seen)) return false;
    }
    return seen > 0;
}
