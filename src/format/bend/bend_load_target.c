/* SPDX-License-Identifier: Apache-2.0
 *
 * <target>: what is minimised. */
#include "base/arguments.h"
#include "bend_load.h"
#include "format/search.h"
#include <string.h>

/* Picture or numbers of a target from its file. */
static enum imp_status target_file(struct imp__bendfile *l, struct imp_node *node,
                                   const char *file, bool image,
                                   struct imp_bend_target *t, imp_film **film,
                                   double **data, float **pixels)
{
    enum imp_status st = IMP_OK;
    const char *path;
    struct imp_film_info info = {.size = sizeof info};
    IMP_TRY(imp__search(l->scene, NULL, file, &path));
    IMP_TRY(imp_film_read(l->ctx, path, film));
    imp_film_get_info(*film, &info);
    const float *p = imp_film_mean(*film);
    const size_t n = (size_t)info.width * (size_t)info.height, c = (size_t)info.channels;
    if (image) { /* the mean of the colours */
        *pixels = imp__alloc(l->ctx, n, sizeof **pixels);
        if (!*pixels) IMP_TRY(imp__error(l->ctx, IMP_E_NOMEM, "%s: no memory", file));
        const size_t colours = imp_min(c, (size_t)3);
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < colours; k++)
                (*pixels)[i] += imp_max(p[i * c + k], 0.0f) / (float)colours;
        t->pixels = *pixels;
        t->width = info.width, t->height = info.height;
        goto out;
    }
    const size_t first = t->bundle < 0 ? 0 : l->bend->bundle_first[t->bundle];
    const size_t last = t->bundle < 0 ? l->bend->n : l->bend->bundle_first[t->bundle + 1];
    const size_t each = t->type == IMP_BEND_PATH ? 1 : 3;
    if (n * c != (last - first) * each)
        IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE,
                                "%s holds %zu numbers, %zu rays need "
                                "%zu each",
                                file, n * c, last - first, each));
    *data = imp__alloc(l->ctx, n * c, sizeof **data);
    if (!*data) IMP_TRY(imp__error(l->ctx, IMP_E_NOMEM, "%s: no memory", file));
    for (size_t i = 0; i < n * c; i++) (*data)[i] = p[i];
    t->data = *data;
out:
    return st;
}

static enum imp_status type_read(const struct imp__bendfile *l,
                                 const struct imp_node *node,
                                 enum imp_bend_target_type *out)
{
    static const char *const types[IMP_BEND_N_TARGETS] = {
        "focus", "spot",      "points", "direction", "directions", "deflection",
        "path",  "wavefront", "image",  "far-field", "shape"};
    for (int k = 0; k < IMP_BEND_N_TARGETS; k++)
        if (strcmp(node->type, types[k]) == 0) {
            *out = (enum imp_bend_target_type)k;
            return IMP_OK;
        }
    return imp__node_error(
        l->ctx, node, IMP_E_SCENE,
        "is of no known type: there are focus, spot, points, direction, "
        "directions, deflection, path, wavefront, image, far-field, "
        "shape");
}

/* Where the target is: its plane, and a point or a direction. */
static enum imp_status place_read(struct imp__bendfile *l, struct imp_node *node,
                                  const struct imp__bendfile_frame *f,
                                  struct imp_bend_target *t)
{
    const double z[3] = {0, 0, 1}, zero[3] = {0};
    double normal[3], point[3];
    t->at_plane = imp__props_has(node, "plane");
    IMP_CHECKED(imp__bendfile_number(l, node, "plane", 0, -1e300, 1e300, &t->offset));
    IMP_CHECKED(imp__props_vector(l->ctx, node, "normal", z, normal));
    IMP_CHECKED(imp__bendfile_number(l, node, "index", l->options.outside_index, 1e-6,
                                     1e6, &t->outside));
    IMP_CHECKED(imp__props_vector(l->ctx, node, "point", zero, point));
    imp__v3_store(imp__bendfile_direction(f, imp__v3_load(normal)), t->normal);
    t->offset += imp__dot(imp__v3_load(t->normal), f->o);
    const bool direction = t->type == IMP_BEND_DIRECTION;
    imp__v3_store(direction ? imp__bendfile_direction(f, imp__v3_load(point))
                            : imp__bendfile_point(f, imp__v3_load(point)),
                  t->point);
    return IMP_OK;
}

/* The corner and the sides of a picture. */
static enum imp_status picture_read(struct imp__bendfile *l, struct imp_node *node,
                                    const struct imp__bendfile_frame *f,
                                    struct imp_bend_target *t)
{
    const double corner[3] = {-1, 1, 0}, right[3] = {2, 0, 0}, down[3] = {0, -2, 0};
    double origin[3], u[3], v[3];
    IMP_CHECKED(imp__props_vector(l->ctx, node, "corner", corner, origin));
    IMP_CHECKED(imp__props_vector(l->ctx, node, "u", right, u));
    IMP_CHECKED(imp__props_vector(l->ctx, node, "v", down, v));
    imp_v3 o = imp__v3_load(origin);
    if (t->type == IMP_BEND_IMAGE && t->at_plane && o[2] == 0) {
        double p;
        IMP_CHECKED(imp__bendfile_number(l, node, "plane", 0, -1e300, 1e300, &p));
        o[2] = p;
    }
    imp__v3_store(t->type == IMP_BEND_FARFIELD ? imp__bendfile_direction(f, o)
                                               : imp__bendfile_point(f, o),
                  t->origin);
    imp__v3_store(imp__bendfile_direction(f, imp__v3_load(u)), t->u);
    imp__v3_store(imp__bendfile_direction(f, imp__v3_load(v)), t->v);
    return IMP_OK;
}

static enum imp_status truth_check(const struct imp__bendfile *l,
                                   const struct imp_node *node,
                                   const struct imp_bend_target *t)
{
    const char *const why =
        imp__target_numbers(t->type) == 0
            ? "'from_truth' is for points, directions, deflection and path"
        : !l->truth ? "'from_truth', and no <volume name=\"truth\"> in the medium"
                    : NULL;
    return why ? imp__prop_error(l->ctx, node, imp__node_prop(node, "from_truth"),
                                 IMP_E_SCENE, "%s", why)
               : IMP_OK;
}

/* Adds the target; an error of its numbers is one of the node. */
static enum imp_status target_add(struct imp__bendfile *l, const struct imp_node *node,
                                  const struct imp_bend_target *t, bool from_truth)
{
    const enum imp_status st = imp_bend_add_target(l->bend, t);
    if (st == IMP_E_ARG) {
        char message[512];
        strncpy(message, imp_last_error(l->ctx), sizeof message - 1);
        message[sizeof message - 1] = 0;
        return imp__node_error(l->ctx, node, IMP_E_SCENE, "%s", message);
    }
    if (st == IMP_OK && from_truth) { /* the sign marks it for truth_apply */
        struct imp__target_of_rays *made = &l->bend->targets[l->bend->n_targets - 1];
        made->power = -made->power;
    }
    return st;
}

enum imp_status imp__bendfile_target(struct imp__bendfile *l, struct imp_node *node,
                                     const struct imp__bendfile_frame *f, int bundle)
{
    enum imp_status st = IMP_OK;
    struct imp_bend_target t = IMP_BEND_TARGET_INIT;
    const char *file;
    imp_film *film = NULL;
    double *data = NULL;
    float *pixels = NULL;
    bool from_truth;
    int64_t tap;
    IMP_TRY(type_read(l, node, &t.type));
    t.bundle = bundle;
    const bool image = t.type == IMP_BEND_IMAGE || t.type == IMP_BEND_FARFIELD;
    IMP_TRY(imp__bendfile_number(l, node, "weight", 1, 0, 1e300, &t.weight));
    IMP_TRY(imp__props_int(l->ctx, node, "tap", -1, -1, 15, &tap));
    t.tap = (int)tap;
    IMP_TRY(place_read(l, node, f, &t));
    IMP_TRY(imp__props_bool(l->ctx, node, "from_truth", false, &from_truth));
    IMP_TRY(imp__props_string(l->ctx, node, "filename", NULL, &file));
    if (image) {
        IMP_TRY(picture_read(l, node, f, &t));
        if (!file)
            IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE, "needs a 'filename'"));
    }
    if (file) IMP_TRY(target_file(l, node, file, image, &t, &film, &data, &pixels));
    if (t.type == IMP_BEND_SHAPE) IMP_TRY(imp__bendfile_sdf(l, node, &t.sdf));
    IMP_TRY(imp__props_finish(l->ctx, node));
    if (from_truth) IMP_TRY(truth_check(l, node, &t));
    if (from_truth && !t.data) { /* filled when all is there */
        const size_t *begin = l->bend->bundle_first;
        const size_t n = bundle < 0 ? l->bend->n : begin[bundle + 1] - begin[bundle];
        data = imp__alloc(l->ctx, 3 * n, sizeof *data);
        if (!data) IMP_TRY(imp__error(l->ctx, IMP_E_NOMEM, "no memory for a target"));
        for (size_t i = 0; i < 3 * n; i++) data[i] = 1;
        t.data = data;
    }
    st = target_add(l, node, &t, from_truth);
out:
    imp_film_destroy(film);
    imp__release(l->ctx, data);
    imp__release(l->ctx, pixels);
    return st;
}
