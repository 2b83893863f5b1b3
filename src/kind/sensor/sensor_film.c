/* SPDX-License-Identifier: Apache-2.0
 *
 * Reads film and sampler of a sensor: size, crop, filter, samples per pixel. */
#include "sensor_film.h"
#include "base/compiler.h"
#include "kind/filter/filter.h"
#include "kind/registry.h"
#include "sensor_response.h"
#include <string.h>

/* Sides and pixels of the full film: beyond any picture, within int and double. */
#define SIDE_MAX   1000000
#define PIXELS_MAX ((int64_t)1 << 31)

static enum imp_status size_read(const struct imp_build *b, struct imp_film_desc *f)
{
    enum imp_status st = IMP_OK;
    const struct {
        const char *name;
        int64_t lo;
    } fields[6] = {{"width", 1},         {"height", 1},     {"crop_offset_x", 0},
                   {"crop_offset_y", 0}, {"crop_width", 1}, {"crop_height", 1}};
    int64_t v[6] = {768, 576, 0, 0, 0, 0};

    for (int i = 0; i < 6; i++) {
        if (i >= 4) v[i] = v[i - 4]; /* the crop window is the whole film */
        IMP_TRY(imp_build_int(b, fields[i].name, v[i], fields[i].lo, SIDE_MAX, &v[i]));
    }
    if (v[0] * v[1] > PIXELS_MAX)
        IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE, "%lld x %lld pixels are too many",
                                (long long)v[0], (long long)v[1]));
    for (int i = 0; i < 2; i++)
        if (v[2 + i] + v[4 + i] > v[i])
            IMP_TRY(imp_build_error(
                b, fields[imp_build_has(b, fields[2 + i].name) ? 2 + i : 4 + i].name,
                IMP_E_SCENE, "%s + %s = %lld is outside [1, %s = %lld]",
                fields[2 + i].name, fields[4 + i].name, (long long)(v[2 + i] + v[4 + i]),
                fields[i].name, (long long)v[i]));
    f->width = (int)v[0];
    f->height = (int)v[1];
    f->crop_x = (int)v[2];
    f->crop_y = (int)v[3];
    f->crop_w = (int)v[4];
    f->crop_h = (int)v[5];
out:
    return st;
}

static enum imp_status format_read(const struct imp_build *b, struct imp_film_desc *f)
{
    static const char *const files[] = {"openexr", "exr", "rgbe", "pfm"};
    static const char *const pixels[] = {[IMP_PIXEL_LUMINANCE] = "luminance",
                                         [IMP_PIXEL_LUMINANCE_ALPHA] = "luminance_alpha",
                                         [IMP_PIXEL_RGB] = "rgb",
                                         [IMP_PIXEL_RGBA] = "rgba",
                                         [IMP_PIXEL_XYZ] = "xyz",
                                         [IMP_PIXEL_XYZA] = "xyza"};
    static const char *const components[] = {"float16", "float32", "uint32"};
    enum imp_status st = IMP_OK;
    int file, pixel, component;

    IMP_TRY(imp_build_choice(b, "file_format", files, imp_count(files), 0, &file));
    IMP_TRY(imp_build_choice(b, "pixel_format", pixels, imp_count(pixels), IMP_PIXEL_RGB,
                             &pixel));
    IMP_TRY(imp_build_choice(b, "component_format", components, imp_count(components), 0,
                             &component));
    f->file_format = file <= 1 ? "openexr" : files[file];
    f->pixel_format = (enum imp_pixel_format)pixel;
    f->half = component == 0;
    if (file >= 2) { /* these formats have nothing else */
        f->pixel_format = IMP_PIXEL_RGB;
        f->half = false;
    }
    if (b->mode == IMP_MONO && f->pixel_format != IMP_PIXEL_LUMINANCE_ALPHA)
        f->pixel_format = IMP_PIXEL_LUMINANCE; /* alpha stays where it is written */
    if (component == 2)
        imp__warn(b->ctx, "film: component_format 'uint32' is written as float32");
out:
    return st;
}

static enum imp_status filter_read(const struct imp_build *b, struct imp_film_desc *f)
{
    struct imp_node *filter = NULL;
    for (size_t i = 0; i < b->node->n_children; i++) {
        struct imp_child *c = &b->node->children[i];
        if (!c->node || strcmp(c->node->tag, "rfilter") != 0) continue;
        if (filter)
            return imp__node_error(b->ctx, c->node, IMP_E_SCENE,
                                   "the film has two filters");
        filter = c->node;
        c->used = true;
    }
    return imp__filter_build(b, filter, &f->filter);
}

static const struct film {
    size_t size;
    const char *name;
} films[] = {{sizeof(struct film), "hdrfilm"}, {sizeof(struct film), "specfilm"}};

const void *imp__film_at(const void *payload, size_t i)
{
    (void)payload;
    return i < imp_count(films) ? &films[i] : NULL;
}

enum imp_status imp__film_desc_build(const struct imp_build *b, struct imp_film_desc *out)
{
    enum imp_status st = IMP_OK;
    struct imp_film_desc f = {0};
    struct imp_build own = *b;
    const void *kind;
    bool ignored;

    if (!own.node) {
        own.node = imp__node_create(b->arena, "film", "hdrfilm", NULL, NULL,
                                    (struct imp_loc){0});
        if (!own.node)
            IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "out of memory for a film"));
    }
    IMP_TRY(imp__kind_choose(b->ctx, own.node, imp__film_at, NULL, &kind));
    const bool curves = kind == &films[1];
    IMP_TRY(size_read(&own, &f));
    if (curves) IMP_TRY(imp__responses_read(&own, &f));
    IMP_TRY(format_read(&own, &f));
    IMP_TRY(imp_build_bool(&own, "sample_border", false, &f.sample_border));
    IMP_TRY(imp_build_bool(&own, "banner", true, &ignored));
    IMP_TRY(imp_build_bool(&own, "compensate", false, &ignored));
    IMP_TRY(filter_read(&own, &f));
    IMP_TRY(imp__props_finish(b->ctx, own.node));
    *out = f;
out:
    return st;
}
