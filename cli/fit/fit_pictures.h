/* SPDX-License-Identifier: Apache-2.0
 *
 * The pictures that importon fit leaves in -o DIR, one of each for every target: before,
 * target, recovered. All return 0, or an exit code with the reason printed. */
#ifndef IMP_CLI_FIT_PICTURES_H
#define IMP_CLI_FIT_PICTURES_H

#include <importon/importon.h>

/* May they all be written? */
int fit_pictures_writable(void);
/* The scene as it is now, through the sensor of every target. spp 0: the run's. */
int fit_pictures_write(const char *name, int spp);
/* Those of this name go: a fit that was refused leaves none. */
void fit_pictures_remove(const char *name);
/* `before` and `target` go where a fit was refused, and the folder, if nothing else is in it. */
void fit_pictures_refused(enum imp_status st);
/* Target i as the fit compares it, with its standard errors where it has them; the
 * caller destroys it. */
int fit_target_film(size_t i, imp_film **out);
/* A copy of each target, so that the folder is complete. */
int fit_targets_write(void);
/* undetermined.exr: the change of each sensor's picture when the problem's values change
 * by x_dot. */
int fit_loosest_write(imp_problem *problem, const double *x_dot);
/* One PNG with a row for each target. */
int fit_sheet_write(const char *to);

#endif
