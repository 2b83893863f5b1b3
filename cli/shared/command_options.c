/* SPDX-License-Identifier: Apache-2.0
 *
 * Options that commands share. Which of them a part or a manifest may carry is decided here, too:
 * ARG_REPLAYS in the entry (text/args.h). */
#include "command.h"

/* In the order of enum imp_color_mode. */
static const char *const mode_words[] = {"rgb", "mono", "spectral", "single", NULL};
static const char *const wavelength_words[] = {"stratified", "independent", "importance",
                                               NULL};
static const char *const files_words[] = {"broadcast", "shared", NULL};
static const char *const from_words[] = {"scene", "sensor", "lights", NULL};
static const char *const upsampling_words[] = {"sigmoid", "linear", NULL};
static const char *const point_words[] = {"scene", "independent", "sobol", "whole", NULL};
static const char *const progress_words[] = {"auto", "always", "never", NULL};

const struct arg_option options_file[] = {{ARG_TEXT | ARG_ASIDE, 'o', "output", "FILE",
                                           "output file; '-' is standard output",
                                           &cli.out, 0, 0, NULL},
                                          {0}};
const struct arg_option options_folder[] = {
    {ARG_TEXT | ARG_ASIDE, 'o', "output", "DIR", "output folder", &cli.out, 0, 0, NULL},
    {0}};
const struct arg_option options_file_or_folder[] = {
    {ARG_TEXT | ARG_ASIDE, 'o', "output", "PATH",
     "output: a file for trace and check, a folder for fit and view", &cli.out, 0, 0,
     NULL},
    {0}};

const struct arg_option options_general[] = {
    {ARG_FLAG | ARG_ASIDE, 0, "overwrite", NULL,
     "replace files of another kind, and older checkpoints", &cli.overwrite, 0, 0, NULL},
    {ARG_INT | ARG_ASIDE, 't', "threads", "N", "threads; 0: all cores (default)",
     &cli.threads, 0, 4096, NULL},
    {ARG_FLAG | ARG_ASIDE, 0, "json", NULL, "print JSON", &cli.json, 0, 0, NULL},
    {ARG_CHOICE | ARG_ASIDE, 0, "progress", "WHEN",
     "auto (on a terminal), always or never", &cli.progress, 0, 0, progress_words},
    {ARG_FLAG | ARG_ASIDE, 'q', "quiet", NULL,
     "print only errors on standard error, and no progress bar", &cli.quiet, 0, 0, NULL},
    {ARG_FLAG | ARG_ASIDE, 'h', "help", NULL, "print this text", &cli.help, 0, 0, NULL},
    {0}};

const struct arg_option options_scene[] = {
    {ARG_LIST | ARG_REPLAYS, 'D', "define", "NAME=VALUE",
     "set a $parameter of the scene file", &cli.defines, 0, 0, NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "set", "ID=V[,V..]",
     "set a scene parameter ('importon info' lists them, and NAME.pose and other numbers "
     "of "
     "geometry); @FILE: many",
     &cli.sets, 0, 0, NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "luminaire", "NAME=FILE",
     "another photometric file for luminaires (emitters ies) of this name, or pattern",
     &cli.luminaires, 0, 0, NULL},
    {ARG_TEXT | ARG_REPLAYS, 'a', "search", "DIR[;DIR..]",
     "more folders to search for files", &cli.search, 0, 0, NULL},
    {ARG_CHOICE | ARG_REPLAYS, 'm', "mode", "MODE",
     "colour: rgb (default), mono, spectral or single", &cli.mode, 0, 0, mode_words},
    {ARG_CHOICE | ARG_REPLAYS, 0, "upsampling", "HOW",
     "with -m spectral, single: colours become spectra by a sigmoid (default), or by a "
     "linear basis",
     &cli.upsampling, 0, 0, upsampling_words},
    {ARG_TEXT | ARG_REPLAYS, 0, "bins", "FROM,TO,N",
     "with -m spectral, single: pictures have N bins of wavelengths in nm as channels",
     &cli.bins, 0, 0, NULL},
    {ARG_TEXT | ARG_REPLAYS, 0, "weights", "NAME=W[,..]",
     "densities of directions, in place of those of the scene file: kernel, emitters, "
     "environment, proxies, guide, uniform",
     &cli.weights, 0, 0, NULL},
    {ARG_FLAG | ARG_REPLAYS, 0, "lenient", NULL,
     "continue without plugins and properties that this version does not have",
     &cli.lenient, 0, 0, NULL},
    {ARG_FLAG, 0, "dump", NULL, "print the parameters and their values, and stop",
     &cli.dump, 0, 0, NULL},
    {0}};

const struct arg_option options_run[] =
    {/* --sensor first: options_walks */
     {ARG_TEXT | ARG_REPLAYS, 's', "sensor", "SENSOR", "its name, or its index from 0",
      &cli.sensor_text, 0, 0, NULL},
     {ARG_INT | ARG_REPLAYS, 0, "spp", "N",
      "samples per pixel (default: those of the scene)", &cli.spp, 1, 1e9, NULL},
     {ARG_SEED | ARG_REPLAYS, 0, "seed", "N", "seed of the random numbers (default 0)",
      &cli.seed, 0, 0, NULL},
     {ARG_CHOICE | ARG_ASIDE, 0, "mpi-files", "HOW",
      "with mpirun: broadcast (default: rank 0 reads files for all) or shared (each "
      "does)",
      &cli.mpi_files, 0, 0, files_words},
     {ARG_CHOICE | ARG_REPLAYS, 0, "wavelengths", "HOW",
      "with -m spectral, single: stratified (default), independent, or importance",
      &cli.wavelengths, 0, 0, wavelength_words},
     {ARG_INT | ARG_REPLAYS, 0, "wavelength-set", "N",
      "samples among which they are stratified (default: a quarter, at most 16)",
      &cli.wavelength_set, 1, 1e9, NULL},
     {ARG_TEXT | ARG_ASIDE, 0, "display", "HOST:PORT",
      "show pictures in a viewer that listens there (tev: port 14158)", &cli.display, 0,
      0, NULL},
     {ARG_CHOICE | ARG_REPLAYS, 0, "from", "END",
      "where walks begin: scene (by its integrator, default), sensor, or lights (light "
      "tracing)",
      &cli.from, 0, 0, from_words},
     {ARG_CHOICE | ARG_REPLAYS, 0, "points", "KIND",
      "random numbers of a pixel's samples: independent, sobol, or scene (default: those "
      "of the scene's sampler; where it is independent, or none, what has least noise); "
      "of "
      "render also whole: sobol with less noise, and up to 192 samples no standard "
      "errors",
      &cli.points, 0, 0, point_words},
     {0}};

const struct arg_option options_limits[] = {
    {ARG_NUMBER, 0, "time", "SECONDS", "stop after this time and keep the results so far",
     &cli.time_s, 1e-3, 1e9, NULL},
    OPTION_PART,
    {ARG_TEXT | ARG_ASIDE, 0, "manifest", "FILE",
     "write a manifest for 'importon verify', with sums of parts (render, gradient, fit)",
     &cli.manifest_path, 0, 0, NULL},
    {ARG_FLAG | ARG_ASIDE, 0, "no-manifest", NULL, "none beside an output file",
     &cli.no_manifest, 0, 0, NULL},
    {0}};

const struct arg_option options_guide[] = {
    {ARG_FLAG | ARG_REPLAYS, 0, "guide", NULL,
     "solve by finite elements first, and choose lights by their light at each vertex",
     &cli.guide, 0, 0, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "guide-share", "S",
     "fraction of directions drawn towards light, or importance, below 1 (default 0)",
     &cli.guide_share, 0, 0.99, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "guide-roulette", "S",
     "survival by S times the expected remaining light (default: by throughput)",
     &cli.guide_roulette, 0, 1e6, NULL},
    {0}};

const char *cli_mode_word(enum imp_color_mode mode) { return mode_words[mode]; }
