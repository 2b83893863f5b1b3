/* SPDX-License-Identifier: Apache-2.0
 *
 * Smoke with a known density: a plume of N^3 cells as a .vol file, the same for the same
 * seed on every machine (docs/media.md 9).
 *
 *     example_smoke N SEED FILE.vol */
#include "../bench/plume.h"

int main(int argc, char **argv)
{
    const int n = argc == 4 ? atoi(argv[1]) : 0;
    if (n < 1 || n > 1024) {
        fprintf(stderr, "usage: example_smoke N SEED FILE.vol (N: 1 to 1024)\n");
        return 2;
    }
    if (!plume_write(argv[3], n, strtoull(argv[2], NULL, 10))) {
        fprintf(stderr, "%s cannot be written\n", argv[3]);
        return 3;
    }
    return 0;
}
