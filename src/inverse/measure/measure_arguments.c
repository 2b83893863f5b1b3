/* SPDX-License-Identifier: Apache-2.0
 *
 * Photographs and options of a measurement: defaults, and what is refused by name. */
#include "base/arguments.h"
#include "inverse/problem/target_levels.h"
#include "math/hash.h"
#include "measuring.h"
#include "scene/fingerprint.h"
#include <math.h>
#include <string.h>

#define ROUNDS 3
#define MASK   6.
#define LEAST  3 /* pixels of a photograph in each direction */

static const char *const stage_names[IMP_MEASURE_STAGES] = {
    "cameras", "lens", "exposure", "lights", "materials", "textures", "together"};

const char *imp_measure_stage_name(enum imp_measure_stage stage)
{
    return (unsigned)stage < IMP_MEASURE_STAGES ? stage_names[stage] : NULL;
}

/* ---- Options --------------------------------------------------------------------------- */

static enum imp_status stages_take(struct imp__measure *m)
{
    for (const char *at = m->o.stages; *at;) {
        const size_t n = strcspn(at, ",");
        int found = -1;
        for (int s = 0; s < IMP_MEASURE_STAGES; s++)
            if (strlen(stage_names[s]) == n && !strncmp(at, stage_names[s], n)) found = s;
        if (found < 0)
            return imp__error(m->ctx, IMP_E_ARG,
                              "options: there is no stage '%.*s'; there are cameras, "
                              "lens, exposure, lights, materials, textures and "
                              "together",
                              (int)imp_min(n, (size_t)100), at);
        m->wanted[found] = true;
        at += n + (at[n] == ',');
    }
    return IMP_OK;
}

static enum imp_status patterns_check(struct imp__measure *m, const char *name,
                                      const char *const *list, size_t n)
{
    if (n > 0 && !list)
        return imp__error(m->ctx, IMP_E_ARG, "options: %s is NULL, and n_%s is %zu", name,
                          name, n);
    for (size_t i = 0; i < n; i++)
        if (!list[i] || !*list[i])
            return imp__error(m->ctx, IMP_E_ARG, "options: %s[%zu] is empty", name, i);
    return IMP_OK;
}

/* Each of `hold` is an item, or several with commas between them. */
static enum imp_status holds_take(struct imp__measure *m)
{
    size_t n = 0;
    for (size_t i = 0; i < m->o.n_hold; i++) {
        n++;
        for (const char *c = m->o.hold[i]; *c; c++) n += *c == ',';
    }
    if (n > 0 && !(m->holds = imp__alloc(m->ctx, n, sizeof *m->holds)))
        return imp__error(m->ctx, IMP_E_NOMEM, "no memory for %zu names", n);
    for (size_t i = 0; i < m->o.n_hold; i++)
        for (const char *from = m->o.hold[i];; from += strcspn(from, ",") + 1) {
            const size_t length = strcspn(from, ",");
            IMP_CHECKED(imp__held_read(m->ctx, from, length, &m->holds[m->n_holds++]));
            if (!from[length]) break;
        }
    return IMP_OK;
}

enum imp_status imp__measure_options_take(struct imp__measure *m,
                                          const struct imp_measure_options *options)
{
    m->o = (struct imp_measure_options)IMP_MEASURE_OPTIONS_INIT;
    IMP_CHECKED(
        imp__options_take(m->ctx, "imp_measure", "options", options, &m->o, sizeof m->o));
    if (m->o.rounds < 0 || m->o.max_iterations < 0)
        return imp__error(m->ctx, IMP_E_ARG, "options: %s = %d is below 0",
                          m->o.rounds < 0 ? "rounds" : "max_iterations",
                          m->o.rounds < 0 ? m->o.rounds : m->o.max_iterations);
    if (!isfinite(m->o.mask))
        return imp__error(m->ctx, IMP_E_ARG, "options: mask is not finite");
    if (m->o.rounds == 0) m->o.rounds = ROUNDS;
    if (m->o.mask == 0) m->o.mask = MASK;
    IMP_CHECKED(patterns_check(m, "params", m->o.params, m->o.n_params));
    IMP_CHECKED(patterns_check(m, "hold", m->o.hold, m->o.n_hold));
    IMP_CHECKED(holds_take(m));
    for (int s = 0; s < IMP_MEASURE_STAGES; s++) m->wanted[s] = !m->o.stages;
    return m->o.stages ? stages_take(m) : IMP_OK;
}

/* ---- Photographs ----------------------------------------------------------------------- */

static enum imp_status numbers_check(struct imp__measure *m, const struct imp__photo *p)
{
    const struct {
        const char *name;
        double value;
    } given[] = {{"noise", p->desc.noise},
                 {"step", p->desc.step},
                 {"focal_35mm", p->desc.focal_35mm},
                 {"exposure_s", p->desc.exposure_s},
                 {"iso", p->desc.iso},
                 {"f_number", p->desc.f_number},
                 {"read", p->desc.read},
                 {"shot", p->desc.shot},
                 {"relative", p->desc.relative}};
    for (size_t k = 0; k < imp_count(given); k++)
        if (!(given[k].value >= 0) || !isfinite(given[k].value))
            return imp__error(m->ctx, IMP_E_ARG, "%s: %s = %g is not a number >= 0",
                              p->name, given[k].name, given[k].value);
    if (!isfinite(p->desc.low) || !isfinite(p->desc.high))
        return imp__error(m->ctx, IMP_E_ARG, "%s: %s is not finite", p->name,
                          isfinite(p->desc.low) ? "high" : "low");
    if (p->desc.clipped && !(p->desc.low < p->desc.high))
        return imp__error(m->ctx, IMP_E_ARG, "%s: levels %g and %g: not low < high",
                          p->name, p->desc.low, p->desc.high);
    return IMP_OK;
}

/* What is black or clipped all over tells nothing, and is most likely the wrong file. */
static enum imp_status pixels_check(struct imp__measure *m, const struct imp__photo *p)
{
    size_t some = 0, bright = 0, between = 0;
    for (size_t i = 0; i < p->n_values; i++) {
        const double v = (double)p->desc.pixels[i];
        const float *w = p->desc.weights;
        if (!isfinite(v))
            return imp__error(m->ctx, IMP_E_ARG, "%s: a value is not finite", p->name);
        if (w && !(w[i / (size_t)p->desc.channels] >= 0))
            return imp__error(m->ctx, IMP_E_ARG, "%s: a weight is below 0, or no number",
                              p->name);
        if (w && w[i / (size_t)p->desc.channels] == 0) continue;
        some++;
        bright += v > IMP_PHOTOGRAPH_LEAST;
        between += !p->desc.clipped || (v > p->desc.low && v < p->desc.high);
    }
    if (some == 0) return imp__error(m->ctx, IMP_E_ARG, "%s: all weights are 0", p->name);
    if (bright == 0)
        return imp__error(m->ctx, IMP_E_ARG, "%s is black all over", p->name);
    if (between == 0)
        return imp__error(m->ctx, IMP_E_ARG, "%s is clipped all over", p->name);
    return IMP_OK;
}

static enum imp_status photo_take(struct imp__measure *m, size_t i)
{
    struct imp__photo *p = &m->photos[i];
    const struct imp_photo *d = &p->desc;
    const struct imp_scene *s = m->scene;
    if (d->sensor < 0 || d->sensor >= s->n_sensors)
        return imp__error(m->ctx, IMP_E_ARG,
                          "photos[%zu]%s%.200s: there is no sensor %d; the scene has %d",
                          i, d->name ? " " : "", d->name ? d->name : "", d->sensor,
                          s->n_sensors);
    p->sensor = s->sensors[d->sensor];
    p->name = d->name ? d->name : p->sensor->name;
    for (size_t k = 0; k < i; k++)
        if (m->photos[k].desc.sensor == d->sensor)
            return imp__error(m->ctx, IMP_E_ARG,
                              "%s and %s are both of sensor '%s': each photograph has a "
                              "sensor of its own",
                              m->photos[k].name, p->name, p->sensor->name);
    if (p->sensor->film.n_responses > 0)
        return imp__error(m->ctx, IMP_E_UNSUPPORTED,
                          "%s: the film of sensor '%s' has response curves", p->name,
                          p->sensor->name);
    if (d->width != p->sensor->film.crop_w || d->height != p->sensor->film.crop_h)
        return imp__error(m->ctx, IMP_E_ARG,
                          "%s is %d x %d, but sensor '%s' makes %d x %d pixels", p->name,
                          d->width, d->height, p->sensor->name, p->sensor->film.crop_w,
                          p->sensor->film.crop_h);
    if (d->width < LEAST || d->height < LEAST)
        return imp__error(m->ctx, IMP_E_ARG, "%s has %d x %d pixels: %d x %d at least",
                          p->name, d->width, d->height, LEAST, LEAST);
    if (d->channels != s->channels)
        return imp__error(m->ctx, IMP_E_ARG,
                          "%s has %d channels, and the scene's pictures %d", p->name,
                          d->channels, s->channels);
    if (!d->pixels) return imp__error(m->ctx, IMP_E_ARG, "%s: pixels is NULL", p->name);
    p->n_pixels = (size_t)d->width * (size_t)d->height;
    p->n_values = p->n_pixels * (size_t)d->channels;
    IMP_CHECKED(numbers_check(m, p));
    IMP_CHECKED(pixels_check(m, p));
    /* About twelve blocks across, of four values at least in each direction where it has them. */
    p->block = imp_max(2, imp_min(d->width, d->height) / 12);
    p->columns = (d->width + p->block - 1) / p->block;
    p->rows = (d->height + p->block - 1) / p->block;
    p->noise_se = imp__alloc(m->ctx, p->n_values, sizeof(float));
    p->lift = imp__alloc(m->ctx, p->n_values, sizeof(float));
    p->weights = imp__alloc(m->ctx, p->n_pixels, sizeof(float));
    p->left = imp__alloc(m->ctx, p->n_values, sizeof(float));
    p->own = imp__alloc(m->ctx, p->n_values, sizeof(float));
    p->square = imp__alloc(m->ctx, p->n_pixels, sizeof(float));
    p->expected = imp__alloc(m->ctx, p->n_pixels, sizeof(float));
    p->robust = imp__alloc(m->ctx, p->n_pixels, sizeof(float));
    p->edges = imp__alloc(m->ctx, p->n_pixels, sizeof(float));
    p->masked = imp__alloc(m->ctx, (size_t)p->columns * (size_t)p->rows, 1);
    if (!p->noise_se || !p->lift || !p->weights || !p->left || !p->own || !p->square ||
        !p->expected || !p->robust || !p->edges || !p->masked)
        return imp__error(m->ctx, IMP_E_NOMEM, "no memory for %s", p->name);
    for (size_t k = 0; k < p->n_pixels; k++)
        p->weights[k] = d->weights ? d->weights[k] : 1;
    return IMP_OK;
}

enum imp_status imp__measure_photos_take(struct imp__measure *m,
                                         const struct imp_photo *photos, size_t n)
{
    if (n == 0) return imp__error(m->ctx, IMP_E_ARG, "there are no photographs");
    m->photos = imp__alloc(m->ctx, n, sizeof *m->photos);
    if (!m->photos) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for photographs");
    for (size_t i = 0; i < n; i++) {
        struct imp_photo *own = &m->photos[i].desc;
        *own = (struct imp_photo)IMP_PHOTO_INIT;
        m->n_photos = i + 1;
        IMP_CHECKED(imp__element_take(m->ctx, "imp_measure", "photos", photos, i, own,
                                      sizeof *own));
        IMP_CHECKED(photo_take(m, i));
    }
    return IMP_OK;
}

void imp__measure_photos_free(struct imp__measure *m)
{
    for (size_t i = 0; i < m->n_photos; i++) {
        imp__release(m->ctx, m->photos[i].noise_se);
        imp__release(m->ctx, m->photos[i].lift);
        imp__release(m->ctx, m->photos[i].weights);
        imp__release(m->ctx, m->photos[i].square);
        imp__release(m->ctx, m->photos[i].left);
        imp__release(m->ctx, m->photos[i].own);
        imp__release(m->ctx, m->photos[i].expected);
        imp__release(m->ctx, m->photos[i].robust);
        imp__release(m->ctx, m->photos[i].edges);
        imp__release(m->ctx, m->photos[i].masked);
    }
    imp__release(m->ctx, m->photos);
}

/* ---- What a checkpoint belongs to ------------------------------------------------------ */

uint64_t imp__measure_hash(const struct imp__measure *m)
{
    const struct imp_scene *s = m->scene;
    uint64_t h = imp__fingerprint_objects(s);
    for (size_t k = 0; k < s->n_params; k++)
        for (size_t e = 0; e < s->params[k].info.count; e++) {
            const double v = imp__param_get(&s->params[k], e);
            h = imp__hash(h, &v, sizeof v);
        }
    for (size_t i = 0; i < m->n_photos; i++) {
        const struct imp__photo *p = &m->photos[i];
        const double d[] = {p->desc.sensor,     p->desc.clipped,    p->desc.low,
                            p->desc.high,       p->desc.noise,      p->desc.step,
                            p->desc.focal_35mm, p->desc.exposure_s, p->desc.iso,
                            p->desc.f_number,   p->desc.read,       p->desc.shot,
                            p->desc.relative};
        const uint64_t camera = imp__fingerprint_sensor(p->sensor);
        h = imp__hash(h, d, sizeof d);
        h = imp__hash(h, &camera, sizeof camera);
        h = imp__hash_array(h, p->desc.pixels, p->n_values * sizeof(float));
        h = imp__hash_array(h, p->weights, p->n_pixels * sizeof(float));
    }
    const double o[] = {m->o.rounds,           m->o.mask,
                        m->o.max_iterations,   m->run.spp,
                        (double)m->run.points, (double)m->run.from};
    h = imp__hash(h, o, sizeof o);
    h = imp__hash(h, &m->run.seed, sizeof m->run.seed);
    h = imp__hash(h, m->wanted, sizeof m->wanted);
    if (m->held) h = imp__hash(h, m->held, s->n_theta);
    return imp__hash(h, m->stage, s->n_params);
}
