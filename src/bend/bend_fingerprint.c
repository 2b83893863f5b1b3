/* SPDX-License-Identifier: Apache-2.0
 *
 * Hashes of a fit's rays, targets, parameters and options. A checkpoint holds them, and
 * resumes only a fit that has the same. */
#include "bend_fingerprint.h"
#include "math/hash.h"

#define HASH(h, x) ((h) = imp__hash((h), &(x), sizeof(x)))

static uint64_t target_hash(uint64_t h, const struct imp__target_of_rays *t)
{
    const struct imp_bend_target *d = &t->desc;
    const size_t n_pixels = t->pixels ? (size_t)d->width * (size_t)d->height : 0;
    HASH(h, d->type), HASH(h, d->bundle), HASH(h, d->tap), HASH(h, d->weight);
    HASH(h, d->at_plane), HASH(h, d->point), HASH(h, d->normal), HASH(h, d->offset);
    HASH(h, d->outside), HASH(h, d->width), HASH(h, d->height);
    HASH(h, d->origin), HASH(h, d->u), HASH(h, d->v);
    h = imp__hash(h, t->data, t->n_data * sizeof *t->data);
    return imp__hash(h, t->pixels, n_pixels * sizeof *t->pixels);
}

static uint64_t surface_hash(uint64_t h, const struct imp_bend_surface *s)
{
    HASH(h, s->type), HASH(h, s->event), HASH(h, s->group), HASH(h, s->normal);
    HASH(h, s->offset), HASH(h, s->centre), HASH(h, s->radius), HASH(h, s->lo);
    HASH(h, s->hi), HASH(h, s->index);
    return h;
}

void imp__bend_fingerprint(const imp_bend *b, const uint8_t *held,
                           enum imp_optimizer optimizer, double smooth_length, int level,
                           struct imp__fingerprint *out)
{
    const struct imp_bend_options *o = &b->options;
    uint64_t h = imp__hash(0, &b->n, sizeof b->n);
    h = imp__hash(h, b->x, b->n * sizeof *b->x);
    h = imp__hash(h, b->d, b->n * sizeof *b->d);
    h = imp__hash(h, b->power, b->n * sizeof *b->power);
    h = imp__hash(h, b->group, b->n * sizeof *b->group);
    const bool disperses = b->dispersion != NULL;
    HASH(h, disperses);
    if (disperses)
        h = imp__hash(h, b->dispersion, b->cap_dispersion * sizeof *b->dispersion);
    HASH(h, o->scheme), HASH(h, o->way), HASH(h, o->step), HASH(h, o->max_steps);
    HASH(h, o->outside), HASH(h, o->outside_index), HASH(h, o->grazing);
    HASH(h, b->step_cells), HASH(h, b->step_max);
    for (size_t i = 0; i < o->n_surfaces; i++) h = surface_hash(h, &o->surfaces[i]);
    for (size_t i = 0; i < o->n_taps; i++) {
        HASH(h, o->taps[i].normal), HASH(h, o->taps[i].offset);
        HASH(h, o->taps[i].group);
    }
    out->scene = h;
    h = 1;
    for (size_t i = 0; i < b->n_targets; i++) h = target_hash(h, &b->targets[i]);
    for (size_t i = 0; i < b->n_smooths; i++) {
        HASH(h, b->smooths[i].weight), HASH(h, b->smooths[i].edge);
        HASH(h, b->smooths[i].order);
    }
    out->targets = h;
    h = imp__hash(2, &b->field->n_theta, sizeof b->field->n_theta);
    HASH(h, b->lo), HASH(h, b->hi), HASH(h, b->field->lo), HASH(h, b->field->hi);
    h = imp__hash(h, held, b->field->n_theta);
    out->parameters = h;
    h = imp__hash(3, &optimizer, sizeof optimizer);
    HASH(h, smooth_length);
    out->options = HASH(h, level);
}
