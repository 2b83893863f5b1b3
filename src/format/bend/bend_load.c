/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of bent rays: the scene format's grammar, with <medium type="graded">, <rays>,
 * <surface> and <target> (docs/bend.md). */
#include "bend_load.h"
#include "base/arguments.h"
#include "format/load.h"
#include "format/search.h"
#include "format/xml.h"
#include <string.h>

static const struct imp__bendfile_frame world = {
    {0, 0, 0, 0}, {1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};

enum imp_status imp__bendfile_number(struct imp__bendfile *l, struct imp_node *node,
                                     const char *name, double fallback, double lo,
                                     double hi, double *out)
{
    if (isnan(fallback) && !imp__props_has(node, name))
        return imp__node_error(l->ctx, node, IMP_E_SCENE, "needs the float '%s'", name);
    return imp__props_float_in(l->ctx, node, name, isnan(fallback) ? 0 : fallback,
                               (struct imp_interval){lo, hi, IMP_CLOSED}, out);
}

/* Data of `from_truth` targets: exits of the same rays through the field `truth`, traced
 * with yoshida4 and a quarter of the step. */
static enum imp_status truth_trace(struct imp__bendfile *l, struct imp_bend_exit **out)
{
    struct imp_bend_rays r = IMP_BEND_RAYS_INIT;
    struct imp_bend_options o = l->options;
    IMP_CHECKED(imp_bend_get_rays(l->bend, &r));
    o.surfaces = l->surfaces, o.n_surfaces = l->n_surfaces;
    o.taps = l->taps, o.n_taps = 0;
    o.scheme = IMP_BEND_YOSHIDA4;
    o.way = IMP_BEND_REVERSE;
    if (!(o.step > 0)) {
        struct imp_bend_options own = {.size = sizeof own};
        const enum imp_status st = imp_bend_get_options(l->bend, &own);
        if (st != IMP_OK) return st;
        o.step = own.step / 4;
    }
    struct imp_bend_exit *e = imp__alloc(l->ctx, imp_max(r.n, (size_t)1), sizeof *e);
    if (!e) return imp__error(l->ctx, IMP_E_NOMEM, "no memory for %zu rays", r.n);
    const enum imp_status st =
        imp__bundles_trace(l->bend, l->truth, &o, &r, e, NULL, NULL);
    if (st != IMP_OK) {
        imp__release(l->ctx, e);
        return st;
    }
    *out = e;
    return IMP_OK;
}

static enum imp_status truth_apply(struct imp__bendfile *l)
{
    enum imp_status st = IMP_OK;
    struct imp_bend_exit *e = NULL;
    imp_bend *b = l->bend;
    for (size_t i = 0; i < b->n_targets; i++) {
        struct imp__target_of_rays *t = &b->targets[i];
        if (t->power >= 0) continue; /* marked by bend_target */
        t->power = -t->power;
        if (!e) IMP_TRY(truth_trace(l, &e));
        for (size_t k = t->first; k < t->last; k++) {
            struct imp__arrival a;
            const size_t own = k - t->first;
            if (!imp__arrive(&t->desc, &e[k], &a)) continue;
            const imp_v3 d0 = imp__normalize(imp__v3_load(b->d[k]));
            if (imp__target_numbers(t->desc.type) == 1) {
                t->data[own] = a.path;
                continue;
            }
            const imp_v3 value = t->desc.type == IMP_BEND_POINTS ? a.x
                                 : t->desc.type == IMP_BEND_DIRECTIONS
                                     ? a.d
                                     : a.v - d0 * imp__dot(d0, a.v); /* deflection */
            imp__v3_store(value, t->data + 3 * own);
        }
    }
out:
    imp__release(l->ctx, e);
    return st;
}

static enum imp_status
each(struct imp__bendfile *l, struct imp_node *node, const char *tag,
     enum imp_status (*fn)(struct imp__bendfile *, struct imp_node *))
{
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, tag) != 0) continue;
        c->used = true;
        const enum imp_status st = fn(l, c->node);
        if (st != IMP_OK) return st;
    }
    return IMP_OK;
}

static enum imp_status surface_of_all(struct imp__bendfile *l, struct imp_node *node)
{
    return imp__bendfile_surface(l, node, &world, -1);
}
static enum imp_status target_of_all(struct imp__bendfile *l, struct imp_node *node)
{
    return imp__bendfile_target(l, node, &world, -1);
}

/* An index below its bound (default 1) is often a mistake, for instance in a file's
 * scale, and a fit would begin by moving it. A few coefficients of a spline may be below
 * the bound while its values are not. */
static enum imp_status bounds_look(struct imp__bendfile *l, const struct imp_node *medium)
{
    const size_t n = l->bend->field->n_theta;
    double *theta = imp__alloc(l->ctx, 3 * n + 1, sizeof *theta);
    size_t beyond = 0;
    if (!theta) return imp__error(l->ctx, IMP_E_NOMEM, "no memory for bounds");
    double *lo = theta + n, *hi = lo + n;
    imp_field_get_theta(l->bend->field, theta);
    imp__bend_bounds(l->bend, lo, hi);
    for (size_t i = 0; i < n; i++)
        beyond += theta[i] < lo[i] - 1e-9 || theta[i] > hi[i] + 1e-9;
    if (beyond > n / 20)
        imp__warn(
            l->ctx,
            "%s:%d:%d: medium (graded): %zu of %zu numbers of the index are outside "
            "index_min .. index_max (default 1 .. infinity)",
            medium->loc.file, medium->loc.line, medium->loc.column, beyond, n);
    imp__release(l->ctx, theta);
    return IMP_OK;
}

static enum imp_status build(struct imp__bendfile *l)
{
    enum imp_status st = IMP_OK;
    struct imp_node *root = l->scene->root, *medium = NULL;
    for (size_t i = 0; i < root->n_children; i++) {
        struct imp_child *c = &root->children[i];
        if (strcmp(c->node->tag, "medium") != 0) continue;
        if (medium)
            IMP_TRY(imp__node_error(l->ctx, c->node, IMP_E_SCENE, "is a second medium"));
        medium = c->node;
        c->used = true;
    }
    if (!medium)
        IMP_TRY(imp__node_error(l->ctx, root, IMP_E_SCENE,
                                "has no <medium type=\"graded\">"));
    IMP_TRY(imp__bendfile_medium(l, medium));
    IMP_TRY(each(l, root, "surface", surface_of_all));
    IMP_TRY(each(l, medium, "surface", surface_of_all));
    IMP_TRY(each(l, root, "rays", imp__bendfile_rays));
    if (imp_bend_n_rays(l->bend) == 0)
        IMP_TRY(imp__node_error(l->ctx, root, IMP_E_SCENE, "has no <rays>"));
    l->options.surfaces = l->surfaces, l->options.n_surfaces = l->n_surfaces;
    l->options.taps = l->taps, l->options.n_taps = l->n_taps;
    IMP_TRY(imp_bend_set_options(l->bend, &l->options));
    IMP_TRY(imp__bendfile_rules(l, medium));
    IMP_TRY(each(l, root, "target", target_of_all));
    for (int b = 0; b < imp_bend_n_bundles(l->bend); b++) {
        struct imp_node *rays = l->nodes[b];
        for (size_t i = 0; i < rays->n_children; i++)
            if (strcmp(rays->children[i].node->tag, "target") == 0) {
                rays->children[i].used = true;
                IMP_TRY(
                    imp__bendfile_target(l, rays->children[i].node, &l->frames[b], b));
            }
    }
    IMP_TRY(truth_apply(l));
    for (int b = 0; b < imp_bend_n_bundles(l->bend); b++)
        IMP_TRY(imp__props_finish(l->ctx, l->nodes[b]));
    IMP_TRY(imp__props_finish(l->ctx, medium));
    IMP_TRY(imp__props_finish(l->ctx, root));
    IMP_TRY(bounds_look(l, medium));
out:
    return st;
}

static enum imp_status load(imp_context *ctx, const struct imp__load_file *f,
                            imp_bend **out)
{
    enum imp_status st = IMP_OK;
    const struct imp_load_options *o = &f->options;
    struct imp__bendfile l = {.ctx = ctx};
    IMP_TRY(imp__scene_new(ctx, o->mode, o->upsampling, &l.scene));
    IMP_TRY(imp__search_init(l.scene, o->search, o->n_search, f->folder));
    IMP_TRY(imp__xml_read(l.scene, &f->text, f->name, o));
    IMP_TRY(build(&l));
    *out = l.bend;
    l.bend = NULL;
out:
    imp_bend_destroy(l.bend);
    imp_field_destroy(l.truth);
    imp__release(ctx, l.surfaces);
    imp__release(ctx, l.frames);
    imp__release(ctx, l.nodes);
    imp_scene_destroy(l.scene);
    return st;
}

enum imp_status imp_bend_load(imp_context *ctx, const char *path,
                              const struct imp_load_options *options, imp_bend **out)
{
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, path, "path");
    IMP_REQUIRE(ctx, out, "out");
    IMP_FLOAT_MODE;
    struct imp__load_file f;
    enum imp_status st = imp__load_open(ctx, path, options, &f);
    if (st == IMP_OK) st = load(ctx, &f, out);
    imp__load_close(ctx, &f);
    return st;
}

enum imp_status imp_bend_load_string(imp_context *ctx, const char *xml, size_t length,
                                     const char *name,
                                     const struct imp_load_options *options,
                                     imp_bend **out)
{
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, xml, "xml");
    IMP_REQUIRE(ctx, out, "out");
    IMP_FLOAT_MODE;
    struct imp__load_file f;
    IMP_CHECKED(imp__load_text(ctx, xml, length, name, options, &f));
    return load(ctx, &f, out);
}
