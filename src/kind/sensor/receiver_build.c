/* SPDX-License-Identifier: Apache-2.0
 *
 * Properties of a meter's receiver, and grids of points by the norm.
 *
 * EN 12464-1, 4.4: with d the longer side of the area in metres, or the shorter one if the
 * ratio is 2 or more, points are at most p = 0.2 x 5^(log10 d) apart, p <= 10 m; the number
 * of points along a side is the nearest whole number of side / p. */
#include "base/arguments.h"
#include "kind/filter/filter.h"
#include "kind/shape/shape.h"
#include "math/transform.h"
#include "receiver_outline.h"
#include <string.h>

#define SPACING_MAX 10.0 /* m */

/* ---- Densities as a material -------------------------------------------------------- */

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    (void)in;
    d->wi = imp__receiver_direction(b->self, u + 1);
    return imp__receiver_density(b->self, d->wi) > 0;
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    (void)in;
    *f = imp__spec(imp__receiver_density(b->self, d->wi));
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    (void)in;
    return imp__receiver_density(b->self, d->wi);
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    (void)b, (void)in, (void)d, (void)df;
}
static bool directional_albedo(const struct imp_bsdf *b, const imp_spec *in,
                               const imp_v3 *wo, imp_spec *albedo)
{
    (void)b, (void)in, (void)wo;
    *albedo = imp__spec(1);
    return true;
}
static const struct imp_bsdf_ops receiver_ops = {.size = sizeof(struct imp_bsdf_ops),
                                                 .name = "",
                                                 .sample = sample,
                                                 .eval = eval,
                                                 .pdf = pdf,
                                                 .eval_d = eval_d,
                                                 .directional_albedo =
                                                     directional_albedo};

/* ---- The grid ------------------------------------------------------------------------ */

static imp_v3 place_of(const struct imp_shape *s, double u, double v, imp_v3 *ng)
{
    struct imp_surface at;
    s->ops->sample_area(s, (double[2]){u, v}, &at);
    *ng = at.ng;
    return at.p;
}

/* The film child, if one is written. */
static struct imp_node *film_of(const struct imp_node *node)
{
    for (size_t i = 0; i < node->n_children; i++)
        if (strcmp(node->children[i].node->tag, "film") == 0)
            return node->children[i].node;
    return NULL;
}

static bool written(const struct imp_node *film, const char *name)
{
    return film && imp__node_prop(film, name);
}

/* Points along a side of that length. */
static int points_along(double side, double spacing)
{
    return (int)imp_clamp(floor(side / spacing + 0.5), 1.0, 4096.0);
}

enum imp_status imp__grid_film(const struct imp_build *b, struct imp_sensor *s)
{
    enum imp_status st = IMP_OK;
    struct imp_film_desc *f = &s->film;
    const struct imp_node *film = film_of(b->node);
    if (!written(film, "pixel_format") && f->n_responses == 0)
        f->pixel_format = IMP_PIXEL_LUMINANCE;
    bool filtered = false;
    for (size_t i = 0; film && i < film->n_children; i++)
        filtered |= strcmp(film->children[i].node->tag, "rfilter") == 0;
    if (!filtered) {
        struct imp_node *box =
            imp__node_create(b->arena, "rfilter", "box", NULL, NULL, b->node->loc);
        if (!box)
            IMP_TRY(imp_build_error(b, NULL, IMP_E_NOMEM, "no memory for a filter"));
        IMP_TRY(imp__filter_build(b, box, &f->filter));
    }
    if (f->filter.radius > 0.5)
        IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE,
                                "its film has the filter %s, which mixes neighbouring "
                                "points; a grid has rfilter box",
                                f->filter.ops->name));
out:
    return st;
}

/* What is not written of the film: its size by the spacing, and what every grid has. */
static enum imp_status film_complete(const struct imp_build *b, struct imp_sensor *s,
                                     const double side[2])
{
    enum imp_status st = IMP_OK;
    struct imp_film_desc *f = &s->film;
    const struct imp_node *film = film_of(b->node);
    const double longer = fmax(side[0], side[1]), shorter = fmin(side[0], side[1]);
    double metre, spacing;
    IMP_TRY(
        imp__props_float_in(b->ctx, b->node, "metres_per_unit", 1, IMP_POSITIVE, &metre));
    const double d = (longer >= 2 * shorter ? shorter : longer) * metre;
    const double norm = fmin(0.2 * pow(5, log10(d)), SPACING_MAX) / metre;
    IMP_TRY(
        imp__props_float_in(b->ctx, b->node, "spacing", norm, IMP_POSITIVE, &spacing));
    const bool sized = written(film, "width") || written(film, "height");
    if (sized && (imp_build_has(b, "spacing") || imp_build_has(b, "metres_per_unit")))
        IMP_TRY(imp_build_error(
            b, imp_build_has(b, "spacing") ? "spacing" : "metres_per_unit", IMP_E_SCENE,
            "its film has a width or height, which say how many points "
            "there are: one of the two"));
    if (!sized) {
        f->width = f->crop_w = points_along(side[0], spacing);
        f->height = f->crop_h = points_along(side[1], spacing);
        f->crop_x = f->crop_y = 0;
    }
    IMP_TRY(imp__grid_film(b, s));
out:
    return st;
}

/* ---- Reading ------------------------------------------------------------------------- */

static enum imp_status facing_read(const struct imp_build *b, struct imp_receiver *r)
{
    enum imp_status st = IMP_OK;
    const imp_v3 n = r->frame.n;
    double f[3];
    IMP_TRY(imp_build_vector(b, "facing", (double[3]){n[0], n[1], n[2]}, f));
    imp_v3 facing = imp__to_local(&r->frame, imp__v3(f[0], f[1], f[2]));
    const double whole = imp__length(facing);
    if (r->kind != IMP_PLANAR) facing[2] = 0;
    const double length = imp__length(facing);
    const bool given = imp_build_has(b, "facing");
    if (r->kind == IMP_CYLINDRICAL && given)
        IMP_TRY(imp_build_error(b, "facing", IMP_E_SCENE,
                                "a cylindrical receiver faces all sides alike"));
    if (r->kind == IMP_SEMICYLINDRICAL && !given)
        IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE,
                                "'facing' is missing: where a semicylindrical receiver "
                                "looks, across the normal of its shape"));
    if (r->kind != IMP_CYLINDRICAL && !(length > 1e-6 * whole && isfinite(whole)))
        IMP_TRY(imp_build_error(
            b, "facing", IMP_E_SCENE,
            r->kind == IMP_PLANAR ? "facing is no direction"
                                  : "facing has no part across the normal of its shape"));
    r->facing = r->kind == IMP_CYLINDRICAL ? imp__v3(0, 0, 0) : facing * (1 / length);
    r->turned = r->kind == IMP_PLANAR && r->facing[2] < 1 - 1e-12;
out:
    return st;
}

static enum imp_status margin_read(const struct imp_build *b, const double whole[2],
                                   struct imp_receiver *r, double side[2])
{
    enum imp_status st = IMP_OK;
    double margin;
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "margin", 0, IMP_NOT_NEGATIVE, &margin));
    for (int k = 0; k < 2; k++) {
        side[k] = whole[k] - 2 * margin;
        if (!(side[k] > 0))
            IMP_TRY(imp_build_error(b, "margin", IMP_E_SCENE,
                                    "a margin of %g leaves nothing of a side of %g",
                                    margin, whole[k]));
        r->first[k] = margin / whole[k];
        r->span[k] = side[k] / whole[k];
    }
out:
    return st;
}

/* A rectangle's sides and frame by its corners; the sides of the rectangle around others. */
static enum imp_status plane_read(const struct imp_build *b, struct imp_sensor *s,
                                  struct imp_receiver *r, struct imp__outline *outline,
                                  double whole[2])
{
    const bool square = s->shape->ops->flags & IMP_SHAPE_SQUARE;
    imp_v3 ng;
    const imp_v3 corner = place_of(s->shape, 0, 0, &ng);
    r->frame = imp__frame_from_normal(ng);
    if (!square) {
        IMP_CHECKED(imp__outline_create(b, s->shape, ng, outline));
        for (int k = 0; k < 2; k++) whole[k] = outline->side[k];
        return IMP_OK;
    }
    whole[0] = imp__length(place_of(s->shape, 1, 0, &ng) - corner);
    whole[1] = imp__length(place_of(s->shape, 0, 1, &ng) - corner);
    return IMP_OK;
}

/* The raster's points within the outline become the pixels of a film of one row. */
static enum imp_status points_list(const struct imp_build *b, struct imp_sensor *s,
                                   const struct imp__outline *outline,
                                   struct imp_receiver *r)
{
    struct imp_film_desc *f = &s->film;
    const char *kind = s->shape->ops->name;
    const double margin = r->first[0] * outline->side[0];
    int n;
    if (f->crop_w != f->width || f->crop_h != f->height)
        return imp_build_error(
            b, NULL, IMP_E_SCENE,
            "its film has a crop window; a grid on this shape (%s) has "
            "all points within its outline",
            kind);
    if (r->points) {
        IMP_CHECKED(imp__outline_points(b, s->shape, outline, margin, f->width, f->height,
                                        r, &n));
        f->width = f->crop_w = n;
        f->height = f->crop_h = 1;
        return IMP_OK;
    }
    if (f->width != 1 || f->height != 1)
        return imp_build_error(b, imp_build_has(b, "at") ? "at" : NULL, IMP_E_SCENE,
                               "the outline of its shape (%s) cuts cells, which have no "
                               "equal areas: 'at' is points, or the film has 1 x 1 "
                               "pixels, the mean",
                               kind);
    if (margin > 0)
        return imp_build_error(b, "margin", IMP_E_SCENE,
                               "the mean over its shape (%s) is over all of it: a margin "
                               "goes with points ('at')",
                               kind);
    return IMP_OK;
}

enum imp_status imp__receiver_build(const struct imp_build *b, struct imp_sensor *s)
{
    static const char *const kinds[] = {"planar", "cylindrical", "semicylindrical"};
    static const char *const places[] = {"cells", "points"};
    enum imp_status st = IMP_OK;
    struct imp_receiver r = {.span = {1, 1}};
    struct imp__outline outline = {.edge = NULL};
    double whole[2], side[2];
    int kind, place;
    IMP_TRY(imp_build_choice(b, "receiver", kinds, 3, IMP_PLANAR, &kind));
    IMP_TRY(imp_build_choice(b, "at", places, 2, 0, &place));
    IMP_TRY(imp_build_bool(b, "virtual", false, &r.absent));
    r.kind = (enum imp_receiver_kind)kind;
    r.points = place == 1;
    const bool plain = !r.points && !r.absent;
    if (r.kind != IMP_PLANAR && !r.absent)
        IMP_TRY(
            imp_build_error(b, "receiver", IMP_E_SCENE,
                            "a %s receiver stands free in space: its shape is virtual "
                            "(<boolean name=\"virtual\" value=\"true\"/>)",
                            kinds[kind]));
    if (plain) goto out; /* what is said of grids alone stays unread: an error */
    IMP_TRY(plane_read(b, s, &r, &outline, whole));
    IMP_TRY(facing_read(b, &r));
    if (r.turned && !r.absent)
        IMP_TRY(
            imp_build_error(b, "facing", IMP_E_SCENE,
                            "a receiver that faces otherwise than its shape stands free "
                            "in space: its shape is virtual"));
    IMP_TRY(margin_read(b, whole, &r, side));
    IMP_TRY(film_complete(b, s, side));
    if (outline.edge) IMP_TRY(points_list(b, s, &outline, &r));
    struct imp_receiver *made = imp_build_alloc(b, 1, sizeof *made);
    if (!made) IMP_TRY(imp_build_error(b, NULL, IMP_E_NOMEM, "no memory for a receiver"));
    *made = r;
    made->bsdf = (struct imp_bsdf){
        .ops = &receiver_ops,
        .self = made,
        .flags =
            IMP_BSDF_SMOOTH | (r.kind != IMP_PLANAR || r.turned ? IMP_BSDF_TRANSMIT : 0),
        .index_input = -1,
        .index = -1,
        .name = "sensor"};
    s->receiver = made;
out:
    imp__outline_destroy(b, &outline);
    return st;
}
