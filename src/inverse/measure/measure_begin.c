/* SPDX-License-Identifier: Apache-2.0
 *
 * Where a measurement begins: fields of view from focal lengths, and brightness. A scene whose
 * exposures or lights are wrong by a factor would have its cameras turned to what is bright, so that
 * these are put right first, by means. */
#include "base/arguments.h"
#include "math/rng.h"
#include "measuring.h"
#include "scene/pose.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define LOOK     16 /* samples per pixel of the pictures whose means are compared */
#define SEED     0xb291
#define DIAGONAL 43.2666 /* of a film of 36 x 24, mm */

/* ---- Fields of view -------------------------------------------------------------------- */

/* A focal length "in 35 mm film" has the same diagonal field of view (CIPA DCG-001, 2005). */
static enum imp_status views_set(struct imp__measure *m)
{
    for (const struct imp_pose *q = m->scene->poses; q; q = q->next) {
        if (q->kind != IMP_POSE_FOV || m->stage[q->param] > IMP_MEASURE_LENS) continue;
        for (size_t i = 0; i < m->n_photos; i++) {
            const struct imp__photo *p = &m->photos[i];
            if (p->sensor != q->sensor || !(p->desc.focal_35mm > 0)) continue;
            const double w = p->sensor->film.width, h = p->sensor->film.height;
            const double x_fov =
                2 / IMP_PI * 180 *
                atan(DIAGONAL / (2 * p->desc.focal_35mm) * w / hypot(w, h));
            const double before = imp__param_get(&m->scene->params[q->param], 0);
            IMP_CHECKED(imp_scene_set_values(m->scene, (size_t)q->param, 1, &x_fov));
            IMP_CHECKED(imp__measure_say(
                m, "%s: %.4g -> %.4g, by the focal length of %.3g mm",
                m->scene->params[q->param].info.name, before, x_fov, p->desc.focal_35mm));
        }
    }
    return IMP_OK;
}

/* ---- Brightness ------------------------------------------------------------------------ */

/* *ratio: photograph over picture, in light. Clipped pixels are left out. */
static enum imp_status ratio_of(struct imp__measure *m, const struct imp__photo *p,
                                double *ratio)
{
    enum imp_status st = IMP_OK;
    imp_problem *blank = NULL;
    imp_film *film = NULL;
    struct imp_run run = m->run;
    size_t index;
    const struct imp_param *curve = imp__measure_film_number(m, p, "gamma", &index);
    const double gamma = curve ? imp__param_get(curve, 0) : 1;
    double photo = 0, picture = 0;
    run.sensor = p->desc.sensor;
    run.spp = LOOK;
    run.seed = imp__mix64(m->run.seed ^ SEED);
    run.time_limit_s = 0;
    run.preview = NULL;
    IMP_TRY(imp_problem_create(m->scene, &blank));
    IMP_TRY(imp_problem_jacobian(blank, &run, &film, NULL));
    for (size_t i = 0; i < p->n_values; i++) {
        const double T = (double)p->desc.pixels[i];
        if (!(p->weights[i / (size_t)p->desc.channels] > 0)) continue;
        if (p->desc.clipped && T >= p->desc.high) continue;
        photo += curve ? pow(fmax(T, 0), gamma) : T;
        picture += (double)imp_film_mean(film)[i];
    }
    *ratio = photo > 0 && picture > 0 ? photo / picture : 1;
out:
    imp_film_destroy(film);
    imp_problem_destroy(blank);
    return st;
}

/* What some files tell and others do not is not used, which is said of the first that does not.
 * known [n_photos]. */
static enum imp_status part_say(struct imp__measure *m, const double *known,
                                const char *what)
{
    size_t some = 0, first = SIZE_MAX;
    for (size_t i = 0; i < m->n_photos; i++) {
        some += known[i] > 0;
        if (!(known[i] > 0) && first == SIZE_MAX) first = i;
    }
    if (some == 0 || some == m->n_photos) return IMP_OK;
    return imp__measure_say(m, "%s has no %s: that of the other files is not used",
                            m->photos[first].name, what);
}

/* exposure_s iso/(100 f_number^2) of all; false: it is not known of all. */
static bool exif_exposures(const struct imp__measure *m, double *out)
{
    bool all = true;
    for (size_t i = 0; i < m->n_photos; i++) {
        const struct imp_photo *d = &m->photos[i].desc;
        out[i] = d->f_number > 0
                     ? d->exposure_s * d->iso / (100 * d->f_number * d->f_number)
                     : 0;
        all &= out[i] > 0;
    }
    return all;
}

static enum imp_status param_scale(struct imp__measure *m, size_t k, double factor)
{
    struct imp_param *q = &m->scene->params[k];
    const double before = imp__param_get(q, 0);
    for (size_t e = 0; e < q->info.count; e++)
        imp__param_set(q, e,
                       imp_clamp(factor * imp__param_get(q, e), q->info.lo, q->info.hi));
    imp__theta_announce(m->scene);
    return imp__measure_say(m, "%s: %.4g -> %.4g, by %s", q->info.name, before,
                            imp__param_get(q, 0), "the means of photograph and picture");
}

/* All measured numbers of lights that are factors of what they send. */
static enum imp_status lights_scale(struct imp__measure *m, double factor)
{
    for (size_t k = 0; k < m->scene->n_params; k++)
        if (m->stage[k] == IMP_MEASURE_LIGHTS && imp__measure_shines(m, k))
            IMP_CHECKED(param_scale(m, k, factor));
    return IMP_OK;
}

/* The measured exposure of a photograph; NULL: it stays. */
static struct imp_param *free_exposure(const struct imp__measure *m, size_t i, size_t *k)
{
    struct imp_param *q = imp__measure_film_number(m, &m->photos[i], "exposure", k);
    return q && m->stage[*k] == IMP_MEASURE_EXPOSURE ? q : NULL;
}

static enum imp_status brightness_set(struct imp__measure *m, double *ratio, double *exif)
{
    double fixed = 0, unit = 0;
    size_t n_fixed = 0, n_free = 0, k;
    for (size_t i = 0; i < m->n_photos; i++) {
        if (free_exposure(m, i, &k)) continue;
        fixed += log(ratio[i]);
        n_fixed++;
    }
    const double light = n_fixed > 0 && imp__measure_count(m, IMP_MEASURE_LIGHTS) > 0
                             ? exp(fixed / (double)n_fixed)
                             : 1;
    if (light != 1) IMP_CHECKED(lights_scale(m, light));
    for (size_t i = 0; i < m->n_photos; i++) ratio[i] /= light;
    const bool known = exif_exposures(m, exif);
    IMP_CHECKED(part_say(m, exif, "exposure time, ISO and aperture"));
    for (size_t i = 0; known && i < m->n_photos; i++) {
        const struct imp_param *q = free_exposure(m, i, &k);
        if (!q || !(imp__param_get(q, 0) > 0)) continue;
        unit += log(ratio[i] * imp__param_get(q, 0) / exif[i]);
        n_free++;
    }
    for (size_t i = 0; i < m->n_photos; i++) {
        struct imp_param *q = free_exposure(m, i, &k);
        if (!q || !(imp__param_get(q, 0) > 0)) continue;
        if (!known) {
            IMP_CHECKED(param_scale(m, k, ratio[i]));
            continue;
        }
        const double value = exp(unit / (double)n_free) * exif[i];
        IMP_CHECKED(
            imp__measure_say(m,
                             "%s: %.4g -> %.4g, by exposure time, ISO and aperture "
                             "of all photographs and their mean",
                             q->info.name, imp__param_get(q, 0), value));
        IMP_CHECKED(imp_scene_set_values(m->scene, k, 1, &value));
    }
    return IMP_OK;
}

enum imp_status imp__measure_begin(struct imp__measure *m)
{
    enum imp_status st = IMP_OK;
    double *ratio = imp__alloc(m->ctx, 2 * m->n_photos, sizeof *ratio);
    if (!ratio) IMP_TRY(imp__error(m->ctx, IMP_E_NOMEM, "no memory for photographs"));
    for (size_t i = 0; i < m->n_photos; i++) {
        IMP_TRY(imp__measure_noise(m, &m->photos[i]));
        IMP_TRY(imp__measure_say(m, "%s: noise %.3g%s", m->photos[i].name,
                                 m->photos[i].noise,
                                 m->photos[i].noise_of > 0 ? " of its values, estimated"
                                 : imp__measure_noise_varies(&m->photos[i])
                                     ? " of its values, root of the mean square"
                                     : " of its values"));
    }
    for (size_t i = 0; i < m->n_photos; i++) ratio[i] = m->photos[i].desc.focal_35mm;
    if (m->wanted[IMP_MEASURE_CAMERAS] && !m->o.params)
        IMP_TRY(part_say(m, ratio, "focal length"));
    IMP_TRY(views_set(m));
    for (size_t i = 0; i < m->n_photos; i++)
        IMP_TRY(ratio_of(m, &m->photos[i], &ratio[i]));
    IMP_TRY(brightness_set(m, ratio, ratio + m->n_photos));
out:
    imp__release(m->ctx, ratio);
    return st;
}
