/* SPDX-License-Identifier: Apache-2.0
 *
 * The error of shares that the directional order makes: the same elements and links,
 * solved once more in another order. Lobes that are cut off ring, so a weak lamp's share
 * may swing with the order by a tenth of itself while the measurement hardly moves. */
#include "elements.h"
#include <string.h>

/* Elements of the same scene and options in another order, with e's splits and links. */
static enum imp_status twin_make(const imp_elements *e, int order, imp_elements **out)
{
    enum imp_status st = IMP_OK;
    struct imp_elements_options o = e->opt;
    imp_elements *t = NULL;
    o.order = order;
    o.progress = NULL;
    o.time_limit_s = 0;
    IMP_TRY(imp__el_create(e->scene, &o, true, &t));
    for (size_t k = e->n_roots; k < e->n_elements; k += 4)
        IMP_TRY(imp__el_split(t, &e->elements[k].parent, 1));
    t->links = imp__grow(t->ctx, NULL, &t->cap_links, e->n_links + 1, sizeof *t->links);
    if (!t->links) IMP_TRY(imp__error(t->ctx, IMP_E_NOMEM, "out of memory for links"));
    memcpy(t->links, e->links, e->n_links * sizeof *t->links);
    t->n_links = e->n_links;
    IMP_TRY(imp__el_links_sort(t, NULL, t->n_links));
    IMP_TRY(imp__el_sources(t));
    imp__el_weigh(t, e->weight);
    IMP_TRY(imp__el_bin(t));
    IMP_TRY(imp__el_sweep(t, t->opt.sweeps, true, true));
    t->solved = true;
    *out = t;
    t = NULL;
out:
    imp_elements_destroy(t);
    return st;
}

static bool is_same(const struct imp_elements_row *a, const struct imp_elements_row *b)
{
    return a->param == b->param && a->element == b->element &&
           a->emission == b->emission && (a->param >= 0 || !strcmp(a->name, b->name));
}

enum imp_status imp_elements_share_errors(imp_elements *e,
                                          const struct imp_elements_row **rows,
                                          size_t *n_rows)
{
    enum imp_status st = IMP_OK;
    const struct imp_elements_row *other = NULL;
    imp_elements *twin = NULL;
    size_t n_other = 0;
    bool glossy = false;
    IMP_REQUIRE(NULL, e, "elements");
    IMP_REQUIRE(e->ctx, rows, "rows");
    IMP_REQUIRE(e->ctx, n_rows, "n_rows");
    IMP_FLOAT_MODE;
    IMP_TRY(imp_elements_sensitivity(e, rows, n_rows));
    for (int k = 0; k < e->n_materials; k++) glossy |= e->materials[k].n > 1;
    if (glossy) {
        const int order = e->basis.order;
        /* Too narrow a lobe for the order below: the one above, if there is one. */
        st = order < 4 ? IMP_E_UNSUPPORTED : twin_make(e, order - 2, &twin);
        if (st == IMP_E_UNSUPPORTED && order + 2 <= EL_ORDER_MAX)
            st = twin_make(e, order + 2, &twin);
        if (st == IMP_E_UNSUPPORTED) return IMP_OK; /* the errors stay NaN */
        IMP_TRY(st);
        IMP_TRY(imp_elements_sensitivity(twin, &other, &n_other));
    }
    for (size_t k = 0; k < e->n_rows; k++) {
        struct imp_elements_row *r = &e->rows[k];
        if (!glossy) r->share_error = 0;
        for (size_t i = 0; i < n_other; i++)
            if (is_same(r, &other[i])) r->share_error = fabs(r->share - other[i].share);
    }
out:
    imp_elements_destroy(twin);
    return st;
}
