/* SPDX-License-Identifier: Apache-2.0
 *
 * The pictures that importon fit leaves in -o DIR, one of each for every target: before,
 * target, recovered. All return 0, or an exit code with the reason printed. */
#ifndef IMP_CLI_FIT_PICTURES_H
#define IMP_CLI_FIT_PICTURES_H

/* May they all be written? */
int fit_pictures_writable(void);
/* The scene as it is now, through the sensor of every target. spp 0: the run's. */
int fit_pictures_write(const char *name, int spp);
/* A copy of each target, so that the folder tells the whole story. */
int fit_targets_write(void);
/* One PNG with a row for each target. */
int fit_sheet_write(const char *to);

#endif
