/* SPDX-License-Identifier: Apache-2.0
 *
 * Searches for places from several starts: the first from where the lamps are, the others from
 * places drawn within the bounds. A search is local, and its merit has many minima, as lamps
 * may be exchanged and rows may run either way. */
#include "base/arguments.h"
#include "design_moving.h"
#include "math/rng.h"
#include <math.h>
#include <string.h>

/* The objective at the present places, by the readings of the search that ended there. */
static enum imp_status end_find(struct imp__moving *v, double *out)
{
    struct imp__design_model *m = v->m;
    struct imp__choice_answer a;
    for (size_t k = 0; k < m->n_wants; k++)
        imp__design_rows_set(m, k, m->want[k].value, IMP_DESIGN_MARGIN);
    IMP_CHECKED(imp__design_search(m, NULL, 0, false, &a));
    *out = a.found ? imp__design_objective(m, m->o.least, a.x) : INFINITY;
    return IMP_OK;
}

/* Places drawn for start s. *there: the scene can have them (a drawn pose may turn a shape into
 * another); if not, it has the first ones. */
static enum imp_status start_place(struct imp__moving *v, int s, bool *there)
{
    const struct imp_key key = imp__key(v->m->run.seed, (uint64_t)s, 0x57a27ull);
    for (size_t i = 0; i < v->n; i++)
        v->p[i] = v->lo[i] + (v->hi[i] - v->lo[i]) * imp__u01(key, (uint32_t)i);
    const enum imp_status st = imp__moving_place(v, v->p);
    *there = st == IMP_OK;
    if (*there) return IMP_OK;
    if (st != IMP_E_ARG && st != IMP_E_SCENE) return st;
    memcpy(v->p, v->first, v->n * sizeof *v->p);
    return imp__moving_place(v, v->p);
}

enum imp_status imp__design_starts(struct imp__moving *v)
{
    const struct imp__design_model *m = v->m;
    const size_t n = (size_t)m->o.starts, row = v->n * sizeof *v->p;
    int steps = 0;
    v->end = imp__arena_array(m->arena, n, sizeof *v->end);
    v->ended = imp__arena_array(m->arena, n * v->n, sizeof *v->ended);
    if (!v->end || !v->ended)
        return imp__error(m->ctx, IMP_E_NOMEM, "no memory for starts");
    for (size_t s = 0; s < n; s++) {
        bool there = true;
        v->steps = 0;
        v->end[s] = INFINITY;
        if (s > 0) IMP_CHECKED(start_place(v, (int)s, &there));
        if (there) {
            IMP_CHECKED(imp__design_move(v));
            IMP_CHECKED(end_find(v, &v->end[s]));
        }
        memcpy(v->ended + s * v->n, v->p, row);
        if (s > 0 && !(v->end[s] < v->end[v->start])) continue;
        v->start = s;
        steps = v->steps;
    }
    v->steps = steps;
    memcpy(v->p, v->ended + v->start * v->n, row);
    return imp__moving_place(v, v->p);
}
