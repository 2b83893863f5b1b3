/* SPDX-License-Identifier: Apache-2.0
 *
 * The tracer of a problem, and refusals where its gradient would lack a term. */
#include "problem_tracer.h"
#include "film/film_measure.h"
#include "film/film_picture.h"
#include "replicates.h"
#include "walk/graded/graded.h"
#include "walk/lights/light_walk.h"
#include "walk/path/baseline.h"
#include <string.h>

/* The attached form of the exponent here has neither the gradient of what arrives nor
 * boundary terms (docs/estimators.md 4): it is right only where both are zero, a convex
 * object under a constant environment whose weight does not jump at the horizon. */
static enum imp_status attached_allowed(const struct imp_scene *scene)
{
    bool fine = scene->n_shapes == 1 && !scene->world && scene->environment >= 0 &&
                scene->n_emitters == 1 &&
                scene->emitters[0]->ops->flags & IMP_EMITTER_UNIFORM &&
                scene->shapes[0]->ops->flags & IMP_SHAPE_CONVEX;
    for (int b = 0; fine && b < scene->n_bsdfs; b++)
        if (scene->bsdfs[b]->flags & IMP_BSDF_JUMP)
            return imp__error(
                scene->ctx, IMP_E_BIAS,
                "alpha_gradient=attached has no boundary term for the jump of "
                "material '%s' at the horizon; use variant=reciprocal, or "
                "detached",
                scene->bsdfs[b]->name);
    if (fine) return IMP_OK;
    return imp__error(
        scene->ctx, IMP_E_BIAS,
        "alpha_gradient=attached is unbiased only for one convex shape under a "
        "constant environment; use detached");
}

/* Light sampling alone never samples a light where its emission is 0, so it misses the
 * derivative there. */
static enum imp_status gaps_allowed(const struct imp_problem *p,
                                    const struct imp_walk_integrator *integrator)
{
    if (integrator->directions) return IMP_OK;
    for (int i = 0; i < p->scene->n_emitters; i++) {
        const struct imp_emitter *e = p->scene->emitters[i];
        if (e->ops->flags & IMP_EMITTER_GAPS && p->active.emitter[i])
            return imp__error(p->ctx, IMP_E_BIAS,
                              "light '%s' (%s) is sampled only where it shines, so "
                              "direct without bsdf_samples has not the whole derivative",
                              e->name, e->ops->name);
    }
    return IMP_OK;
}

enum imp_status imp__problem_tracer(const struct imp_problem *p,
                                    const struct imp_run *run,
                                    const struct imp_wavelengths *waves,
                                    struct imp_tracer *out)
{
    const enum imp_status st = imp__problem_tracer_of_any_end(p, run, waves, out);
    if (st != IMP_OK || !out->integrator->from_lights) return st;
    return imp__error(
        p->ctx, IMP_E_UNSUPPORTED,
        "walks from the lights make pictures, losses and their derivatives, "
        "but not this; let walks begin at the sensor");
}

enum imp_status imp__problem_tracer_of_any_end(const struct imp_problem *p,
                                               const struct imp_run *run,
                                               const struct imp_wavelengths *waves,
                                               struct imp_tracer *out)
{
    const struct imp_sensor *sensor;
    enum imp_status st = imp__run_sensor(p->scene, run, &sensor);
    if (st != IMP_OK) return st;
    const struct imp_walk_integrator *integrator = imp__walk_integrator(p->scene);
    if (p->scene->integrator->ops->flags & IMP_INTEGRATOR_SOLVES)
        return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                          "integrator elements makes no walks, and has derivatives of "
                          "its own: imp_elements_sensitivity (importon elements "
                          "--sensitivity); for walks use path, direct or stam");
    if (!integrator)
        return imp__error(p->ctx, IMP_E_SCENE,
                          "the scene's integrator has no derivative; "
                          "use path, direct or stam");
    if (run->from != IMP_FROM_SCENE && !imp__walk_integrator_of(p->scene->integrator))
        return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                          "integrator %s: the end at which walks begin is chosen for "
                          "integrators of walks alone",
                          p->scene->integrator->ops->name);
    st = imp__walks_from(p->scene, integrator, run->from, &integrator);
    if (st != IMP_OK) return st;
    if (integrator->from_lights) {
        st = imp__light_walks_allowed(p->scene, sensor, integrator, &p->active);
        if (st == IMP_OK)
            st = imp__guide_lights_allowed(p->scene, integrator, run->guide);
        if (st != IMP_OK) return st;
    }
    if (integrator->alpha_gradient == IMP_ALPHA_ATTACHED) {
        st = attached_allowed(p->scene);
        if (st != IMP_OK) return st;
    }
    st = gaps_allowed(p, integrator);
    if (st != IMP_OK) return st;
    *out = (struct imp_tracer){.scene = p->scene,
                               .integrator = integrator,
                               .sensor = sensor,
                               .active = &p->active,
                               .seed = run->seed,
                               .guide = imp__guide_of(p->scene, integrator, run->guide),
                               .collisions_stand = integrator->from_lights};
    if (!waves && sensor->film.n_responses > 0 && sensor->film.n_responses != 3)
        return imp__error(
            p->ctx, IMP_E_UNSUPPORTED,
            "derivatives of pictures are of films with three channels; this "
            "specfilm has %d response curves (a loss takes any number)",
            sensor->film.n_responses);
    imp__tracer_numbers(out, run, 0);
    if (integrator->from_lights) out->points = NULL; /* groups would share a set */
    if (waves)
        out->wavelengths =
            &waves[run->wavelengths == IMP_WAVELENGTHS_IMPORTANCE ? IMP_WAVES_IMPORTANCE
                                                                  : IMP_WAVES_UNIFORM];
    out->set = 1; /* leave-one-out needs independent walks, or sets */
    if (run->walks) {
        if (waves)
            return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                              "losses of films with other than three response curves "
                              "have several walks for each sample; none are kept");
        out->collisions_stand = true;
        return imp__walks_use(run, out);
    }
    st = imp__baseline_set(out, imp__walks_of(run, sensor) * sensor->film.crop_w *
                                    sensor->film.crop_h);
    if (st != IMP_OK) return st;
    return p->active.body ? imp__graded_survey(out) : IMP_OK;
}

void imp__problem_tell(struct imp_problem *p, const struct imp_tracer *tracer)
{
    if (!p->missing_told)
        imp__light_walks_tell(p->scene, tracer->sensor, tracer->integrator);
    p->missing_told = true;
}

enum imp_status imp__target_tracer(const struct imp_problem *p,
                                   const struct imp__target *target, int part,
                                   struct imp_run *run, struct imp_tracer *out)
{
    const struct imp_wavelengths *waves = target->of_curves ? target->waves : NULL;
    run->sensor = target->desc.sensor;
    /* A seed for each part makes the parts independent. */
    run->seed += (uint64_t)part * UINT64_C(0x9e3779b97f4a7c15);
    const enum imp_status st = imp__problem_tracer_of_any_end(p, run, waves, out);
    if (target->photograph.pixels) out->photograph = &target->photograph;
    return st;
}
