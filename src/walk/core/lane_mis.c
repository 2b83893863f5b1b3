/* SPDX-License-Identifier: Apache-2.0
 *
 * Shares of lanes in a walk that one of them drew (lane_mis.h). */
#include "step.h"

int imp__lane_mis_count(const struct imp_step *s)
{
    return s->at.carried ? s->at.carried->n : s->scene->channels;
}

int imp__lane_mis_drew(struct imp_step *s)
{
    struct imp_lane_mis *l = &s->lanes;
    /* Wavelengths that the walk has chosen: its branches, and what follows a meter, have
     * other keys. */
    if (l->drew < 0)
        l->drew = s->at.carried ? imp__waves_drew(s->at.carried)
                                : imp__lane_drawn(s->walk->key, imp__lane_mis_count(s));
    return l->drew;
}

double imp__lane_mis_decide(struct imp_step *s, imp_spec p)
{
    struct imp_lane_mis *l = &s->lanes;
    const int n = imp__lane_mis_count(s);
    double sum = 0;
    bool certain = true; /* as what meets nothing is */
    for (int j = 0; j < n; j++) certain &= p[j] == 1;
    if (certain) return 1;
    const int drew = imp__lane_mis_drew(s);
    l->ratio *= p * (1 / p[drew]);
    l->ratio[drew] = 1;
    for (int j = 0; j < n; j++) sum += l->ratio[j];
    const double before = l->weight;
    l->weight = n / sum;
    return imp__decide1(l->weight / (before * p[drew]));
}

double imp__lane_mis_density(const struct imp_step *s, imp_spec p)
{
    const struct imp_lane_mis *l = &s->lanes;
    const int n = imp__lane_mis_count(s);
    double sum = 0;
    for (int j = 0; j < n; j++) sum += l->ratio[j] * p[j];
    return sum * l->weight / n;
}
