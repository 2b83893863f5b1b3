/* SPDX-License-Identifier: Apache-2.0
 *
 * Writing of output files: through a temporary file that is renamed, or to standard
 * output. */
#include "output.h"

#include "command.h"
#include "proof.h"

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int failed(const char *path, int code)
{
    return cli_error(EXIT_RUN, "%s: cannot write: %s", path, strerror(code ? code : EIO));
}

/* What a new file may be, as open() would make it. */
static mode_t new_mode(void)
{
    const mode_t mask = umask(0);
    umask(mask);
    return 0666 & ~mask;
}

int output_open(struct output *o, const char *path, enum output_kind kind)
{
    struct stat info;
    *o = (struct output){.path = path};
    const int rc = overwrite_check(path, kind);
    if (rc) return rc;
    if (!cli_writes()) path = "/dev/null";
    if (!strcmp(path, "-")) {
        o->file = stdout;
        return 0;
    }
    const int exists = stat(path, &info) == 0;
    if (exists && !S_ISREG(info.st_mode)) {
        o->file = fopen(path, "w");
        return o->file ? 0 : failed(path, errno);
    }
    o->target = exists ? realpath(path, NULL) : strdup(path);
    if (!o->target) return failed(path, errno);
    const size_t n = strlen(o->target) + 8;
    o->temporary = cli_alloc(n, 1);
    snprintf(o->temporary, n, "%s.XXXXXX", o->target);
    const int fd = mkstemp(o->temporary);
    if (fd >= 0) (void)!fchmod(fd, exists ? info.st_mode & 07777 : new_mode());
    if (fd >= 0 && !(o->file = fdopen(fd, "w"))) {
        close(fd);
        unlink(o->temporary);
    }
    if (o->file) return 0;
    const int code = errno;
    free(o->target);
    free(o->temporary);
    return failed(path, code);
}

int output_close(struct output *o, int rc)
{
    int code = 0;
    if (!o->file) return rc;
    if (o->file == stdout) return rc; /* its end is everybody's */
    errno = 0;
    if (fflush(o->file) != 0 || ferror(o->file)) code = errno ? errno : EIO;
    if (!code && o->target && !rc && fsync(fileno(o->file)) != 0 && errno != EINVAL)
        code = errno;
    if (fclose(o->file) != 0 && !code) code = errno;
    if (o->target && !code && !rc && rename(o->temporary, o->target) != 0) code = errno;
    if (o->target && (code || rc)) unlink(o->temporary);
    else if (o->target) manifest_wrote(o->path);
    free(o->target);
    free(o->temporary);
    o->file = NULL;
    return code && !rc ? failed(o->path, code) : rc;
}
