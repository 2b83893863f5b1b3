/* SPDX-License-Identifier: Apache-2.0
 *
 * What a file of another program is seen through and lit by, where it says nothing. */
#include "base/arguments.h"
#include "import.h"
#include "math/transform.h"
#include <math.h>

#define FOV 40 /* degrees */

enum imp_status imp__import_film(const struct imp__import *in, struct imp_node *sensor,
                                 double aspect, struct imp_loc loc)
{
    double width, spp;
    struct imp_node *node;
    IMP_CHECKED(imp__import_number(in, "width", "512", 1, 65536, &width));
    IMP_CHECKED(imp__import_number(in, "spp", "64", 1, 1e9, &spp));
    const double height = floor(width / aspect + .5);
    if (!(height < 65536))
        return imp__error(in->scene->ctx, IMP_E_SCENE,
                          "%s: the picture would be %g pixels high", in->name, height);
    IMP_CHECKED(
        imp__tree_open(in->tree, sensor, "film", "hdrfilm", NULL, NULL, loc, &node));
    IMP_CHECKED(imp__import_integer(in, node, "width", (int64_t)width, loc));
    IMP_CHECKED(imp__import_integer(in, node, "height",
                                    imp_max((int64_t)height, (int64_t)1), loc));
    IMP_CHECKED(imp__tree_open(in->tree, sensor, "sampler", "independent", NULL, NULL,
                               loc, &node));
    return imp__import_integer(in, node, "sample_count", (int64_t)spp, loc);
}

enum imp_status imp__import_camera(const struct imp__import *in, const double lo[3],
                                   const double hi[3], struct imp_loc loc)
{
    imp_context *ctx = in->scene->ctx;
    struct imp_mat4 look;
    struct imp_node *sensor;
    const imp_v3 a = imp__v3(lo[0], lo[1], lo[2]), b = imp__v3(hi[0], hi[1], hi[2]),
                 middle = (a + b) * .5, from = imp__normalize(imp__v3(.45, .35, 1));
    const double radius = .5 * imp__length(b - a);
    if (!(radius > 0) || !isfinite(radius))
        return imp__error(ctx, IMP_E_SCENE, "%s: it has no mesh to look at", in->name);
    if (!imp__lookat(middle + from * (radius / sin(FOV * IMP_PI / 360)), middle,
                     imp__v3(0, 1, 0), &look))
        return imp__error(ctx, IMP_E_SCENE, "%s: its meshes are too far away to look at",
                          in->name);
    const char *id = imp__import_id(in, "camera");
    if (!id) return imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", in->name);
    IMP_CHECKED(imp__tree_open(in->tree, in->parent, "sensor", "perspective", id, NULL,
                               loc, &sensor));
    IMP_CHECKED(imp__import_matrix(in, sensor, "to_world", look.m, loc));
    IMP_CHECKED(imp__import_string(in, sensor, "fov_axis", "smaller", loc));
    IMP_CHECKED(imp__import_float(in, sensor, "fov", FOV, loc));
    return imp__import_film(in, sensor, 4. / 3, loc);
}

enum imp_status imp__import_sky(const struct imp__import *in, struct imp_loc loc)
{
    struct imp_node *sky;
    const char *id = imp__import_id(in, "sky");
    if (!id)
        return imp__error(in->scene->ctx, IMP_E_NOMEM, "%s: out of memory", in->name);
    imp__warn(in->scene->ctx,
              "%s: it has no light: a sky of radiance 1 from everywhere is added",
              in->name);
    IMP_CHECKED(
        imp__tree_open(in->tree, in->parent, "emitter", "constant", id, NULL, loc, &sky));
    return imp__import_rgb(in, sky, "radiance", (double[3]){1, 1, 1}, loc);
}
