/* SPDX-License-Identifier: Apache-2.0
 *
 * Lights, glasses and metals by name. The tables are made by tools/color_tables.py. */
#ifndef IMP_COLOR_TABLES_H
#define IMP_COLOR_TABLES_H

/* Relative power in steps of 5 nm, 0 outside. The list ends with {0}. */
struct imp__illuminant {
    const char *name;
    int n, first_nm;
    const double *value;
};
extern const struct imp__illuminant imp__illuminants[];

/* Sellmeier's n^2 = 1 + sum_k B_k l^2/(l^2 - C_k), l in um: B [n], C [n]. */
struct imp__glass {
    const char *name;
    int n;
    double number[8];
};
extern const struct imp__glass imp__glasses[];

/* Complex index eta + i k at wavelengths. */
struct imp__metal {
    const char *name;
    int n;
    const double *nm, *eta, *k; /* [n] */
};
extern const struct imp__metal imp__metals[];

/* By name, in any case; NULL: unknown. */
const struct imp__illuminant *imp__illuminant_find(const char *name);
const struct imp__glass *imp__glass_find(const char *name);
const struct imp__metal *imp__metal_find(const char *name);

#endif
