/* SPDX-License-Identifier: Apache-2.0
 *
 * Checks options and prepares tracing: chooses the step, sorts surfaces by group, splits
 * boxes into faces. */
#include "bend_rays.h"
#include "scene/scene.h"
#include <string.h>

#define MAX_STEPS_DEFAULT 100000
#define GROUPS_MAX        65535
#define SURFACES_MAX      60000

/* The faces of a box, planes that differ from s in normal and offset. */
static enum imp_status box_faces(imp_context *ctx, const struct imp_bend_surface *in,
                                 const struct imp__surface *s, struct imp__surface out[6])
{
    for (int k = 0; k < 3; k++) {
        if (!(in->hi[k] > in->lo[k]))
            return imp__error(ctx, IMP_E_ARG,
                              "surface %d: empty box, %g to %g along axis %d", s->id,
                              in->lo[k], in->hi[k], k);
        for (int side = 0; side < 2; side++) {
            struct imp__surface *face = &out[2 * k + side];
            *face = *s;
            face->n = (imp_v3){0};
            face->n[k] = side ? 1 : -1;
            face->offset = side ? in->hi[k] : -in->lo[k];
        }
    }
    return IMP_OK;
}

/* Unit normal, and the offset with it; that of a disc is its centre's. */
static enum imp_status normal_set(imp_context *ctx, const struct imp_bend_surface *in,
                                  struct imp__surface *s)
{
    const double length = imp__length(s->n);
    if (!(length > 0) || !isfinite(length))
        return imp__error(ctx, IMP_E_ARG, "surface %d: the normal has no direction",
                          s->id);
    s->n *= 1 / length;
    s->offset /= length;
    if (in->type == IMP_BEND_DISC) s->offset = imp__dot(s->n, s->c);
    return IMP_OK;
}

static enum imp_status radius_check(imp_context *ctx, const struct imp_bend_surface *in,
                                    int id)
{
    if (in->radius > 0 && isfinite(in->radius)) return IMP_OK;
    return imp__error(ctx, IMP_E_ARG, "surface %d: radius %g", id, in->radius);
}

/* One surface, or the *n = 6 faces of a box. */
static enum imp_status surface_make(imp_context *ctx, const struct imp_bend_surface *in,
                                    int id, struct imp__surface out[6], int *n)
{
    static const enum imp__surface_kind kinds[] = {
        [IMP_BEND_PLANE] = IMP__PLANE,       [IMP_BEND_SPHERE] = IMP__SPHERE,
        [IMP_BEND_CYLINDER] = IMP__CYLINDER, [IMP_BEND_DISC] = IMP__DISC,
        [IMP_BEND_BOX] = IMP__PLANE,         [IMP_BEND_SDF] = IMP__SDF,
        [IMP_BEND_APPROACH] = IMP__APPROACH, [IMP_BEND_MESH] = IMP__MESH};
    if ((int)in->type < 0 || in->type > IMP_BEND_MESH || (int)in->event < 0 ||
        in->event > IMP_BEND_STOP)
        return imp__error(ctx, IMP_E_ARG, "surface %d: no such type or event", id);
    const struct imp__surface s = {.kind = kinds[in->type],
                                   .event = in->event,
                                   .id = id,
                                   .n = imp__v3_load(in->normal),
                                   .c = imp__v3_load(in->centre),
                                   .offset = in->offset,
                                   .radius = in->radius,
                                   .index = in->index,
                                   .sdf = in->sdf,
                                   .scene = in->scene};
    if (in->event == IMP_BEND_REFRACT && !(in->index > 0 && isfinite(in->index)))
        return imp__error(ctx, IMP_E_ARG, "surface %d: index %g outside is not positive",
                          id, in->index);
    if (!imp__is_finite(s.c) || !isfinite(s.offset))
        return imp__error(ctx, IMP_E_ARG, "surface %d: not finite", id);
    *n = 1;
    out[0] = s;
    switch (in->type) {
    case IMP_BEND_PLANE: return normal_set(ctx, in, &out[0]);
    case IMP_BEND_DISC:
    case IMP_BEND_CYLINDER:
        IMP_CHECKED(normal_set(ctx, in, &out[0]));
        return radius_check(ctx, in, id);
    case IMP_BEND_SPHERE: return radius_check(ctx, in, id);
    case IMP_BEND_BOX: *n = 6; return box_faces(ctx, in, &s, out);
    case IMP_BEND_SDF:
        if (in->sdf) return IMP_OK;
        return imp__error(ctx, IMP_E_ARG, "surface %d: no distance field", id);
    case IMP_BEND_APPROACH:
        if (in->event == IMP_BEND_END) return IMP_OK;
        return imp__error(ctx, IMP_E_ARG, "surface %d: rays end at a closest approach",
                          id);
    case IMP_BEND_MESH:
        if (in->scene && in->scene->n_shapes > 0) return IMP_OK;
        return imp__error(ctx, IMP_E_ARG, "surface %d: no scene with shapes", id);
    }
    return IMP_OK;
}

/* Surfaces of group g and those of all groups, faces of boxes first. */
static void domain_make(const struct imp_bend_options *o, const struct imp__surface *all,
                        const int *first, int g, const struct imp__plan *p,
                        struct imp__domain *d, struct imp__surface *room)
{
    d->surface = room;
    d->n = d->n_general = 0;
    d->lo = p->lo;
    d->hi = p->hi;
    for (int boxes = 1; boxes >= 0; boxes--)
        for (size_t i = 0; i < o->n_surfaces; i++) {
            const struct imp_bend_surface *s = &o->surfaces[i];
            if ((s->group >= 0 && s->group != g) || (s->type == IMP_BEND_BOX) != boxes)
                continue;
            for (int k = first[i]; k < first[i + 1]; k++) d->surface[d->n++] = all[k];
            if (!boxes) d->n_general++;
            for (int k = 0; boxes && k < 3; k++) {
                d->lo[k] = fmax(d->lo[k], s->lo[k]);
                d->hi[k] = fmin(d->hi[k], s->hi[k]);
            }
        }
}

static enum imp_status step_choose(struct imp__plan *p)
{
    const imp_field *f = p->field;
    p->t = p->options.step;
    if (p->t < 0 || !isfinite(p->t))
        return imp__error(p->ctx, IMP_E_ARG, "step %g must be positive", p->t);
    if (p->t > 0) return IMP_OK;
    if (!(f->spacing > 0))
        return imp__error(p->ctx, IMP_E_ARG,
                          "a %s field has no cells to choose a step by: give one",
                          f->ops->name);
    const uint32_t *number;
    const struct imp__grid *g = imp__field_nodes(f, &number);
    const double part = g && g->desc.interp == IMP_FIELD_TRILINEAR ? 0.5 : 1;
    p->t = part * f->spacing;
    if (!p->scheme->arc) p->t /= fmax(imp__field_index_max(f), 1e-3);
    return IMP_OK;
}

static void bounds_choose(struct imp__plan *p, const struct imp_bend_rays *rays)
{
    const imp_field *f = p->field;
    imp_v3 lo = imp__v3(INFINITY, INFINITY, INFINITY), hi = -lo;
    for (size_t i = 0; i < rays->n && i < 4096; i++)
        for (int k = 0; k < 3; k++)
            lo[k] = fmin(lo[k], rays->x[i][k]), hi[k] = fmax(hi[k], rays->x[i][k]);
    p->size = 0;
    for (int k = 0; k < 3; k++) {
        const bool finite = isfinite(f->lo[k]) && isfinite(f->hi[k]);
        const double w = finite ? f->hi[k] - f->lo[k] : hi[k] - lo[k];
        if (isfinite(w)) p->size = fmax(p->size, w);
    }
    if (!(p->size > 0)) p->size = 1;
    /* A ray may be one step outside the field: its exit lies within that step. */
    const double margin = p->t * (p->scheme->arc ? 1 : fmax(imp__field_index_max(f), 1));
    for (int k = 0; k < 3; k++)
        p->lo[k] = f->lo[k] - margin, p->hi[k] = f->hi[k] + margin;
}

enum imp_status imp__bend_options_take(imp_context *ctx, const char *function,
                                       const char *name,
                                       const struct imp_bend_options *in,
                                       struct imp_bend_options *own)
{
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    IMP_CHECKED(imp__options_take(ctx, function, name, in, &o, sizeof o));
    const struct {
        const char *name;
        double value;
    } numbers[] = {{"step", o.step},
                   {"outside_index", o.outside_index},
                   {"grazing", o.grazing},
                   {"reversal", o.reversal}};
    for (size_t i = 0; i < imp_count(numbers); i++)
        if (!isfinite(numbers[i].value))
            return imp__error(ctx, IMP_E_ARG, "%s: %s->%s is %g", function, name,
                              numbers[i].name, numbers[i].value);
    if (o.n_taps > IMP_BEND_TAPS_MAX)
        return imp__error(ctx, IMP_E_ARG, "%zu taps: at most %d", o.n_taps,
                          IMP_BEND_TAPS_MAX);
    if (o.n_surfaces > SURFACES_MAX)
        return imp__error(ctx, IMP_E_ARG, "%zu surfaces: at most %d", o.n_surfaces,
                          SURFACES_MAX);
    if ((o.n_surfaces && !o.surfaces) || (o.n_taps && !o.taps))
        return imp__error(ctx, IMP_E_ARG, "%s: %s->%s is NULL", function, name,
                          o.n_surfaces && !o.surfaces ? "surfaces" : "taps");
    *own = o;
    return IMP_OK;
}

/* Numbers of the options, by default or as given. */
static enum imp_status numbers_set(struct imp__plan *p, const struct imp_bend_rays *rays)
{
    const struct imp_bend_options *o = &p->options;
    if ((int)o->scheme < 0 || o->scheme >= IMP_BEND_N_SCHEMES || (int)o->way < 0 ||
        o->way > IMP_BEND_PSEUDO)
        return imp__error(p->ctx, IMP_E_ARG, "no such scheme or way back");
    p->scheme = &imp__schemes[o->scheme];
    if (rays->n > 0 && (!rays->x || !rays->d))
        return imp__error(p->ctx, IMP_E_ARG, "rays without origins or directions");
    p->max_steps = o->max_steps ? o->max_steps : MAX_STEPS_DEFAULT;
    p->grazing = o->grazing == 0 ? 0.05 : fmax(o->grazing, 0);
    p->outside_index = o->outside_index == 0 ? 1 : o->outside_index;
    p->reversal = o->reversal > 0 ? o->reversal : 1e-10;
    if (!(p->outside_index > 0) || !isfinite(p->outside_index) || !isfinite(p->grazing))
        return imp__error(p->ctx, IMP_E_ARG, "index outside %g", p->outside_index);
    IMP_CHECKED(step_choose(p));
    bounds_choose(p, rays);
    if (p->field->spacing > 0 && p->t > p->size)
        return imp__error(p->ctx, IMP_E_ARG, "step %g is longer than the field, %g", p->t,
                          p->size);
    return IMP_OK;
}

/* Without surfaces rays end at the field's box. */
static enum imp_status box_of_field(const imp_field *field, struct imp_bend_surface *box)
{
    *box = (struct imp_bend_surface)IMP_BEND_SURFACE_INIT;
    box->type = IMP_BEND_BOX;
    for (int k = 0; k < 3; k++) {
        box->lo[k] = field->lo[k], box->hi[k] = field->hi[k];
        if (!isfinite(box->lo[k]) || !isfinite(box->hi[k]))
            return imp__error(field->ctx, IMP_E_ARG,
                              "a %s field has no end: give a surface where rays exit",
                              field->ops->name);
    }
    return IMP_OK;
}

/* Surfaces as given, and as the tracer has them: those of surface i are all[first[i]] to
 * all[first[i + 1] - 1]. */
struct prepared {
    struct imp_bend_surface *surfaces;
    struct imp__surface *all;
    int *first;
    size_t shared, own; /* of all, those of every group, and those of one */
};

static enum imp_status surfaces_prepare(struct imp__plan *p, struct prepared *to)
{
    struct imp_bend_options *o = &p->options;
    imp_context *ctx = p->ctx;
    to->surfaces = imp__alloc(ctx, o->n_surfaces, sizeof *to->surfaces);
    to->all = imp__alloc(ctx, 6 * o->n_surfaces, sizeof *to->all);
    to->first = imp__alloc(ctx, o->n_surfaces + 1, sizeof *to->first);
    if (!to->surfaces || !to->all || !to->first)
        return imp__error(ctx, IMP_E_NOMEM, "no memory for surfaces");
    for (size_t i = 0; i < o->n_surfaces; i++) {
        to->surfaces[i] = (struct imp_bend_surface)IMP_BEND_SURFACE_INIT;
        IMP_CHECKED(imp__element_take(ctx, "bend", "surfaces", o->surfaces, i,
                                      &to->surfaces[i], sizeof *to->surfaces));
    }
    o->surfaces = to->surfaces;
    for (size_t i = 0; i < o->n_surfaces; i++) {
        const int group = to->surfaces[i].group;
        int n = 0;
        IMP_CHECKED(
            surface_make(ctx, &to->surfaces[i], (int)i, to->all + to->first[i], &n));
        to->first[i + 1] = to->first[i] + n;
        if (group > GROUPS_MAX)
            return imp__error(ctx, IMP_E_ARG, "surface %zu: group %d", i, group);
        p->n_groups = imp_max(p->n_groups, group + 1);
        *(group < 0 ? &to->shared : &to->own) += (size_t)n;
    }
    return IMP_OK;
}

/* The surfaces of each group, and of rays without one. */
static enum imp_status domains_make(struct imp__plan *p, const struct prepared *from)
{
    const size_t n_domains = (size_t)p->n_groups + 1;
    p->domain = imp__alloc(p->ctx, n_domains, sizeof *p->domain);
    p->surfaces =
        imp__alloc(p->ctx, from->own + n_domains * from->shared + 1, sizeof *p->surfaces);
    if (!p->domain || !p->surfaces)
        return imp__error(p->ctx, IMP_E_NOMEM, "no memory for surfaces");
    struct imp__surface *room = p->surfaces;
    for (int g = 0; g <= p->n_groups; g++) {
        domain_make(&p->options, from->all, from->first, g < p->n_groups ? g : -2, p,
                    &p->domain[g], room);
        room += p->domain[g].n;
    }
    return IMP_OK;
}

static enum imp_status taps_make(struct imp__plan *p)
{
    const struct imp_bend_options *o = &p->options;
    p->n_taps = (int)o->n_taps;
    for (int i = 0; i < p->n_taps; i++) {
        struct imp_bend_tap tap = IMP_BEND_TAP_INIT;
        IMP_CHECKED(imp__element_take(p->ctx, "bend", "taps", o->taps, (size_t)i, &tap,
                                      sizeof tap));
        struct imp__surface s = {.kind = IMP__PLANE,
                                 .id = i,
                                 .n = imp__v3_load(tap.normal),
                                 .offset = tap.offset};
        const double length = imp__length(s.n);
        if (!(length > 0) || !isfinite(length) || !isfinite(s.offset))
            return imp__error(p->ctx, IMP_E_ARG, "tap %d: the normal has no direction",
                              i);
        s.n *= 1 / length;
        s.offset /= length;
        p->taps[i] = s;
        p->tap_group[i] = tap.group;
    }
    return IMP_OK;
}

enum imp_status imp__plan_create(const imp_field *field,
                                 const struct imp_bend_options *options,
                                 const struct imp_bend_rays *rays, struct imp__plan *out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = field->ctx;
    struct imp__plan p = {.ctx = ctx, .field = field, .options = IMP_BEND_OPTIONS_INIT};
    struct imp_bend_options *o = &p.options;
    struct imp_bend_surface box;
    struct prepared prepared = {0};

    IMP_CHECKED(imp__bend_options_take(ctx, "bend", "options", options, o));
    IMP_TRY(numbers_set(&p, rays));
    if (o->n_surfaces == 0) {
        IMP_TRY(box_of_field(field, &box));
        o->surfaces = &box;
        o->n_surfaces = 1;
    }
    IMP_TRY(surfaces_prepare(&p, &prepared));
    IMP_TRY(domains_make(&p, &prepared));
    IMP_TRY(taps_make(&p));
    o->surfaces = NULL; /* belong to the caller; copies are in p */
    o->taps = NULL;
    *out = p;
out:
    imp__release(ctx, prepared.surfaces);
    imp__release(ctx, prepared.all);
    imp__release(ctx, prepared.first);
    if (st != IMP_OK) imp__plan_destroy(&p);
    return st;
}

void imp__plan_destroy(struct imp__plan *p)
{
    imp__release(p->ctx, p->domain);
    imp__release(p->ctx, p->surfaces);
    p->domain = NULL;
    p->surfaces = NULL;
}
