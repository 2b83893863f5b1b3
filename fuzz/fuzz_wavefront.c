/* SPDX-License-Identifier: Apache-2.0
 *
 * OBJ files with MTL files: any bytes are a scene or an error that names a file. The first
 * byte says whether they are read leniently; the library, "m.mtl", is what follows the
 * first zero byte. */
#include "foreign_scene.h"
#include <stdio.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static char folder[] = "/tmp/importon-fuzz-XXXXXX";

static void library_put(const uint8_t *data, size_t size)
{
    char path[64];
    snprintf(path, sizeof path, "%s/m.mtl", folder);
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(data, 1, size, f) != size || fclose(f) != 0) abort();
}

static void folder_remove(void)
{
    char path[64];
    snprintf(path, sizeof path, "%s/m.mtl", folder);
    remove(path);
    remove(folder);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static bool made;
    if (!made && (!mkdtemp(folder) || atexit(folder_remove) != 0)) abort();
    made = true;
    if (size < 1) return 0;
    const uint8_t *zero = memchr(data + 1, 0, size - 1);
    const size_t n = zero ? (size_t)(zero - data) - 1 : size - 1;
    library_put(zero ? zero + 1 : data, zero ? size - n - 2 : 0);
    foreign_scene("fuzz.obj", data + 1, n, data[0] & 1, folder);
    return 0;
}
