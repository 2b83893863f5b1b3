/* SPDX-License-Identifier: Apache-2.0
 *
 * Quadrature over visible normals m. A normal of slopes alpha (x, y) is seen from w with
 * weight P(x, y) (mu - sin alpha x), where that is positive; P is the distribution of
 * slopes at alpha = 1. Coordinates are chosen so that the weight is smooth up to its end:
 *
 *   Beckmann   exp(-x^2) exp(-y^2)/pi on x < mu/(sin alpha)
 *   GGX        x = tan(chi), y = tan(psi)/cos(chi):   cos(chi) cos^2(psi) dchi dpsi
 *
 * and Gauss-Legendre does the rest. The weights' own sum normalises. Where total reflection
 * begins, w.m = c, Fresnel's reflectance has a vertical tangent: there the rules are cut,
 * and their nodes cluster. So the sums are smooth in alpha and eta, and the derivatives of
 * the sums are those of the means. */
#include "coat.h"
#include "fresnel.h"
#include "math/quadrature.h"

enum { NX = 20, NY = 14, CUTS = 6 };
#define BECKMANN_REACH 4.8 /* slopes beyond: 1e-11 of them */

static imp__dual constant(double v) { return (imp__dual){v, 0, 0, 0}; }
static imp__dual product(imp__dual a, imp__dual b)
{
    imp__dual r = a * b[0] + b * a[0];
    r[0] = a[0] * b[0];
    return r;
}
/* f(a), of which value and slope are known. */
static imp__dual chain(imp__dual a, double f, double slope)
{
    imp__dual r = a * slope;
    r[0] = f;
    return r;
}
static imp__dual root(imp__dual a)
{
    const double r = sqrt(imp_max(a[0], 0));
    return chain(a, r, r > 0 ? 0.5 / r : 0);
}
static imp__dual inverse(imp__dual a) { return chain(a, 1 / a[0], -1 / (a[0] * a[0])); }

/* G1 of a direction with cosine z > 0 (isotropic). */
static imp__dual masking(enum imp__distribution type, imp__dual alpha, imp__dual z)
{
    const struct imp__microfacet f = {type, true, alpha[0], alpha[0], 0};
    const double s2 = imp_max(1 - z[0] * z[0], 0);
    const imp_v3 v = imp__v3(sqrt(s2), 0, z[0]);
    double d[2];
    const double g = imp__microfacet_g1(&f, &v, d);
    if (!(g < 1)) return constant(1); /* Beckmann's fit jumps by 6e-5 at its end */
    /* G1 depends on t2 = alpha^2 (1 - z^2)/z^2; d[0] is its derivative by alpha. */
    const double dz = s2 > 0 ? -d[0] * alpha[0] / (z[0] * s2) : 0;
    imp__dual r = alpha * d[0] + z * dz;
    r[0] = g;
    return r;
}

struct sight {
    enum imp__distribution type;
    double mu, sine;
    imp__dual alpha, e; /* e: index on the far side over the near side */
    bool back;          /* what comes back is wanted, else what passes */
    imp__dual c2;       /* squared cosine of total reflection; <= 0: there is none */
};

/* One facet: weight, and what passes and what comes back. h: along its normal. */
static void facet_add(const struct sight *s, const imp__dual h[3], imp__dual weight,
                      imp__dual sum[2])
{
    const imp__dual inv =
        inverse(root(product(h[0], h[0]) + product(h[1], h[1]) + product(h[2], h[2])));
    const imp__dual mx = product(h[0], inv), mz = product(h[2], inv);
    const imp__dual c = mx * s->sine + mz * s->mu;
    sum[0] += weight;
    if (!(c[0] > 0)) return;
    double F_c, F_e;
    const double value = imp__fresnel_dielectric_d(imp_min(c[0], 1), s->e[0], &F_c, &F_e);
    imp__dual F = c * F_c + s->e * F_e;
    F[0] = value;

    if (s->back) {
        const imp__dual up = product(mz, c) * 2 - constant(s->mu); /* reflected */
        if (up[0] > 0)
            sum[1] += product(weight, product(F, masking(s->type, s->alpha, up)));
        return;
    }
    const imp__dual inv_e = inverse(s->e);
    const imp__dual ct2 =
        constant(1) - product(product(inv_e, inv_e), constant(1) - product(c, c));
    if (!(ct2[0] > 0)) return;
    const imp__dual down = product(mz, root(ct2) - product(c, inv_e)) + inv_e * s->mu;
    if (down[0] > 0)
        sum[1] +=
            product(weight, product(constant(1) - F, masking(s->type, s->alpha, down)));
}

/* x in units of alpha, or the angle chi of GGX. */
static imp__dual coordinate(const struct sight *s, imp__dual X)
{
    const imp__dual x = product(X, inverse(s->alpha));
    if (s->type != IMP_GGX) return x;
    return chain(x, atan(x[0]), 1 / (1 + x[0] * x[0]));
}

/* The slopes X with A X^2 - 2 B X + C = 0, among the cuts in rising order. */
static int roots_add(const struct sight *s, imp__dual A, imp__dual B, imp__dual C,
                     double reach, double end, imp__dual *cut, int n)
{
    const imp__dual disc = product(B, B) - product(A, C);
    if (!(disc[0] > 0)) return n;
    const imp__dual r = root(disc), q = B[0] < 0 ? B - r : B + r;
    const imp__dual X[2] = {product(C, inverse(q)), product(q, inverse(A))};
    for (int k = 0; k < 2; k++) {
        const imp__dual x = coordinate(s, X[k]);
        int at = n;
        if (!(x[0] > -reach && x[0] < end)) continue;
        for (; at > 1 && cut[at - 1][0] > x[0]; at--) cut[at] = cut[at - 1];
        cut[at] = x;
        n++;
    }
    return n;
}

/* Ends of the pieces of x at this y (of GGX: psi). With slopes X, Y, and Y^2 = K - 1 + M
 * X^2 - X^2,
 *
 *   w.m = (mu - sin X)/sqrt(K + M X^2)                                                */
static int pieces(const struct sight *s, imp__dual y, double reach, imp__dual cut[CUTS])
{
    const double mu = s->mu, sine = s->sine, tangent = tan(y[0]);
    const imp__dual t = s->type == IMP_GGX ? chain(y, tangent, 1 + tangent * tangent) : y;
    const imp__dual t2 = product(t, t), a2 = product(s->alpha, s->alpha);
    const imp__dual K = constant(1) + product(a2, t2),
                    M = s->type == IMP_GGX ? constant(1) + t2 : constant(1);
    int n = 0;
    cut[n++] = constant(-reach);
    imp__dual end = constant(reach); /* or w.m = 0 */
    if (sine > 0) {
        const imp__dual x = coordinate(s, constant(mu / sine));
        if (x[0] < reach) end = x;
    }
    /* (sin^2 - c^2 M) X^2 - 2 mu sin X + mu^2 - c^2 K = 0, where mu - sin X > 0 */
    if (s->c2[0] > 0)
        n = roots_add(s, constant(sine * sine) - product(s->c2, M), constant(mu * sine),
                      constant(mu * mu) - product(s->c2, K), reach, end[0], cut, n);
    /* The mirror direction at the horizon: mu M X^2 + 2 sin X + mu (K - 2) = 0 */
    if (s->back)
        n = roots_add(s, M * mu, constant(-sine), (K - constant(2)) * mu, reach, end[0],
                      cut, n);
    cut[n++] = end;
    return n;
}

/* The y beyond which w.m never reaches c: max w.m = sqrt(mu^2/K + sin^2/M). */
static imp__dual last_y(const struct sight *s, double reach)
{
    const double mu2 = s->mu * s->mu, s2 = s->sine * s->sine;
    const imp__dual c2 = s->c2, a2 = product(s->alpha, s->alpha);
    if (!(c2[0] > 0)) return constant(reach);
    if (s->type == IMP_GGX) { /* a quadratic in tan^2(psi), with one positive root */
        const imp__dual b = product(c2, constant(1) + a2) - constant(mu2) - a2 * s2;
        const imp__dual rest = constant(1) - c2, a = product(c2, a2);
        const imp__dual q = root(product(b, b) + product(a, rest) * 4);
        const imp__dual tangent = root(b[0] > 0 ? product(rest * 2, inverse(b + q))
                                                : product(q - b, inverse(a * 2)));
        return chain(tangent, atan(tangent[0]), 1 / (1 + tangent[0] * tangent[0]));
    }
    if (!(c2[0] > s2)) return constant(reach);
    const imp__dual Y2 = inverse(c2 - constant(s2)) * mu2 - constant(1);
    const imp__dual y = product(root(Y2), inverse(s->alpha));
    return y[0] < reach ? y : constant(reach);
}

/* All facets with this y, or psi. */
static void strip_add(const struct sight *s, imp__dual y, imp__dual dy, double reach,
                      const double *node, const double *share, imp__dual sum[2])
{
    imp__dual cut[CUTS];
    const bool ggx = s->type == IMP_GGX;
    const int n = pieces(s, y, reach, cut);
    const double c = cos(y[0]), z = sin(y[0]), gy = exp(-y[0] * y[0]);
    const imp__dual cp = chain(y, c, -z), sp = chain(y, z, c);
    const imp__dual weight_y =
        product(dy, ggx ? product(cp, cp) : chain(y, gy, -2 * y[0] * gy));
    const imp__dual h_y = product(s->alpha, ggx ? sp : y) * -1.0;
    for (int p = 0; p + 1 < n; p++)
        for (int i = 0; i < NX; i++) {
            const double t = node[i];
            const imp__dual width = cut[p + 1] - cut[p];
            const imp__dual x = cut[p] + width * (s->c2[0] > 0 ? t * t * (3 - 2 * t) : t);
            const imp__dual dx =
                width * (share[i] * (s->c2[0] > 0 ? 6 * t * (1 - t) : 1));
            imp__dual slope, weight, up, h[3];
            if (ggx) {
                const double cx = cos(x[0]), sx = sin(x[0]);
                up = chain(x, cx, -sx);
                slope = product(s->alpha, chain(x, sx, cx));
                weight = dx;
                h[0] = product(slope, cp) * -1.0;
                h[2] = product(up, cp);
            } else {
                const double g = exp(-x[0] * x[0]);
                up = constant(1);
                slope = product(s->alpha, x);
                weight = product(dx, chain(x, g, -2 * x[0] * g));
                h[0] = -slope;
                h[2] = up;
            }
            h[1] = h_y;
            const imp__dual seen = up * s->mu - slope * s->sine;
            facet_add(s, h, product(product(weight, seen), weight_y), sum);
        }
}

/* Gauss-Legendre on [0, 1]. */
struct rules {
    double x[NX], dx[NX], y[NY], dy[NY];
};

/* Mean over the facets seen at mu of what passes, or what comes back. */
static imp__dual mean(const struct rules *rules, enum imp__distribution type, double mu,
                      imp__dual alpha, imp__dual e, bool back)
{
    const struct sight s = {type, mu,   sqrt(imp_max(0, 1 - mu * mu)), alpha,
                            e,    back, constant(1) - product(e, e)};
    const double reach = type == IMP_GGX ? IMP_PI / 2 : BECKMANN_REACH;
    const imp__dual middle = last_y(&s, reach), end[3] = {{0}, middle, constant(reach)};
    imp__dual sum[2] = {{0}, {0}};
    for (int part = 0; part < (middle[0] < reach ? 2 : 1); part++) {
        const imp__dual width = end[part + 1] - end[part];
        for (int j = 0; j < NY; j++)
            strip_add(&s, end[part] + width * rules->y[j], width * rules->dy[j], reach,
                      rules->x, rules->dx, sum);
    }
    return product(sum[1], inverse(sum[0]));
}

void imp__coat_make(struct imp__coat *c, enum imp__distribution type, double alpha,
                    double eta)
{
    if (c->alpha == alpha && c->eta == eta && c->type == type) return;
    *c = (struct imp__coat){.type = type, .alpha = alpha, .eta = eta};
    const imp__dual a = {alpha, 1, 0, 0}, e = {eta, 0, 1, 0};
    struct rules rules;
    imp__gauss_legendre(NX, 0, 1, rules.x, rules.dx);
    imp__gauss_legendre(NY, 0, 1, rules.y, rules.dy);
    for (int k = 0; k < IMP_COAT_NODES; k++) {
        const double mu = imp_max(1e-6, k / (IMP_COAT_NODES - 1.));
        c->T[k] = mean(&rules, type, mu, a, e, false);
        c->R_int +=
            mean(&rules, type, mu, a, inverse(e), true) * (2 * mu / IMP_COAT_NODES);
    }
}

imp__dual imp__coat_T(const struct imp__coat *c, double mu)
{
    const double x = imp_clamp(mu, 0, 1) * (IMP_COAT_NODES - 1);
    const int k = imp_min((int)x, IMP_COAT_NODES - 2);
    return c->T[k] + (c->T[k + 1] - c->T[k]) * (x - k);
}

imp__dual imp__coat_T_slope(const struct imp__coat *c, double mu)
{
    const double x = imp_clamp(mu, 0, 1) * (IMP_COAT_NODES - 1);
    const int k = imp_min((int)x, IMP_COAT_NODES - 2);
    return (c->T[k + 1] - c->T[k]) * (IMP_COAT_NODES - 1);
}
