/* SPDX-License-Identifier: Apache-2.0
 *
 * Radiance's materials as bsdfs and lights (docs/import.md). They are made when a surface
 * has them: libraries of materials are long. */
#include "base/nearest.h"
#include "rad.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static const struct rule {
    const char *type;
    enum rad_kind kind;
    size_t least, most; /* number of real arguments */
} rules[] = {{"plastic", RAD_PLAIN, 5, 5}, {"metal", RAD_PLAIN, 5, 5},
             {"glass", RAD_PLAIN, 3, 4},   {"mirror", RAD_PLAIN, 3, 3},
             {"light", RAD_LIGHT, 3, 3},   {"glow", RAD_LIGHT, 4, 4},
             {"illum", RAD_LIGHT, 3, 3}};

static const struct rule *rule_of(const char *type)
{
    for (size_t i = 0; i < imp_count(rules); i++)
        if (strcmp(rules[i].type, type) == 0) return &rules[i];
    return NULL;
}

bool imp__rad_is_material(const char *type) { return rule_of(type) != NULL; }

enum imp_status imp__rad_modifier(struct rad_reader *r, const char *name,
                                  struct rad_modifier **out)
{
    if (strcmp(name, "void") == 0) {
        *out = &r->nothing;
        return IMP_OK;
    }
    const struct imp_name *found = imp__names_find(&r->names, NULL, name);
    struct imp_nearest near = imp__nearest(name);
    if (found) {
        *out = found->value;
        return IMP_OK;
    }
    for (size_t i = 0; i < r->names.capacity; i++)
        if (r->names.slots[i].name) imp__nearest_try(&near, r->names.slots[i].name);
    return imp__rad_error(r, "modifier '%.80s' is not defined before it%s%s%s", name,
                          near.best ? "; did you mean '" : "", near.best ? near.best : "",
                          near.best ? "'?" : "");
}

/* A later definition of a name counts from then on, as in Radiance. */
static enum imp_status declare(struct rad_reader *r, struct rad_modifier **out)
{
    struct rad_modifier *m = imp__arena_array(&r->in->scene->files, 1, sizeof *m);
    if (!m) return imp__error(r->ctx, IMP_E_NOMEM, "scene: out of memory");
    enum imp_status st = imp__rad_keep(r, r->p.id, &m->id);
    if (st != IMP_OK) return st;
    m->line = r->p.line;
    struct imp_name *old = imp__names_find(&r->names, NULL, m->id);
    if (old) old->value = m;
    else if (!imp__names_add(&r->names, NULL, m->id, m, imp__rad_loc(r)))
        return imp__error(r->ctx, IMP_E_NOMEM, "scene: out of memory");
    *out = m;
    return IMP_OK;
}

/* What modifies a modifier is a texture, a pattern or nothing; a material does nothing. */
static enum imp_status under(struct rad_reader *r, struct rad_modifier *m)
{
    struct rad_modifier *u;
    const enum imp_status st = imp__rad_modifier(r, r->p.modifier, &u);
    if (st == IMP_OK) m->under = u->kind == RAD_OTHER ? u : NULL;
    return st;
}

static enum imp_status replaced(struct rad_reader *r, const struct rule *rule,
                                const struct rad_modifier *by)
{
    enum imp_status st = IMP_OK;
    struct rad_modifier *m;
    const struct rad_modifier copy = *by; /* declare() may give the name of `by` */
    imp__warn(r->ctx, "%s:%d:1: %s '%s': its alternative, '%s', takes its place",
              r->in->name, r->p.line, rule->type, r->p.id, copy.id);
    IMP_TRY(declare(r, &m));
    const char *id = m->id;
    *m = copy;
    m->id = id;
    m->node_id = NULL;
    m->mesh = NULL;
out:
    return st;
}

enum imp_status imp__rad_material(struct rad_reader *r)
{
    enum imp_status st = IMP_OK;
    struct rad_modifier *m, *other;
    const struct rule *rule = rule_of(r->p.type);
    const size_t n = r->p.n_real;
    const double *v = r->p.real;
    const bool colored = rule->kind == RAD_PLAIN;
    const bool chooses = strcmp(rule->type, "illum") == 0 ||
                         strcmp(rule->type, "mirror") == 0; /* an alternative */
    if (n < rule->least || n > rule->most)
        IMP_TRY(imp__rad_error(r, "needs %zu numbers, and has %zu", rule->least, n));
    for (size_t i = 0; i < 3; i++)
        if (v[i] < 0 || (colored && v[i] > 1))
            IMP_TRY(imp__rad_error(r, "%s %zu is %g, not %s",
                                   colored ? "colour" : "radiance", i + 1, v[i],
                                   colored ? "in [0, 1]" : "positive or 0"));
    if (rule->most == 5 && (v[3] < 0 || v[3] > 1))
        IMP_TRY(imp__rad_error(r, "specularity %g is not in [0, 1]", v[3]));
    if (rule->most == 5 && (v[4] < 0 || v[4] > 1))
        IMP_TRY(imp__rad_error(r, "roughness %g is not in [0, 1]", v[4]));
    if (strcmp(rule->type, "glass") == 0 && n == 4 && !(v[3] > 1 && v[3] <= 10))
        IMP_TRY(imp__rad_error(r, "index %g is not above 1 and at most 10", v[3]));
    if (chooses && r->p.n_strings) {
        IMP_TRY(imp__rad_modifier(r, r->p.string, &other));
        if (other->kind != RAD_VOID) return replaced(r, rule, other);
    }
    if (chooses && r->p.n_strings && colored) return imp__rad_other(r);
    IMP_TRY(declare(r, &m));
    m->kind = rule->kind;
    m->type = rule->type;
    m->value[3] = 1.52; /* of glass, Radiance's index */
    for (size_t i = 0; i < n; i++) m->value[i] = v[i];
    IMP_TRY(under(r, m));
out:
    return st;
}

enum imp_status imp__rad_other(struct rad_reader *r)
{
    enum imp_status st = IMP_OK;
    struct rad_modifier *m;
    IMP_TRY(declare(r, &m));
    m->kind = RAD_OTHER;
    IMP_TRY(imp__rad_keep(r, r->p.type, &m->type));
out:
    return st;
}

/* "modifier alias new old": old under another modifier, or with its own (inherit). */
enum imp_status imp__rad_alias(struct rad_reader *r)
{
    enum imp_status st = IMP_OK;
    struct rad_modifier *m, *old;
    IMP_TRY(imp__rad_modifier(r, r->p.string, &old));
    const struct rad_modifier copy = *old;
    IMP_TRY(declare(r, &m));
    const char *id = m->id;
    const int line = m->line;
    *m = copy;
    m->id = id;
    m->line = line;
    m->node_id = NULL;
    m->mesh = NULL;
    m->reported = false;
    if (strcmp(r->p.modifier, "inherit") != 0) IMP_TRY(under(r, m));
out:
    return st;
}

/* ---- Nodes ----------------------------------------------------------------------- */

static enum imp_status nested(const struct rad_reader *r, struct imp_node *parent,
                              const char *type, const char *id, struct imp_loc loc,
                              struct imp_node **out)
{
    return imp__tree_open(r->in->tree, parent, "bsdf", type, id, NULL, loc, out);
}

static enum imp_status diffuse(const struct rad_reader *r, struct imp_node *parent,
                               const char *id, const double color[3], struct imp_loc loc)
{
    struct imp_node *node;
    const enum imp_status st = nested(r, parent, "diffuse", id, loc, &node);
    return st == IMP_OK ? imp__import_rgb(r->in, node, "reflectance", color, loc) : st;
}

/* A mirror, or Beckmann's facets whose slopes have Ward's density exp(-tan^2/alpha^2). */
static enum imp_status glossy(const struct rad_reader *r, struct imp_node *parent,
                              const char *id, const double color[3], double alpha,
                              struct imp_loc loc)
{
    enum imp_status st = IMP_OK;
    struct imp_node *node;
    IMP_TRY(
        nested(r, parent, alpha > 0 ? "roughconductor" : "conductor", id, loc, &node));
    IMP_TRY(imp__import_rgb(r->in, node, "specular_reflectance", color, loc));
    if (!(alpha > 0)) return IMP_OK;
    IMP_TRY(imp__import_string(r->in, node, "distribution", "beckmann", loc));
    IMP_TRY(imp__import_float(r->in, node, "alpha", alpha, loc));
out:
    return st;
}

/* Both sides: (1 - s) color/pi and s times a highlight, white or of the metal's color. */
static enum imp_status opaque(const struct rad_reader *r, const struct rad_modifier *m,
                              struct imp_loc loc)
{
    static const double white[3] = {1, 1, 1};
    enum imp_status st = IMP_OK;
    struct imp_node *sides, *mix;
    const double *color = m->value, s = m->value[3], alpha = m->value[4];
    const double *tint = strcmp(m->type, "metal") == 0 ? color : white;
    IMP_TRY(nested(r, r->in->parent, "twosided", m->node_id, loc, &sides));
    if (s == 0) return diffuse(r, sides, NULL, color, loc);
    if (s == 1) return glossy(r, sides, NULL, tint, alpha, loc);
    IMP_TRY(nested(r, sides, "blendbsdf", NULL, loc, &mix));
    IMP_TRY(imp__import_float(r->in, mix, "weight", s, loc));
    IMP_TRY(diffuse(r, mix, NULL, color, loc));
    IMP_TRY(glossy(r, mix, NULL, tint, alpha, loc));
out:
    return st;
}

/* A pane with transmissivity t (one crossing) and the reflectance F of a face: at normal
 * incidence T = t (1 - F)^2/(1 - F^2 t^2) and R = F (1 + (1 - 2 F) t^2)/(1 - F^2 t^2), with
 * all reflections between the faces, as in Radiance. Ours has 2 F/(1 + F) and
 * (1 - F)/(1 + F), times two tints. */
static enum imp_status pane(const struct rad_reader *r, const struct rad_modifier *m,
                            struct imp_loc loc)
{
    enum imp_status st = IMP_OK;
    struct imp_node *node;
    double through[3], back[3];
    const double n = m->value[3], F = (n - 1) * (n - 1) / ((n + 1) * (n + 1));
    for (int k = 0; k < 3; k++) {
        const double t = m->value[k], all = 1 - F * F * t * t;
        through[k] = t * (1 - F * F) / all;
        back[k] = (1 + (1 - 2 * F) * t * t) * (1 + F) / (2 * all);
    }
    IMP_TRY(nested(r, r->in->parent, "thindielectric", m->node_id, loc, &node));
    IMP_TRY(imp__import_float(r->in, node, "int_ior", n, loc));
    IMP_TRY(imp__import_float(r->in, node, "ext_ior", 1, loc));
    IMP_TRY(imp__import_rgb(r->in, node, "specular_transmittance", through, loc));
    IMP_TRY(imp__import_rgb(r->in, node, "specular_reflectance", back, loc));
out:
    return st;
}

static enum imp_status bsdf_make(const struct rad_reader *r, struct rad_modifier *m)
{
    const struct imp_loc loc = {r->in->name, m->line, 1};
    m->node_id = imp__import_id(r->in, m->id);
    if (!m->node_id) return imp__error(r->ctx, IMP_E_NOMEM, "scene: out of memory");
    if (strcmp(m->type, "glass") == 0) return pane(r, m, loc);
    if (strcmp(m->type, "mirror") == 0) /* its back is black */
        return glossy(r, r->in->parent, m->node_id, m->value, 0, loc);
    return opaque(r, m, loc);
}

static enum imp_status report(struct rad_reader *r, struct rad_modifier *m,
                              const char *lost)
{
    char what[2 * RAD_WORD_MAX];
    if (m->reported) return IMP_OK;
    m->reported = true;
    snprintf(what, sizeof what, "%.80s '%.80s'", m->type, m->id);
    return imp__unread_add(r->in, &r->unread, m->line, what, lost);
}

static void light_said(struct rad_reader *r, struct rad_modifier *m)
{
    if (m->reported) return;
    m->reported = true;
    if (strcmp(m->type, "glow") == 0)
        imp__warn(r->ctx,
                  "%s:%d:1: glow '%s': an area light for all that it is seen from; its "
                  "radius, %g, is not used",
                  r->in->name, m->line, m->id, m->value[3]);
    if (strcmp(m->type, "illum") == 0)
        imp__warn(r->ctx, "%s:%d:1: illum '%s': an area light, which is seen",
                  r->in->name, m->line, m->id);
}

enum imp_status imp__rad_look(struct rad_reader *r, struct rad_modifier **out,
                              const char **bsdf)
{
    enum imp_status st = IMP_OK;
    struct rad_modifier *m;
    *out = NULL;
    *bsdf = NULL;
    IMP_TRY(imp__rad_modifier(r, r->p.modifier, &m));
    if (m->under)
        IMP_TRY(report(r, m->under, "what it modifies is as if it was not there"));
    if (m->kind == RAD_VOID) return IMP_OK;
    if (m->kind == RAD_OTHER) {
        IMP_TRY(report(r, m, "its surfaces are diffuse grey"));
        if (!r->in->scene->lenient) return IMP_OK; /* an error will follow */
    }
    if (m->kind == RAD_LIGHT) light_said(r, m);
    if (m->kind == RAD_PLAIN && !m->node_id) IMP_TRY(bsdf_make(r, m));
    *out = m;
    *bsdf = m->node_id;
out:
    return st;
}
