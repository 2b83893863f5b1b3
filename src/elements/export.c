/* SPDX-License-Identifier: Apache-2.0
 *
 * The leaves, for other programs: a binary PLY mesh with colours, or JSON. */
#include "base/text.h"
#include "color/rgb.h"
#include "elements.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct writer {
    imp_context *ctx;
    struct imp_bytes out;
    bool ok;
};

static void put(struct writer *w, const void *data, size_t n)
{
    w->ok = w->ok && imp__bytes_add(w->ctx, &w->out, data, n);
}
static void put_text(struct writer *w, const char *text) { put(w, text, strlen(text)); }
static void put_float(struct writer *w, double x)
{
    const float f = (float)x;
    unsigned char b[4];
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    for (int k = 0; k < 4; k++) b[k] = (unsigned char)(bits >> (8 * k));
    put(w, b, 4);
}
static void put_u32(struct writer *w, uint32_t x)
{
    unsigned char b[4];
    for (int k = 0; k < 4; k++) b[k] = (unsigned char)(x >> (8 * k));
    put(w, b, 4);
}
/* A number as JSON has it, whatever the host's locale calls a decimal point. */
static void put_number(struct writer *w, double x)
{
    char text[40], clean[40];
    int n = 0;
    if (!isfinite(x)) {
        put_text(w, "null");
        return;
    }
    snprintf(text, sizeof text, "%.9e", x);
    for (const char *s = text; *s; s++) {
        const bool digit =
            (*s >= '0' && *s <= '9') || *s == '-' || *s == '+' || *s == 'e';
        if (digit) clean[n++] = *s;
        else if (n && clean[n - 1] != '.') clean[n++] = '.';
    }
    put(w, clean, (size_t)n);
}
static void put_string(struct writer *w, const char *s)
{
    w->ok = w->ok && imp__json_string(w->ctx, &w->out, s);
}

void imp__el_means(const imp_elements *e, const struct imp__element *x,
                   double radiance[3], double *importance)
{
    const struct imp__el_root *r = imp__el_root_of(e, x);
    const int n = imp__el_n(e, r);
    double lobe = r->light == EL_DARK ? 0 : r->light == EL_UNIFORM ? 1 : 0;
    if (r->light == EL_PROFILE) lobe = r->power;
    if (r->light == EL_LOBE) lobe = 1 / (r->power + 1); /* mean about the normal */
    *importance = 0;
    for (int c = 0; c < 3; c++) {
        const int k = e->ch == 1 ? 0 : c;
        radiance[c] = r->radiance[k] * lobe;
        if (n) radiance[c] += imp__el_at(e, e->l, x)[k * n] / sqrt(IMP_2PI);
        if (n && c < e->ch) *importance += imp__el_at(e, e->g, x)[c * n] / sqrt(IMP_2PI);
    }
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static bool is_leaf(const imp_elements *e, size_t k)
{
    return !e->elements[k].child && imp__el_root_of(e, &e->elements[k])->shape >= 0;
}

static enum imp_status ply(const imp_elements *e, struct writer *w)
{
    size_t faces = 0, vertices = 0;
    double *sorted = imp__alloc(e->ctx, e->n_elements, sizeof *sorted);
    if (!sorted) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for the mesh");
    for (size_t k = 0; k < e->n_elements; k++) {
        double l[3], g;
        if (!is_leaf(e, k)) continue;
        imp__el_means(e, &e->elements[k], l, &g);
        sorted[faces++] = l[1];
        vertices += e->elements[k].corners;
    }
    qsort(sorted, faces, sizeof *sorted, ascending);
    const double white = faces ? fmax(sorted[(faces - 1) * 98 / 100], 1e-300) : 1;
    imp__release(e->ctx, sorted);
    char head[640];
    snprintf(head, sizeof head,
             "ply\nformat binary_little_endian 1.0\ncomment importon finite elements\n"
             "element vertex %zu\nproperty float x\nproperty float y\nproperty float z\n"
             "element face %zu\nproperty list uchar int vertex_indices\n"
             "property uchar red\nproperty uchar green\nproperty uchar blue\n"
             "property float radiance_r\nproperty float radiance_g\nproperty float "
             "radiance_b\n"
             "property float importance\nend_header\n",
             vertices, faces);
    put_text(w, head);
    for (size_t k = 0; k < e->n_elements; k++)
        for (int i = 0; i < e->elements[k].corners && is_leaf(e, k); i++)
            for (int a = 0; a < 3; a++) put_float(w, e->elements[k].v[i][a]);
    uint32_t next = 0;
    for (size_t k = 0; k < e->n_elements; k++) {
        const struct imp__element *x = &e->elements[k];
        double l[3], g;
        if (!is_leaf(e, k)) continue;
        imp__el_means(e, x, l, &g);
        put(w, &x->corners, 1);
        for (int i = 0; i < x->corners; i++) put_u32(w, next++);
        for (int c = 0; c < 3; c++) {
            const double v = imp__srgb_encode(imp_clamp(l[c] / white, 0.0, 1.0));
            put(w, &(unsigned char){(unsigned char)(255 * v + 0.5)}, 1);
        }
        for (int c = 0; c < 3; c++) put_float(w, l[c]);
        put_float(w, g);
    }
    return IMP_OK;
}

static void json(const imp_elements *e, struct writer *w)
{
    bool first = true;
    put_text(w, "{\"importon\":\"" IMP_VERSION_STRING "\",\"elements\":[");
    for (size_t k = 0; k < e->n_elements; k++) {
        const struct imp__element *x = &e->elements[k];
        double l[3], g;
        char text[48];
        if (!is_leaf(e, k)) continue;
        imp__el_means(e, x, l, &g);
        put_text(w, first ? "\n{\"shape\":" : ",\n{\"shape\":");
        first = false;
        put_string(w, e->scene->shapes[imp__el_root_of(e, x)->shape]->name);
        snprintf(text, sizeof text, ",\"polygon\":%u,\"level\":%d,\"area\":", x->root,
                 x->level);
        put_text(w, text);
        put_number(w, x->area);
        put_text(w, ",\"corners\":[");
        for (int i = 0; i < x->corners; i++)
            for (int a = 0; a < 3; a++) {
                put_text(w, a ? "," : i ? ",[" : "[");
                put_number(w, x->v[i][a]);
                if (a == 2) put_text(w, "]");
            }
        put_text(w, "],\"radiance\":[");
        for (int c = 0; c < e->ch; c++) {
            if (c) put_text(w, ",");
            put_number(w, l[c]);
        }
        put_text(w, "],\"importance\":");
        put_number(w, g);
        put_text(w, "}");
    }
    put_text(w, "]}\n");
}

enum imp_status imp_elements_export(const imp_elements *e, const char *path)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, e, "elements");
    IMP_REQUIRE(e->ctx, path, "path");
    IMP_FLOAT_MODE;
    struct writer w = {.ctx = e->ctx, .ok = true};
    const char *dot = strrchr(path, '.');
    if (!e->solved)
        return imp__error(e->ctx, IMP_E_ARG, "the elements are not solved yet");
    if (dot && strcmp(dot, ".ply") == 0) IMP_TRY(ply(e, &w));
    else if (dot && strcmp(dot, ".json") == 0) json(e, &w);
    else
        IMP_TRY(imp__error(e->ctx, IMP_E_ARG, "%s: elements are written as .ply or .json",
                           path));
    if (!w.ok) IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for %s", path));
    IMP_TRY(imp__file_write(e->ctx, path, w.out.data, w.out.size));
out:
    imp__bytes_free(e->ctx, &w.out);
    return st;
}
