/* SPDX-License-Identifier: Apache-2.0
 *
 * A free flight through media while it is decided (tracking.h lists its events
 * are).
 *
 * With headroom h > 1, so that recorded walks can be evaluated where extinctions are larger,
 * tentative collisions are drawn under b' = max(h b, (h - 1) e), e an eighth of the largest
 * bound or one over the size of the box, and are real with the probability max(sigma/b',
 * 1/10) of a lane. Then there is a density wherever 0 <= sigma <= b', also where sigma is
 * 0, and the value of a flight is no longer its density. So it is where things move, whose derivatives have
 * the slope of the extinction over the density of a collision (moved/moved_sweep.c), with h next to 1 and
 * 1/1000 in place of 1/10 (imp__real_least). */
#ifndef IMP_WALK_FLIGHT_H
#define IMP_WALK_FLIGHT_H

#include "tracking.h"

/* A ray through media, from its start. */
struct imp_free_flight {
    struct imp_step *s;
    struct imp_key key; /* of its own random numbers */
    uint32_t n;         /* of them used */
    imp_v3 o, d;        /* as decided: where extinction is looked up */
    imp_spec f;         /* the segment's value */
    imp_spec p; /* its density; that is the value, too, unless there is headroom */
    struct imp_track *track; /* NULL: not kept */
    bool any;                /* it has crossed a medium */
    bool open;               /* no surface ends the stretch at work */
    struct imp_event line;   /* IMP_LINE_AT so far; bound 0: none */
    double length;           /* of the stretches that it was chosen from */
    double control;          /* optical depth of controls on the way */
    /* The next stretch, where it is looked at before it is flown through: */
    const struct imp_medium *ahead; /* its medium; NULL: not looked at */
    imp_spec sigma;                 /* its extinction */
    double path;                    /* optical depth to the collision */
};

/* Streams of random numbers of a vertex. */
enum { IMP_FLIGHT_ALONG = 0x7001, IMP_FLIGHT_TO_LIGHT, IMP_FLIGHT_LINE };

struct imp_free_flight imp__flight_from(struct imp_step *s, imp_v3 o, imp_v3 d,
                                        int stream);
/* Keep an event where the walk is recorded. False: no memory. */
bool imp__flight_event(struct imp_free_flight *w, struct imp_event e);
#define IMP_REACH_SLACK 1e-5 /* of a distance; that of float is 6e-8 */
/* How far from the start a surface can lie and change the flight through m from near on, with
 * room for the rounding of rays; INFINITY: any distance. It looks at the number that imp__fly then
 * has, so that a ray need not look behind the collision. */
double imp__flight_reach(struct imp_free_flight *w, const struct imp_medium *m,
                         double near);
/* From near to far in a medium; true: a collision at *t. */
bool imp__fly(struct imp_free_flight *w, const struct imp_medium *m, double near,
              double far, bool collides, double *t);
/* At a light sample: controls are taken into account, and the point of the way that was
 * chosen, if any, is kept. False: no memory. */
bool imp__flight_end(struct imp_free_flight *w);

#endif
