/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums over elements and links by all threads, the same to the bit for any number of
 * them: the parts are cut by the problem's size and added in a fixed binary tree
 * (base/sum_tree.h). */
#include "elements.h"

enum { PARTS = 256, LEAST = 64 };

struct sum {
    const imp_elements *e;
    size_t n, parts;
    double (*part)(const imp_elements *e, size_t first, size_t end, const void *how);
    const void *how;
    double value[PARTS];
};

static enum imp_status part_work(size_t item, int worker, int slot, void *payload)
{
    struct sum *s = payload;
    (void)worker, (void)slot;
    s->value[item] =
        s->part(s->e, s->n * item / s->parts, s->n * (item + 1) / s->parts, s->how);
    return IMP_OK;
}

double imp__el_sum(const imp_elements *e, size_t n,
                   double (*part)(const imp_elements *e, size_t first, size_t end,
                                  const void *how),
                   const void *how)
{
    struct sum s = {.e = e,
                    .n = n,
                    .parts = imp_clamp(n / LEAST, (size_t)1, (size_t)PARTS),
                    .part = part,
                    .how = how};
    const struct imp_loop loop = {.n_items = s.parts, .work = part_work, .payload = &s};
    if (imp__parallel(e->ctx, &loop, NULL) != IMP_OK) /* no memory for threads */
        for (size_t k = 0; k < s.parts; k++) part_work(k, 0, 0, &s);
    for (size_t step = 1; step < s.parts; step *= 2)
        for (size_t k = 0; k + step < s.parts; k += 2 * step)
            s.value[k] += s.value[k + step];
    return s.value[0];
}
