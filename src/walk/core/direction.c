/* SPDX-License-Identifier: Apache-2.0
 *
 * How the direction of a continuation is drawn: from a mixture of densities, each with a
 * share,
 *
 *     q(w) = sum_m share_m p_m(w),    sum_m share_m = 1      (Morley et al. 2006, section 4)
 *
 * One member draws; all densities are evaluated, whichever drew, so the mixture is
 * unbiased as long as one of them covers the kernel. Shares are weights of the integrator
 * or of the material (scene/mixing.h); a member that knows nothing at a place leaves its
 * part to the others. No shadow ray is traced: a density says where to look, and what is
 * in the way is met.
 *
 * A vertex that splits draws one direction from every member, each with the weight of the
 * power heuristic (Veach 1997, exponent 2),
 *
 *     w_m = p_m^2/sum_j p_j^2,    step weight w_m f/p_m = f p_m/sum_j p_j^2,
 *
 * and a light sample competes with all of them, as with one density sqrt(sum_j p_j^2). */
#include "math/warp.h"
#include "step.h"

/* Shares at a vertex of material b. Directions that a guide knows are in front of it. */
static void shares_set(struct imp_step *s, const struct imp_bsdf *b)
{
    static const struct imp_mixing kernel = {
        .weight = {[IMP_DENSITY_KERNEL] = 1, [IMP_DENSITY_GUIDE] = -1}};
    const unsigned lobes =
        b->flags & (IMP_BSDF_SMOOTH | IMP_BSDF_DELTA | IMP_BSDF_TRANSMIT | IMP_BSDF_NULL);
    struct imp_mixed *m = &s->mixed;
    const struct imp_mixing *own =
        m->all && b->index >= 0 && !m->same ? s->scene->bsdf_mixing[b->index] : NULL;
    const struct imp_mixing *use = own ? own : m->all ? m->all : &kernel;
    const struct imp_aims *t = &s->scene->aims;
    const bool guided = s->guided.here && lobes == IMP_BSDF_SMOOTH;
    double sum = 0;
    for (int k = 0; k < IMP_DENSITIES; k++) m->share[k] = imp_max(use->weight[k], 0.0);
    m->sphere = (lobes & IMP_BSDF_TRANSMIT) != 0;
    if (m->share[IMP_DENSITY_EMITTERS] > 0) {
        m->strength[0] = imp__aims_sum(t, 0, t->n_lights, m->p);
        if (!(m->strength[0] > 0)) m->share[IMP_DENSITY_EMITTERS] = 0;
    }
    if (m->share[IMP_DENSITY_PROXIES] > 0) {
        m->strength[1] = imp__aims_sum(t, t->n_lights, t->n, m->p);
        if (!(m->strength[1] > 0)) m->share[IMP_DENSITY_PROXIES] = 0;
    }
    if (!guided) m->share[IMP_DENSITY_GUIDE] = 0;
    /* Only the kernel draws delta lobes. */
    if ((lobes & IMP_BSDF_DELTA) && m->share[IMP_DENSITY_KERNEL] == 0)
        m->share[IMP_DENSITY_KERNEL] = 1;
    for (int k = 0; k < IMP_DENSITIES; k++) sum += m->share[k];
    if (!(sum > 0)) m->share[IMP_DENSITY_KERNEL] = sum = 1;
    /* A guide without a weight takes its own share, and leaves the rest to the others. */
    double left = 1;
    if (guided && use->weight[IMP_DENSITY_GUIDE] < 0) left = 1 - s->guided.at.share;
    if (sum != left)
        for (int k = 0; k < IMP_DENSITIES; k++) m->share[k] *= left / sum;
    if (left != 1) m->share[IMP_DENSITY_GUIDE] = s->guided.at.share;
}

void imp__mixture_prepare(struct imp_step *s, const struct imp_bsdf *b, imp_v3 p)
{
    struct imp_mixed *m = &s->mixed;
    m->here = (b->flags & IMP_BSDF_SMOOTH) != 0;
    m->members = 0;
    m->only = -1;
    if (!m->here) return;
    m->p = p;
    shares_set(s, b);
    for (int k = 0; k < IMP_DENSITIES; k++) m->members += m->share[k] > 0;
    m->here = m->share[IMP_DENSITY_KERNEL] < 1;
}

/* ---- Densities ------------------------------------------------------------------- */

/* p [IMP_DENSITIES] of direction w, world, for which the BSDF alone has `kernel`; those
 * without a share are 0. */
static void densities(const struct imp_step *s, double kernel, imp_v3 w, double *p)
{
    const struct imp_mixed *m = &s->mixed;
    const double *share = m->share;
    for (int k = 0; k < IMP_DENSITIES; k++) p[k] = 0;
    p[IMP_DENSITY_KERNEL] = kernel;
    if (share[IMP_DENSITY_EMITTERS] > 0 || share[IMP_DENSITY_PROXIES] > 0) {
        const double sum[2] = {share[IMP_DENSITY_EMITTERS] > 0 ? m->strength[0] : 0,
                               share[IMP_DENSITY_PROXIES] > 0 ? m->strength[1] : 0};
        double aimed[2];
        imp__aims_pdf(&s->scene->aims, sum, m->p, w, aimed);
        p[IMP_DENSITY_EMITTERS] = aimed[0];
        p[IMP_DENSITY_PROXIES] = aimed[1];
    }
    if (share[IMP_DENSITY_ENVIRONMENT] > 0) {
        const int n = s->scene->n_environments;
        for (int k = 0; k < n; k++) {
            const struct imp_emitter *e = s->scene->emitters[s->scene->environments[k]];
            p[IMP_DENSITY_ENVIRONMENT] += e->ops->pdf(e, &m->p, &w, NULL, NULL) / n;
        }
    }
    if (share[IMP_DENSITY_GUIDE] > 0)
        p[IMP_DENSITY_GUIDE] = s->guided.guide->pdf(s->guided.guide, &s->guided.at, w);
    /* Where the kernel is not 0, w is on the side of wo unless light is transmitted. */
    if (share[IMP_DENSITY_UNIFORM] > 0)
        p[IMP_DENSITY_UNIFORM] = IMP_INV_PI / (m->sphere ? 4 : 2);
}

double imp__mixture_pdf(const struct imp_step *s, double kernel, imp_v3 w, int drawn,
                        int lobe, double *competing)
{
    const struct imp_mixed *m = &s->mixed;
    double p[IMP_DENSITIES], sum = 0;
    if (lobe != IMP_SMOOTH) { /* no other member draws it */
        const double pdf = m->only < 0 ? m->share[IMP_DENSITY_KERNEL] * kernel : kernel;
        return *competing = pdf;
    }
    densities(s, kernel, w, p);
    if (!m->splits) {
        for (int k = IMP_DENSITIES - 1; k >= 0; k--) sum += m->share[k] * p[k];
        return *competing = sum;
    }
    for (int k = 0; k < IMP_DENSITIES; k++)
        if (m->share[k] > 0) sum += p[k] * p[k];
    *competing = sqrt(sum);
    return drawn >= 0 && p[drawn] > 0 ? sum / p[drawn] : 0;
}

/* ---- Drawing --------------------------------------------------------------------- */

/* A point that is aimed at; u[0] chooses which. */
static bool aim_draw(const struct imp_step *s, int group, const double u[3], imp_v3 *w)
{
    const struct imp_mixed *m = &s->mixed;
    const struct imp_aims *t = &s->scene->aims;
    struct imp_light_sample ls;
    double chance;
    const int chosen =
        imp__aim_choose(t, group ? t->n_lights : 0, group ? t->n : t->n_lights,
                        m->strength[group], m->p, u[0], &chance);
    if (chosen < 0) return false;
    const struct imp_shape *shape = t->list[chosen].shape;
    if (!shape->ops->sample_toward(shape, &m->p, &u[1], &ls)) return false;
    *w = ls.wi;
    return true;
}

/* As the lane that draws would. */
static bool kernel_draw(const struct imp_step *s, const struct imp_bsdf *b,
                        const double u[3], struct imp_dirs *dirs)
{
    imp_spec own[IMP_INPUTS_MAX];
    if (imp_likely(!b->shaped)) return b->ops->sample(b, s->in, u, dirs);
    imp__shaped_inputs(b, s->in, imp__waves_drew(s->at.carried), own);
    return b->ops->sample(b, own, u, dirs);
}

/* A direction from member k; u[0] is uniform again. False: none. */
static bool member_draw(const struct imp_step *s, int k, const struct imp_bsdf *b,
                        const struct imp_frame *frame, const double u[3],
                        struct imp_dirs *dirs)
{
    imp_v3 w = {0};
    switch ((enum imp_density)k) {
    case IMP_DENSITY_EMITTERS:
    case IMP_DENSITY_PROXIES:
        if (!aim_draw(s, k == IMP_DENSITY_PROXIES, u, &w)) return false;
        break;
    case IMP_DENSITY_ENVIRONMENT: {
        const int n = s->scene->n_environments, one = (int)(u[0] * n);
        const struct imp_emitter *e = s->scene->emitters[s->scene->environments[one]];
        struct imp_light_sample ls;
        if (!e->ops->sample(e, &s->mixed.p, &u[1], &ls)) return false;
        w = ls.wi;
        break;
    }
    case IMP_DENSITY_GUIDE:
        w = s->guided.guide->draw(s->guided.guide, &s->guided.at, &u[1]);
        break;
    case IMP_DENSITY_UNIFORM:
        dirs->wi = imp__uniform_sphere(&u[1]);
        if (!s->mixed.sphere) dirs->wi[2] = copysign(dirs->wi[2], dirs->wo[2]);
        return true;
    case IMP_DENSITY_KERNEL:
    case IMP_DENSITIES: return kernel_draw(s, b, u, dirs);
    }
    dirs->wi = imp__to_local(frame, w);
    return true;
}

bool imp__mixture_draw(const struct imp_step *s, const struct imp_bsdf *b,
                       const struct imp_frame *frame, const double u[3],
                       struct imp_dirs *dirs, int *drawn)
{
    const struct imp_mixed *m = &s->mixed;
    if (!m->here) return kernel_draw(s, b, u, dirs);
    if (m->only >= 0) {
        *drawn = m->only;
        return member_draw(s, m->only, b, frame, u, dirs);
    }
    /* u[0] chooses the member, the kernel last, and what is left of it is uniform. */
    double before = 0;
    int k = IMP_DENSITIES - 1;
    while (k > 0 && !(u[0] < before + m->share[k])) before += m->share[k--];
    *drawn = k;
    const double width = k > 0 ? m->share[k] : 1 - before;
    const double rest[3] = {imp_min((u[0] - before) / width, 0x1.fffffffffffffp-1), u[1],
                            u[2]};
    return member_draw(s, k, b, frame, rest, dirs);
}
