/* SPDX-License-Identifier: Apache-2.0
 *
 * The kinds of integrators that make walks: what each reads, and the end that walks
 * begin at. */
#include "math/hash.h"
#include "scene/majorants.h"
#include "scene/unlit.h"
#include "walk_settings.h"
#include <string.h>

const struct imp_walk_integrator *imp__walk_integrator(const struct imp_scene *scene)
{
    const struct imp_integrator *top = scene->integrator;
    const struct imp_walk_integrator *walk = imp__walk_integrator_of(top);
    for (int k = 0; !walk && top && k < top->n_inner; k++)
        walk = imp__walk_integrator_of(&top->inner[k]);
    return walk;
}

#define HASH_VERSION 2 /* raised with what is hashed */

uint64_t imp__walk_integrator_hash(const struct imp_walk_integrator *i)
{
    static const struct imp_mixing none = {.weight = {0}};
    if (!i) return 0;
    const bool draws = i->mixes || i->photons;
    const int number[] = {HASH_VERSION,
                          i->max_depth,
                          i->rr_depth,
                          i->hide_emitters,
                          i->lights,
                          i->directions,
                          i->guided,
                          i->absorbs,
                          i->first_hit,
                          (int)i->alpha_gradient,
                          i->media,
                          i->light_tree,
                          (int)i->transmittance,
                          i->from_lights,
                          i->both,
                          i->mixes,
                          i->photons,
                          draws ? i->split : 0};
    const double h = i->photons ? i->h : 0;
    const struct imp_mixing *mixing = draws ? i->mixing : &none;
    uint64_t hash = imp__hash(0, number, sizeof number);
    hash = imp__hash(hash, &h, sizeof h);
    return imp__hash(hash, mixing->weight, sizeof mixing->weight);
}

const struct imp_walk_integrator *imp__walks_from(const struct imp_walk_integrator *of,
                                                  enum imp_from from)
{
    if (of && of->both && from != IMP_FROM_SCENE) of = of->other_end; /* from one */
    if (from == IMP_FROM_SCENE || !of || (from == IMP_FROM_LIGHTS) == of->from_lights)
        return of;
    return of->other_end;
}

/* ---- Kinds ----------------------------------------------------------------------- */

static enum imp_status mixture_ready(struct imp_scene *scene,
                                     const struct imp_integrator *i)
{
    return imp__mixture_settle(scene, i, i->self);
}

/* `depth`: default of max_depth. */
static enum imp_status path_read(const struct imp_build *build, int depth,
                                 struct imp_integrator *i)
{
    struct imp_walk_integrator *w = i->self;
    enum imp_status st = IMP_OK;
    int64_t rr;
    *w = (struct imp_walk_integrator){.lights = true, .directions = true, .guided = true};
    IMP_TRY(imp__props_int(build->ctx, build->node, "rr_depth", 5, 1, INT32_MAX, &rr));
    IMP_TRY(imp__depth_read(build, depth, i, w));
    IMP_TRY(imp__light_choice_read(build, w));
    IMP_TRY(imp__mixture_read(build, w));
    w->rr_depth = (int)rr;
    IMP_TRY(imp__other_end_make(build, w));
out:
    return st;
}

static enum imp_status path_build(const struct imp_build *build, struct imp_integrator *i)
{
    return path_read(build, -1, i);
}

/* Mitsuba's integrators that differentiate have this max_depth where none is given. */
#define DEPTH_OF_DERIVATIVES 6

static void read_as(const struct imp_build *build, const struct imp_integrator *i,
                    const char *name)
{
    imp__warn(build->ctx, "integrator '%s' is read as '%s', whose picture it makes",
              i->ops->name, name);
}

/* volpath, and Mitsuba's two other estimators of the same mean. */
static enum imp_status volpath_build(const struct imp_build *build,
                                     struct imp_integrator *i)
{
    struct imp_walk_integrator *w = i->self;
    enum imp_status st = IMP_OK;
    bool spectral;
    const bool derivative = strcmp(i->ops->name, "prbvolpath") == 0;
    if (derivative) read_as(build, i, "volpath");
    IMP_TRY(path_read(build, derivative ? DEPTH_OF_DERIVATIVES : -1, i));
    if (strcmp(i->ops->name, "volpathmis") == 0)
        IMP_TRY(imp_build_bool(build, "use_spectral_mis", true, &spectral));
    w->guided = false;
    w->media = w->other_end->media = true;
    static const char *const estimators[] = {"ratio", "residual", "delta"};
    int estimator;
    IMP_TRY(imp__props_choice(build->ctx, build->node, "transmittance", estimators, 3, 0,
                              &estimator));
    w->transmittance = w->other_end->transmittance = (enum imp_transmittance)estimator;
out:
    return st;
}

static enum imp_status volpath_ready(struct imp_scene *scene,
                                     const struct imp_integrator *i)
{
    const struct imp_walk_integrator *w = i->self;
    enum imp_status st = mixture_ready(scene, i);
    for (int m = 0; m < scene->n_media && st == IMP_OK; m++)
        if (w->transmittance == IMP_RESIDUAL_TRACKING && scene->media[m]->majorants)
            st = imp__majorants_control(scene, scene->media[m]->majorants);
    return st;
}

/* Counts other than 0 make no difference: a walk has one sample of each technique, and
 * more samples a pixel do the same. */
static enum imp_status direct_build(const struct imp_build *build,
                                    struct imp_integrator *i)
{
    imp_context *ctx = build->ctx;
    struct imp_node *node = build->node;
    struct imp_walk_integrator *w = i->self;
    enum imp_status st = IMP_OK;
    int64_t shading, emitter, bsdf;
    *w = (struct imp_walk_integrator){.max_depth = 2, .rr_depth = 5, .first_hit = true};
    i->max_depth = w->max_depth;
    IMP_TRY(imp__props_bool(ctx, node, "hide_emitters", false, &w->hide_emitters));
    if (imp__props_has(node, "shading_samples") &&
        (imp__props_has(node, "emitter_samples") || imp__props_has(node, "bsdf_samples")))
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                "shading_samples cannot be given together with "
                                "emitter_samples or bsdf_samples"));
    IMP_TRY(imp__props_int(ctx, node, "shading_samples", 1, 1, 1 << 20, &shading));
    IMP_TRY(imp__props_int(ctx, node, "emitter_samples", shading, 0, 1 << 20, &emitter));
    IMP_TRY(imp__props_int(ctx, node, "bsdf_samples", shading, 0, 1 << 20, &bsdf));
    if (emitter + bsdf == 0)
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                "emitter_samples and bsdf_samples are both 0"));
    IMP_TRY(imp__light_choice_read(build, w));
    w->lights = emitter > 0;
    w->directions = bsdf > 0;
out:
    return st;
}

static enum imp_status direct_ready(struct imp_scene *scene,
                                    const struct imp_integrator *i)
{
    imp__light_choice_ready(scene, i->self);
    return IMP_OK;
}

/* Mitsuba's integrators for derivatives of path and direct; prb_basic samples no lights. */
static enum imp_status derivative_build(const struct imp_build *build,
                                        struct imp_integrator *i)
{
    struct imp_walk_integrator *w = i->self;
    enum imp_status st = IMP_OK;
    const char *name = i->ops->name, *text;
    const bool direct = strcmp(name, "direct_projective") == 0;
    static const char *const counts[] = {"sppc", "sppp", "sppi", "guiding_rounds"};
    int64_t unused;
    bool flag;
    read_as(build, i, direct ? "direct" : "path");
    if (strstr(name, "projective")) { /* how edges are sampled: without effect here */
        for (size_t k = 0; k < imp_count(counts); k++)
            IMP_TRY(imp_build_int(build, counts[k], 0, 0, INT32_MAX, &unused));
        IMP_TRY(imp_build_string(build, "guiding", "octree", &text));
        IMP_TRY(imp_build_string(build, "project_seed", "both", &text));
        IMP_TRY(imp_build_bool(build, "guiding_proj", true, &flag));
    }
    if (direct) {
        IMP_TRY(imp_build_int(build, "max_depth", 2, -1, INT32_MAX, &unused));
        IMP_TRY(imp_build_int(build, "rr_depth", 5, 1, INT32_MAX, &unused));
        IMP_TRY(direct_build(build, i));
        return IMP_OK;
    }
    IMP_TRY(path_read(build, DEPTH_OF_DERIVATIVES, i));
    if (strcmp(name, "prb_basic") == 0) w->lights = w->guided = false;
out:
    return st;
}

static enum imp_status stam_build(const struct imp_build *build, struct imp_integrator *i)
{
    static const char *const words[] = {"detached", "attached", "paper"};
    struct imp_walk_integrator *w = i->self;
    enum imp_status st = IMP_OK;
    int choice;
    *w = (struct imp_walk_integrator){.rr_depth = 5, .directions = true, .absorbs = true};
    IMP_TRY(imp__depth_read(build, 64, i, w));
    IMP_TRY(imp__props_choice(build->ctx, build->node, "alpha_gradient", words, 3, 0,
                              &choice));
    w->alpha_gradient = (enum imp_stam_alpha)choice;
    if (w->alpha_gradient == IMP_ALPHA_PAPER)
        imp__warn(build->ctx,
                  "alpha_gradient=paper: derivatives of exponents are those of Stam's "
                  "App. C, which are wrong (docs/stam.md, E9)");
out:
    return st;
}

/* Adjoint photons (Morley et al. 2006): light is met or not, and no vertex is connected to
 * it. */
static enum imp_status photons_build(const struct imp_build *build,
                                     struct imp_integrator *i)
{
    struct imp_walk_integrator *w = i->self;
    enum imp_status st = IMP_OK;
    *w = (struct imp_walk_integrator){.rr_depth = 5,
                                      .directions = true,
                                      .guided = true,
                                      .photons = true,
                                      .media = true};
    IMP_TRY(imp__depth_read(build, -1, i, w));
    IMP_TRY(imp__props_float_in(build->ctx, build->node, "h", 1, IMP_POSITIVE, &w->h));
    IMP_TRY(imp__mixture_read(build, w));
    IMP_TRY(imp__other_end_make(build, w));
out:
    return st;
}

static enum imp_status photons_ready(struct imp_scene *scene,
                                     const struct imp_integrator *i)
{
    for (int k = 0; k < scene->n_emitters; k++) {
        const struct imp_emitter *e = scene->emitters[k];
        if (e->ops->flags & IMP_EMITTER_DELTA)
            return imp__node_error(
                scene->ctx, imp__node_of(scene->root, e), IMP_E_UNSUPPORTED,
                "integrator photons: %s, and no photon can meet it; use "
                "path, or an area light",
                e->shape ? "this light has one direction" : "this light has no surface");
    }
    return mixture_ready(scene, i);
}

/* Walks from the lights, connected to the sensor (Mitsuba's name). */
static enum imp_status ptracer_build(const struct imp_build *build,
                                     struct imp_integrator *i)
{
    struct imp_walk_integrator *w = i->self;
    enum imp_status st = IMP_OK;
    int64_t rr;
    *w = (struct imp_walk_integrator){
        .lights = true, .directions = true, .media = true, .from_lights = true};
    IMP_TRY(imp__props_int(build->ctx, build->node, "rr_depth", 5, 1, INT32_MAX, &rr));
    IMP_TRY(imp__depth_read(build, -1, i, w));
    w->rr_depth = (int)rr;
    IMP_TRY(imp__other_end_make(build, w));
out:
    return st;
}

/* Without media they are walks of surfaces alone. From the sensor they are those of path. */
static enum imp_status ptracer_ready(struct imp_scene *scene,
                                     const struct imp_integrator *i)
{
    struct imp_walk_integrator *w = i->self;
    w->media = w->other_end->media = scene->n_media > 0 || scene->priorities;
    if (!w->both) return imp__mixture_settle(scene, i, w->other_end);
    w->other_end->other_end->media = w->media;
    return imp__mixture_settle(scene, i, w->other_end->other_end);
}

/* Walks from both ends, joined. Its other ends are ptracer's, and of that path's. */
static enum imp_status bdpt_build(const struct imp_build *build, struct imp_integrator *i)
{
    struct imp_walk_integrator *w = i->self;
    enum imp_status st = IMP_OK;
    IMP_TRY(ptracer_build(build, i));
    struct imp_walk_integrator *lights =
        imp__arena_array(build->arena, 1, sizeof *lights);
    if (!lights)
        IMP_TRY(imp__error(build->ctx, IMP_E_NOMEM, "no memory for the integrator"));
    *lights = *w;
    w->both = true;
    w->other_end = lights;
out:
    return st;
}

const struct imp_integrator_ops imp__integrator_path = {
    .size = sizeof(struct imp_integrator_ops),
    .name = "path",
    .object_size = sizeof(struct imp_walk_integrator),
    .flags = IMP_INTEGRATOR_WALKS | IMP_INTEGRATOR_INNER,
    .build = path_build,
    .ready = mixture_ready};
const struct imp_integrator_ops imp__integrator_direct = {
    .size = sizeof(struct imp_integrator_ops),
    .name = "direct",
    .object_size = sizeof(struct imp_walk_integrator),
    .flags = IMP_INTEGRATOR_WALKS | IMP_INTEGRATOR_INNER,
    .build = direct_build,
    .ready = direct_ready};
const struct imp_integrator_ops imp__integrator_stam = {
    .size = sizeof(struct imp_integrator_ops),
    .name = "stam",
    .object_size = sizeof(struct imp_walk_integrator),
    .flags = IMP_INTEGRATOR_WALKS | IMP_INTEGRATOR_INNER | IMP_INTEGRATOR_NO_FIELDS,
    .build = stam_build};
const struct imp_integrator_ops imp__integrator_photons = {
    .size = sizeof(struct imp_integrator_ops),
    .name = "photons",
    .object_size = sizeof(struct imp_walk_integrator),
    .flags = IMP_INTEGRATOR_WALKS | IMP_INTEGRATOR_INNER | IMP_INTEGRATOR_MEDIA,
    .build = photons_build,
    .ready = photons_ready};

const struct imp_integrator_ops imp__integrator_ptracer = {
    .size = sizeof(struct imp_integrator_ops),
    .name = "ptracer",
    .object_size = sizeof(struct imp_walk_integrator),
    .flags = IMP_INTEGRATOR_WALKS | IMP_INTEGRATOR_MEDIA,
    .build = ptracer_build,
    .ready = ptracer_ready};

const struct imp_integrator_ops imp__integrator_bdpt = {
    .size = sizeof(struct imp_integrator_ops),
    .name = "bdpt",
    .object_size = sizeof(struct imp_walk_integrator),
    .flags = IMP_INTEGRATOR_WALKS | IMP_INTEGRATOR_MEDIA,
    .build = bdpt_build,
    .ready = ptracer_ready};

#define VOLPATH(kind)                                                                    \
    const struct imp_integrator_ops imp__integrator_##kind = {                           \
        .size = sizeof(struct imp_integrator_ops),                                       \
        .name = #kind,                                                                   \
        .object_size = sizeof(struct imp_walk_integrator),                               \
        .flags = IMP_INTEGRATOR_WALKS | IMP_INTEGRATOR_INNER | IMP_INTEGRATOR_MEDIA,     \
        .build = volpath_build,                                                          \
        .ready = volpath_ready}
VOLPATH(volpath);
VOLPATH(volpathmis);
VOLPATH(prbvolpath);

#define DERIVATIVE(kind, ready_)                                                         \
    const struct imp_integrator_ops imp__integrator_##kind = {                           \
        .size = sizeof(struct imp_integrator_ops),                                       \
        .name = #kind,                                                                   \
        .object_size = sizeof(struct imp_walk_integrator),                               \
        .flags = IMP_INTEGRATOR_WALKS | IMP_INTEGRATOR_INNER,                            \
        .build = derivative_build,                                                       \
        .ready = ready_}
DERIVATIVE(prb, mixture_ready);
DERIVATIVE(prb_basic, mixture_ready);
DERIVATIVE(prb_projective, mixture_ready);
DERIVATIVE(direct_projective, direct_ready);
