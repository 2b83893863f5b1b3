/* SPDX-License-Identifier: Apache-2.0
 *
 * .vol files for tests. */
#ifndef IMP_TEST_VOL_WRITE_H
#define IMP_TEST_VOL_WRITE_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* A new file in the folder for temporary ones; path [64]. */
static inline void vol_write(char *path, int nx, int ny, int nz, int channels,
                             const float *value)
{
    const int32_t head[5] = {1, nx, ny, nz, channels};
    const float box[6] = {0, 0, 0, 1, 1, 1};
    const size_t n = (size_t)nx * (size_t)ny * (size_t)nz * (size_t)channels;
    snprintf(path, 64, "/tmp/importon-XXXXXX");
    const int fd = mkstemp(path);
    FILE *f = fd < 0 ? NULL : fdopen(fd, "wb");
    if (!f || fwrite("VOL\3", 1, 4, f) != 4 || fwrite(head, 4, 5, f) != 5 ||
        fwrite(box, 4, 6, f) != 6 || fwrite(value, sizeof *value, n, f) != n ||
        fclose(f) != 0) {
        printf("Bail out! no volume file\n");
        exit(99);
    }
}

#endif
