/* SPDX-License-Identifier: Apache-2.0
 *
 * Densities of directions, at vertices of the scene's own walks. A density p' that is not the
 * one that directions are drawn with makes pictures and their derivatives wrong alike, so
 * differences see little of it, or nothing. With a second density q that can be drawn too,
 * and any subset S of directions,
 *
 *     E_p[ 1_S q/(q + p') ] = int_S p q/(q + p')  and  E_q[ 1_S p'/(q + p') ] = int_S q p'/(q + p')
 *
 * are equal if p' = p; if p' = a p their ratio is a. The fractions are between 0 and 1, so
 * their variances are bounded. q is a mixture of a uniform density and lobes about directions
 * that may have peaks: the mirror direction, the one straight on, and some that were drawn.
 * The subsets are cells of the sphere and of the size of p'/q. Delta lobes are subsets of
 * their own: how often one is drawn, and its probability.
 *
 * Where the walk draws from a mixture, p' is that of all of it. Directions from q for which
 * the value is not 0 and the density is are a subset, too: none of it is drawn. A phase
 * function's integral is 1. */
#include "check_lobes.h"
#include "check_sources.h"
#include "math/rng.h"
#include "math/warp.h"
#include "scene/in_medium.h"
#include "walk/core/vertex.h"
#include <math.h>
#include <string.h>

#define PILOTS 4  /* directions drawn for the lobes of q */
#define LOOKED 32 /* draws that find delta lobes */
enum {
    WHOLE,
    RATIOS,
    CELLS = RATIOS + 6,
    LOBE = CELLS + 8,
    UNCOVERED = LOBE + 6,
    VALUE,
    SAME
};
#define DELTAS (UNCOVERED - LOBE)

/* One place, and what q is there. */
struct asked {
    const struct imp__place *place;
    bool derivative; /* draws are those of walks whose derivative is wanted */
    int n_lobes;
    struct imp__lobes q; /* in the vertex's frame */
    struct imp_dirs lobe[DELTAS];
};
struct asked_kind {
    const struct imp__places *places;
    const struct imp_bsdf *bsdf, *pure; /* pure: of a medium, albedo 1 */
    int n;
    struct asked *asked; /* [n] */
};

/* ---- The density under test ---------------------------------------------------------- */

static void inputs_of(const struct imp_step *s, const struct imp_bsdf *b, imp_spec *own,
                      const imp_spec **in)
{
    *in = s->in;
    if (!b->shaped || !s->at.carried) return;
    imp__shaped_inputs(b, s->in, imp__waves_drew(s->at.carried), own);
    *in = own;
}

struct at_work {
    struct imp_step s;
    struct imp_walk walk;
    imp_spec scratch[IMP_INPUTS_MAX], own[IMP_INPUTS_MAX];
    const imp_spec *in;
    const struct asked *x;
    const struct imp_bsdf *b;
    uint64_t derivative;
};

static void work_begin(const struct asked_kind *a, const struct asked *x,
                       struct at_work *w)
{
    imp__place_step(a->places, x->place, &w->walk, w->scratch, &w->s);
    w->x = x;
    w->b = x->place->v->bsdf;
    inputs_of(&w->s, w->b, w->own, &w->in);
    w->derivative = x->derivative ? imp__derivative_wanted(&w->s, w->b) : 0;
}

static bool work_draw(const struct at_work *w, const double u[3], struct imp_dirs *d)
{
    int by;
    *d =
        (struct imp_dirs){.wo = w->s.wo, .lobe = IMP_SMOOTH, .derivative = w->derivative};
    return imp__direction_draw(&w->s, w->b, &w->x->place->frame, u, d, &by);
}
/* The kernel's density as walks ask for it. */
static double kernel_pdf(const struct at_work *w, const struct imp_dirs *d)
{
    imp_spec f;
    return w->b->shaped ? w->b->ops->pdf(w->b, w->in, d)
                        : imp__bsdf_pdf_eval(w->b, w->in, d, &f);
}
/* The density that is claimed; of a delta lobe its probability. */
static double work_pdf(const struct at_work *w, struct imp_dirs *d)
{
    double competing;
    const double kernel = kernel_pdf(w, d);
    if (!(kernel > 0)) return 0; /* as the walk has it, whatever else could draw it */
    const imp_v3 world = imp__to_world(&w->x->place->frame, d->wi);
    return imp__direction_pdf(&w->s, kernel, world, IMP_DENSITY_KERNEL, d->lobe,
                              &competing);
}

/* ---- A pair ---------------------------------------------------------------------------- */

static int ratio_part(double p, double q)
{
    return RATIOS + imp_min((int)(6 * p / (p + q)), 5);
}
/* By the side of the surface, and the quarter about the axis from the mirror direction. */
static int cell_part(const struct asked *x, imp_v3 w)
{
    const imp_v3 m = x->q.axis[0];
    const double along = w[0] * m[0] + w[1] * m[1], across = w[0] * m[1] - w[1] * m[0];
    return CELLS + (w[2] < 0 ? 4 : 0) + (along < 0 ? 2 : 0) + (across < 0 ? 1 : 0);
}
static int lobe_of(const struct asked *x, int lobe)
{
    for (int k = 0; k < x->n_lobes; k++)
        if (x->lobe[k].lobe == lobe) return k;
    return -1;
}

static void drawn_add(const struct at_work *w, const double u[3], struct imp__pair *p)
{
    struct imp_dirs d;
    if (!work_draw(w, u, &d)) return;
    if (d.lobe != IMP_SMOOTH) {
        const int k = lobe_of(w->x, d.lobe);
        if (k >= 0) imp__pair_add(p, LOBE + k, 1, 0);
        if (k >= 0) imp__pair_add(p, WHOLE, 1, 0);
        return;
    }
    const double pdf = work_pdf(w, &d);
    if (!(pdf > 0)) return; /* the walk ends there */
    const double q = imp__lobes_pdf(&w->x->q, d.wi), part = q / (q + pdf);
    imp__pair_add(p, WHOLE, part, 0);
    imp__pair_add(p, ratio_part(pdf, q), part, 0);
    imp__pair_add(p, cell_part(w->x, d.wi), part, 0);
    /* Two functions of the kind say it. */
    const double one = kernel_pdf(w, &d), other = w->b->ops->pdf(w->b, w->in, &d);
    imp__pair_add(p, SAME, other > 0 ? fmin(one / other, 2) : 2, 1);
}

static void claimed_add(const struct asked_kind *a, struct at_work *w, const double u[3],
                        struct imp__pair *p)
{
    struct imp_dirs d = {.wo = w->s.wo, .lobe = IMP_SMOOTH, .derivative = w->derivative};
    imp_spec f;
    d.wi = imp__lobes_sample(&w->x->q, u);
    for (int k = 0; k < w->x->n_lobes; k++) {
        struct imp_dirs lobe = w->x->lobe[k];
        const double chance = work_pdf(w, &lobe);
        imp__pair_add(p, LOBE + k, 0, chance);
        imp__pair_add(p, WHOLE, 0, chance);
    }
    if (!(w->b->flags & IMP_BSDF_SMOOTH)) return;
    const double pdf = work_pdf(w, &d), q = imp__lobes_pdf(&w->x->q, d.wi),
                 part = pdf / (q + pdf);
    if (a->pure) {
        a->pure->ops->eval(a->pure, w->in, &d, &f);
        imp__pair_add(p, VALUE, 1, f[0] / q);
    }
    if (pdf > 0) {
        imp__pair_add(p, WHOLE, 0, part);
        imp__pair_add(p, ratio_part(pdf, q), 0, part);
        imp__pair_add(p, cell_part(w->x, d.wi), 0, part);
        return;
    }
    imp__bsdf_eval(w->b, w->s.at.carried, w->s.in, &d, &f);
    const double most = imp__max_used(f, w->s.at.carried != NULL);
    if (most > 0) imp__pair_add(p, UNCOVERED, 0, fmin(most / q, 1));
}

static void pair(const void *payload, uint64_t seed, int64_t i, struct imp__pair *p)
{
    const struct asked_kind *a = payload;
    const struct imp_key key = imp__key(seed, 0xd1, (uint64_t)i);
    struct at_work w;
    double u[6];
    work_begin(a, &a->asked[i % a->n], &w);
    for (int k = 0; k < 6; k++) u[k] = imp__u01(key, (uint32_t)k);
    drawn_add(&w, u, p);
    claimed_add(a, &w, u + 3, p);
}

/* ---- Rows ------------------------------------------------------------------------------ */

/* The axes of q, and the delta lobes there are. */
static void ask(const struct asked_kind *a, const struct imp__place *place, int i,
                struct asked *x)
{
    struct at_work w;
    int pilots = 0;
    *x = (struct asked){.place = place, .derivative = i & 1};
    work_begin(a, x, &w);
    const imp_v3 wo = w.s.wo;
    imp__lobes_add(&x->q, imp__is_in_medium(w.b) ? -wo : (imp_v3){-wo[0], -wo[1], wo[2]});
    if (w.b->flags & IMP_BSDF_TRANSMIT) imp__lobes_add(&x->q, -wo);
    for (int k = 0; k < LOOKED; k++) {
        const struct imp_key key = imp__key(0x9107, (uint64_t)i, (uint64_t)k);
        const double u[3] = {imp__u01(key, 0), imp__u01(key, 1), imp__u01(key, 2)};
        struct imp_dirs d;
        if (!work_draw(&w, u, &d)) continue;
        if (d.lobe == IMP_SMOOTH) {
            if (pilots++ < PILOTS) imp__lobes_add(&x->q, d.wi);
        } else if (x->n_lobes < DELTAS && lobe_of(x, d.lobe) < 0) {
            x->lobe[x->n_lobes++] = d;
        }
    }
}

enum imp_status imp__check_directions(struct imp__draw_list *l,
                                      const struct imp__places *places)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *scene = places->tracer.scene;
    for (int k = 0; k < places->n_kinds; k++) {
        const struct imp__place_kind *kind = &places->kind[k];
        struct asked_kind *a = imp__arena_array(&l->arena, 1, sizeof *a);
        struct asked *asked =
            imp__arena_array(&l->arena, (size_t)kind->n + 1, sizeof *asked);
        if (!a || !asked)
            IMP_TRY(imp__error(l->check->ctx, IMP_E_NOMEM, "no memory for a check"));
        *a = (struct asked_kind){.places = places, .asked = asked};
        if (k >= scene->n_bsdfs) a->pure = scene->media[k - scene->n_bsdfs]->pure;
        for (int i = 0; i < kind->n; i++) {
            const struct imp_bsdf *b = kind->place[i].v->bsdf;
            if (!(b->flags & (IMP_BSDF_SMOOTH | IMP_BSDF_DELTA))) continue;
            ask(a, &kind->place[i], i, &asked[a->n++]);
        }
        if (a->n == 0) continue;
        IMP_TRY(imp__draw_add(l, &(struct imp__draw_row){.method = "directions",
                                                         .name = kind->name,
                                                         .pair = pair,
                                                         .payload = a}));
    }
out:
    return st;
}
