/* SPDX-License-Identifier: Apache-2.0
 *
 * Builds emitters and sensors. Each is built once, where it first appears in document order,
 * however many references it has. */
#include "kind/sensor/sensor_film.h"
#include "kind/sensor/sensor_response.h"
#include "kind/shape/shape.h"
#include "scene_build.h"

/* The medium that a sensor or a light names; NULL: none. */
static struct imp_node *medium_child(struct imp_node *node)
{
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, "medium") != 0) continue;
        c->used = true;
        return c->node;
    }
    return NULL;
}

/* May a light or a sensor be built here? `shape`: whose surface it is given, or NULL. */
static enum imp_status attachment_check(imp_context *ctx, const struct imp_node *node,
                                        bool area, const struct imp_shape *shape)
{
    if (!area && shape)
        return imp__node_error(ctx, node, IMP_E_SCENE, "cannot be attached to a shape");
    if (node->object)
        return imp__node_error(ctx, node, IMP_E_SCENE,
                               "is attached to a second shape; each needs its own");
    return IMP_OK;
}

void imp__emitter_changed(void *payload)
{
    const struct imp_emitter *e = payload;
    e->ops->changed(e);
}

enum imp_status imp__build_emitter(struct imp_scene *scene, struct imp_node *node,
                                   const char *parent, const char *slot,
                                   struct imp_shape *shape)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    const void *found;
    IMP_TRY(imp__kind_find(scene->ctx, IMP_CONCEPT_EMITTER, node, &found));
    const struct imp_emitter_ops *ops = found;
    /* A name may be that of two kinds: a light of its own, and one in a shape. */
    for (size_t k = 0; shape && found; k++) {
        const struct imp_emitter_ops *other = found =
            imp__kind_at(ctx, IMP_CONCEPT_EMITTER, k);
        if (other && strcmp(other->name, node->type) == 0 &&
            other->flags & IMP_EMITTER_AREA)
            ops = other;
    }
    const bool area = ops->flags & IMP_EMITTER_AREA;
    if (area && !shape)
        return IMP_OK; /* declared only; used where a shape refers to it */
    IMP_TRY(attachment_check(ctx, node, area, shape));

    struct imp_emitter *e = imp__arena_array(&scene->arena, 1, sizeof *e);
    void *self = imp__arena_array(&scene->arena, 1, ops->object_size);
    if (!e || !self) IMP_TRY(imp__build_no_memory(scene));
    *e = (struct imp_emitter){.ops = ops,
                              .self = self,
                              .shape = shape,
                              .index = scene->n_emitters,
                              .name = imp__build_object_name(scene, node, parent, slot)};
    if (!e->name) IMP_TRY(imp__build_no_memory(scene));
    node->object = e;
    const struct imp_build b = imp__build_make(scene, node);
    if (ops->prepare) IMP_TRY(ops->prepare(&b));
    int n = 0;
    while (ops->inputs && ops->inputs[n].name) n++;
    const struct imp_input **input =
        imp__arena_array(&scene->arena, (size_t)n + 1, sizeof *input);
    if (!input) IMP_TRY(imp__build_no_memory(scene));
    IMP_TRY(imp__build_inputs(scene, node, e->name, ops->inputs, input, &e->n_in));
    e->input = input;
    e->shaped = imp__build_shaped(scene, e->input, e->n_in);
    IMP_TRY(imp__props_float_in(ctx, node, "sampling_weight", 1, IMP_NOT_NEGATIVE,
                                &e->weight));
    IMP_TRY(imp__build_course(scene, node, &e->course));
    scene->timed_lights |= e->course != NULL;
    medium_child(node); /* walks have the place */
    if (ops->build) IMP_TRY(ops->build(&b, self, e));
    for (int j = 0; j < e->n_in; j++)
        if (e->fixed >> j & 1) imp__build_fix(scene, e->input[j], NULL);
    IMP_TRY(imp__proxies_take(scene, node, e->name));
    IMP_TRY(imp__props_finish(ctx, node));
    if (ops->changed)
        IMP_TRY(imp__build_watch(scene, e->input, e->n_in, imp__emitter_changed, e));
    if (shape) shape->emitter = e->index;
    IMP_TRY(
        imp__build_list_add(scene, (void ***)&scene->emitters, &scene->n_emitters, e));
out:
    return st;
}

/* The child of this tag, or a default one of the given type; type NULL: none. */
static enum imp_status child_or_default(struct imp_scene *scene, struct imp_node *node,
                                        const char *tag, const char *type,
                                        struct imp_node **out)
{
    *out = NULL;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, tag) != 0) continue;
        if (*out)
            return imp__node_error(scene->ctx, node, IMP_E_SCENE, "has two %ss", tag);
        c->used = true;
        *out = c->node;
    }
    if (*out || !type) return IMP_OK;
    *out = imp__node_create(&scene->arena, tag, type, NULL, NULL, node->loc);
    return *out ? IMP_OK : imp__build_no_memory(scene);
}

/* A sensor, with the film `own` where it has a place in another's; it is in no list yet. */
static enum imp_status sensor_make(struct imp_scene *scene, struct imp_node *node,
                                   const char *name, struct imp_shape *shape,
                                   const struct imp_film_desc *own,
                                   struct imp_sensor **out);

/* The sensors of a batch: each has its share of the film's columns, and nothing of its own
 * film and sampler counts, as in Mitsuba. */
static enum imp_status children_make(struct imp_scene *scene, struct imp_node *node,
                                     struct imp_sensor *s)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    int n = 0, k = 0;
    for (size_t i = 0; i < node->n_children; i++)
        n += strcmp(node->children[i].node->tag, "sensor") == 0;
    if (n == 0) IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "has no sensors"));
    if (s->film.width % n != 0)
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                "the width of its film, %d pixels, is no multiple of its "
                                "%d sensors",
                                s->film.width, n));
    const struct imp_sensor **child =
        imp__arena_array(&scene->arena, (size_t)n, sizeof *child);
    if (!child) IMP_TRY(imp__build_no_memory(scene));
    struct imp_film_desc film = s->film;
    film.width /= n;
    film.crop_x = film.crop_y = 0;
    film.crop_w = film.width;
    film.crop_h = film.height;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        struct imp_sensor *made = NULL;
        if (strcmp(c->node->tag, "sensor") != 0) continue;
        char slot[32];
        snprintf(slot, sizeof slot, "sensor%d", k);
        const char *name = imp__build_object_name(scene, c->node, s->name, slot);
        if (!name) IMP_TRY(imp__build_no_memory(scene));
        IMP_TRY(sensor_make(scene, c->node, name, NULL, &film, &made));
        if (!made || made->ops->flags & IMP_SENSOR_GROUP)
            IMP_TRY(imp__node_error(ctx, c->node, IMP_E_UNSUPPORTED,
                                    made ? "is nested in a batch, and is one"
                                         : "is nested in a batch, and is a surface"));
        if (k > 0 && made->medium != s->medium)
            IMP_TRY(imp__node_error(ctx, c->node, IMP_E_UNSUPPORTED,
                                    "is in another medium than the sensors before it"));
        if (made->photometric != s->photometric && made->photometric)
            IMP_TRY(imp__node_error(ctx, c->node, IMP_E_SCENE,
                                    "has units, which are those of its batch"));
        if (made->film.srf)
            IMP_TRY(imp__node_error(ctx, c->node, IMP_E_SCENE,
                                    "has srf, which is that of its batch"));
        if (made->open != 0 || made->close != 0 || made->course)
            IMP_TRY(
                imp__node_error(ctx, c->node, IMP_E_SCENE,
                                "has a shutter or times, which are those of its batch"));
        s->medium = made->medium;
        c->used = true;
        child[k++] = made;
    }
    s->n_child = n;
    s->child = child;
out:
    return st;
}

static enum imp_status sensor_make(struct imp_scene *scene, struct imp_node *node,
                                   const char *name, struct imp_shape *shape,
                                   const struct imp_film_desc *own,
                                   struct imp_sensor **out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    const void *found;
    IMP_TRY(imp__kind_find(scene->ctx, IMP_CONCEPT_SENSOR, node, &found));
    const struct imp_sensor_ops *ops = found;
    const bool area = ops->flags & IMP_SENSOR_AREA;
    if (area && !shape)
        return IMP_OK; /* declared only; used where a shape refers to it */
    /* A sensor that a batch refers to may be one of the scene, too: it is made twice. */
    if (!own) IMP_TRY(attachment_check(ctx, node, area, shape));
    struct imp_sensor *s = imp__arena_array(&scene->arena, 1, sizeof *s);
    void *self = imp__arena_array(&scene->arena, 1, ops->object_size);
    if (!s || !self) IMP_TRY(imp__build_no_memory(scene));
    *s = (struct imp_sensor){.ops = ops,
                             .self = self,
                             .name = name,
                             .shape = shape,
                             .scale = 1,
                             .scene = &scene->ball};
    if (!own) node->object = s;
    if (shape) shape->sensor = s;

    struct imp_node *film, *sampler;
    IMP_TRY(child_or_default(scene, node, "film", "hdrfilm", &film));
    IMP_TRY(child_or_default(scene, node, "sampler", NULL, &sampler));
    const struct imp_build film_build = imp__build_make(scene, film);
    const struct imp_build sampler_build = imp__build_make(scene, sampler);
    const struct imp_build b = imp__build_make(scene, node);
    struct imp_camera_gain *gain = NULL;
    if (own && imp__gain_written(film))
        IMP_TRY(imp__node_error(ctx, film, IMP_E_SCENE,
                                "an exposure, a white balance, vignetting and gamma of "
                                "sensors in a batch are those of its film"));
    if (!own) IMP_TRY(imp__build_gain(scene, film, name, &gain));
    IMP_TRY(imp__film_desc_build(&film_build, &s->film));
    IMP_TRY(imp__gain_fit(scene, film, &s->film, gain));
    s->gain = gain;
    if (own) s->film = *own;
    IMP_TRY(imp__sampler_build(&sampler_build, &s->spp, &s->points));
    static const char *const units[] = {"radiometric", "photometric"};
    int unit;
    IMP_TRY(imp_build_choice(&b, "units", units, 2, 0, &unit));
    s->photometric = unit == 1;
    if (s->photometric && imp__is_spectral(scene->mode))
        IMP_TRY(imp_build_error(&b, "units", IMP_E_UNSUPPORTED,
                                "photometric units are those of rgb and mono modes"));
    IMP_TRY(imp__srf_read(&b, &s->film));
    IMP_TRY(imp__build_shutter(scene, node, s));
    if (ops->flags & IMP_SENSOR_GROUP) IMP_TRY(children_make(scene, node, s));
    IMP_TRY(ops->build(&b, self, s)); /* needs the film's shape */
    struct imp_node *medium = medium_child(node);
    if (medium) IMP_TRY(imp__build_medium(scene, medium, name, "medium", &s->medium));
    else if (shape) s->medium = shape->exterior;
    IMP_TRY(imp__props_finish(ctx, node));
    *out = s;
out:
    return st;
}

enum imp_status imp__build_sensor(struct imp_scene *scene, struct imp_node *node,
                                  const char *name, struct imp_shape *shape)
{
    struct imp_sensor *s = NULL;
    const enum imp_status st = sensor_make(scene, node, name, shape, NULL, &s);
    if (st != IMP_OK || !s) return st;
    return imp__build_list_add(scene, (void ***)&scene->sensors, &scene->n_sensors, s);
}
