/* SPDX-License-Identifier: Apache-2.0
 *
 * Which materials and lights of a scene are constant or linear while some parameters may
 * change. */
#include "kind/texture/bitmap.h"
#include "kind_trials.h"
#include "reduced.h"

/* Which of these inputs may change. False: one of them is more than its own number. */
static bool free_find(const struct imp_input *const *input, int n, const uint8_t *free,
                      uint8_t *out, bool *any)
{
    bool simple = true;
    *any = false;
    for (int j = 0; j < n; j++) {
        const struct imp_input *i = input[j];
        const struct imp_input *of = i->luminance   ? input[j - i->luminance]
                                     : i->component ? input[j - i->component]
                                                    : i;
        out[j] = imp__input_depends(of, free);
        *any |= out[j];
        simple &= !out[j] || !(i->luminance || i->component || i->bump || i->vector);
    }
    return simple;
}

static enum imp_reduction_class bsdf_class(const struct imp_reduction *r,
                                           const struct imp_bsdf *b, const uint8_t *free,
                                           uint8_t *inputs)
{
    bool any;
    const bool simple = free_find(b->input, b->n_in, free, inputs, &any);
    if (!any) return IMP_REDUCES_CONSTANT;
    if (simple && imp__trial_bsdf_linear(b, inputs, r->channels))
        return IMP_REDUCES_LINEAR;
    imp__trial_first_degree(b, r->channels, inputs);
    return IMP_REDUCES_NOT;
}

static enum imp_reduction_class emitter_class(const struct imp_reduction *r,
                                              const struct imp_emitter *e,
                                              const uint8_t *free, uint8_t *inputs)
{
    bool any;
    bool simple = free_find(e->input, e->n_in, free, inputs, &any);
    if (!any) return IMP_REDUCES_CONSTANT;
    for (int j = 0; j < e->n_in; j++) simple &= !inputs[j] || e->input[j]->plain;
    return simple && imp__trial_emitter_linear(e, inputs, r->channels)
               ? IMP_REDUCES_LINEAR
               : IMP_REDUCES_NOT;
}

/* Inputs and those of their textures. */
static size_t slots_count(const struct imp_input *const *input, int n)
{
    size_t sum = (size_t)n;
    for (int j = 0; j < n; j++)
        if (input[j]->texture)
            sum += slots_count(input[j]->texture->input, input[j]->texture->n_in);
    return sum;
}

static void slots_add(struct imp_reduction *r, const struct imp_input *const *input,
                      int n, const struct imp_bsdf *owner, const uint8_t *free)
{
    const int first = r->n_slots;
    r->n_slots += n;
    for (int j = 0; j < n; j++) {
        const struct imp_texture *t = input[j]->texture;
        const int slot = first + j;
        struct imp__texels texels;
        r->owner[slot] = owner;
        r->slot[slot] = input[j];
        r->free_slot[slot] = imp__input_depends(input[j], free);
        r->inner[slot] = r->n_slots;
        if (!t) continue;
        if (imp__bitmap_texels(t, &texels)) {
            r->texels[slot] = texels.data;
            r->texel_channels[slot] = (uint8_t)texels.channels;
        }
        slots_add(r, t->input, t->n_in, owner, free);
    }
}

void imp__reduction_destroy(struct imp_reduction *r)
{
    if (!r) return;
    imp__release(r->ctx, r->bsdf);
    imp__release(r->ctx, r->emitter);
    imp__release(r->ctx, r->free_bsdf);
    imp__release(r->ctx, r->free_emitter);
    imp__release(r->ctx, r->bsdf_slot);
    imp__release(r->ctx, r->emitter_slot);
    imp__release(r->ctx, r->slot);
    imp__release(r->ctx, r->inner);
    imp__release(r->ctx, r->free_slot);
    imp__release(r->ctx, r->texels);
    imp__release(r->ctx, r->texel_channels);
    imp__release(r->ctx, r->owner);
    imp__release(r->ctx, r);
}

enum imp_status imp__reduction_create(const struct imp_scene *scene,
                                      const struct imp_walk_integrator *integrator,
                                      const uint8_t *free, struct imp_reduction **out)
{
    imp_context *ctx = scene->ctx;
    *out = NULL;
    if (scene->wavelengths || scene->n_bodies > 0 || integrator->first_hit) return IMP_OK;
    const size_t bsdfs = (size_t)scene->n_bsdfs, emitters = (size_t)scene->n_emitters;
    size_t slots = 1;
    for (size_t b = 0; b < bsdfs; b++)
        slots += slots_count(scene->bsdfs[b]->input, scene->bsdfs[b]->n_in);
    for (size_t e = 0; e < emitters; e++)
        slots += slots_count(scene->emitters[e]->input, scene->emitters[e]->n_in);
    struct imp_reduction *r = imp__alloc(ctx, 1, sizeof *r);
    if (!r) goto no_memory;
    r->ctx = ctx;
    r->scene = scene;
    r->channels = scene->channels;
    r->bsdf = imp__alloc(ctx, bsdfs + 1, 1);
    r->emitter = imp__alloc(ctx, emitters + 1, 1);
    r->free_bsdf = imp__alloc(ctx, bsdfs + 1, IMP_INPUTS_MAX);
    r->free_emitter = imp__alloc(ctx, emitters + 1, IMP_INPUTS_MAX);
    r->bsdf_slot = imp__alloc(ctx, bsdfs + 1, sizeof *r->bsdf_slot);
    r->emitter_slot = imp__alloc(ctx, emitters + 1, sizeof *r->emitter_slot);
    r->slot = imp__alloc(ctx, slots, sizeof *r->slot);
    r->owner = imp__alloc(ctx, slots, sizeof *r->owner);
    r->inner = imp__alloc(ctx, slots, sizeof *r->inner);
    r->free_slot = imp__alloc(ctx, slots, 1);
    r->texels = imp__alloc(ctx, slots, sizeof *r->texels);
    r->texel_channels = imp__alloc(ctx, slots, 1);
    if (!r->bsdf || !r->emitter || !r->free_bsdf || !r->free_emitter || !r->bsdf_slot ||
        !r->emitter_slot || !r->slot || !r->owner || !r->inner || !r->free_slot ||
        !r->texels || !r->texel_channels)
        goto no_memory;
    for (size_t b = 0; b < bsdfs; b++) {
        const struct imp_bsdf *bsdf = scene->bsdfs[b];
        r->bsdf_slot[b] = r->n_slots;
        slots_add(r, bsdf->input, bsdf->n_in, bsdf, free);
        r->bsdf[b] =
            (uint8_t)bsdf_class(r, bsdf, free, r->free_bsdf + b * IMP_INPUTS_MAX);
    }
    for (size_t e = 0; e < emitters; e++) {
        const struct imp_emitter *emitter = scene->emitters[e];
        r->emitter_slot[e] = r->n_slots;
        slots_add(r, emitter->input, emitter->n_in, NULL, free);
        r->emitter[e] = (uint8_t)emitter_class(r, emitter, free,
                                               r->free_emitter + e * IMP_INPUTS_MAX);
    }
    *out = r;
    return IMP_OK;
no_memory:
    imp__reduction_destroy(r);
    return imp__error(ctx, IMP_E_NOMEM, "no memory for recorded walks");
}
