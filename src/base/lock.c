/* SPDX-License-Identifier: Apache-2.0
 *
 * Locks of files that a run writes again and again. */
#include "lock.h"
#include "file.h"
#include "team.h"
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define MARK  "importon lock: "
#define TRIES 100

static enum imp_status cannot(imp_context *ctx, const char *name, int code)
{
    char text[256];
    return imp__error(ctx, IMP_E_IO, "%s: cannot make this lock: %s", name,
                      strerror_r(code, text, sizeof text));
}

/* Who holds it, as its holder wrote it; "" while it is being written. */
static void holder_read(int fd, char *who, size_t size)
{
    const ssize_t n = pread(fd, who, size - 1, 0);
    who[n > 0 ? n : 0] = 0;
    who[strcspn(who, "\n")] = 0;
}

static void holder_write(int fd)
{
    char host[256] = "", line[512];
    (void)gethostname(host, sizeof host - 1);
    const int n =
        snprintf(line, sizeof line, MARK "process %ld on %s\n", (long)getpid(), host);
    (void)!ftruncate(fd, 0);
    (void)!pwrite(fd, line, (size_t)n, 0);
}

/* Is PATH.lock still the file that was opened? Its former holder may have removed it. */
static bool is_there(const char *name, const struct stat *of)
{
    struct stat info;
    return stat(name, &info) == 0 && info.st_dev == of->st_dev &&
           info.st_ino == of->st_ino;
}

/* *fd < 0 and IMP_OK: there are no locks here. */
static enum imp_status acquire(imp_context *ctx, const char *path, const char *name,
                               int *fd)
{
    char who[512];
    struct stat info;
    for (int k = 0; k < TRIES; k++) {
        *fd = open(name, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666);
        if (*fd < 0) return cannot(ctx, name, errno);
        if (fstat(*fd, &info) != 0) return cannot(ctx, name, errno);
        holder_read(*fd, who, sizeof who);
        if (!S_ISREG(info.st_mode) ||
            (info.st_size > 0 && strncmp(who, MARK, sizeof MARK - 1) != 0))
            return imp__error(ctx, IMP_E_IO,
                              "%s: this file is in the way of the lock of %s, and is not "
                              "of importon's making",
                              name, path);
        if (flock(*fd, LOCK_EX | LOCK_NB) == 0) {
            if (is_there(name, &info)) return IMP_OK;
        } else if (errno == EWOULDBLOCK) {
            return imp__error(ctx, IMP_E_IO, "%s: another run writes this file (%s)",
                              path, who[0] ? who + sizeof MARK - 1 : "it just began");
        } else if (errno != EINTR) {
            if (info.st_size == 0) unlink(name);
            close(*fd);
            *fd = -1;
            return IMP_OK;
        }
        close(*fd);
        *fd = -1;
    }
    return imp__error(ctx, IMP_E_IO, "%s: other runs begin to write this file", path);
}

static enum imp_status lock_here(imp_context *ctx, const char *path,
                                 struct imp_file_lock *out)
{
    struct stat info;
    const char *where = path;
    char real[PATH_MAX];
    if (stat(path, &info) == 0) {
        if (!S_ISREG(info.st_mode)) return IMP_OK;
        if (realpath(path, real)) where = real; /* as it is written: through links */
    }
    const size_t room = strlen(where) + sizeof ".lock";
    char *name = imp__alloc(ctx, room, 1);
    int fd = -1;
    if (!name) return imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", path);
    snprintf(name, room, "%s.lock", where);
    const enum imp_status st = acquire(ctx, path, name, &fd);
    if (st == IMP_OK && fd >= 0) {
        holder_write(fd);
        *out = (struct imp_file_lock){fd, name};
        return IMP_OK;
    }
    if (fd >= 0) close(fd);
    imp__release(ctx, name);
    return st;
}

enum imp_status imp__file_lock(imp_context *ctx, const char *path,
                               struct imp_file_lock *out)
{
    enum imp_status st = IMP_OK;
    bool any = false;
    *out = (struct imp_file_lock){0};
    if (!path) return IMP_OK;
    if (imp__team_writes(ctx)) st = lock_here(ctx, path, out);
    if (imp__team_broadcasts(ctx)) {
        struct imp_bytes nothing = {0};
        st = imp__team_broadcast(ctx, st, &nothing);
        imp__bytes_free(ctx, &nothing);
    } else if (imp__team_ranks(ctx)) {
        const enum imp_status met = imp__team_any(ctx, st != IMP_OK, &any);
        if (st == IMP_OK) st = met;
        if (st == IMP_OK && any)
            st = imp__error(ctx, IMP_E_IO, "%s: another run writes this file", path);
    }
    if (st != IMP_OK) imp__file_unlock(ctx, out);
    return st;
}

void imp__file_unlock(imp_context *ctx, struct imp_file_lock *lock)
{
    if (!lock->name) return;
    unlink(lock->name);
    (void)flock(lock->fd, LOCK_UN); /* of processes that were forked meanwhile, too */
    close(lock->fd);
    imp__release(ctx, lock->name);
    *lock = (struct imp_file_lock){0};
}
