/* SPDX-License-Identifier: Apache-2.0
 *
 * The luminous opening of a luminaire as a shape. Tables are of the far field: at five times its
 * length an opening lights like a point to 1 % (for Lambert's law the point is 1 + (a^2 + b^2)/(6 d^2)
 * times as bright below its middle, a and b its sides, d the distance), nearer it does not. */
#include "luminaire_openings.h"
#include "math/transform.h"
#include <string.h>

#define THIN 0.01 /* m, of a box whose file gives it no height */

static enum imp_status no_memory(struct imp_scene *scene)
{
    return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for the scene");
}

/* Does any light leave across nadir's plane, at an angle of the table or between two of them? Of type B,
 * whose angles end there, none does. */
static bool shines_behind(const struct imp_ies_data *d)
{
    const double level = d->type == IMP_PHOTOMETRY_C ? 90 : 0;
    if (d->type == IMP_PHOTOMETRY_B) return false;
    const double *v = d->vertical;
    for (int j = 0; j < d->n_horizontal; j++)
        for (int k = 0; k < d->n_vertical; k++) {
            const bool crosses =
                k + 1 < d->n_vertical && v[k] < level && v[k + 1] > level;
            if ((v[k] > level || crosses) && d->candela[j * d->n_vertical + k] > 0)
                return true;
        }
    return false;
}

static bool number_add(struct imp_scene *scene, struct imp_node *node, const char *name,
                       enum imp_prop_type type, const double *number, size_t n)
{
    struct imp_prop *p = imp__node_add(&scene->arena, node, name, type, node->loc);
    if (p) memcpy(p->number, number, n * sizeof *number);
    return p != NULL;
}

/* A shape without children, of the given half sides in the luminaire's own space. A box hangs from the
 * luminaire's place along nadir: half of it would be behind the ceiling else. */
static struct imp_node *shape_of(struct imp_scene *scene, const struct imp_node *lamp,
                                 const double half[3], bool flat)
{
    static const double black[3] = {0, 0, 0};
    const struct imp_prop *place = imp__node_prop(lamp, "to_world");
    double to_world[16];
    char *id = NULL;
    for (int k = 0; k < 16; k++)
        to_world[k] =
            (place ? place->number[k] : k % 5 == 0) * (k % 4 < 3 ? half[k % 4] : 1);
    for (int k = 0; k < 12 && !flat; k += 4) to_world[k + 3] += to_world[k + 2];
    if (lamp->id) {
        id = imp__arena_array(&scene->arena, strlen(lamp->id) + sizeof "_opening", 1);
        if (!id) return NULL;
        strcpy(id, lamp->id);
        strcat(id, "_opening");
    }
    struct imp_node *shape = imp__node_create(&scene->arena, "shape",
                                              flat ? "rectangle" : "cube", id, NULL,
                                              lamp->loc),
                    *bsdf = imp__node_create(&scene->arena, "bsdf", "diffuse", NULL, NULL,
                                             lamp->loc);
    const bool got =
        shape && bsdf &&
        number_add(scene, shape, "to_world", IMP_PROP_TRANSFORM, to_world, 16) &&
        number_add(scene, bsdf, "reflectance", IMP_PROP_RGB, black, 3) &&
        imp__node_add_child(&scene->arena, shape, bsdf, NULL, lamp->loc);
    return got ? shape : NULL;
}

static bool has_id(const struct imp_node *node, const char *id)
{
    bool has = node->id && !strcmp(node->id, id);
    for (size_t i = 0; i < node->n_children && !has; i++)
        has = node->children[i].node && !node->children[i].ref &&
              has_id(node->children[i].node, id);
    return has;
}

/* In place of the luminaire in `at`. */
static enum imp_status opening_make(struct imp_scene *scene, struct imp_child *at)
{
    struct imp_node *lamp = at->node;
    const struct imp_ies_data *d = lamp->ies;
    const struct imp_prop *place = imp__node_prop(lamp, "to_world");
    if (place && place->type != IMP_PROP_TRANSFORM)
        return imp__node_error(scene->ctx, lamp, IMP_E_SCENE, "to_world is no transform");
    if (!d || !(d->size[0] > 0 && d->size[1] > 0))
        return imp__node_error(scene->ctx, lamp, IMP_E_SCENE,
                               "opening: its file names no luminous opening, so put it "
                               "into a shape");
    const bool flat = !(d->size[2] > 0) && !shines_behind(d);
    const double height = d->size[2] > 0 ? d->size[2] : THIN;
    const double half[3] = {d->size[0] / 2, d->size[1] / 2, flat ? 1 : height / 2};
    struct imp_node *shape = shape_of(scene, lamp, half, flat);
    if (shape && shape->id && has_id(scene->root, shape->id))
        return imp__node_error(scene->ctx, lamp, IMP_E_SCENE,
                               "opening: the id of its shape, '%s', is taken", shape->id);
    if (!shape || !imp__node_add_child(&scene->arena, shape, lamp, NULL, lamp->loc))
        return no_memory(scene);
    at->node = shape;
    return IMP_OK;
}

enum imp_status imp__luminaire_openings_make(struct imp_scene *scene)
{
    struct imp_node *root = scene->root;
    for (size_t i = 0; root && i < root->n_children; i++) {
        struct imp_node *lamp = root->children[i].ref ? NULL : root->children[i].node;
        if (!lamp || strcmp(lamp->tag, "emitter") != 0 || strcmp(lamp->type, "ies") != 0)
            continue;
        const struct imp_prop *p = imp__node_prop(lamp, "opening");
        if (!p) continue;
        if (p->type != IMP_PROP_BOOL)
            return imp__node_error(scene->ctx, lamp, IMP_E_SCENE,
                                   "opening is true or false");
        const bool wanted = p->integer;
        imp__node_remove(lamp, "opening");
        if (!wanted) continue;
        const enum imp_status st = opening_make(scene, &root->children[i]);
        if (st != IMP_OK) return st;
    }
    return IMP_OK;
}
