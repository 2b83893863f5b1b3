/* SPDX-License-Identifier: Apache-2.0
 *
 * Reading and writing of whole files. A file is written beside its final name and
 * renamed, so that no reader meets half of it. */
#include "file.h"
#include "team.h"
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <time.h>
#include <unistd.h>

/* Most bytes read from a pipe, which has no size and may never end. */
#define ENDLESS_MAX ((size_t)1 << 28)

/* A pipe with a name into which nobody writes, and any in which nothing comes, is given up. */
#define WRITER_S 10
#define SILENT_S 60

#define PIPES 0x50495045 /* statfs: pipes without a name, whose writer was there before */

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

enum imp_status imp__unpacks(imp_context *ctx, const char *name, double packed,
                             double unpacked, double always)
{
    if (unpacked <= always || unpacked <= IMP_UNPACKS_TO * packed) return IMP_OK;
    return imp__error(ctx, IMP_E_SCENE,
                      "%s: %.0f bytes would become %.0f, more than %d times as many: "
                      "refused",
                      name, packed, unpacked, IMP_UNPACKS_TO);
}

/* Pipes are opened without waiting for a writer, and waited for with an end. */
static enum imp_status pipe_wait(imp_context *ctx, const char *path, int fd, int seconds,
                                 bool *came)
{
    struct pollfd p = {.fd = fd, .events = POLLIN};
    int n;
    do n = poll(&p, 1, 1000 * seconds);
    while (n < 0 && errno == EINTR);
    *came = n > 0;
    return n < 0 ? io_error(ctx, path, "cannot read", errno) : IMP_OK;
}

/* As read(), of a pipe: waits for a writer, and for its bytes. `begun`: there was a writer. */
static enum imp_status pipe_read(imp_context *ctx, const char *path, int fd, void *to,
                                 size_t room, bool *begun, ssize_t *n)
{
    for (int waited = 0;;) {
        bool came;
        *n = read(fd, to, room);
        if (*n < 0 && errno == EINTR) continue;
        const bool silent = *n < 0 && errno == EAGAIN; /* there is a writer */
        *begun |= *n > 0 || silent;
        if (!silent && (*n != 0 || *begun)) return IMP_OK;
        const int limit = silent ? SILENT_S : WRITER_S;
        if (waited >= limit)
            return imp__error(ctx, IMP_E_IO,
                              "%s: nothing came through this pipe for %d s", path, limit);
        const enum imp_status st = pipe_wait(ctx, path, fd, limit - waited, &came);
        if (st != IMP_OK) return st;
        if (came) *begun = true;
        else waited = limit;
    }
}

/* More than this machine has, or holes: what no disk holds is not read into memory. */
static enum imp_status size_check(imp_context *ctx, const char *path, int fd,
                                  const struct stat *info)
{
    const double size = (double)info->st_size,
                 memory = (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGESIZE);
    if (memory > 0 && size > memory)
        return imp__error(ctx, IMP_E_NOMEM,
                          "%s: %.0f bytes, and this machine has %.0f of memory", path,
                          size, memory);
    double held = 512.0 * (double)info->st_blocks;
    if (held == 0 && lseek(fd, 0, SEEK_DATA) == 0)
        held = size; /* blocks are not counted here */
    return imp__unpacks(ctx, path, held, size, 0x1p30);
}

enum imp_status imp__file_read_own(imp_context *ctx, const char *path, size_t limit,
                                   struct imp_bytes *out)
{
    enum imp_status st = IMP_OK;
    struct imp_bytes b = {0};
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0) return io_error(ctx, path, "cannot open", errno);

    struct stat info;
    struct statfs where;
    bool begun = fstatfs(fd, &where) == 0 && where.f_type == PIPES;
    if (fstat(fd, &info) != 0) IMP_TRY(io_error(ctx, path, "cannot read", errno));
    if (S_ISDIR(info.st_mode)) IMP_TRY(io_error(ctx, path, "cannot read", EISDIR));
    size_t room = 1 << 16; /* pipes say 0 */
    if (!S_ISREG(info.st_mode)) limit = imp_min(limit, ENDLESS_MAX);
    else {
        if ((uint64_t)info.st_size > limit)
            IMP_TRY(imp__error(ctx, IMP_E_IO, "%s: longer than %zu bytes", path, limit));
        IMP_TRY(size_check(ctx, path, fd, &info));
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
        ssize_t n;
        void *const to = b.data + b.size;
        const size_t most = imp_min(b.capacity - b.size - 1, (size_t)1 << 30);
        if (!S_ISFIFO(info.st_mode)) n = read(fd, to, most);
        else IMP_TRY(pipe_read(ctx, path, fd, to, most, &begun, &n));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0 &&
            errno == EAGAIN) { /* a terminal, whose first line is refused below */
            (void)fcntl(fd, F_SETFL, 0);
            continue;
        }
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
        const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
        if (fd < 0 && errno == ENOENT) return IMP_OK;
        struct stat info;
        if (fd >= 0 && fstat(fd, &info) == 0 && !S_ISREG(info.st_mode)) {
            close(fd);
            return imp__error(ctx, IMP_E_IO, "%s: this is no regular file", path);
        }
        *out = fd >= 0 ? fdopen(fd, "rb") : NULL;
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
