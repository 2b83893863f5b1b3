/* SPDX-License-Identifier: Apache-2.0
 *
 * Shared by the files that make objects from nodes: scene_build.c (the scene), build_bsdf.c,
 * build_objects.c (lights, shapes, sensors), build_time.c (courses, shutters),
 * build_inputs.c (their inputs), build_texture.c, build_tools.c (names, lists, watches). */
#ifndef IMP_SCENE_BUILD_H
#define IMP_SCENE_BUILD_H

#include "color/convert.h"
#include "kind/registry.h"
#include "scene.h"
#include <stdio.h>
#include <string.h>

enum imp_status imp__build_no_memory(struct imp_scene *scene);
/* "parent.key"; NULL: no memory. */
char *imp__build_name(struct imp_scene *scene, const char *parent, const char *key);
/* The name of an object: its id, else the slot below the parent. */
const char *imp__build_object_name(struct imp_scene *scene, const struct imp_node *node,
                                   const char *parent, const char *slot);
/* Append to one of the scene's lists; they live in the arena and double. */
enum imp_status imp__build_list_add(struct imp_scene *scene, void ***list, int *n,
                                    void *object);
/* The argument of a kind's build function. */
struct imp_build imp__build_make(struct imp_scene *scene, struct imp_node *node);

/* Read the declared inputs of a node into out [as many as desc has]; *n how many. */
enum imp_status imp__build_inputs(struct imp_scene *scene, struct imp_node *node,
                                  const char *name, const struct imp_input_desc *desc,
                                  const struct imp_input **out, int *n);
/* No gradient with respect to what the input is made of: it would be biased. why: as
 * imp_param_info.why; NULL: no more is known. */
void imp__build_fix(struct imp_scene *scene, const struct imp_input *input,
                    const char *why);
/* Does a scalar input differ between the lanes of walks? */
bool imp__build_shaped(const struct imp_scene *scene,
                       const struct imp_input *const *input, int n);
/* Call `changed` when a value of these inputs is set: a constant's, or a texel. */
enum imp_status imp__build_watch(struct imp_scene *scene,
                                 const struct imp_input *const *input, int n,
                                 void (*changed)(void *payload), void *payload);
/* A spectrum that may be read as a colour, or as one number: what its numbers do to
 * that. */
enum imp_status imp__build_spectrum(struct imp_scene *scene, const struct imp_input *in,
                                    enum imp_role role);
/* asked: the input whose value it is; NULL: it is only declared. */
enum imp_status imp__build_texture(struct imp_scene *scene, struct imp_node *node,
                                   const char *parent, const char *slot,
                                   const struct imp_input_desc *asked,
                                   struct imp_texture **out);

enum imp_status imp__build_bsdf(struct imp_scene *scene, struct imp_node *node,
                                const char *parent, const char *slot,
                                struct imp_bsdf **out);
/* times = "time:factor, ..." of a light or a sensor that varies in time. NULL: it does
 * not. */
enum imp_status imp__build_course(struct imp_scene *scene, struct imp_node *node,
                                  const struct imp_course **out);
/* When the shutter is open, and how the response varies meanwhile. */
enum imp_status imp__build_shutter(struct imp_scene *scene, struct imp_node *node,
                                   struct imp_sensor *s);
/* Exposure, white balance, vignetting and response that a film has; NULL: none. */
enum imp_status imp__build_gain(struct imp_scene *scene, struct imp_node *film,
                                const char *name, struct imp_camera_gain **out);
bool imp__gain_written(const struct imp_node *film);
/* When the film's size is known; gain may be NULL. */
enum imp_status imp__gain_fit(struct imp_scene *scene, struct imp_node *film,
                              const struct imp_film_desc *desc,
                              struct imp_camera_gain *gain);
/* Listeners of these objects' numbers; payload: the object. */
void imp__bsdf_changed(void *payload);
void imp__emitter_changed(void *payload);
/* Bounds of an input for the texels that are its values. */
void imp__build_texels_bound(struct imp_scene *scene, int param,
                             const struct imp_input_desc *d);
/* Attributes (build_attributes.c): the textures in a shape under such names;
 * whether its material has bump maps, which need its surface; and, when all objects are
 * made, the textures that mesh_attributes look up. */
enum imp_status imp__build_shape_attributes(struct imp_scene *scene,
                                            struct imp_node *node, struct imp_shape *s);
enum imp_status imp__build_bumps_survey(struct imp_scene *scene,
                                        const struct imp_node *node, struct imp_shape *s);
enum imp_status imp__build_attributes(struct imp_scene *scene);
/* Has a material (index; below 0: none) bump maps? */
bool imp__is_bumped(const struct imp_scene *scene, int bsdf);
/* A medium that scatters, called `slot` below its parent if it has no id. */
enum imp_status imp__build_medium(struct imp_scene *scene, struct imp_node *node,
                                  const char *parent, const char *slot,
                                  const struct imp_medium **out);
/* When all objects are there: does the integrator scatter light in these media? */
enum imp_status imp__media_check(struct imp_scene *scene);
/* When rays can be traced: is it known where cameras and boundaries are? IMP_E_SCENE for
 * a camera; a boundary without a medium is a warning, and scene->media_open. */
enum imp_status imp__media_survey(struct imp_scene *scene);
/* A material that reflects nothing: emitters' default. */
enum imp_status imp__build_black(struct imp_scene *scene, struct imp_bsdf **out);
/* An area light without a shape is only declared, and nothing is made. */
enum imp_status imp__build_emitter(struct imp_scene *scene, struct imp_node *node,
                                   const char *parent, const char *slot,
                                   struct imp_shape *shape);
/* A shape that is in no list yet: neither its material nor its index are set. */
enum imp_status imp__build_shape_bare(struct imp_scene *scene, struct imp_node *node,
                                      const char *name, struct imp_shape **out);
enum imp_status imp__build_shape(struct imp_scene *scene, struct imp_node *node,
                                 const char *name);
/* shape: the one it is nested in, or NULL. A sensor that needs one is made there alone. */
enum imp_status imp__build_sensor(struct imp_scene *scene, struct imp_node *node,
                                  const char *name, struct imp_shape *shape);

#endif
