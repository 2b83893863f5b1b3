/* SPDX-License-Identifier: Apache-2.0
 *
 * Which objects depend on which active numbers, found once a job so that the sweep can
 * pass by a material nobody asked about. */
#include "kind/texture/placed.h"
#include "scene/pose.h"
#include "walk.h"
#include <string.h>

static bool texture_depends(const struct imp_texture *t, const uint8_t *chosen);

bool imp__input_depends(const struct imp_input *in, const uint8_t *chosen)
{
    if (in->texture) return texture_depends(in->texture, chosen);
    return in->param >= 0 && chosen[in->param];
}

static bool texture_depends(const struct imp_texture *t, const uint8_t *chosen)
{
    if (t->param >= 0 && chosen[t->param]) return true;
    for (int k = 0; t->placed && k < t->placed->n; k++)
        if (chosen[t->placed->by[k].param]) return true;
    for (int k = 0; k < t->n_in; k++)
        if (imp__input_depends(t->input[k], chosen)) return true;
    return false;
}

uint64_t imp__inputs_depend(const struct imp_bsdf *b, const uint8_t *chosen)
{
    uint64_t inputs = 0;
    for (int k = 0; k < b->n_in; k++)
        inputs |= (uint64_t)imp__input_depends(b->input[k], chosen) << k;
    return inputs;
}

/* Does a chosen number move something? */
static bool any_moves(const struct imp_scene *scene, const uint8_t *chosen)
{
    for (const struct imp_pose *p = scene->poses; p; p = p->next)
        if (chosen[p->param]) return true;
    return false;
}

/* The index of glass that reflects and bends in single directions. */
static uint64_t index_input(const struct imp_bsdf *b)
{
    uint64_t inputs = 0;
    if (b->straight || b->flags != (IMP_BSDF_DELTA | IMP_BSDF_TRANSMIT)) return 0;
    for (int k = 0; b->ops->inputs[k].name; k++)
        if (b->ops->inputs[k].flags & IMP_INPUT_INDEX) inputs |= UINT64_C(1) << k;
    return inputs;
}

/* Inputs of the medium that need not be looked up for derivatives by its extinction: where
 * one input alone is active, itself. */
static uint64_t medium_unseen(const struct imp_medium *m, const uint8_t *chosen)
{
    uint64_t only = 0;
    for (int k = 0; k < m->n_own; k++) {
        const unsigned flags = m->ops->inputs[k].flags;
        if (!imp__input_depends(m->input[k], chosen)) continue;
        if (!(flags & IMP_INPUT_EXTINCTION)) continue;
        if (only || !(flags & IMP_INPUT_AFFINE)) return 0;
        only = UINT64_C(1) << k;
    }
    return only;
}

static bool media_create(const struct imp_scene *scene, const uint8_t *chosen,
                         struct imp_active *a)
{
    for (int m = 0; m < scene->n_media; m++) {
        const struct imp_medium *medium = scene->media[m];
        uint8_t *points = &a->bsdf[medium->scatterer->index];
        if (*points) *points = IMP_BY_EXTINCTION;
        for (int k = 0; k < medium->n_in; k++)
            if ((k >= medium->n_own ||
                 !(medium->ops->inputs[k].flags & IMP_INPUT_EXTINCTION)) &&
                imp__input_depends(medium->input[k], chosen))
                *points = 1;
        for (int k = 0; k < medium->n_own; k++) {
            if (!(medium->ops->inputs[k].flags & IMP_INPUT_EXTINCTION)) continue;
            if (!imp__input_depends(medium->input[k], chosen)) continue;
            const size_t n = (size_t)scene->n_media;
            if (!a->medium) a->medium = imp__alloc(scene->ctx, n, 1);
            if (!a->unseen) a->unseen = imp__alloc(scene->ctx, n, sizeof *a->unseen);
            if (!a->medium || !a->unseen) return false;
            a->medium[m] = 1;
            a->unseen[m] = medium_unseen(medium, chosen);
        }
    }
    return true;
}

enum imp_status imp__active_create(const struct imp_scene *scene, const uint8_t *chosen,
                                   struct imp_active *out)
{
    imp_context *ctx = scene->ctx;
    struct imp_active a = {0};
    a.base = imp__alloc(ctx, scene->n_params + 1, sizeof *a.base);
    a.bsdf = imp__alloc(ctx, (size_t)scene->n_bsdfs + 1, 1);
    a.inputs = imp__alloc(ctx, (size_t)scene->n_bsdfs + 1, sizeof *a.inputs);
    a.emitter = imp__alloc(ctx, (size_t)scene->n_emitters + 1, 1);
    if (!a.base || !a.bsdf || !a.inputs || !a.emitter) {
        imp__active_destroy(ctx, &a);
        return imp__error(ctx, IMP_E_NOMEM, "no memory for the active parameters");
    }
    for (size_t i = 0; i < scene->n_params; i++) {
        a.base[i] = chosen[i] ? (int64_t)a.n : -1;
        if (chosen[i]) a.n += scene->params[i].info.count;
    }
    const bool moves = any_moves(scene, chosen);
    for (int b = 0; b < scene->n_bsdfs; b++) {
        a.inputs[b] = imp__inputs_depend(scene->bsdfs[b], chosen);
        a.bsdf[b] = a.inputs[b] != 0;
        if (moves) a.inputs[b] |= index_input(scene->bsdfs[b]);
    }
    for (int e = 0; e < scene->n_emitters; e++)
        for (int k = 0; k < scene->emitters[e]->n_in; k++)
            a.emitter[e] |= imp__input_depends(scene->emitters[e]->input[k], chosen);
    if (!media_create(scene, chosen, &a)) {
        imp__active_destroy(ctx, &a);
        return imp__error(ctx, IMP_E_NOMEM, "no memory for the active parameters");
    }
    for (int m = 0; m < scene->n_bodies; m++)
        for (int k = 0; k < scene->bodies[m]->n_numbers; k++) {
            const int param = scene->bodies[m]->numbers[k].param;
            if (param < 0 || !chosen[param]) continue;
            if (!a.body) a.body = imp__alloc(ctx, (size_t)scene->n_bodies, 1);
            if (!a.body) {
                imp__active_destroy(ctx, &a);
                return imp__error(ctx, IMP_E_NOMEM,
                                  "no memory for the active parameters");
            }
            a.body[m] = 1;
        }
    *out = a;
    return IMP_OK;
}

void imp__active_destroy(imp_context *ctx, struct imp_active *a)
{
    imp__release(ctx, a->base);
    imp__release(ctx, a->tied);
    imp__release(ctx, a->bsdf);
    imp__release(ctx, a->inputs);
    imp__release(ctx, a->emitter);
    imp__release(ctx, a->body);
    imp__release(ctx, a->medium);
    imp__release(ctx, a->unseen);
    *a = (struct imp_active){0};
}

double imp__tied_slope(const struct imp_tied *tied, size_t e)
{
    if (!tied->param) return 1;
    if (tied->held && tied->held[e]) return 0;
    if (tied->log) return imp__param_get(tied->param, e);
    return tied->factor ? tied->factor[e] : 1;
}
