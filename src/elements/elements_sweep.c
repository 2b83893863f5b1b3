/* SPDX-License-Identifier: Apache-2.0
 *
 * Jacobi sweeps of radiance and importance over the same links. A sweep passes twice over
 * the samples and evaluates the basis once at each end: by source, where l becomes the
 * radiance that a sample carries and its importance is added to b; by receiver, where
 * that radiance is added to c and g becomes the importance that the sample carries back.
 * One number a sample and channel (`value`) holds whichever of the two is under way. Each
 * element's sum is taken by one worker in the order of its links, so it does not depend
 * on the threads.
 *
 * A link's sample s is the kernel at quarter s of the receiver. Where the receiver has
 * children, the sample belongs to child s alone (`from_above` of the child) instead of
 * being spread over all four: without that, what comes from far patches is too flat
 * across a wall whose near patches are linked to its parts, and furnaces are 2 % off
 * where they need not. */
#include "elements.h"
#include <string.h>

struct pass {
    imp_elements *e;
    bool importance, prime; /* prime: only make the values from g */
};

enum { ELEMENTS_PER_ITEM = 32 };

static void direction(const struct imp__el_link *k, const struct imp_frame *f,
                      double sign, imp_spec w[3])
{
    imp_spec d[3];
    for (int a = 0; a < 3; a++)
        d[a] = (imp_spec){k->w[a][0], k->w[a][1], k->w[a][2], k->w[a][3]} * sign;
    w[0] = d[0] * f->s[0] + d[1] * f->s[1] + d[2] * f->s[2];
    w[1] = d[0] * f->t[0] + d[1] * f->t[1] + d[2] * f->t[2];
    w[2] = d[0] * f->n[0] + d[1] * f->n[1] + d[2] * f->n[2];
}

static void basis_of(const imp_elements *e, int n, const imp_spec w[3], imp_spec *h)
{
    if (n > 1) imp__basis_eval4(&e->basis, w[0], w[1], w[2], h);
    else h[0] = imp__spec(e->basis.lead[0]);
}

static imp_spec dot_of(int n, const double *x, const imp_spec *h)
{
    imp_spec sum = imp__spec(0);
    for (int k = 0; k < n; k++) sum += x[k] * h[k];
    return sum;
}

/* Coefficients by lane: of the children where there are any, else all the same. */
static void by_lane(const imp_elements *e, const struct imp__element *i, double *array,
                    int n, imp_spec *out)
{
    const double *own = imp__el_at(e, array, i);
    if (!i->child) {
        for (int q = 0; q < e->ch * n; q++) out[q] = imp__spec(own[q]);
        return;
    }
    for (int s = 0; s < 4; s++) {
        const double *child = imp__el_at(e, array, &e->elements[i->child + (uint32_t)s]);
        for (int q = 0; q < e->ch * n; q++) out[q][s] = child[q];
    }
}

static imp_spec dot_of4(int n, const imp_spec *x, const imp_spec *h)
{
    imp_spec sum = imp__spec(0);
    for (int k = 0; k < n; k++) sum += x[k] * h[k];
    return sum;
}

void imp__el_ends(const imp_elements *e, const struct imp__el_link *k, imp_spec *radiance,
                  imp_spec *importance)
{
    const struct imp__element *i = &e->elements[k->rcv], *j = &e->elements[k->src];
    const struct imp__el_root *ri = imp__el_root_of(e, i), *rj = imp__el_root_of(e, j);
    const int ni = imp__el_n(e, ri), nj = imp__el_n(e, rj);
    imp_spec w[3], h[EL_N_MAX];
    if (radiance) {
        if (nj) {
            direction(k, &rj->frame, -1, w);
            basis_of(e, nj, w, h);
        }
        for (int c = 0; c < e->ch; c++)
            radiance[c] = dot_of(nj, imp__el_at(e, e->l, j) + c * nj, h);
        imp__el_emission(e, k, rj, radiance);
    }
    if (importance) {
        imp_spec g[3 * EL_N_MAX];
        by_lane(e, i, e->g, ni, g);
        direction(k, &ri->frame, 1, w);
        basis_of(e, ni, w, h);
        for (int c = 0; c < e->ch; c++) importance[c] = dot_of4(ni, g + c * ni, h);
    }
}

/* Add what the source's light sends along the samples. */
void imp__el_emission(const imp_elements *e, const struct imp__el_link *k,
                      const struct imp__el_root *r, imp_spec *radiance)
{
    if (r->light == EL_DARK) return;
    imp_spec lobe = imp__spec(1);
    if (r->light == EL_LOBE || r->light == EL_PROFILE)
        for (int s = 0; s < 4; s++)
            lobe[s] = imp__el_lobe(r, imp__v3(-(double)k->w[0][s], -(double)k->w[1][s],
                                              -(double)k->w[2][s]));
    for (int c = 0; c < e->ch; c++) radiance[c] += r->radiance[c] * lobe;
}

static void by_source(imp_elements *e, uint32_t index, bool importance)
{
    const struct imp__element *j = &e->elements[index];
    const struct imp__el_root *r = imp__el_root_of(e, j);
    const int n = imp__el_n(e, r), ch = e->ch;
    const double *l = imp__el_at(e, e->l, j);
    imp_spec sum[3][EL_N_MAX], w[3], h[EL_N_MAX];
    for (int c = 0; c < ch; c++) memset(sum[c], 0, (size_t)n * sizeof **sum);
    for (size_t at = e->out_start[index]; at < e->out_start[index + 1]; at++) {
        const struct imp__el_link *k = &e->links[e->out[at]];
        imp_spec *value = (imp_spec *)e->value + (size_t)ch * e->out[at], radiance[3];
        if (at + 2 < e->out_start[index + 1])
            __builtin_prefetch(&e->links[e->out[at + 2]]);
        if (n) {
            direction(k, &r->frame, -1, w);
            basis_of(e, n, w, h);
        }
        for (int c = 0; c < ch; c++) {
            radiance[c] = dot_of(n, l + c * n, h);
            if (!importance) continue;
            const imp_spec kg = (imp_spec){k->k[0], k->k[1], k->k[2], k->k[3]} * value[c];
            for (int q = 0; q < n; q++) sum[c][q] += kg * h[q];
        }
        imp__el_emission(e, k, r, radiance);
        for (int c = 0; c < ch; c++) value[c] = radiance[c];
    }
    double *b = imp__el_at(e, e->b, j);
    for (int c = 0; c < ch; c++)
        for (int q = 0; q < n; q++) {
            const imp_spec s = sum[c][q];
            b[c * n + q] = j->area > 0 ? ((s[0] + s[1]) + (s[2] + s[3])) / j->area : 0;
        }
}

static void by_receiver(imp_elements *e, uint32_t index, bool importance, bool prime)
{
    const struct imp__element *i = &e->elements[index];
    const struct imp__el_root *r = imp__el_root_of(e, i);
    const int n = imp__el_n(e, r), ch = e->ch;
    imp_spec sum[3][EL_N_MAX], g[3 * EL_N_MAX], w[3], h[EL_N_MAX];
    if (importance) by_lane(e, i, e->g, n, g);
    for (int c = 0; c < ch; c++) memset(sum[c], 0, (size_t)n * sizeof **sum);
    for (size_t at = e->in_start[index]; at < e->in_start[index + 1]; at++) {
        const struct imp__el_link *k = &e->links[at];
        imp_spec *value = (imp_spec *)e->value + (size_t)ch * at;
        direction(k, &r->frame, 1, w);
        basis_of(e, n, w, h);
        for (int c = 0; c < ch; c++) {
            if (!prime) {
                const imp_spec kl =
                    (imp_spec){k->k[0], k->k[1], k->k[2], k->k[3]} * value[c];
                for (int q = 0; q < n; q++) sum[c][q] += kl * h[q];
            }
            value[c] = importance ? dot_of4(n, g + c * n, h) : imp__spec(0);
        }
    }
    if (prime) return;
    double *out = imp__el_at(e, e->c, i);
    for (int c = 0; c < ch; c++)
        for (int q = 0; q < n; q++) {
            const imp_spec s = sum[c][q];
            out[c * n + q] =
                i->child || i->area == 0 ? 0 : ((s[0] + s[1]) + (s[2] + s[3])) / i->area;
        }
    for (uint32_t s = 0; s < 4 && i->child; s++) {
        const struct imp__element *child = &e->elements[i->child + s];
        double *below = imp__el_at(e, e->from_above, child);
        for (int c = 0; c < ch; c++)
            for (int q = 0; q < n; q++)
                below[c * n + q] = child->area > 0 ? sum[c][q][s] / child->area : 0;
    }
}

static enum imp_status source_work(size_t item, int worker, int slot, void *payload)
{
    const struct pass *p = payload;
    (void)worker, (void)slot;
    const size_t end = imp_min((item + 1) * ELEMENTS_PER_ITEM, p->e->n_elements);
    for (size_t k = item * ELEMENTS_PER_ITEM; k < end; k++)
        by_source(p->e, (uint32_t)k, p->importance);
    return IMP_OK;
}
static enum imp_status receiver_work(size_t item, int worker, int slot, void *payload)
{
    const struct pass *p = payload;
    (void)worker, (void)slot;
    const size_t end = imp_min((item + 1) * ELEMENTS_PER_ITEM, p->e->n_elements);
    for (size_t k = item * ELEMENTS_PER_ITEM; k < end; k++)
        by_receiver(p->e, (uint32_t)k, p->importance, p->prime);
    return IMP_OK;
}

/* ---- Push, reflect, pull ------------------------------------------------------- */

/* What is gathered goes down unchanged (it is per area); what is reflected comes up as
 * the area-weighted mean. */
static void reflect(imp_elements *e, uint32_t index, bool importance)
{
    const struct imp__element *x = &e->elements[index];
    const struct imp__el_root *r = imp__el_root_of(e, x);
    const struct imp__el_material *m = imp__el_material_of(e, x);
    const int n = imp__el_n(e, r), ch = e->ch;
    double *in = imp__el_at(e, importance ? e->b : e->c, x);
    double *out = imp__el_at(e, importance ? e->g : e->l, x);
    if (x->child) {
        memset(out, 0, (size_t)(ch * n) * sizeof *out);
        for (uint32_t k = x->child; k < x->child + 4; k++) {
            const struct imp__element *y = &e->elements[k];
            double *down = imp__el_at(e, importance ? e->b : e->c, y);
            const double *up = imp__el_at(e, importance ? e->g : e->l, y);
            const double *below = imp__el_at(e, e->from_above, y);
            for (int q = 0; q < ch * n; q++)
                down[q] += in[q] + (importance ? 0 : below[q]);
            reflect(e, k, importance);
            const double part = x->area > 0 ? y->area / x->area : 0;
            for (int q = 0; q < ch * n; q++) out[q] += part * up[q];
        }
        return;
    }
    for (int c = 0; c < ch; c++) {
        double arrives[EL_N_MAX];
        const double *from = in + c * n;
        if (importance) {
            const double scale = x->area > 0 ? e->eye[c] / x->area : 0;
            for (int q = 0; q < n; q++)
                arrives[q] = from[q] + e->a[x->coef + (size_t)q] * scale;
            from = arrives;
        }
        if (m->n) imp__el_apply(&e->basis, n, m->r[c], from, out + c * n);
        else if (n) out[c * n] = 0;
        if (importance && n) out[c * n] += e->lum[c] * r->measure * sqrt(IMP_2PI);
    }
}

static enum imp_status reflect_work(size_t item, int worker, int slot, void *payload)
{
    const struct pass *p = payload;
    (void)worker, (void)slot;
    reflect(p->e, p->e->roots[item].element, p->importance);
    return IMP_OK;
}

static enum imp_status run(const struct pass *p, size_t n,
                           enum imp_status (*work)(size_t, int, int, void *))
{
    struct pass copy = *p;
    const struct imp_loop loop = {.n_items = n, .work = work, .payload = &copy};
    return imp__parallel(p->e->ctx, &loop, NULL);
}

enum imp_status imp__el_sweep(imp_elements *e, int n, bool importance, bool cold)
{
    enum imp_status st = IMP_OK;
    const size_t items = (e->n_elements + ELEMENTS_PER_ITEM - 1) / ELEMENTS_PER_ITEM;
    if (cold) {
        memset(e->l, 0, (size_t)e->ch * e->n_coef * sizeof *e->l);
        memset(e->g, 0, (size_t)e->ch * e->n_coef * sizeof *e->g);
        memset(e->value, 0, 4 * (size_t)e->ch * e->n_links * sizeof *e->value);
    } else if (importance) {
        IMP_TRY(run(&(struct pass){e, true, true}, items, receiver_work));
    }
    for (int k = 0; k < n; k++) {
        IMP_TRY(run(&(struct pass){e, importance, false}, items, source_work));
        if (importance)
            IMP_TRY(run(&(struct pass){e, true, false}, e->n_roots, reflect_work));
        IMP_TRY(run(&(struct pass){e, importance, false}, items, receiver_work));
        IMP_TRY(run(&(struct pass){e, false, false}, e->n_roots, reflect_work));
    }
out:
    return st;
}
