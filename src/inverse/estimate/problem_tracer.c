/* SPDX-License-Identifier: Apache-2.0
 *
 * The tracer of a problem, and the job that rules decide about. */
#include "problem_tracer.h"
#include "film/film_measure.h"
#include "film/film_picture.h"
#include "replicates.h"
#include "scene/media_around.h"
#include "walk/graded/graded.h"
#include "walk/lights/light_walk.h"
#include "walk/path/baseline.h"
#include <string.h>

enum imp_status imp__problem_job(const struct imp_problem *p, const struct imp_run *run,
                                 struct imp_job *job)
{
    const struct imp_sensor *sensor;
    IMP_CHECKED(imp__run_sensor(p->scene, run, &sensor));
    const bool solves = p->scene->integrator->ops->flags & IMP_INTEGRATOR_SOLVES;
    if (!solves && !imp__walk_integrator(p->scene))
        return imp__error(p->ctx, IMP_E_SCENE,
                          "the scene's integrator has no derivative; "
                          "use path, direct or stam");
    *job = imp__job(p->scene, sensor, run, &p->active);
    imp__job_state(job, IMP_HAS_DERIVATIVE, NULL);
    if (solves) imp__job_state(job, IMP_HAS_ELEMENTS, NULL);
    return IMP_OK;
}

enum imp_status imp__problem_tracer(const struct imp_problem *p,
                                    const struct imp_run *run,
                                    const struct imp_wavelengths *waves,
                                    struct imp_tracer *out)
{
    struct imp_job job;
    IMP_CHECKED(imp__problem_job(p, run, &job));
    imp__job_state(&job, IMP_HAS_SINGLE_WALKS, NULL);
    IMP_CHECKED(imp__job_allowed(&job));
    return imp__problem_tracer_of_any_end(p, run, waves, out);
}

enum imp_status imp__problem_tracer_of_any_end(const struct imp_problem *p,
                                               const struct imp_run *run,
                                               const struct imp_wavelengths *waves,
                                               struct imp_tracer *out)
{
    enum imp_status st = IMP_OK;
    struct imp_job job;
    IMP_CHECKED(imp__problem_job(p, run, &job));
    if (p->edge_terms) imp__job_state(&job, IMP_HAS_EDGE_TERMS, NULL);
    imp__job_state(&job, waves ? IMP_HAS_RESPONSE_LOSS : IMP_HAS_PICTURE_DERIVATIVE,
                   NULL);
    IMP_CHECKED(imp__job_allowed(&job));
    const struct imp_sensor *sensor = job.sensor;
    const struct imp_walk_integrator *integrator = job.walks;
    *out = (struct imp_tracer){.scene = p->scene,
                               .integrator = integrator,
                               .sensor = sensor,
                               .active = &p->active,
                               .seed = run->seed,
                               .guide = imp__guide_of(p->scene, integrator, run->guide),
                               .collisions_fixed = integrator->from_lights};
    imp__tracer_numbers(out, run, 0);
    if (imp__problem_moves(p) && imp__media_vary(p->scene))
        out->headroom = IMP_HEADROOM_MOVES;
    if (integrator->from_lights) out->points = NULL; /* groups would share a set */
    if (waves)
        out->wavelengths =
            &waves[run->wavelengths == IMP_WAVELENGTHS_IMPORTANCE ? IMP_WAVES_IMPORTANCE
                                                                  : IMP_WAVES_UNIFORM];
    out->set = 1; /* leave-one-out needs independent walks, or sets */
    if (run->walks) {
        out->collisions_fixed = true;
        return imp__walks_use(run, out);
    }
    st = imp__baseline_set(out, imp__walks_of(run, sensor) * sensor->film.crop_w *
                                    sensor->film.crop_h);
    if (st != IMP_OK) return st;
    return p->active.body ? imp__graded_survey(out) : IMP_OK;
}

void imp__problem_tell(struct imp_problem *p, const struct imp_tracer *tracer)
{
    if (!p->misses_reported)
        imp__light_walks_tell(p->scene, tracer->sensor, tracer->integrator);
    p->misses_reported = true;
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
