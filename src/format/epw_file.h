/* SPDX-License-Identifier: Apache-2.0
 *
 * Weather of a year by hours: EnergyPlus weather files `.epw`. */
#ifndef IMP_FORMAT_EPW_FILE_H
#define IMP_FORMAT_EPW_FILE_H

#include "base/arena.h"
#include "base/file.h"
#include <importon/rooms.h>

struct imp_weather {
    struct imp_weather_info info;
    struct imp_weather_hour *hour; /* [info.n], in the arena */
};

/* `text` is the file; `name` is for messages. Every number of the answer is finite and in
 * its range, suns are unit vectors, hours follow each other. @return IMP_E_SCENE with file, line and
 * column; IMP_E_NOMEM. */
enum imp_status imp__epw_parse(imp_context *ctx, struct imp_arena *keep, const char *name,
                               const struct imp_bytes *text, struct imp_weather *out);

#endif
