/* SPDX-License-Identifier: Apache-2.0
 *
 * The reasons to refuse walks from the lights, and what they cannot find. */
#include "light_walk.h"
#include "scene/media_around.h"
#include "walk/media/tracking.h"

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

/* The material in it, or it itself, whose directions are turned. */
static const struct imp_bsdf *turned_of(const struct imp_bsdf *b)
{
    for (int k = 0; k < b->n_child; k++)
        if (b->child[k]->flags & IMP_BSDF_TURNED) return turned_of(b->child[k]);
    return b;
}

/* Nothing but lights may emit, and each must be able to send a walk. */
static enum imp_status emission_allowed(const struct imp_scene *scene,
                                        const struct imp_active *active)
{
    imp_context *ctx = scene->ctx;
    for (int i = 0; i < scene->n_emitters; i++) {
        const struct imp_emitter *e = scene->emitters[i];
        if (!e->ops->sample_emission || !e->ops->pdf_emission ||
            (e->shape && !e->shape->ops->sample_area))
            return imp__error(ctx, IMP_E_UNSUPPORTED,
                              "walks from the lights: no walk can begin at light '%s' "
                              "(%s); let walks begin at the sensor",
                              e->name, e->ops->name);
        if (e->weight == 0)
            return imp__error(
                ctx, IMP_E_UNSUPPORTED,
                "walks from the lights: light '%s' (%s) has sampling_weight "
                "0, and no walk would begin there",
                e->name, e->ops->name);
    }
    for (int m = 0; m < scene->n_media; m++)
        if (scene->media[m]->emits)
            return imp__error(ctx, IMP_E_UNSUPPORTED,
                              "walks from the lights: medium '%s' emits, and no walk "
                              "begins there; let walks begin at the sensor",
                              scene->media[m]->name);
    for (int b = 0; b < scene->n_bsdfs; b++)
        if (scene->bsdfs[b]->flags & IMP_BSDF_TURNED) {
            const struct imp_bsdf *m = turned_of(scene->bsdfs[b]);
            return imp__error(ctx, IMP_E_UNSUPPORTED,
                              "walks from the lights: material '%s' (%s) %s; let walks "
                              "begin at the sensor",
                              m->name, m->ops->name,
                              m->n_child
                                  ? "shades about normals of its own"
                                  : "is a fibre, which light enters where it is seen");
        }
    for (int b = 0; b < scene->n_bsdfs; b++)
        if (scene->bsdfs[b]->flags & IMP_BSDF_EMIT && !is_dark(scene->bsdfs[b], active))
            return imp__error(ctx, IMP_E_UNSUPPORTED,
                              "walks from the lights: material '%s' (%s) glows, and no "
                              "walk begins there; let walks begin at the sensor",
                              scene->bsdfs[b]->name, scene->bsdfs[b]->ops->name);
    if (scene->n_bodies > 0)
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "walks from the lights: they do not bend in media of graded "
                          "index; let walks begin at the sensor");
    return IMP_OK;
}

/* A light infinitely far away; NULL: there is none. */
static const struct imp_emitter *far_light(const struct imp_scene *scene)
{
    for (int i = 0; i < scene->n_emitters; i++)
        if (scene->emitters[i]->ops->flags &
                (IMP_EMITTER_ENVIRONMENT | IMP_EMITTER_FAR) &&
            !scene->emitters[i]->shape)
            return scene->emitters[i];
    return NULL;
}

/* Does the sensor's medium go on outside of everything? */
static bool is_endless(const struct imp_scene *scene, const struct imp_sensor *sensor)
{
    if (!sensor->medium) return false;
    const struct imp_ball *ball = sensor->scene;
    const imp_v3 up = imp__v3(0, 0, 2 * ball->radius);
    return imp__medium_around(scene, ball->centre + up, imp__v3(0, 0, -1),
                              sensor->medium) != NULL;
}

static enum imp_status sensor_allowed(const struct imp_scene *scene,
                                      const struct imp_sensor *sensor,
                                      const struct imp_walk_integrator *integrator)
{
    imp_context *ctx = scene->ctx;
    if (!sensor->ops->connect)
        return imp__error(
            ctx, IMP_E_UNSUPPORTED,
            "walks from the lights: sensor '%s' (%s) measures one ray, which "
            "they never meet; let walks begin at the sensor",
            sensor->name, sensor->ops->name);
    if (sensor->gain)
        return imp__error(
            ctx, IMP_E_UNSUPPORTED,
            "walks from the lights: the film of sensor '%s' has an exposure; "
            "let walks begin at the sensor",
            sensor->name);
    if (!integrator->lights && !sensor->shape)
        return imp__error(
            ctx, IMP_E_UNSUPPORTED,
            "photons from the lights: sensor '%s' (%s) is no surface, which "
            "they could meet; use ptracer, or an irradiancemeter",
            sensor->name, sensor->ops->name);
    if (scene->environment >= 0 && (sensor->ops->flags & IMP_SENSOR_PARALLEL))
        return imp__error(
            ctx, IMP_E_UNSUPPORTED,
            "walks from the lights: sensor '%s' (%s) has one direction, in "
            "which light '%s' is never drawn; let walks begin at the sensor",
            sensor->name, sensor->ops->name, scene->emitters[scene->environment]->name);
    const struct imp_emitter *far = far_light(scene);
    if (far && is_endless(scene, sensor))
        return imp__error(
            ctx, IMP_E_UNSUPPORTED,
            "walks from the lights: medium '%s' has no end, and light '%s' lies "
            "beyond it; let walks begin at the sensor",
            sensor->medium->name, far->name);
    bool area = false;
    for (int i = 0; i < scene->n_emitters; i++) area |= scene->emitters[i]->shape != NULL;
    if (integrator->hide_emitters && area &&
        (sensor->shape || (integrator->media && scene->n_media > 0)))
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "walks from the lights: with hide_emitters they pass no light "
                          "on their way through media or to a surface; let walks begin "
                          "at the sensor");
    return IMP_OK;
}

/* Weights of samples from both ends count the vertices of a path, so every way must find
 * the same ones, and film positions of both walks must have the same bounds. */
static enum imp_status both_allowed(const struct imp_scene *scene,
                                    const struct imp_sensor *sensor,
                                    const struct imp_walk_integrator *integrator)
{
    for (int b = 0; integrator->media && b < scene->n_bsdfs; b++)
        if (scene->bsdfs[b]->straight && !(scene->bsdfs[b]->flags & IMP_BSDF_NULL))
            return imp__error(
                scene->ctx, IMP_E_UNSUPPORTED,
                "integrator bdpt: connections through media pass material '%s' (%s), "
                "which lets light go straight on and is a vertex of walks; use volpath "
                "or ptracer",
                scene->bsdfs[b]->name, scene->bsdfs[b]->ops->name);
    if (sensor->ops->flags & IMP_SENSOR_GROUP)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "integrator bdpt: sensor '%s' (%s) is several, and weights of "
                          "both ends are those of one; use path or ptracer",
                          sensor->name, sensor->ops->name);
    if (sensor->film.sample_border)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "integrator bdpt: the film of sensor '%s' has sample_border, "
                          "and walks from the sensor begin inside of the picture alone; "
                          "set it to false, or use path or ptracer",
                          sensor->name);
    return IMP_OK;
}

/* Where collisions are drawn depends on the extinction. That they stand still makes a
 * derivative that is whole only where every collision had a chance to be drawn. */
static enum imp_status media_allowed(const struct imp_scene *scene,
                                     const struct imp_active *active)
{
    for (int m = 0; active->medium && m < scene->n_media; m++) {
        const struct imp_medium *medium = scene->media[m];
        imp_spec in[IMP_INPUTS_MAX];
        if (!active->medium[m]) continue;
        if (medium->majorants)
            return imp__error(scene->ctx, IMP_E_BIAS,
                              "walks from the lights: the derivative with respect to the "
                              "extinction of medium '%s', which varies, is not whole "
                              "where it is 0; let walks begin at the sensor",
                              medium->name);
        if (imp__is_zero(imp__extinction_at(medium, (imp_v3){0}, NULL, in)))
            return imp__error(
                scene->ctx, IMP_E_BIAS,
                "walks from the lights: the extinction of medium '%s' is 0, "
                "and what it would scatter is not in the derivative; let "
                "walks begin at the sensor",
                medium->name);
    }
    return IMP_OK;
}

enum imp_status imp__light_walks_allowed(const struct imp_scene *scene,
                                         const struct imp_sensor *sensor,
                                         const struct imp_walk_integrator *integrator,
                                         const struct imp_active *active)
{
    enum imp_status st = IMP_OK;
    IMP_TRY(emission_allowed(scene, active));
    IMP_TRY(sensor_allowed(scene, sensor, integrator));
    if (integrator->both) IMP_TRY(both_allowed(scene, sensor, integrator));
    if (active) IMP_TRY(media_allowed(scene, active));
out:
    return st;
}

const struct imp_bsdf *imp__delta_bsdf(const struct imp_scene *scene)
{
    for (int b = 0; b < scene->n_bsdfs; b++)
        if (scene->bsdfs[b]->flags & IMP_BSDF_DELTA &&
            !(scene->bsdfs[b]->flags & IMP_BSDF_NULL))
            return scene->bsdfs[b];
    return NULL;
}

const struct imp_bsdf *imp__light_walks_miss(const struct imp_scene *scene,
                                             const struct imp_sensor *sensor,
                                             const struct imp_walk_integrator *integrator)
{
    if (!integrator->from_lights || integrator->both || sensor->shape) return NULL;
    return imp__delta_bsdf(scene);
}

void imp__light_walks_tell(const struct imp_scene *scene, const struct imp_sensor *sensor,
                           const struct imp_walk_integrator *integrator)
{
    const struct imp_bsdf *b = imp__light_walks_miss(scene, sensor, integrator);
    if (b)
        imp__warn(
            scene->ctx,
            "walks from the lights: light that material '%s' (%s) mirrors or refracts "
            "straight to sensor '%s' (%s) is missing; let walks begin at the sensor, "
            "or at both ends (bdpt)",
            b->name, b->ops->name, sensor->name, sensor->ops->name);
}
