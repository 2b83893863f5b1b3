/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of what light walks bring, and of samples from both ends. Wherever
 * light reaches the film it has an adjoint of its own. A joint of y and z (both.h) brings
 *
 *     A  P_y f_y T m f_z P_z,    A: adjoint,  P: products of the weights up to y and z
 *
 * P_y belongs to the walk from the sensor, whose B of y holds the rest as a factor; P_z to
 * the walk from the light, where A P_y f_y T m f_z enters at z as light that reaches the
 * film. What is left are the derivatives of f_y, f_z and T: the pieces of a joint, which both modes
 * take from one visitor, as those of a vertex. */
#include "both.h"
#include "walk/media/tracking.h"
#include "walk/path/vertex_pieces.h"

struct joints {
    struct imp_both *both;
    imp_spec adjoint; /* A */
    imp_spec *P;      /* [light vertices] P_z */
    struct imp_entry *entry;
};

static imp_spec *products(struct imp_arena *arena, const struct imp_walk *walk)
{
    imp_spec *P = imp__arena_take(arena, (size_t)imp_max(walk->n, 1), sizeof *P);
    imp_spec product = imp__spec(1);
    int k = 0;
    if (!P) return NULL;
    for (const struct imp_vertex *v = walk->first; v; v = v->next) {
        P[k++] = product;
        product *= v->w;
    }
    return P;
}

/* The entries of the walk from the light, and its fold with them. NULL: no memory. */
static struct imp_entry *entries(struct imp_arena *arena, struct imp_light_walk *w,
                                 const imp_spec *adjoint, imp_spec *of_eye)
{
    struct imp_entry *entry =
        imp__arena_array(arena, (size_t)imp_max(w->walk.n, 1), sizeof *entry);
    if (!entry) return NULL;
    *of_eye = (imp_spec){0};
    for (const struct imp_reach *r = w->reach; r; r = r->next, adjoint++) {
        if (!r->vertex) *of_eye = *adjoint * w->both->pixels;
        else if (r->met) entry[r->number].e = *adjoint;
        else entry[r->number].b = *adjoint;
    }
    return entry;
}

/* Each joint with P_y, in the order of the walk from the sensor. */
static void each_joint(const struct joints *j,
                       void (*take)(const struct joints *j, struct imp_joint *joint,
                                    imp_spec P_y, void *payload),
                       void *payload)
{
    imp_spec P = j->adjoint;
    struct imp_joint *joint = j->both->joints;
    for (const struct imp_vertex *v = j->both->eye.first; v && joint; v = v->next) {
        for (; joint && joint->y == v; joint = joint->next) take(j, joint, P, payload);
        P *= v->w;
    }
}

static void joint_enter(const struct joints *j, struct imp_joint *joint, imp_spec P_y,
                        void *payload)
{
    (void)payload;
    j->entry[joint->z_number].joints +=
        P_y * joint->f_y * joint->T * (double)joint->weight * joint->f_z;
}

static struct imp_dirs dirs_y(const struct imp_joint *j)
{
    return (struct imp_dirs){imp__decided_v3(j->y->d.wo), imp__decided_v3(j->wi),
                             IMP_SMOOTH, 0};
}
static struct imp_dirs dirs_z(const struct imp_joint *j)
{
    return (struct imp_dirs){imp__decided_v3(j->wo), imp__decided_v3(j->z->d.wi),
                             IMP_SMOOTH, 0};
}

/* ---- Pieces of a joint --------------------------------------------------------------- */

/* The value of a vertex towards the other one, whose value is `other`. */
struct kernel {
    const struct imp_vertex *v;
    struct imp_dirs dirs;
    imp_spec other;
};
struct joint_ops {
    void (*kernels)(void *taker, const struct kernel of[2], imp_spec adjoint);
    void (*track)(void *taker, const struct imp_joint *joint, imp_spec adjoint);
};

static inline __attribute__((always_inline)) void
joint_pieces(const struct joint_ops *ops, void *taker, const struct joints *j,
             const struct imp_joint *joint, imp_spec P_y)
{
    const imp_spec all = P_y * j->P[joint->z_number] * (double)joint->weight;
    const struct kernel kernels[2] = {{joint->y, dirs_y(joint), joint->f_z},
                                      {joint->z, dirs_z(joint), joint->f_y}};
    ops->kernels(taker, kernels, all * joint->T);
    if (joint->track) ops->track(taker, joint, all * joint->f_y * joint->f_z);
}

static const struct imp_bsdf *kernel_d(const struct kernel *k, imp_spec *d)
{
    imp__bsdf_eval_d(k->v->bsdf, k->v->carried, k->v->in, &k->dirs, d);
    return k->v->bsdf;
}

/* ---- Reverse ------------------------------------------------------------------------ */

struct reverse {
    const struct imp_tracer *tracer;
    struct imp_sink *sink;
};

static void reverse_kernels(void *taker, const struct kernel of[2], imp_spec adjoint)
{
    const struct reverse *r = taker;
    imp_spec d[IMP_INPUTS_MAX];
    for (int k = 0; k < 2; k++) {
        if (!imp__scatterer_active(r->tracer, of[k].v)) continue;
        const imp_spec bar = adjoint * of[k].other;
        const struct imp_bsdf *b = kernel_d(&of[k], d);
        for (int i = 0; i < b->n_in; i++) d[i] *= bar;
        imp__vertex_scatter(r->tracer, of[k].v, d, r->sink);
    }
}

static void reverse_track(void *taker, const struct imp_joint *joint, imp_spec adjoint)
{
    const struct reverse *r = taker;
    imp__track_sweep(r->tracer, joint->track, joint->y->carried, &joint->T, adjoint,
                     r->sink);
}

static const struct joint_ops reverse_ops = {reverse_kernels, reverse_track};

static void joint_sweep(const struct joints *j, struct imp_joint *joint, imp_spec P_y,
                        void *payload)
{
    joint_pieces(&reverse_ops, payload, j, joint, P_y);
}

bool imp__light_walk_sweep(const struct imp_tracer *tracer, struct imp_arena *arena,
                           struct imp_light_walk *w, const imp_spec *adjoint,
                           double factor, struct imp_sink *sink)
{
    if (w->n_reach == 0) return true;
    struct joints j = {.both = w->both};
    struct reverse r = {tracer, sink};
    j.entry = entries(arena, w, adjoint, &j.adjoint);
    if (!j.entry) return false;
    if (w->both) {
        j.P = products(arena, &w->walk);
        if (!j.P) return false;
        each_joint(&j, joint_enter, NULL);
        j.adjoint *= imp__spec(factor);
        imp__walk_sweep_values(tracer, &w->both->eye, j.adjoint, sink);
        each_joint(&j, joint_sweep, &r);
    }
    w->walk.entry = j.entry;
    imp__walk_fold(&w->walk);
    imp__walk_sweep_values(tracer, &w->walk, imp__spec(factor), sink);
    return true;
}

/* ---- Forward ------------------------------------------------------------------------ */

struct forward {
    const struct imp_tracer *tracer;
    const double *x_dot;
    imp_spec L_dot;
};

static void forward_kernels(void *taker, const struct kernel of[2], imp_spec adjoint)
{
    struct forward *f = taker;
    imp_spec d[IMP_INPUTS_MAX], in_dot[IMP_INPUTS_MAX], both = {0};
    for (int k = 0; k < 2; k++) {
        imp_spec sum = {0};
        if (!imp__scatterer_active(f->tracer, of[k].v)) continue;
        imp__vertex_tangent(f->tracer, of[k].v, f->x_dot, in_dot);
        const struct imp_bsdf *b = kernel_d(&of[k], d);
        for (int i = 0; i < b->n_in; i++) sum += d[i] * in_dot[i];
        both += sum * of[k].other;
    }
    f->L_dot += adjoint * both;
}

static void forward_track(void *taker, const struct imp_joint *joint, imp_spec adjoint)
{
    struct forward *f = taker;
    f->L_dot +=
        adjoint * imp__track_tangent_along(f->tracer, joint->track, joint->y->carried,
                                           &joint->T, f->x_dot);
}

static const struct joint_ops forward_ops = {forward_kernels, forward_track};

static void joint_tangent(const struct joints *j, struct imp_joint *joint, imp_spec P_y,
                          void *payload)
{
    joint_pieces(&forward_ops, payload, j, joint, P_y);
}

bool imp__light_walk_tangent(const struct imp_tracer *tracer, struct imp_arena *arena,
                             struct imp_light_walk *w, const imp_spec *adjoint,
                             const double *x_dot, imp_spec *L_dot)
{
    *L_dot = (imp_spec){0};
    if (w->n_reach == 0) return true;
    struct joints j = {.both = w->both};
    struct forward f = {.tracer = tracer, .x_dot = x_dot};
    j.entry = entries(arena, w, adjoint, &j.adjoint);
    if (!j.entry) return false;
    if (w->both) {
        j.P = products(arena, &w->walk);
        if (!j.P) return false;
        each_joint(&j, joint_enter, NULL);
        f.L_dot = j.adjoint * imp__walk_tangent_values(tracer, &w->both->eye, x_dot);
        each_joint(&j, joint_tangent, &f);
    }
    w->walk.entry = j.entry;
    imp__walk_fold(&w->walk);
    *L_dot = f.L_dot + imp__walk_tangent_values(tracer, &w->walk, x_dot);
    return true;
}

/* ---- Frozen walks -------------------------------------------------------------------- */

bool imp__light_walk_evaluate(const struct imp_tracer *tracer, struct imp_arena *arena,
                              struct imp_light_walk *w)
{
    imp__walk_evaluate(tracer, &w->walk);
    if (w->both) {
        struct imp_both *b = w->both;
        const imp_spec *P = products(arena, &w->walk);
        if (!P) return false;
        imp__walk_evaluate(tracer, &b->eye);
        for (struct imp_joint *j = b->joints; j; j = j->next) {
            const struct imp_dirs y = dirs_y(j), z = dirs_z(j);
            imp__bsdf_eval(j->y->bsdf, j->y->carried, j->y->in, &y, &j->f_y);
            imp__bsdf_eval(j->z->bsdf, j->z->carried, j->z->in, &z, &j->f_z);
            if (j->track) j->T = imp__track_eval(tracer->scene, j->track, j->y->carried);
            j->y->b += j->f_y * j->f_z * P[j->z_number] * j->T * (double)j->weight;
        }
    }
    imp__light_walk_close(tracer, w);
    return true;
}
