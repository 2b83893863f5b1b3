/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums of large gradients. A slice of rays reaches few of the coefficients of a large
 * grid, so a slice's buffer begins uncleared, blocks are cleared when first touched, and
 * adding up costs what was touched. */
#include "adjoint.h"
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
    pthread_mutex_init(&p->lock, NULL);
}

static void partial_free(imp_context *ctx, struct imp__partial *own)
{
    if (!own) return;
    imp__release(ctx, own->theta);
    imp__release(ctx, own->touched);
    imp__release(ctx, own);
}

void imp__partials_free(struct imp__partials *p)
{
    while (p->idle) {
        struct imp__partial *next = p->idle->next;
        partial_free(p->ctx, p->idle);
        p->idle = next;
    }
    partial_free(p->ctx, p->sum);
    pthread_mutex_destroy(&p->lock);
}

enum imp_status imp__partial_take(struct imp__partials *p, struct imp__partial **out)
{
    pthread_mutex_lock(&p->lock);
    struct imp__partial *own = p->idle;
    if (own) p->idle = own->next;
    pthread_mutex_unlock(&p->lock);
    if (!own) {
        own = imp__alloc(p->ctx, 1, sizeof *own);
        if (own) own->touched = imp__alloc(p->ctx, p->n_blocks + 1, 1);
        if (own) own->theta = imp__alloc_raw(p->ctx, p->n_blocks * BLOCK, sizeof(double));
        if (!own || !own->theta || !own->touched) {
            partial_free(p->ctx, own);
            return imp__error(p->ctx, IMP_E_NOMEM, "no memory for a gradient");
        }
    }
    *out = own;
    return IMP_OK;
}

void imp__partial_add(struct imp__partials *p, struct imp__partial *own)
{
    if (!p->sum) {
        p->sum = own;
        return;
    }
    for (size_t b = 0; b < p->n_blocks; b++) {
        double *sum = p->sum->theta + b * BLOCK;
        const double *add = own->theta + b * BLOCK;
        if (!own->touched[b]) continue;
        if (p->sum->touched[b])
            for (size_t i = 0; i < BLOCK; i++) sum[i] += add[i];
        else memcpy(sum, add, BLOCK * sizeof *sum);
        p->sum->touched[b] = 1;
        own->touched[b] = 0;
    }
    pthread_mutex_lock(&p->lock);
    own->next = p->idle;
    p->idle = own;
    pthread_mutex_unlock(&p->lock);
}

void imp__partials_sum(const struct imp__partials *p, double *theta)
{
    for (size_t b = 0; b < p->n_blocks; b++) {
        const size_t first = b * BLOCK, n = imp_min(BLOCK, p->n_theta - first);
        if (p->sum && p->sum->touched[b])
            memcpy(theta + first, p->sum->theta + first, n * sizeof *theta);
        else memset(theta + first, 0, n * sizeof *theta);
    }
}
