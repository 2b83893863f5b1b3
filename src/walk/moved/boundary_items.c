/* SPDX-License-Identifier: Apache-2.0
 *
 * What draws of the boundary choose among (boundary.h): edges, by measures of what they may be, and
 * curved shapes, shading and skies, whose edges are in no list. */
#include "base/arguments.h"
#include "boundary_parts.h"
#include "moved_sky.h"
#include "scene/majorants.h"
#include "walk/media/tracking.h"

extern const struct imp_emitter_ops imp__projector;

/* A tenth of each measure is the length in space. */
#define BY_LENGTH 0.1

/* What an edge may be to the picture: its length as the camera sees it, where it is a silhouette, or
 * else by how much its faces turn. */
static double film_measure(const struct imp__boundary *b, const struct imp__edge *e)
{
    const imp_v3 along = e->b - e->a,
                 r = b->parallel ? b->camera : (e->a + e->b) * 0.5 - b->camera;
    const imp_v3 m = imp__cross(along, r);
    const double d2 =
        b->parallel ? 1 : imp_max(imp__dot(r, r), 1e-12 * imp__sqr(b->size));
    const double jump =
        imp__edge_side(b->edges, e, m) == 0 ? imp__edge_turn(b->edges, e) : 1;
    return imp__length(m) / d2 * jump;
}

/* To lights: of all lines through it, a silhouette to so many; to scattered light, all that jumps is
 * made by the turn. */
static double turn_measure(const struct imp__boundary *b, const struct imp__edge *e)
{
    return imp__length(e->b - e->a) * imp__edge_turn(b->edges, e);
}

/* The picture alone jumps at an edge, and of a camera at rest only at one that moves: a meter or a ray
 * also receives light past edges at rest, and mirrors may move their images. */
static bool film_at_rest(const struct imp__boundary *b)
{
    return !b->tracer->sensor->shape && !b->rays && b->n_planes + b->n_benders == 0 &&
           !imp__moves_shape(b->moves, IMP_MOVE_CAMERA, NULL);
}
static bool shape_moves(const struct imp__boundary *b, int shape, int64_t place)
{
    return imp__moves_shape(b->moves, imp__carrier(b->tracer->scene, shape, place), NULL);
}
static bool edge_moves(const struct imp__boundary *b, const struct imp__edge *e)
{
    for (int k = 0; k < e->n_faces; k++) {
        const struct imp__edge_face *f = &b->edges->face[e->first + (size_t)k];
        if (shape_moves(b, f->shape, f->place)) return true;
    }
    return false;
}

/* Does it matter to a kind of draws that this edge, or this item, is seen? */
static bool edge_counts(const struct imp__boundary *b, const struct imp__edge *e,
                        int kind)
{
    return kind != IMP_BOUNDARY_FILM || !film_at_rest(b) || edge_moves(b, e);
}
static bool item_counts(const struct imp__boundary *b, const struct imp__edge_item *item,
                        int kind)
{
    if (kind != IMP_BOUNDARY_FILM || !film_at_rest(b) || item->kind == IMP_ITEM_SKY)
        return true;
    if (item->kind != IMP_ITEM_ARC) return shape_moves(b, item->shape, item->place);
    const struct imp__edge_face *side = item->arc->side;
    return shape_moves(b, side[0].shape, side[0].place) ||
           shape_moves(b, side[1].shape, side[1].place);
}

static enum imp_status choice_make(struct imp__boundary *b, enum imp__boundary_kind kind)
{
    const struct imp__edges *edges = b->edges;
    double *measure = imp__alloc(edges->ctx, edges->n + 1, sizeof *measure);
    double sum = 0, all = 0;
    size_t n = 0;
    if (!measure) return imp__error(edges->ctx, IMP_E_NOMEM, "no memory for edges");
    for (size_t k = 0; k < edges->n; k++) {
        const struct imp__edge *e = &edges->edge[k];
        measure[k] = 0;
        if (!edge_counts(b, e, kind)) continue;
        sum += measure[k] =
            kind == IMP_BOUNDARY_FILM ? film_measure(b, e) : turn_measure(b, e);
        all += imp__length(e->b - e->a);
        n++;
    }
    for (size_t k = 0; k < edges->n; k++) {
        const struct imp__edge *e = &edges->edge[k];
        if (n > 0 && !edge_counts(b, e, kind)) continue;
        if (n == 0) measure[k] = 1; /* none is chosen (items_make) */
        else
            measure[k] = BY_LENGTH * imp__length(e->b - e->a) / all +
                         (sum > 0 ? (1 - BY_LENGTH) * measure[k] / sum : 0);
    }
    const enum imp_status st =
        imp__edge_choice_begin(edges, &b->tree, measure, 1, &b->choice[kind]);
    imp__release(edges->ctx, measure);
    return st;
}

/* Is it that of the sun's disc? */
static bool is_border(const struct imp__sky_sun *sun, const struct imp_sky_circle *c)
{
    return sun->radius > 0 && c->cosine > 0 && imp__dot(c->axis, sun->towards) > 1 - 1e-9;
}

/* Circles of a camera's pictures of skies, if it or the sky moves; or whatever moves, where curved mirrors or
 * glass show them. */
static void circles_find(struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    const bool camera = imp__moves_shape(b->moves, IMP_MOVE_CAMERA, NULL);
    if (b->tracer->sensor->shape) return; /* what a meter sees is glued to the sky */
    for (int k = 0; k < scene->n_environments; k++) {
        const int sky = scene->environments[k];
        const struct imp_emitter *e = scene->emitters[sky];
        if (!camera && b->n_benders == 0 &&
            !imp__moves_shape(b->moves, IMP_MOVE_EMITTER(sky), NULL))
            continue;
        const bool parts = imp__sky_in_parts(b->moves, sky);
        struct imp__sky_sun sun;
        imp__sky_sun_read(e, &sun);
        struct imp_sky_circle circle[IMP_SKY_CIRCLES];
        const int n = e->ops->jumps(e, circle);
        for (int i = 0; i < n; i++) {
            const bool glued = !parts || is_border(&sun, &circle[i]);
            if (camera || glued || b->n_benders > 0)
                b->item[b->n_items++] = (struct imp__edge_item){.kind = IMP_ITEM_SKY,
                                                                .shape = -1,
                                                                .sky = sky,
                                                                .circle = circle[i],
                                                                .glued = glued};
        }
    }
}

/* Borders of the pictures of projectors. */
static void borders_find(struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    for (int k = 0; k < scene->n_emitters; k++)
        if (scene->emitters[k]->ops == &imp__projector)
            b->item[b->n_items++] =
                (struct imp__edge_item){.kind = IMP_ITEM_BORDER, .shape = -1, .sky = k};
}

static struct imp__edge_item round_item(const struct imp__boundary *b,
                                        const struct imp__body *body)
{
    const struct imp_scene *scene = b->tracer->scene;
    struct imp__edge_item item = {
        .kind = IMP_ITEM_ROUND, .shape = body->shape, .place = body->place};
    const bool disk = imp__moves_disk(scene, body->shape);
    for (int k = 0; k < imp__rims(scene, body->shape); k++) {
        const struct imp__rim_name rim = {body->shape, body->place, k};
        struct imp__rim_name beside;
        if (!imp__rim_beside(b->edges, scene, &rim, &beside)) continue;
        if (disk)
            item.wall = imp__rim(scene, beside.shape, beside.place, beside.k, 0).out;
        else item.closed[k] = true;
    }
    return item;
}

/* Borders of media: they move, or what sees them does. */
static enum imp_status media_find(struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    for (int k = 0; k < imp__shapes_outside(scene) && b->media; k++) {
        const struct imp_shape *s = scene->shapes[k];
        if (!imp__is_border(scene, s)) continue;
        struct imp__edge_item *item = &b->item[b->n_items++];
        *item = (struct imp__edge_item){.kind = IMP_ITEM_MEDIUM, .shape = k};
        if (s->geometry == IMP_TRIANGLES) IMP_CHECKED(imp__edge_item_measure(b, item));
    }
    return IMP_OK;
}

/* What has edges that are in no list: two of a body at most, and arcs. */
static enum imp_status items_find(struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    const size_t most = 2 * b->edges->n_bodies + b->edges->n_arcs +
                        IMP_SKY_CIRCLES * (size_t)scene->n_environments +
                        (size_t)scene->n_emitters + (size_t)scene->n_all_shapes;
    b->item = imp__alloc(scene->ctx, most + 1, sizeof *b->item);
    if (!b->item) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for spheres");
    circles_find(b);
    borders_find(b);
    IMP_CHECKED(media_find(b));
    for (size_t k = 0; k < b->edges->n_arcs; k++)
        b->item[b->n_items++] = (struct imp__edge_item){
            .kind = IMP_ITEM_ARC, .shape = -1, .arc = &b->edges->arc[k]};
    for (size_t k = 0; k < b->edges->n_bodies; k++) {
        const struct imp__body *body = &b->edges->body[k];
        if (imp__moves_curved(scene, body->shape, body->place)) {
            struct imp__edge_item *item = &b->item[b->n_items++];
            *item = round_item(b, body);
            if (scene->shapes[body->shape]->geometry == IMP_CURVES)
                IMP_CHECKED(imp__strand_lengths(b, item));
        }
        if (!imp__moves_smooth(scene, body->shape)) continue;
        for (int i = 0; i < 2; i++) {
            struct imp__edge_item *item = &b->item[b->n_items++];
            *item =
                (struct imp__edge_item){.kind = i ? IMP_ITEM_HORIZON : IMP_ITEM_SHADING,
                                        .shape = body->shape,
                                        .place = body->place};
            IMP_CHECKED(imp__edge_item_measure(b, item));
        }
    }
    return IMP_OK;
}

/* As long as an edge that hides as much, about: its area times the change of extinction, or, where no
 * light comes through, what it is across. What is scattered may change where the extinction does not. */
static double border_length(const struct imp_shape *s, double area)
{
    const struct imp_medium *side[2] = {s->interior, s->exterior};
    imp_spec sigma[2] = {{0}, {0}}, in[IMP_INPUTS_MAX];
    for (int k = 0; k < 2; k++)
        if (side[k] && side[k]->majorants)
            sigma[k] = imp__spec((double)side[k]->majorants->most);
        else if (side[k]) sigma[k] = imp__extinction_at(side[k], (imp_v3){0}, NULL, in);
    double most = 0;
    for (int c = 0; c < 3; c++) {
        const double least = BY_LENGTH * imp_max(sigma[0][c], sigma[1][c]);
        most = imp_max(most, imp_max(fabs(sigma[0][c] - sigma[1][c]), least));
    }
    return imp_min(area * most, 2 * sqrt(area));
}

/* The circumference of a circle that is as large, about: of spheres and disks; of cylinders the length
 * of all edges; half of it of what meshes with vertex normals have, which between lights and vertices is
 * nothing. */
static double item_length(const struct imp__boundary *b,
                          const struct imp__edge_item *item, int kind)
{
    if (item->kind == IMP_ITEM_BORDER) return kind == IMP_BOUNDARY_LIGHT ? b->size : 0;
    if (item->kind == IMP_ITEM_SKY) /* as large as the scene, if anything is there */
        return kind == IMP_BOUNDARY_FILM ||
                       (kind == IMP_BOUNDARY_SCATTER && b->n_benders > 0)
                   ? IMP_PI * (b->size > 0 && b->size < INFINITY ? b->size : 1) *
                         sqrt(1 - imp__sqr(item->circle.cosine))
                   : 0;
    if (item->kind == IMP_ITEM_ARC) /* it is no silhouette */
        return kind == IMP_BOUNDARY_LIGHT ? 0 : imp__arc_length(item->arc);
    const struct imp_shape *s = b->tracer->scene->shapes[item->shape];
    struct imp_round round;
    struct imp__tube tube;
    if (item->kind == IMP_ITEM_MEDIUM)
        return border_length(s, item->until ? item->until[s->triangles.n_triangles]
                                            : s->area);
    if (imp__moves_sphere(b->tracer->scene, item->shape, item->place, &round))
        return IMP_2PI * round.radius;
    if (imp__moves_cylinder(b->tracer->scene, item->shape, item->place, &tube))
        return 2 * IMP_2PI * tube.radius + 2 * tube.length;
    if (item->kind == IMP_ITEM_ROUND && item->until)
        return item->until[s->curves.n_segments];
    if (item->kind == IMP_ITEM_ROUND)
        return IMP_2PI * sqrt(s->area * IMP_INV_PI) *
               imp__place_scale(b->tracer->scene, item->place);
    if (kind == IMP_BOUNDARY_LIGHT) return 0;
    if (kind == IMP_BOUNDARY_FILM && item->n_seen == 0 && b->n_planes == 0) return 0;
    return IMP_PI * sqrt(item->until[s->triangles.n_triangles] * IMP_INV_PI / 4);
}

/* Items by such lengths, edges by theirs. */
static enum imp_status items_make(struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    IMP_CHECKED(items_find(b));
    for (int kind = 0; kind < IMP_BOUNDARY_KINDS; kind++) {
        double *part =
            imp__alloc(scene->ctx, (size_t)b->n_items + 2, sizeof *b->part[kind]);
        if (!part) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for spheres");
        b->part[kind] = part;
        double edges = 0, sum = part[0] = 0;
        for (size_t k = 0; k < b->edges->n; k++)
            if (edge_counts(b, &b->edges->edge[k], kind))
                edges += turn_measure(b, &b->edges->edge[k]);
        for (int k = 0; k < b->n_items; k++) {
            if (item_counts(b, &b->item[k], kind))
                sum += item_length(b, &b->item[k], kind);
            part[k + 1] = sum;
        }
        sum += edges;
        for (int k = 0; k <= b->n_items && sum > 0; k++) part[k] /= sum;
        if (!(edges > 0)) part[b->n_items] = 1;
        part[b->n_items + 1] = 1;
    }
    return IMP_OK;
}

enum imp_status imp__boundary_choices_make(struct imp__boundary *b)
{
    IMP_CHECKED(items_make(b));
    if (b->edges->n == 0) return IMP_OK;
    IMP_CHECKED(imp__edge_tree_build(b->edges, &b->tree));
    for (int k = 0; k < IMP_BOUNDARY_KINDS; k++)
        IMP_CHECKED(choice_make(b, (enum imp__boundary_kind)k));
    return IMP_OK;
}
