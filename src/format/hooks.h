/* SPDX-License-Identifier: Apache-2.0
 *
 * Allocator hooks for libraries whose own hooks carry no payload (expat, OpenEXRCore).
 * The context travels in a thread-local, set around every call into such a library. */
#ifndef IMP_FORMAT_HOOKS_H
#define IMP_FORMAT_HOOKS_H

#include "base/context.h"

/* Allocate for `ctx` on this thread until imp__hooks_leave with the value returned here.
 */
imp_context *imp__hooks_enter(imp_context *ctx);
void imp__hooks_leave(imp_context *previous);
/* Has an allocation failed on this thread since the last call of this? Libraries do not
 * always report it themselves. */
bool imp__hooks_failed(void);

void *imp__hooks_malloc(size_t bytes);
void *imp__hooks_realloc(void *memory, size_t bytes);
void imp__hooks_free(void *memory);

#endif
