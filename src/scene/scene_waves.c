/* SPDX-License-Identifier: Apache-2.0
 *
 * Wavelengths that the walks of a sensor carry: uniform over the range that the film
 * sees, or with a density proportional to its responses times the light of the scene. */
#include "color/cie.h"
#include "scene_build.h"

#define BIN_NM   1.0
#define BINS_MAX 4096 /* of a range that a file may make as wide as it likes */
/* Of the mean light, added everywhere: where lights are dark a derivative may not be. */
#define LIGHT_FLOOR 0.05

/* Spectrum of an emitter's first input; textures are taken for daylight. */
static double light_at(const struct imp_emitter *e, double nm)
{
    const struct imp_input *in = e->n_in > 0 ? e->input[0] : NULL;
    if (!in || in->texture) return imp__spectrum_value(&imp__daylight, nm);
    return in->spectrum ? imp__spectrum_value(in->spectrum, nm) : 1;
}

/* What the film sees of a wavelength. */
static double seen_at(const struct imp_wavelengths *w, bool observer, double nm)
{
    double sum = 0;
    if (observer)
        for (int c = 0; c < 3; c++) sum += imp__cie_lookup(imp__cie_xyz[c], nm);
    else
        for (int c = 0; c < w->n_channels; c++)
            sum += fabs(imp__spectrum_value(&w->response[c], nm));
    return sum;
}

static enum imp_status density_make(struct imp_scene *scene, struct imp_wavelengths *w,
                                    bool observer)
{
    const int n = (int)fmin(ceil((w->hi - w->lo) / BIN_NM), BINS_MAX);
    const double bin = (w->hi - w->lo) / n;
    double *cdf = imp__arena_array(&scene->arena, (size_t)n + 1, sizeof *cdf);
    double *light = imp__arena_array(&scene->arena, (size_t)n, sizeof *light);
    double mean = 0, sum = 0;
    if (!cdf || !light) return imp__build_no_memory(scene);
    for (int e = 0; e < scene->n_emitters; e++) {
        double own = 0;
        for (int k = 0; k < n; k++)
            own += light_at(scene->emitters[e], w->lo + bin * (k + 0.5)) / n;
        for (int k = 0; k < n && own > 0; k++)
            light[k] += light_at(scene->emitters[e], w->lo + bin * (k + 0.5)) / own;
    }
    for (int k = 0; k < n; k++) mean += light[k] / n;
    if (!(mean > 0) || !isfinite(mean)) return IMP_OK; /* dark: uniform */
    for (int k = 0; k < n; k++) {
        const double nm = w->lo + bin * (k + 0.5);
        cdf[k + 1] = cdf[k] + seen_at(w, observer, nm) * (light[k] + LIGHT_FLOOR * mean);
    }
    sum = cdf[n];
    if (!(sum > 0) || !isfinite(sum)) return IMP_OK;
    for (int k = 0; k <= n; k++) cdf[k] /= sum;
    w->n_bins = n;
    w->cdf = cdf;
    return IMP_OK;
}

enum imp_status imp__waves_build(struct imp_scene *scene)
{
    enum imp_status st = IMP_OK;
    const size_t n = (size_t)scene->n_sensors;
    if (!imp__is_spectral(scene->mode) || n == 0) return IMP_OK;
    struct imp_wavelengths *all =
        imp__arena_array(&scene->arena, n * IMP_WAVES_DRAWN, sizeof *all);
    const struct imp_spectrum *rgb = imp__rgb_responses(&scene->arena);
    if (!all || !rgb) return imp__build_no_memory(scene);
    for (size_t s = 0; s < n; s++) {
        struct imp_wavelengths w = {.lanes = scene->mode == IMP_SINGLE ? 1 : 4,
                                    .lo = IMP_CIE_FIRST_NM,
                                    .hi = IMP_CIE_LAST_NM,
                                    .n_channels = 3,
                                    .response = rgb};
        const struct imp_film_desc *film = &scene->sensors[s]->film;
        if (film->n_responses > 0) {
            w.n_channels = film->n_responses;
            w.response = film->response;
            w.lo = INFINITY;
            w.hi = 0;
            for (int c = 0; c < w.n_channels; c++) {
                w.lo = fmin(w.lo, w.response[c].lo);
                w.hi = fmax(w.hi, w.response[c].hi);
            }
        }
        all[s * IMP_WAVES_DRAWN + IMP_WAVES_UNIFORM] = w;
        IMP_TRY(density_make(scene, &w, film->n_responses == 0));
        all[s * IMP_WAVES_DRAWN + IMP_WAVES_IMPORTANCE] = w;
    }
    scene->wavelengths = all;
out:
    return st;
}
