/* SPDX-License-Identifier: Apache-2.0
 *
 * mesh_attribute: the texture of the hit shape with the name `name`, times `scale`; 0
 * where it has none. A mesh has values of its vertices or triangles (attribute_data.c),
 * any shape the textures in it with such names. When the scene is complete these textures
 * are its inputs (scene/build_attributes.c). */
#include "mesh_attribute.h"
#include "base/required.h"
#include "input.h"
#include "math/vec.h"
#include <math.h>
#include <string.h>

struct mesh_attribute {
    const char *name;
    double scale;
};

static const struct imp_input_desc inputs[] = {{0}};

extern const struct imp_texture_ops imp__mesh_attribute;

static enum imp_status build(const struct imp_build *b, void *self, struct imp_texture *t)
{
    enum imp_status st = IMP_OK;
    struct mesh_attribute *m = self;
    t->param = -1;
    IMP_TRY(imp_build_string(b, "name", NULL, &m->name));
    IMP_TRY(imp_build_float(b, "scale", 1, &m->scale));
    if (!m->name) IMP_TRY(imp__node_missing(b->ctx, b->node, "name"));
    if (!imp__attribute_name(m->name))
        IMP_TRY(imp_build_error(
            b, "name", IMP_E_SCENE,
            "name = '%s': names of attributes begin with vertex_ or face_", m->name));
    if (!isfinite(m->scale))
        IMP_TRY(imp_build_error(b, "scale", IMP_E_SCENE, "'scale' must be finite"));
out:
    return st;
}

bool imp__attribute_name(const char *name)
{
    return strncmp(name, "vertex_", 7) == 0 || strncmp(name, "face_", 5) == 0;
}

bool imp__attribute_asked(const struct imp_texture *t, const char *name)
{
    const struct mesh_attribute *m = t->self;
    return t->ops == &imp__mesh_attribute && strcmp(m->name, name) == 0;
}

double imp__attribute_scale(const struct imp_texture *t)
{
    const struct mesh_attribute *m = t->self;
    return t->ops == &imp__mesh_attribute ? m->scale : 1;
}

/* NULL: the shape has none of this name. */
static const struct imp_texture *found(const struct imp_texture *t,
                                       const struct imp_texcoord *at)
{
    const struct mesh_attribute *m = t->self;
    const int n = at->shape ? at->shape->n_attributes : 0;
    const struct imp_texture *of = NULL;
    for (int k = 0; k < n && !of; k++)
        if (strcmp(at->shape->attribute[k].name, m->name) == 0)
            of = at->shape->attribute[k].texture;
    return of;
}

static void eval(const struct imp_texture *t, const struct imp_texcoord *at, bool scalar,
                 imp_spec *value)
{
    const struct imp_texture *of = found(t, at);
    *value = imp__spec(0);
    if (!of) return;
    of->ops->eval(of, at, scalar, value);
    *value *= imp__attribute_scale(t);
}
static void scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    const struct imp_texture *of = found(t, at);
    const imp_spec scaled = *bar * imp__attribute_scale(t);
    if (of) of->ops->scatter(of, at, scalar, &scaled, sink);
}
static void tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot)
{
    const struct imp_texture *of = found(t, at);
    *value_dot = imp__spec(0);
    if (!of) return;
    of->ops->tangent(of, at, scalar, dot, x_dot, value_dot);
    *value_dot *= imp__attribute_scale(t);
}

const struct imp_texture_ops imp__mesh_attribute = {
    .size = sizeof(struct imp_texture_ops),
    .name = "mesh_attribute",
    .object_size = sizeof(struct mesh_attribute),
    .inputs = inputs,
    .build = build,
    .eval = eval,
    .scatter = scatter,
    .tangent = tangent};
