/* SPDX-License-Identifier: Apache-2.0
 *
 * Lines of commands that parts and manifests carry. The bytes are such a line, behind one that
 * says of which kind its file is. A line that is taken sets nothing but what its kind of file may
 * carry, and the parser of options agrees about every word. */
#include "shared/command.h"
#include "shared/ranks.h"
#include "shared/replay.h"
#include "shared/settings.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* ---- A command of every type of option ------------------------------------------------- */

static struct {
    int flag, whole, choice, pair[2], overwrite, pixel[2];
    uint64_t seed;
    double number;
    const char *text, *out, *display;
    struct arg_list list, sets;
} good, bad;

static const char *const words[] = {"one", "two", NULL};
static const struct arg_option options[] = {
    {ARG_FLAG | ARG_REPLAYS, 'e', "se", NULL, "", &good.flag, 0, 0, NULL},
    {ARG_INT | ARG_REPLAYS, 0, "spp", "N", "", &good.whole, 1, 1e9, NULL},
    {ARG_SEED | ARG_REPLAYS, 0, "seed", "N", "", &good.seed, 0, 0, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "until", "R", "", &good.number, 0, 0, NULL},
    {ARG_TEXT | ARG_REPLAYS, 'a', "search", "DIR", "", &good.text, 0, 0, NULL},
    {ARG_LIST | ARG_REPLAYS, 'D', "define", "X", "", &good.list, 0, 0, NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "set", "X", "", &good.sets, 0, 0, NULL},
    {ARG_CHOICE | ARG_REPLAYS, 'm', "mode", "M", "", &good.choice, 0, 0, words},
    {ARG_PAIR | ARG_REPLAYS, 0, "place", "X,Y", "", good.pair, 0, 0, NULL},
    {ARG_FLAG | ARG_ASIDE, 0, "overwrite", NULL, "", &bad.overwrite, 0, 0, NULL},
    {ARG_TEXT | ARG_ASIDE, 'o', "output", "FILE", "", &bad.out, 0, 0, NULL},
    {ARG_TEXT | ARG_ASIDE, 0, "display", "PLACE", "", &bad.display, 0, 0, NULL},
    {ARG_LIST, 0, "export", "FILE", "", &bad.list, 0, 0, NULL},
    {ARG_PAIR, 0, "pixel", "X,Y", "", bad.pixel, 0, 0, NULL},
    {0}};
static const struct command commands[] = {
    {{"render", "SCENE", "", {options}, 1, 1}, NULL, 0, 0, REPLAYS_PARTS},
    {{"fit", "SCENE", "", {options}, 1, 1}, NULL, 0, 0, REPLAYS_MANIFEST},
    {{"report", "DIR", "", {options}, 1, 1}, NULL, 0, 0, REPLAYS_NEVER}};

/* ---- What cli/shared/replay.c has from the command --------------------------------------- */

struct cli cli;
static int said;

const struct command *cli_command(const char *name)
{
    for (size_t k = 0; k < sizeof commands / sizeof *commands; k++)
        if (!strcmp(commands[k].args.command, name)) return &commands[k];
    return NULL;
}
void *cli_alloc(size_t n, size_t size)
{
    void *p = calloc(n ? n : 1, size);
    if (!p) abort();
    return p;
}
int cli_error(int code, const char *format, ...)
{
    char text[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    said = strstr(text, "file.part") != NULL;
    return code;
}
bool ranks_first(void) { return true; }
const char *settings_hold(const char *path, size_t *length)
{
    (void)path;
    *length = 0;
    return NULL;
}

/* ---- The target ------------------------------------------------------------------------ */

static void must(int is)
{
    if (!is) abort();
}

static void typed_free(struct arg_list *typed)
{
    for (size_t k = 0; k < typed->n; k++) free((void *)(uintptr_t)typed->item[k]);
    args_list_free(typed);
    args_list_free(&good.list);
    args_list_free(&good.sets);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0) return 0;
    const enum replays kind = data[0] & 1 ? REPLAYS_MANIFEST : REPLAYS_PARTS;
    char *line = cli_alloc(size, 1), **argv = NULL;
    int argc = 0, first;
    memcpy(line, data + 1, size - 1);
    said = 0;
    const int rc = replay_words("file.part", kind, line, &argc, &argv);
    must(rc ? said && !argv : argv && argc > 0 && !argv[argc]);
    if (!rc) {
        struct arg_list typed = {0};
        char *const memory = argv[0];
        const struct command *command = cli_command(argv[0]);
        must(command && command->replays & kind);
        /* A value may still be no good: the parser says so, and nothing runs. */
        FILE *nothing = freopen("/dev/null", "w", stderr);
        must(nothing != NULL);
        if (args_parse(&command->args, argc, argv, &first, &typed) == 0) {
            must(argc - first == 1 && *argv[first]);
            for (size_t k = 0; k < good.sets.n; k++) must(*good.sets.item[k] != '@');
            /* Written again, it is the same command. */
            cli.name = command->args.command;
            cli.typed = typed;
            cli.operand = argv + first;
            cli.n_operands = 1;
            must(!replay_unfit());
            char *again = replay_line(), **same = NULL;
            int n = 0;
            must(again && replay_words("file.part", kind, again, &n, &same) == 0);
            must((size_t)n == typed.n + 3);
            free(same[0]);
            free(same);
            free(again);
        }
        must(!bad.overwrite && !bad.out && !bad.display && !bad.list.n && !bad.pixel[0]);
        typed_free(&typed);
        free(memory);
        free(argv);
    }
    free(line);
    return 0;
}
