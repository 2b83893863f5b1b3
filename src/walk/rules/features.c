/* SPDX-License-Identifier: Apache-2.0
 *
 * How the features of a job are found (features.h): one predicate each. */
#include "features.h"

#include "base/team.h"
#include "kind/sensor/receiver.h"
#include "scene/guide.h"
#include "scene/media_around.h"
#include "scene/pose.h"
#include "walk/kept/store.h"
#include "walk/media/tracking.h"

#define FOUND(name)                                                                      \
    static bool found_##name(const struct imp_job *j, struct imp_bearer *by)
#define BEARS(object)                                                                    \
    (*by = (struct imp_bearer){.name = (object)->name, .kind = (object)->ops->name})

/* ---- Integrators ------------------------------------------------------------------- */

/* A condition of the walks, and no object bears it. */
#define OF_WALKS(feature, condition)                                                     \
    FOUND(feature)                                                                       \
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

FOUND(NO_WALKS)
{
    (void)by;
    return !imp__walk_integrator(j->scene);
}
FOUND(NO_PLAIN_WALKS)
{
    (void)by;
    return !imp__walk_integrator_of(j->scene->integrator);
}
FOUND(END_CHOSEN)
{
    (void)by;
    return j->run && j->run->from != IMP_FROM_SCENE;
}
FOUND(ONE_END)
{
    (void)by;
    return !j->walks && imp__walk_integrator(j->scene) != NULL;
}
FOUND(HIDDEN_AREA_LIGHTS)
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
FOUND(GUIDE)
{
    (void)by;
    return guide_of(j) != NULL;
}
FOUND(GUIDE_WITHOUT_IMPORTANCE)
{
    (void)by;
    return guide_of(j) && !guide_of(j)->importance;
}
FOUND(GUIDE_ROULETTE)
{
    (void)by;
    return guide_of(j) && guide_of(j)->roulette > 0;
}

/* ---- Scenes ------------------------------------------------------------------------ */

/* Where records are read, nothing is traced. */
FOUND(NO_GEOMETRY)
{
    return j->scene->rayless && !imp__job_has(j, IMP_HAS_RECORDING, by);
}
FOUND(MEDIA)
{
    if (j->scene->n_media == 0) return false;
    *by = (struct imp_bearer){.name = j->scene->media[0]->name};
    return true;
}
FOUND(GRADED_MEDIA)
{
    (void)by;
    return j->scene->n_bodies > 0;
}
FOUND(EMITTING_MEDIUM)
{
    for (int m = 0; m < j->scene->n_media; m++)
        if (j->scene->media[m]->emits) {
            *by = (struct imp_bearer){.name = j->scene->media[m]->name};
            return true;
        }
    return false;
}
FOUND(PRIORITIES)
{
    (void)by;
    return j->scene->priorities != NULL;
}

/* The first material with `flag`; NULL: none. */
static const struct imp_bsdf *material_with(const struct imp_job *j, unsigned flag)
{
    for (int b = 0; b < j->scene->n_bsdfs; b++)
        if (j->scene->bsdfs[b]->flags & flag) return j->scene->bsdfs[b];
    return NULL;
}
/* The material in it, or it itself, whose directions are turned. */
static const struct imp_bsdf *turned_of(const struct imp_bsdf *b)
{
    for (int k = 0; k < b->n_child; k++)
        if (b->child[k]->flags & IMP_BSDF_TURNED) return turned_of(b->child[k]);
    return b;
}
FOUND(TURNED_MATERIAL)
{
    const struct imp_bsdf *b = material_with(j, IMP_BSDF_TURNED);
    if (!b) return false;
    b = turned_of(b);
    BEARS(b);
    by->more = b->n_child ? "shades about normals of its own"
                          : "is a fibre, which light enters where it is seen";
    return true;
}
/* Is what the material emits 0, whatever is differentiated? */
static bool is_dark(const struct imp_bsdf *b, const struct imp_active *active)
{
    for (int j = 0; j < b->n_own; j++) {
        const struct imp_input *in = b->input[j];
        if (b->ops->inputs[j].role != IMP_EMISSION) continue;
        if (in->texture || !imp__is_zero(in->value)) return false;
        if (active && in->param >= 0 && active->base[in->param] >= 0) return false;
    }
    for (int k = 0; k < b->n_child; k++)
        if (!is_dark(b->child[k], active)) return false;
    return true;
}
FOUND(GLOWING_MATERIAL)
{
    for (int b = 0; b < j->scene->n_bsdfs; b++) {
        const struct imp_bsdf *m = j->scene->bsdfs[b];
        if (!(m->flags & IMP_BSDF_EMIT) || is_dark(m, j->active)) continue;
        BEARS(m);
        return true;
    }
    return false;
}
FOUND(STRAIGHT_MATERIAL)
{
    for (int b = 0; j->walks && j->walks->media && b < j->scene->n_bsdfs; b++) {
        const struct imp_bsdf *m = j->scene->bsdfs[b];
        if (!m->straight || m->flags & IMP_BSDF_NULL) continue;
        BEARS(m);
        return true;
    }
    return false;
}
FOUND(JUMPING_MATERIAL)
{
    const struct imp_scene *s = j->scene;
    const struct imp_bsdf *b = material_with(j, IMP_BSDF_JUMP);
    struct imp_bearer nobody;
    if (!b || imp__job_has(j, IMP_HAS_NOT_ONE_CONVEX, &nobody) || !s) return false;
    BEARS(b);
    return true;
}
/* The attached form of the exponent here has neither the gradient of what arrives nor
 * boundary terms (docs/estimators.md 4): it is right only where both are zero, a convex
 * object under a constant environment whose weight does not jump at the horizon. */
FOUND(NOT_ONE_CONVEX)
{
    (void)by;
    const struct imp_scene *s = j->scene;
    return !(s->n_shapes == 1 && !s->world && s->environment >= 0 && s->n_emitters == 1 &&
             s->emitters[0]->ops->flags & IMP_EMITTER_UNIFORM &&
             s->shapes[0]->ops->flags & IMP_SHAPE_CONVEX);
}

/* ---- Lights ------------------------------------------------------------------------ */

FOUND(SILENT_LIGHT)
{
    for (int k = 0; k < j->scene->n_emitters; k++) {
        const struct imp_emitter *e = j->scene->emitters[k];
        if (e->ops->sample_emission && e->ops->pdf_emission &&
            !(e->shape && !e->shape->ops->sample_area))
            continue;
        BEARS(e);
        return true;
    }
    return false;
}
FOUND(UNSAMPLED_LIGHT)
{
    for (int k = 0; k < j->scene->n_emitters; k++)
        if (j->scene->emitters[k]->weight == 0) {
            BEARS(j->scene->emitters[k]);
            return true;
        }
    return false;
}
/* Light sampling alone never samples a light where its emission is 0, so it misses the
 * derivative there. */
FOUND(GAPPED_LIGHT_ACTIVE)
{
    for (int k = 0; j->active && k < j->scene->n_emitters; k++) {
        const struct imp_emitter *e = j->scene->emitters[k];
        if (!(e->ops->flags & IMP_EMITTER_GAPS) || !j->active->emitter[k]) continue;
        BEARS(e);
        return true;
    }
    return false;
}
FOUND(SKY)
{
    if (j->scene->environment < 0) return false;
    BEARS(j->scene->emitters[j->scene->environment]);
    return true;
}
/* Does the sensor's medium go on outside of everything, and does a light lie there? */
FOUND(LIGHT_BEYOND_MEDIUM)
{
    if (!j->sensor || !j->sensor->medium) return false;
    const struct imp_ball *ball = j->sensor->scene;
    const imp_v3 up = imp__v3(0, 0, 2 * ball->radius);
    for (int k = 0; k < j->scene->n_emitters; k++) {
        const struct imp_emitter *e = j->scene->emitters[k];
        if (!(e->ops->flags & (IMP_EMITTER_ENVIRONMENT | IMP_EMITTER_FAR)) || e->shape)
            continue;
        *by = (struct imp_bearer){.name = j->sensor->medium->name, .more = e->name};
        return imp__medium_around(j->scene, ball->centre + up, imp__v3(0, 0, -1),
                                  j->sensor->medium) != NULL;
    }
    return false;
}

/* ---- Sensors and films ------------------------------------------------------------- */

#define OF_SENSOR(feature, condition)                                                    \
    FOUND(feature)                                                                       \
    {                                                                                    \
        const struct imp_sensor *s = j->sensor;                                          \
        if (!s || !(condition)) return false;                                            \
        BEARS(s);                                                                        \
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
FOUND(NOT_THREE_RESPONSES)
{
    const struct imp_sensor *s = j->sensor;
    if (!s || s->film.n_responses == 0 || s->film.n_responses == 3) return false;
    BEARS(s);
    by->number = (size_t)s->film.n_responses;
    return true;
}
OF_SENSOR(ALPHA, s->film.n_responses == 0 &&
                     (s->film.pixel_format == IMP_PIXEL_LUMINANCE_ALPHA ||
                      s->film.pixel_format == IMP_PIXEL_RGBA ||
                      s->film.pixel_format == IMP_PIXEL_XYZA))

/* ---- Runs -------------------------------------------------------------------------- */

#define OF_RUN(feature, condition)                                                       \
    FOUND(feature)                                                                       \
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

/* ---- Active parameters ------------------------------------------------------------- */

/* Where collisions are drawn depends on the extinction. With fixed collisions the
 * derivative is complete only where every collision had a chance to be drawn. */
static const struct imp_medium *extinction_active(const struct imp_job *j, bool field)
{
    for (int m = 0; j->active && j->active->medium && m < j->scene->n_media; m++) {
        const struct imp_medium *medium = j->scene->media[m];
        imp_spec in[IMP_INPUTS_MAX];
        if (!j->active->medium[m]) continue;
        if (field ? medium->majorants != NULL
                  : !medium->majorants &&
                        imp__is_zero(imp__extinction_at(medium, (imp_v3){0}, NULL, in)))
            return medium;
    }
    return NULL;
}
FOUND(EXTINCTION_FIELD_ACTIVE)
{
    const struct imp_medium *m = extinction_active(j, true);
    if (m) *by = (struct imp_bearer){.name = m->name};
    return m != NULL;
}
FOUND(EXTINCTION_ZERO_ACTIVE)
{
    const struct imp_medium *m = extinction_active(j, false);
    if (m) *by = (struct imp_bearer){.name = m->name};
    return m != NULL;
}
FOUND(POSE_ACTIVE)
{
    for (const struct imp_pose *p = j->active ? j->scene->poses : NULL; p; p = p->next) {
        if (j->active->base[p->param] < 0 || !imp__pose_moves(p)) continue;
        *by = (struct imp_bearer){.name = j->scene->params[p->param].info.name};
        return true;
    }
    return false;
}
FOUND(VOLUME_JUMPS)
{
    for (const struct imp_pose *p = j->active ? j->scene->poses : NULL; p; p = p->next) {
        if (j->active->base[p->param] < 0 || imp__pose_moves(p)) continue;
        const struct imp_medium *m = imp__volume_jumps(j->scene, p);
        if (!m) continue;
        *by = (struct imp_bearer){.name = j->scene->params[p->param].info.name,
                                  .more = m->name};
        return true;
    }
    return false;
}
FOUND(RAYS_ACTIVE)
{
    (void)by;
    return j->active && j->active->body;
}
FOUND(COLLISIONS_ACTIVE)
{
    for (size_t k = 0; j->active && k < j->scene->n_params; k++) {
        const struct imp_param *p = &j->scene->params[k];
        if (j->active->base[k] < 0 || !p->probed) continue;
        *by = (struct imp_bearer){.name = p->info.name};
        return true;
    }
    return false;
}

/* ---- All --------------------------------------------------------------------------- */

static bool (*const found[])(const struct imp_job *, struct imp_bearer *) = {
#define X(name, text) found_##name,
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
