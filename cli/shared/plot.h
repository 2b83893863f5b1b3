/* SPDX-License-Identifier: Apache-2.0
 *
 * Line charts as SVG files. */
#ifndef IMP_CLI_PLOT_H
#define IMP_CLI_PLOT_H

#include <stddef.h>

/* An SVG file of y [n] against 0, 1, .. n-1, with a band of one standard error (se may be
 * NULL). 0, or an exit code with the reason printed. */
int plot_curve(const char *path, const char *title, const char *x_label,
               const char *y_label, size_t n, const double *y, const double *se);
/* The same against wavelengths nm [n], n > 1, which increase. */
int plot_spectrum(const char *path, const char *title, const char *y_label, size_t n,
                  const double *nm, const double *y, const double *se);

#endif
