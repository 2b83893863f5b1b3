/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers that were computed, not read, are rounded to floats before they are hashed:
 * another mathematical library may differ in their last bits. */
#include "fingerprint.h"
#include "instances.h"
#include "kind/bsdf/measured.h"
#include "kind/cleared.h"
#include "kind/shape/shape.h"
#include "math/course.h"
#include "math/hash.h"
#include <string.h>

#define HASH(h, x) imp__hash(h, &(x), sizeof(x))

static const int version = 2; /* raised with what is hashed */

static uint64_t number_hash(uint64_t h, double x)
{
    const float rounded = isnan(x) || x == 0 ? 0 : (float)x; /* NaN and 0 have signs */
    return HASH(h, rounded);
}
static uint64_t vector_hash(uint64_t h, imp_v3 v)
{
    for (int k = 0; k < 3; k++) h = number_hash(h, v[k]);
    return h;
}

/* ---- Nodes ----------------------------------------------------------------------- */

static uint64_t prop_hash(uint64_t h, const struct imp_prop *p)
{
    h = imp__hash_text(h, p->name);
    if (p->theta || strcmp(p->name, "filename") == 0) return h; /* contents count */
    h = HASH(h, p->type);
    h = HASH(h, p->integer);
    h = HASH(h, p->number);
    h = imp__hash_text(h, p->string);
    return p->list ? imp__hash(h, p->list, 2 * p->n * sizeof *p->list) : h;
}

static uint64_t measured_hash(uint64_t h, const struct imp_measured_data *d)
{
    size_t count[IMP_MEASURED_TABLES];
    if (!imp__measured_counts(d, count)) return h;
    for (int k = 0; k < IMP_MEASURED_TABLES; k++)
        if (count[k]) h = imp__hash_array(h, d->table[k], count[k] * sizeof *d->table[k]);
    return HASH(h, d->jacobian);
}

static uint64_t node_hash(uint64_t h, const struct imp_node *node)
{
    h = imp__hash_text(h, node->tag);
    h = imp__hash_text(h, node->type);
    h = imp__hash_text(h, node->id);
    const bool has[2] = {node->merl != NULL, node->measured != NULL};
    h = HASH(h, has);
    if (node->merl)
        h = imp__hash_array(h, node->merl->rho,
                            3 * (size_t)node->merl->n_half *
                                (size_t)node->merl->n_difference *
                                (size_t)node->merl->n_azimuth * sizeof *node->merl->rho);
    if (node->measured) h = measured_hash(h, node->measured);
    for (size_t i = 0; i < node->n_props; i++) h = prop_hash(h, &node->props[i]);
    for (size_t i = 0; i < node->n_children; i++) {
        const struct imp_child *c = &node->children[i];
        h = imp__hash_text(h, c->name);
        if (c->theta) continue;
        h = c->ref ? imp__hash_text(h, c->ref) : node_hash(h, c->node);
    }
    return HASH(h, node->n_children);
}

/* Cameras, samplers and integrators are no objects. */
static bool is_object(const struct imp_node *node)
{
    static const char *const others[] = {"sensor", "film", "rfilter", "sampler",
                                         "integrator"};
    for (size_t k = 0; k < imp_count(others); k++)
        if (strcmp(node->tag, others[k]) == 0) return false;
    return true;
}

/* ---- What files held ------------------------------------------------------------- */

/* Hash of the parts of a mesh's surface besides its triangles. */
static uint64_t mesh_hash(uint64_t h, const struct imp__mesh *m, size_t n_vertices)
{
    const bool has[3] = {m->reversed, m->normals != NULL, m->uvs != NULL};
    h = HASH(h, has);
    if (m->normals) h = imp__hash_array(h, m->normals, 3 * n_vertices * sizeof(float));
    return m->uvs ? imp__hash_array(h, m->uvs, 2 * n_vertices * sizeof(float)) : h;
}

static uint64_t shape_hash(uint64_t h, const struct imp_shape *s)
{
    const struct imp_triangles *t = &s->triangles;
    h = imp__hash_text(h, s->name);
    h = imp__hash_text(h, s->ops->name);
    h = HASH(h, s->bsdf);
    h = HASH(h, s->emitter);
    h = HASH(h, s->flip_normals);
    h = vector_hash(vector_hash(h, s->lo), s->hi);
    if (s->geometry == IMP_CURVES) {
        const struct imp_curves *c = &s->curves;
        h = HASH(h, c->degree);
        h = imp__hash_array(h, c->points, 4 * c->n_points * sizeof *c->points);
        return imp__hash_array(h, c->first, c->n_segments * sizeof *c->first);
    }
    if (s->geometry != IMP_TRIANGLES) return h;
    h = imp__hash_array(h, t->positions, 3 * t->n_vertices * sizeof *t->positions);
    h = imp__hash_array(h, t->indices, 3 * t->n_triangles * sizeof *t->indices);
    if (s->ops->surface == imp__mesh_surface) return mesh_hash(h, s->self, t->n_vertices);
    for (size_t k = 0; k < t->n_triangles; k++) { /* normals and uv at a point of each */
        const imp_v3 o = {0}, d = {0, 0, 1, 0};
        const struct imp_hit hit = {
            .shape = s->index, .prim = (int)k, .u = 0.2, .v = 0.3};
        struct imp_surface at;
        s->ops->surface(s, &hit, &o, &d, &at);
        h = number_hash(number_hash(vector_hash(h, at.n), at.uv[0]), at.uv[1]);
    }
    return h;
}

static uint64_t group_hash(uint64_t h, const struct imp_group *g)
{
    h = imp__hash_text(h, g->name);
    h = HASH(h, g->first);
    h = HASH(h, g->n_shapes);
    for (int k = 0; k < g->n_instances; k++) {
        const struct imp_instance *p = &g->instance[k];
        const int covered = p->covered ? p->covered->first : -1;
        const bool moves = p->motion != NULL;
        h = HASH(h, moves);
        for (int j = 0; j < 12; j++) h = number_hash(h, p->to_world.m[j]);
        h = HASH(h, p->group->first);
        h = HASH(h, covered);
        if (!moves) continue;
        struct imp_map end, inverse;
        imp__motion_at(p->motion, p->motion->end, &end, &inverse);
        h = number_hash(number_hash(h, p->motion->start), p->motion->end);
        for (int j = 0; j < 12; j++) h = number_hash(h, end.m[j]);
    }
    return h;
}

/* Light of unit inputs, by direction: tables of luminaires. */
static uint64_t emitter_hash(uint64_t h, const struct imp_emitter *e)
{
    imp_spec in[IMP_INPUTS_MAX];
    h = imp__hash_text(h, e->name);
    h = imp__hash_text(h, e->ops->name);
    h = number_hash(h, e->weight);
    for (int j = 0; j < e->n_in; j++)
        in[j] = e->ops->inputs[j].flags & IMP_INPUT_WAVELENGTH
                    ? (imp_spec){550, 450, 600, 650} /* nm */
                    : imp__spec(1);
    for (int k = 0; k < 64; k++) { /* a spiral over the sphere */
        const double z = (k + 0.5) / 32 - 1, r = sqrt(1 - z * z), phi = 2.4 * k;
        const struct imp_emission x = {.uv = {0.5, 0.5},
                                       .dist = 1,
                                       .cos_light = 0.5,
                                       .d = imp__v3(r * cos(phi), r * sin(phi), z)};
        imp_spec le;
        e->ops->eval(e, in, &x, &le);
        h = number_hash(h, le[0]);
    }
    return h;
}

uint64_t imp__fingerprint_objects(const struct imp_scene *scene)
{
    uint64_t h = HASH(0, version);
    h = HASH(h, scene->mode);
    h = HASH(h, scene->linear_colors);
    for (size_t i = 0; i < scene->root->n_children; i++) {
        const struct imp_child *c = &scene->root->children[i];
        if (c->node && is_object(c->node)) h = node_hash(h, c->node);
    }
    for (int s = 0; s < scene->n_all_shapes; s++) h = shape_hash(h, scene->shapes[s]);
    for (int g = 0; g < scene->n_groups; g++) h = group_hash(h, scene->groups[g]);
    h = HASH(h, scene->n_groups);
    if (scene->world) h = group_hash(h, scene->world);
    for (int e = 0; e < scene->n_emitters; e++) h = emitter_hash(h, scene->emitters[e]);
    for (size_t k = 0; k < scene->n_params; k++) {
        const struct imp_param_info *info = &scene->params[k].info;
        h = imp__hash_text(h, info->name);
        h = HASH(h, info->dims);
        h = HASH(h, info->count);
    }
    return h;
}

uint64_t imp__fingerprint_evaluated(const struct imp_scene *scene)
{
    uint64_t h = HASH(0, version);
    h = HASH(h, scene->mode);
    h = HASH(h, scene->linear_colors);
    h = HASH(h, scene->n_environments);
    for (int k = 0; k < scene->n_environments; k++) h = HASH(h, scene->environments[k]);
    h = imp__hash_text(h, scene->integrator ? scene->integrator->ops->name : "");
    for (int s = 0; s < scene->n_all_shapes; s++) {
        const struct imp_shape *shape = scene->shapes[s];
        const int medium[2] = {shape->interior ? shape->interior->index : -1,
                               shape->exterior ? shape->exterior->index : -1};
        h = HASH(h, shape->bsdf);
        h = HASH(h, shape->emitter);
        h = HASH(h, shape->n_attributes);
        h = HASH(h, medium);
    }
    for (int b = 0; b < scene->n_bsdfs; b++) {
        h = imp__hash_text(h, scene->bsdfs[b]->ops->name);
        h = HASH(h, scene->bsdfs[b]->flags);
        h = HASH(h, scene->bsdfs[b]->n_in);
    }
    for (int m = 0; m < scene->n_media; m++) {
        h = imp__hash_text(h, scene->media[m]->name);
        h = HASH(h, scene->media[m]->n_in);
    }
    for (int e = 0; e < scene->n_emitters; e++) h = emitter_hash(h, scene->emitters[e]);
    for (int s = 0; s < scene->n_sensors && scene->wavelengths; s++)
        for (int k = 0; k < IMP_WAVES_DRAWN; k++)
            h = imp__wavelengths_hash(h, &scene->wavelengths[s * IMP_WAVES_DRAWN + k]);
    for (size_t k = 0; k < scene->n_params; k++) {
        const struct imp_param *p = &scene->params[k];
        const bool how[2] = {p->info.flags & IMP_PARAM_DIFFERENTIABLE, p->probed};
        h = imp__hash_text(h, p->info.name);
        h = HASH(h, p->info.dims);
        h = HASH(h, p->info.count);
        h = HASH(h, how);
    }
    return h;
}

/* ---- The rest -------------------------------------------------------------------- */

uint64_t imp__fingerprint_sensor(const struct imp_sensor *sensor)
{
    const struct imp_film_desc *f = &sensor->film;
    const int size[] = {f->width,  f->height, f->crop_x,       f->crop_y,
                        f->crop_w, f->crop_h, f->sample_border};
    const size_t n_course = sensor->course ? sensor->course->n : 0;
    uint64_t h = imp__hash_text(HASH(0, version), sensor->ops->name);
    h = HASH(h, size);
    h = HASH(h, sensor->n_child);
    for (int k = 0; k < sensor->n_child; k++) {
        const uint64_t child = imp__fingerprint_sensor(sensor->child[k]);
        h = HASH(h, child);
    }
    h = number_hash(number_hash(h, sensor->open), sensor->close);
    h = HASH(h, n_course);
    for (size_t k = 0; k < n_course; k++)
        h = number_hash(number_hash(h, sensor->course->time[k]),
                        sensor->course->value[k]);
    h = imp__hash_text(h, f->filter.ops->name);
    h = number_hash(h, f->filter.radius);
    for (int k = 0; k < 4; k++)
        h = number_hash(h, f->filter.ops->eval(&f->filter, k * f->filter.radius / 4));
    for (int k = 0; k < 18; k++) {
        const double px = k % 3 * 0.5 * f->width, py = k / 3 % 3 * 0.5 * f->height;
        const double lens[2] = {k < 9 ? 0.2 : 0.7, 0.4};
        struct imp_sensor_ray ray;
        imp__sensor_ray(sensor, px, py, lens, &ray);
        h = vector_hash(vector_hash(h, ray.o), ray.d);
        h = number_hash(number_hash(h, ray.t_near), ray.t_far);
    }
    return h;
}

static uint64_t values_hash(uint64_t h, const struct imp_param *p)
{
    for (size_t e = 0; e < p->info.count; e++) {
        const double value = imp__param_get(p, e);
        h = HASH(h, value);
    }
    return h;
}

uint64_t imp__fingerprint_rays(const struct imp_scene *scene)
{
    uint64_t h = 0;
    for (size_t k = 0; k < scene->n_params; k++)
        if (!(scene->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE))
            h = values_hash(h, &scene->params[k]);
    for (int m = 0; m < scene->n_bodies; m++)
        for (int k = 0; k < scene->bodies[m]->n_numbers; k++) {
            const int param = scene->bodies[m]->numbers[k].param;
            if (param >= 0) h = values_hash(h, &scene->params[param]);
        }
    return h;
}
