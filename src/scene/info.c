/* SPDX-License-Identifier: Apache-2.0
 *
 * What a scene holds, for people and host programs. */
#include "base/arguments.h"
#include "camera_gain.h"
#include "instances.h"

static double triangles_of(const struct imp_scene *scene, int first, int n)
{
    double sum = 0;
    for (int k = first; k < first + n; k++)
        if (scene->shapes[k]->geometry == IMP_TRIANGLES)
            sum += (double)scene->shapes[k]->triangles.n_triangles;
    return sum;
}

/* Triangles of a group, with those in its instances. */
static double triangles_met(const struct imp_scene *scene, const struct imp_group *g)
{
    double sum = triangles_of(scene, g->first, g->n_shapes), of_last = 0;
    const struct imp_group *last = NULL;
    for (int i = 0; i < g->n_instances; i++) {
        if (g->instance[i].group != last)
            of_last = triangles_met(scene, last = g->instance[i].group);
        sum += of_last;
    }
    return sum;
}

/* Its shapes, triangles and instances, and the triangles that rays can meet. */
static void instances_count(const struct imp_scene *scene, struct imp_scene_info *info)
{
    double own = triangles_of(scene, 0, scene->n_shapes);
    info->n_shapes = scene->n_shapes;
    info->triangles_met = scene->world ? triangles_met(scene, scene->world) : own;
    info->n_instances = scene->world ? scene->world->n_instances : 0;
    for (int k = 0; k < scene->n_groups; k++) {
        const struct imp_group *g = scene->groups[k];
        info->n_shapes += g->n_shapes;
        info->n_instances += g->n_instances;
        own += triangles_of(scene, g->first, g->n_shapes);
    }
    info->n_triangles = (int64_t)own;
}

enum imp_status imp_scene_get_info(const imp_scene *scene, struct imp_scene_info *out)
{
    struct imp_scene_info all = {.size = sizeof all}, *info = &all;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, out, "info");
    info->n_emitters = scene->n_emitters;
    info->n_bsdfs = scene->n_bsdfs;
    info->n_textures = scene->n_textures;
    info->n_sensors = scene->n_sensors;
    info->mode = scene->mode;
    info->channels = scene->channels;
    info->integrator = scene->integrator ? scene->integrator->ops->name : "";
    info->max_depth = scene->integrator ? scene->integrator->max_depth : -1;
    instances_count(scene, info);
    for (int c = 0; c < 3; c++) {
        info->bounds_min[c] = scene->lo[c];
        info->bounds_max[c] = scene->hi[c];
    }
    info->missing = scene->missing;
    info->n_missing = scene->n_missing;
    info->memory_bytes = scene->arena.total + imp__intersector_bytes(scene) +
                         scene->cap_params * sizeof *scene->params;
    IMP_GIVE(scene->ctx, out, all, "info");
    return IMP_OK;
}

enum imp_status imp_scene_get_sensor(const imp_scene *scene, int sensor,
                                     struct imp_sensor_info *info)
{
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, info, "info");
    if (sensor < 0 || sensor >= scene->n_sensors)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "there is no sensor %d; the scene has %d", sensor,
                          scene->n_sensors);
    const struct imp_sensor *s = scene->sensors[sensor];
    const struct imp_sensor_info all = {.size = sizeof all,
                                        .name = s->name,
                                        .type = s->ops->name,
                                        .width = s->film.crop_w,
                                        .height = s->film.crop_h,
                                        .spp = s->spp,
                                        .filter = s->film.filter.ops->name,
                                        .filter_radius = s->film.filter.radius,
                                        .file_format = s->film.file_format,
                                        .unit = s->shape
                                                    ? s->photometric ? "lx" : "W m^-2"
                                                : s->photometric ? "cd m^-2"
                                                                 : "W m^-2 sr^-1",
                                        .n_responses = s->film.n_responses,
                                        .photograph = s->gain && s->gain->fitted_gamma,
                                        .response_names = s->film.response_name};
    IMP_GIVE(scene->ctx, info, all, "info");
    return IMP_OK;
}
