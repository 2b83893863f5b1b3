/* SPDX-License-Identifier: Apache-2.0
 *
 * Spectra of RGB texels: lifted when texels change, on all threads, each colour once where
 * it is met again, or by the first walk that looks one up; value, reverse and forward
 * derivatives of their interpolation at a wavelength.
 *
 * What a texel is lifted to depends on its colour alone, so it does not count when that is
 * done, nor by whom. */
#include "lifted_texels.h"
#include "base/context.h"
#include "base/pool.h"
#include "color/rgb_basis.h"
#include "math/vec.h"
#include <stdatomic.h>
#include <string.h>

/* A texel that was made from the same colour, by a hash of it: pictures have far fewer
 * colours than texels. Where two colours share a place, the later one stays. */
struct known {
    uint32_t
        *texel; /* [1 << bits], 0: none, k + 1: texel k; NULL: no memory, none is known */
    int bits;
};
#define KNOWN_BITS 17
#define LEAST      1024 /* texels of a thread */

/* Colours that a thread lifts of its texels before walks look them up: so many, and a part of them.
 * Where colours are met again these are all; where they are not, a picture of millions of
 * colours would take its time before the first walk. */
#define LIFTED_FIRST 8192
#define LIFTED_PART  32

/* State of a texel's spectrum; IS_WRITTEN while one thread writes it. */
enum { IS_NOT, IS_WRITTEN, IS_THERE };

static _Atomic uint8_t *state_of(const struct imp__lifted_texels *t, size_t k)
{
    return (_Atomic uint8_t *)&t->state[k];
}

static uint32_t *known_at(const struct known *k, const float colour[3])
{
    uint32_t bits[3];
    memcpy(bits, colour, sizeof bits);
    const uint64_t h = (bits[0] * UINT64_C(0x9e3779b97f4a7c15)) ^
                       (bits[1] * UINT64_C(0xc2b2ae3d27d4eb4f)) ^
                       (bits[2] * UINT64_C(0x165667b19e3779f9));
    return &k->texel[(h ^ h >> 29) * UINT64_C(0xbf58476d1ce4e5b9) >> (64 - k->bits)];
}

static void lift(const struct imp__lifted_texels *t, const struct imp__lifter *by,
                 const float *p, struct imp__lifted *out)
{
    const double rgb[3] = {p[0], p[1], p[2]};
    const bool beyond = rgb[0] > 1 || rgb[1] > 1 || rgb[2] > 1;
    if (t->rule == IMP__LIFT_ANY_SIZE || (t->rule == IMP__LIFT_BY_SIZE && beyond))
        imp__lift_unbounded_by(by, rgb, out);
    else imp__lift_reflectance_by(by, rgb, out);
}

struct lifting {
    struct imp__lifted_texels *texels;
    bool all; /* not only texels that have other colours now */
};

static enum imp_status texels_lift(size_t first, size_t end, void *payload)
{
    const struct lifting *l = payload;
    struct imp__lifted_texels *t = l->texels;
    struct known known = {.bits = 4};
    size_t left = LIFTED_FIRST + (end - first) / LIFTED_PART;
    while (known.bits < KNOWN_BITS && (size_t)1 << known.bits < 2 * (end - first))
        known.bits++;
    if (t->n < UINT32_MAX)
        known.texel = imp__alloc(t->ctx, (size_t)1 << known.bits, sizeof *known.texel);
    for (size_t i = first; i < end; i++) {
        struct imp__lifted_texel *to = &t->texel[i];
        const float *p = t->data + 3 * i;
        if (!l->all && t->state[i] == IS_THERE && memcmp(p, to->of, sizeof to->of) == 0)
            continue;
        t->state[i] = IS_NOT;
        uint32_t *at = known.texel ? known_at(&known, p) : NULL;
        const struct imp__lifted_texel *same = at && *at ? &t->texel[*at - 1] : NULL;
        if (same && memcmp(p, same->of, sizeof same->of) == 0) {
            *to = *same;
            t->state[i] = IS_THERE;
            continue;
        }
        if (left == 0 && !t->whole) continue;
        left -= left > 0;
        lift(t, t->by, p, &to->lifted);
        memcpy(to->of, p, sizeof to->of);
        t->state[i] = IS_THERE;
        if (at) *at = (uint32_t)i + 1;
    }
    imp__release(t->ctx, known.texel);
    return IMP_OK;
}

enum imp_status imp__lifted_texels_make(const struct imp_build *b, const float *data,
                                        size_t n, struct imp__lifted_texels *out)
{
    *out = (struct imp__lifted_texels){.ctx = b->ctx, .data = data, .n = n};
    if (b->linear_colors) return IMP_OK;
    out->texel = imp__arena_take(b->arena, n, sizeof *out->texel);
    out->state = imp__arena_array(b->arena, n, sizeof *out->state);
    struct imp__lifter *by = imp__arena_take(b->arena, 1, sizeof *by);
    if (!out->texel || !out->state || !by)
        return imp__error(b->ctx, IMP_E_NOMEM, "texels do not fit as spectra");
    imp__lifter_make(by);
    out->by = by;
    return IMP_OK;
}

void imp__lifted_texels_update(struct imp__lifted_texels *t, enum imp__lift_rule rule)
{
    const bool all = !t->made || t->rule != rule;
    t->rule = rule;
    t->made = true;
    struct lifting l = {t, all};
    if (!t->texel) return;
    /* Without memory for a loop of all threads, this one does it. */
    if (imp__parallel_ranges(t->ctx, t->n, LEAST, texels_lift, &l) != IMP_OK)
        (void)texels_lift(0, t->n, &l);
}

static const struct imp__lifted *lift_now(const struct imp__lifted_texels *t, size_t k,
                                          struct imp__lifted *own)
{
    uint8_t was = IS_NOT;
    const float *p = t->data + 3 * k;
    lift(t, t->by, p, own);
    if (atomic_compare_exchange_strong_explicit(state_of(t, k), &was, IS_WRITTEN,
                                                memory_order_relaxed,
                                                memory_order_relaxed)) {
        t->texel[k].lifted = *own;
        memcpy(t->texel[k].of, p, sizeof t->texel[k].of);
        atomic_store_explicit(state_of(t, k), IS_THERE, memory_order_release);
    }
    return own;
}

const struct imp__lifted *imp__lifted_texel(const struct imp__lifted_texels *t, size_t k,
                                            struct imp__lifted *own)
{
    if (imp_likely(atomic_load_explicit(state_of(t, k), memory_order_acquire) ==
                   IS_THERE))
        return &t->texel[k].lifted;
    return lift_now(t, k, own);
}

/* Value of a texel at one wavelength and its derivatives by its three numbers. */
static double texel_at(const struct imp__lifted_texels *t, size_t k, double nm,
                       double d[3])
{
    struct imp__lifted own;
    if (t->texel) return imp__lifted_value_d(imp__lifted_texel(t, k, &own), nm, d);
    imp__rgb_basis(nm, d);
    const float *p = t->data + 3 * k;
    return p[0] * d[0] + p[1] * d[1] + p[2] * d[2];
}

static void linear_eval(const struct imp__lifted_texels *t,
                        const struct imp__texel_sum *sum,
                        const struct imp_carried *carried, imp_spec *value)
{
    double rgb[3] = {0, 0, 0}, b[3];
    for (int k = 0; k < sum->n; k++)
        for (size_t c = 0; c < 3; c++)
            rgb[c] += sum->weight[k] * t->data[3 * sum->texel[k] + c];
    for (int j = 0; j < carried->n; j++) {
        imp__rgb_basis(carried->nm[j], b);
        (*value)[j] = rgb[0] * b[0] + rgb[1] * b[1] + rgb[2] * b[2];
    }
}

void imp__lifted_texels_eval(const struct imp__lifted_texels *t,
                             const struct imp__texel_sum *sum,
                             const struct imp_carried *carried, imp_spec *value)
{
    if (!t->texel) {
        linear_eval(t, sum, carried, value);
    } else {
        double at[4] = {0, 0, 0, 0};
        for (int k = 0; k < sum->n; k++) {
            struct imp__lifted own;
            const struct imp__lifted *l = imp__lifted_texel(t, sum->texel[k], &own);
            for (int j = 0; j < carried->n; j++)
                at[j] += sum->weight[k] * imp__lifted_value(l, carried->nm[j]);
        }
        for (int j = 0; j < carried->n; j++) (*value)[j] = at[j];
    }
    for (int j = carried->n; j < 4; j++) (*value)[j] = (*value)[0];
}

void imp__lifted_texels_scatter(const struct imp__lifted_texels *t,
                                const struct imp__texel_sum *sum,
                                const struct imp_carried *carried, int param,
                                const imp_spec *bar, struct imp_sink *sink)
{
    for (int k = 0; k < sum->n; k++) {
        imp_spec part[3] = {{0}, {0}, {0}};
        for (int j = 0; j < carried->n; j++) {
            double d[3];
            texel_at(t, sum->texel[k], carried->nm[j], d);
            for (int c = 0; c < 3; c++) part[c][j] = (*bar)[j] * sum->weight[k] * d[c];
        }
        for (size_t c = 0; c < 3; c++)
            sink->add(sink, param, 3 * sum->texel[k] + c, 1, &part[c]);
    }
}

void imp__lifted_texels_tangent(const struct imp__lifted_texels *t,
                                const struct imp__texel_sum *sum,
                                const struct imp_carried *carried, int param,
                                imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot)
{
    *value_dot = imp__spec(0);
    for (int k = 0; k < sum->n && param >= 0; k++)
        for (int j = 0; j < carried->n; j++) {
            double d[3];
            texel_at(t, sum->texel[k], carried->nm[j], d);
            for (size_t c = 0; c < 3; c++)
                (*value_dot)[j] +=
                    sum->weight[k] * d[c] * dot(x_dot, param, 3 * sum->texel[k] + c);
        }
    for (int j = carried->n; j < 4; j++) (*value_dot)[j] = (*value_dot)[0];
}

double imp__lifted_texels_most(const struct imp__lifted_texels *t, size_t k)
{
    const float *p = t->data + 3 * k;
    struct imp__lifted own;
    if (t->texel) return imp__lifted_most(imp__lifted_texel(t, k, &own));
    return fmax(fmax(p[0], p[1]), p[2]);
}
