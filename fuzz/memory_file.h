/* SPDX-License-Identifier: Apache-2.0
 *
 * What targets need whose reader takes a path: files in memory, and the bytes of a good file. */
#ifndef IMP_FUZZ_MEMORY_FILE_H
#define IMP_FUZZ_MEMORY_FILE_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

struct memory_file {
    int fd;
    char path[64];
};

static inline void memory_file_open(struct memory_file *m)
{
    m->fd = memfd_create("fuzz", 0);
    if (m->fd < 0) abort();
    snprintf(m->path, sizeof m->path, "/proc/self/fd/%d", m->fd);
}

/* These bytes, and no others. */
static inline void memory_file_put(const struct memory_file *m, const void *bytes,
                                   size_t n)
{
    if (ftruncate(m->fd, 0) != 0 || pwrite(m->fd, bytes, n, 0) != (ssize_t)n) abort();
}

/* A name for the good file that the target writes; its bytes, fewer than `most`, when it has
 * removed it. */
static inline void good_file_name(char name[64])
{
    snprintf(name, 64, "fuzz.%ld.tmp", (long)getpid());
}
static inline size_t good_file_take(const char *name, void *bytes, size_t most)
{
    FILE *f = fopen(name, "rb");
    if (!f) abort();
    const size_t n = fread(bytes, 1, most, f);
    fclose(f);
    remove(name);
    if (n == most) abort();
    return n;
}

#endif
