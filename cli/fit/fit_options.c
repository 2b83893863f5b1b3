/* SPDX-License-Identifier: Apache-2.0
 *
 * Options of a search, as both fit and view take them, and the imp_fit_options that they make. */
#include "fit_options.h"
#include <math.h>

static const char *const optimizer_words[] = {"adam", "lm",    "lbfgs",
                                              "mma",  "slsqp", NULL};

static const char *const allocation_words[] = {"auto", "variance", "even", NULL};

static const char *const missing_words[] = {"auto", "always", "never", NULL};

static const char *const variate_words[] = {"auto", "on", "off", NULL};

struct fit_choice fit_choice = {.memory = -1, .mesh_lambda = -1};

const struct arg_option options_search[] = {
    {ARG_CHOICE | ARG_REPLAYS, 0, "optimizer", "NAME",
     "adam (default), lm, lbfgs, mma or slsqp", &fit_choice.optimizer, 0, 0,
     optimizer_words},
    {ARG_INT | ARG_REPLAYS, 'n', "iterations", "N",
     "maximum number of iterations (default 200 for adam, else 30)",
     &fit_choice.iterations, 1, 1e9, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "lr", "RATE",
     "learning rate of adam (default 0.05); for values with two bounds it falls, in fits "
     "of more than 64 values with control variates",
     &fit_choice.learning_rate, 1e-12, 1, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "momentum", "B",
     "adam: the decay factor of the mean gradient, beta1 (default 0.9; 0.5 for values "
     "with two bounds in fits of more than 64 values with control variates)",
     &fit_choice.momentum, 1e-6, 0.999999, NULL},
    {ARG_INT | ARG_REPLAYS, 0, "levels", "N",
     "adam, poses, and bent rays: from coarse to fine, in N levels", &fit_choice.levels,
     1, 16, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "mesh-lambda", "L",
     "adam: vertices of meshes move in smooth steps, of (I + L Laplacian) x (default: "
     "their number / 64; 0: each for itself)",
     &fit_choice.mesh_lambda, 0, 1e12, NULL},
    {ARG_CHOICE | ARG_REPLAYS, 0, "allocation", "HOW",
     "adam: samples by tile: variance (of the gradient), even, or auto (default: "
     "even beside control variates of more than 64 values)",
     &fit_choice.allocation, 0, 0, allocation_words},
    {ARG_NUMBER | ARG_REPLAYS, 0, "tolerance", "T",
     "stop when relative steps stay below (default 1e-4)", &fit_choice.tolerance, 1e-15,
     1, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "memory", "MB",
     "lbfgs, mma, slsqp: for recorded walks (default 1074; 0: none)", &fit_choice.memory,
     0, 1e12, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "headroom", "H",
     "lbfgs, mma, slsqp: the factor by which extinctions of grids may grow with "
     "recorded walks (default 1: such walks are traced)",
     &fit_choice.headroom, 1, 64, NULL},
    {ARG_CHOICE | ARG_REPLAYS, 0, "control-variate", "WHEN",
     "adam: walks are evaluated at the last parameters, too: auto (default: for more "
     "than 64 values, where possible), on or off",
     &fit_choice.variate, 0, 0, variate_words},
    {ARG_FLAG | ARG_REPLAYS, 0, "no-intervals", NULL,
     "do not estimate 95 % intervals at the end", &fit_choice.no_intervals, 0, 0, NULL},
    {0}};

const struct arg_option options_missing[] = {
    {ARG_CHOICE | ARG_REPLAYS, 0, "missing", "WHEN",
     "name parameters that are not fitted and may be wrong: auto (default: where they "
     "are "
     "not explained), always or never",
     &fit_choice.missing, 0, 0, missing_words},
    {0}};

struct imp_fit_options fit_choice_options(void)
{
    static const enum imp_optimizer optimizers[] = {IMP_ADAM, IMP_LM, IMP_LBFGS, IMP_MMA,
                                                    IMP_SLSQP};
    struct imp_fit_options fit = IMP_FIT_OPTIONS_INIT;
    fit.optimizer = optimizers[fit_choice.optimizer];
    fit.max_iterations = fit_choice.iterations;
    fit.learning_rate = fit_choice.learning_rate;
    fit.tolerance = fit_choice.tolerance;
    fit.momentum = fit_choice.momentum;
    fit.levels = fit_choice.levels;
    fit.memory = fit_choice.memory > 0 ? (size_t)(1e6 * fit_choice.memory) : 0;
    fit.no_recording = fit_choice.memory == 0;
    fit.headroom = fit_choice.headroom;
    fit.mesh_lambda = fit_choice.mesh_lambda == 0 ? -1 : fmax(fit_choice.mesh_lambda, 0);
    static const enum imp_variates variates[] = {IMP_VARIATES_AUTO, IMP_VARIATES_ON,
                                                 IMP_VARIATES_OFF};
    fit.control_variate = variates[fit_choice.variate];
    static const enum imp_allocation allocations[] = {
        IMP_ALLOCATION_DEFAULT, IMP_ALLOCATION_VARIANCE, IMP_ALLOCATION_EVEN};
    fit.allocation = allocations[fit_choice.allocation];
    fit.intervals = !fit_choice.no_intervals;
    return fit;
}

const char *fit_optimizer_word(void) { return optimizer_words[fit_choice.optimizer]; }
