/* SPDX-License-Identifier: Apache-2.0
 *
 * What all commands share: the options every one understands, the context and scene they
 * work on, and how they end. A command is a table entry (main.c) with its own option
 * table; its run function returns an exit code. */
#ifndef IMP_CLI_COMMAND_H
#define IMP_CLI_COMMAND_H

#include "text/args.h"
#include "text/json.h"
#include <importon/elements.h>
#include <stdio.h>

/* Exit codes; the manual page is the contract. */
enum {
    EXIT_DONE = 0,
    EXIT_NO = 1,       /* check, selftest, compare: the answer is no */
    EXIT_USAGE = 2,    /* usage or scene error */
    EXIT_RUN = 3,      /* the run failed */
    EXIT_SIGNAL = 128, /* and the number of the signal that interrupted the run */
    EXIT_STOP = -1     /* inside: end now, all is done */
};

/* Files that may carry a command, which merge and verify run again (replay.h). */
enum replays { REPLAYS_NEVER = 0, REPLAYS_PARTS = 1, REPLAYS_MANIFEST = 2 };

struct command {
    struct args_spec args;
    int (*run)(int n, char **operand);
    int prints;  /* all its data is text, so -o replaces standard output */
    int shared;  /* may run in several processes, by mpirun */
    int replays; /* enum replays, or-ed */
};
extern const struct command command_render, command_gradient, command_jacobian,
    command_check, command_selftest, command_fit, command_compare, command_info,
    command_bench, command_bend, command_elements, command_envmap, command_merge,
    command_report, command_read, command_verify, command_view, command_record,
    command_whatif, command_plan, command_measure, command_design;

/* Option tables, to be named in args_spec.group. -o is a file, or a folder for commands
 * that write several files. */
/* --part, of options_limits and of commands that have no other limits. */
#define OPTION_PART                                                                      \
    {                                                                                    \
        ARG_TEXT | ARG_ASIDE, 0, "part", "I/N",                                          \
            "compute part I of N (from 1), to the file of -o; 'importon merge' makes "   \
            "the whole",                                                                 \
            &cli.part, 0, 0, NULL                                                        \
    }
extern const struct arg_option options_file[], options_folder[], options_file_or_folder[],
    options_general[], options_scene[], options_run[], options_limits[], options_guide[];
/* options_run of a command that is of no single sensor. */
#define options_walks (options_run + 1)

/* The running command. A process runs one, so there is one. */
struct cli {
    const char *name; /* of the command */
    int argc;
    char **argv;           /* as typed, for provenance */
    struct arg_list typed; /* the options of it, spelled out */
    int n_operands;
    char **operand;
    /* options_general */
    const char *out;
    int threads, json, progress, help, quiet, overwrite;
    /* options_scene */
    struct arg_list defines, sets, luminaires;
    const char *search, *weights, *bins;
    int mode, dump;
    int lenient; /* enum imp_lenience; an option sets 1, IMP_LENIENT_WARN */
    /* options_run */
    int sensor, spp;
    int brief; /* spp are all that the scene's runs will take: set before cli_load */
    const char *sensor_text; /* --sensor, until the scene is there */
    uint64_t seed;
    double time_s;
    const char *manifest_path;
    int no_manifest;        /* none beside an output file */
    imp_manifest *manifest; /* in the making, or what is verified */
    const char *carried;    /* the file that carries this command; NULL: it was typed */
    int verifies;           /* results are compared, and not written */
    int mpi_files;          /* how ranks read files: as it is written */
    const char *part, *part_out; /* "I/N", and where it goes */
    imp_parts *parts;            /* the part in the making, or those that are merged */
    int upsampling, wavelengths, wavelength_set, from, points;
    const char *display; /* HOST:PORT of a viewer */
    /* options_guide */
    int guide;
    double guide_share, guide_roulette;
    /* what cli_load opened */
    const char *scene_path;
    imp_context *context;
    imp_scene *scene;
    imp_elements *elements; /* behind the guide, NULL: none */
    imp_guide *guiding;
};
extern struct cli cli;

/* The command of this name, or NULL. */
const struct command *cli_command(const char *name);
/* Run a command as if typed: argv[0] is its name. Returns an exit code. */
int cli_run_command(int argc, char **argv);

/* Does this process print answers and write files? */
int cli_writes(void);

/* Make the context, unless there is one. 0, or an exit code with the reason printed. */
int cli_open(void);
/* Make the context, load the scene ("-": from stdin), apply --set. 0, EXIT_STOP after
 * --dump, or an exit code. */
int cli_load(const char *path);
void cli_close(void);
/* As -m has it. */
const char *cli_mode_word(enum imp_color_mode mode);
/* From here on, what is printed goes to -o, if there is one. 0, or an exit code. */
int cli_redirect(void);

/* The run of the options. */
struct imp_run cli_run(void);
/* Samples per pixel that `run` will take. */
int cli_spp(const struct imp_run *run);

/* Print "importon: what: message of the last error" and return the exit code that belongs
 * to `status`. `what` NULL: without it. */
int cli_fail(enum imp_status status, const char *what);
/* Print "importon: message" and return `code`. */
int cli_error(int code, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* IMP_OK and IMP_CANCELLED go on; anything else has failed. */
static inline int cli_failed(enum imp_status status)
{
    return status != IMP_OK && status != IMP_CANCELLED;
}
/* The exit code of a run that was not refused: 130 after Ctrl-C. */
int cli_done(void);

/* Behind the word for what is counted: "1 sample", "2 samples". */
static inline const char *plural(long long n) { return n == 1 ? "" : "s"; }

/* Was the option --name given with a value? */
bool cli_typed(const char *name);

/* Talk on stderr, unless --quiet. */
void cli_say(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Start a JSON answer with "importon" and "command"; end it with a newline. */
struct json cli_json(void);
void cli_json_end(struct json *j);

/* Seconds on a monotonic clock. */
double cli_now(void);

/* malloc that ends the process when there is no memory; the cli may. */
void *cli_alloc(size_t n, size_t size);
/* strdup, the same. */
char *cli_strdup(const char *text);
/* A copy without control characters, for a terminal. */
char *cli_plain(const char *text);

/* "name" of a parameter, or "name[element]" when it has several values. */
const char *cli_number_name(const struct imp_param_info *info, size_t element, char *text,
                            size_t size);
/* The same as a row's title: with the wavelength, where it is a sample of a spectrum. */
const char *cli_number_row(const struct imp_param_info *info, size_t element, char *text,
                           size_t size);

#endif
