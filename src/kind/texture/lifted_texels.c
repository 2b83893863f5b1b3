/* SPDX-License-Identifier: Apache-2.0
 *
 * Spectra of RGB texels: value, reverse and forward derivatives of their interpolation at a
 * wavelength. The first walk that looks a texel up lifts it, unless another texel of its colour was
 * lifted before: texels refer to a common list of spectra, which a table finds by colour.
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

#define LEAST 1024 /* texels of a thread */
/* The table of colours: so many places for 2^KNOWN_BITS_MAX colours at most, and a colour is in one of
 * PROBES places. One that finds them taken is lifted again where it is met again. */
#define KNOWN_BITS_MAX 21
#define PROBES         4
#define BUSY           UINT32_MAX /* of a texel that a thread is lifting */

static _Atomic uint32_t *atomic_of(uint32_t *x) { return (_Atomic uint32_t *)x; }
static uint32_t get(uint32_t *x)
{
    return atomic_load_explicit(atomic_of(x), memory_order_acquire);
}
static void put(uint32_t *x, uint32_t value)
{
    atomic_store_explicit(atomic_of(x), value, memory_order_release);
}

static bool same_colour(const float a[3], const float b[3])
{
    return memcmp(a, b, 3 * sizeof *a) == 0;
}

static size_t hash_of(const float colour[3], int bits_of_hash)
{
    uint32_t bits[3];
    memcpy(bits, colour, sizeof bits);
    const uint64_t h = (bits[0] * UINT64_C(0x9e3779b97f4a7c15)) ^
                       (bits[1] * UINT64_C(0xc2b2ae3d27d4eb4f)) ^
                       (bits[2] * UINT64_C(0x165667b19e3779f9));
    return (h ^ h >> 29) * UINT64_C(0xbf58476d1ce4e5b9) >> (64 - bits_of_hash);
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

enum imp_status imp__lifted_texels_make(const struct imp_build *b, const float *data,
                                        size_t n, struct imp__lifted_texels *out)
{
    struct imp__lifted_texels t = {.ctx = b->ctx, .data = data, .n = n, .known_bits = 4};
    *out = t;
    if (b->linear_colors) return IMP_OK;
    /* An eighth more than texels, so that a few that change need no new list. Pages that nothing
     * is written to take no memory. */
    t.room = imp_min(n + n / 8 + 64, (size_t)UINT32_MAX / 2);
    while (t.known_bits < KNOWN_BITS_MAX && (size_t)1 << t.known_bits < n) t.known_bits++;
    struct imp__lifter *by = imp__arena_take(b->arena, 1, sizeof *by);
    t.spectrum_of = imp__arena_take(b->arena, n, sizeof *t.spectrum_of);
    t.spectrum = imp__arena_take(b->arena, t.room, sizeof *t.spectrum);
    t.colour = imp__arena_take(b->arena, t.room, sizeof *t.colour);
    t.known = imp__arena_take(b->arena, (size_t)1 << t.known_bits, sizeof *t.known);
    t.used = imp__arena_array(b->arena, 1, sizeof *t.used);
    if (!t.spectrum_of || !t.spectrum || !t.colour || !t.known || !t.used || !by)
        return imp__error(b->ctx, IMP_E_NOMEM, "texels do not fit as spectra");
    imp__lifter_make(by);
    t.by = by;
    *out = t;
    return IMP_OK;
}

/* Lifts texel k, or finds the spectrum of its colour. *own is the result if the list is full. */
static const struct imp__lifted *lift_now(const struct imp__lifted_texels *t, size_t k,
                                          struct imp__lifted *own)
{
    const float *p = t->data + 3 * k;
    const size_t mask = ((size_t)1 << t->known_bits) - 1, h = hash_of(p, t->known_bits);
    uint32_t *place = &t->known[h];
    for (size_t i = 0; i < PROBES; i++) {
        uint32_t *at = &t->known[(h + i) & mask];
        const uint32_t s = get(at);
        if (s && same_colour(t->colour[s - 1], p)) {
            put(&t->spectrum_of[k], s);
            return &t->spectrum[s - 1];
        }
        if (s) continue;
        place = at;
        break;
    }
    /* One thread gives the texel its spectrum: a second one would take room. Others that look it up
     * meanwhile lift it for themselves. */
    uint32_t none = 0;
    const bool mine = atomic_compare_exchange_strong_explicit(
        atomic_of(&t->spectrum_of[k]), &none, BUSY, memory_order_acquire,
        memory_order_acquire);
    if (!mine && none != BUSY) return &t->spectrum[none - 1];
    lift(t, t->by, p, own);
    if (!mine) return own;
    const uint32_t s =
        get(t->used) < t->room
            ? atomic_fetch_add_explicit(atomic_of(t->used), 1, memory_order_relaxed)
            : BUSY;
    if (s >= t->room) {
        put(&t->spectrum_of[k], 0);
        return own;
    }
    t->spectrum[s] = *own;
    memcpy(t->colour[s], p, sizeof t->colour[s]);
    put(place, s + 1);
    put(&t->spectrum_of[k], s + 1);
    return &t->spectrum[s];
}

const struct imp__lifted *imp__lifted_texel(const struct imp__lifted_texels *t, size_t k,
                                            struct imp__lifted *own)
{
    const uint32_t s = get(&t->spectrum_of[k]);
    return imp_likely(s - 1 < BUSY - 1) ? &t->spectrum[s - 1] : lift_now(t, k, own);
}

static enum imp_status lift_all(size_t first, size_t end, void *payload)
{
    const struct imp__lifted_texels *t = payload;
    struct imp__lifted own;
    for (size_t k = first; k < end; k++) imp__lifted_texel(t, k, &own);
    return IMP_OK;
}

struct forgetting {
    const struct imp__lifted_texels *texels;
    _Atomic size_t without; /* texels that have no spectrum now */
};

/* Texels whose colours have changed have no spectrum any more. */
static enum imp_status forget_changed(size_t first, size_t end, void *payload)
{
    struct forgetting *f = payload;
    const struct imp__lifted_texels *t = f->texels;
    size_t without = 0;
    for (size_t k = first; k < end; k++) {
        uint32_t *s = &t->spectrum_of[k];
        if (*s && !same_colour(t->colour[*s - 1], t->data + 3 * k)) *s = 0;
        without += *s == 0;
    }
    atomic_fetch_add(&f->without, without);
    return IMP_OK;
}

/* Work on all texels, by all threads or, without memory for a loop of them, by this one. */
static void all_texels(const struct imp__lifted_texels *t,
                       enum imp_status (*work)(size_t, size_t, void *), void *payload)
{
    if (imp__parallel_ranges(t->ctx, t->n, LEAST, work, payload) != IMP_OK)
        (void)work(0, t->n, payload);
}

void imp__lifted_texels_update(struct imp__lifted_texels *t, enum imp__lift_rule rule)
{
    bool anew = !t->made || t->rule != rule;
    t->rule = rule;
    t->made = true;
    if (!t->spectrum_of) return;
    if (!anew) {
        struct forgetting f = {.texels = t};
        all_texels(t, forget_changed, &f);
        anew = *t->used + f.without > t->room;
    }
    if (anew) {
        memset(t->spectrum_of, 0, t->n * sizeof *t->spectrum_of);
        memset(t->known, 0, sizeof *t->known << t->known_bits);
        *t->used = 0;
    }
    if (t->whole) all_texels(t, lift_all, t);
}

/* Value of a texel at one wavelength and its derivatives by its three numbers. */
static double texel_at(const struct imp__lifted_texels *t, size_t k, double nm,
                       double d[3])
{
    struct imp__lifted own;
    if (t->spectrum_of) return imp__lifted_value_d(imp__lifted_texel(t, k, &own), nm, d);
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
    if (!t->spectrum_of) {
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
    if (t->spectrum_of) return imp__lifted_most(imp__lifted_texel(t, k, &own));
    return fmax(fmax(p[0], p[1]), p[2]);
}
