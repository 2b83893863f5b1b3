/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums of large gradients. A slice of rays reaches few of the coefficients of a large
 * grid, so a slice's buffer starts uninitialised, a block of it is cleared when it is
 * first touched, and only touched blocks are added up. Threads add different parts of the
 * coefficients at the same time. Each coefficient adds its slices in order of their
 * number, so the sum has the same bits for any number of threads. */
#include "bend_adjoint.h"
#include <string.h>

#define BLOCK ((size_t)1 << IMP_BLOCK_SHIFT)

void imp__bar_touch(struct imp__bar *bar, size_t first, size_t last)
{
    for (size_t b = first; b <= last; b++) {
        if (bar->touched[b]) continue;
        bar->touched[b] = 1;
        memset(bar->theta + b * BLOCK, 0, BLOCK * sizeof *bar->theta);
    }
}

void imp__partials_init(struct imp__partials *p, imp_context *ctx, size_t n_theta)
{
    *p = (struct imp__partials){
        .ctx = ctx, .n_theta = n_theta, .n_blocks = (n_theta + BLOCK - 1) / BLOCK};
    p->n_parts = (int)imp_min(p->n_blocks, (size_t)IMP_PARTIALS_PARTS);
    for (int k = 0; k < p->n_parts; k++) {
        p->part[k].first = p->n_blocks * (size_t)k / (size_t)p->n_parts;
        p->part[k].last = p->n_blocks * (size_t)(k + 1) / (size_t)p->n_parts;
    }
    pthread_mutex_init(&p->lock, NULL);
}

static void partial_free(imp_context *ctx, struct imp__partial *own)
{
    while (own) {
        struct imp__partial *next = own->next;
        imp__release(ctx, own->theta);
        imp__release(ctx, own->touched);
        imp__release(ctx, own);
        own = next;
    }
}

void imp__partials_free(struct imp__partials *p)
{
    partial_free(p->ctx, p->idle);
    partial_free(p->ctx, p->ready);
    partial_free(p->ctx, p->sum);
    pthread_mutex_destroy(&p->lock);
}

static struct imp__partial *partial_new(struct imp__partials *p)
{
    struct imp__partial *own = imp__alloc(p->ctx, 1, sizeof *own);
    if (own) own->touched = imp__alloc(p->ctx, p->n_blocks + 1, 1);
    if (own) own->theta = imp__alloc_raw(p->ctx, p->n_blocks * BLOCK, sizeof(double));
    if (own && own->theta && own->touched) return own;
    partial_free(p->ctx, own);
    return NULL;
}

enum imp_status imp__partial_take(struct imp__partials *p, struct imp__partial **out)
{
    pthread_mutex_lock(&p->lock);
    struct imp__partial *own = p->idle;
    if (own) p->idle = own->next;
    if (!p->sum) p->sum = partial_new(p);
    const bool failed = !p->sum;
    pthread_mutex_unlock(&p->lock);
    if (own) own->next = NULL;
    else if (!failed) own = partial_new(p);
    if (!own) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for a gradient");
    *out = own;
    return IMP_OK;
}

void imp__partial_drop(struct imp__partials *p, struct imp__partial *own)
{
    if (own) partial_free(p->ctx, own);
}

static void add_part(const struct imp__partials *p, const struct imp__partials_part *part,
                     const struct imp__partial *own)
{
    for (size_t b = part->first; b < part->last; b++) {
        double *sum = p->sum->theta + b * BLOCK;
        const double *add = own->theta + b * BLOCK;
        if (!own->touched[b]) continue;
        if (p->sum->touched[b])
            for (size_t i = 0; i < BLOCK; i++) sum[i] += add[i];
        else memcpy(sum, add, BLOCK * sizeof *sum);
        p->sum->touched[b] = 1;
        own->touched[b] = 0;
    }
}

void imp__partial_add(struct imp__partials *p, size_t slice, struct imp__partial *own)
{
    own->slice = slice;
    own->parts_left = p->n_parts;
    pthread_mutex_lock(&p->lock);
    own->next = p->ready;
    p->ready = own;
    /* A part that another thread is adding is skipped: before that thread leaves, it
     * reads the list again under this lock, and so adds what has become ready since. */
    for (int k = 0; k < p->n_parts; k++) {
        struct imp__partials_part *part =
            &p->part[((size_t)k + slice) % (size_t)p->n_parts];
        while (!part->busy) {
            struct imp__partial **at = &p->ready;
            while (*at && (*at)->slice != part->slice) at = &(*at)->next;
            struct imp__partial *add = *at;
            if (!add) break;
            part->busy = true;
            pthread_mutex_unlock(&p->lock);
            add_part(p, part, add);
            pthread_mutex_lock(&p->lock);
            part->busy = false;
            part->slice++;
            if (--add->parts_left > 0) continue;
            for (at = &p->ready; *at != add;) at = &(*at)->next;
            *at = add->next;
            add->next = p->idle;
            p->idle = add;
        }
    }
    pthread_mutex_unlock(&p->lock);
}

struct sum_job {
    const struct imp__partials *p;
    double *theta;
};

static enum imp_status sum_work(size_t item, int worker, int slot, void *payload)
{
    const struct sum_job *j = payload;
    const struct imp__partials *p = j->p;
    (void)worker, (void)slot;
    for (size_t b = p->part[item].first; b < p->part[item].last; b++) {
        const size_t first = b * BLOCK, n = imp_min(BLOCK, p->n_theta - first);
        if (p->sum && p->sum->touched[b])
            memcpy(j->theta + first, p->sum->theta + first, n * sizeof *j->theta);
        else memset(j->theta + first, 0, n * sizeof *j->theta);
    }
    return IMP_OK;
}

enum imp_status imp__partials_sum(struct imp__partials *p, double *theta)
{
    struct sum_job job = {p, theta};
    const struct imp_loop loop = {
        .n_items = (size_t)p->n_parts, .work = sum_work, .payload = &job};
    return imp__parallel(p->ctx, &loop, NULL);
}
