/* SPDX-License-Identifier: Apache-2.0
 *
 * Targets of films with response curves. A walk carries three channels; the loss of a
 * film with another number of curves is the sum of losses of up to three curves each,
 * from independent walks. */
#include "target_levels.h"
#include <string.h>

#define AT_ONCE 3

void imp__clip_free(imp_context *ctx, struct imp__clip *clip)
{
    if (!clip) return;
    imp__release(ctx, clip->measured);
    imp__release(ctx, clip->base);
    imp__release(ctx, clip->silent);
    imp__release(ctx, clip);
}

void imp__target_free(imp_context *ctx, struct imp__target *t)
{
    for (int k = 0; k < t->n_parts; k++) {
        imp__release(ctx, t->part[k].pixels);
        imp__release(ctx, t->part[k].noise_se);
        imp__release(ctx, t->part[k].precision);
    }
    imp__release(ctx, t->part);
    imp__clip_free(ctx, t->clip);
    imp__release(ctx, t->pixels);
    imp__release(ctx, t->weights);
    imp__release(ctx, t->noise_se);
    imp__release(ctx, t->value_noise);
    imp__release(ctx, t->precision);
}

/* Channels first .. first + count - 1 of a picture, as a picture. */
static enum imp_status channels_copy(imp_context *ctx, const float *from, size_t pixels,
                                     int all, int first, int count, float **out)
{
    float *to = imp__alloc(ctx, pixels * (size_t)count, sizeof *to);
    if (!to) return imp__error(ctx, IMP_E_NOMEM, "no memory for a target picture");
    for (size_t i = 0; i < pixels; i++)
        memcpy(to + i * (size_t)count, from + i * (size_t)all + first,
               (size_t)count * sizeof *to);
    *out = to;
    return IMP_OK;
}

enum imp_status imp__target_split(struct imp_problem *p, struct imp__target *t)
{
    enum imp_status st = IMP_OK;
    const struct imp_target *d = &t->desc;
    const int n = p->scene->sensors[d->sensor]->film.n_responses;
    const size_t pixels = (size_t)d->width * (size_t)d->height;
    if (n == 0 || n == AT_ONCE) return IMP_OK;
    t->part = imp__alloc(p->ctx, (size_t)(n + AT_ONCE - 1) / AT_ONCE, sizeof *t->part);
    if (!t->part) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for a target");
    for (int first = 0; first < n; first += AT_ONCE) {
        struct imp__target *part = &t->part[t->n_parts++];
        const int count = imp_min(AT_ONCE, n - first);
        *part =
            (struct imp__target){.desc = *d, .weights = t->weights, .of_curves = true};
        part->desc.channels = count;
        IMP_TRY(channels_copy(p->ctx, t->pixels, pixels, n, first, count, &part->pixels));
        if (t->noise_se)
            IMP_TRY(channels_copy(p->ctx, t->noise_se, pixels, n, first, count,
                                  &part->noise_se));
        if (t->precision)
            IMP_TRY(channels_copy(p->ctx, t->precision, pixels, n, first, count,
                                  &part->precision));
        part->desc.pixels = part->pixels;
        part->desc.noise_se = part->noise_se;
        for (int k = 0; k < IMP_WAVES_DRAWN; k++) {
            part->waves[k] = p->scene->wavelengths[d->sensor * IMP_WAVES_DRAWN + k];
            part->waves[k].n_channels = count;
            part->waves[k].response += first;
        }
    }
out:
    return st;
}
