/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of the measurement from one pair of solutions, links fixed:
 *     dJ/dp  = sum over leaves A (b + a/A)^T (dR/dp) c       material numbers
 *     dJ/dL0 = sum over the source's samples K g lobe        lights (linear, exact)
 * They are those of the discrete system, so central differences of it agree to rounding;
 * the mesh is not differentiated. J is linear in the lights: value x derivative sums to
 * it. */
#include "elements.h"
#include <stdlib.h>
#include <string.h>

static enum imp_status row_find(imp_elements *e, const char *name, int param,
                                size_t element, bool emission, double value,
                                struct imp_elements_row **out)
{
    for (size_t k = 0; k < e->n_rows; k++) {
        struct imp_elements_row *r = &e->rows[k];
        if (r->param == param && r->element == element && r->emission == emission &&
            (param >= 0 || strcmp(r->name, name) == 0)) {
            *out = r;
            return IMP_OK;
        }
    }
    struct imp_elements_row *grown =
        imp__grow(e->ctx, e->rows, &e->cap_rows, e->n_rows + 1, sizeof *grown);
    if (!grown) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for sensitivities");
    e->rows = grown;
    *out = &grown[e->n_rows++];
    **out = (struct imp_elements_row){
        .size = sizeof **out,
        .name = param >= 0 ? e->scene->params[param].info.name : name,
        .param = param,
        .element = element,
        .emission = emission,
        .value = value};
    return IMP_OK;
}

static enum imp_status rows_add(imp_elements *e, const char *name, int param, int count,
                                bool emission, const double value[3], const double d[3])
{
    enum imp_status st = IMP_OK;
    for (int c = 0; c < e->ch; c++) {
        struct imp_elements_row *r = NULL;
        const size_t element = count == 3 ? (size_t)c : 0;
        IMP_TRY(row_find(e, name, param, element, emission, value[element], &r));
        r->derivative += d[c];
    }
out:
    return st;
}

static enum imp_status lights_take(imp_elements *e)
{
    enum imp_status st = IMP_OK;
    for (size_t k = 0; k < e->n_roots; k++) { /* what the eye sees of them */
        const struct imp__el_root *r = &e->roots[k];
        if (r->light == EL_DARK) continue;
        IMP_TRY(rows_add(e, r->light_name, r->light_param, r->light_count, true,
                         r->light_value, (double[3]){0}));
    }
    for (size_t k = 0; k < e->n_hits; k++) {
        const struct imp__el_hit *hit = &e->hits[k];
        if (hit->root == EL_NONE) continue;
        const struct imp__el_root *r = &e->roots[hit->root];
        const double lobe = imp__el_lobe(r, hit->w) * hit->weight;
        if (r->light == EL_DARK || lobe == 0) continue;
        const double d[3] = {e->eye[0] * lobe, e->eye[1] * lobe, e->eye[2] * lobe};
        IMP_TRY(rows_add(e, r->light_name, r->light_param, r->light_count, true,
                         r->light_value, d));
    }
    for (size_t j = 0; j < e->n_elements; j++) {
        struct imp__el_root r = *imp__el_root_of(e, &e->elements[j]);
        double d[3] = {0};
        if (r.light == EL_DARK) continue;
        for (int c = 0; c < 3; c++) r.radiance[c] = 1;
        for (size_t at = e->out_start[j]; at < e->out_start[j + 1]; at++) {
            const struct imp__el_link *k = &e->links[e->out[at]];
            imp_spec lobe[3] = {{0}}, g[3];
            imp__el_emission(e, k, &r, lobe);
            imp__el_ends(e, k, NULL, g);
            for (int c = 0; c < e->ch; c++)
                for (int s = 0; s < 4; s++) d[c] += k->k[s] * lobe[c][s] * g[c][s];
        }
        IMP_TRY(rows_add(e, r.light_name, r.light_param, r.light_count, true,
                         r.light_value, d));
    }
out:
    return st;
}

static enum imp_status materials_take(imp_elements *e)
{
    enum imp_status st = IMP_OK;
    struct sum {
        double d[3];
    };
    size_t n = 0;
    for (int k = 0; k < e->n_materials; k++) n += (size_t)e->materials[k].n_d;
    struct sum *sums = imp__alloc(e->ctx, n + 1, sizeof *sums);
    if (!sums) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for sensitivities");
    for (size_t i = 0; i < e->n_elements; i++) {
        const struct imp__element *x = &e->elements[i];
        const struct imp__el_material *m = imp__el_material_of(e, x);
        if (x->child || m->n == 0 || m->n_d == 0) continue;
        size_t at = 0;
        for (const struct imp__el_material *o = e->materials; o < m; o++)
            at += (size_t)o->n_d;
        for (int j = 0; j < m->n_d; j++)
            for (int c = 0; c < e->ch; c++) {
                const double *in = imp__el_at(e, e->c, x) + c * m->n,
                             *b = imp__el_at(e, e->b, x) + c * m->n;
                double y[EL_N_MAX], sum = 0;
                imp__el_apply(&e->basis, m->n, m->d[j].r[c], in, y);
                for (int q = 0; q < m->n; q++)
                    sum +=
                        (x->area * b[q] + e->eye[c] * e->a[x->coef + (size_t)q]) * y[q];
                sums[at + (size_t)j].d[c] += sum;
            }
    }
    size_t at = 0;
    for (int k = 0; k < e->n_materials; k++)
        for (int j = 0; j < e->materials[k].n_d; j++, at++) {
            const struct imp__el_material_d *d = &e->materials[k].d[j];
            bool used = false;
            for (size_t i = 0; i < e->n_roots; i++) used |= e->roots[i].material == k;
            if (used)
                IMP_TRY(rows_add(e, d->name, d->param, d->count, false, d->value,
                                 sums[at].d));
        }
out:
    imp__release(e->ctx, sums);
    return st;
}

static int by_size(const void *a, const void *b)
{
    const struct imp_elements_row *x = a, *y = b;
    const double p = fabs(x->value * x->derivative), q = fabs(y->value * y->derivative);
    if (p != q) return p < q ? 1 : -1;
    const int names = strcmp(x->name, y->name);
    return names ? names : (x->element > y->element) - (x->element < y->element);
}

enum imp_status imp_elements_sensitivity(imp_elements *e,
                                         const struct imp_elements_row **rows,
                                         size_t *n_rows)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, e, "elements");
    IMP_REQUIRE(e->ctx, rows, "rows");
    IMP_REQUIRE(e->ctx, n_rows, "n_rows");
    if (!e->solved)
        return imp__error(e->ctx, IMP_E_ARG, "the elements are not solved yet");
    IMP_FLOAT_MODE;
    IMP_READS(e->scene);
    e->n_rows = 0;
    IMP_TRY(imp__el_settle(e, 8, true, 1e-13));
    e->has_importance = true;
    IMP_TRY(lights_take(e));
    IMP_TRY(materials_take(e));
    const double measure = imp__el_measure(e, NULL);
    for (size_t k = 0; k < e->n_rows; k++) {
        struct imp_elements_row *r = &e->rows[k];
        r->share = measure != 0 ? r->value * r->derivative / measure : 0;
        r->share_error = NAN;
    }
    if (e->n_rows) qsort(e->rows, e->n_rows, sizeof *e->rows, by_size);
    *rows = e->rows;
    *n_rows = e->n_rows;
out:
    return st;
}
