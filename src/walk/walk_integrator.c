/* SPDX-License-Identifier: Apache-2.0 */
#include "walk_integrator.h"
#include "math/hash.h"

const struct imp_walk_integrator *imp__walk_integrator(const struct imp_scene *scene)
{
    const struct imp_integrator *top = scene->integrator;
    const struct imp_walk_integrator *walk = imp__walk_integrator_of(top);
    for (int k = 0; !walk && top && k < top->n_inner; k++)
        walk = imp__walk_integrator_of(&top->inner[k]);
    return walk;
}

uint64_t imp__walk_integrator_hash(const struct imp_walk_integrator *i)
{
    if (!i) return 0;
    const int number[] = {i->max_depth, i->rr_depth,   i->hide_emitters,
                          i->lights,    i->directions, i->guided,
                          i->absorbs,   i->first_hit,  (int)i->alpha_gradient};
    return imp__hash(0, number, sizeof number);
}

/* ---- Kinds ----------------------------------------------------------------------- */

/* Reads hide_emitters and max_depth. */
static enum imp_status depth_read(const struct imp_build *build, int fallback,
                                  struct imp_integrator *i, struct imp_walk_integrator *w)
{
    enum imp_status st = IMP_OK;
    int64_t depth;
    IMP_TRY(imp__props_bool(build->ctx, build->node, "hide_emitters", false,
                            &w->hide_emitters));
    IMP_TRY(imp__props_int(build->ctx, build->node, "max_depth", fallback, -1, INT32_MAX,
                           &depth));
    i->max_depth = w->max_depth = (int)depth;
out:
    return st;
}

static enum imp_status path_build(const struct imp_build *build, struct imp_integrator *i)
{
    struct imp_walk_integrator *w = i->self;
    enum imp_status st = IMP_OK;
    int64_t rr;
    *w = (struct imp_walk_integrator){.lights = true, .directions = true, .guided = true};
    IMP_TRY(imp__props_int(build->ctx, build->node, "rr_depth", 5, 1, INT32_MAX, &rr));
    IMP_TRY(depth_read(build, -1, i, w));
    w->rr_depth = (int)rr;
out:
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
    w->lights = emitter > 0;
    w->directions = bsdf > 0;
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
    IMP_TRY(depth_read(build, 64, i, w));
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

const struct imp_integrator_ops imp__integrator_path = {
    sizeof(struct imp_integrator_ops), "path", sizeof(struct imp_walk_integrator),
    IMP_INTEGRATOR_WALKS | IMP_INTEGRATOR_INNER, path_build};
const struct imp_integrator_ops imp__integrator_direct = {
    sizeof(struct imp_integrator_ops), "direct", sizeof(struct imp_walk_integrator),
    IMP_INTEGRATOR_WALKS | IMP_INTEGRATOR_INNER, direct_build};
const struct imp_integrator_ops imp__integrator_stam = {
    sizeof(struct imp_integrator_ops), "stam", sizeof(struct imp_walk_integrator),
    IMP_INTEGRATOR_WALKS | IMP_INTEGRATOR_INNER | IMP_INTEGRATOR_NO_FIELDS, stam_build};
