/* SPDX-License-Identifier: Apache-2.0
 *
 * For tests: a small closed mesh with vertex normals that are not those of its faces. */
#ifndef IMP_TEST_EGG_H
#define IMP_TEST_EGG_H

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

/* It stands in a room before a camera, of the material `grey`. */
#define EGG_OF(file)                                                                     \
    "<shape type='obj' id='egg'><string name='filename' value='" file                    \
    "'/><transform name='to_world'><scale value='.6'/><translate x='1' y='-.8' "         \
    "z='.6'/></transform><ref id='grey'/></shape>"

/* An octahedron with every triangle cut into four, on an ellipsoid: 18 vertices. normals: of the
 * ellipsoid, in the file; else importon computes them. */
static inline void egg_write(const char *file, bool normals)
{
    static const int face[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                   {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    double p[18][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                       {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
    int n = 6, middle[6][6] = {{0}};
    FILE *f = fopen(file, "w");
    if (!f) exit(99);
    for (int a = 0; a < 6; a++)
        for (int b = 0; b < a; b++) {
            if (a / 2 == b / 2) continue;
            for (int i = 0; i < 3; i++) p[n][i] = (p[a][i] + p[b][i]) / sqrt(2);
            middle[a][b] = middle[b][a] = n++;
        }
    for (int k = 0; k < n; k++)
        fprintf(f, "v %.9g %.9g %.9g\n", .8 * p[k][0], .6 * p[k][1], .7 * p[k][2]);
    for (int k = 0; k < n && normals; k++)
        fprintf(f, "vn %.9g %.9g %.9g\n", p[k][0] / .8, p[k][1] / .6, p[k][2] / .7);
    for (int k = 0; k < 8; k++)
        for (int j = 0; j < 4; j++) {
            const int *v = face[k];
            const int m[3] = {middle[v[0]][v[1]], middle[v[1]][v[2]], middle[v[2]][v[0]]};
            const int c[3] = {j == 3 ? m[0] : v[j], j == 3 ? m[1] : m[j],
                              j == 3 ? m[2] : m[(j + 2) % 3]};
            for (int i = 0; i < 3; i++) {
                fprintf(f, i == 0 ? "f %d" : " %d", c[i] + 1);
                if (normals) fprintf(f, "//%d", c[i] + 1);
            }
            fprintf(f, "\n");
        }
    fclose(f);
}

#endif
