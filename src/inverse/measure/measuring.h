/* SPDX-License-Identifier: Apache-2.0
 *
 * What the parts of imp_measure share (importon/measure.h has the stages). */
#ifndef IMP_INVERSE_MEASURING_H
#define IMP_INVERSE_MEASURING_H

#include "inverse/problem/problem.h"
#include <importon/measure.h>

/* A photograph at work. */
struct imp__photo {
    struct imp_photo desc; /* borrowed arrays */
    const char *name;
    const struct imp_sensor *sensor;
    size_t n_pixels, n_values;
    double noise;    /* one standard deviation; root of the mean square where it varies */
    double noise_of; /* relative error of its square; 0: it was given */
    float *noise_se; /* [n_values] all `noise`, unless it varies */
    float *
        lift; /* [n_values] what noise of light adds to the mean of a value with a gamma */
    float *weights; /* [n_pixels] desc.weights, 0 where masked */
    float *left,
        *own;      /* [n_values] residuals, NAN: not compared; the picture's variances */
    float *square; /* [n_pixels] sum of squared residuals of its compared values ... */
    float
        *expected; /* [n_pixels] ... and what noise makes of it; 0: nothing is compared */
    float *robust; /* [n_pixels] factors of weights in all fits but the last */
    float *
        edges; /* [n_pixels] squared residuals by edges that are a little off; 0: places are known */
    int block, columns, rows;
    uint8_t *masked; /* [rows][columns] */
    size_t n_masked;
    double chi2,
        chi2_se; /* mean square of residuals, our own noise taken off, over the noise */
    size_t n_compared; /* values in it */
};

/* An error of chi-square with which nothing is explained. */
#define IMP_MEASURE_BLIND 1
/* Standard errors by which something is more. */
#define IMP_MEASURE_SURE 3

struct imp__measure {
    imp_context *ctx;
    struct imp_scene *scene;
    struct imp_measure_options o;
    struct imp_run run;
    struct imp_arena arena; /* of the result: goes to the problem */
    size_t n_photos;
    struct imp__photo *photos;
    bool wanted[IMP_MEASURE_STAGES];
    uint8_t *stage; /* [n_params] of which stage it is; IMP_MEASURE_STAGES: held */
    size_t n_holds;
    struct imp__held *holds;      /* [n_holds] the items of o.hold */
    bool joined;                  /* textures are few: the last fit has them */
    uint8_t *held;                /* [n_theta] single numbers that stay; NULL: none */
    double *at;                   /* [n_theta] where its own stage has left each number */
    double *at_se;                /* [n_theta] and its standard error there; 0: none */
    uint64_t task;                /* hash of scene, photographs and options */
    int round, next;              /* the round, from 1, and the stage that comes next */
    bool due[IMP_MEASURE_STAGES]; /* in this round */
    size_t n_rows, cap_rows;
    struct imp_measure_row *rows;
    size_t n_lines, cap_lines;
    char **lines;
    bool
        doubtful; /* the last fit has the stages' weights, which its intervals do not know */
    bool astray;     /* the last fit ended worse than it began, whatever was done */
    double own_part; /* of the last fit's answer (struct imp_fit_result) */
    bool looked;     /* residuals are those of the present numbers */
    bool repeats;    /* lines are not given to the host: the checkpoint's */
};

/* ---- measure.c ---- */
/* A decision: kept, and given to the host. */
IMP_PRINTF(2, 3)
enum imp_status imp__measure_say(struct imp__measure *m, const char *format, ...);

/* ---- measure_arguments.c ---- */
enum imp_status imp__measure_options_take(struct imp__measure *m,
                                          const struct imp_measure_options *options);
/* To be freed by imp__measure_photos_free. */
enum imp_status imp__measure_photos_take(struct imp__measure *m,
                                         const struct imp_photo *photos, size_t n);
void imp__measure_photos_free(struct imp__measure *m);
uint64_t imp__measure_hash(const struct imp__measure *m);

/* ---- measure_numbers.c ---- */
/* Poses become parameters, and each parameter gets its stage. */
enum imp_status imp__measure_numbers(struct imp__measure *m);
/* The parameter "SENSOR.NUMBER.value" of a photograph's film or camera; NULL: there is none. */
struct imp_param *imp__measure_film_number(const struct imp__measure *m,
                                           const struct imp__photo *photo,
                                           const char *number, size_t *index);
/* Is a single number of parameter k held? */
bool imp__measure_holds(const struct imp__measure *m, size_t k);
/* Is parameter k a factor of what a light sends: a radiance or the like, or a scale, and no place,
 * angle or turbidity? */
bool imp__measure_shines(const struct imp__measure *m, size_t k);
/* Is parameter k of a stage? The last fit has those of all stages before textures, and of textures where
 * they are few. */
bool imp__measure_has(const struct imp__measure *m, enum imp_measure_stage stage,
                      size_t k);
/* How many numbers a stage has. */
size_t imp__measure_count(const struct imp__measure *m, enum imp_measure_stage stage);

/* ---- measure_begin.c ---- */
/* Fields of view and exposures at the start. */
enum imp_status imp__measure_begin(struct imp__measure *m);

/* ---- measure_noise.c ---- */
/* Is it given by value? */
bool imp__measure_noise_varies(const struct imp__photo *photo);
/* Then: noise_se and lift of all values, where the scene's light is light [n_values] and its film has this
 * gamma; by the picture and not by the photograph, whose noise would be in the weights. */
void imp__measure_noise_by_light(struct imp__photo *photo, const float *light,
                                 double gamma);
/* noise, and noise_of where it was not given. */
enum imp_status imp__measure_noise(struct imp__measure *m, struct imp__photo *photo);
/* The same from its residuals, where that is less: *changed, and a line. */
enum imp_status imp__measure_noise_again(struct imp__measure *m, struct imp__photo *photo,
                                         bool *changed);

/* ---- measure_photo.c ---- */
/* Residuals, chi2 and robust weights at the scene's present numbers, by pictures of `seed`. */
enum imp_status imp__measure_residual(struct imp__measure *m, struct imp__photo *photo,
                                      uint64_t seed);
/* ---- measure_mask.c ---- */
/* Which blocks are masked, by the residuals. *changed: others than before. */
enum imp_status imp__measure_mask(struct imp__measure *m, struct imp__photo *photo,
                                  bool *changed);

/* photo->weights, by what is masked. */
void imp__measure_weights(struct imp__photo *photo);

/* ---- measure_stage.c ---- */
/* Residuals of all photographs at the present numbers, unless they are there. */
enum imp_status imp__measure_look(struct imp__measure *m);
/* Chi-square of the residuals that are there, of row->n numbers; own_part: what our own noise in them
 * adds, in parts of row->n; it is taken off. */
void imp__measure_judge(const struct imp__measure *m, double own_part,
                        struct imp_measure_row *row);
/* Chi-square of the last row again, by other noise; says so. */
enum imp_status imp__measure_judge_again(struct imp__measure *m);
/* A fit of one stage, whose problem is destroyed unless `problem` is there. Adds its row. */
enum imp_status imp__measure_fit(struct imp__measure *m, enum imp_measure_stage stage,
                                 int round, imp_problem **problem,
                                 const struct imp_fit_result **result);

/* ---- measure_last.c ---- */
/* The last fit of a round: of all numbers, or of textures where there is nothing else. */
enum imp_measure_stage imp__measure_last_stage(const struct imp__measure *m);
/* imp__measure_fit in this round, without cameras that have no derivatives. */
enum imp_status imp__measure_stage(struct imp__measure *m, enum imp_measure_stage stage,
                                   imp_problem **problem,
                                   const struct imp_fit_result **result);
enum imp_status imp__measure_last(struct imp__measure *m, imp_problem **problem,
                                  const struct imp_fit_result **result);
/* Behind the last round: with more samples, where the photographs are not explained. */
enum imp_status imp__measure_last_again(struct imp__measure *m, imp_problem **problem,
                                        const struct imp_fit_result **result);

/* ---- measure_state.c ---- */
/* The checkpoint, if there is one: rows, lines, masks and numbers after so many fits. */
enum imp_status imp__measure_state_write(const struct imp__measure *m);
enum imp_status imp__measure_state_read(struct imp__measure *m, bool *found);

#endif
