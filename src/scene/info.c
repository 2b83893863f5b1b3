/* SPDX-License-Identifier: Apache-2.0
 *
 * What a scene holds, for people and host programs. */
#include "base/arguments.h"
#include "camera_gain.h"
#include "instances.h"

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
    imp__instances_count(scene, info);
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
