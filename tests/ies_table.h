/* SPDX-License-Identifier: Apache-2.0
 *
 * For tests: the table of a luminaire that is not symmetric, with another plane at each right angle. */
#ifndef IMP_TEST_IES_TABLE_H
#define IMP_TEST_IES_TABLE_H

#include <stdio.h>
#include <stdlib.h>

/* last: what is left at 90 degrees. */
static inline void table_write(const char *name, int last)
{
    FILE *f = fopen(name, "w");
    if (!f) exit(99);
    fputs("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 5 5 1 2 0 0 0\n1 1 0\n"
          "0 20 45 65 90\n0 90 180 270 360\n",
          f);
    for (int k = 0; k < 5; k++)
        fprintf(f, "9000 %d %d %d %d\n", 9000 - 900 * (k % 4), 8000 - 1700 * (k % 4),
                4000 + 900 * (k % 4), last);
    fclose(f);
}

#endif
