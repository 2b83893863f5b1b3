/* SPDX-License-Identifier: Apache-2.0
 *
 * Daylight of a year (importon/rooms.h): what the files that compute it share.
 *
 * With C_p the coefficient of patch p, L_p(h) the mean radiance of hour h's sky in it, E_s(h)
 * the illuminance across the sun's rays, D(h) what reaches the point straight from the sun and
 * I_q what comes reflected while the sun is in patch q, both for an illuminance of 1,
 *
 *     E(h) = sum_p C_p L_p(h) + E_s(h) (D(h) + I_q(h))
 *
 * C, D and I are estimated by each of IMP__GROUPS groups of walks. */
#ifndef IMP_INVERSE_ANNUAL_H
#define IMP_INVERSE_ANNUAL_H

#include "base/arena.h"
#include "base/drops.h"
#include "color/rgb.h"
#include "sky_patches.h"
#include "walk/core/walk.h"
#include <importon/rooms.h>

/* A number of the year by all groups, by 15 pairs of halves, by 5 times 4 quarters of them. */
enum {
    IMP__GROUPS = 16,
    IMP__HALVES = IMP__GROUPS - 1,
    IMP__QUARTERED = 5,
    IMP__VARIANTS = 1 + 2 * IMP__HALVES + 4 * IMP__QUARTERED
};

/* Two suns of a table from which one is drawn (Walker 1977): the first below `part`. */
struct imp__annual_sun {
    float to[2][3]; /* unit, world */
    float part;
    uint16_t cell[2];
};

/* Hours with light: hour k is lane k % 8 of block k/8. Blocks are in pairs: the last ones may be
 * without hours. */
struct imp__annual_hours {
    size_t n, blocks;
    const struct imp_weather_hour *given; /* the caller's */
    size_t *hour;                         /* [n] of them */
    double *sun;                          /* [n] E_s, lx; 0: none */
    imp_v3 *to_sun;                       /* [n] unit, world */
    int *cell;                            /* [n] of the sun; -1: none */
    /* Patches in which the sun is at some hour. */
    int n_cells;
    int cell_of[IMP__PATCHES];  /* -1: the sun is never there */
    int patch_of[IMP__PATCHES]; /* of a cell */
    double times[IMP__PATCHES]; /* 1 over the chance of a cell */
    size_t n_suns;              /* hours with a sun */
    struct imp__annual_sun *suns;
};

/* Skies of two blocks of hours. */
typedef imp__annual_lanes imp__annual_skies[IMP__PATCHES][2];

struct imp__annual {
    const struct imp_scene *scene;
    const struct imp_sensor *sensor;
    struct imp_tracer tracer;
    struct imp__sky_patches patches;
    struct imp__annual_hours hours;
    int sky;       /* the emitter */
    bool panes;    /* has some material a lobe that goes straight on? */
    bool through;  /* such lobes are no bounces */
    int64_t walks; /* of a group */
};

/* Light as one number. */
static inline double imp__annual_light(bool mono, imp_spec x)
{
    return mono ? x[0] : imp__luminance(x[0], x[1], x[2]);
}

/* What comes from a patch; what comes straight from the sun at an hour, with E_s: groups g and
 * g + IMP__SUN_RAYS have the same. */
enum { IMP__SUN_RAYS = IMP__GROUPS / 2 };
struct imp__annual_part {
    float C;
    int patch;
};
struct imp__annual_sunlit {
    size_t hour;
    float light[IMP__SUN_RAYS];
};

/* One point: of each group what comes from patches, those without light left out; I [n_cells];
 * hours in which the sun comes straight, and from which of them on they have not been counted. */
struct imp__annual_at {
    const struct imp__annual_part *part[IMP__GROUPS];
    int parts[IMP__GROUPS];
    float (*I)[IMP__GROUPS];
    const struct imp__annual_sunlit *sunlit;
    size_t n_sunlit, next;
};

/* What a thread needs, while it makes coefficients of a point. */
struct imp__annual_worker {
    struct imp_arena arena; /* of walks */
    struct imp_arena keep;  /* of what a point has */
    struct imp_drops drops;
    double *C_sum, *I_sum;             /* of a group, [IMP__PATCHES] each */
    struct imp__annual_sunlit *sunlit; /* [n_suns] */
};

/* annual_hours.c: IMP_E_ARG for numbers out of range; suns of hours that are checked, which `out`
 * borrows; skies of some blocks, in pairs. */
enum imp_status imp__annual_hours_check(imp_context *ctx, size_t n,
                                        const struct imp_weather_hour *hour);
enum imp_status imp__annual_hours_make(const struct imp__annual *a, size_t n,
                                       const struct imp_weather_hour *hour,
                                       struct imp__annual_hours *out);
enum imp_status imp__annual_skies_make(const struct imp__annual *a, size_t first,
                                       size_t blocks, imp__annual_skies *out);
void imp__annual_hours_free(imp_context *ctx, struct imp__annual_hours *h);

/* annual_sun.c: what of the light from direction w reaches o: 0 or 1 but for panes. */
imp_spec imp__annual_passes(const struct imp__annual *a, double time, imp_v3 o, imp_v3 w);
/* The suns of all hours, straight to the point of pixel (x, y): how many of them come. */
size_t imp__annual_direct(const struct imp__annual *a, int x, int y,
                          struct imp__annual_sunlit *out);

/* annual_walks.c: coefficients of group g at pixel (x, y); at->I has room. IMP_E_NOMEM has no
 * message. */
enum imp_status imp__annual_walks(const struct imp__annual *a, int x, int y, int g,
                                  struct imp__annual_worker *w,
                                  struct imp__annual_at *at);

/* annual_light.c: E of some blocks from `block` on, whose skies begin at `sky`; E has the direct suns at
 * first. */
void imp__annual_light_add(const struct imp__annual *a, const struct imp__annual_at *at,
                           const imp__annual_skies *sky, size_t block, size_t blocks,
                           imp__annual_lanes (*E)[IMP__GROUPS]);

/* annual_sums.c: numbers of a year of one point, as all groups have them, halves and quarters. */
enum imp__annual_number {
    IMP__AUTONOMY,
    IMP__CONTINUOUS,
    IMP__USEFUL,
    IMP__MEAN = IMP__USEFUL + 4,
    IMP__EXPOSURE,
    IMP__SUNLIT,
    IMP__ANNUAL_NUMBERS
};
struct imp__annual_numbers {
    double of[IMP__ANNUAL_NUMBERS][IMP__VARIANTS];
    double mean[IMP__GROUPS], exposure[IMP__GROUPS]; /* sums, by groups */
};
/* Counts by lanes of as many blocks as one likes. */
struct imp__annual_counts {
    imp__annual_mask of[IMP__ANNUAL_NUMBERS][IMP__VARIANTS];
};
/* Blocks whose sums are floats, at most. used: -1 of an hour of use, else 0. sun: has a block any? */
enum { IMP__BATCH = 8 };
void imp__annual_add(const struct imp_annual_options *o, const imp__annual_mask *used,
                     size_t blocks, const imp__annual_lanes (*E)[IMP__GROUPS],
                     const imp__annual_lanes (*S)[IMP__GROUPS], const bool *sun,
                     struct imp__annual_counts *counts, struct imp__annual_numbers *out);
void imp__annual_count(const struct imp__annual_counts *counts,
                       struct imp__annual_numbers *out);
/* Sums become numbers. all: hours of use in the year; lit: those with light. */
void imp__annual_end(const struct imp_annual_options *o, size_t all, size_t lit,
                     struct imp__annual_numbers *out);
/* Value and error of a number's variants. */
struct imp_estimate imp__annual_estimate(const double variant[IMP__VARIANTS]);
void imp__annual_point_set(const struct imp__annual_numbers *x,
                           struct imp_annual_point *out);
/* Mean of the groups, and its error. */
struct imp_estimate imp__annual_mean(const double group[IMP__GROUPS]);

/* annual_points.c: numbers [points] of a grid; readings of hours, if they are wanted, [points] [n]. */
struct imp__annual_year {
    const struct imp__annual *a;
    const struct imp_annual_options *options;
    const struct imp_run *run;
    size_t n, points;             /* hours as given */
    const imp__annual_mask *used; /* [hours.blocks] */
    size_t n_used;                /* of the year */
    double *reading, *se;         /* NULL: not wanted */
    struct imp__annual_numbers *numbers;
};
enum imp_status imp__annual_points(const struct imp__annual_year *year);

#endif
