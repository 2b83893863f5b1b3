/* SPDX-License-Identifier: Apache-2.0
 *
 * Spectra at the wavelengths of walks. A walk has its wavelengths from its first vertex to its last, so
 * what many of them meet is looked up once for all. */
#include "color/spectrum.h"
#include "lanes_record.h"

/* The rows of s; NULL: it is not kept. */
static const imp_spec *rows_of(const struct imp_bundle *b, const struct imp_spectrum *s)
{
    for (int i = 0; i < b->n_kept; i++)
        if (b->kept[i].of == s) return b->kept[i].row;
    return NULL;
}

static void keep(struct imp_bundle *b, const struct imp_spectrum *s)
{
    if (b->n_kept == IMP_SPECTRA_KEPT || rows_of(b, s)) return;
    const bool failed = b->arena->failed;
    imp_spec *row = imp__arena_take(b->arena, (size_t)b->n, sizeof *row);
    b->arena->failed = failed; /* without it, too */
    if (!row) return;
    for (int k = 0; k < b->n; k++)
        imp__spectrum_lanes(s, b->waves[k]->carried.nm, &row[k]);
    b->kept[b->n_kept++] = (struct imp_spectrum_kept){s, row};
}

void imp__lanes_spectra_keep(struct imp_bundle *b, const struct imp_bin *bin, int n)
{
    const struct imp_scene *scene = b->tracer->scene;
    if (!b->arena || n < b->n / 4) return;
    for (int j = 0; bin->spectra && j < bin->bsdf->n_in; j++)
        keep(b, bin->bsdf->input[j]->spectrum);
    if (scene->n_emitters != 1 || scene->emitters[0]->n_in == 0) return;
    const struct imp_input *i = scene->emitters[0]->input[0];
    if (i->plain && i->spectrum) keep(b, i->spectrum);
}

void imp__lanes_spectrum(const struct imp_bundle *b, const struct imp_spectrum *s,
                         const struct imp_lanes_vertices *v, unsigned bits,
                         struct imp_wide_color *out)
{
    const imp_spec *kept = rows_of(b, s);
    if (imp_likely(kept != NULL)) {
        imp_spec rows[IMP_WIDE_LANES];
        for (int k = 0; k < IMP_WIDE_LANES; k++) rows[k] = kept[v->walk[k]];
        *out = imp__color_of_rows(rows);
        return;
    }
    imp_spec rows[IMP_WIDE_LANES] = {{0}};
    for (; bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits);
        imp__spectrum_lanes(s, imp__lanes_carried(b, v, k)->nm, &rows[k]);
    }
    *out = imp__color_of_rows(rows);
}
