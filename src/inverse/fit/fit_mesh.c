/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertices of meshes, fitted by Adam in smooth steps (search/smoother.h). x stays the vertices, so that
 * checkpoints, answers and steps that are halved are as they are without; the search takes derivatives
 * to the smoother's variables u, and steps of u back to x. */
#include "base/arguments.h"
#include "fit.h"
#include "move/moves.h"
#include "scene/pose.h"
#include "search/smoother.h"
#include <math.h>

/* The default, over the number of places: steps are smooth over the same part of a mesh, .6 of a ball's
 * radius, whatever its triangles. (The paper's examples have 19 to 50 for some thousand vertices.) */
#define LAMBDA (1. / 64)

struct imp__fit_mesh {
    size_t first; /* of its numbers in x */
    struct imp__smoother *smoother;
};

static const struct imp_pose *vertices_of(const struct imp_problem *p,
                                          const struct imp__block *b)
{
    const struct imp_pose *pose = imp__pose_of(p->scene, b->param);
    return pose && pose->kind == IMP_POSE_VERTICES ? pose : NULL;
}

bool imp__fit_smooths(const struct imp__fit *f, const struct imp__block *b)
{
    return f->n_meshes > 0 && vertices_of(f->problem, b) != NULL;
}

/* Which places are held: all three numbers of all of their vertices, or none. */
static enum imp_status held_find(const struct imp_problem *p, const struct imp__block *b,
                                 const uint32_t *place, bool *held)
{
    for (size_t e = 0; e < b->count; e++) {
        const bool is_held = imp__block_held(p, b, e);
        const size_t v = e / 3;
        if (e % 3 == 0 && place[v] == v) held[v] = is_held;
        if (is_held == held[place[v]]) continue;
        return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                          "%s[%zu]: of a mesh in smooth steps (mesh_lambda) whole places "
                          "are held, three numbers of every vertex there",
                          p->scene->params[b->param].info.name, e);
    }
    return IMP_OK;
}

static enum imp_status mesh_make(struct imp__fit *f, const struct imp__block *b,
                                 const struct imp_pose *pose)
{
    enum imp_status st = IMP_OK;
    const struct imp_problem *p = f->problem;
    const struct imp_triangles *t = &p->scene->shapes[pose->shape]->triangles;
    const size_t n = t->n_vertices;
    struct imp__fit_mesh *mesh = &f->meshes[f->n_meshes];
    uint32_t *place = imp__alloc(p->ctx, n, sizeof *place);
    bool *held = imp__alloc(p->ctx, n, sizeof *held);
    if (!place || !held) IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for a mesh"));
    if (b->log || b->tie >= 0)
        IMP_TRY(imp__error(p->ctx, IMP_E_UNSUPPORTED,
                           "%s is tied or in logarithms: mesh_lambda < 0 fits it without "
                           "smooth steps",
                           p->scene->params[b->param].info.name));
    IMP_TRY(imp__vertex_places(p->ctx, pose->object->positions, n, place));
    size_t places = 0;
    for (size_t v = 0; v < n; v++) places += place[v] == v;
    f->seams |= places < n;
    IMP_TRY(held_find(p, b, place, held));
    const struct imp__smooth_mesh of = {.n_vertices = n,
                                        .n_triangles = t->n_triangles,
                                        .indices = t->indices,
                                        .place = place,
                                        .held = held,
                                        .lambda = f->options.mesh_lambda > 0
                                                      ? f->options.mesh_lambda
                                                      : LAMBDA * (double)places};
    IMP_TRY(imp__smoother_create(p->ctx, &of, &mesh->smoother));
    mesh->first = b->first;
    f->n_meshes++;
out:
    imp__release(p->ctx, place);
    imp__release(p->ctx, held);
    return st;
}

enum imp_status imp__fit_meshes(struct imp__fit *f)
{
    struct imp_problem *p = f->problem;
    const double lambda = f->options.mesh_lambda;
    size_t n = 0;
    for (size_t k = 0; k < p->n_blocks; k++) n += vertices_of(p, &p->blocks[k]) != NULL;
    if (!isfinite(lambda))
        return imp__error(p->ctx, IMP_E_ARG, "mesh_lambda = %g is not finite", lambda);
    if (lambda > 0 && f->options.optimizer != IMP_ADAM)
        return imp__error(p->ctx, IMP_E_ARG,
                          "mesh_lambda: smooth steps of a mesh are Adam's");
    if (lambda > 0 && n == 0)
        return imp__error(p->ctx, IMP_E_ARG,
                          "mesh_lambda: no vertex_positions of a mesh are active");
    if (lambda < 0 || n == 0 || f->options.optimizer != IMP_ADAM) return IMP_OK;
    f->meshes = imp__alloc(p->ctx, n, sizeof *f->meshes);
    if (!f->meshes) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for meshes");
    for (size_t k = 0; k < p->n_blocks; k++) {
        const struct imp_pose *pose = vertices_of(p, &p->blocks[k]);
        if (pose) IMP_CHECKED(mesh_make(f, &p->blocks[k], pose));
    }
    p->seams_join = f->seams;
    return IMP_OK;
}

void imp__fit_meshes_free(struct imp__fit *f)
{
    f->problem->seams_join = false;
    for (size_t k = 0; k < f->n_meshes; k++)
        imp__smoother_destroy(f->problem->ctx, f->meshes[k].smoother);
    imp__release(f->problem->ctx, f->meshes);
    f->meshes = NULL;
    f->n_meshes = 0;
}

void imp__fit_smooth(double *v, bool step, void *payload)
{
    const struct imp__fit *f = payload;
    for (size_t k = 0; k < f->n_meshes; k++) {
        const struct imp__fit_mesh *m = &f->meshes[k];
        if (step) imp__smoother_step(m->smoother, v + m->first);
        else imp__smoother_derivative(m->smoother, v + m->first);
    }
}
