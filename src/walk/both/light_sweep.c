/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of what walks from the lights bring, and of samples from both ends. Wherever
 * light reaches the film it has an adjoint of its own. A joint of y and z (both.h) brings
 *
 *     A  P_y f_y T m f_z P_z,    A: adjoint,  P: products of the weights up to y and z
 *
 * P_y belongs to the walk from the sensor, whose B of y holds the rest as a factor; P_z to
 * the walk from the light, where A P_y f_y T m f_z enters at z as light that reaches the
 * film. What is left are the derivatives of f_y, f_z and T. */
#include "both.h"
#include "walk/media/tracking.h"

struct joints {
    const struct imp_tracer *tracer;
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

/* ---- Reverse ------------------------------------------------------------------------ */

static void kernel_sweep(const struct imp_tracer *tracer, const struct imp_vertex *v,
                         const struct imp_dirs *dirs, imp_spec bar, struct imp_sink *sink)
{
    imp_spec d[IMP_INPUTS_MAX];
    if (!imp__vertex_active(tracer, v)) return;
    imp__bsdf_eval_d(v->bsdf, v->carried, v->in, dirs, d);
    for (int k = 0; k < v->bsdf->n_in; k++) d[k] *= bar;
    imp__vertex_scatter(tracer, v, d, sink);
}

static void joint_sweep(const struct joints *j, struct imp_joint *joint, imp_spec P_y,
                        void *payload)
{
    struct imp_sink *sink = payload;
    const imp_spec all = P_y * j->P[joint->z_number] * (double)joint->weight;
    const struct imp_dirs y = dirs_y(joint), z = dirs_z(joint);
    kernel_sweep(j->tracer, joint->y, &y, all * joint->T * joint->f_z, sink);
    kernel_sweep(j->tracer, joint->z, &z, all * joint->T * joint->f_y, sink);
    if (joint->track)
        imp__track_sweep(j->tracer, joint->track, joint->y->carried, &joint->T,
                         all * joint->f_y * joint->f_z, sink);
}

bool imp__light_walk_sweep(const struct imp_tracer *tracer, struct imp_arena *arena,
                           struct imp_light_walk *w, const imp_spec *adjoint,
                           double factor, struct imp_sink *sink)
{
    if (w->n_reach == 0) return true;
    struct joints j = {.tracer = tracer, .both = w->both};
    j.entry = entries(arena, w, adjoint, &j.adjoint);
    if (!j.entry) return false;
    if (w->both) {
        j.P = products(arena, &w->walk);
        if (!j.P) return false;
        each_joint(&j, joint_enter, NULL);
        j.adjoint *= imp__spec(factor);
        imp__walk_sweep_values(tracer, &w->both->eye, j.adjoint, sink);
        each_joint(&j, joint_sweep, sink);
    }
    w->walk.entry = j.entry;
    imp__walk_fold(&w->walk);
    imp__walk_sweep_values(tracer, &w->walk, imp__spec(factor), sink);
    return true;
}

/* ---- Forward ------------------------------------------------------------------------ */

struct forward {
    const double *x_dot;
    imp_spec L_dot;
};

static imp_spec kernel_tangent(const struct imp_tracer *tracer,
                               const struct imp_vertex *v, const struct imp_dirs *dirs,
                               const double *x_dot)
{
    imp_spec d[IMP_INPUTS_MAX], in_dot[IMP_INPUTS_MAX], sum = {0};
    if (!imp__vertex_active(tracer, v)) return sum;
    imp__vertex_tangent(tracer, v, x_dot, in_dot);
    imp__bsdf_eval_d(v->bsdf, v->carried, v->in, dirs, d);
    for (int k = 0; k < v->bsdf->n_in; k++) sum += d[k] * in_dot[k];
    return sum;
}

static void joint_tangent(const struct joints *j, struct imp_joint *joint, imp_spec P_y,
                          void *payload)
{
    struct forward *f = payload;
    const imp_spec all = P_y * j->P[joint->z_number] * (double)joint->weight;
    const struct imp_dirs y = dirs_y(joint), z = dirs_z(joint);
    f->L_dot += all * joint->T *
                (kernel_tangent(j->tracer, joint->y, &y, f->x_dot) * joint->f_z +
                 kernel_tangent(j->tracer, joint->z, &z, f->x_dot) * joint->f_y);
    if (joint->track)
        f->L_dot += all * joint->f_y * joint->f_z *
                    imp__track_tangent_along(j->tracer, joint->track, joint->y->carried,
                                             &joint->T, f->x_dot);
}

bool imp__light_walk_tangent(const struct imp_tracer *tracer, struct imp_arena *arena,
                             struct imp_light_walk *w, const imp_spec *adjoint,
                             const double *x_dot, imp_spec *L_dot)
{
    *L_dot = (imp_spec){0};
    if (w->n_reach == 0) return true;
    struct joints j = {.tracer = tracer, .both = w->both};
    struct forward f = {.x_dot = x_dot};
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
