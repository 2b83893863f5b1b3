/* SPDX-License-Identifier: Apache-2.0
 *
 * The kinds of integrators that make walks: one table of the settings of each name, and how
 * their properties are read. A name that differs from another by settings alone is a row. */
#include "scene/majorants.h"
#include "scene/unlit.h"
#include "walk_settings.h"

static const struct imp_walk_kind *kind_of(const struct imp_integrator *i)
{
    return (const struct imp_walk_kind *)i->ops;
}

/* The settings that the kind begins with. */
static struct imp_walk_integrator *begin(const struct imp_build *build,
                                         struct imp_integrator *i)
{
    const struct imp_walk_kind *kind = kind_of(i);
    struct imp_walk_integrator *w = i->self;
    if (kind->read_as)
        imp__warn(build->ctx, "integrator '%s' is read as '%s', whose picture it makes",
                  i->ops->name, kind->read_as);
    *w = kind->start;
    return w;
}

/* Mitsuba's properties that change nothing here: how edges are sampled, how deep. */
static enum imp_status unused_read(const struct imp_build *build,
                                   const struct imp_walk_kind *kind)
{
    static const char *const counts[] = {"sppc", "sppp", "sppi", "guiding_rounds"};
    enum imp_status st = IMP_OK;
    const char *text;
    int64_t unused;
    bool flag;
    if (kind->reads_edges) {
        for (size_t k = 0; k < imp_count(counts); k++)
            IMP_TRY(imp_build_int(build, counts[k], 0, 0, INT32_MAX, &unused));
        IMP_TRY(imp_build_string(build, "guiding", "octree", &text));
        IMP_TRY(imp_build_string(build, "project_seed", "both", &text));
        IMP_TRY(imp_build_bool(build, "guiding_proj", true, &flag));
    }
    if (kind->reads_depths) {
        IMP_TRY(imp_build_int(build, "max_depth", 2, -1, INT32_MAX, &unused));
        IMP_TRY(imp_build_int(build, "rr_depth", 5, 1, INT32_MAX, &unused));
    }
    if (kind->reads_spectral_mis)
        IMP_TRY(imp_build_bool(build, "use_spectral_mis", true, &flag));
out:
    return st;
}

static enum imp_status mixture_ready(struct imp_scene *scene,
                                     const struct imp_integrator *i)
{
    return imp__mixture_settle(scene, i, i->self);
}

/* ---- Walks from the sensor ------------------------------------------------------- */

static enum imp_status path_build(const struct imp_build *build, struct imp_integrator *i)
{
    const struct imp_walk_kind *kind = kind_of(i);
    struct imp_walk_integrator *w = begin(build, i);
    enum imp_status st = IMP_OK;
    int64_t rr;
    IMP_TRY(unused_read(build, kind));
    IMP_TRY(imp__props_int(build->ctx, build->node, "rr_depth", 5, 1, INT32_MAX, &rr));
    IMP_TRY(imp__depth_read(build, kind->depth, i, w));
    IMP_TRY(imp__light_choice_read(build, w));
    IMP_TRY(imp__mixture_read(build, w));
    w->rr_depth = (int)rr;
    IMP_TRY(imp__other_end_make(build, w));
    if (kind->unconnected) w->lights = false;
out:
    return st;
}

static enum imp_status volpath_build(const struct imp_build *build,
                                     struct imp_integrator *i)
{
    static const char *const estimators[] = {"ratio", "residual", "delta"};
    struct imp_walk_integrator *w = i->self;
    enum imp_status st = IMP_OK;
    int estimator;
    IMP_TRY(path_build(build, i));
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
    struct imp_walk_integrator *w = begin(build, i);
    enum imp_status st = IMP_OK;
    int64_t shading, emitter, bsdf;
    IMP_TRY(unused_read(build, kind_of(i)));
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

static enum imp_status stam_build(const struct imp_build *build, struct imp_integrator *i)
{
    static const char *const words[] = {"detached", "attached", "paper"};
    struct imp_walk_integrator *w = begin(build, i);
    enum imp_status st = IMP_OK;
    int choice;
    IMP_TRY(imp__depth_read(build, kind_of(i)->depth, i, w));
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
    struct imp_walk_integrator *w = begin(build, i);
    enum imp_status st = IMP_OK;
    IMP_TRY(imp__depth_read(build, kind_of(i)->depth, i, w));
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

/* Light walks, connected to the sensor (Mitsuba's name). */
static enum imp_status ptracer_build(const struct imp_build *build,
                                     struct imp_integrator *i)
{
    struct imp_walk_integrator *w = begin(build, i);
    enum imp_status st = IMP_OK;
    int64_t rr;
    IMP_TRY(imp__props_int(build->ctx, build->node, "rr_depth", 5, 1, INT32_MAX, &rr));
    IMP_TRY(imp__depth_read(build, kind_of(i)->depth, i, w));
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
    w->media = w->other_end->media = scene->n_media > 0 || scene->priorities
                                         ? IMP_CROSSES_WHAT_IS_THERE
                                         : IMP_CROSSES_NOTHING;
    if (!w->both) return imp__mixture_settle(scene, i, w->other_end);
    w->other_end->other_end->media = w->media;
    return imp__mixture_settle(scene, i, w->other_end->other_end);
}

/* Bidirectional walks, joined. Its other ends are ptracer's, and of that path's. */
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

/* ---- The table ------------------------------------------------------------------- */

/* Mitsuba's integrators that differentiate have this max_depth where none is given. */
#define DEPTH_OF_DERIVATIVES 6

#define KIND(kind, flags_, build_, ready_)                                               \
    .ops = {.size = sizeof(struct imp_integrator_ops),                                   \
            .name = #kind,                                                               \
            .object_size = sizeof(struct imp_walk_integrator),                           \
            .flags = IMP_INTEGRATOR_WALKS | (flags_),                                    \
            .build = build_,                                                             \
            .ready = ready_}
#define INNER IMP_INTEGRATOR_INNER
#define MEDIA IMP_INTEGRATOR_MEDIA
#define PATH  .lights = true, .directions = true

/* path, and Mitsuba's integrators for its derivatives. */
const struct imp_walk_kind imp__integrator_path = {
    KIND(path, INNER, path_build, mixture_ready), .start = {PATH, .guided = true},
    .depth = -1};
const struct imp_walk_kind imp__integrator_prb = {
    KIND(prb, INNER, path_build, mixture_ready), .start = {PATH, .guided = true},
    .read_as = "path", .depth = DEPTH_OF_DERIVATIVES};
const struct imp_walk_kind imp__integrator_prb_basic = {
    KIND(prb_basic, INNER, path_build, mixture_ready), .start = {PATH}, .read_as = "path",
    .depth = DEPTH_OF_DERIVATIVES, .unconnected = true};
const struct imp_walk_kind imp__integrator_prb_projective = {
    KIND(prb_projective, INNER, path_build, mixture_ready),
    .start = {PATH, .guided = true}, .read_as = "path", .depth = DEPTH_OF_DERIVATIVES,
    .reads_edges = true};

/* volpath, and two other estimators of the same mean. */
const struct imp_walk_kind imp__integrator_volpath = {
    KIND(volpath, INNER | MEDIA, volpath_build, volpath_ready),
    .start = {PATH, .media = IMP_CROSSES_MEDIA}, .depth = -1};
const struct imp_walk_kind imp__integrator_volpathmis = {
    KIND(volpathmis, INNER | MEDIA, volpath_build, volpath_ready),
    .start = {PATH, .media = IMP_CROSSES_MEDIA}, .depth = -1, .reads_spectral_mis = true};
const struct imp_walk_kind imp__integrator_prbvolpath = {
    KIND(prbvolpath, INNER | MEDIA, volpath_build, volpath_ready),
    .start = {PATH, .media = IMP_CROSSES_MEDIA}, .read_as = "volpath",
    .depth = DEPTH_OF_DERIVATIVES};

const struct imp_walk_kind imp__integrator_direct = {
    KIND(direct, INNER, direct_build, direct_ready),
    .start = {.max_depth = 2, .rr_depth = 5, .first_hit = true}};
const struct imp_walk_kind imp__integrator_direct_projective = {
    KIND(direct_projective, INNER, direct_build, direct_ready),
    .start = {.max_depth = 2, .rr_depth = 5, .first_hit = true}, .read_as = "direct",
    .reads_edges = true, .reads_depths = true};

const struct imp_walk_kind imp__integrator_stam = {
    KIND(stam, INNER | IMP_INTEGRATOR_NO_FIELDS, stam_build, NULL),
    .start = {.rr_depth = 5, .directions = true, .ends_by = IMP_ENDS_BY_ABSORPTION},
    .depth = 64};
const struct imp_walk_kind imp__integrator_photons = {
    KIND(photons, INNER | MEDIA, photons_build, photons_ready),
    .start = {.rr_depth = 5,
              .directions = true,
              .guided = true,
              .ends_by = IMP_ENDS_BY_ALBEDO,
              .media = IMP_CROSSES_WHAT_IS_THERE},
    .depth = -1};

const struct imp_walk_kind imp__integrator_ptracer = {
    KIND(ptracer, MEDIA, ptracer_build, ptracer_ready),
    .start = {PATH, .media = IMP_CROSSES_WHAT_IS_THERE, .from_lights = true},
    .depth = -1};
const struct imp_walk_kind imp__integrator_bdpt = {
    KIND(bdpt, MEDIA, bdpt_build, ptracer_ready),
    .start = {PATH, .media = IMP_CROSSES_WHAT_IS_THERE, .from_lights = true},
    .depth = -1};
