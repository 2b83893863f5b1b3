/* SPDX-License-Identifier: Apache-2.0
 *
 * Wavelengths that the walks of a sensor carry: uniform over the range that the film
 * sees, or with a density proportional to its responses times the light of the scene. */
#include "color/cie.h"
#include "scene_build.h"
#include "unlit.h"

/* Steps of the density stop stratification at about 100 walks if they are as wide as 1 nm. */
#define BIN_NM   0.125
#define BINS_MAX 4096 /* of a range that a file may make as wide as it likes */
/* Part of the mean light, added everywhere: where lights are dark a derivative may not be. */
#define LIGHT_FLOOR 0.05

/* Spectrum of an emitter's first input; textures are taken for daylight. */
static double light_at(const struct imp_emitter *e, double nm)
{
    const struct imp_input *in = e->n_in > 0 ? e->input[0] : NULL;
    if (!in || in->texture) return imp__spectrum_value(&imp__daylight, nm);
    return in->spectrum ? imp__spectrum_value(in->spectrum, nm) : 1;
}

/* What the film sees of a wavelength. */
static double seen_at(const struct imp_film_desc *film, double nm)
{
    double sum = 0;
    for (int c = 0; c < film->n_responses; c++)
        sum += imp__spectrum_value(&film->response[c], nm);
    if (film->n_responses > 0) return sum;
    for (int c = 0; c < 3; c++) sum += imp__cie_lookup(imp__cie_xyz[c], nm);
    return film->srf ? sum * imp__spectrum_value(film->srf, nm) : sum;
}

static enum imp_status density_make(struct imp_scene *scene,
                                    const struct imp_film_desc *film,
                                    struct imp_wavelengths *w)
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
        cdf[k + 1] = cdf[k] + seen_at(film, nm) * (light[k] + LIGHT_FLOOR * mean);
    }
    sum = cdf[n];
    if (!(sum > 0) || !isfinite(sum)) return IMP_OK;
    for (int k = 0; k <= n; k++) cdf[k] /= sum;
    w->n_bins = n;
    w->cdf = cdf;
    return IMP_OK;
}

/* ---- Does light reach the responses? ----------------------------------------------- */

struct range {
    double lo, hi;
};

/* Where a spectrum may be other than 0, whatever its values become. */
static struct range range_of(const struct imp_spectrum *s)
{
    struct range r = {s->lo, s->hi};
    if (!s->times) return r;
    const struct range t = range_of(s->times);
    return (struct range){fmax(r.lo, t.lo), fmin(r.hi, t.hi)};
}
/* The same for a curve, whose values are constant: without the zeros at its ends. */
static struct range curve_range(const struct imp_spectrum *s)
{
    struct range r = range_of(s);
    size_t first = 0, last = s->n - 1;
    if (s->form != IMP_SPECTRUM_POINTS) return r;
    while (first + 1 < s->n && s->value[first + 1] == 0 && s->value[first] == 0) first++;
    while (last > 0 && s->value[last - 1] == 0 && s->value[last] == 0) last--;
    const double step = s->per_nm > 0 ? 1 / s->per_nm : 0;
    r.lo = imp_max(step > 0 ? s->nm[0] + step * (double)first : s->nm[first], r.lo);
    r.hi = imp_min(step > 0 ? s->nm[0] + step * (double)last : s->nm[last], r.hi);
    return r;
}

/* Does light of these inputs reach the range? *any: one of them is light. */
static bool inputs_reach(const struct imp_input_desc *desc,
                         const struct imp_input *const *input, int n, struct range seen,
                         bool *any)
{
    for (int j = 0; desc && j < n;
         j++) { /* its own inputs: children are visited themselves */
        if (desc[j].role != IMP_EMISSION) continue;
        *any = true;
        if (input[j]->texture || !input[j]->spectrum) return true; /* not known */
        const struct range r = range_of(input[j]->spectrum);
        if (fmax(r.lo, seen.lo) < fmin(r.hi, seen.hi)) return true;
    }
    return false;
}
static bool light_reaches(const struct imp_scene *scene, struct range seen)
{
    bool any = false, met = false;
    for (int e = 0; e < scene->n_emitters && !met; e++)
        met = inputs_reach(scene->emitters[e]->ops->inputs, scene->emitters[e]->input,
                           scene->emitters[e]->n_in, seen, &any);
    for (int k = 0; k < scene->n_bsdfs && !met; k++)
        met = inputs_reach(scene->bsdfs[k]->ops->inputs, scene->bsdfs[k]->input,
                           scene->bsdfs[k]->n_own, seen, &any);
    for (int m = 0; m < scene->n_media && !met; m++)
        met = inputs_reach(scene->media[m]->ops->inputs, scene->media[m]->input,
                           scene->media[m]->n_own, seen, &any);
    return met || !any; /* a scene without light is dark, and no error */
}

static enum imp_status lit_check(const struct imp_scene *scene,
                                 const struct imp_sensor *s)
{
    for (int c = 0; c < s->film.n_responses; c++) {
        const struct range seen = curve_range(&s->film.response[c]);
        const struct imp_node *node = imp__node_of(scene->root, s);
        if (light_reaches(scene, seen)) continue;
        return imp__node_error(scene->ctx, node ? node : scene->root, IMP_E_SCENE,
                               "response '%s' sees nothing: no light of the scene has "
                               "wavelengths between %g and %g nm",
                               s->film.response_name[c], seen.lo, seen.hi);
    }
    return IMP_OK;
}

/* ---- Is light seen by any film? ------------------------------------------------------ */

static bool is_seen(const struct imp_scene *scene, const struct imp_wavelengths *all,
                    struct range light)
{
    for (int s = 0; s < scene->n_sensors; s++) {
        const struct imp_wavelengths *w = &all[s * IMP_WAVES_DRAWN];
        if (fmax(light.lo, w->lo) < fmin(light.hi, w->hi)) return true;
    }
    return false;
}

enum { UNSEEN_TOLD = 20 }; /* warnings, at most */

/* Warns of an object's spectra of light that are black in every picture, infrared ones beside an rgb
 * film. */
static void unseen_tell(const struct imp_scene *scene, const struct imp_wavelengths *all,
                        const void *object, const struct imp_input_desc *desc,
                        const struct imp_input *const *input, int n, int *told)
{
    char where[512];
    for (int j = 0; desc && *told < UNSEEN_TOLD && j < n; j++) {
        const struct imp_input *in = input[j];
        if (desc[j].role != IMP_EMISSION || in->texture || !in->spectrum) continue;
        const struct range r = range_of(in->spectrum);
        if (is_seen(scene, all, r)) continue;
        const struct imp_node *node = imp__node_of(scene->root, object);
        if (!node) continue;
        ++*told;
        imp__warn(scene->ctx,
                  "%s: %s: %g to %g nm are seen by no film of the scene: it is black",
                  imp__loc_text(node->loc, where, sizeof where),
                  in->param >= 0 ? scene->params[in->param].info.name : desc[j].name,
                  r.lo, r.hi);
    }
}
static void all_unseen_tell(const struct imp_scene *scene,
                            const struct imp_wavelengths *all)
{
    int told = 0;
    for (int e = 0; e < scene->n_emitters; e++)
        unseen_tell(scene, all, scene->emitters[e], scene->emitters[e]->ops->inputs,
                    scene->emitters[e]->input, scene->emitters[e]->n_in, &told);
    for (int k = 0; k < scene->n_bsdfs; k++)
        unseen_tell(scene, all, scene->bsdfs[k], scene->bsdfs[k]->ops->inputs,
                    scene->bsdfs[k]->input, scene->bsdfs[k]->n_own, &told);
    for (int m = 0; m < scene->n_media; m++)
        unseen_tell(scene, all, scene->media[m], scene->media[m]->ops->inputs,
                    scene->media[m]->input, scene->media[m]->n_own, &told);
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
                w.lo = imp_min(w.response[c].lo, w.lo);
                w.hi = imp_max(w.response[c].hi, w.hi);
            }
        }
        if (film->srf) {
            struct imp_spectrum *own = imp__arena_array(&scene->arena, 3, sizeof *own);
            if (!own) IMP_TRY(imp__build_no_memory(scene));
            for (int c = 0; c < 3; c++) {
                own[c] = rgb[c];
                own[c].times = film->srf;
            }
            w.response = own;
            w.lo = imp_max(film->srf->lo, w.lo);
            w.hi = imp_min(film->srf->hi, w.hi);
        }
        w.one_grid = imp__responses_share_grid(&w);
        IMP_TRY(lit_check(scene, scene->sensors[s]));
        all[s * IMP_WAVES_DRAWN + IMP_WAVES_UNIFORM] = w;
        IMP_TRY(density_make(scene, film, &w));
        all[s * IMP_WAVES_DRAWN + IMP_WAVES_IMPORTANCE] = w;
    }
    all_unseen_tell(scene, all);
    scene->wavelengths = all;
out:
    return st;
}
