/* SPDX-License-Identifier: Apache-2.0
 *
 * Targets that are files of 8 or 16 bits: what they can hold, and how they are encoded. */
#ifndef IMP_CLI_PHOTOGRAPH_H
#define IMP_CLI_PHOTOGRAPH_H

#include "command.h"

/* Between neighbouring values of a file of integers, as it has them; 0: it holds floating-point
 * numbers. */
double photograph_step(const char *spec);
/* Where its values are clipped once they are linear light, as picture_read has them; infinite: it does not
 * say. */
double photograph_white(const char *spec);
/* Warns of pixels that are as bright as the file can hold. */
void photograph_warn_clipped(const char *spec, const struct imp_target *target);
/* Where the film of target->sensor has a gamma, it is the numbers of the file that count:
 * what was read as sRGB is encoded again. The target's pixels are ours. */
void photograph_undo_srgb(const char *spec, struct imp_target *target);
/* --clip: levels in the target's values. `text`: "auto", by the file, or "LOW,HIGH" in
 * the file's values; either may be left out. 0, or an exit code with the reason
 * printed. */
int photograph_levels(const char *spec, const char *text, const struct imp_target *target,
                      double *low, double *high);

#endif
