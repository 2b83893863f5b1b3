/* SPDX-License-Identifier: Apache-2.0
 *
 * The cells of a guide: which elements they are, and the lookup of a point's cell. */
#include "elements_guide.h"

#define CELLS_MAX ((size_t)1 << 14)
#define GRID_MAX  ((size_t)1 << 22)

static bool is_cell(const imp_elements *e, const struct imp__element *x, int level)
{
    return (x->level == level || (x->level < level && !x->child)) &&
           imp__el_root_of(e, x)->shape >= 0 && imp__el_material_of(e, x)->n > 0;
}

enum imp_status imp__guide_cells(const imp_elements *e, int level,
                                 struct imp__guide_cells *c)
{
    for (;; level--) {
        c->n = 0;
        for (size_t i = 0; i < e->n_elements; i++)
            c->n += is_cell(e, &e->elements[i], level);
        if (c->n <= CELLS_MAX || level == 0) break;
    }
    c->level = level;
    c->of = imp__alloc(e->ctx, e->n_elements + 1, sizeof *c->of);
    c->where = imp__alloc(e->ctx, c->n + 1, sizeof *c->where);
    if (!c->of || !c->where)
        return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide");
    size_t n = 0;
    for (size_t i = 0; i < e->n_elements; i++) {
        const bool cell = is_cell(e, &e->elements[i], level);
        c->of[i] = cell ? (uint32_t)n : EL_NONE;
        if (cell) c->where[n++] = (uint32_t)i;
    }
    return IMP_OK;
}

enum imp_status imp__guide_finders(struct imp__guide *g)
{
    const imp_elements *e = g->e;
    size_t total = 0, at = 0;
    g->finder = imp__alloc(e->ctx, e->n_roots + 1, sizeof *g->finder);
    if (!g->finder) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide");
    for (size_t k = 0; k < g->cells.n; k++) {
        const struct imp__element *x = &e->elements[g->cells.where[k]];
        const struct imp__el_root *r = imp__el_root_of(e, x);
        struct imp__guide_finder *f = &g->finder[x->root];
        const imp_v3 u = r->v[1] - r->v[0], v = r->v[3] - r->v[0], n = imp__cross(u, v);
        const double size = imp__length(u) + imp__length(v), nn = imp__dot(n, n);
        if (r->corners != 4 || imp__length(r->v[2] - r->v[1] - v) > 1e-6 * size ||
            !(nn > 0))
            continue;
        total -= (size_t)(f->side * f->side);
        f->side = imp_max(f->side, 1 << x->level);
        total += (size_t)(f->side * f->side);
        f->origin = r->v[0];
        f->to_u = imp__cross(v, n) * (f->side / nn);
        f->to_v = imp__cross(n, u) * (f->side / nn);
    }
    if (total > GRID_MAX) return IMP_OK; /* by the tree then */
    g->grids = imp__alloc(e->ctx, total + 1, sizeof *g->grids);
    if (!g->grids) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide");
    for (size_t r = 0; r < e->n_roots; r++) {
        struct imp__guide_finder *f = &g->finder[r];
        if (f->side == 0) continue;
        f->grid = g->grids + at;
        at += (size_t)(f->side * f->side);
        for (int j = 0; j < f->side; j++)
            for (int i = 0; i < f->side; i++)
                f->grid[j * f->side + i] =
                    g->cells.of[imp__el_find_level(e, (uint32_t)r, (i + 0.5) / f->side,
                                                   (j + 0.5) / f->side, g->cells.level)];
    }
    return IMP_OK;
}
