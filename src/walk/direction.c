/* SPDX-License-Identifier: Apache-2.0
 *
 * How the direction of a continuation is drawn: from a mixture of densities, each with a
 * share,
 *
 *     p(w) = sum_m share_m p_m(w),    sum_m share_m = 1.
 *
 * One member draws; all densities are evaluated, whichever drew, so the mixture is
 * unbiased as long as one of them covers the kernel. The kernel itself (the BSDF's own
 * sampling) is always a member, with the share that the others leave. */
#include "step.h"

/* A member of the mixture besides the kernel; directions in world coordinates. */
struct member {
    double share; /* 0: it knows nothing here */
    imp_v3 (*draw)(const struct imp_step *s, const double u[2]);
    double (*pdf)(const struct imp_step *s, imp_v3 w);
};

static imp_v3 guide_draw(const struct imp_step *s, const double u[2])
{
    return s->guided.guide->draw(s->guided.guide, &s->guided.at, u);
}
static double guide_pdf(const struct imp_step *s, imp_v3 w)
{
    return s->guided.guide->pdf(s->guided.guide, &s->guided.at, w);
}

#define MEMBERS_MAX 1

/* The members that take part at a vertex with this BSDF. Their directions are in front of
 * it, and a delta lobe has no density to mix with. */
static int members(const struct imp_step *s, const struct imp_bsdf *b,
                   struct member m[MEMBERS_MAX])
{
    const unsigned lobes =
        b->flags & (IMP_BSDF_SMOOTH | IMP_BSDF_DELTA | IMP_BSDF_TRANSMIT | IMP_BSDF_NULL);
    int n = 0;
    if (lobes != IMP_BSDF_SMOOTH) return 0;
    if (s->guided.here && s->guided.at.share > 0)
        m[n++] = (struct member){s->guided.at.share, guide_draw, guide_pdf};
    return n;
}

static double mixture_pdf(const struct imp_step *s, const struct member *m, int n,
                          double kernel, imp_v3 w)
{
    double left = 1, sum = 0;
    for (int i = 0; i < n; i++) {
        left -= m[i].share;
        sum += m[i].share * m[i].pdf(s, w);
    }
    return left * kernel + sum;
}

double imp__mixture_pdf(const struct imp_step *s, const struct imp_bsdf *b, double kernel,
                        imp_v3 w)
{
    struct member m[MEMBERS_MAX];
    const int n = members(s, b, m);
    return n ? mixture_pdf(s, m, n, kernel, w) : kernel;
}

bool imp__mixture_draw(const struct imp_step *s, const struct imp_bsdf *b,
                       const struct imp_frame *frame, const double u[3],
                       struct imp_dirs *dirs)
{
    struct member m[MEMBERS_MAX];
    const int n = members(s, b, m);
    if (n == 0) return b->ops->sample(b, s->in, u, dirs);

    /* u[0] chooses the member, and what is left of it the kernel's lobe. */
    double before = 0;
    int chosen = 0;
    while (chosen < n && !(u[0] < before + m[chosen].share)) before += m[chosen++].share;
    if (chosen < n) {
        dirs->wi = imp__to_local(frame, m[chosen].draw(s, &u[1]));
        return true;
    }
    const double lobe = (u[0] - before) / (1 - before);
    const double rest[3] = {fmin(lobe, 0x1.fffffffffffffp-1), u[1], u[2]};
    return b->ops->sample(b, s->in, rest, dirs);
}
