/* SPDX-License-Identifier: Apache-2.0
 *
 * Measurements: which polygons they are of, how they weigh, and their value from the
 * radiance that arrives and from the importance that lights receive. */
#include "elements.h"
#include <string.h>

enum imp_status imp__el_plane_add(imp_elements *e, const struct imp_elements_source *src)
{
    const imp_v3 o = imp__v3(src->origin[0], src->origin[1], src->origin[2]);
    const imp_v3 u = imp__v3(src->edge_u[0], src->edge_u[1], src->edge_u[2]);
    const imp_v3 v = imp__v3(src->edge_v[0], src->edge_v[1], src->edge_v[2]);
    struct imp__el_root r = {.shape = -1,
                             .corners = 4,
                             .light_param = -1,
                             .back = -1,
                             .v = {o, o + u, o + u + v, o + v}};
    const imp_v3 c = imp__cross(u, v);
    int index;
    r.area = imp__length(c);
    if (!(r.area > 0) || !isfinite(r.area))
        return imp__error(e->ctx, IMP_E_ARG, "a measuring plane has area %g", r.area);
    r.frame = imp__frame_from_normal(c * (1 / r.area));
    r.measured = true;
    const enum imp_status st =
        imp__el_material_add(e, &(struct imp__el_material){.bsdf = NULL}, &r.material);
    return st == IMP_OK ? imp__el_root_append(e, &r, &index) : st;
}

/* Is the root a front of the shape that this source measures? */
static bool is_measured(const imp_elements *e, const struct imp__el_root *r,
                        const struct imp_elements_source *src)
{
    if (r->shape < 0 || strcmp(e->scene->shapes[r->shape]->name, src->shape) != 0)
        return false;
    return r->back < 0 || &e->roots[r->back] > r; /* a back comes after its front */
}

enum imp_status imp__el_measure_shape(imp_elements *e,
                                      const struct imp_elements_source *src)
{
    bool found = false;
    for (size_t i = 0; i < e->n_roots; i++)
        if (is_measured(e, &e->roots[i], src)) found = e->roots[i].measured = true;
    if (!found)
        return imp__error(e->ctx, IMP_E_ARG, "there is no shape '%s' to measure",
                          src->shape);
    return IMP_OK;
}

int imp__el_source_of(const imp_elements *e, uint32_t root)
{
    uint32_t plane = root; /* their roots are the last, in the sources' order */
    while (plane > 0 && e->roots[plane - 1].shape < 0) plane--;
    for (size_t k = 0; k < e->n_sources; k++) {
        const struct imp_elements_source *src = &e->sources[k];
        if (src->kind == IMP_ELEMENTS_SHAPE && is_measured(e, &e->roots[root], src))
            return (int)k;
        if (src->kind == IMP_ELEMENTS_PLANE && e->roots[root].shape < 0 &&
            plane++ == root)
            return (int)k;
    }
    return -1;
}

void imp__el_weigh(imp_elements *e, const double *w)
{
    size_t plane = 0; /* their roots are the last, in the sources' order */
    while (plane < e->n_roots && e->roots[plane].shape >= 0) plane++;
    for (size_t i = 0; i < e->n_roots; i++) e->roots[i].measure = 0;
    for (size_t k = 0; k < e->n_sources; k++) {
        const struct imp_elements_source *src = &e->sources[k];
        e->weight[k] = w[k];
        if (src->kind == IMP_ELEMENTS_CAMERA) {
            size_t n = 0;
            for (size_t i = 0; i < e->n_hits; i++) n += e->hits[i].source == k;
            for (size_t i = 0; i < e->n_hits; i++)
                if (e->hits[i].source == k)
                    e->hits[i].weight =
                        e->scene->sensors[src->sensor]->scale * w[k] / (double)n;
        } else if (src->kind == IMP_ELEMENTS_PLANE) {
            struct imp__el_root *r = &e->roots[plane++];
            r->measure = w[k] / r->area;
        } else {
            double area = 0;
            for (size_t i = 0; i < e->n_roots; i++)
                if (is_measured(e, &e->roots[i], src)) area += e->roots[i].area;
            for (size_t i = 0; i < e->n_roots; i++)
                if (is_measured(e, &e->roots[i], src)) e->roots[i].measure += w[k] / area;
        }
    }
}

/* ---- The measurement, from both sides ------------------------------------------ */

/* Weights of the channels: of what the eye sees, of what falls on a patch. */
struct weights {
    const double *eye, *patch;
};

static double direct_of(const imp_elements *e, const double *eye)
{
    double sum = 0;
    for (size_t i = 0; i < e->n_roots; i++) {
        const struct imp__el_root *r = &e->roots[i];
        if (r->light == EL_DARK) continue;
        const uint32_t *range = e->elements[r->element].hit;
        for (uint32_t k = range[0]; k < range[1]; k++) {
            const double lobe = imp__el_lobe(r, e->hits[k].w) * e->hits[k].weight;
            for (int c = 0; c < e->ch && lobe != 0; c++)
                sum += eye[c] * r->radiance[c] * lobe;
        }
    }
    return sum;
}

static double leaves_measure(const imp_elements *e, size_t first, size_t end,
                             const void *how)
{
    const struct weights *w = how;
    double sum = 0;
    for (size_t k = first; k < end; k++) {
        const struct imp__element *x = &e->elements[k];
        if (x->child) continue;
        const struct imp__el_root *r = imp__el_root_of(e, x);
        const int n = imp__el_n(e, r);
        for (int c = 0; c < e->ch && n; c++) {
            const double *l = imp__el_at(e, e->l, x) + c * n,
                         *in = imp__el_at(e, e->c, x) + c * n;
            double eye = 0;
            for (int q = 0; q < n; q++) eye += e->a[x->coef + (size_t)q] * l[q];
            sum += w->eye[c] * eye +
                   w->patch[c] * (x->area * r->measure * sqrt(IMP_2PI) * in[0]);
        }
    }
    return sum;
}

double imp__el_measure(const imp_elements *e, double *direct)
{
    const double seen = direct_of(e, e->eye);
    const struct weights w = {e->eye, e->lum};
    if (direct) *direct = seen;
    return imp__el_sum(e, e->n_elements, leaves_measure, &w) + seen;
}

double imp__el_luminance(const imp_elements *e)
{
    const struct weights w = {e->lum, (const double[3]){0}};
    bool camera = false;
    for (size_t k = 0; k < e->n_sources; k++)
        camera |= e->sources[k].kind == IMP_ELEMENTS_CAMERA;
    if (!camera) return NAN;
    return imp__el_sum(e, e->n_elements, leaves_measure, &w) + direct_of(e, e->lum);
}

/* Sum over a measured root's leaves of area x irradiance. */
static double flux_of(const imp_elements *e, const struct imp__element *x, int n)
{
    double sum = 0;
    if (x->child) {
        for (uint32_t k = 0; k < 4; k++) sum += flux_of(e, &e->elements[x->child + k], n);
        return sum;
    }
    for (int c = 0; c < e->ch; c++) sum += e->lum[c] * imp__el_at(e, e->c, x)[c * n];
    return x->area * sqrt(IMP_2PI) * sum;
}

static double mean_seen(const imp_elements *e, size_t source)
{
    const struct imp_elements_source *src = &e->sources[source];
    const int *r = src->region;
    const size_t n = (size_t)(r[2] - r[0]) * (size_t)(r[3] - r[1]) *
                     (size_t)(e->opt.rays * e->opt.rays);
    double sum = 0;
    for (size_t k = 0; k < n; k++) sum += e->seen[e->first_ray[source] + k];
    return e->scene->sensors[src->sensor]->scale * sum / (double)n;
}

enum imp_status imp__el_measure_each(imp_elements *e, double *J)
{
    size_t plane = 0; /* as in imp__el_weigh */
    const enum imp_status st = imp__el_see(e);
    while (plane < e->n_roots && e->roots[plane].shape >= 0) plane++;
    for (size_t k = 0; k < e->n_sources && st == IMP_OK; k++) {
        const struct imp_elements_source *src = &e->sources[k];
        double flux = 0, area = 0;
        if (src->kind == IMP_ELEMENTS_CAMERA) {
            J[k] = mean_seen(e, k);
            continue;
        }
        const bool is_plane = src->kind == IMP_ELEMENTS_PLANE;
        for (size_t i = is_plane ? plane++ : 0; i < (is_plane ? plane : e->n_roots);
             i++) {
            const struct imp__el_root *r = &e->roots[i];
            if (!is_plane && !is_measured(e, r, src)) continue;
            flux += flux_of(e, &e->elements[r->element], imp__el_n(e, r));
            area += r->area;
        }
        J[k] = flux / area;
    }
    return st;
}

void imp__el_given_add(const imp_elements *e, size_t j, double *sum)
{
    const struct imp__el_root *r = imp__el_root_of(e, &e->elements[j]);
    for (size_t at = e->out_start[j]; at < e->out_start[j + 1]; at++) {
        const struct imp__el_link *k = &e->links[e->out[at]];
        imp_spec emitted[3] = {{0}}, g[3];
        imp__el_emission(e, k, r, emitted);
        imp__el_ends(e, k, NULL, g);
        for (int c = 0; c < e->ch; c++)
            for (int s = 0; s < 4; s++) *sum += k->k[s] * emitted[c][s] * g[c][s];
    }
}

static double lights_measure(const imp_elements *e, size_t first, size_t end,
                             const void *how)
{
    double sum = 0;
    (void)how;
    for (size_t j = first; j < end; j++) {
        if (imp__el_root_of(e, &e->elements[j])->light == EL_DARK) continue;
        imp__el_given_add(e, j, &sum);
    }
    return sum;
}

double imp__el_measure_adjoint(const imp_elements *e)
{
    return direct_of(e, e->eye) + imp__el_sum(e, e->n_elements, lights_measure, NULL);
}
