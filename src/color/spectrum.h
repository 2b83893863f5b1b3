/* SPDX-License-Identifier: Apache-2.0
 *
 * Spectra: what a colour is where walks carry wavelengths. A spectrum is a few numbers,
 * which may be a parameter, and a rule that gives a value at every wavelength, with its
 * derivatives by those numbers. */
#ifndef IMP_COLOR_SPECTRUM_H
#define IMP_COLOR_SPECTRUM_H

#include "base/arena.h"
#include "base/compiler.h"
#include "upsample.h"
#include <importon/kinds.h>
#include <string.h>

enum imp__spectrum_form {
    IMP_SPECTRUM_POINTS,    /* values at increasing wavelengths, linear between them */
    IMP_SPECTRUM_NUMBER,    /* one number at all wavelengths */
    IMP_SPECTRUM_COLOR,     /* r, g, b by the sigmoid of upsample.h */
    IMP_SPECTRUM_BLACKBODY, /* temperature in K: radiance in W m^-2 sr^-1 nm^-1 */
    IMP_SPECTRUM_SELLMEIER, /* n^2 = 1 + sum_k B_k l^2/(l^2 - C_k), l in um: B, then C */
    IMP_SPECTRUM_CAUCHY     /* n = A + B/l^2 + C/l^4, l in um */
};

typedef int32_t imp_int4 __attribute__((vector_size(16)));

#define IMP_SPECTRUM_NUMBERS 8 /* on which the value at one wavelength depends, at most */

struct imp_spectrum {
    enum imp__spectrum_form form;
    size_t n;            /* numbers */
    const double *value; /* [n] */
    double *own;         /* the same, to be set; NULL: a fixed spectrum */
    const double *nm;    /* POINTS: [n]; the first alone where per_nm > 0 is enough */
    double per_nm; /* POINTS: 1/step where the wavelengths are equidistant, else 0 */
    double lo, hi; /* nm, outside of which it is 0 */
    const struct imp_spectrum *times, *over; /* fixed; NULL: 1 */
    struct imp__lifted lifted;               /* COLOR: what follows from value */
    bool emission, extinction; /* COLOR: of any size by one rule or the other of
                                  upsample.h; neither: <= 1 */
    bool linear;               /* COLOR: linear in its numbers */
    double *color_d;           /* [n][3] d colour/d number, if prepared; or NULL */
};

/* Value at one wavelength, and its derivatives by numbers first .. first + n - 1. */
struct imp__spectrum_at {
    double value, d[IMP_SPECTRUM_NUMBERS];
    size_t first;
    int n;
};
double imp__spectrum_value(const struct imp_spectrum *s, double nm);
/* The same at the wavelengths of a walk, to the bit. */
void imp__spectrum_lanes_any(const struct imp_spectrum *s, const double nm[4],
                             imp_spec *value);
/* Equidistant samples, whose wavelengths are found without a call. */
static inline bool imp__spectrum_is_even(const struct imp_spectrum *s)
{
    return s->form == IMP_SPECTRUM_POINTS && s->per_nm > 0 && !s->times && !s->over;
}
/* Where wavelengths lie among them: of all such spectra with the same lo, hi, per_nm and n. */
struct imp__even_place {
    imp_int4 k;
    imp_spec part;
    __typeof__((imp_spec){0} >= (imp_spec){0}) inside;
};
static inline struct imp__even_place imp__spectrum_place(const struct imp_spectrum *s,
                                                         const double nm[4])
{
    struct imp__even_place p;
    const imp_spec l = {nm[0], nm[1], nm[2], nm[3]}, zero = {0};
    p.inside = (l >= zero + s->lo) & (l <= zero + s->hi);
    const imp_spec at =
        (imp_spec)((__typeof__(p.inside))((l - s->lo) * s->per_nm) & p.inside);
    p.k = __builtin_convertvector(at, imp_int4);
    p.k += p.k > (int)s->n - 2; /* true is -1: the last point ends the last interval */
    p.part = at - __builtin_convertvector(p.k, imp_spec);
    return p;
}
static inline imp_spec imp__spectrum_there(const struct imp_spectrum *s,
                                           const struct imp__even_place *p)
{
    /* A sample and the next one are loaded together. */
    typedef double pair __attribute__((vector_size(16)));
    pair at[4];
    for (int j = 0; j < 4; j++) memcpy(&at[j], &s->value[p->k[j]], sizeof at[j]);
    const imp_spec even = __builtin_shufflevector(at[0], at[2], 0, 1, 2, 3),
                   odd = __builtin_shufflevector(at[1], at[3], 0, 1, 2, 3),
                   low = __builtin_shufflevector(even, odd, 0, 4, 2, 6),
                   high = __builtin_shufflevector(even, odd, 1, 5, 3, 7);
    const imp_spec x = low + p->part * (high - low);
    return (imp_spec)((__typeof__(p->inside))x & p->inside);
}
static inline void imp__spectrum_lanes(const struct imp_spectrum *s, const double nm[4],
                                       imp_spec *value)
{
    if (imp_unlikely(!imp__spectrum_is_even(s))) {
        imp__spectrum_lanes_any(s, nm, value);
        return;
    }
    const struct imp__even_place p = imp__spectrum_place(s, nm);
    *value = imp__spectrum_there(s, &p);
}
void imp__spectrum_at(const struct imp_spectrum *s, double nm,
                      struct imp__spectrum_at *out);
/* No less than the value at any wavelength. */
double imp__spectrum_most(const struct imp_spectrum *s);

/* Colour in linear sRGB (docs/scene-format.md 2.3), not clamped. `daylight`: the colour
 * of a surface of this reflectance under D65; else that of a light of this power. */
void imp__spectrum_color(const struct imp_spectrum *s, bool daylight, double rgb[3]);

/* Sets color_d, of a form whose values are linear in its numbers, or a colour. False: no
 * memory. */
bool imp__spectrum_color_prepare(struct imp_arena *arena, bool daylight,
                                 struct imp_spectrum *s);

/* Numbers have changed: what is derived from them is made anew. */
void imp__spectrum_update(struct imp_spectrum *s);

/* Daylight D65, 1 as a white of luminance 1. */
extern const struct imp_spectrum imp__daylight;

/* The wavelength itself, in nm. */
extern const struct imp_spectrum imp__wavelength;

/* One that lives as long as the arena, with room for n numbers, which are copied, as are
 * the wavelengths (NULL: none). NULL if out of memory. */
struct imp_spectrum *imp__spectrum_make(struct imp_arena *arena,
                                        enum imp__spectrum_form form, size_t n,
                                        const double *nm, const double *value);

#endif
