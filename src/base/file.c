/* SPDX-License-Identifier: Apache-2.0
 *
 * Reading and writing of whole files. A file is written beside its final name and
 * renamed, so that no reader meets half of it. */
#include "file.h"
#include "team.h"
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* Most bytes read from a pipe, which has no size and may never end. */
#define ENDLESS_MAX ((size_t)1 << 30)

static enum imp_status io_error(imp_context *ctx, const char *path, const char *what,
                                int code)
{
    char text[256];
    return imp__error(ctx, IMP_E_IO, "%s: %s: %s", path, what,
                      strerror_r(code, text, sizeof text));
}

bool imp__bytes_put(imp_context *ctx, struct imp_bytes *b, size_t offset,
                    const void *data, size_t n)
{
    size_t end;
    if (__builtin_add_overflow(offset, n, &end)) return false;
    if (end > b->capacity) {
        unsigned char *grown = imp__grow(ctx, b->data, &b->capacity, end, 1);
        if (!grown) return false;
        b->data = grown;
    }
    if (n) memcpy(b->data + offset, data, n);
    if (end > b->size) b->size = end;
    return true;
}

void imp__bytes_free(imp_context *ctx, struct imp_bytes *b)
{
    imp__release(ctx, b->data);
    *b = (struct imp_bytes){0};
}

enum imp_status imp__file_read_own(imp_context *ctx, const char *path, size_t limit,
                                   struct imp_bytes *out)
{
    enum imp_status st = IMP_OK;
    struct imp_bytes b = {0};
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return io_error(ctx, path, "cannot open", errno);

    struct stat info;
    if (fstat(fd, &info) != 0) IMP_TRY(io_error(ctx, path, "cannot read", errno));
    if (S_ISDIR(info.st_mode)) IMP_TRY(io_error(ctx, path, "cannot read", EISDIR));
    size_t room = 1 << 16; /* pipes say 0 */
    if (!S_ISREG(info.st_mode)) limit = imp_min(limit, ENDLESS_MAX);
    else {
        if ((uint64_t)info.st_size > limit)
            IMP_TRY(imp__error(ctx, IMP_E_IO, "%s: longer than %zu bytes", path, limit));
        room = (size_t)info.st_size +
               2; /* one to see the end of the file, one for the zero */
    }
    for (;;) {
        if (b.size + room > b.capacity) {
            unsigned char *grown;
            if (!b.data) { /* exactly, not doubled */
                grown = imp__alloc_raw(ctx, room, 1);
                b.capacity = room;
            } else grown = imp__grow(ctx, b.data, &b.capacity, b.size + room, 1);
            if (!grown)
                IMP_TRY(
                    imp__error(ctx, IMP_E_NOMEM, "%s: no memory for its contents", path));
            b.data = grown;
        }
        const ssize_t n =
            read(fd, b.data + b.size, imp_min(b.capacity - b.size - 1, (size_t)1 << 30));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) IMP_TRY(io_error(ctx, path, "cannot read", errno));
        if (n == 0) break;
        if (S_ISCHR(info.st_mode) || S_ISBLK(info.st_mode))
            IMP_TRY(imp__error(ctx, IMP_E_IO,
                               "%s: a device is not read: it may never end", path));
        b.size += (size_t)n;
        if (b.size > limit)
            IMP_TRY(imp__error(ctx, IMP_E_IO, "%s: longer than %zu bytes", path, limit));
        room = b.capacity - b.size > 1 ? 1 : 1 << 16;
    }
    b.data[b.size] = 0;
    *out = b;
out:
    close(fd);
    if (st != IMP_OK) imp__bytes_free(ctx, &b);
    return st;
}

enum imp_status imp__file_read(imp_context *ctx, const char *path, size_t limit,
                               struct imp_bytes *out)
{
    struct imp_bytes bytes = {0};
    enum imp_status st = IMP_OK;
    const bool broadcasts = imp__team_broadcasts(ctx);
    if (!broadcasts || ctx->team->host.rank == 0)
        st = imp__file_read_own(ctx, path, limit, &bytes);
    if (broadcasts) st = imp__team_broadcast(ctx, st, &bytes);
    if (st != IMP_OK) return st;
    if (ctx->on_read)
        st = ctx->on_read(ctx->on_read_payload, path, bytes.data, bytes.size);
    if (st == IMP_OK) *out = bytes;
    else imp__bytes_free(ctx, &bytes);
    return st;
}

bool imp__file_exists(imp_context *ctx, const char *path)
{
    struct stat info;
    struct imp_bytes answer = {0};
    bool is = stat(path, &info) == 0;
    if (!imp__team_broadcasts(ctx)) return is;
    /* A failure shows at the next call of the team. */
    if (is && !imp__bytes_add(ctx, &answer, "y", 1)) is = false;
    if (imp__team_broadcast(ctx, IMP_OK, &answer) == IMP_OK) is = answer.size > 0;
    imp__bytes_free(ctx, &answer);
    return is;
}

enum imp_status imp__file_open(imp_context *ctx, const char *path, struct imp_bytes *held,
                               FILE **out)
{
    *out = NULL;
    *held = (struct imp_bytes){0};
    if (imp__team_broadcasts(ctx)) {
        if (!imp__file_exists(ctx, path)) return IMP_OK;
        const enum imp_status st = imp__file_read(ctx, path, SIZE_MAX / 2, held);
        if (st != IMP_OK) return st;
        *out = fmemopen(held->data, held->size, "rb");
    } else {
        *out = fopen(path, "rbe");
        if (!*out && errno == ENOENT) return IMP_OK;
    }
    if (*out) return IMP_OK;
    imp__bytes_free(ctx, held);
    char text[256];
    return imp__error(ctx, IMP_E_IO, "%s: %s", path,
                      strerror_r(errno, text, sizeof text));
}

static int write_all(int fd, const unsigned char *p, size_t size)
{
    while (size) {
        const ssize_t n = write(fd, p, imp_min(size, (size_t)1 << 30));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return n < 0 ? errno : EIO;
        p += n;
        size -= (size_t)n;
    }
    return 0;
}

static void flush(struct imp_file_writer *w)
{
    if (!w->error) w->error = write_all(w->fd, w->buffer, w->used);
    w->used = 0;
}

void imp__file_put(struct imp_file_writer *w, const void *data, size_t n)
{
    if (n > sizeof w->buffer - w->used) flush(w);
    if (n > sizeof w->buffer) {
        if (!w->error) w->error = write_all(w->fd, data, n);
    } else if (n) {
        memcpy(w->buffer + w->used, data, n);
        w->used += n;
    }
}

/* Returns errno, or 0. */
static int fill_all(int fd, void (*fill)(struct imp_file_writer *w, const void *payload),
                    const void *payload)
{
    struct imp_file_writer w;
    w.fd = fd;
    w.error = 0;
    w.used = 0;
    fill(&w, payload);
    flush(&w);
    return w.error;
}

/* A name beside `path` that is free: created, never opened over something. */
static int temporary_open(const char *path, mode_t mode, char *name, size_t size)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    for (unsigned k = 0; k < 100; k++) {
        snprintf(name, size, "%s.%lx%lx%x.tmp", path, (long)getpid(), now.tv_nsec, k);
        const int fd = open(name, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
        if (fd >= 0 || errno != EEXIST) return fd;
    }
    return -1;
}

/* The rename itself must survive a crash too; folders that cannot be synced are left. */
static void folder_sync(const char *path, char *scratch, size_t size)
{
    snprintf(scratch, size, "%s", path);
    char *slash = strrchr(scratch, '/');
    if (slash) slash[slash == scratch] = 0;
    const int fd = open(slash ? scratch : ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return;
    (void)fsync(fd);
    close(fd);
}

enum imp_status imp__file_write_by(imp_context *ctx, const char *path,
                                   void (*fill)(struct imp_file_writer *w,
                                                const void *payload),
                                   const void *payload)
{
    struct stat info;
    if (!imp__team_writes(ctx)) return IMP_OK;
    const bool exists = stat(path, &info) == 0;
    if (exists && S_ISDIR(info.st_mode))
        return io_error(ctx, path, "cannot write", EISDIR);
    if (exists && !S_ISREG(info.st_mode)) {
        const int fd = open(path, O_WRONLY | O_CLOEXEC);
        if (fd < 0) return io_error(ctx, path, "cannot open", errno);
        const int code = fill_all(fd, fill, payload);
        if (close(fd) != 0 || code) return io_error(ctx, path, "cannot write", code);
        return IMP_OK;
    }

    enum imp_status st = IMP_OK;
    char link[PATH_MAX]; /* write through symbolic links */
    const char *target = exists && realpath(path, link) ? link : path;
    const size_t room = strlen(target) + 64;
    char *name = imp__alloc(ctx, room, 1);
    int fd = -1, code = 0;
    if (!name) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", path));
    fd = temporary_open(target, 0666, name, room);
    if (fd < 0) IMP_TRY(io_error(ctx, path, "cannot create", errno));
    if (exists) (void)fchmod(fd, info.st_mode & 07777);
    code = fill_all(fd, fill, payload);
    if (!code && fsync(fd) != 0 && errno != EINVAL && errno != EROFS) code = errno;
    if (close(fd) != 0 && !code) code = errno;
    if (!code && rename(name, target) != 0) code = errno;
    if (code) {
        unlink(name);
        IMP_TRY(io_error(ctx, path, "cannot write", code));
    }
    if (name) folder_sync(target, name, room);
out:
    imp__release(ctx, name);
    return st;
}

struct parts {
    const struct imp_chunk *part;
    size_t n;
};
static void parts_fill(struct imp_file_writer *w, const void *payload)
{
    const struct parts *p = payload;
    for (size_t k = 0; k < p->n; k++) imp__file_put(w, p->part[k].data, p->part[k].size);
}

enum imp_status imp__file_write_parts(imp_context *ctx, const char *path,
                                      const struct imp_chunk *parts, size_t n)
{
    const struct parts p = {parts, n};
    return imp__file_write_by(ctx, path, parts_fill, &p);
}

enum imp_status imp__file_write(imp_context *ctx, const char *path, const void *data,
                                size_t size)
{
    return imp__file_write_parts(ctx, path, &(struct imp_chunk){data, size}, 1);
}
