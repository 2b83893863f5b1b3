/* SPDX-License-Identifier: Apache-2.0
 *
 * Decisions as records keep them: words of 32 bits, of which those that say nothing are left
 * out. A vertex without emission that was met has none of it; a survival, a share or a
 * transmittance that is 1 everywhere takes no room; neither do coordinates on a shape that are
 * its uv. A vertex with a light sample, on a mesh without texture coordinates, is 32 words.
 *
 *     2  struct imp_packed_head          1  prim, 2  at             if located
 *     5  uv, p                           1  place                   if placed
 *     3  wo       unless at the sky      7  met                     if met
 *     5  wi, pdf, survive  if goes_on   15  light without located   if lit
 *     2  share, rest       if mixed      1  prim, 2  at             if lit_located
 *     2  passes, glow_weight  if rare                                               */
#ifndef IMP_WALK_PACKED_H
#define IMP_WALK_PACKED_H

#include "walk/core/decision.h"
#include <stddef.h>
#include <string.h>

enum imp_packed_located {
    IMP_LOCATED_NOWHERE, /* prim -1 */
    IMP_LOCATED_UV,      /* prim 0, at uv */
    IMP_LOCATED_PRIM_UV, /* at uv */
    IMP_LOCATED_WHOLE
};

struct imp_packed_head {
    int32_t shape;
    uint32_t scatterer : 3, connection : 2, drawn : 3, glows : 1, goes_on : 1, alone : 1,
        back : 1, located : 2, placed : 1, mixed : 1, rare : 1, met : 1, lit : 1,
        lit_located : 2, unused : 3, lobe : 8;
};
_Static_assert(sizeof(struct imp_packed_head) == 8, "it is written");

enum {
    IMP_PACKED_MET = 7,
    IMP_PACKED_LIGHT = 15,
    IMP_PACKED_MOST =
        2 + 5 + 3 + 5 + 3 + 1 + 2 + 2 + IMP_PACKED_MET + IMP_PACKED_LIGHT + 3
};
_Static_assert(sizeof(struct imp_met) == 4 * IMP_PACKED_MET, "no padding");
_Static_assert(offsetof(struct imp_light, located) == 4 * IMP_PACKED_LIGHT, "no padding");

/* Words of a point on a shape. */
static inline size_t imp__packed_located(unsigned kind)
{
    return (kind >= IMP_LOCATED_PRIM_UV) + 2 * (size_t)(kind == IMP_LOCATED_WHOLE);
}

/* Words of a decision with this head. */
static inline size_t imp__packed_words(const struct imp_packed_head *h)
{
    return 2 + 5 + 3 * (size_t)(h->scatterer != IMP_AT_SKY) + 5 * (size_t)h->goes_on +
           imp__packed_located(h->located) + h->placed + 2 * (size_t)h->mixed +
           2 * (size_t)h->rare + IMP_PACKED_MET * (size_t)h->met +
           h->lit * (IMP_PACKED_LIGHT + imp__packed_located(h->lit_located));
}

/* What is kept of a decision. */
struct imp_packed_head imp__packed_head(const struct imp_decision *d);
/* words [IMP_PACKED_MOST]; returns how many there are. */
size_t imp__packed_put(const struct imp_decision *d, uint32_t *words);

/* Members that are packed together begin at this one. */
#define IMP_PACKED_FROM(d, member) ((char *)(d) + offsetof(struct imp_decision, member))

/* n words more, to `out`. */
static inline const uint32_t *imp__packed_take(const uint32_t *words, void *out, size_t n)
{
    memcpy(out, words, 4 * n);
    return words + n;
}
static inline const uint32_t *imp__packed_located_take(const uint32_t *words,
                                                       unsigned kind,
                                                       const imp_decided uv[2],
                                                       struct imp_located *x)
{
    if (kind == IMP_LOCATED_NOWHERE) {
        *x = (struct imp_located){.prim = -1};
        return words;
    }
    x->prim = 0;
    memcpy(x->at, uv, sizeof x->at);
    if (kind >= IMP_LOCATED_PRIM_UV) words = imp__packed_take(words, &x->prim, 1);
    if (kind == IMP_LOCATED_WHOLE) words = imp__packed_take(words, x->at, 2);
    return words;
}

/* Where a decision lies and goes on: all of it but the instance, what was met and the light
 * sample. Returns the words that follow. */
static inline const uint32_t *imp__packed_step(const uint32_t *words,
                                               struct imp_packed_head *head,
                                               struct imp_decision *d)
{
    struct imp_packed_head h;
    words = imp__packed_take(words, &h, 2);
    d->shape = h.shape;
    d->scatterer = h.scatterer;
    d->connection = h.connection & 3;
    d->drawn = h.drawn & 7;
    d->glows = h.glows;
    d->goes_on = h.goes_on;
    d->fixed = d->from_light = false;
    d->alone = h.alone;
    d->back = h.back;
    d->lobe = (int8_t)h.lobe;
    words = imp__packed_take(words, IMP_PACKED_FROM(d, uv), 5);
    if (imp_likely(h.scatterer != IMP_AT_SKY)) words = imp__packed_take(words, d->wo, 3);
    else memset(d->wo, 0, sizeof d->wo);
    if (h.goes_on) words = imp__packed_take(words, IMP_PACKED_FROM(d, wi), 5);
    else memset(IMP_PACKED_FROM(d, wi), 0, 5 * sizeof(imp_decided));
    d->share = h.goes_on;
    d->rest = 0;
    if (imp_unlikely(h.mixed))
        words = imp__packed_take(words, IMP_PACKED_FROM(d, share), 2);
    d->passes = d->glow_weight = 1;
    if (imp_unlikely(h.rare))
        words = imp__packed_take(words, IMP_PACKED_FROM(d, passes), 2);
    *head = h;
    return imp__packed_located_take(words, h.located, d->uv, &d->located);
}

/* The decision again; what was left out is 0, or 1 or -1 where it was that. */
static inline void imp__packed_get(const uint32_t *words, struct imp_decision *d)
{
    struct imp_packed_head h;
    words = imp__packed_step(words, &h, d);
    d->place = 0;
    if (imp_unlikely(h.placed)) words = imp__packed_take(words, &d->place, 1);
    if (h.met) {
        words = imp__packed_take(words, &d->met, IMP_PACKED_MET);
    } else {
        memset(&d->met, 0, sizeof d->met);
        d->met.emitter = -1;
    }
    if (h.lit) {
        words = imp__packed_take(words, &d->light, IMP_PACKED_LIGHT);
        imp__packed_located_take(words, h.lit_located, d->light.uv, &d->light.located);
    } else {
        memset(&d->light, 0, sizeof d->light);
        d->light.emitter = d->light.located.prim = -1;
    }
}

/* Members that are packed together follow each other. */
_Static_assert(
    offsetof(struct imp_decision, p) == offsetof(struct imp_decision, uv) + 8 &&
        offsetof(struct imp_decision, pdf) == offsetof(struct imp_decision, wi) + 12 &&
        offsetof(struct imp_decision, survive) ==
            offsetof(struct imp_decision, pdf) + 4 &&
        offsetof(struct imp_decision, rest) == offsetof(struct imp_decision, share) + 4 &&
        offsetof(struct imp_decision, glow_weight) ==
            offsetof(struct imp_decision, passes) + 4,
    "struct imp_decision");

#endif
