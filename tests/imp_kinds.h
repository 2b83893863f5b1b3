/* SPDX-License-Identifier: Apache-2.0
 *
 * Every material, ready to be tested. kinds_visit calls back with one instance of every
 * kind of the registry: in its default configuration, in the configurations listed below,
 * and, for kinds with children, around every other kind. Inputs are drawn from what each
 * kind declares, so a new kind is tested by existing; it adds a line here only for
 * properties that are not inputs.
 */
#ifndef IMP_KINDS_H
#define IMP_KINDS_H

#include "imp_measured.h"
#include "imp_merl.h"
#include "kind/build.h"
#include "math/rng.h"
#include "math/warp.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Properties "name=text": a number, true, false, or a word. */
static const struct {
    const char *kind, *props[6];
} kind_configs[] = {
    {"dielectric", {"int_ior=1.5", "ext_ior=1.0"}},
    {"conductor", {"material=Au"}},
    {"roughconductor", {"distribution=beckmann", "alpha=0.3"}},
    {"roughconductor", {"distribution=ggx", "alpha=0.3", "material=Cu"}},
    {"roughconductor", {"distribution=beckmann", "alpha_u=0.1", "alpha_v=0.4"}},
    {"roughconductor", {"distribution=ggx", "alpha_u=0.4", "alpha_v=0.1"}},
    {"roughconductor",
     {"distribution=beckmann", "alpha_u=0.1", "alpha_v=0.4", "sample_visible=false"}},
    {"roughconductor", {"distribution=ggx", "alpha=0.3", "sample_visible=false"}},
    {"plastic", {"nonlinear=true", "int_ior=1.9"}},
    {"plastic", {"int_ior=1.1", "ext_ior=1.6"}},
    {"roughdielectric", {"distribution=beckmann", "alpha=0.3"}},
    {"roughdielectric", {"distribution=ggx", "alpha=0.4", "int_ior=1.1", "ext_ior=1.6"}},
    {"roughdielectric", {"distribution=ggx", "alpha_u=0.4", "alpha_v=0.1"}},
    {"roughdielectric", {"distribution=beckmann", "alpha=0.2", "sample_visible=false"}},
    {"roughplastic", {"distribution=ggx", "nonlinear=true"}},
    {"roughplastic",
     {"distribution=ggx", "sample_visible=false", "int_ior=1.1", "ext_ior=1.6"}},
    {"principled", {"spec_trans=0.5"}},
    {"principled", {"spec_trans=0.5", "eta=1.5", "metallic=0.2"}},
    {"principled", {"clearcoat=0.5", "eta=0.7"}},
    {"stam_m2", {"variant=reciprocal", "sampling=cosine", "absorb=0.3"}},
    {"stam_m2", {"variant=microfacet", "sampling=phong"}},
    {"stam_m2", {"variant=microfacet", "sampling=mixture"}},
    {"stam_m2", {"variant=paper", "sampling=mixture"}},
    {"stam_m2", {"variant=paper", "sampling=phong"}},
};

struct kind_case {
    char label[128];
    const char *kind;
    const char *const *props; /* of its configuration, NULL-terminated, or NULL */
    struct imp_bsdf bsdf, child[2];
};

struct kind_factory {
    imp_context *ctx;
    struct imp_arena arena;
};

/* A drawn direction with all that the engine asks of it. */
struct kind_draw {
    imp_spec f;
    double pdf, eta;
};
static inline bool kind_draw(const struct imp_bsdf *b, const imp_spec *in,
                             const double u[3], struct imp_dirs *d, struct kind_draw *s)
{
    if (!b->ops->sample(b, in, u, d)) return false;
    s->pdf = b->ops->pdf(b, in, d);
    b->ops->eval(b, in, d, &s->f);
    s->eta = b->ops->index_ratio ? b->ops->index_ratio(b, in, d) : 1;
    return s->pdf > 0;
}

static bool kind_make(struct kind_factory *f, const struct imp_bsdf_ops *ops,
                      const char *const *props, int n_props, const struct imp_bsdf *child,
                      int n_child, struct imp_bsdf *out)
{
    struct imp_node *node =
        imp__node_create(&f->arena, "bsdf", ops->name, NULL, NULL, (struct imp_loc){0});
    for (int i = 0; i < n_props && props[i]; i++) {
        char name[64];
        const char *eq = strchr(props[i], '=');
        snprintf(name, sizeof name, "%.*s", (int)(eq - props[i]), props[i]);
        char *end;
        const double number = strtod(eq + 1, &end);
        const bool truth = strcmp(eq + 1, "true") == 0,
                   lie = strcmp(eq + 1, "false") == 0;
        struct imp_prop *p = imp__node_add(&f->arena, node, name,
                                           !*end          ? IMP_PROP_FLOAT
                                           : truth || lie ? IMP_PROP_BOOL
                                                          : IMP_PROP_STRING,
                                           (struct imp_loc){0});
        p->number[0] = number;
        p->integer = truth;
        p->string = eq + 1;
    }
    if (strcmp(ops->name, "merl") == 0) { /* what its file would hold */
        static float rho[3 * 30 * 10 * 12];
        static const struct imp_merl_data table = {30, 10, 12, rho};
        const struct merl_model model = {
            .alpha = 0.3, .diffuse = 0.2, .albedo = {0.7, 0.5, 0.3}};
        merl_fill(30, 10, 12, &model, rho);
        node->merl = &table;
    }
    if (strcmp(ops->name, "measured") == 0) {
        static struct rgl_tables tables;
        rgl_fill(&(struct rgl_model){{0.3, 0.5}, 2, true, false, true}, &tables);
        node->measured = &tables.data;
    }
    void *self = imp__arena_array(&f->arena, 1, ops->object_size + 1);
    *out = (struct imp_bsdf){.ops = ops,
                             .self = self,
                             .flags = IMP_BSDF_SMOOTH,
                             .index = 0,
                             .name = ops->name};
    while (ops->inputs[out->n_own].name) out->n_own++;
    if (out->n_own > IMP_INPUTS_MAX) return false;
    out->n_in = out->n_own;
    for (int k = 0; k < n_child; k++) out->n_in += child[k].n_in;
    const struct imp_input **input =
        imp__arena_array(&f->arena, (size_t)out->n_in + 1, sizeof *input);
    out->n_in = out->n_own;
    out->input = input;
    for (int j = 0; j < out->n_own; j++) {
        struct imp_input *own = imp__arena_array(&f->arena, 1, sizeof *own);
        own->value = imp__spec(ops->inputs[j].fallback);
        own->param = -1;
        input[j] = own;
    }
    for (int k = 0; k < n_child; k++) {
        out->child[k] = &child[k];
        out->child_in[k] = out->n_in;
        for (int j = 0; j < child[k].n_in; j++) input[out->n_in + j] = child[k].input[j];
        out->n_in += child[k].n_in;
    }
    out->n_child = n_child;
    const struct imp_build b = {.ctx = f->ctx, .node = node, .arena = &f->arena};
    if (ops->prepare && ops->prepare(&b) != IMP_OK) return false;
    return !ops->build || ops->build(&b, self, out) == IMP_OK;
}

/* Description of input j, children's inputs included. */
static inline const struct imp_input_desc *kind_input(const struct imp_bsdf *b, int j)
{
    if (j < b->n_own) return &b->ops->inputs[j];
    for (int k = b->n_child - 1; k >= 0; k--)
        if (j >= b->child_in[k]) return kind_input(b->child[k], j - b->child_in[k]);
    return NULL;
}
/* One number, in all lanes. */
static inline bool kind_is_scalar(const struct imp_input_desc *d)
{
    return !(d->flags & IMP_INPUT_BUMP) &&
           d->flags & (IMP_INPUT_SCALAR | IMP_INPUT_LUMINANCE | IMP_INPUT_COMPONENT);
}
static inline void kind_bounds(const struct imp_input_desc *d, double *lo, double *hi)
{
    *lo = d->lo;
    *hi = d->lo == 0 && d->hi == 0 ? INFINITY : d->hi;
}

/* What the engine calls after inputs have got other values. */
static inline void kind_changed(const struct imp_bsdf *b)
{
    for (int k = 0; k < b->n_child; k++) kind_changed(b->child[k]);
    if (b->ops->changed) b->ops->changed(b);
}

enum kind_set {
    KIND_FALLBACK, /* what the kind declares */
    KIND_RANDOM,   /* near it, another value in every lane */
    KIND_WIDE,     /* far around it */
    KIND_LOWEST    /* every input at its lower bound: zeros */
};
static inline void kind_inputs(const struct imp_bsdf *b, enum kind_set set, uint64_t seed,
                               imp_spec *in)
{
    const struct imp_key key = imp__key(seed, (uint64_t)set, 0);
    if (b->n_in > IMP_INPUTS_MAX) { /* callers have room for as many */
        fprintf(stderr, "%s has %d inputs\n", b->name, b->n_in);
        abort();
    }
    /* Numbers that tables are made for stay for a while: making them takes long. */
    const struct imp_key slow = imp__key(seed / 50, (uint64_t)set, 0);
    for (int j = 0; j < b->n_in; j++) {
        const struct imp_input_desc *d = kind_input(b, j);
        const struct imp_key key_j = d->flags & IMP_INPUT_NUMBER ? slow : key;
        double lo, hi;
        kind_bounds(d, &lo, &hi);
        in[j] = imp__spec(0);
        for (int c = 0; c < 3; c++) {
            /* A normal, and its components, which are drawn as those of the normal are. */
            int k = 0, at = 0; /* `at`: index without components */
            while (kind_input(b, j - k)->flags & IMP_INPUT_COMPONENT) k++;
            for (int i = 0; i < j - k; i++)
                at += !(kind_input(b, i)->flags & IMP_INPUT_COMPONENT);
            const unsigned vector = kind_input(b, j - k)->flags;
            const int lane = k ? k - 1 : kind_is_scalar(d) ? 0 : c;
            const double u = imp__u01(key_j, (uint32_t)(4 * at + lane));
            double v = d->fallback;
            /* What has no gradient does not take the others' away. */
            const bool fixed = d->flags & IMP_INPUT_FIXED && d->role == IMP_REFLECTANCE;
            if (set == KIND_LOWEST && !fixed) v = lo;
            else if (set == KIND_FALLBACK) v = d->fallback;
            else if (isfinite(hi)) v = lo + u * (hi - lo);
            else if (d->fallback > 0)
                v = d->fallback * exp2(set == KIND_WIDE ? 7 * u - 3.5 : 3 * u - 1.5);
            else v = lo + 3 * u;
            /* On the side of the surface. */
            if (vector & (IMP_INPUT_VECTOR | IMP_INPUT_BUMP))
                v = lane == 2 ? 0.75 + 0.25 * u : 0.2 + 0.6 * u;
            in[j][c] = vector & IMP_INPUT_BUMP ? 2 * v - 1 : imp_clamp(v, lo, hi);
        }
        in[j][3] = kind_is_scalar(d) ? in[j][0] : NAN; /* nobody may read it */
        ((struct imp_input *)b->input[j])->value = in[j];
    }
    kind_changed(b);
}

static inline bool kind_has_config(const struct kind_case *c, const char *prop)
{
    for (int i = 0; c->props && i < 6 && c->props[i]; i++)
        if (strcmp(c->props[i], prop) == 0) return true;
    return false;
}

/* Tables that are constant in their cells, or have kinks: value or density is not smooth. */
static inline bool kind_steps(const struct kind_case *c)
{
    return strstr(c->label, "merl") || strstr(c->label, "measured");
}

/* Fibres and tables inside another material: dear to evaluate, and the outer kind is met with all
 * other materials inside. They wait for the long run. */
static inline bool kind_waits(const struct kind_case *c)
{
    return strchr(c->label, '(') && (kind_steps(c) || strstr(c->label, "hair"));
}

static inline int kinds_visit(struct kind_factory *f,
                              void (*visit)(const struct kind_case *c, void *payload),
                              void *payload)
{
    int visited = 0;
    for (int k = 0; imp__bsdf_kinds[k]; k++) {
        const struct imp_bsdf_ops *ops = imp__bsdf_kinds[k];
        struct kind_case c = {.kind = ops->name};
        if (ops->min_children == 0) {
            snprintf(c.label, sizeof c.label, "%s", ops->name);
            if (!kind_make(f, ops, NULL, 0, NULL, 0, &c.bsdf)) {
                fprintf(stderr, "%s\n", imp_last_error(f->ctx));
                return -1;
            }
            visit(&c, payload);
            visited++;
        }
        for (size_t i = 0; i < imp_count(kind_configs); i++) {
            if (strcmp(kind_configs[i].kind, ops->name) != 0) continue;
            c.props = kind_configs[i].props;
            int n = snprintf(c.label, sizeof c.label, "%s", ops->name);
            for (int j = 0; j < 6 && c.props[j]; j++)
                n += snprintf(c.label + n, sizeof c.label - (size_t)n, " %s", c.props[j]);
            if (!kind_make(f, ops, c.props, 6, NULL, 0, &c.bsdf)) {
                fprintf(stderr, "%s\n", imp_last_error(f->ctx));
                return -1;
            }
            visit(&c, payload);
            visited++;
        }
        c.props = NULL;
        for (int i = 0; ops->max_children && imp__bsdf_kinds[i]; i++) {
            const struct imp_bsdf_ops *front = imp__bsdf_kinds[i];
            const char *allow[] = {"allow_transmission=true", NULL};
            const char *clamp[] = {"clamp_invalid_normals=true", NULL};
            if (front->max_children) continue;
            const int n = imp_max(ops->min_children, /* one and two in turn */
                                  imp_min(ops->max_children, 1 + i % 2));
            const struct imp_bsdf_ops *back = imp__bsdf_kinds[0];
            for (int b = 0; imp__bsdf_kinds[b]; b++)
                if (strcmp(imp__bsdf_kinds[b]->name, "diffuse") == 0)
                    back = imp__bsdf_kinds[b];
            if (!kind_make(f, front, NULL, 0, NULL, 0, &c.child[0]) ||
                !kind_make(f, back, NULL, 0, NULL, 0, &c.child[1]))
                return -1;
            const bool transmits = strcmp(ops->name, "twosided") == 0 &&
                                   c.child[0].flags & IMP_BSDF_TRANSMIT;
            snprintf(c.label, sizeof c.label, "%s(%s%s%s)", ops->name, front->name,
                     n > 1 ? ", " : "", n > 1 ? back->name : "");
            if (!kind_make(f, ops, allow, transmits, c.child, n, &c.bsdf)) return -1;
            visit(&c, payload);
            visited++;
            if (!(ops->inputs[0].flags & (IMP_INPUT_VECTOR | IMP_INPUT_BUMP)) ||
                imp__bsdf_without_directions_d(&c.child[0]))
                continue;
            strcat(c.label, " clamped"); /* normals that have a derivative */
            if (!kind_make(f, ops, clamp, 1, c.child, n, &c.bsdf)) return -1;
            visit(&c, payload);
            visited++;
        }
    }
    return visited;
}

static inline bool kinds_open(struct kind_factory *f)
{
    const struct imp_context_options options = {.size = sizeof options, .threads = 1};
    if (imp_context_create(&options, &f->ctx) != IMP_OK) return false;
    imp__arena_init(&f->arena, f->ctx);
    return true;
}
static inline void kinds_close(struct kind_factory *f)
{
    imp__arena_free(&f->arena);
    imp_context_destroy(f->ctx);
}

/* A direction away from the horizon, above it for even i. */
static inline imp_v3 kind_direction(int i, uint64_t seed)
{
    const struct imp_key key = imp__key(seed, 77, (uint64_t)i);
    imp_v3 w;
    uint32_t dim = 0;
    do {
        const double u[2] = {imp__u01(key, dim), imp__u01(key, dim + 1)};
        w = imp__uniform_sphere(u);
        dim += 2;
    } while (fabs(w[2]) < 0.02);
    w[2] = i % 2 ? -fabs(w[2]) : fabs(w[2]);
    return w;
}

#endif
