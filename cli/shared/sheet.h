/* SPDX-License-Identifier: Apache-2.0
 *
 * A contact sheet: previews side by side in one PNG, small ones magnified. */
#ifndef IMP_CLI_SHEET_H
#define IMP_CLI_SHEET_H

#include <stddef.h>

struct sheet {
    char **picture; /* [n] the PNG files, in the order of reading */
    size_t n;
};

/* Add the preview beside the picture `path` (x.exr -> x.png). */
void sheet_add(struct sheet *s, const char *path);

/* Write the sheet to `path` ("x.png"), `columns` wide. Tiles are as large as the largest
 * picture. 0, or an exit code with the reason printed. */
int sheet_write(const struct sheet *s, size_t columns, const char *path);
void sheet_free(struct sheet *s);

#endif
