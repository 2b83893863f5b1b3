/* SPDX-License-Identifier: Apache-2.0
 *
 * importon: which luminaires of a room are used, and how far they are dimmed, so that what is
 * wanted of its grids holds with the fewest watts. Light adds up: walks with one lamp at a
 * time give what every combination makes, and the best of all combinations is found by branch and
 * bound, with a proof. Errors of the walks are margins, and fresh walks judge the answer.
 * docs/design.md. Same conventions as importon.h.
 */
#ifndef IMPORTON_DESIGN_H
#define IMPORTON_DESIGN_H

#include <importon/importon.h>

#ifdef __cplusplus
extern "C" {
#endif

/** A lamp that may be used: an emitter of the scene, of which level 1 is the output that it has
 * there. All other emitters shine as they are. */
struct imp_design_lamp {
    size_t size;
    const char *lamp; /**< name of the emitter (imp_plan_lamp) */
    /** At most one lamp of a place is used; NULL: it has a place of its own. */
    const char *place;
    bool needed;  /**< one lamp of its place is used */
    double watts; /**< at level 1; 0: by its photometric file, times its present level */
    double cost;  /**< of using it, at any level */
    /** Levels when it is used, 0 < least <= most <= 1; 0: .1 and 1. Equal ones: on or off. */
    double least, most;
};
#define IMP_DESIGN_LAMP_INIT IMP_INIT_ZERO(struct imp_design_lamp)

/** What a grid (an irradiancemeter, rooms.h) shall have. */
enum imp_design_want_of {
    IMP_WANT_AVERAGE = 0,    /**< at least, in the sensor's unit */
    IMP_WANT_MINIMUM = 1,    /**< at each point at least */
    IMP_WANT_MAXIMUM = 2,    /**< at each point at most */
    IMP_WANT_UNIFORMITY = 3, /**< each point over the average at least, in (0, 1) */
    IMP_WANT_UGR = 4         /**< unified glare rating of each observer at most
                                  (imp_grid_glare) */
};
struct imp_design_want {
    size_t size;
    int sensor;
    enum imp_design_want_of of;
    double value;
};
#define IMP_DESIGN_WANT_INIT IMP_INIT_ZERO(struct imp_design_want)

/** A number of the scene's geometry that may change: where a lamp is, or where it looks. */
struct imp_design_move {
    size_t size;
    /** "LAMP.position", "LAMP.direction" or "SHAPE.pose" (imp_scene_add_geometry). */
    const char *name;
    int component; /**< which of its numbers, from 0 */
    /** Bounds, in its unit, with its present value between them. Both 0: of a place, or of the box of
     * a shape with a pose, the box of all shapes less options.clearance; of a component of a
     * direction -1 and 1, or its present value's size; of a turn .5 rad to both sides. */
    double lo, hi;
};
#define IMP_DESIGN_MOVE_INIT IMP_INIT_ZERO(struct imp_design_move)

enum imp_design_least {
    IMP_LEAST_WATTS = 0, /**< sum of watts times level */
    IMP_LEAST_FLUX = 1,  /**< sum of flux times level; all lamps are luminaires */
    IMP_LEAST_COST =
        2 /**< sum of the costs of those used; of equal ones the fewest watts */
};

struct imp_design_options {
    size_t size;
    enum imp_design_least least;
    double confidence; /**< with which all that is wanted holds, in (0, 1); 0: .95 */
    int rounds;        /**< of fresh walks, after each of which margins grow; 0: 4 */
    int others;        /**< other sets of lamps to be listed, at most; 0: none */
    double within; /**< of their objective above the answer's, as a part of it; 0: .05 */
    int64_t nodes; /**< branches of a search, at most; 0: 20000 */
    double clearance; /**< of what moves, from the box of all shapes: scene units, >= 0 */
    int steps;        /**< of a search for places, at most; 0: 60 */
    int starts; /**< searches for places: the first from the present ones, others from
                     places drawn within the bounds by the run's seed; at most 1000; 0: 1 */
};
#define IMP_DESIGN_OPTIONS_INIT IMP_INIT_ZERO(struct imp_design_options)

/** A want, and what the answer has of it, by fresh walks. */
struct imp_design_finding {
    size_t size;
    double wanted;
    double value; /**< without an answer: as `alone` */
    /** The bound that holds with the confidence asked for: the least value that it may have, of a
     * maximum and of UGR the largest. */
    double sure;
    bool holds;   /**< `sure` is on the right side of what is wanted */
    bool binding; /**< a little less wanted were cheaper */
    double price; /**< d objective / d wanted, with the same lamps; 0 of costs */
    /** Without an answer: the best value that it can have while all other wants hold; NAN: with
     * the others there is none, or a search ended after options.nodes. */
    double attainable;
    double alone; /**< the same without the other wants */
    size_t at;    /**< point or observer where `sure` is taken; 0 of an average */
};

struct imp_design_answer {
    size_t size;
    bool found; /**< some combination has what is wanted, with the margins */
    bool holds; /**< and by fresh walks each want does, with the confidence */
    /** The search ended by itself: nothing has a smaller objective, or nothing has what is wanted. Else
     * it ended after options.nodes. */
    bool proven;
    double objective;
    double
        bound; /**< none has less than this: equal to the objective where the search ended */
    /** One standard error of the objective, at most: what errors of the walks make of it. */
    double objective_se;
    /** How much of it is margin for the errors of the walks; more samples save up to that. */
    double margin;
    double watts, flux, cost; /**< of the answer; flux in lm, of luminaires */
    int rounds;               /**< that were needed */
    int64_t nodes;            /**< branches that were searched */
    size_t n_lamps;
    const double
        *level; /**< [n_lamps] in the order in which they were given; 0: not used */
    const double *lamp_watts, *lamp_flux; /**< [n_lamps] at level 1 */
    size_t n_wants;
    const struct imp_design_finding *wants; /**< [n_wants] in the order in which they were
                                                 given (IMP_ROW) */
    size_t n_others;
    const double *other_objective; /**< [n_others] the least first */
    const double *other_level;     /**< [n_others][n_lamps] */
    size_t n_moves;
    const double *moved_from,
        *moved_to; /**< [n_moves] in the order in which they were given */
    int steps;     /**< that were taken from there to here */
    size_t n_starts;
    /** [n_starts] the objective at the end of the search from each start, before fresh walks;
     * INFINITY: nothing there has what is wanted, or the start was no scene. */
    const double *start_objective;
    const double *start_place; /**< [n_starts][n_moves] where it ended */
    size_t start; /**< the one whose places the answer has; n_starts: the first places
                       are better than all */
};

/** Is `value` on the right side of what is wanted? A bound that is met exactly holds; rounding is
 * up to a part of 1e-6. */
static inline bool imp_design_enough(enum imp_design_want_of of, double value,
                                     double wanted)
{
    const double rounding = 1e-6 * (wanted < 0 ? -wanted : wanted);
    return of == IMP_WANT_MAXIMUM || of == IMP_WANT_UGR ? value <= wanted + rounding
                                                        : value >= wanted - rounding;
}

typedef struct imp_design imp_design;

/**
 * Find the best combination, and check it.
 *
 * The reading of point i of a grid is b_i + sum_j a_ij x_j, x_j the level of lamp j, with an
 * error for each a_ij. In the search each want holds with a margin of 4 of its standard errors, as
 * a function of x: a glare limit, too, is a convex constraint, c L_b(x) - sum q_j x_j^2 >= 0
 * with c = 4 10^(UGR/8). Fresh walks through the answer then give one-sided bounds of each want,
 * whose joint confidence needs no correction (all must hold; Berger 1982); rounds share the
 * risk, halved each time.
 * @param lamps  [n_lamps] at least 1.
 * @param wants  [n_wants] at least 1.
 * @param options NULL for defaults.
 * @param run    samples of each reading with one lamp, seed, points and the end of the
 *               walks; its sensor is ignored. NULL for defaults.
 * @param[out] out to be destroyed before the scene. There is one without an answer, too.
 * @return IMP_OK; IMP_CANCELLED; IMP_E_ARG for a lamp that there is not or twice, numbers out of
 *         their range, lamps without watts where these count, two wants of one kind for one
 *         grid; IMP_E_UNSUPPORTED for a lamp that varies in time, and where the context makes
 *         parts; and what imp_grid_read and imp_grid_glare refuse.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_design_find(imp_scene *scene, const struct imp_design_lamp *lamps, size_t n_lamps,
                const struct imp_design_want *wants, size_t n_wants,
                const struct imp_design_options *options, const struct imp_run *run,
                imp_design **out);
/**
 * Move lamps first: find places and aims near the present ones for which what is wanted holds with the
 * fewest watts, flux or cost; then do as imp_design_find there. A search is local (sequential
 * linear programs in levels and places, with one set of random numbers), so that where it ends
 * depends on where it begins: options.starts of them begin in different places, and the best end
 * is taken. They prove nothing of other places, while `proven` and `bound`
 * are of the combinations at the places found. Lamps that are not used at the first places stay
 * where they are, unless nothing there has what is wanted: then all are used to begin with.
 * The scene has the places found afterwards, also without an answer; after an error, the first ones.
 * @param moves   [n_moves] at least 1.
 * @param lamps, wants, options, run, out   as imp_design_find.
 * @return as imp_design_find; IMP_E_ARG for a number that is none of these, is there twice, or has a
 *         value outside of its bounds; and what imp_scene_add_geometry refuses, with a problem made
 *         with the scene before that was to be.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_design_move(imp_scene *scene, const struct imp_design_lamp *lamps, size_t n_lamps,
                const struct imp_design_want *wants, size_t n_wants,
                const struct imp_design_move *moves, size_t n_moves,
                const struct imp_design_options *options, const struct imp_run *run,
                imp_design **out);
/** It belongs to the design. NULL for NULL. */
IMP_API const struct imp_design_answer *imp_design_result(const imp_design *design);
/** design may be NULL. */
IMP_API void imp_design_destroy(imp_design *design);

#ifdef __cplusplus
}
#endif

#endif
