/* SPDX-License-Identifier: Apache-2.0
 *
 * glTF: any bytes are a scene or an error that names the file. The first byte says whether
 * it is read leniently. */
#include "foreign_scene.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size > 0) foreign_scene("fuzz.glb", data + 1, size - 1, data[0] & 1, NULL);
    return 0;
}
