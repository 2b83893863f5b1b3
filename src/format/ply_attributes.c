/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers of a PLY file's vertices and faces that are none of the geometry: vertex_NAME and
 * face_NAME (docs/scene-format.md 13.2). */
#include "base/context.h"
#include "color/rgb.h"
#include "ply_file.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* The channel that a name of one letter or word is, of a colour; -1: none. */
static int color_channel(const char *name)
{
    static const char *const names[][2] = {
        {"r", "red"}, {"g", "green"}, {"b", "blue"}, {"a", "alpha"}};
    for (int c = 0; c < 4; c++)
        if (strcmp(name, names[c][0]) == 0 || strcmp(name, names[c][1]) == 0) return c;
    return -1;
}

/* Properties i to i + n of an element, of one prefix, are an attribute of n channels.
 * Those of another number than 1 and 3 are read as 0, as in Mitsuba: they are left out. */
static enum imp_status attribute_add(struct ply *p, int element, int i, int n)
{
    const struct ply_element *e = &p->elements[element];
    struct ply_property *q = &p->properties[i];
    const bool face = element == p->face;
    const char *mark = strrchr(q->name, '_');
    const bool bare = color_channel(q->name) >= 0;
    const bool color = bare || (mark && n > 1 && color_channel(mark + 1) == 0);
    char name[64];
    snprintf(name, sizeof name, "%s_%.*s%s", face ? "face" : "vertex",
             bare   ? 5
             : mark ? (int)(mark - q->name)
                    : (int)strlen(q->name),
             bare ? "color" : q->name, color && !bare ? "_color" : "");
    for (int k = 0; k < p->n_attributes; k++)
        if (strcmp(p->attribute[k].name, name) == 0)
            return imp__ply_error(p, "attribute '%s' is there twice", name);
    if (n != 1 && n != 3) {
        imp__warn(p->ctx,
                  "%s: attribute '%s' of %d channels is read as 0; 1 or 3 are "
                  "possible",
                  p->source->name, name, n);
        return IMP_OK;
    }
    if (p->n_attributes == ATTRIBUTES_MAX)
        return imp__ply_error(p, "more than %d attributes", ATTRIBUTES_MAX);
    char *kept = imp__arena_take(p->source->keep, strlen(name) + 1, 1);
    if (!kept) return imp__error(p->ctx, IMP_E_NOMEM, "%s: no memory", p->source->name);
    strcpy(kept, name);
    p->attribute[p->n_attributes] =
        (struct imp_attribute_data){.name = kept,
                                    .n = e->n,
                                    .channels = n,
                                    .face = face,
                                    .color = strstr(name, "color") != NULL};
    for (int c = 0; c < n; c++) {
        q[c].attribute = p->n_attributes;
        q[c].channel = c;
    }
    p->n_attributes++;
    return IMP_OK;
}

/* Neighbouring properties NAME_x, NAME_y, NAME_z or r, g, b belong together. */
static bool together(const struct ply_property *a, const struct ply_property *b)
{
    const char *ma = strrchr(a->name, '_'), *mb = strrchr(b->name, '_');
    if (b->use != USE_SKIP || b->count != PLY_NONE) return false;
    if (color_channel(a->name) >= 0) return color_channel(b->name) >= 0;
    return ma && mb && ma - a->name == mb - b->name &&
           strncmp(a->name, b->name, (size_t)(ma - a->name)) == 0;
}

static enum imp_status attributes_find(struct ply *p, int element)
{
    enum imp_status st = IMP_OK;
    const struct ply_element *e = &p->elements[element];
    const int end = e->first + e->n_properties;
    for (int i = e->first, n; i < end; i += n) {
        const struct ply_property *q = &p->properties[i];
        n = 1;
        if (q->use != USE_SKIP || q->count != PLY_NONE) continue;
        while (i + n < end && together(q, &p->properties[i + n])) n++;
        IMP_TRY(attribute_add(p, element, i, n));
    }
out:
    return st;
}

static enum imp_status attributes_allocate(struct ply *p)
{
    for (int k = 0; k < p->n_attributes; k++) {
        struct imp_attribute_data *a = &p->attribute[k];
        a->values = imp__arena_take(p->source->temporary, a->n * (size_t)a->channels,
                                    sizeof *a->values);
        if (!a->values)
            return imp__error(p->ctx, IMP_E_NOMEM, "%s: no memory for attribute '%s'",
                              p->source->name, a->name);
    }
    return IMP_OK;
}

/* Integers encode [0,1], as in pictures. */
enum imp_status imp__ply_attribute_store(struct ply *p, const struct ply_property *q,
                                         size_t row, double x)
{
    static const double top[] = {INT8_MAX,   UINT8_MAX, INT16_MAX,
                                 UINT16_MAX, INT32_MAX, UINT32_MAX};
    const struct imp_attribute_data *a = &p->attribute[q->attribute];
    const float f =
        (float)(q->type < PLY_F32 ? imp__srgb_decode(imp_max(x / top[q->type], 0.0)) : x);
    if (!isfinite(f))
        return imp__ply_error(p, "%s of %s %zu is not finite", a->name,
                              a->face ? "face" : "vertex", row);
    a->values[row * (size_t)a->channels + (size_t)q->channel] = f;
    return IMP_OK;
}

enum imp_status imp__ply_attributes(struct ply *p)
{
    enum imp_status st = IMP_OK;
    IMP_TRY(attributes_find(p, p->vertex));
    IMP_TRY(attributes_find(p, p->face));
    IMP_TRY(attributes_allocate(p));
out:
    return st;
}

enum imp_status imp__ply_attributes_keep(const struct ply *p, struct imp_mesh_data *mesh)
{
    const size_t n = (size_t)p->n_attributes;
    mesh->n_attributes = p->n_attributes;
    mesh->attribute =
        imp__arena_array(p->source->temporary, n + 1, sizeof *mesh->attribute);
    if (!mesh->attribute)
        return imp__error(p->ctx, IMP_E_NOMEM, "%s: no memory", p->source->name);
    if (n) memcpy(mesh->attribute, p->attribute, n * sizeof *mesh->attribute);
    return IMP_OK;
}
