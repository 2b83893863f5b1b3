/* SPDX-License-Identifier: Apache-2.0
 *
 * Looks whether the derivative with respect to a field is the whole one. It is if what is
 * seen through the medium varies smoothly as the rays move. It is not where they pass an
 * edge: of a light that does not fill the view, of one shape before another, of a body
 * with corners. Edges are found as a surface from which moved rays go on to different
 * surfaces. A glass ball's outline before what has no edges itself is none (reflection
 * and refraction meet there), nor is the border of a light that is dark along it, in the
 * dark. */
#include "kind/shape/shape.h"
#include "walk/core/vertex.h"
#include "walk/graded/graded.h"
#include <stdio.h>
#include <string.h>

#define WALKS 8192
#define PAIRS 512

/* A piece of surface without edges: a round shape, or the facets of one normal. */
struct piece {
    const struct imp_shape *shape; /* NULL: no shape */
    int normal[3];
    bool ball, around; /* a glass ball from outside; nothing, or a sphere from inside */
};
struct pair {
    struct piece from, to;
    bool inside; /* the way between them begins behind `from` */
};

static struct piece piece_of(const struct imp_scene *scene, const struct imp_vertex *v)
{
    struct piece p = {.around = true};
    struct imp_round r;
    if (!v || !v->shape) return p;
    p.shape = v->shape;
    p.around = false;
    if (!imp__shape_round(v->shape, &r)) {
        for (int k = 0; k < 3; k++) p.normal[k] = (int)lrint(v->ng[k] * 1e4);
        return p;
    }
    if (imp__dot(r.axis, r.axis) != 0) return p;
    const imp_v3 from = v->prev ? imp__decided_v3(v->prev->d.p) - r.centre : (imp_v3){0};
    const bool outside = imp__dot(from, from) > imp__sqr(r.radius) * (1 + 1e-9);
    const bool clear = imp__shape_bsdf(scene, v->shape)->flags & IMP_BSDF_TRANSMIT;
    p.ball = clear && outside;
    p.around = !clear && !outside;
    return p;
}
static bool same(struct piece a, struct piece b)
{
    return a.shape == b.shape && memcmp(a.normal, b.normal, sizeof a.normal) == 0;
}

/* A rectangle that emits nothing along its border. Texels have not more than a few
 * samples each: the border of a finer picture is not seen between them. */
static bool dark_border(const struct imp_scene *scene, const struct imp_shape *s)
{
    if (!(s->ops->flags & IMP_SHAPE_SQUARE) || s->emitter < 0) return false;
    const struct imp_emitter *e = scene->emitters[s->emitter];
    size_t n = 1024;
    for (int j = 0; j < e->n_in; j++) {
        const struct imp_texture *t = e->input[j]->texture;
        if (!t || t->param < 0) continue;
        const struct imp_param_info *info = &scene->params[t->param].info;
        for (int k = 0; k < 2 && k < info->n_dims; k++) n = imp_max(n, 4 * info->dims[k]);
    }
    for (size_t i = 0; i < 4 * n; i++) {
        const double along = ((double)(i / 4) + 0.5) / (double)n, side = (double)(i & 1);
        const bool u = i & 2;
        const struct imp_texcoord at = {.uv = {u ? along : side, u ? side : along}};
        const struct imp_emission x = {{at.uv[0], at.uv[1]}, 1, 1, {0, 0, 1, 0}};
        imp_spec in[IMP_INPUTS_MAX], le;
        imp__inputs_eval(e->input, e->n_in, &at, in);
        e->ops->eval(e, in, &x, &le);
        for (int c = 0; c < scene->channels; c++)
            if (le[c] != 0) return false;
    }
    return true;
}

/* Do rays that move from one to the other see no jump? */
static bool smooth_between(const struct imp_scene *scene, struct piece a, struct piece b)
{
    if (same(a, b)) return true;
    if ((a.ball || b.ball) && (a.ball || a.around) && (b.ball || b.around)) return true;
    if (scene->environment >= 0 || (a.shape && b.shape)) return false;
    return dark_border(scene, a.shape ? a.shape : b.shape);
}

static const char *name_of(struct piece p)
{
    return !p.shape ? "nothing" : p.shape->name ? p.shape->name : p.shape->ops->name;
}

static enum imp_status refuse(const struct imp_tracer *t, const struct imp_body *m,
                              const char *format, const char *a, const char *b)
{
    char text[400];
    snprintf(text, sizeof text, format, a, b);
    return imp__error(t->scene->ctx, IMP_E_BIAS,
                      "medium '%s': no unbiased derivative of its field: %s "
                      "(docs/bend.md, In scenes)",
                      m->name, text);
}

struct survey {
    const struct imp_tracer *tracer;
    struct pair pair[PAIRS];
    int n;
};

/* The ray that left v has moved and met `next` (NULL: nothing). */
static enum imp_status look(struct survey *s, const struct imp_body *m,
                            const struct imp_vertex *v, const struct imp_vertex *next)
{
    const struct imp_scene *scene = s->tracer->scene;
    const struct imp_vertex *shape = next && next->shape ? next : NULL;
    const struct imp_graded_segment *leg = next ? imp__graded_kept(next) : NULL;
    const imp_v3 d = !leg ? (imp_v3){0} : leg->medium ? leg->ride.d : leg->d;
    const struct pair p = {piece_of(scene, v), piece_of(scene, shape),
                           imp__dot(v->ng, d) < 0};
    bool known = false;
    for (int i = 0; i < s->n; i++) {
        if (!same(s->pair[i].from, p.from) || s->pair[i].inside != p.inside) continue;
        known |= same(s->pair[i].to, p.to);
        if (!smooth_between(scene, s->pair[i].to, p.to))
            return refuse(s->tracer, m,
                          "its rays meet '%s' and, beside it, '%s': an edge that moves "
                          "with the field. Let one fill all that is seen, or be dark at "
                          "its border",
                          name_of(s->pair[i].to), name_of(p.to));
    }
    if (known) return IMP_OK;
    if (s->n < PAIRS) s->pair[s->n++] = p;
    return IMP_OK;
}

static const struct imp_body *an_active(const struct imp_tracer *t)
{
    for (int i = 0; i < t->scene->n_bodies; i++)
        if (t->active->body[i]) return t->scene->bodies[i];
    return NULL;
}

static enum imp_status walk_look(struct survey *s, const struct imp_walk *w)
{
    const struct imp_body *m = an_active(s->tracer);
    bool moved = false;
    for (const struct imp_vertex *v = w->first; v; v = v->next) {
        const struct imp_graded_segment *to = imp__graded_kept(v);
        const struct imp_graded_segment *on = v->next ? imp__graded_kept(v->next) : NULL;
        moved |= to && to->moved;
        const bool bent = on && on->moved;
        const struct imp_texcoord at = imp__vertex_at(v);
        if (w->dropped == IMP_DROP_MOVED && !v->next)
            return refuse(s->tracer, m, "its rays go on to '%s', which %s",
                          name_of(piece_of(s->tracer->scene, v)),
                          imp__graded_obstacle(s->tracer->scene, v->shape, &at));
        if (!v->d.goes_on || w->dropped || !(bent || moved)) continue;
        const enum imp_status st = look(s, m, v, v->next);
        if (st != IMP_OK) return st;
    }
    return IMP_OK;
}

enum imp_status imp__graded_survey(const struct imp_tracer *tracer)
{
    const struct imp_film_desc *film = &tracer->sensor->film;
    const int64_t pixels = (int64_t)film->crop_w * film->crop_h;
    const int64_t walks = imp_min(imp_max(pixels, (int64_t)2048), (int64_t)WALKS);
    struct survey s = {.tracer = tracer};
    struct imp_arena arena;
    enum imp_status st = IMP_OK;
    imp__arena_init(&arena, tracer->scene->ctx);
    const struct imp_arena_mark start = imp__arena_mark(&arena);
    for (int64_t i = 0; i < walks && st == IMP_OK; i++) {
        const int64_t pixel = pixels <= walks ? i % pixels : i * pixels / walks;
        struct imp_walk w;
        imp__walk_trace(tracer, &arena, (int)(pixel % film->crop_w),
                        (int)(pixel / film->crop_w), i / pixels, &w);
        if (w.dropped == IMP_DROP_MEMORY)
            st = imp__error(tracer->scene->ctx, IMP_E_NOMEM, "no memory to record walks");
        else st = walk_look(&s, &w);
        imp__arena_rewind(&arena, start);
    }
    imp__arena_free(&arena);
    return st;
}
