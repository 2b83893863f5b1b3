/* SPDX-License-Identifier: Apache-2.0
 *
 * The file as JSON, its members, and what reading it takes in turn. */
#include "gltf.h"
#include "format/search.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define GLB_MAGIC  0x46546c67u /* "glTF" */
#define CHUNK_JSON 0x4e4f534au
#define CHUNK_BIN  0x004e4942u

/* Numbers of JSON take twenty times their bytes. */
#define JSON_MAX ((size_t)1 << 28)

enum imp_status imp__gltf_error(const struct gltf *g, const char *format, ...)
{
    char text[400];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return imp__error(g->ctx, IMP_E_SCENE, "%s: %s%s%s", g->in->name, g->where,
                      g->where[0] ? ": " : "", text);
}

enum imp_status imp__gltf_memory(const struct gltf *g)
{
    return imp__error(g->ctx, IMP_E_NOMEM, "%s: out of memory", g->in->name);
}

enum imp_status imp__gltf_unread(struct gltf *g, const char *lost, const char *format,
                                 ...)
{
    char text[200];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return imp__unread_add(g->in, &g->unread, 1, text, lost);
}

/* ---- Members ---------------------------------------------------------------------------- */

size_t imp__gltf_count(const struct gltf *g, const char *list)
{
    return json_array_size(json_object_get(g->root, list));
}

enum imp_status imp__gltf_item(struct gltf *g, const char *list, size_t index,
                               const json_t **out)
{
    *out = json_array_get(json_object_get(g->root, list), index);
    snprintf(g->where, sizeof g->where, "%s[%zu]", list, index);
    if (!json_is_object(*out)) return imp__gltf_error(g, "there is no such object");
    const char *name = imp__gltf_text(*out, "name");
    if (name) snprintf(g->where, sizeof g->where, "%s[%zu] '%.80s'", list, index, name);
    return IMP_OK;
}

static enum imp_status number_of(const struct gltf *g, const json_t *value,
                                 const char *name, double *out)
{
    if (!json_is_number(value) || !isfinite(json_number_value(value)))
        return imp__gltf_error(g, "%s is not a number", name);
    *out = json_number_value(value);
    return IMP_OK;
}

enum imp_status imp__gltf_number(const struct gltf *g, const json_t *object,
                                 const char *name, double lo, double hi, double *out)
{
    const json_t *value = json_object_get(object, name);
    if (!value) return IMP_OK;
    IMP_CHECKED(number_of(g, value, name, out));
    if (!(*out >= lo && *out <= hi))
        return imp__gltf_error(g, "%s is %g, not between %g and %g", name, *out, lo, hi);
    return IMP_OK;
}

enum imp_status imp__gltf_numbers(const struct gltf *g, const json_t *object,
                                  const char *name, size_t n, double *out)
{
    const json_t *value = json_object_get(object, name);
    if (!value) return IMP_OK;
    if (json_array_size(value) != n)
        return imp__gltf_error(g, "%s is not a list of %zu numbers", name, n);
    for (size_t i = 0; i < n; i++)
        IMP_CHECKED(number_of(g, json_array_get(value, i), name, &out[i]));
    return IMP_OK;
}

enum imp_status imp__gltf_size(const struct gltf *g, const json_t *object,
                               const char *name, size_t count, size_t *out)
{
    const json_t *value = json_object_get(object, name);
    if (!value) return IMP_OK;
    /* 3.0 is an integer, too. */
    const double v = json_is_number(value) ? json_number_value(value) : -1;
    if (!(v >= 0 && v < (double)count && v == floor(v)))
        return imp__gltf_error(g, "%s is not an integer in [0, %zu)", name, count);
    *out = (size_t)v;
    return IMP_OK;
}

enum imp_status imp__gltf_index(const struct gltf *g, const json_t *object,
                                const char *name, size_t count, int *out)
{
    size_t index = SIZE_MAX;
    *out = -1;
    const enum imp_status st =
        imp__gltf_size(g, object, name, imp_min(count, (size_t)INT32_MAX), &index);
    if (st == IMP_OK && index != SIZE_MAX) *out = (int)index;
    return st;
}

bool imp__gltf_flag(const json_t *object, const char *name)
{
    return json_is_true(json_object_get(object, name));
}

const char *imp__gltf_text(const json_t *object, const char *name)
{
    return json_string_value(json_object_get(object, name));
}

const json_t *imp__gltf_extension(const json_t *object, const char *name)
{
    return json_object_get(json_object_get(object, "extensions"), name);
}

const char *imp__gltf_id(const struct gltf *g, const json_t *object, const char *kind,
                         size_t index)
{
    char text[64];
    const char *name = imp__gltf_text(object, "name");
    snprintf(text, sizeof text, "%s_%zu", kind, index);
    return imp__import_name(g->in, name && *name ? name : text);
}

/* ---- The file --------------------------------------------------------------------------- */

static uint32_t little(const unsigned char *p)
{
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 |
           (uint32_t)p[3] << 24;
}

/* The chunks of a .glb; of a .gltf all is JSON. */
static enum imp_status chunks(struct gltf *g, const char **json, size_t *n)
{
    const unsigned char *p = g->in->text->data;
    const size_t size = g->in->text->size;
    *json = (const char *)p;
    *n = size;
    if (size < 4 || little(p) != GLB_MAGIC) return IMP_OK;
    if (size < 20) return imp__gltf_error(g, "the file ends in its header");
    if (little(p + 4) != 2)
        return imp__gltf_error(g, "version %u of glTF; 2 is read",
                               (unsigned)little(p + 4));
    size_t at = 12;
    for (int k = 0; at + 8 <= size; k++) {
        const size_t length = little(p + at);
        const uint32_t type = little(p + at + 4);
        if (length > size - at - 8)
            return imp__gltf_error(g, "the file ends inside its chunk %d", k + 1);
        if (k == 0 && type != CHUNK_JSON)
            return imp__gltf_error(g, "the first chunk is not JSON");
        if (k == 0) {
            *json = (const char *)p + at + 8;
            *n = length;
        } else if (type == CHUNK_BIN && !g->binary) {
            g->binary = p + at + 8;
            g->n_binary = length;
        }
        at += 8 + length;
        at = (at + 3) & ~(size_t)3;
    }
    return IMP_OK;
}

static enum imp_status json_read(struct gltf *g)
{
    const char *json;
    size_t n;
    json_error_t error;
    IMP_CHECKED(chunks(g, &json, &n));
    if (n > JSON_MAX)
        return imp__gltf_error(g, "%zu bytes of JSON; at most %zu are read", n, JSON_MAX);
    g->root = json_loadb(json, n, 0, &error);
    if (!g->root && json_error_code(&error) == json_error_out_of_memory)
        return imp__gltf_memory(g);
    if (!g->root)
        return imp__loc_error(g->ctx,
                              (struct imp_loc){g->in->name, error.line, error.column},
                              IMP_E_SCENE, "%.200s", error.text);
    if (!json_is_object(g->root)) return imp__gltf_error(g, "it is no object of JSON");
    const char *version = imp__gltf_text(json_object_get(g->root, "asset"), "version");
    if (!version || strncmp(version, "2.", 2) != 0)
        return imp__gltf_error(g, "asset.version is '%.20s'; 2.0 is read",
                               version ? version : "");
    return IMP_OK;
}

/* Extensions without which the file has another meaning. */
static enum imp_status required(struct gltf *g)
{
    static const char *const known[] = {
        "KHR_lights_punctual",        "KHR_materials_emissive_strength",
        "KHR_materials_ior",          "KHR_materials_clearcoat",
        "KHR_materials_transmission", "KHR_materials_volume",
        "KHR_materials_unlit",        "KHR_mesh_quantization",
        "KHR_texture_transform"};
    const json_t *list = json_object_get(g->root, "extensionsRequired");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const char *name = json_string_value(json_array_get(list, i));
        bool found = false;
        for (size_t k = 0; name && k < imp_count(known); k++)
            found |= strcmp(name, known[k]) == 0;
        if (name && !found)
            return imp__error(g->ctx, IMP_E_UNSUPPORTED,
                              "%s: needs the extension %.80s, which is not supported",
                              g->in->name, name);
    }
    return IMP_OK;
}

static enum imp_status tables(struct gltf *g)
{
    g->n_buffers = imp__gltf_count(g, "buffers");
    g->n_images = imp__gltf_count(g, "images");
    g->n_materials = imp__gltf_count(g, "materials");
    g->n_meshes = imp__gltf_count(g, "meshes");
    g->n_nodes = imp__gltf_count(g, "nodes");
    struct imp_arena *files = &g->in->scene->files;
    g->buffer = imp__arena_array(files, g->n_buffers + 1, sizeof *g->buffer);
    g->film = imp__arena_array(files, g->n_images + 1, sizeof(imp_film *));
    g->film_srgb = imp__arena_array(files, g->n_images + 1, sizeof *g->film_srgb);
    g->material = imp__arena_array(files, g->n_materials + 1, sizeof *g->material);
    g->mesh = imp__arena_array(files, g->n_meshes + 1, sizeof *g->mesh);
    g->visited = imp__arena_array(files, g->n_nodes + 1, sizeof *g->visited);
    g->folder = imp__folder_of(g->in->scene, g->in->name);
    return g->buffer && g->film && g->film_srgb && g->material && g->mesh && g->visited &&
                   g->folder
               ? IMP_OK
               : imp__gltf_memory(g);
}

enum imp_status imp__gltf_read(const struct imp__import *in)
{
    enum imp_status st = IMP_OK;
    struct gltf g = {.in = in,
                     .ctx = in->scene->ctx,
                     .loc = {in->name, 1, 1},
                     .lo = {INFINITY, INFINITY, INFINITY},
                     .hi = {-INFINITY, -INFINITY, -INFINITY},
                     .bytes_read = (double)in->text->size};
    IMP_TRY(imp__import_number(in, "efficacy", "1", 0, 1e6, &g.efficacy));
    IMP_TRY(json_read(&g));
    IMP_TRY(required(&g));
    IMP_TRY(tables(&g));
    IMP_TRY(imp__gltf_nodes(&g));
    IMP_TRY(imp__unread_finish(in, &g.unread));
out:
    for (size_t i = 0; g.film && i < g.n_images; i++) imp_film_destroy(g.film[i]);
    for (size_t i = 0; g.buffer && i < g.n_buffers; i++)
        imp__bytes_free(g.ctx, &g.buffer[i].own);
    json_decref(g.root);
    return st;
}
