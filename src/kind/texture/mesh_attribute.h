/* SPDX-License-Identifier: Apache-2.0
 *
 * Attributes of shapes by name. */
#ifndef IMP_KIND_TEXTURE_MESH_ATTRIBUTE_H
#define IMP_KIND_TEXTURE_MESH_ATTRIBUTE_H

#include "kind/build.h"

/* Is it the name of an attribute? */
bool imp__attribute_name(const char *name);
/* Is it a mesh_attribute that looks up this name? */
bool imp__attribute_asked(const struct imp_texture *t, const char *name);
/* `scale` of a mesh_attribute; 1 of other textures. */
double imp__attribute_scale(const struct imp_texture *t);

#endif
