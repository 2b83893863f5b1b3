/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures as textures: the channels that a material asks for, times its factors. */
#include "color/rgb.h"
#include "format/image.h"
#include "gltf.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static enum imp_status film_of(struct gltf *g, size_t index, imp_film **out)
{
    const json_t *object;
    struct imp_bytes own = {0}, file = {0};
    int view;
    *out = g->film[index];
    if (*out) return IMP_OK;
    IMP_CHECKED(imp__gltf_item(g, "images", index, &object));
    const char *uri = imp__gltf_text(object, "uri");
    char name[256];
    IMP_CHECKED(imp__gltf_index(g, object, "bufferView",
                                imp__gltf_count(g, "bufferViews"), &view));
    snprintf(name, sizeof name, "%.120s: %.100s", g->in->name, g->where);
    if (uri) {
        IMP_CHECKED(imp__gltf_uri(g, uri, &own));
        file = own;
    } else {
        const unsigned char *data;
        size_t size, stride;
        if (view < 0) return imp__gltf_error(g, "has neither a uri nor a bufferView");
        IMP_CHECKED(imp__gltf_view(g, (size_t)view, &data, &size, &stride));
        file = (struct imp_bytes){(unsigned char *)data, size, size};
    }
    const enum imp_status st =
        imp__image_parse(g->ctx, name, &file, &g->film[index], &g->film_srgb[index]);
    imp__bytes_free(g->ctx, &own);
    *out = g->film[index];
    return st;
}

static double encoded(double v, bool srgb) { return srgb ? imp__srgb_decode(v) : v; }

/* A normal's texel with its slope times `scale`. */
static void direction(const float *from, double scale, float *to)
{
    double n[3], length = 0;
    for (int k = 0; k < 3; k++) {
        n[k] = (2 * (double)from[k] - 1) * (k < 2 ? scale : 1);
        length += n[k] * n[k];
    }
    for (int k = 0; k < 3; k++)
        to[k] = (float)(length > 0 ? .5 + .5 * n[k] / sqrt(length) : k == 2 ? 1 : .5);
}

static enum imp_status texels(struct gltf *g, const imp_film *film, bool srgb,
                              const struct gltf_texture *t, struct imp_image_data *out)
{
    const struct imp_pick pick = imp__image_pick(film);
    const bool three = t->use == GLTF_COLOR || t->use == GLTF_DIRECTION;
    const size_t n = (size_t)film->width * (size_t)film->height;
    const int channels = three ? 3 : 1;
    if (!pick.n || pick.xyz) return imp__gltf_error(g, "its picture has no colours");
    IMP_CHECKED(imp__gltf_made(g, (double)n * channels * sizeof(float)));
    float *to = imp__arena_take(&g->in->scene->files, n, (size_t)channels * sizeof *to);
    if (!to) return imp__gltf_memory(g);
    const bool plain = t->factor[0] == 1 && t->factor[1] == 1 && t->factor[2] == 1;
    *out = (struct imp_image_data){film->width, film->height, channels, to,
                                   t->use == GLTF_COLOR && srgb && plain};
    const int alpha = imp__film_find(film, "A");
    for (size_t i = 0; i < n; i++, to += channels) {
        const float *from = film->mean + i * (size_t)film->channels;
        float rgb[3];
        for (int k = 0; k < 3; k++) rgb[k] = from[pick.channel[pick.n == 3 ? k : 0]];
        switch ((enum gltf_use)t->use) {
        case GLTF_COLOR:
            for (int k = 0; k < 3; k++)
                to[k] = plain ? rgb[k]
                              : (float)(t->factor[k] * encoded((double)rgb[k], srgb));
            break;
        case GLTF_DIRECTION: direction(rgb, t->factor[0], to); break;
        case GLTF_RED: *to = (float)(t->factor[0] * (double)rgb[0]); break;
        case GLTF_GREEN: *to = (float)(t->factor[0] * (double)rgb[1]); break;
        case GLTF_BLUE: *to = (float)(t->factor[0] * (double)rgb[2]); break;
        case GLTF_ALPHA: *to = (float)(t->factor[0] * (double)from[alpha]); break;
        case GLTF_CUT: *to = (double)from[alpha] >= t->factor[0]; break;
        }
    }
    return IMP_OK;
}

/* ---- textureInfo -------------------------------------------------------------------------- */

enum imp_status imp__gltf_texcoord(struct gltf *g, const json_t *info, int *out)
{
    size_t set = 0;
    IMP_CHECKED(imp__gltf_size(g, info, "texCoord", 100, &set));
    IMP_CHECKED(imp__gltf_size(g, imp__gltf_extension(info, "KHR_texture_transform"),
                               "texCoord", 100, &set));
    *out = (int)set;
    return IMP_OK;
}

/* KHR_texture_transform: the uvs scaled, then turned, then moved. */
static enum imp_status transform(struct gltf *g, const json_t *info, double m[16])
{
    const json_t *t = imp__gltf_extension(info, "KHR_texture_transform");
    double offset[2] = {0, 0}, scale[2] = {1, 1}, angle = 0;
    const struct imp_mat4 none = imp__mat4_identity();
    memcpy(m, none.m, sizeof none.m);
    if (!t) return IMP_OK;
    IMP_CHECKED(imp__gltf_numbers(g, t, "offset", 2, offset));
    IMP_CHECKED(imp__gltf_numbers(g, t, "scale", 2, scale));
    IMP_CHECKED(imp__gltf_number(g, t, "rotation", -1e6, 1e6, &angle));
    const double c = cos(angle), s = sin(angle);
    m[0] = c * scale[0], m[1] = s * scale[1], m[3] = offset[0];
    m[4] = -s * scale[0], m[5] = c * scale[1], m[7] = offset[1];
    return IMP_OK;
}

static enum imp_status sampling(struct gltf *g, const json_t *texture,
                                struct imp_node *node)
{
    const json_t *object;
    int sampler;
    size_t filter = 0, s = 10497, t = 10497; /* REPEAT */
    IMP_CHECKED(
        imp__gltf_index(g, texture, "sampler", imp__gltf_count(g, "samplers"), &sampler));
    if (sampler < 0) return IMP_OK;
    IMP_CHECKED(imp__gltf_item(g, "samplers", (size_t)sampler, &object));
    IMP_CHECKED(imp__gltf_size(g, object, "magFilter", 65536, &filter));
    IMP_CHECKED(imp__gltf_size(g, object, "wrapS", 65536, &s));
    IMP_CHECKED(imp__gltf_size(g, object, "wrapT", 65536, &t));
    if (s != t)
        imp__warn(g->ctx, "%s: %s: wrapT is taken to be wrapS", g->in->name, g->where);
    if (filter == 9728)
        IMP_CHECKED(imp__import_string(g->in, node, "filter_type", "nearest", g->loc));
    if (s != 10497)
        IMP_CHECKED(imp__import_string(g->in, node, "wrap_mode",
                                       s == 33071 ? "clamp" : "mirror", g->loc));
    return IMP_OK;
}

static enum imp_status make(struct gltf *g, struct gltf_texture *t)
{
    static const char *const uses[] = {"color",   "green", "blue",  "red",
                                       "opacity", "cut",   "normal"};
    const json_t *texture;
    struct imp_node *node;
    imp_film *film;
    int image;
    IMP_CHECKED(imp__gltf_item(g, "textures", (size_t)t->texture, &texture));
    IMP_CHECKED(imp__gltf_index(g, texture, "source", g->n_images, &image));
    if (image < 0)
        return imp__gltf_unread(g, "it is left out",
                                "%s: a picture that is not PNG or JPEG", g->where);
    IMP_CHECKED(film_of(g, (size_t)image, &film));
    if ((t->use == GLTF_ALPHA || t->use == GLTF_CUT) && imp__film_find(film, "A") < 0)
        return IMP_OK; /* opaque */
    char name[140];
    const char *own = imp__gltf_text(texture, "name");
    snprintf(name, sizeof name, "texture_%d_%s", t->texture, uses[t->use]);
    if (own && *own) snprintf(name, sizeof name, "%.100s_%s", own, uses[t->use]);
    const json_t *named = json_pack("{s:s}", "name", name);
    t->id = imp__gltf_id(g, named, "texture", (size_t)t->texture);
    json_decref((json_t *)named);
    if (!t->id) return imp__gltf_memory(g);
    IMP_CHECKED(imp__tree_open(g->in->tree, g->in->parent, "texture", "bitmap", t->id,
                               NULL, g->loc, &node));
    struct imp_image_data *data = imp__arena_array(&g->in->scene->files, 1, sizeof *data);
    if (!data) return imp__gltf_memory(g);
    IMP_CHECKED(texels(g, film, g->film_srgb[image], t, data));
    node->image = data;
    if (t->use != GLTF_COLOR)
        IMP_CHECKED(imp__import_bool(g->in, node, "raw", true, g->loc));
    IMP_CHECKED(sampling(g, texture, node));
    const struct imp_mat4 none = imp__mat4_identity();
    if (memcmp(t->matrix, none.m, sizeof none.m) != 0)
        IMP_CHECKED(imp__import_matrix(g->in, node, "to_uv", t->matrix, g->loc));
    return IMP_OK;
}

enum imp_status imp__gltf_texture(struct gltf *g, const json_t *info, enum gltf_use use,
                                  const double factor[3], const char **id)
{
    struct gltf_texture wanted = {.use = (int)use}, *t;
    *id = NULL;
    if (!info) return IMP_OK;
    IMP_CHECKED(imp__gltf_index(g, info, "index", imp__gltf_count(g, "textures"),
                                &wanted.texture));
    if (wanted.texture < 0) return imp__gltf_error(g, "a texture has no index");
    memcpy(wanted.factor, factor, sizeof wanted.factor);
    IMP_CHECKED(transform(g, info, wanted.matrix));
    for (t = g->textures; t; t = t->next)
        if (t->texture == wanted.texture && t->use == wanted.use &&
            memcmp(t->factor, wanted.factor, sizeof t->factor) == 0 &&
            memcmp(t->matrix, wanted.matrix, sizeof t->matrix) == 0) {
            *id = t->id;
            return IMP_OK;
        }
    t = imp__arena_array(&g->in->scene->files, 1, sizeof *t);
    if (!t) return imp__gltf_memory(g);
    *t = wanted;
    t->next = g->textures;
    g->textures = t;
    IMP_CHECKED(make(g, t));
    *id = t->id;
    return IMP_OK;
}
