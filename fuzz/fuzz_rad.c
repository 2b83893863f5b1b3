/* SPDX-License-Identifier: Apache-2.0
 *
 * Radiance's scenes and views: any bytes are a scene or an error that names a line. The first
 * byte says what is read, and whether leniently; the view of a scene is Radiance's. */
#include "foreign_scene.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size > 0)
        foreign_scene(data[0] & 2 ? "fuzz.vf" : "fuzz.rad", data + 1, size - 1,
                      data[0] & 1, NULL);
    return 0;
}
