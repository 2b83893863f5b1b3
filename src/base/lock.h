/* SPDX-License-Identifier: Apache-2.0
 *
 * One writer of a file that is written again and again: whoever writes PATH holds PATH.lock. The
 * lock is the kernel's (flock), so that it ends with its process, however that ends. */
#ifndef IMP_BASE_LOCK_H
#define IMP_BASE_LOCK_H

#include "context.h"

/* name NULL: not held. */
struct imp_file_lock {
    int fd;
    char *name;
};

/* Hold the lock, of all ranks or of none. Without effect for NULL, for what is no regular file
 * (/dev/null), and on file systems without locks. @return IMP_OK; IMP_E_IO: another process, which
 * the message names, holds it, or PATH.lock cannot be made or is a file of somebody else's;
 * IMP_E_NOMEM. */
enum imp_status imp__file_lock(imp_context *ctx, const char *path,
                               struct imp_file_lock *out);
/* PATH.lock goes. */
void imp__file_unlock(imp_context *ctx, struct imp_file_lock *lock);

#endif
