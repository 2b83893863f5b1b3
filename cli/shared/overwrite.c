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

#define HEAD 65536 /* bytes read; the header of an EXR file contains command lines */

/* Files of a kind begin with one of `begins`, and hold the mark in their first `within` bytes; 0:
 * at their end. The mark is written by this program alone: the format's own magic is none. */
#define MARK(text) text, sizeof text - 1
static const struct {
    const char *name;
    const char *begins[6];
    const char *mark;
    size_t mark_bytes, within;
} kinds[] = {
    [OUTPUT_ANSWER] =
        {"an answer of importon's", {"{\"importon\":", "# importon "}, NULL, 0, 0},
    [OUTPUT_CHECKPOINT] = {"a checkpoint", {"importon checkpoint "}, NULL, 0, 0},
    [OUTPUT_SOLUTION] = {"a saved solution", {"IMPELEM"}, NULL, 0, 0},
    [OUTPUT_PART] = {"a part of a run", {"impparts"}, NULL, 0, 0},
    [OUTPUT_RECORD] = {"a record of walks", {"impdrawn"}, NULL, 0, 0},
    [OUTPUT_MANIFEST] = {"a manifest", {"impproof"}, NULL, 0, 0},
    [OUTPUT_SETTINGS] = {"a list of settings of importon's", {"# importon "}, NULL, 0, 0},
    [OUTPUT_SCENE] = {"a scene of importon's",
                      {"<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<!-- importon "},
                      NULL,
                      0,
                      0},
    [OUTPUT_TABLE] = {"a table of importon's",
                      {"iteration,loss,se\n", "evaluation,objective\n", "ray,bundle,x,y,",
                       "file,mean,se,", "column,row,x,y,z,value,se\n"},
                      NULL,
                      0,
                      0},
    [OUTPUT_CURVE] = {"a curve of importon's",
                      {"<svg "},
                      MARK(">\n<metadata>importon</metadata>\n"),
                      512},
    [OUTPUT_JSON] = {"an answer of importon's in JSON", {"{\"importon\":"}, NULL, 0, 0},
    [OUTPUT_WALKS] = {"a list of walks", {"{\"pixel\":["}, NULL, 0, 0},
    [OUTPUT_PAGE] = {"a report of importon's",
                     {"<!doctype html>"},
                     MARK("<title>importon report"),
                     HEAD},
    [OUTPUT_PLY] = {"a mesh of importon's",
                    {"ply\n"},
                    MARK("\ncomment importon finite elements\n"),
                    512},
    [OUTPUT_VOL] = {"a volume of importon's", {"VOL"}, MARK("importon"), 0},
    [OUTPUT_PROFILE] = {"a profile of importon's", {"importon-profile"}, NULL, 0, 0},
    [OUTPUT_EXR] = {"an EXR picture of importon's",
                    {"\x76\x2f\x31\x01"},
                    MARK("importon.version\0string\0"),
                    HEAD},
    [OUTPUT_PNG] = {"a PNG picture of importon's",
                    {"\x89PNG"},
                    MARK("tEXtSoftware\0importon "),
                    512},
    [OUTPUT_PFM] = {"a PFM picture of importon's",
                    {"PF\n", "Pf\n"},
                    MARK("\n-0.1e+1\n"),
                    64},
    [OUTPUT_HDR] =
        {"an HDR picture of importon's", {"#?RADIANCE\n# importon\n"}, NULL, 0, 0},
    [OUTPUT_NPY] = {"an array of importon's", {"\x93NUMPY"}, MARK(" \t\t\t\t\n"), 128},
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

/* Does the file end with the mark? */
static bool ends(FILE *file, const char *mark, size_t m)
{
    char tail[64];
    return m <= sizeof tail && fseek(file, -(long)m, SEEK_END) == 0 &&
           fread(tail, 1, m, file) == m && !memcmp(tail, mark, m);
}

static bool is_kind(enum output_kind kind, FILE *file)
{
    const size_t m = kinds[kind].mark_bytes, within = kinds[kind].within;
    char *head = cli_alloc(HEAD + 1, 1);
    const size_t n = fread(head, 1, HEAD, file);
    bool good = false;
    for (const char *const *with = kinds[kind].begins; *with; with++)
        good |= begins(head, n, *with);
    if (good && m)
        good = within ? memmem(head, n < within ? n : within, kinds[kind].mark, m) != NULL
                      : ends(file, kinds[kind].mark, m);
    free(head);
    return good;
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
    const bool good = is_kind(kind, file);
    fclose(file);
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
    int rc = path ? overwrite_check(path, OUTPUT_CHECKPOINT) : 0;
    if (!rc && path && !cli.verifies) { /* of all ranks */
        const enum imp_status st = imp_checkpoint_free(cli.context, path);
        if (st != IMP_OK) rc = cli_fail(st, NULL);
    }
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
    if (path)
        cli_say("importon: interrupted; --checkpoint %s --resume goes on from there",
                path);
    else cli_say("importon: interrupted; with --checkpoint FILE a fit can be resumed");
}
