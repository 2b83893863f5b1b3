/* SPDX-License-Identifier: Apache-2.0
 *
 * Illuminants, glasses and metals by name, from the tables of color_tables.c. */
#include "color_tables.h"
#include <stddef.h>
#include <strings.h>

#define FIND(table)                                                                      \
    for (size_t i = 0; (table)[i].name; i++)                                             \
        if (strcasecmp((table)[i].name, name) == 0) return &(table)[i];                  \
    return NULL

const struct imp__illuminant *imp__illuminant_find(const char *name)
{
    FIND(imp__illuminants);
}
const struct imp__glass *imp__glass_find(const char *name) { FIND(imp__glasses); }
const struct imp__metal *imp__metal_find(const char *name) { FIND(imp__metals); }
