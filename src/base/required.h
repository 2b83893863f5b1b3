/* SPDX-License-Identifier: Apache-2.0
 *
 * What a plugin cannot be without and a file does not give. */
#ifndef IMP_BASE_REQUIRED_H
#define IMP_BASE_REQUIRED_H

#include "props.h"

/* The error of a property that is missing, at the node's place. It names what was written in its
 * stead if that is near: a property or child that nobody has read. */
IMP_COLD enum imp_status imp__node_missing(imp_context *ctx, const struct imp_node *node,
                                           const char *name);

#endif
