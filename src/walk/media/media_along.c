/* SPDX-License-Identifier: Apache-2.0
 *
 * Media along a line, piece by piece between planes of their grids (media_along.h). */
#include "media_along.h"
#include "math/lanes.h"
#include "math/vec.h"
#include "scene/majorants.h"
#include "scene/pose.h"
#include "tracking.h"
#include <math.h>

/* ---- The extinction, and its gradient --------------------------------------------------- */

static bool is_extinction(const struct imp_medium *m, int j)
{
    return m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION;
}
static bool varies(const struct imp_input *in)
{
    return in->texture && !(in->texture->ops->flags & IMP_TEXTURE_CONSTANT);
}

imp_spec imp__extinction_in(const struct imp_scene *scene, const struct imp_medium *m,
                            imp_v3 p, const struct imp_carried *carried)
{
    imp_spec in[IMP_INPUTS_MAX];
    if (!imp__medium_reaches(scene, m, p)) return imp__spec(0);
    return imp__extinction_at(m, p, carried, in);
}

/* The extinction at p, and its derivatives by p. */
static imp_spec gradient_at(const struct imp_medium *m, imp_v3 p,
                            const struct imp_carried *carried, imp_spec slope[3])
{
    const struct imp_texcoord at = {.p = p, .carried = carried};
    imp_spec in[IMP_INPUTS_MAX], d_p[3];
    struct imp_coefficients c, dc[IMP_INPUTS_MAX];
    for (int j = 0; j < m->n_own; j++)
        if (is_extinction(m, j)) imp__inputs_eval(&m->input[j], 1, &at, &in[j]);
        else in[j] = (imp_spec){0};
    m->ops->eval(m, in, &c);
    m->ops->eval_d(m, in, dc);
    for (int i = 0; i < 3; i++) slope[i] = (imp_spec){0};
    for (int j = 0; j < m->n_own; j++) {
        const struct imp_input *x = m->input[j];
        if (!is_extinction(m, j) || !varies(x)) continue;
        x->texture->ops->gradient(x->texture, &at, x->scalar, d_p);
        for (int i = 0; i < 3; i++) slope[i] += dc[j].extinction * d_p[i];
    }
    return c.extinction;
}

static imp_spec log_slope(imp_spec d, imp_spec value)
{
    imp_spec out;
    for (int c = 0; c < 4; c++) out[c] = value[c] > 0 ? d[c] / value[c] : 0;
    return out;
}

bool imp__point_slopes(const struct imp_medium *m, imp_v3 p,
                       const struct imp_carried *carried, struct imp__point_slopes *out)
{
    const struct imp_texcoord at = {.p = p, .carried = carried};
    imp_spec in[IMP_INPUTS_MAX], d_p[3];
    struct imp_coefficients c, dc[IMP_INPUTS_MAX];
    bool any = false;
    for (int j = 0; j < m->n_own; j++) any |= varies(m->input[j]);
    *out = (struct imp__point_slopes){.extinction = {{0}}};
    if (!any) return false;
    imp__inputs_eval(m->input, m->n_own, &at, in);
    m->ops->eval(m, in, &c);
    m->ops->eval_d(m, in, dc);
    const imp_spec albedo = imp__spec(1) * log_slope(c.scattering, c.extinction);
    for (int j = 0; j < m->n_own; j++) {
        const struct imp_input *x = m->input[j];
        if (!varies(x)) continue;
        x->texture->ops->gradient(x->texture, &at, x->scalar, d_p);
        for (int i = 0; i < 3; i++) {
            const imp_spec d =
                log_slope(dc[j].scattering - albedo * dc[j].extinction, c.extinction) *
                d_p[i];
            out->extinction[i] += log_slope(dc[j].extinction * d_p[i], c.extinction);
            out->albedo[i] += log_slope(d, albedo);
            out->glow[i] += (1 - albedo) * dc[j].emission * d_p[i] - d * c.emission;
        }
    }
    return true;
}

/* ---- Pieces of a line ------------------------------------------------------------------- */

#define PLANES_MAX 12 /* three axes of as many grids as a medium has extinctions */

struct pieces {
    const struct imp_medium *m;
    imp_v3 o, w;
    const struct imp_carried *carried;
    double from, to, end; /* the piece at work; where the line leaves the medium */
    int n;
    double next[PLANES_MAX], each[PLANES_MAX];
};

static void planes_add(struct pieces *p, const struct imp_scene *scene,
                       const struct imp_texture *t)
{
    double rows[12];
    int cells[3];
    t->ops->extent(t, rows, cells); /* coarse ones */
    imp__grid_cells(&scene->params[t->param].info, cells);
    const struct imp_mat4 to_unit = imp__mat4_of_rows(rows);
    const imp_v3 u = imp__point(&to_unit, p->o), v = imp__vector(&to_unit, p->w);
    for (int a = 0; a < 3 && p->n < PLANES_MAX; a++) {
        const double n = cells[a], speed = v[a] * n;
        if (speed == 0) continue;
        const double x = u[a] * n - 0.5, here = x + p->from * speed,
                     plane = speed > 0 ? floor(here) + 1 : ceil(here) - 1;
        p->each[p->n] = 1 / fabs(speed);
        p->next[p->n++] = (plane - x) / speed;
    }
}

bool imp__along_box(const struct imp_medium *m, imp_v3 o, imp_v3 w, double *near,
                    double *far)
{
    struct imp_majorant_walk cells;
    if (!imp__majorants_enter(m->majorants, o, w, *near, *far, &cells)) return false;
    *near = cells.t;
    *far = cells.end;
    return true;
}

static void pieces_begin(struct pieces *p, const struct imp_scene *scene, double near,
                         double far)
{
    p->from = near;
    p->end = far;
    for (int j = 0; j < p->m->n_own; j++)
        if (is_extinction(p->m, j) && varies(p->m->input[j]))
            planes_add(p, scene, p->m->input[j]->texture);
}

/* Sets p->to. False: the line has left. */
static bool piece_next(struct pieces *p)
{
    if (!(p->from < p->end)) return false;
    p->to = p->end;
    for (int k = 0; k < p->n; k++) p->to = imp_min(p->to, p->next[k]);
    p->to = imp_max(p->to, p->from);
    for (int k = 0; k < p->n; k++)
        if (!(p->next[k] > p->to)) /* on, also where a step is lost to rounding */
            p->next[k] = imp_max(p->next[k] + p->each[k], nextafter(p->to, INFINITY));
    return true;
}

#define GAUSS 0.28867513459481287 /* 1/(2 sqrt 3) */

static imp_spec depth_of(const struct pieces *p, double from, double to)
{
    const double middle = 0.5 * (from + to), off = GAUSS * (to - from);
    imp_spec in[IMP_INPUTS_MAX];
    return (imp__extinction_at(p->m, p->o + p->w * (middle - off), p->carried, in) +
            imp__extinction_at(p->m, p->o + p->w * (middle + off), p->carried, in)) *
           (0.5 * (to - from));
}

static imp_spec uniform_depth(const struct imp_medium *m, imp_v3 o, double length,
                              const struct imp_carried *carried)
{
    imp_spec in[IMP_INPUTS_MAX];
    const imp_spec sigma = imp__extinction_at(m, o, carried, in);
    return imp__choose_4(sigma > 0, sigma * length, imp__spec(0));
}

void imp__along_add(const struct imp_scene *scene, const struct imp_medium *m, imp_v3 o,
                    imp_v3 w, double near, double far, const struct imp_carried *carried,
                    bool slopes, struct imp__along *a)
{
    struct pieces p = {.m = m, .o = o, .w = w, .carried = carried};
    if (!(near < far)) return;
    if (!m->majorants) {
        a->depth += uniform_depth(m, o, far - near, carried);
        return;
    }
    if (!imp__along_box(m, o, w, &near, &far)) return;
    pieces_begin(&p, scene, near, far);
    for (; piece_next(&p); p.from = p.to) {
        if (!slopes) {
            a->depth += depth_of(&p, p.from, p.to);
            continue;
        }
        const double middle = 0.5 * (p.from + p.to), half = 0.5 * (p.to - p.from);
        for (int k = 0; k < 2; k++) {
            const double t = middle + (k ? 2 : -2) * GAUSS * half;
            imp_spec slope[3];
            a->depth += gradient_at(m, o + w * t, carried, slope) * half;
            for (int i = 0; i < 3; i++) {
                a->slope[i] += slope[i] * half;
                a->turn[i] += slope[i] * (half * t);
            }
        }
    }
}

imp_spec imp__along_beyond(const struct imp_scene *scene, const struct imp_medium *m,
                           imp_v3 o, imp_v3 w, double near, double far,
                           const struct imp_carried *carried)
{
    struct pieces p = {.m = m, .o = o, .w = w, .carried = carried};
    imp_spec depth = {0};
    pieces_begin(&p, scene, near, far);
    for (; piece_next(&p); p.from = p.to) depth += depth_of(&p, p.from, p.to);
    return depth;
}

/* Within a piece the depth is a polynomial that does not fall: Newton's steps, or halves of what is left. */
#define SEARCH_MOST 60
static double search(const struct pieces *p, int lane, double depth)
{
    double lo = p->from, hi = p->to, t = 0.5 * (lo + hi);
    imp_spec in[IMP_INPUTS_MAX];
    for (int k = 0; k < SEARCH_MOST && hi - lo > 1e-14 * (fabs(hi) + 1); k++) {
        const double off = depth_of(p, p->from, t)[lane] - depth;
        if (off > 0) hi = t;
        else lo = t;
        const double sigma =
            imp__extinction_at(p->m, p->o + p->w * t, p->carried, in)[lane];
        const double step = off / sigma;
        if (fabs(step) < 1e-14 * (fabs(t) + 1)) return t;
        t -= step;
        if (!(t > lo && t < hi)) t = 0.5 * (lo + hi);
    }
    return t;
}

double imp__along_until(const struct imp_scene *scene, const struct imp_medium *m,
                        imp_v3 o, imp_v3 w, double near, double far,
                        const struct imp_carried *carried, int lane, double *depth)
{
    struct pieces p = {.m = m, .o = o, .w = w, .carried = carried};
    imp_spec in[IMP_INPUTS_MAX];
    if (!(near < far)) return INFINITY;
    if (!m->majorants) {
        const double sigma = imp__extinction_at(m, o, carried, in)[lane],
                     t = sigma > 0 ? near + *depth / sigma : INFINITY;
        if (t < far) return t;
        *depth -= sigma > 0 ? sigma * (far - near) : 0;
        return INFINITY;
    }
    if (!imp__along_box(m, o, w, &near, &far)) return INFINITY;
    pieces_begin(&p, scene, near, far);
    for (; piece_next(&p); p.from = p.to) {
        const double here = depth_of(&p, p.from, p.to)[lane];
        if (here > *depth) return search(&p, lane, *depth);
        *depth -= here;
    }
    return INFINITY;
}

/* ---- Lines ------------------------------------------------------------------------------ */

#define BORDERS_MOST 1024

struct imp__media_line imp__media_line(const struct imp__borders *borders, imp_v3 o,
                                       imp_v3 w, double length)
{
    return (struct imp__media_line){.borders = borders,
                                    .start = o,
                                    .o = o,
                                    .w = w,
                                    .length = length,
                                    .next = borders->outside,
                                    .left = BORDERS_MOST};
}

bool imp__media_next(struct imp__media_line *line, struct imp__stretch *out)
{
    bool outwards;
    if (!(line->from < line->length) || line->left-- == 0) return false;
    const struct imp_shape *s =
        imp__border_next(line->borders->scene, &line->o, line->w, &outwards);
    const double t = s ? imp__dot(line->o - line->start, line->w) : INFINITY;
    if (s) line->next = outwards ? s->interior : s->exterior;
    *out = (struct imp__stretch){line->next, line->from,
                                 imp_max(imp_min(t, line->length), line->from)};
    line->from = t;
    if (s) line->next = outwards ? s->exterior : s->interior;
    return true;
}

struct imp__along imp__media_along(const struct imp__borders *borders, imp_v3 o, imp_v3 w,
                                   double length, const struct imp_carried *carried)
{
    struct imp__media_line line = imp__media_line(borders, o, w, length);
    struct imp__along a = {.depth = {0}};
    struct imp__stretch s;
    while (imp__media_next(&line, &s))
        if (s.medium)
            imp__along_add(borders->scene, s.medium, o, w, s.near, s.far, carried, true,
                           &a);
    return a;
}

/* ---- What has them ---------------------------------------------------------------------- */

const char *imp__along_without(const struct imp_scene *scene, const struct imp_medium *m)
{
    const struct imp_texcoord nowhere = {.prim = -1};
    imp_spec slope[3];
    int grids = 0;
    for (int j = 0; j < m->n_own; j++) {
        const struct imp_texture *t = m->input[j]->texture;
        if (!varies(m->input[j])) continue;
        if (!t->ops->gradient) return "varies, and not as a gridvolume does";
        if (!t->ops->gradient(t, &nowhere, m->input[j]->scalar, slope))
            return "has a grid whose values jump from cell to cell (filter_type "
                   "trilinear)";
        if (t->param < 0 || scene->params[t->param].info.n_dims < 3)
            return "has a grid whose cells are no parameter";
        grids += is_extinction(m, j);
    }
    for (int j = m->n_own; j < m->n_in; j++)
        if (m->input[j]->texture) return "has a phase function that varies";
    return 3 * grids > PLANES_MAX ? "has too many grids" : NULL;
}
