/* SPDX-License-Identifier: Apache-2.0
 *
 * What most binary files hold: vertices whose numbers are floats, and triangles by integers
 * of 32 bits, in rows of one size. */
#include "base/pool.h"
#include "ply_file.h"
#include <math.h>
#include <string.h>

#define LEAST 32768 /* rows that are worth a thread */

struct copying {
    const struct ply *p;
    const unsigned char *rows;
    size_t row;                     /* bytes of one */
    int offset[USES];               /* of a vertex's numbers; -1: it has none */
    int count, count_bytes, corner; /* offsets in a face's row */
};

static enum imp_status vertices_copy(size_t first, size_t end, void *payload)
{
    const struct copying *c = payload;
    const struct ply *p = c->p;
    for (size_t k = first; k < end; k++) {
        const unsigned char *row = c->rows + k * c->row;
        float f[USES] = {0};
        bool finite = true;
        for (int i = 0; i < USES; i++) {
            if (c->offset[i] < 0) continue;
            memcpy(&f[i], row + c->offset[i], sizeof *f);
            finite &= (bool)isfinite(f[i]);
        }
        if (!finite) return IMP_E_SCENE;
        imp__ply_put(p, k, f);
    }
    return IMP_OK;
}

/* Copies vertices that are three floats in a row, with nothing else that is read. A float whose
 * bits but the sign are these or more is not finite. */
#define BITS_INFINITE 0x7f800000u
static enum imp_status positions_copy(size_t first, size_t end, void *payload)
{
    const struct copying *c = payload;
    float *to = c->p->positions;
    uint32_t most = 0;
    for (size_t k = first; k < end; k++) {
        uint32_t bits[3];
        memcpy(bits, c->rows + k * c->row + c->offset[USE_X], sizeof bits);
        memcpy(to + 3 * k, bits, sizeof bits);
        for (int i = 0; i < 3; i++) most = imp_max(most, bits[i] & ~(1u << 31));
    }
    return most < BITS_INFINITE ? IMP_OK : IMP_E_SCENE;
}
static bool are_positions(const struct copying *c)
{
    const int *at = c->offset;
    for (int i = 0; i < USES; i++)
        if (i > USE_Z && at[i] >= 0) return false;
    return at[USE_X] >= 0 && at[USE_Y] == at[USE_X] + 4 && at[USE_Z] == at[USE_X] + 8;
}

/* What is wrong with one is known when all are copied: so none waits for a branch. */
static enum imp_status faces_copy(size_t first, size_t end, void *payload)
{
    const struct copying *c = payload;
    const size_t n = c->p->elements[c->p->vertex].n;
    uint32_t *to = c->p->indices, most = 0, others = 0;
    for (size_t k = first; k < end; k++) {
        const unsigned char *row = c->rows + k * c->row;
        uint32_t corners = row[c->count], index[3];
        if (c->count_bytes > 1) memcpy(&corners, row + c->count, (size_t)c->count_bytes);
        memcpy(index, row + c->corner, sizeof index);
        others |= corners ^ 3;
        most = imp_max(imp_max(most, index[0]), imp_max(index[1], index[2]));
        memcpy(to + 3 * k, index, sizeof index);
    }
    return others == 0 && most < n ? IMP_OK : IMP_E_SCENE;
}

/* Where the numbers lie in a row of three corners a list; false: elsewhere in each. */
static bool layout(const struct ply *p, const struct ply_element *e, struct copying *c)
{
    size_t at = 0;
    for (int i = 0; i < USES; i++) c->offset[i] = -1;
    for (int i = 0; i < e->n_properties; i++) {
        const struct ply_property *q = &p->properties[e->first + i];
        const size_t bytes = (size_t)imp__ply_bytes(q->type);
        if (q->attribute >= 0) return false;
        if (q->count == PLY_NONE) {
            if (q->use < USES && q->type != PLY_F32) return false;
            if (q->use < USES) c->offset[q->use] = (int)at;
            at += bytes;
            continue;
        }
        if (!q->indices || (q->type != PLY_I32 && q->type != PLY_U32)) return false;
        c->count = (int)at;
        c->count_bytes = imp__ply_bytes(q->count);
        c->corner = c->count + c->count_bytes;
        at += (size_t)c->count_bytes + 3 * bytes;
    }
    c->row = at;
    return true;
}

bool imp__ply_copy(struct ply *p, int element)
{
    const struct ply_element *e = &p->elements[element];
    const bool vertices = element == p->vertex;
    struct copying c = {.p = p, .rows = p->at};
    if (p->format != PLY_LITTLE || __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__)
        return false;
    if ((!vertices && element != p->face) || !layout(p, e, &c)) return false;
    if (e->n > (size_t)(p->end - p->at) / c.row) return false;
    if (imp__parallel_ranges(p->ctx, e->n, LEAST,
                             !vertices           ? faces_copy
                             : are_positions(&c) ? positions_copy
                                                 : vertices_copy,
                             &c) != IMP_OK)
        return false;
    p->at += e->n * c.row;
    return true;
}
