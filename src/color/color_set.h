/* SPDX-License-Identifier: Apache-2.0
 *
 * What properties and objects that are colours share: numbers as a mode has them, and
 * their spectra. */
#ifndef IMP_COLOR_SET_H
#define IMP_COLOR_SET_H

#include "convert.h"

/* Light has longer waves: a spectrum that ends below was written in micrometres. */
#define IMP_LIGHT_FIRST_NM 100.0

/* Three numbers, or one where the mode or the input has room for one only. */
void imp__color_rgb_set(const struct imp__color_ask *ask, const double rgb[3],
                        struct imp__color *out);
void imp__color_number_set(const struct imp__color_ask *ask, double c,
                           struct imp__color *out);
static inline bool imp__color_wants_spectrum(const struct imp__color_ask *ask)
{
    return imp__is_spectral(ask->mode);
}
/* out->spectrum, of n numbers. */
enum imp_status imp__color_spectrum_make(const struct imp__color_ask *ask,
                                         enum imp__spectrum_form form, size_t n,
                                         const double *nm, const double *value,
                                         const struct imp_spectrum *times,
                                         struct imp__color *out);
/* The spectrum of a colour, where the mode has spectra. */
enum imp_status imp__color_lift(const struct imp__color_ask *ask, const double rgb[3],
                                struct imp__color *out);
/* A colour as the role allows it; `prop` is where it is written. */
enum imp_status imp__color_check_rgb(const struct imp__color_ask *ask,
                                     const struct imp_node *node,
                                     const struct imp_prop *prop, const double rgb[3]);
/* Samples, checked. */
enum imp_status imp__color_samples_set(const struct imp__color_ask *ask,
                                       const struct imp_node *node,
                                       const struct imp_prop *prop, size_t n,
                                       const double *nm, const double *v,
                                       struct imp__color *out);

#endif
