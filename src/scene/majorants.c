/* SPDX-License-Identifier: Apache-2.0
 *
 * Grid of bounds and control extinctions over a medium's box, filled again where parameters
 * change; a ray's entry into it. */
#include "majorants.h"
#include "base/arguments.h"

#define CELLS_MAX 64 /* along an axis */

/* The extinction of the largest inputs in the world's box of a cell: it does not fall where
 * an input rises (IMP_INPUT_EXTINCTION). Where it does (IMP_INPUT_FALLS), the input is one
 * value, which is the largest and the smallest. */
static double cell_bound(const struct imp_majorants *g, const int cell[3])
{
    const struct imp_medium *m = g->medium;
    imp_v3 lo = {INFINITY, INFINITY, INFINITY, 0}, hi = -lo;
    imp_spec in[IMP_INPUTS_MAX];
    struct imp_coefficients c;
    for (int k = 0; k < 8; k++) {
        imp_v3 p = {0};
        for (int a = 0; a < 3; a++) p[a] = (double)(cell[a] + (k >> a & 1)) / g->n[a];
        p = imp__point(&g->to_world, p);
        lo = imp__lesser(lo, p);
        hi = imp__greater(hi, p);
    }
    const struct imp_texcoord at = {.p = (lo + hi) * 0.5};
    imp__inputs_eval(m->input, m->n_own, &at, in);
    for (int j = 0; j < m->n_own; j++)
        if ((m->ops->inputs[j].flags & (IMP_INPUT_EXTINCTION | IMP_INPUT_FALLS)) ==
            IMP_INPUT_EXTINCTION)
            imp__input_most(m->input[j], &lo, &hi, &in[j]);
    m->ops->eval(m, in, &c);
    double most = 0;
    for (int k = 0; k < g->channels; k++) most = imp_max(c.extinction[k], most);
    return most;
}

/* Floats above what they bound. */
static float above(double x)
{
    return x > 0 ? nextafterf((float)(x * (1 + 1e-7)), INFINITY) : 0;
}

/* Control extinction of a cell by 2 x 2 x 2 of its points and its bound. The reach is a tenth
 * of the bound at least: a factor is then at most 11, whatever lies between the points. */
static struct imp_control cell_control(const struct imp_majorants *g, const int cell[3],
                                       double bound)
{
    const struct imp_medium *m = g->medium;
    double sum = 0, least = bound;
    imp_spec in[IMP_INPUTS_MAX];
    struct imp_coefficients c;
    for (int k = 0; k < 8; k++) {
        imp_v3 p = {0};
        for (int a = 0; a < 3; a++)
            p[a] = (cell[a] + 0.25 + 0.5 * (k >> a & 1)) / g->n[a];
        const struct imp_texcoord at = {.p = imp__point(&g->to_world, p)};
        for (int j = 0; j < m->n_own; j++) {
            in[j] = (imp_spec){0};
            if (m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION)
                imp__inputs_eval(&m->input[j], 1, &at, &in[j]);
        }
        m->ops->eval(m, in, &c);
        for (int l = 0; l < g->channels; l++) {
            sum += c.extinction[l];
            least = imp_min(c.extinction[l], least);
        }
    }
    const double mean = imp_min(sum / (8 * g->channels), bound);
    const double reach = imp_max(imp_max(mean - least, bound - mean), 0.1 * bound);
    return (struct imp_control){(float)mean, (float)reach};
}

static void fill(void *payload)
{
    struct imp_majorants *g = payload;
    int cell[3];
    float *to = g->bound;
    struct imp_control *control = g->control;
    g->most = 0;
    for (cell[2] = 0; cell[2] < g->n[2]; cell[2]++)
        for (cell[1] = 0; cell[1] < g->n[1]; cell[1]++)
            for (cell[0] = 0; cell[0] < g->n[0]; cell[0]++) {
                *to = above(cell_bound(g, cell));
                if (control) *control++ = cell_control(g, cell, *to);
                g->most = fmaxf(g->most, *to++);
            }
}

/* An extinction that falls where an input rises is bounded by the least value of that, which
 * is not known of textures, nor of spectra. */
static enum imp_status falling_check(struct imp_scene *scene, const struct imp_node *node,
                                     const struct imp_medium *m, bool varies)
{
    for (int j = 0; j < m->n_own; j++) {
        const struct imp_input *in = m->input[j];
        const bool spectrum = in->spectrum && in->spectrum->form != IMP_SPECTRUM_NUMBER;
        if (!(m->ops->inputs[j].flags & IMP_INPUT_FALLS)) continue;
        if (in->texture || (varies && spectrum))
            return imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                                   "'%s': the extinction %sfalls where it rises, and a "
                                   "%s has no known lower "
                                   "bound: give it one value",
                                   m->ops->inputs[j].name,
                                   in->texture ? "" : "varies, and ",
                                   in->texture ? in->texture->ops->name : "spectrum");
    }
    return IMP_OK;
}

enum imp_status imp__majorants_create(struct imp_scene *scene,
                                      const struct imp_node *node, struct imp_medium *m)
{
    enum imp_status st = IMP_OK;
    struct imp_majorants *g = NULL;
    const struct imp_texture *box = NULL;
    bool varies = m->ops->boxed;
    for (int j = 0; j < m->n_own; j++)
        varies |= m->input[j]->texture &&
                  m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION &&
                  !(m->input[j]->texture->ops->flags & IMP_TEXTURE_CONSTANT);
    IMP_CHECKED(falling_check(scene, node, m, varies));
    for (int j = 0; j < m->n_own; j++) {
        const struct imp_texture *t = m->input[j]->texture;
        if (!t || !(m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION)) continue;
        if (!box && t->ops->extent) box = t;
        if (!t->ops->bound)
            return imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                                   "'%s': a %s has no known bound, and cannot be an "
                                   "extinction",
                                   m->ops->inputs[j].name, t->ops->name);
    }
    if (!varies) return IMP_OK;
    if (!box && !m->ops->boxed)
        return imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                               "its extinction varies, and has no box to look for it in");
    g = imp__arena_array(&scene->arena, 1, sizeof *g);
    if (!g) return imp__build_no_memory(scene);
    *g = (struct imp_majorants){.medium = m,
                                .box = box,
                                .channels = scene->channels,
                                .ends = true,
                                .to_unit = imp__mat4_identity(),
                                .n = {1, 1, 1}};
    if (box) box->ops->extent(box, g->to_unit.m, g->n);
    if (!imp__mat4_inverse(&g->to_unit, &g->to_world))
        return imp__node_error(scene->ctx, node, IMP_E_SCENE, "its box is flat");
    size_t n = 1;
    for (int a = 0; a < 3; a++) {
        g->n[a] = imp_min(imp_max(g->n[a], 1), CELLS_MAX);
        n *= (size_t)g->n[a];
    }
    g->bound = imp__arena_array(&scene->arena, n, sizeof *g->bound);
    if (!g->bound) return imp__build_no_memory(scene);
    fill(g);
    for (int j = 0; j < m->n_own; j++)
        if (m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION)
            IMP_TRY(imp__build_watch(scene, &m->input[j], 1, fill, g));
    m->majorants = g;
out:
    return st;
}

void imp__majorants_renew(struct imp_majorants *g)
{
    int cells[3];
    if (!g) return;
    if (g->box) {
        g->box->ops->extent(g->box, g->to_unit.m, cells);
        imp__mat4_inverse(&g->to_unit, &g->to_world);
    }
    fill(g);
}

enum imp_status imp__majorants_control(struct imp_scene *scene, struct imp_majorants *g)
{
    const size_t n = (size_t)g->n[0] * (size_t)g->n[1] * (size_t)g->n[2];
    if (g->control) return IMP_OK;
    g->control = imp__arena_array(&scene->arena, n, sizeof *g->control);
    if (!g->control) return imp__build_no_memory(scene);
    fill(g);
    return IMP_OK;
}

/* ---- A ray through the cells ------------------------------------------------------- */

bool imp__majorants_enter(const struct imp_majorants *of, imp_v3 o, imp_v3 d, double near,
                          double far, struct imp_majorant_walk *w)
{
    const imp_v3 u = imp__point(&of->to_unit, o), v = imp__vector(&of->to_unit, d);
    ptrdiff_t stride = 1;
    w->of = of;
    for (int a = 0; a < 3; a++) { /* the slab of each axis */
        if (v[a] == 0) {
            if (!(u[a] >= 0 && u[a] <= 1)) return false;
            continue;
        }
        const double t0 = -u[a] / v[a], t1 = (1 - u[a]) / v[a];
        near = imp_max(near, imp_min(t0, t1));
        far = imp_min(far, imp_max(t0, t1));
    }
    if (!(near < far)) return false;
    w->t = near;
    w->end = far;
    w->cell = 0;
    w->next = w->each = imp__spec(INFINITY);
    for (int a = 0; a < 3; a++) {
        const double x = (u[a] + near * v[a]) * of->n[a], speed = v[a] * of->n[a];
        const int cell = (int)imp_clamp(floor(x), 0.0, of->n[a] - 1.0);
        w->cell += cell * stride;
        w->stride[a] = speed > 0 ? stride : -stride;
        w->left[a] = speed > 0 ? of->n[a] - 1 - cell : cell;
        stride *= of->n[a];
        if (speed == 0) continue;
        w->each[a] = 1 / fabs(speed);
        w->next[a] = (cell + (speed > 0) - u[a] * of->n[a]) / speed;
    }
    w->leave = imp_min(imp__majorants_wall(w), w->end);
    w->bound = (double)of->bound[w->cell];
    return true;
}
