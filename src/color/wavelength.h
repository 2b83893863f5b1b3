/* SPDX-License-Identifier: Apache-2.0
 *
 * Wavelengths of walks, and what a sensor makes of the radiance at them. A walk carries C
 * wavelengths: the hero l_0 is drawn with density p and its companions follow at equal
 * distances in the cumulative distribution, so that each of them alone has density p
 * (Wilkie et al., "Hero Wavelength Spectral Sampling", 2014). Channel c of the walk is
 *
 *     sum_j r_c(l_j) L_j / (C p(l_j)),
 *
 * an estimate of the integral of r_c L. It is linear in L, so adjoints of channels enter
 * the wavelengths through the transpose. */
#ifndef IMP_COLOR_WAVELENGTH_H
#define IMP_COLOR_WAVELENGTH_H

#include "spectrum.h"

#define IMP_CHANNELS_MAX 4 /* of a walk */

struct imp_wavelengths {
    int lanes;     /* C: 4 or 1 */
    double lo, hi; /* nm */
    /* [n_bins + 1] distribution over bins of equal width, from 0 to 1; NULL: uniform */
    int n_bins;
    const double *cdf;
    int n_channels;
    const struct imp_spectrum *response; /* [n_channels] r_c, per nm */
    bool one_grid; /* those that walks have are samples at the same wavelengths */
};

/* The wavelengths of one walk. */
struct imp_waves {
    struct imp_carried carried;
    int drew;         /* lane that makes decisions whose density depends on the lane */
    imp_spec density; /* C p(l_j); 1 in unused lanes */
    int n_channels;
    imp_spec channel[IMP_CHANNELS_MAX]; /* channel c is channel[c] . L */
};

/* For one_grid. */
bool imp__responses_share_grid(const struct imp_wavelengths *w);

/* u: uniform on [0, 1). The hero is lane 0. */
void imp__waves_make(const struct imp_wavelengths *w, double u, struct imp_waves *out);

/* Weights of a response in the lanes of a walk. */
void imp__waves_response(const struct imp_waves *waves,
                         const struct imp_spectrum *response, imp_spec *weight);

/* Responses whose channels are linear sRGB by the CIE 1931 observer; daylight of
 * imp__daylight is white. NULL if out of memory. */
struct imp_spectrum *imp__rgb_responses(struct imp_arena *arena);

/* Walks drawn with another hash carry other wavelengths, or have other channels. */
uint64_t imp__wavelengths_hash(uint64_t h, const struct imp_wavelengths *w);

/* Channels of a walk's radiance at its wavelengths, and the transpose. */
static inline imp_spec imp__waves_channels(const struct imp_waves *w, imp_spec L)
{
    imp_spec out = {0};
    for (int c = 0; c < w->n_channels; c++) {
        const imp_spec p = w->channel[c] * L;
        out[c] = (p[0] + p[1]) + (p[2] + p[3]);
    }
    return out;
}
static inline imp_spec imp__waves_lanes(const struct imp_waves *w, imp_spec channels)
{
    imp_spec out = {0};
    for (int c = 0; c < w->n_channels; c++) out += w->channel[c] * channels[c];
    return out;
}

#endif
