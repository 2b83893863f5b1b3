/* SPDX-License-Identifier: Apache-2.0
 *
 * May an existing file be replaced by an output? Its first bytes decide. */
#include "overwrite.h"

#include "command.h"
#include "picture_files.h"
#include "ranks.h"
#include "text/progress.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define HEAD 65536 /* bytes looked at; the header of an EXR file holds command lines */

/* Files of a kind begin with one of `begins`, and hold `holds`. */
static const struct {
    const char *name;
    const char *begins[5];
    const char *holds;
} kinds[] = {
    [OUTPUT_ANSWER] = {"an answer of this command", {"{\"importon\":"}, NULL},
    [OUTPUT_CHECKPOINT] = {"a checkpoint", {"importon checkpoint "}, NULL},
    [OUTPUT_SOLUTION] = {"a saved solution", {"IMPELEM"}, NULL},
    [OUTPUT_PART] = {"a part of a run", {"impparts"}, NULL},
    [OUTPUT_RECORD] = {"a record of walks", {"impdrawn"}, NULL},
    [OUTPUT_MANIFEST] = {"a manifest", {"impproof"}, NULL},
    [OUTPUT_SETTINGS] = {"a list of settings (ID=VALUE)", {NULL}, NULL},
    [OUTPUT_TABLE] = {"a table of importon's",
                      {"iteration,loss,se\n", "evaluation,objective\n", "ray,bundle,x,y,",
                       "file,mean,se,"},
                      NULL},
    [OUTPUT_CURVE] = {"a curve of importon's", {"<svg "}, "viewBox=\"0 0 720 440\""},
    [OUTPUT_JSON] = {"an answer of importon's in JSON", {"{\"importon\":"}, NULL},
    [OUTPUT_WALKS] = {"a list of walks", {"{\"pixel\":["}, NULL},
    [OUTPUT_PAGE] = {"a report of importon's",
                     {"<!doctype html>"},
                     "<title>importon report"},
    [OUTPUT_PLY] = {"a mesh of importon's", {"ply\n"}, "comment importon"},
    [OUTPUT_VOL] = {"a volume (.vol)", {"VOL"}, NULL},
    [OUTPUT_PROFILE] = {"a profile of importon's", {"importon-profile"}, NULL},
    [OUTPUT_EXR] = {"an EXR picture of importon's", {"\x76\x2f\x31\x01"}, "importon."},
    [OUTPUT_PNG] = {"a PNG picture of importon's", {"\x89PNG"}, "importon"},
    [OUTPUT_PFM] = {"a PFM picture", {"PF\n", "Pf\n"}, NULL},
    [OUTPUT_HDR] = {"an HDR picture", {"#?"}, NULL},
    [OUTPUT_NPY] = {"an array (.npy)", {"\x93NUMPY"}, NULL},
};

/* Files that this command reads, by what does not depend on their spelling. */
static struct {
    struct {
        dev_t device;
        ino_t number;
    } * file;
    size_t n;
} inputs;

void overwrite_protect(const char *path)
{
    struct stat info;
    if (stat(path, &info) != 0 || !S_ISREG(info.st_mode)) return;
    void *grown = realloc(inputs.file, (inputs.n + 1) * sizeof *inputs.file);
    if (!grown) exit(cli_error(EXIT_RUN, "out of memory"));
    inputs.file = grown;
    inputs.file[inputs.n].device = info.st_dev;
    inputs.file[inputs.n++].number = info.st_ino;
}

static bool is_input(const struct stat *info)
{
    for (size_t i = 0; i < inputs.n; i++)
        if (inputs.file[i].device == info->st_dev &&
            inputs.file[i].number == info->st_ino)
            return true;
    return false;
}

static bool begins(const char *head, size_t n, const char *with)
{
    const size_t m = strlen(with);
    return n >= m && !memcmp(head, with, m);
}

/* Does the first line read name=number? */
static bool is_setting(const char *head)
{
    const size_t name = strcspn(head, "= \t\n<>\"");
    return name > 0 && head[name] == '=' && head[name + 1] &&
           strchr("0123456789-+.", head[name + 1]);
}

static bool is_kind(enum output_kind kind, const char *head, size_t n)
{
    bool good = false;
    if (kind == OUTPUT_SETTINGS) return is_setting(head);
    for (const char *const *with = kinds[kind].begins; *with; with++)
        good |= begins(head, n, *with);
    if (kind == OUTPUT_ANSWER && !good) {
        const char *phrase = cli.answer, *line = strchr(head, '\n');
        const char *found = phrase ? strstr(head, phrase) : NULL;
        return is_setting(head) || (found && line && found < line);
    }
    if (!kinds[kind].holds) return good;
    return good && memmem(head, n, kinds[kind].holds, strlen(kinds[kind].holds));
}

static int cannot(const char *path, int code)
{
    return cli_error(EXIT_RUN, "%s: cannot write: %s", path, strerror(code));
}

/* Files are written beside their place and renamed, so their folder takes new ones. */
static int folder_check(const char *path)
{
    const char *slash = strrchr(path, '/');
    char *folder = slash ? strndup(path, (size_t)(slash - path + 1)) : strdup(".");
    if (!folder) return cli_error(EXIT_RUN, "out of memory");
    const int rc =
        access(folder, W_OK | X_OK) == 0
            ? 0
            : cli_error(EXIT_RUN, "%s: cannot create: %s", path, strerror(errno));
    free(folder);
    return rc;
}

int overwrite_check(const char *path, enum output_kind kind)
{
    struct stat info;
    if (!strcmp(path, "-") || !cli_writes()) return 0;
    if (stat(path, &info) != 0) return folder_check(path);
    if (S_ISDIR(info.st_mode)) return cannot(path, EISDIR);
    if (!S_ISREG(info.st_mode)) return 0;
    if (is_input(&info))
        return cli_error(EXIT_USAGE,
                         "%s: not overwritten: it is an input of this command", path);
    const int rc = folder_check(path);
    if (rc || cli.overwrite || info.st_size == 0) return rc;

    FILE *file = fopen(path, "rb");
    if (!file) return cannot(path, errno);
    char *head = cli_alloc(HEAD + 1, 1);
    const size_t n = fread(head, 1, HEAD, file);
    const bool good = is_kind(kind, head, n);
    fclose(file);
    free(head);
    if (good) return 0;
    return cli_error(EXIT_USAGE,
                     "%s: not overwritten: it exists and is not %s (--overwrite "
                     "replaces it)",
                     path, kinds[kind].name);
}

int overwrite_check_in(const char *folder, const char *name, enum output_kind kind)
{
    char *path = join_path(folder, name);
    const int rc = overwrite_check(path, kind);
    free(path);
    return rc;
}

int checkpoint_writable(const char *path, bool resume)
{
    struct stat info;
    const int rc = path ? overwrite_check(path, OUTPUT_CHECKPOINT) : 0;
    if (rc || !path || resume || cli.overwrite || !ranks_first()) return rc;
    if (stat(path, &info) != 0 || !S_ISREG(info.st_mode) || info.st_size == 0) return 0;
    return cli_error(EXIT_USAGE,
                     "%s: there is a checkpoint already: go on from it with --resume, or "
                     "begin anew with --overwrite",
                     path);
}

void checkpoint_hint(const char *path)
{
    const char *ended;
    if (!progress_interrupted() && !ranks_ended(&ended)) return;
    if (path) cli_say("importon: interrupted; go on from %s with --resume", path);
    else cli_say("importon: interrupted; with --checkpoint FILE a fit can be resumed");
}
