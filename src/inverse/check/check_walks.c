/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks of a frozen check, the scalar that their colours fold to, and the sink that takes
 * their gradients. */
#include "check_walks.h"
#include "color/rgb.h"
#include "film/film_picture.h"
#include <math.h>
#include <string.h>

#define MEMORY_MAX ((size_t)512 << 20) /* of recorded walks */

imp_spec imp__kept_fold_bar(const struct imp__check *c)
{
    static const imp_spec lane = {1, 0.7, 1.3, 0};
    const struct imp_scene *scene = c->problem->scene;
    if (!scene->wavelengths) return scene->channels == 3 ? lane : (imp_spec){lane[0]};
    /* X + 0.7 Y + 1.3 Z: no wavelength has a negative weight, so that nothing cancels. */
    imp_spec bar = {0};
    for (int c = 0; c < 3; c++) {
        double xyz[3];
        imp__rgb_to_xyz((double[3]){c == 0, c == 1, c == 2}, xyz);
        for (int k = 0; k < 3; k++) bar[c] += lane[k] * xyz[k];
    }
    return bar;
}
double imp__kept_fold(const struct imp__check *c, imp_spec L)
{
    const imp_spec lane = imp__kept_fold_bar(c);
    double sum = 0;
    for (int k = 0; k < c->problem->scene->channels; k++) sum += lane[k] * L[k];
    return sum;
}

void imp__kept_add(struct imp_sink *sink, int param, size_t element, int channels,
                   const imp_spec *bar)
{
    struct imp__kept_list *l = (struct imp__kept_list *)sink;
    const int64_t base = l->active->base[param];
    if (base < 0) return;
    struct imp__kept_entry *grown =
        imp__grow(l->ctx, l->at, &l->cap, l->n + 3, sizeof *grown);
    if (!grown) {
        l->failed = true;
        return;
    }
    l->at = grown;
    if (channels == 3) {
        for (int k = 0; k < l->lanes; k++)
            l->at[l->n++] =
                (struct imp__kept_entry){(size_t)base + element + (size_t)k, (*bar)[k]};
        return;
    }
    double sum = 0;
    for (int k = 0; k < l->lanes; k++) sum += (*bar)[k];
    l->at[l->n++] = (struct imp__kept_entry){(size_t)base + element, sum};
}

static enum imp_status no_memory(const struct imp__check *c)
{
    return imp__error(c->ctx, IMP_E_NOMEM, "no memory to keep %d walks",
                      c->options.paths);
}

enum imp_status imp__kept_create(struct imp__kept *k)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = k->check;
    const struct imp_film_desc *film = &c->tracer.sensor->film;
    const uint64_t pixels = (uint64_t)film->crop_w * (uint64_t)film->crop_h;
    const size_t wanted = (size_t)c->options.paths;
    struct imp__kept_list list = {{.add = imp__kept_add},
                                  c->tracer.active,
                                  c->ctx,
                                  c->problem->scene->lanes,
                                  NULL,
                                  0,
                                  0,
                                  false};

    k->walks = imp__alloc(c->ctx, wanted, sizeof *k->walks);
    for (int i = 0; i < 3; i++) k->value[i] = imp__alloc(c->ctx, wanted, sizeof(double));
    if (!k->walks || !k->value[0] || !k->value[1] || !k->value[2]) IMP_TRY(no_memory(c));
    for (size_t t = 0;
         t < IMP_KEPT_TRIES * wanted && k->n < wanted && k->arena.total < MEMORY_MAX;
         t++) {
        const uint64_t pixel = imp__mix64(t + 0x51ed270b) % pixels;
        const struct imp_arena_mark mark = imp__arena_mark(&k->arena);
        struct imp__kept_walk *w = &k->walks[k->n];
        imp__walk_trace(&c->tracer, &k->arena, (int)(pixel % (uint64_t)film->crop_w),
                        (int)(pixel / (uint64_t)film->crop_w), (int64_t)t, &w->walk);
        if (w->walk.dropped == IMP_DROP_MEMORY) IMP_TRY(no_memory(c));
        list.n = 0;
        if (w->walk.dropped == IMP_DROP_NONE)
            imp__walk_sweep(&c->tracer, &w->walk, imp__kept_fold_bar(c), &list.sink);
        bool any = false;
        for (size_t i = 0; i < list.n; i++) any |= fabs(list.at[i].g) > IMP_KEPT_NOTHING;
        w->L = imp__kept_fold(c, w->walk.L);
        w->n = list.n;
        if (!any && fabs(w->L) <= IMP_KEPT_NOTHING) { /* nothing to compare */
            imp__arena_rewind(&k->arena, mark);
            continue;
        }
        w->gradient = imp__arena_take(&k->arena, list.n + 1, sizeof *w->gradient);
        if (!w->gradient || list.failed) IMP_TRY(no_memory(c));
        if (list.n > 0) memcpy(w->gradient, list.at, list.n * sizeof *list.at);
        k->n++;
    }
out:
    imp__release(c->ctx, list.at);
    return st;
}

void imp__kept_destroy(struct imp__kept *k)
{
    imp__arena_free(&k->arena);
    imp__release(k->check->ctx, k->walks);
    for (int i = 0; i < 3; i++) imp__release(k->check->ctx, k->value[i]);
}
