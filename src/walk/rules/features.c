/* SPDX-License-Identifier: Apache-2.0
 *
 * How the features of a job are found (features.h), and those of its integrator, guide, sensor
 * and run. */
#include "found.h"

#include "base/team.h"
#include "kind/sensor/receiver.h"
#include "scene/guide.h"
#include "walk/kept/store.h"

/* ---- Integrators ------------------------------------------------------------------- */

/* A condition of the walks, and no object bears it. */
#define OF_WALKS(feature, condition)                                                     \
    IMP_FOUND(feature)                                                                   \
    {                                                                                    \
        (void)by;                                                                        \
        const struct imp_walk_integrator *i = j->walks;                                  \
        return i && (condition);                                                         \
    }
OF_WALKS(LIGHT_TRACING, i->from_lights)
OF_WALKS(BIDIRECTIONAL, i->both)
OF_WALKS(LIGHT_PHOTONS, i->from_lights && !i->lights)
OF_WALKS(ABSORPTION, i->ends_by == IMP_ENDS_BY_ABSORPTION)
OF_WALKS(ATTACHED, i->alpha_gradient == IMP_ALPHA_ATTACHED)
OF_WALKS(MOVING_DIRECTIONS, i->alpha_gradient != IMP_ALPHA_DETACHED)
OF_WALKS(LIGHTS_ALONE, !i->directions)
OF_WALKS(DELTA_TRACKING, i->transmittance == IMP_DELTA_TRACKING)
OF_WALKS(HIDDEN_LIGHTS, i->hide_emitters)

IMP_FOUND(NO_WALKS)
{
    (void)by;
    return !imp__walk_integrator(j->scene);
}
IMP_FOUND(NO_PLAIN_WALKS)
{
    (void)by;
    return !imp__walk_integrator_of(j->scene->integrator);
}
IMP_FOUND(END_CHOSEN)
{
    (void)by;
    return j->run && j->run->from != IMP_FROM_SCENE;
}
IMP_FOUND(ONE_END)
{
    (void)by;
    return !j->walks && imp__walk_integrator(j->scene) != NULL;
}
IMP_FOUND(HIDDEN_AREA_LIGHTS)
{
    (void)by;
    const struct imp_walk_integrator *i = j->walks;
    const bool clear =
        !(j->sensor && j->sensor->shape) && !(i && i->media && j->scene->n_media > 0);
    for (int k = 0; i && i->hide_emitters && !clear && k < j->scene->n_emitters; k++)
        if (j->scene->emitters[k]->shape) return true;
    return false;
}

/* ---- Guides ------------------------------------------------------------------------ */

static const struct imp_guide *guide_of(const struct imp_job *j)
{
    return j->run ? j->run->guide : NULL;
}
IMP_FOUND(GUIDE)
{
    (void)by;
    return guide_of(j) != NULL;
}
IMP_FOUND(GUIDE_WITHOUT_IMPORTANCE)
{
    (void)by;
    return guide_of(j) && !guide_of(j)->importance;
}
IMP_FOUND(GUIDE_ROULETTE)
{
    (void)by;
    return guide_of(j) && guide_of(j)->roulette > 0;
}

/* ---- Sensors and films ------------------------------------------------------------- */

#define OF_SENSOR(feature, condition)                                                    \
    IMP_FOUND(feature)                                                                   \
    {                                                                                    \
        const struct imp_sensor *s = j->sensor;                                          \
        if (!s || !(condition)) return false;                                            \
        IMP_BEARS(s);                                                                    \
        return true;                                                                     \
    }
OF_SENSOR(PARALLEL_SENSOR, s->ops->flags &IMP_SENSOR_PARALLEL)
OF_SENSOR(RAY_SENSOR, !s->ops->connect)
OF_SENSOR(SURFACE_SENSOR, s->shape)
OF_SENSOR(UNMET_SENSOR, imp__is_unmet(s))
OF_SENSOR(CAMERA, !s->shape)
OF_SENSOR(SENSOR_GROUP, s->ops->flags &IMP_SENSOR_GROUP)
OF_SENSOR(EXPOSURE, s->gain)
OF_SENSOR(SAMPLED_BORDER, s->film.sample_border)
OF_SENSOR(RESPONSES, s->film.n_responses > 0)
IMP_FOUND(NOT_THREE_RESPONSES)
{
    const struct imp_sensor *s = j->sensor;
    if (!s || s->film.n_responses == 0 || s->film.n_responses == 3) return false;
    IMP_BEARS(s);
    by->number = (size_t)s->film.n_responses;
    return true;
}
OF_SENSOR(ALPHA, s->film.n_responses == 0 &&
                     (s->film.pixel_format == IMP_PIXEL_LUMINANCE_ALPHA ||
                      s->film.pixel_format == IMP_PIXEL_RGBA ||
                      s->film.pixel_format == IMP_PIXEL_XYZA))

/* ---- Runs -------------------------------------------------------------------------- */

#define OF_RUN(feature, condition)                                                       \
    IMP_FOUND(feature)                                                                   \
    {                                                                                    \
        (void)by;                                                                        \
        return condition;                                                                \
    }
OF_RUN(RECORDED_WALKS, j->run && j->run->walks)
OF_RUN(SPREAD_WALKS, j->run && j->run->walks && j->run->walks->spread)
OF_RUN(TIME_LIMIT, j->run && j->run->time_limit_s > 0)
OF_RUN(PARTS, imp__team_apart(j->ctx))
OF_RUN(PROCESSES, imp__team_shares(j->ctx))
OF_RUN(RANKS, imp__team_ranks(j->ctx))

/* ---- All --------------------------------------------------------------------------- */

static bool (*const found[])(const struct imp_job *, struct imp_bearer *) = {
#define X(name, text) imp__found_##name,
    IMP_FOUND_FEATURES(X)
#undef X
};

bool imp__job_has(const struct imp_job *job, enum imp_feature feature,
                  struct imp_bearer *by)
{
    if (feature == IMP_HAS_ANY) return true;
    if (feature == IMP_HAS_DECLARED)
        return job->ctx->declared && job->ctx->declared->found(job, by);
    if (!job->scene && feature < IMP_HAS_RECORDED_WALKS) return false; /* of scenes */
    if ((size_t)feature < imp_count(found)) return found[feature](job, by);
    for (int k = 0; k < job->n_stated; k++)
        if (job->stated[k].feature == feature) {
            *by = job->stated[k].by;
            return true;
        }
    return false;
}

struct imp_job imp__job(const struct imp_scene *scene, const struct imp_sensor *sensor,
                        const struct imp_run *run, const struct imp_active *active)
{
    const struct imp_walk_integrator *walks = imp__walk_integrator(scene);
    return (struct imp_job){.ctx = scene->ctx,
                            .scene = scene,
                            .sensor = sensor,
                            .walks = run ? imp__walks_from(walks, run->from) : walks,
                            .run = run,
                            .active = active};
}

void imp__job_state(struct imp_job *job, enum imp_feature feature,
                    const struct imp_bearer *by)
{
    if (job->n_stated < IMP_STATED_MAX)
        job->stated[job->n_stated++] =
            (struct imp_stated){feature, by ? *by : (struct imp_bearer){0}};
}
