/* SPDX-License-Identifier: Apache-2.0
 *
 * What goes with what. A job is what a call asks for: a scene, one of its sensors, how walks are
 * made, and what becomes of them. A feature is something that a job has or has not, found in
 * it by a predicate (found.h) or stated by the call. A rule (rules.def): a
 * feature excludes or needs another one, and why; imp__job_allowed decides and
 * refuses. What is no pair of features (a missing end, no walks at all) is refused where it
 * is found.
 *
 * A new feature is a line here, a predicate, and its rules. */
#ifndef IMP_WALK_FEATURES_H
#define IMP_WALK_FEATURES_H

#include "walk/core/walk_integrator.h"

struct imp_active;

/* X(NAME, what users call it): found in a job by a predicate (found.h). */
#define IMP_FOUND_FEATURES(X)                                                            \
    X(LIGHT_TRACING, "light walks")                                                      \
    X(BIDIRECTIONAL, "bidirectional walks (bdpt)")                                       \
    X(LIGHT_PHOTONS, "photons from the lights")                                          \
    X(NO_WALKS, "an integrator without walks (elements, depth)")                         \
    X(NO_PLAIN_WALKS,                                                                    \
      "an integrator that is not one of walks alone (elements, depth, aov, moment)")     \
    X(ONE_END, "an integrator whose walks begin at the sensor alone")                    \
    X(END_CHOSEN, "a chosen end of walks (--from)")                                      \
    X(ABSORPTION, "emission collected where walks are absorbed (stam)")                  \
    X(ATTACHED, "alpha_gradient=attached")                                               \
    X(MOVING_DIRECTIONS, "alpha_gradient other than detached")                           \
    X(LIGHTS_ALONE, "light samples without directions (direct, bsdf_samples=0)")         \
    X(DELTA_TRACKING, "transmittance=delta")                                             \
    X(HIDDEN_LIGHTS, "hide_emitters")                                                    \
    X(HIDDEN_AREA_LIGHTS,                                                                \
      "hide_emitters, area lights, and media or a sensor that is a surface")             \
    X(GUIDE, "a guide")                                                                  \
    X(GUIDE_WITHOUT_IMPORTANCE, "a guide without importance")                            \
    X(GUIDE_ROULETTE, "roulette by a guide")                                             \
    X(NO_GEOMETRY, "a scene from a file of recorded walks")                              \
    X(MEDIA, "media")                                                                    \
    X(GRADED_MEDIA, "media of graded index")                                             \
    X(EMITTING_MEDIUM, "a medium that emits")                                            \
    X(PRIORITIES, "shapes with a priority")                                              \
    X(TURNED_MATERIAL, "a material with normals of its own, or a fibre")                 \
    X(GLOWING_MATERIAL, "a material that emits")                                         \
    X(STRAIGHT_MATERIAL, "a material that light passes straight on, in media")           \
    X(JUMPING_MATERIAL, "a material that jumps at the horizon")                          \
    X(NOT_ONE_CONVEX, "anything but one convex shape under a constant environment")      \
    X(SILENT_LIGHT, "a light where no walk can begin")                                   \
    X(UNSAMPLED_LIGHT, "a light with sampling_weight 0")                                 \
    X(GAPPED_LIGHT_ACTIVE, "an active light that is sampled only where it shines")       \
    X(SKY, "a light infinitely far away in all directions")                              \
    X(LIGHT_BEYOND_MEDIUM, "a light beyond a medium without end")                        \
    X(PARALLEL_SENSOR, "a sensor of one direction")                                      \
    X(RAY_SENSOR, "a sensor of one ray")                                                 \
    X(SURFACE_SENSOR, "a sensor that is a surface")                                      \
    X(UNMET_SENSOR, "a meter at points, or whose shape is virtual")                      \
    X(CAMERA, "a sensor that is no surface")                                             \
    X(SENSOR_GROUP, "several sensors in one (batch)")                                    \
    X(EXPOSURE, "a film with an exposure")                                               \
    X(SAMPLED_BORDER, "a film with sample_border")                                       \
    X(RESPONSES, "a film of response curves (specfilm)")                                 \
    X(NOT_THREE_RESPONSES, "a film of other than three response curves")                 \
    X(ALPHA, "a film with alpha")                                                        \
    X(RECORDED_WALKS, "recorded walks in place of new ones")                             \
    X(SPREAD_WALKS, "recorded walks that are spread over ranks")                         \
    X(TIME_LIMIT, "a time limit")                                                        \
    X(PARTS, "a part of a run, made by itself")                                          \
    X(PROCESSES, "a team of processes")                                                  \
    X(RANKS, "ranks (mpirun)")                                                           \
    X(EXTINCTION_FIELD_ACTIVE, "an active extinction that varies in space")              \
    X(EXTINCTION_ZERO_ACTIVE, "an active extinction that is 0")                          \
    X(POSE_ACTIVE, "an active pose")                                                     \
    X(VOLUME_JUMPS, "an active place of a volume that does not end at 0")                \
    X(RAYS_ACTIVE, "active parameters that bend rays")                                   \
    X(COLLISIONS_ACTIVE, "active parameters by which collisions are drawn")
/* ... and stated by the call that asks. */
#define IMP_STATED_FEATURES(X)                                                           \
    X(PICTURE, "a picture")                                                              \
    X(PRINTED_WALKS, "printed walks (render --paths)")                                   \
    X(DERIVATIVE, "derivatives")                                                         \
    X(PICTURE_DERIVATIVE, "derivatives of pictures")                                     \
    X(EDGE_TERMS, "derivatives with the terms of moving edges")                          \
    X(LOSS, "a loss")                                                                    \
    X(RESPONSE_LOSS, "a loss of other than three response curves")                       \
    X(MANY_PARAMETERS, "a gradient of very many parameters")                             \
    X(SHARES, "shares of parameters")                                                    \
    X(SINGLE_WALKS, "an answer made of walks one by one")                                \
    X(RECORDING, "recording of walks")                                                   \
    X(UNTIL, "a wanted error (--until)")                                                 \
    X(SEQUENTIAL, "a search, whose steps depend on each other")                          \
    X(CONTROL_VARIATE, "a control variate")                                              \
    X(ONE_MAKING, "a scene that cannot be made a second time")                           \
    X(SHARED_PIXELS, "a filter wider than a pixel")                                      \
    X(NOT_QUADRATIC, "a loss that is not quadratic")                                     \
    X(GAUSS_NEWTON, "a Gauss-Newton matrix")                                             \
    X(SPARSE_ROWS, "least squares of more than 256 parameters")                          \
    X(CHECKED_SAMPLING, "a check of sampling")                                           \
    X(CHECKPOINT, "a checkpoint")                                                        \
    X(CLIPPED_TARGET, "clipped targets")                                                 \
    X(ELEMENTS, "finite elements")
#define IMP_FEATURES(X) IMP_FOUND_FEATURES(X) IMP_STATED_FEATURES(X)

enum imp_feature {
#define X(name, text) IMP_HAS_##name,
    IMP_FEATURES(X)
#undef X
        IMP_FEATURE_COUNT,
    IMP_HAS_DECLARED = IMP_FEATURE_COUNT, /* that of a context (struct imp_declared) */
    IMP_HAS_ANY                           /* every job has it */
};

/* Which object of the job has a feature, for the sentence. */
struct imp_bearer {
    const char *name, *kind, *more;
    size_t number;
};

#define IMP_STATED_MAX   6
#define IMP_SENTENCE_MAX 512
/* NULL or 0: the job has no such thing, or it is not known yet. */
struct imp_job {
    imp_context *ctx;
    const struct imp_scene *scene;
    const struct imp_sensor *sensor;
    const struct imp_walk_integrator *walks; /* from the end of the run */
    const struct imp_run *run;
    const struct imp_active *active;
    const char *call; /* its name, for the sentence */
    struct imp_stated {
        enum imp_feature feature;
        struct imp_bearer by;
    } stated[IMP_STATED_MAX];
    int n_stated;
};

enum imp_relation { IMP_EXCLUDES, IMP_NEEDS };
struct imp_job_rule {
    enum imp_feature feature, with; /* jobs that have both ... */
    enum imp_relation relation;
    enum imp_feature other; /* ... may not, or must, have this one */
    enum imp_status status;
    /* {name}, {kind}, {more}, {number}: of the bearer of `other`; {its.name}, {its.kind}: of that of
     * `feature`; {sensor},
     * {sensor.kind}, {integrator}, {call}: the job's. */
    const char *sentence;
};

/* A feature more, with rules of its own: what a test declares in its context. */
struct imp_declared {
    bool (*found)(const struct imp_job *job, struct imp_bearer *by);
    const struct imp_job_rule *rules;
    int n_rules;
};

/* The job of a run: its walks are those from the end that the run asks for. run, sensor, active:
 * NULL, or as in struct imp_job. */
struct imp_job imp__job(const struct imp_scene *scene, const struct imp_sensor *sensor,
                        const struct imp_run *run, const struct imp_active *active);
/* A feature that the call states; by NULL: no bearer. */
void imp__job_state(struct imp_job *job, enum imp_feature feature,
                    const struct imp_bearer *by);
/* Has the job this feature? by: who bears it; NULL: nobody asks. */
bool imp__job_has(const struct imp_job *job, enum imp_feature feature,
                  struct imp_bearer *by);
/* IMP_OK, or the status and the sentence of the first rule that the job breaks. */
enum imp_status imp__job_allowed(const struct imp_job *job);

/* The table (rules.def), for tests. */
extern const struct imp_job_rule imp__job_rules[];
extern const int imp__n_job_rules;
extern const char *const imp__feature_names[IMP_FEATURE_COUNT];

#endif
