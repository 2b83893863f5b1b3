/* SPDX-License-Identifier: Apache-2.0
 *
 * <medium type="graded">: the index field from <volume>s, the options of tracing, bounds
 * and held numbers of a fit. */
#include "bend_load.h"
#include "color/color_tables.h"
#include "format/search.h"
#include <string.h>

/* A glass with the name that materials use. */
static enum imp_status glass_read(struct imp__bendfile *l, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    struct imp_dispersion *d = &l->dispersion;
    const char *name;
    IMP_TRY(imp__props_string(l->ctx, node, "glass", "", &name));
    const struct imp_prop *at = imp__node_prop(node, "glass");
    const struct imp__glass *g = imp__glass_find(name);
    if (!g)
        IMP_TRY(imp__prop_error(l->ctx, node, at, IMP_E_SCENE,
                                "there is no glass '%s'; there are N-BK7, N-SF6, N-SF10, "
                                "N-SF11, fused silica and others (the manual lists them)",
                                name));
    if (g->n > 3)
        IMP_TRY(imp__prop_error(l->ctx, node, at, IMP_E_UNSUPPORTED,
                                "'%s' has a formula of %d terms; here it has up to three",
                                name, g->n));
    d->model = IMP_SELLMEIER;
    for (int k = 0; k < g->n; k++) {
        d->coefficient[k] = g->number[k];
        d->coefficient[3 + k] = g->number[g->n + k];
    }
out:
    return st;
}

/* cauchy = "A B C", or sellmeier_b and sellmeier_c, in powers of micrometres, or a glass by
 * name. */
static enum imp_status dispersion_read(struct imp__bendfile *l, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    struct imp_dispersion *d = &l->dispersion;
    const double zero[3] = {0};
    const bool cauchy = imp__props_has(node, "cauchy"),
               sellmeier = imp__props_has(node, "sellmeier_b"),
               glass = imp__props_has(node, "glass");
    *d = (struct imp_dispersion)IMP_DISPERSION_INIT;
    IMP_TRY(imp__bendfile_number(l, node, "reference", d->reference, 0.01, 1000,
                                 &d->reference));
    if (cauchy + sellmeier + glass > 1)
        IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE,
                                "has more than one of 'cauchy', 'sellmeier_b' and "
                                "'glass'"));
    IMP_TRY(imp__props_vector(l->ctx, node, "cauchy", zero, d->coefficient));
    if (sellmeier) {
        d->model = IMP_SELLMEIER;
        IMP_TRY(imp__props_vector(l->ctx, node, "sellmeier_b", zero, d->coefficient));
        IMP_TRY(imp__props_vector(l->ctx, node, "sellmeier_c", zero, d->coefficient + 3));
    }
    if (glass) IMP_TRY(glass_read(l, node));
    l->dispersive = cauchy || sellmeier || glass;
out:
    return st;
}

enum imp_status imp__bendfile_medium(struct imp__bendfile *l, struct imp_node *node)
{
    static const char *const schemes[] = {"leapfrog", "euler", "verlet",
                                          "yoshida4", "arc",   "arc-index"};
    static const char *const ways[] = {"reverse", "stored", "pseudo"};
    enum imp_status st = IMP_OK;
    imp_field *parts[64], *field = NULL;
    size_t n = 0;
    int scheme, way;
    int64_t max_steps;
    bool outside;
    double cells, most;
    struct imp_bend_options *o = &l->options;
    *o = (struct imp_bend_options)IMP_BEND_OPTIONS_INIT;
    if (strcmp(node->type, "graded") != 0)
        IMP_TRY(
            imp__node_error(l->ctx, node, IMP_E_UNSUPPORTED, "is not of type 'graded'"));
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, "volume") != 0) continue;
        c->used = true;
        if (c->name && strcmp(c->name, "truth") == 0) {
            IMP_TRY(imp__bendfile_volume(l, c->node, &l->truth));
            continue;
        }
        if (n == imp_count(parts))
            IMP_TRY(
                imp__node_error(l->ctx, node, IMP_E_SCENE, "has more than 64 volumes"));
        IMP_TRY(imp__bendfile_volume(l, c->node, &parts[n]));
        n++;
    }
    if (n == 0) IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE, "has no <volume>"));
    if (n == 1) {
        field = parts[0];
    } else {
        const size_t taken = n;
        n = 0; /* taken over, also on failure */
        IMP_TRY(imp_field_sum_create(l->ctx, taken, parts, &field));
    }
    n = 0;
    imp_field *given = field;
    field = NULL;
    IMP_TRY(imp_bend_create(l->ctx, given, &l->bend));
    IMP_TRY(imp__props_choice(l->ctx, node, "scheme", schemes, 6, 0, &scheme));
    IMP_TRY(imp__props_choice(l->ctx, node, "way", ways, 3, 0, &way));
    o->scheme = (enum imp_bend_scheme)scheme;
    o->way = (enum imp_bend_way)way;
    IMP_TRY(imp__bendfile_number(l, node, "step", 0, 0, 1e300, &o->step));
    IMP_TRY(imp__bendfile_number(l, node, "step_cells", l->bend->step_cells, 1e-6, 1e3,
                                 &cells));
    IMP_TRY(imp__bendfile_number(l, node, "step_max", 0, 0, 1e300, &most));
    imp_bend_set_step(l->bend, cells, most);
    IMP_TRY(imp__props_int(l->ctx, node, "max_steps", 0, 0, 4000000000, &max_steps));
    o->max_steps = (uint32_t)max_steps;
    IMP_TRY(imp__props_bool(l->ctx, node, "outside", false, &outside));
    o->outside = outside;
    IMP_TRY(
        imp__bendfile_number(l, node, "outside_index", 1, 1e-6, 1e6, &o->outside_index));
    IMP_TRY(imp__bendfile_number(l, node, "grazing", 0, -1, 1, &o->grazing));
    IMP_TRY(dispersion_read(l, node));
out:
    for (size_t i = 0; i < n; i++) imp_field_destroy(parts[i]);
    imp_field_destroy(field);
    return st;
}

enum imp_status imp__bendfile_rules(struct imp__bendfile *l, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    double value, weight, edge, lo, hi, radius;
    const double zero[3] = {0};
    double centre[3];
    int64_t layers, order;
    IMP_TRY(imp__bendfile_number(l, node, "index_min", 1, -1e300, 1e300, &lo));
    IMP_TRY(imp__bendfile_number(l, node, "index_max", 1e300, -1e300, 1e300, &hi));
    if (imp__props_has(node, "index_min") || imp__props_has(node, "index_max"))
        IMP_TRY(imp__bendfile_placed(l, node, imp_bend_set_bounds(l->bend, lo, hi)));
    IMP_TRY(imp__bendfile_number(l, node, "hold_value", 0, 0, 1e6, &value));
    if (!imp__props_has(node, "hold_value")) value = NAN; /* held where they are */
    IMP_TRY(imp__props_int(l->ctx, node, "hold_rim", 0, 0, 1000, &layers));
    IMP_TRY(imp__bendfile_number(l, node, "hold_outside", 0, 0, 1e300, &radius));
    IMP_TRY(imp__props_vector(l->ctx, node, "hold_centre", zero, centre));
    if (layers > 0)
        IMP_TRY(imp__bendfile_placed(l, node,
                                     imp_bend_hold_rim(l->bend, (int)layers, value)));
    if (radius > 0)
        IMP_TRY(imp__bendfile_placed(
            l, node, imp_bend_hold_outside(l->bend, centre, radius, value)));
    IMP_TRY(imp__bendfile_number(l, node, "smoothness", 0, 0, 1e300, &weight));
    IMP_TRY(imp__bendfile_number(l, node, "smoothness_edge", 0, 0, 1e300, &edge));
    IMP_TRY(imp__props_int(l->ctx, node, "smoothness_order", 2, 1, 2, &order));
    if (weight > 0) IMP_TRY(imp_bend_add_smoothness(l->bend, weight, (int)order, edge));
    /* Names of profile coefficients that a fit holds: "n0 x y z". */
    const char *hold;
    IMP_TRY(imp__props_string(l->ctx, node, "hold", "", &hold));
    for (const char *s = hold; *s;) {
        s += strspn(s, " ,");
        const size_t len = strcspn(s, " ,");
        if (len == 0) break;
        bool met = false;
        for (size_t i = 0; i < l->bend->field->n_theta; i++) {
            const char *name = imp_field_param_name(l->bend->field, i);
            if (!name || strlen(name) != len || memcmp(name, s, len) != 0) continue;
            met = true;
            IMP_TRY(imp_bend_hold_number(l->bend, i, NAN));
        }
        if (!met)
            IMP_TRY(
                imp__prop_error(l->ctx, node, imp__node_prop(node, "hold"), IMP_E_SCENE,
                                "no number of the field is called '%.*s'", (int)len, s));
        s += len;
    }
out:
    return st;
}
