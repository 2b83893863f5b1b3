/* SPDX-License-Identifier: Apache-2.0
 *
 * <volume>: index fields of bent rays, and distances. */
#include "bend_load.h"
#include "format/search.h"
#include <string.h>

static enum imp_status grid_read(struct imp__bendfile *l, struct imp_node *node,
                                 struct imp_field_grid *g)
{
    static const char *const interps[] = {"spline", "trilinear"}, *const params[] = {
                                                                      "eta", "eta2"};
    enum imp_status st = IMP_OK;
    int interp, param;
    bool single;
    const double minus[3] = {-1, -1, -1}, one[3] = {1, 1, 1}, sixteen[3] = {16, 16, 16};
    double cells[3];
    *g = (struct imp_field_grid)IMP_FIELD_GRID_INIT;
    IMP_TRY(imp__props_choice(l->ctx, node, "interpolation", interps, 2, 0, &interp));
    IMP_TRY(imp__props_choice(l->ctx, node, "parameter", params, 2, 0, &param));
    IMP_TRY(imp__props_bool(l->ctx, node, "single", false, &single));
    IMP_TRY(
        imp__bendfile_number(l, node, "gladstone_dale", 0, 0, 1e6, &g->gladstone_dale));
    if (g->gladstone_dale > 0 && !imp__props_has(node, "filename"))
        IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE,
                                "has a 'gladstone_dale' and no file of densities"));
    IMP_TRY(imp__props_vector(l->ctx, node, "lo", minus, g->lo));
    IMP_TRY(imp__props_vector(l->ctx, node, "hi", one, g->hi));
    g->interp = (enum imp_field_interp)interp;
    g->param = (enum imp_field_param)param;
    g->single = single;
    struct imp_prop *p = imp__node_prop(node, "cells");
    if (p && p->type == IMP_PROP_VECTOR) {
        IMP_TRY(imp__props_vector(l->ctx, node, "cells", sixteen, cells));
    } else {
        int64_t n;
        IMP_TRY(imp__props_int(l->ctx, node, "cells", 16, 1, 8192, &n));
        cells[0] = cells[1] = cells[2] = (double)n;
    }
    for (int k = 0; k < 3; k++) {
        if (!(cells[k] >= 1 && cells[k] <= 8192))
            IMP_TRY(imp__prop_error(l->ctx, node, p, IMP_E_SCENE, "%g cells: 1 to 8192",
                                    cells[k]));
        g->cells[k] = (int)cells[k];
    }
out:
    return st;
}

enum imp_status imp__bendfile_placed(struct imp__bendfile *l, struct imp_node *node,
                                     enum imp_status st)
{
    if (st == IMP_OK || st == IMP_E_NOMEM) return st;
    char message[900]; /* the message of the failed call */
    strncpy(message, imp_last_error(l->ctx), sizeof message - 1);
    message[sizeof message - 1] = 0;
    return imp__node_error(l->ctx, node, st == IMP_E_IO ? st : IMP_E_SCENE, "%s",
                           message);
}

/* Coefficients of a grid from another field: its values, through a spline's samples. */
static enum imp_status grid_sample(struct imp__bendfile *l, imp_field *grid,
                                   const imp_field *from)
{
    struct imp_field_grid g = {.size = sizeof g};
    enum imp_status st = imp_field_get_grid(grid, &g);
    const size_t m[3] = {(size_t)g.cells[0] + 1, (size_t)g.cells[1] + 1,
                         (size_t)g.cells[2] + 1};
    double *samples = imp__alloc(l->ctx, m[0] * m[1] * m[2], sizeof *samples);
    if (!samples) return imp__error(l->ctx, IMP_E_NOMEM, "no memory for samples");
    size_t at = 0;
    for (size_t k = 0; k < m[2]; k++)
        for (size_t j = 0; j < m[1]; j++)
            for (size_t i = 0; i < m[0]; i++) {
                const double x[3] = {
                    g.lo[0] + (g.hi[0] - g.lo[0]) * (double)i / g.cells[0],
                    g.lo[1] + (g.hi[1] - g.lo[1]) * (double)j / g.cells[1],
                    g.lo[2] + (g.hi[2] - g.lo[2]) * (double)k / g.cells[2]};
                imp_field_eval(from, x, &samples[at++], NULL, NULL);
            }
    if (st == IMP_OK) st = imp_field_set_samples(grid, samples);
    imp__release(l->ctx, samples);
    return st;
}

static struct imp_node *volume_child(struct imp_node *node, const char *name)
{
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, "volume") != 0) continue;
        if (name ? !c->name || strcmp(c->name, name) != 0 : c->name != NULL) continue;
        c->used = true;
        return c->node;
    }
    return NULL;
}

static enum imp_status profile_build(struct imp__bendfile *l, struct imp_node *node,
                                     imp_field **out)
{
    enum imp_status st = IMP_OK;
    double params[16] = {0}, axis[3], centre[3];
    const double z[3] = {0, 0, 1}, zero[3] = {0};
    const size_t n = imp_field_profile_count(node->type);
    if (n == 0)
        IMP_TRY(
            imp__node_error(l->ctx, node, IMP_E_SCENE,
                            "is of no known type: there are grid, radial, rz, constant, "
                            "luneburg, maxwell, rod, rod-vendor, rod-power, sech, plume, "
                            "polynomial, axial, linear"));
    for (size_t i = 0; i < n - 3; i++) {
        const char *name = imp__profile_param(node->type, i);
        const bool optional =
            i > 0 && (name[0] == 'n' || name[0] == 'h'); /* coefficients */
        IMP_TRY(imp__bendfile_number(l, node, name, optional ? 0 : NAN, -1e300, 1e300,
                                     &params[i]));
    }
    IMP_TRY(imp__props_vector(l->ctx, node, "centre", zero, centre));
    IMP_TRY(imp__props_vector(l->ctx, node, "axis", z, axis));
    for (int k = 0; k < 3; k++) params[n - 3 + (size_t)k] = centre[k];
    IMP_TRY(imp__bendfile_placed(
        l, node, imp_field_profile_create(l->ctx, node->type, params, axis, out)));
out:
    return st;
}

static enum imp_status radial_build(struct imp__bendfile *l, struct imp_node *node,
                                    double index, imp_field **out)
{
    enum imp_status st = IMP_OK;
    struct imp_field_radial r = IMP_FIELD_RADIAL_INIT;
    const double z[3] = {0, 0, 1}, zero[3] = {0};
    int64_t cells;
    bool cylinder;
    IMP_TRY(imp__props_bool(l->ctx, node, "cylinder", false, &cylinder));
    IMP_TRY(imp__props_int(l->ctx, node, "cells", 16, 1, 65536, &cells));
    IMP_TRY(imp__bendfile_number(l, node, "radius", 1, 1e-300, 1e300, &r.radius));
    IMP_TRY(imp__props_vector(l->ctx, node, "centre", zero, r.centre));
    IMP_TRY(imp__props_vector(l->ctx, node, "axis", z, r.axis));
    r.cylinder = cylinder;
    r.cells = (int)cells;
    IMP_TRY(
        imp__bendfile_placed(l, node, imp_field_radial_create(l->ctx, &r, index, out)));
out:
    return st;
}

static enum imp_status rz_build(struct imp__bendfile *l, struct imp_node *node,
                                double index, imp_field **out)
{
    enum imp_status st = IMP_OK;
    struct imp_field_rz r = IMP_FIELD_RZ_INIT;
    const double z[3] = {0, 0, 1}, zero[3] = {0};
    int64_t cells_r, cells_z;
    IMP_TRY(imp__props_int(l->ctx, node, "cells_r", 8, 1, 8192, &cells_r));
    IMP_TRY(imp__props_int(l->ctx, node, "cells_z", 16, 1, 8192, &cells_z));
    IMP_TRY(imp__bendfile_number(l, node, "radius", 1, 1e-300, 1e300, &r.radius));
    IMP_TRY(imp__bendfile_number(l, node, "lo", -1, -1e300, 1e300, &r.lo));
    IMP_TRY(imp__bendfile_number(l, node, "hi", 1, -1e300, 1e300, &r.hi));
    IMP_TRY(imp__props_vector(l->ctx, node, "centre", zero, r.centre));
    IMP_TRY(imp__props_vector(l->ctx, node, "axis", z, r.axis));
    r.cells_r = (int)cells_r, r.cells_z = (int)cells_z;
    IMP_TRY(imp__bendfile_placed(l, node, imp_field_rz_create(l->ctx, &r, index, out)));
out:
    return st;
}

/* "mirror-x fourfold-z": words, each an operation and its axis. */
static enum imp_status symmetry_read(struct imp__bendfile *l, struct imp_node *node,
                                     struct imp_field_symmetry *s, bool *any)
{
    static const struct {
        const char *word;
        int fold;
    } words[] = {
        {"mirror-", 0}, {"twofold-", 2}, {"fourfold-", 4}, {"axial-", IMP_FIELD_AXIAL}};
    const char *text;
    enum imp_status st = imp__props_string(l->ctx, node, "symmetry", "", &text);
    *s = (struct imp_field_symmetry)IMP_FIELD_SYMMETRY_INIT;
    *any = false;
    while (st == IMP_OK) {
        text += strspn(text, " ,");
        const size_t length = strcspn(text, " ,");
        if (length == 0) break;
        bool known = false;
        for (size_t i = 0; i < imp_count(words); i++) {
            const size_t n = strlen(words[i].word);
            if (length != n + 1 || memcmp(text, words[i].word, n) != 0 || text[n] < 'x' ||
                text[n] > 'z')
                continue;
            known = i == 0 || s->fold == 0; /* one turn */
            if (i == 0) s->mirror[text[n] - 'x'] = 1;
            else s->fold = words[i].fold, s->axis = text[n] - 'x';
        }
        if (!known)
            st = imp__prop_error(l->ctx, node, imp__node_prop(node, "symmetry"),
                                 IMP_E_SCENE,
                                 "'%.*s': mirrors are mirror-x, -y, -z; besides one of "
                                 "twofold-, fourfold- and axial- with an axis",
                                 (int)imp_min(length, (size_t)40), text);
        *any = true;
        text += length;
    }
    return st;
}

static enum imp_status index_build(struct imp__bendfile *l, struct imp_node *node,
                                   const struct imp_field_grid *g, imp_field **out)
{
    double index;
    enum imp_status st = imp__bendfile_number(l, node, "index", 1, 1e-6, 1e6, &index);
    if (st != IMP_OK) return st;
    if (g)
        return imp__bendfile_placed(l, node,
                                    imp_field_grid_create(l->ctx, g, index, out));
    return strcmp(node->type, "rz") == 0 ? rz_build(l, node, index, out)
                                         : radial_build(l, node, index, out);
}

enum imp_status imp__bendfile_volume(struct imp__bendfile *l, struct imp_node *node,
                                     imp_field **out)
{
    enum imp_status st = IMP_OK;
    imp_field *f = NULL, *start = NULL;
    const char *file;
    struct imp_field_grid g = {.size = sizeof g};
    struct imp_field_symmetry symmetry;
    const bool grid = strcmp(node->type, "grid") == 0;
    bool tied = false;
    if (!grid && strcmp(node->type, "radial") != 0 && strcmp(node->type, "rz") != 0) {
        IMP_TRY(profile_build(l, node, &f));
    } else {
        IMP_TRY(imp__props_string(l->ctx, node, "filename", NULL, &file));
        if (grid) IMP_TRY(grid_read(l, node, &g));
        if (grid) IMP_TRY(symmetry_read(l, node, &symmetry, &tied));
        if (file) {
            const char *path;
            if (imp__props_has(node, "index") || imp__props_has(node, "cells"))
                IMP_TRY(
                    imp__node_error(l->ctx, node, IMP_E_SCENE,
                                    "has a 'filename', which gives the index and its "
                                    "cells, and '%s' as well",
                                    imp__props_has(node, "index") ? "index" : "cells"));
            IMP_TRY(
                imp__bendfile_placed(l, node, imp__search(l->scene, NULL, file, &path)));
            IMP_TRY(imp__bendfile_placed(
                l, node, imp_field_read(l->ctx, path, grid ? &g : NULL, &f)));
            if (imp__field_is_grid(f) != grid ||
                (!grid && strcmp(node->type, imp_field_kind(f)) != 0))
                IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE, "%s holds a %s field",
                                        file, imp_field_kind(f)));
        } else {
            IMP_TRY(index_build(l, node, grid ? &g : NULL, &f));
        }
        struct imp_node *from = grid ? volume_child(node, "start") : NULL;
        if (from && file)
            IMP_TRY(imp__node_error(l->ctx, from, IMP_E_SCENE,
                                    "is a start of a grid that a file gives"));
        if (from) {
            IMP_TRY(imp__bendfile_volume(l, from, &start));
            IMP_TRY(imp__bendfile_placed(l, node, grid_sample(l, f, start)));
        }
        if (tied) {
            imp_field *given = f;
            f = NULL; /* taken over, also on failure */
            IMP_TRY(imp__bendfile_placed(
                l, node, imp_field_tie_create(l->ctx, given, &symmetry, &f)));
        }
    }
    IMP_TRY(imp__props_finish(l->ctx, node));
    *out = f;
    f = NULL;
out:
    imp_field_destroy(f);
    imp_field_destroy(start);
    return st;
}

enum imp_status imp__bendfile_sdf(struct imp__bendfile *l, struct imp_node *parent,
                                  const imp_field **out)
{
    imp_bend *b = l->bend;
    imp_field *f;
    struct imp_node *node = volume_child(parent, NULL);
    if (!node)
        return imp__node_error(l->ctx, parent, IMP_E_SCENE,
                               "needs a <volume> of distances");
    const enum imp_status st = imp__bendfile_volume(l, node, &f);
    if (st != IMP_OK) return st;
    void *grown =
        imp__grow(l->ctx, b->sdfs, &b->cap_sdfs, b->n_sdfs + 1, sizeof *b->sdfs);
    if (!grown) {
        imp_field_destroy(f);
        return imp__error(l->ctx, IMP_E_NOMEM, "no memory for a distance field");
    }
    b->sdfs = grown;
    b->sdfs[b->n_sdfs++] = f;
    *out = f;
    return IMP_OK;
}
