/* SPDX-License-Identifier: Apache-2.0
 *
 * The arrays of reduced walks. */
#include "reduce.h"
#include <string.h>

static void op_add(struct imp_reduced *r, struct imp_op op, int index)
{
    struct imp_op *grown =
        imp__grow(r->of->ctx, r->ops, &r->cap_ops, r->n_ops + 1, sizeof *grown);
    if (grown) r->ops = grown; /* even if it is of no use: the old one is gone */
    if (!grown || r->n_ops >= INT32_MAX || index >= IMP_OP_INDICES) {
        r->failed = true;
        return;
    }
    op.index = (uint32_t)index & (IMP_OP_INDICES - 1);
    grown[r->n_ops++] = op;
}

void imp__reduced_op(struct imp_reduced *r, enum imp_op_kind kind, int index)
{
    op_add(r, (struct imp_op){.kind = (uint32_t)kind & 15}, index);
}

void imp__reduced_words(struct imp_reduced *r, const void *data, size_t bytes)
{
    const size_t n = bytes / sizeof *r->words;
    uint32_t *grown =
        imp__grow(r->of->ctx, r->words, &r->cap_words, r->n_words + n, sizeof *grown);
    if (grown) r->words = grown;
    if (!grown || r->n_words + n > UINT32_MAX) {
        r->failed = true;
        return;
    }
    memcpy(grown + r->n_words, data, bytes);
    r->n_words += n;
}

void imp__reduced_term(struct imp_reduced *r, enum imp_op_kind kind, int index,
                       imp_spec c, const float lit[3], const void *data, size_t bytes)
{
    bool coloured = false;
    for (int k = 1; k < r->of->channels; k++) coloured |= c[k] != c[0];
    op_add(r, (struct imp_op){(uint32_t)kind & 15, coloured, lit != NULL, 0}, index);
    if (lit) imp__reduced_words(r, lit, 3 * sizeof *lit);
    if (bytes > 0) imp__reduced_words(r, data, bytes);
    const double number[3] = {c[0], c[1], c[2]};
    imp__reduced_words(r, number, coloured ? sizeof number : sizeof *number);
}

void imp__reduced_free(struct imp_reduced *r)
{
    if (!r->of) return;
    imp__release(r->of->ctx, r->walks);
    imp__release(r->of->ctx, r->ops);
    imp__release(r->of->ctx, r->words);
    *r = (struct imp_reduced){.of = NULL};
}

size_t imp__reduced_bytes(const struct imp_reduced *r)
{
    if (!r->of) return 0;
    return (r->n_walks + 1) * sizeof *r->walks + r->n_ops * sizeof *r->ops +
           r->n_words * sizeof *r->words;
}

void *imp__reduced_trimmed(imp_context *ctx, void *array, size_t n, size_t size)
{
    void *small = imp__alloc_raw(ctx, n + 1, size);
    if (!small) return array;
    if (n > 0) memcpy(small, array, n * size);
    imp__release(ctx, array);
    return small;
}
