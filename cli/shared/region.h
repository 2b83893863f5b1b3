/* SPDX-License-Identifier: Apache-2.0
 *
 * A part of a picture, as --region names it. */
#ifndef IMP_CLI_REGION_H
#define IMP_CLI_REGION_H

/* "X0,Y0,X1,Y1", [X0, X1) x [Y0, Y1); NULL: all. The mean over it is sum(adjoint picture):
 * *adjoint [height][width][channels of the scene], and, of a part, *mask [height][width], 1
 * inside; both to be freed. 0, or an exit code with the reason printed. */
int region_take(const char *text, int sensor, float **adjoint, float **mask);

#endif
