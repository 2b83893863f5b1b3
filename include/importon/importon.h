/* SPDX-License-Identifier: Apache-2.0
 *
 * importon: adjoint and differentiable light transport.
 *
 * A host creates a context, loads or builds a scene, renders it, computes derivatives of
 * what its sensors see, or fits it to pictures. In the order of a first program:
 *
 *     imp_context_create      threads, memory, errors
 *     imp_scene_load          or imp_scene_load_string, or imp_scene_create and calls
 *     imp_render              -> imp_film, mean and standard error of every pixel
 *     imp_problem_create      which parameters, which targets, which losses
 *     imp_problem_objective   loss, gradient and the standard errors of both
 *     imp_fit                 parameters back from pictures
 *
 * Conventions, for all public headers.
 *
 *   Errors     Functions that can fail return enum imp_status; the message belongs to the
 *              context and the calling thread (imp_last_error) and names the argument. On
 *              failure, outputs keep their contents. `destroy(NULL)` does nothing; any
 *              other pointer that is NULL, and a number that is not finite, is IMP_E_ARG
 *              where not documented otherwise. IMP_E_NOMEM is possible wherever
 *              something is made.
 *   Memory     Strings and arrays handed in are copied unless documented otherwise;
 *              pointers handed out belong to the object and live until it is destroyed or
 *              changed. The comment of a function names what the caller frees.
 *   Threads    A scene may be used by several threads at once; calls that set its
 *              parameters wait for those that read them. Any other object is used by one
 *              thread at a time. Results have the same bits on any number of threads.
 *   Images     [height][width][channels], row 0 at the top, linear.
 *   Names      imp_OBJECT_n_THINGS counts, imp_OBJECT_get_THING copies to the caller,
 *              imp_OBJECT_THING returns a value or what belongs to the object,
 *              imp_OBJECT_set_THING changes it. `bool` is a yes or no; an int has its
 *              values beside it; callbacks return int, and other than 0 stops the call.
 *
 * Structs are of three kinds, and a test compares them with those of the last release:
 *
 *   sized      begin with `size` and may grow at their end. Start from the initialiser
 *              (IMP_RUN_INIT), or set `size` before a getter writes. Fields that an older
 *              caller does not have keep their defaults, and are not written. Zero in an
 *              options struct is the default.
 *   rows       sized structs in an array. Handed in, all have the size of the first.
 *              Handed out, the library's rows may be longer than the caller's struct:
 *              step through them by IMP_ROW, not by an index; IMP_ROW_HAS is for fields
 *              that an older library does not have.
 *   closed     have no `size` and never change: imp_allocator, imp_estimate,
 *              imp_bend_exit, imp_bend_cotangent, imp_bend_arrival, of which hosts keep
 *              arrays of their own.
 */
#ifndef IMPORTON_H
#define IMPORTON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define IMP_VERSION_MAJOR  0
#define IMP_VERSION_MINOR  2
#define IMP_VERSION_PATCH  0
#define IMP_VERSION_STRING "0.2.0"
/* 200 is 0.2.0; imp_version_number is that of the library. */
#define IMP_VERSION_NUMBER                                                               \
    (10000 * IMP_VERSION_MAJOR + 100 * IMP_VERSION_MINOR + IMP_VERSION_PATCH)

#if defined(__GNUC__)
#define IMP_API                 __attribute__((visibility("default")))
#define IMP_MUST_CHECK          __attribute__((warn_unused_result))
#define IMP_DEPRECATED(instead) __attribute__((deprecated(instead)))
#else
#define IMP_API
#define IMP_MUST_CHECK
#define IMP_DEPRECATED(instead)
#endif

/* Initial values of a sized struct: its size, what is named, and zeros for the rest;
 * IMP_INIT(struct imp_team, .ranks = 1). At most 6 values. In C++, where designated
 * initialisers are of 2020, a function sets the members. */
#ifdef __cplusplus
template <class T, class Set> inline T imp_init(Set set)
{
    T t = T();
    t.size = sizeof(T);
    set(t);
    return t;
}
#define IMP_SET_1(t, a, z)                    t a;
#define IMP_SET_2(t, a, b, z)                 t a, t b;
#define IMP_SET_3(t, a, b, c, z)              t a, t b, t c;
#define IMP_SET_4(t, a, b, c, d, z)           t a, t b, t c, t d;
#define IMP_SET_5(t, a, b, c, d, e, z)        t a, t b, t c, t d, t e;
#define IMP_SET_6(t, a, b, c, d, e, f, z)     t a, t b, t c, t d, t e, t f;
#define IMP_SET_N(a, b, c, d, e, f, set, ...) set
#define IMP_INIT(type, ...)                                                              \
    imp_init<type>([](type &t) {                                                         \
        IMP_SET_N(__VA_ARGS__, IMP_SET_6, IMP_SET_5, IMP_SET_4, IMP_SET_3, IMP_SET_2,    \
                  IMP_SET_1, 0)                                                          \
        (t, __VA_ARGS__, 0)                                                              \
    })
#define IMP_INIT_ZERO(type) imp_init<type>([](type &) {})
extern "C" {
#else
#define IMP_INIT(type, ...)                                                              \
    {                                                                                    \
        .size = sizeof(type), __VA_ARGS__                                                \
    }
#define IMP_INIT_ZERO(type)                                                              \
    {                                                                                    \
        .size = sizeof(type)                                                             \
    }
#endif

/* Row k of an array of sized structs that was handed out, a const struct TAG *; and
 * whether the library that made the row has this field: IMP_ROW(imp_check_row, rows,
 * k). */
#define IMP_ROW(tag, rows, k)                                                            \
    ((const struct tag *)(const void *)((const char *)(rows) +                           \
                                        (size_t)(k) * (rows)->size))
#define IMP_ROW_HAS(tag, row, field)                                                     \
    (offsetof(struct tag, field) + sizeof((row)->field) <= (row)->size)

/* ---- Status -------------------------------------------------------------------- */

/* Values have gaps so that codes can be added, never renumbered. */
#define IMP_STATUS_LIST(X)                                                               \
    X(IMP_OK, 0, "success")                                                              \
    X(IMP_CANCELLED, 1, "cancelled by the caller; results so far are valid")             \
    X(IMP_PART, 2, "a part is kept; there is no whole result")                           \
    X(IMP_E_ARG, 10, "argument outside its documented range")                            \
    X(IMP_E_SCENE, 20, "scene or input file is not valid")                               \
    X(IMP_E_UNSUPPORTED, 25, "valid, but not available in this version")                 \
    X(IMP_E_BIAS, 26, "a derivative that cannot be computed without bias")               \
    X(IMP_E_IO, 30, "file cannot be read or written")                                    \
    X(IMP_E_NOMEM, 40, "out of memory, or over a memory limit")                          \
    X(IMP_E_PATHS, 50, "more paths dropped than the budget allows")                      \
    X(IMP_E_NUMERIC, 60, "a computation did not converge or is singular")
#define IMP_STATUS_ENUM(name, value, text) name = value,
enum imp_status { IMP_STATUS_LIST(IMP_STATUS_ENUM) };

/** The sentence that belongs to a status, never NULL. */
IMP_API const char *imp_status_text(enum imp_status status);

/** "major.minor.patch" of the library that is loaded, never NULL. */
IMP_API const char *imp_version(void);
/** The same as 10000 major + 100 minor + patch: IMP_VERSION_NUMBER of its header. */
IMP_API int imp_version_number(void);
/** Does the library that is loaded have all that this header declares? The interface of a
 * major version only grows; before 1.0, that of a minor version. */
static inline bool imp_version_fits(void)
{
    const int library = imp_version_number(), step = IMP_VERSION_MAJOR ? 10000 : 100;
    return library / step == IMP_VERSION_NUMBER / step && library >= IMP_VERSION_NUMBER;
}

/* ---- Context ------------------------------------------------------------------- */

typedef struct imp_context imp_context;

/** Allocator hooks. `allocate` returns memory aligned to 64 bytes, or NULL. */
struct imp_allocator {
    void *(*allocate)(size_t bytes, void *payload);
    void (*release)(void *memory, void *payload);
    void *payload;
};

enum imp_log_level { IMP_LOG_INFO = 0, IMP_LOG_WARNING = 1 };

struct imp_context_options {
    size_t size;
    int threads;                    /**< 0: all cores; 1: the calling thread only */
    struct imp_allocator allocator; /**< zero: the C library's */
    void (*log)(enum imp_log_level level, const char *message, void *payload);
    void *log_payload; /**< log NULL: warnings are dropped */
};
#define IMP_CONTEXT_OPTIONS_INIT IMP_INIT_ZERO(struct imp_context_options)

/**
 * @param options  NULL for the defaults.
 * @param[out] out the context. It lives until it and everything made from it is
 * destroyed.
 * @return IMP_OK; IMP_E_ARG for a negative thread count; IMP_E_NOMEM.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_context_create(const struct imp_context_options *options, imp_context **out);
/** End the context, when all that was made from it has ended. context may be NULL. */
IMP_API void imp_context_destroy(imp_context *context);

/** Message of the last failure in this context on this thread; "" if none. Never NULL.
 * context NULL: of the last call of this thread whose context was not known, because the
 * object was NULL, or there is none yet. */
IMP_API const char *imp_last_error(const imp_context *context);

/** Number of threads in use. */
IMP_API int imp_context_threads(const imp_context *context);

/* ---- Many processes ------------------------------------------------------------ */

/** Processes that work together, the ranks of a team. Each makes the same calls in the
 * same order with the same arguments, on scenes and targets that are the same. Each
 * computes a share of the walks, and all get the whole result, with the bits that one
 * process alone gives; what is not walks is computed by each. A failure, a cancel or a
 * time limit of one ends the call on all. Rank 0 writes files; on others,
 * such a call does nothing. Calls come from one thread a rank at a time. */
struct imp_team {
    size_t size;
    int rank, ranks; /**< this one, of how many */
    /** Give the messages of all ranks to all: calls `receive` with those of ranks 0, 1,
     * ..., its own too. The message may be of 0 bytes, and what is received belongs to
     * the team. @return IMP_OK, or the status that ends the call. */
    enum imp_status (*gather)(const void *message, size_t bytes,
                              void (*receive)(void *receiver, int rank,
                                              const void *message, size_t bytes),
                              void *receiver, void *payload);
    /** The next of 0, 1, 2, ...: each number goes to one rank, by whatever thread; the
     * numbers begin anew in every round, and all ranks gather between two rounds. NULL:
     * ranks get equal shares, and none takes over what another has left. */
    int64_t (*next)(uint64_t round, void *payload);
    void *payload;
    /** Non-zero: rank 0 reads files and gives their bytes to all. 0: each reads them. */
    bool broadcast;
    /** Put the sums over all ranks in the place of numbers [n]: what an MPI_Allreduce of
     * MPI_INT64_T does. Gradients of textures and grids then cost a rank bytes that do
     * not grow with the ranks. All ranks have equal n. NULL: they are gathered.
     * @return as gather. */
    enum imp_status (*sum)(int64_t *numbers, size_t n, void *payload);
};
#define IMP_TEAM_INIT IMP_INIT(struct imp_team, .ranks = 1)

/** Work on this context's calls from now on as one rank of a team; NULL: alone again.
 * Waits for the other ranks.
 * @return IMP_OK; IMP_E_ARG if a rank runs another version, or another processor whose
 *         results have other bits (the message names both); what `gather` returned. */
IMP_API IMP_MUST_CHECK enum imp_status imp_context_set_team(imp_context *context,
                                                            const struct imp_team *team);

/** Parts of a run, made one by one on any machine and at any time, and merged later to
 * the bits of one run. They are the messages that the ranks of a team would have sent,
 * kept in files; a part is made by making all calls of the run with this part set. */
typedef struct imp_parts imp_parts;

/** Part `index`, from 1, of `count`; nothing is computed yet. `command`: the command
 * line of the run, stored as it is. Parts go together only with equal commands.
 * @return IMP_OK; IMP_E_ARG; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_parts_create(imp_context *context, int index,
                                                        int count, const char *command,
                                                        imp_parts **out);
/** Read files of parts, paths [n], each of one part or of several. They may be of
 * different cuts, such as 1/2, 3/4 and 4/4.
 * @return IMP_OK; IMP_E_IO, also for what is damaged; IMP_E_SCENE for another version;
 *         IMP_E_ARG for parts that overlap, or do not belong together; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_parts_read(imp_context *context, const char *const *paths, size_t n, imp_parts **out);
/** Write all of them to one file, which appears whole or not at all.
 * @return IMP_OK; IMP_E_IO; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_parts_write(const imp_parts *parts,
                                                       const char *path);
/** parts may be NULL; a context must not use them any more. */
IMP_API void imp_parts_destroy(imp_parts *parts);

struct imp_parts_info {
    size_t size;
    int n;               /**< parts that are there */
    int missing;         /**< holes between them; 0: they are a whole */
    const char *holes;   /**< which, for people: "2/4, 4/4"; belongs to the parts */
    const char *command; /**< as given to imp_parts_create; belongs to the parts */
};
/** Set info->size first. @return IMP_OK; IMP_E_ARG. */
IMP_API enum imp_status imp_parts_get_info(imp_parts *parts, struct imp_parts_info *info);
/** The calls that follow compute this part (they return IMP_PART and leave their outputs
 * alone: write it when the last was made), or merge the parts that were read: the same
 * calls give the whole, and compute no walk. NULL: calls are whole again. `parts` must
 * live until then. Losses through filters wider than a pixel take pictures first; each
 * part makes these whole.
 * @return IMP_OK; IMP_E_ARG if some are missing (the message says which), or they were
 *         made by another version or on another kind of processor. */
IMP_API IMP_MUST_CHECK enum imp_status imp_context_set_parts(imp_context *context,
                                                             imp_parts *parts);

/** A manifest: what a result was made from (the files that were read, the version, the
 * command), the hash of its bits, and the sums of up to 64 chunks of every sum on the
 * way. With it anybody can compute the result again, or a random part of the chunks, on
 * any number of threads or ranks. Hashes are no signatures: they find changes and
 * mistakes, and false results by the work that somebody spends on them. */
typedef struct imp_manifest imp_manifest;

/** A manifest in the making: files that are read from now on are inputs of the last
 * that was made in the context. `command`: that made the result, stored as it is.
 * @return IMP_OK; IMP_E_ARG; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_manifest_create(imp_context *context, const char *command, imp_manifest **out);
/** Keep sums while all of them take no more than `bytes` (256 MiB before this call); a
 * run whose sums take more is verified as a whole. The more sums a run has, the fewer
 * chunks are kept of each. @return IMP_OK; IMP_E_ARG. */
IMP_API enum imp_status imp_manifest_set_limit(imp_manifest *manifest, size_t bytes);
/** Read one, to verify it: files that are read from now on are compared with its inputs,
 * and its output files are read and compared now. What is no input of it, or has other
 * bytes, is not taken: the call that reads it returns IMP_E_IO.
 * @param fraction of the chunks that the calls after imp_context_set_manifest compute
 *        again, 0 < fraction <= 1; 1 where the manifest has no sums.
 * @param seed which they are.
 * @return IMP_OK; IMP_E_ARG; IMP_E_IO, also if it is damaged; IMP_E_SCENE if it is of another
 *         version; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_manifest_read(imp_context *context,
                                                         const char *path,
                                                         double fraction, uint64_t seed,
                                                         imp_manifest **out);
/** manifest may be NULL; a context must not use it any more. */
IMP_API void imp_manifest_destroy(imp_manifest *manifest);
/** The sums of the calls that follow are kept, or verified; NULL: no more. In a team of
 * ranks sums are not kept. @return IMP_OK; IMP_E_ARG; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_context_set_manifest(imp_context *context,
                                                                imp_manifest *manifest);
/** A result, by name: its hash is kept, or compared. @return IMP_OK; IMP_E_ARG;
 * IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_manifest_result(imp_manifest *manifest,
                                                           const char *name,
                                                           const void *bytes, size_t n);
/** A file that was written; written again, its last bytes count. Read again by the same run, it is
 * no input. @return IMP_OK; IMP_E_ARG; IMP_E_IO; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_manifest_output(imp_manifest *manifest,
                                                           const char *path);
/** Whole or not at all. @return IMP_OK; IMP_E_ARG; IMP_E_IO; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_manifest_write(const imp_manifest *manifest,
                                                          const char *path);

struct imp_manifest_info {
    size_t size;
    const char *command; /**< as given to imp_manifest_create; belongs to the manifest */
    int n_inputs, n_results, n_outputs;
    uint64_t n_sums; /**< chunks whose sums are kept; 0: the whole is computed again */
    uint64_t n_verified; /**< of these, computed again so far */
    int n_missing;       /**< inputs and results that were not met so far */
    const char *refuted; /**< the first difference that was found; NULL: none */
};
/** Set info->size first. @return IMP_OK; IMP_E_ARG. */
IMP_API enum imp_status imp_manifest_get_info(imp_manifest *manifest,
                                              struct imp_manifest_info *info);

/* ---- Progress and cancel ------------------------------------------------------- */

struct imp_progress {
    size_t size;
    const char *stage; /**< "render", "gradient", "fit" ... */
    double fraction;   /**< of the work, 0..1 */
    double elapsed_s;
    double eta_s; /**< time still to go; negative: unknown */
    double rate;  /**< units of rate_unit per second */
    const char *rate_unit;
    const char *note; /**< e.g. "loss 3.1e-4 +- 2e-5"; may be NULL */
};

/** Called from one thread at a time, a few times a second. Non-zero stops: the
 * call in progress returns IMP_CANCELLED. Pictures then hold the samples taken so far and
 * fits the state reached, both valid; a loss or gradient of a part of the picture would
 * mean nothing, so those outputs keep their contents. */
typedef int (*imp_progress_fn)(const struct imp_progress *progress, void *payload);

/* ---- Scenes -------------------------------------------------------------------- */

typedef struct imp_scene imp_scene;

/** What light is made of. In IMP_SPECTRAL a walk carries four wavelengths, a hero and its
 * companions; in IMP_SINGLE it carries one. Pictures of both are linear sRGB, or what the
 * film's response curves make of spectra (docs/spectra.md). */
enum imp_color_mode { IMP_RGB = 0, IMP_MONO = 1, IMP_SPECTRAL = 2, IMP_SINGLE = 3 };

/** How three values become a spectrum in spectral modes (docs/spectra.md): by the sigmoid
 * of a quadratic, smooth as measured spectra are; or as the sum of three fixed spectra,
 * so that all is linear in the values. */
enum imp_upsampling { IMP_UPSAMPLING_SIGMOID = 0, IMP_UPSAMPLING_LINEAR = 1 };

/** A scene with plugins or properties that this version does not have. */
enum imp_lenience {
    IMP_LENIENT_OFF = 0, /**< an error */
    IMP_LENIENT_WARN =
        1, /**< it goes on without them: imp_scene_info lists them, and each
                               is a warning */
    IMP_LENIENT_QUIET = 2 /**< the same without warnings */
};

struct imp_load_options {
    size_t size;
    enum imp_color_mode mode;
    /** [n_defines] "name=value", as -D on the command line. */
    const char *const *defines;
    size_t n_defines;
    const char *const *search; /**< [n_search] folders searched for files */
    size_t n_search;
    /** The property `weights` of a file's integrator (of the first one in aov
     * and moment), in place of the file's; NULL: the file's. */
    const char *weights;
    enum imp_lenience lenient;
    enum imp_upsampling upsampling;
    /** For files in spectral modes, "from, to, n" in nm: films have n bins of
     * wavelengths for channels (docs/spectra.md 5), in place of what they have; NULL:
     * that. */
    const char *bins;
    /** [n_luminaires] "GLOB=FILE" or "GLOB=FILE,FILE": photometric files in place of those of
     * emitters `ies` at the top of the scene; of several files each is a luminaire of its own at the
     * same place, "ID:NAME" with NAME the file's without folder and ending (design.h
     * chooses among them). */
    const char *const *luminaires;
    size_t n_luminaires;
    /** Samples a pixel that all runs of this scene will take, about; 0: not known. Where a scene has
     * many more triangles than it will have walks, the tree over them is made in a third of the time,
     * and asked a little slower. Hits are the same to the bit, except of facets that lie in each other
     * or share the edge that a ray hits, of which either may be met. */
    int64_t spp;
};
#define IMP_LOAD_OPTIONS_INIT IMP_INIT_ZERO(struct imp_load_options)

/** Load a scene file (Mitsuba 3 XML; by the ending .rad, .gltf, .glb or .obj
 * those of docs/import.md).
 * The scene is committed and ready. `options` may be NULL.
 * @return IMP_OK; IMP_E_IO; IMP_E_SCENE (message begins file:line:column); IMP_E_NOMEM;
 *         IMP_E_UNSUPPORTED for a plugin this version does not have. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_scene_load(imp_context *context, const char *path,
               const struct imp_load_options *options, imp_scene **out);

/** The same from memory: xml [length]; `name` is the file in messages, and
 * its ending says what is read; files are searched for in the working folder.
 * @return as imp_scene_load. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_scene_load_string(imp_context *context, const char *xml, size_t length,
                      const char *name, const struct imp_load_options *options,
                      imp_scene **out);

/**
 * A scene built by calls. The calls mirror the file format: begin/end open and close an
 * object (tag "shape", type "sphere", ...), the property calls give it values. The first
 * error of a build is kept: the call returns it, so do all later ones, which do nothing,
 * and imp_scene_commit. A host may test the last of them alone.
 * @return IMP_OK; IMP_E_UNSUPPORTED; IMP_E_NOMEM.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_scene_create(imp_context *context, const struct imp_load_options *options,
                 imp_scene **out);
/** scene may be NULL. Problems, walks and elements made from it go first. */
IMP_API void imp_scene_destroy(imp_scene *scene);

/** Open an object, and close the one opened last. `id` and `name` may be NULL; `name` is
 * the slot under the parent. tag NULL: what objects of this type are ("diffuse":
 * "bsdf"). The calls in between set properties of the open object, in the units of the
 * file format (degrees, scene units).
 * @return IMP_OK; IMP_E_ARG for a tag that is none, or a scene that is committed;
 *         IMP_E_UNSUPPORTED, without a tag, for a type that does not exist; IMP_E_SCENE for
 *         an id that is there already; IMP_E_NOMEM. */
IMP_API enum imp_status imp_scene_begin(imp_scene *scene, const char *tag,
                                        const char *type, const char *id,
                                        const char *name);
/** Close the open object.
 * @return IMP_OK; IMP_E_ARG without imp_scene_begin. */
IMP_API enum imp_status imp_scene_end(imp_scene *scene);
/** A property of the open object, in the units of the file format. Which properties
 * there are is checked by imp_scene_commit.
 * @return IMP_OK; IMP_E_ARG for a name that is NULL; IMP_E_SCENE for one that is
 *         there already; IMP_E_NOMEM. */
IMP_API enum imp_status imp_scene_bool(imp_scene *scene, const char *name, bool value);
/** @return as imp_scene_bool. */
IMP_API enum imp_status imp_scene_integer(imp_scene *scene, const char *name,
                                          int64_t value);
/** @return as imp_scene_bool; IMP_E_ARG also for a value that is not finite. */
IMP_API enum imp_status imp_scene_float(imp_scene *scene, const char *name, double value);
/** The text is copied.
 * @return as imp_scene_bool; IMP_E_ARG also for a value that is NULL. */
IMP_API enum imp_status imp_scene_string(imp_scene *scene, const char *name,
                                         const char *value);
/** value [3]: a point or a vector.
 * @return as imp_scene_float. */
IMP_API enum imp_status imp_scene_vector(imp_scene *scene, const char *name,
                                         const double value[3]);
/** value [3]: linear sRGB.
 * @return as imp_scene_float. */
IMP_API enum imp_status imp_scene_rgb(imp_scene *scene, const char *name,
                                      const double value[3]);
/** A spectrum by samples: n >= 2 strictly increasing wavelengths in nm; or, with n == 1
 * and wavelengths_nm NULL, the same value at all of them.
 * wavelengths_nm [n] and values [n] are copied.
 * @return as imp_scene_float; IMP_E_ARG also for wavelengths that do not rise. */
IMP_API enum imp_status imp_scene_spectrum(imp_scene *scene, const char *name, size_t n,
                                           const double *wavelengths_nm,
                                           const double *values);
/** Local-to-world matrix, row-major.
 * @return as imp_scene_float. */
IMP_API enum imp_status imp_scene_transform(imp_scene *scene, const char *name,
                                            const double value[16]);
/** Refer to the object with this id; `name` may be NULL. Forward references are fine.
 * @return IMP_OK; IMP_E_ARG for an id that is NULL; IMP_E_NOMEM. */
IMP_API enum imp_status imp_scene_ref(imp_scene *scene, const char *id, const char *name);
/** Triangles for the open shape of type "mesh". normals and uvs may be NULL.
 * positions [3*n_vertices], normals [3*n_vertices], uvs [2*n_vertices],
 * indices [3*n_triangles].
 * @return IMP_OK; IMP_E_ARG for another open object, no vertices or triangles, or
 *         numbers that are not finite; IMP_E_NOMEM. Indices are checked by
 *         imp_scene_commit. */
IMP_API enum imp_status imp_scene_mesh(imp_scene *scene, size_t n_vertices,
                                       size_t n_triangles, const float *positions,
                                       const float *normals, const float *uvs,
                                       const uint32_t *indices);
/** Linear pixels for the open texture of type "bitmap" or emitter of type "envmap", in
 * place of `filename`.
 * pixels [height][width][channels], channels 1 or 3.
 * @return IMP_OK; IMP_E_ARG for another open object, sizes below 1, other channels,
 *         or pixels that are not finite; IMP_E_NOMEM. */
IMP_API enum imp_status imp_scene_image(imp_scene *scene, int width, int height,
                                        int channels, const float *pixels);
/** Values of the cells of the open volume of type "gridvolume", in place of `filename`,
 * in the order of its files: values [nz][ny][nx][channels], channels 1 or 3, finite. The
 * grid fills the unit cube, to which `to_world` applies; they are copied.
 * @return as imp_scene_image. */
IMP_API enum imp_status imp_scene_grid(imp_scene *scene, int nx, int ny, int nz,
                                       int channels, const float *values);
/** Finish a scene built by calls: make all objects, check them, build what rays need.
 * @return IMP_OK; the first error of the calls before; IMP_E_SCENE; IMP_E_UNSUPPORTED;
 *         IMP_E_NOMEM; IMP_E_ARG if it has been committed already. */
IMP_API IMP_MUST_CHECK enum imp_status imp_scene_commit(imp_scene *scene);

struct imp_scene_info {
    size_t size;
    int n_shapes, n_emitters, n_bsdfs, n_textures, n_sensors;
    int64_t n_triangles;
    /** Scene units; min > max if there is no shape. */
    double bounds_min[3], bounds_max[3];
    enum imp_color_mode mode;
    int channels; /**< of pictures: 1 for mono, else 3 */
    const char *integrator;
    int max_depth;       /**< -1: unlimited */
    size_t memory_bytes; /**< held by the scene, Embree's part included */
    /** [n_missing] what a lenient scene goes on without: place, plugin or property, and
     * what is lost. */
    const char *const *missing;
    int n_missing;
    /** Instances of groups, those inside groups counted once; and the triangles that a
     * ray can meet, each as often as it occurs in the scene. */
    int n_instances;
    double triangles_met;
};
/** Set info->size first; strings belong to the scene. @return IMP_OK; IMP_E_ARG. */
IMP_API enum imp_status imp_scene_get_info(const imp_scene *scene,
                                           struct imp_scene_info *info);

struct imp_sensor_info {
    size_t size;
    const char *name, *type;
    int width, height; /**< of the picture: the crop window */
    int spp;           /**< samples per pixel of its sampler */
    const char *filter;
    double filter_radius;
    const char *file_format; /**< "openexr", "rgbe" or "pfm" */
    const char *unit;        /**< of its numbers: "W m^-2 sr^-1", of an irradiancemeter
                                "W m^-2"; or "cd m^-2", "lx" of photometric scenes */
    /** A specfilm's: its response curves, which are its channels; else 0. */
    int n_responses;
    const char *const *response_names; /**< [n_responses] */
    /** Its film has a gamma: targets hold the values of a photograph, from 0 to 1, not
     * linear in light. */
    bool photograph;
};
/** Set info->size first; strings belong to the scene.
 * @return IMP_OK; IMP_E_ARG if there is no such sensor. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_scene_get_sensor(const imp_scene *scene, int sensor, struct imp_sensor_info *info);

/* ---- Parameters: theta --------------------------------------------------------- */

enum imp_param_flags {
    IMP_PARAM_DIFFERENTIABLE = 1, /**< a gradient exists, without bias */
    IMP_PARAM_DISCONTINUOUS = 2,  /**< changing it can move edges of the picture */
    IMP_PARAM_INTEGER = 4,
    IMP_PARAM_COLOR = 8,   /**< its last dimension holds the channels */
    IMP_PARAM_VOLUME = 16, /**< a grid that imp_scene_write_volume writes */
    IMP_PARAM_LIST = 32    /**< rows that have no order, like vertices: none is another's
                             neighbour */
};

struct imp_param_info {
    size_t size;
    const char *name; /**< stable dotted name, e.g. "red.reflectance.value" */
    const char *unit; /**< "1", "W m^-2 sr^-1", ... */
    size_t offset;    /**< of its first value in theta */
    size_t count;     /**< of values: the product of dims */
    size_t dims[3];   /**< [n_dims], row-major */
    int n_dims;       /**< 0: a scalar */
    double lo, hi;    /**< bounds of every value; may be infinite */
    unsigned flags;   /**< enum imp_param_flags */
    const char *why;  /**< why it has no gradient; NULL: no more is known */
    /** [count] of a spectrum given by its values at wavelengths: those, in nm; else
     * NULL. */
    const double *wavelengths_nm;
    /** A grid in space has sizes dims [layers][y][x], or of colours
     * [layers y][x][3]; else 0. */
    size_t layers;
};

/** Number of parameters. */
IMP_API size_t imp_scene_n_params(const imp_scene *scene);
/** Values in all parameters together: the length of theta. 0 for NULL. */
IMP_API size_t imp_scene_n_theta(const imp_scene *scene);
/** Set info->size first; strings belong to the scene. @return IMP_OK; IMP_E_ARG if there
 * is no such parameter. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_scene_get_param(const imp_scene *scene, size_t index, struct imp_param_info *info);
/** Find by name; a final ".value" may be left out, and names of parents may come
 * first. @return IMP_OK; IMP_E_ARG with a message that names the nearest ones. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_scene_find_param(const imp_scene *scene, const char *name, size_t *index);
/** Make a number of geometry a parameter, behind all others. Setting it moves the object.
 *
 *     NAME.pose, pose_end    as imp_scene_add_pose; the second of where an instance that moves in time is at last
 *     NAME.scale             of a shape, instance, group or volume: 1 as the scene file has it, about the
 *                            middle of its box
 *     NAME.to_world          of a shape, instance, volume, camera, spot or projector: [3][4], the
 *                            upper rows of the matrix that puts it there; not beside pose, scale and what else
 *                            says where it is; IMP_E_NUMERIC where it makes another kind of thing
 *                            of it
 *     NAME.vertex_positions  of a mesh: [vertices][3], world; vertex normals, if it has any, are
 *                            computed from them
 *     NAME.vertex_normals    of a mesh with vertex normals: [vertices][3], world, of any length
 *     NAME.control_points    of a bsplinecurve without textures: [points][4], x, y, z and radius,
 *                            world; not beside pose and scale; IMP_E_NUMERIC: a radius below 0
 *     NAME.center, NAME.radius   of a sphere: world; not beside pose and scale
 *     NAME.p0, NAME.p1, NAME.radius   of a circular cylinder without textures: the middles of its
 *                            ends, world; likewise
 *     NAME.x_fov             of a perspective camera or projector: horizontal field of view, degrees
 *     NAME.principal_point_offset_x, NAME.principal_point_offset_y   of a perspective camera:
 *                            in parts of the film's width and height
 *     NAME.opencv_k1, _k2, _p1, _p2, _k3   of a perspective camera: the distortion of its lens;
 *                            IMP_E_NUMERIC where it would fold the picture
 *     NAME.aperture_radius, NAME.focus_distance   of a thin lens
 *     NAME.position          of a point, spot, projector or ies light: [3], world
 *     NAME.direction         of a directional light or a sun, of a spot's or projector's axis or an
 *                            ies light's nadir: [3], of any length
 *     NAME.turn              of an envmap, sunsky, ciesky or perezsky, or a distant sensor: [3], a
 *                            rotation vector in radians away from what the file says
 *     NAME.sun_direction     of a sunsky, ciesky or perezsky: [3], towards its sun, of any length
 *     NAME.sun_radius        of a sun or sunsky: of its disc, radians
 *
 * An ies light is one without a shape.
 *
 * Gradients, patterns, and what is there already: as of poses.
 * @param name  such a name.
 * @return IMP_OK; IMP_E_ARG if there is no such object or number, the scene is not committed, or
 *         a problem has been created with it; IMP_E_UNSUPPORTED, with the reason, where it cannot
 *         be moved; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_scene_add_geometry(imp_scene *scene,
                                                              const char *name);
/** Names of what imp_scene_add_geometry accepts: of shapes, then of sensors, then of lights without
 * a shape, then of the scene's instances, if there are at most 1,024. Those that are parameters already are among them.
 * @param index  from 0.
 * @param name   [size] overwritten; 256 are enough for every name.
 * @return IMP_OK; IMP_E_ARG if there are no more, or size does not suffice. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_scene_geometry_name(const imp_scene *scene, size_t index, size_t size, char *name);
/** Make the pose of a shape, an instance or a camera a parameter, `OBJECT.pose`, behind all others:
 * six numbers, a translation in scene units and a rotation vector in radians about the middle of the
 * shape's box, of its group's box where the instance has it, or the camera's own place, away from where the scene file has it. Setting it moves
 * the object. Theta, and offsets in it, are longer afterwards; a pose that is there already
 * stays as it is. Gradients, derivative pictures and fits know it (docs/poses.md); patterns of
 * imp_problem_activate pass it over unless they end in ".pose".
 * @param object  its name, as of imp_param_info.
 * @return IMP_OK; IMP_E_ARG if there is no such object, the scene is not committed, or a problem
 *         has been created with it; IMP_E_UNSUPPORTED, with the reason, of one that cannot
 *         move: it is not made of triangles or no perspective camera, or the scene has
 *         instances, media, or what else is made from places; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_scene_add_pose(imp_scene *scene,
                                                          const char *object);
/** Where what a number of geometry moves is now: the point that a pose turns about, a light's or
 * camera's own place, else the middle of the box of the shape or instance.
 * @param middle  [3] overwritten; world.
 * @param radius  [1] overwritten; half the diagonal of that box, of what has no size a twentieth of the
 *                scene's radius.
 * @return IMP_OK; IMP_E_ARG if there is no such parameter, or it is no number of geometry or moves
 *         what has no place (a sky, a camera's lens). */
IMP_API IMP_MUST_CHECK enum imp_status
imp_scene_place(const imp_scene *scene, size_t param, double middle[3], double *radius);
/** Where a sensor sees a point: in pixels from the upper left corner of its picture, through the
 * middle of its lens, whatever hides the point.
 * @param point  [3] world.
 * @param film   [2] overwritten; NaN if the point is not in the picture.
 * @return IMP_OK; IMP_E_ARG if there is no such sensor, or the point is not finite; IMP_E_UNSUPPORTED of
 *         one that has no such picture (a meter, `distant`, `radiancemeter`). */
IMP_API IMP_MUST_CHECK enum imp_status imp_scene_film_point(const imp_scene *scene,
                                                            int sensor,
                                                            const double point[3],
                                                            double film[2]);
/** Parameters by text: lines NAME=VALUE or NAME=VALUE,VALUE,.., as of --set @FILE and
 * recovered.txt; empty lines and lines that begin with # are skipped. Names of geometry, NAME.pose and
 * the like, become parameters first, as by imp_scene_add_geometry.
 * @param text    [length] bytes; need not end with a zero byte.
 * @param name    of the text, for messages ("NAME:LINE: .."); NULL: there are no places in them.
 * @return IMP_OK; IMP_E_ARG if a line is malformed, its parameter does not exist or has other bounds
 *         or another count: lines before it are set; and what imp_scene_add_geometry returns;
 *         IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_scene_set_text(imp_scene *scene, const char *text, size_t length, const char *name);
/** theta [imp_scene_n_theta], in the units of imp_param_info; written, and read.
 * @return IMP_OK; IMP_E_ARG. */
IMP_API enum imp_status imp_scene_get_theta(const imp_scene *scene, double *theta);
/** @return IMP_OK; IMP_E_ARG if a value is not finite or outside its bounds, IMP_E_NUMERIC if
 * geometry cannot be so (docs/poses.md): nothing is set.
 * theta [imp_scene_n_theta] is copied. */
IMP_API IMP_MUST_CHECK enum imp_status imp_scene_set_theta(imp_scene *scene,
                                                           const double *theta);
/** One parameter: values [info.count], or n == 1 to set all of them to one value.
 * @return IMP_OK; IMP_E_ARG if there is no such parameter, for another n, or a value
 *         outside its bounds; IMP_E_NUMERIC if geometry cannot be so (docs/poses.md): nothing is
 *         set. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_scene_set_values(imp_scene *scene, size_t index, size_t n, const double *values);
/** values [info.count] of one parameter, in its unit.
 * @return IMP_OK; IMP_E_ARG if there is no such parameter. */
IMP_API IMP_MUST_CHECK enum imp_status imp_scene_get_values(const imp_scene *scene,
                                                            size_t index, double *values);
/** Write a grid in space (IMP_PARAM_VOLUME) as a .vol file of version 3, in 32-bit
 * floats, with the box of the file that it was read from: what a fit has found becomes
 * the file of another scene.
 * @param values [info.count]; NULL: those that the scene has.
 * @return IMP_OK; IMP_E_ARG if there is no such parameter or it is no grid in space;
 *         IMP_E_IO. */
IMP_API IMP_MUST_CHECK enum imp_status imp_scene_write_volume(const imp_scene *scene,
                                                              size_t index,
                                                              const double *values,
                                                              const char *path);

/* ---- Pictures ------------------------------------------------------------------ */

typedef struct imp_film imp_film;

/** Why a walk was dropped. Its value counts as 0. */
#define IMP_DROP_LIST(X)                                                                 \
    X(IMP_DROP_NONE, 0, "not dropped")                                                   \
    X(IMP_DROP_NAN, 1, "the value is not a number")                                      \
    X(IMP_DROP_INFINITE, 2, "the value is infinite, or more than a float holds")         \
    X(IMP_DROP_NEGATIVE, 3, "the value is negative")                                     \
    X(IMP_DROP_MEMORY, 4, "no memory for the vertices")                                  \
    X(IMP_DROP_LONG, 5, "nothing ended the walk in 16384 vertices")                      \
    X(IMP_DROP_BENT, 6, "a bent ray came to no end, or to what media cannot hold")       \
    X(IMP_DROP_MOVED, 7, "what moves with an active field has no derivative there")      \
    X(IMP_DROP_MEDIUM, 8, "left a medium that it was not in: a hole in its boundary")    \
    X(IMP_DROP_MAJORANT, 9, "an extinction is above its bound, or negative")             \
    X(IMP_DROP_EVENTS, 10, "nothing ended the walk in 1048576 tentative collisions")
#define IMP_DROP_ENUM(name, value, text) name = value,
enum imp_drop { IMP_DROP_LIST(IMP_DROP_ENUM) };

/** The sentence that belongs to a cause, never NULL. */
IMP_API const char *imp_drop_text(enum imp_drop cause);

#define IMP_DROP_CAUSES 16 /**< enum imp_drop, and room for more */
#define IMP_DROP_KEYS   8

/** A dropped walk. imp_walk_describe with the same sensor, seed, pixel and sample is that
 * walk, vertex by vertex (IMP_DROP_MOVED: the walk, but not what was dropped of it). */
struct imp_drop_key {
    size_t size;
    uint64_t seed;
    int64_t sample;
    int32_t x, y;   /**< pixel of the picture; outside of it within the filter's radius */
    int32_t sensor; /**< index */
    int32_t cause;  /**< enum imp_drop */
};

struct imp_film_info {
    size_t size;
    int width, height, channels;
    int64_t spp;      /**< samples per pixel in it */
    bool has_se;      /**< standard errors are there */
    uint64_t dropped; /**< walks dropped, of all causes */
    /** The same by enum imp_drop. All 0 for a picture that was read from a file. */
    uint64_t dropped_by_cause[IMP_DROP_CAUSES];
    int n_drop_keys; /**< at most IMP_DROP_KEYS */
    /** [n_drop_keys] the first by sample, row, column: rows, which belong to the film. */
    const struct imp_drop_key *drop_keys;
};

/** An empty picture to fill by hand, zeros. `names` is "R,G,B", "Y", "albedo.R,..." .
 * @return IMP_OK; IMP_E_ARG for a size below 1, or names that are empty or there twice;
 *         IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_film_create(imp_context *context, int width,
                                                       int height, const char *names,
                                                       imp_film **out);
/** film may be NULL. What it handed out (means, names, rows) ends with it. */
IMP_API void imp_film_destroy(imp_film *film);
/** Set info->size first. @return IMP_OK; IMP_E_ARG. */
IMP_API enum imp_status imp_film_get_info(const imp_film *film,
                                          struct imp_film_info *info);
/** Name of a channel as in EXR files; belongs to the film. NULL if there is none. */
IMP_API const char *imp_film_channel(const imp_film *film, int channel);
/** [height][width][channels], linear; belongs to the film, and may be written to. */
IMP_API float *imp_film_mean(imp_film *film);
/** One standard error of each mean, in the same order; NULL if there are none. */
IMP_API float *imp_film_se(imp_film *film);
/** Take the samples of another picture of the same scene, made with another seed, too:
 * means by samples per pixel, and their standard errors where both have them.
 * @return IMP_OK; IMP_E_ARG if sizes or channels differ, or one has no samples. */
IMP_API IMP_MUST_CHECK enum imp_status imp_film_merge(imp_film *film,
                                                      const imp_film *other);
/** Append the channels of another picture of the same size as "layer.NAME": viewers show
 * them as a layer. Standard errors stay where both have them.
 * @return IMP_OK; IMP_E_ARG if sizes differ, the name is no layer's or is there;
 * IMP_E_NOMEM. On an error the picture is what it was. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_film_add_layer(imp_film *film, const imp_film *other, const char *layer);
/** Attach a text attribute (provenance); it is written to EXR files.
 * key and value are copied.
 * @return IMP_OK; IMP_E_ARG; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_film_set_text(imp_film *film, const char *key,
                                                         const char *value);

/** The text attribute with this key, made here or read from an EXR file; belongs to the
 * film. NULL if there is none. */
IMP_API const char *imp_film_text(const imp_film *film, const char *key);

struct imp_write_options {
    size_t size;
    bool half;           /**< 16-bit floats instead of 32 (EXR) */
    bool standard_error; /**< add channels se.R, se.G ... (EXR) */
    double exposure;     /**< stops, for PNG */
    bool diverging; /**< PNG of a signed picture: blue-white-red, symmetric about 0 */
    double range;   /**< of a signed picture; 0: its 99.5 percentile of |value| */
};
#define IMP_WRITE_OPTIONS_INIT IMP_INIT_ZERO(struct imp_write_options)

/** Write by extension: .exr, .pfm, .hdr, .png (sRGB), .npy. The file appears whole or not
 * at all. options may be NULL.
 * @return IMP_OK; IMP_E_ARG for an extension or channels that do not go together;
 *         IMP_E_IO; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_film_write(const imp_film *film, const char *path,
               const struct imp_write_options *options);
/** Read .exr, .pfm, .hdr, .npy, .png, .jpg, .tif, .dng and others, by their first bytes (8- and
 * 16-bit files are taken to be sRGB and made linear; a DNG is what its sensor counted, white at 1,
 * 2 x 2 pixels of a mosaic as one). The caller destroys the film.
 * @return IMP_OK; IMP_E_IO; IMP_E_SCENE if it is not such a file, or damaged;
 *         IMP_E_UNSUPPORTED; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_film_read(imp_context *context,
                                                     const char *path, imp_film **out);

/** A picture of fewer pixels: means of blocks of nx x ny, where it has nx width x ny height.
 * @param white values at or above it are clipped: a block of these alone has `white`, and one with
 *              some of them NaN, as its mean is not known. INFINITY: none.
 * @param[out] out with the same channels, and errors where it has some; the caller destroys it.
 * @return IMP_OK; IMP_E_ARG where that is not a whole number of pixels; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_film_reduce(const imp_film *film, int width,
                                                       int height, double white,
                                                       imp_film **out);

/** How a picture holds all directions: rows at equal angles from up to down, the first
 * and the last at the poles, or rows at equal cosines, all texels of one solid angle. */
enum imp_sky_projection { IMP_LATLONG, IMP_EQUAL_AREA };
/** A map of the sky (an envmap's picture) in another projection or size. Its light as it
 * is interpolated, the integral over all directions, is kept.
 * @return IMP_OK; IMP_E_ARG for maps below 2 x 2; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_film_project(const imp_film *map, enum imp_sky_projection from,
                 enum imp_sky_projection to, int width, int height, imp_film **out);

/* ---- Rendering ----------------------------------------------------------------- */

/** A distribution of the light, from which walks draw (imp_elements_guide of elements.h).
 * It changes the noise, never the mean. */
typedef struct imp_guide imp_guide;
/** guide may be NULL. No run may use it any more. */
IMP_API void imp_guide_destroy(imp_guide *guide);

/** How walks draw their wavelengths. */
enum imp_wavelength_sampling {
    IMP_WAVELENGTHS_STRATIFIED = 0, /**< uniformly, stratified within a pixel */
    IMP_WAVELENGTHS_INDEPENDENT,    /**< uniformly, each walk on its own */
    IMP_WAVELENGTHS_IMPORTANCE /**< by response times light, stratified within a pixel */
};

/** A picture in the making, with standard errors: valid during the call, which comes from
 * one thread and holds up the others. */
typedef void (*imp_preview_fn)(const imp_film *picture, void *payload);
/** The random numbers of a pixel's walks. */
enum imp_points {
    /** Those of the sensor's sampler. Where there is none, or one that is called
     * independent: independent for fits by IMP_LM, and for losses of scenes with
     * media; of Sobol's sequence for all else. */
    IMP_POINTS_SCENE = 0,
    IMP_POINTS_INDEPENDENT, /**< independent, whatever the scene says */
    /** Sets of up to 64 points of Sobol's sequence, scrambled by Owen's method. Pixels
     * and sets are independent of each other. Means stay what they are, errors shrink;
     * standard errors come from the spread of independent sets, four of each pixel at
     * least in pictures of 8 samples or more. */
    IMP_POINTS_SOBOL,
    /** The same, in as few sets of each pixel as hold its samples, for pictures alone
     * (imp_render, imp_denoise, imp_walk_describe), without a time limit and recorded
     * walks: errors are smaller, but pictures of fewer than four sets (192 samples or
     * less) have no standard errors, and no previews. Walks from the lights have
     * independent samples, and errors, as ever. */
    IMP_POINTS_WHOLE
};

/** The end at which walks begin. */
enum imp_from {
    IMP_FROM_SCENE = 0, /**< that of the scene's integrator: the lights for ptracer,
                             both ends for bdpt */
    IMP_FROM_SENSOR,
    IMP_FROM_LIGHTS
};

/** Recorded walks (walks.h). */
typedef struct imp_walks imp_walks;

/** How Monte Carlo is run. The same (seed, spp) give the same bits on any thread count.
 */
struct imp_run {
    size_t size;
    int sensor; /**< index; default 0 */
    int spp;    /**< samples per pixel; 0: those of the scene */
    uint64_t seed;
    /** For pictures. 0: none; else samples are taken until then (every pixel gets at
     * least one pass), at most spp if that is given. */
    double time_limit_s;
    /** Fraction of walks that may be dropped, 0 to 1; 0: 1e-4, and 1e-3 of those that met a
     * hole in the boundary of a medium (IMP_DROP_MEDIUM). */
    double drop_budget;
    imp_progress_fn progress;
    void *progress_payload;
    const imp_guide *guide; /**< NULL: none; for path, and for light walks */
    /** For spectral modes. */
    enum imp_wavelength_sampling wavelengths;
    /** Independent walks of a pixel among which wavelengths are stratified; 0: a quarter of
     * the samples per pixel, at most 16. Standard errors come from the spread of such
     * sets. With IMP_POINTS_SOBOL wavelengths are stratified in the sets of points. */
    int wavelength_set;
    /** For pictures: called with the picture after 1, 2, 4, ... passes of 64 samples
     * (with a time limit, of 4);
     * NULL: not called. */
    imp_preview_fn preview;
    void *preview_payload;
    /** Both ends give the same numbers; what cannot begin there is refused with its
     * name. With light walks spp times the pixels are made for the whole
     * film. */
    enum imp_from from;
    enum imp_points points;
    /** Recorded walks, which are evaluated in place of tracing new ones. Seed, samples,
     * points and wavelengths are those that they were drawn with, whatever these fields
     * are. NULL: walks are traced. */
    const imp_walks *walks;
};
#define IMP_RUN_INIT IMP_INIT_ZERO(struct imp_run)

/** Render the scene's integrator through a sensor.
 * @return IMP_OK; IMP_CANCELLED (*out is valid, with the passes done; or NULL, if less
 * than one pass of a picture of more than 16 million pixels was); IMP_E_ARG; IMP_E_PATHS;
 *         IMP_E_NOMEM, with the size, before the first sample; IMP_E_NUMERIC if a pixel
 * is not finite. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_render(const imp_scene *scene, const struct imp_run *run, imp_film **out);

/**
 * A picture without its noise, by Intel's Open Image Denoise (version 2, found when this
 * is called) from the colours and the albedo and normal of first surfaces, for viewing
 * only. Its error is unknown: it has no standard errors, and it is no target for
 * a fit. Channels other than R, G, B or Y are copied.
 * @param run     of the picture: its sensor and seed; NULL for defaults.
 * @param picture that imp_render made of the scene; borrowed.
 * @param[out] out a new picture with the same channels; the caller destroys it.
 * @return IMP_OK; IMP_E_UNSUPPORTED, with what to do, if there is no such library, or no
 *         channel to denoise; IMP_E_ARG for another size; IMP_E_NOMEM; IMP_CANCELLED.
 */
IMP_API IMP_MUST_CHECK enum imp_status imp_denoise(const imp_scene *scene,
                                                   const struct imp_run *run,
                                                   const imp_film *picture,
                                                   imp_film **out);

/** Is there a library for imp_denoise? To be called before a long render.
 * @return IMP_OK; IMP_E_UNSUPPORTED, with what to do, if there is none. */
IMP_API IMP_MUST_CHECK enum imp_status imp_denoiser_check(imp_context *context);

/** One walk, vertex by vertex, as text (json 0) or JSON: sample number `sample` of pixel
 * (x, y) of the picture, the same walk that renders and gradients of run->seed use
 * (losses of scenes with media: with run->points IMP_POINTS_INDEPENDENT). Walk j of set s
 * of points has the number 64 s + j. Pixels
 * of the border that a film with sample_border samples for its filter have numbers below
 * 0 and from the width, or height, on. The caller frees *text with imp_free.
 * @return IMP_OK; IMP_E_ARG for a pixel outside these; IMP_E_SCENE if the
 * integrator makes no walks; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_walk_describe(const imp_scene *scene,
                                                         const struct imp_run *run, int x,
                                                         int y, int64_t sample, bool json,
                                                         char **text);
/** Free what a function of this context handed to the caller (a text, points,
 * arrivals). memory may be NULL. */
IMP_API void imp_free(imp_context *context, void *memory);

/* ---- Problems: parameters, targets, derivatives -------------------------------- */

typedef struct imp_problem imp_problem;

/** A number with one standard error. */
struct imp_estimate {
    double value, se;
    int bias_order; /**< 0: no bias; 1: O(1/N), 2: O(1/N^2) in the samples per pixel */
    int freedom;    /**< degrees of freedom of se; 0: not said */
};

/** Nothing is active until imp_problem_activate. The scene must outlive the problem, and
 * is changed by calls that take x.
 * @return IMP_OK; IMP_E_ARG if the scene is not committed; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_problem_create(imp_scene *scene,
                                                          imp_problem **out);
/** problem may be NULL. Its scene stays. */
IMP_API void imp_problem_destroy(imp_problem *problem);

/** Make parameters active: a name or a glob ("*.reflectance.value"; "*" is everything
 * that has a gradient). Active parameters keep the scene's order, whatever the order of
 * calls.
 * @return IMP_OK; IMP_E_ARG if nothing matches; IMP_E_BIAS, with the reason, if a
 *         parameter named without wildcards, or all that match, have no unbiased
 *         gradient. */
IMP_API IMP_MUST_CHECK enum imp_status imp_problem_activate(imp_problem *problem,
                                                            const char *glob);
enum imp_tie {
    IMP_TIE_SAME = 0, /**< equal values: one x for all of them, from the first's values */
    IMP_TIE_FACTOR,   /**< one x, from 1, multiplies all of them as they are now */
    IMP_TIE_LOG       /**< v = exp(x), each value by itself: it stays positive */
};

/** Tie all active parameters that match: parameters that are the same paint, lamps of one
 * dimmer. x, gradients, Jacobians, covariances and bounds are then of the tied
 * variables, with their standard errors; regularisers weigh x. A parameter has at most
 * one tie of equality or factor, and one logarithm; checks test every value by itself. A
 * fit's rows have numbers in the parameter's own unit also where x is a logarithm, a
 * factor's are factors.
 * @param glob  as for imp_problem_activate, which comes first; or several, with commas
 *              between them: "left.*,right.*".
 * @return IMP_OK; IMP_E_ARG if nothing is tied by it, sizes or bounds do not agree, a
 *         factor multiplies zeros only, a number is not positive, or has such a tie
 *         already; IMP_E_UNSUPPORTED for factors and logarithms in fields of indices. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_problem_tie(imp_problem *problem, const char *glob, enum imp_tie kind);

struct imp_tie_info {
    size_t size;
    const char *name; /**< the parameter's, or factor(GLOB) */
    bool factor;      /**< x multiplies what the members had when they were tied */
    bool log;         /**< x is a logarithm */
    size_t count;     /**< variables that belong together */
    size_t n_members; /**< parameters that follow them */
    const char *const *members; /**< [n_members] their names; owned by the problem */
};
#define IMP_TIE_INFO_INIT IMP_INIT_ZERO(struct imp_tie_info)

/** What variable i < imp_problem_n_variables of x is.
 * Set info->size first.
 * @return IMP_OK; IMP_E_ARG if i is not below. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_problem_get_tie(const imp_problem *problem, size_t i, struct imp_tie_info *info);

/** Hold numbers of active parameters at the values that the scene has: of a block on a floor
 * `block.pose[2-4]`. Held numbers stay in x, between bounds that are both their value;
 * their derivatives are 0, with an error of 0; fits and their intervals are those of the other
 * numbers. Checks test every number.
 * @param glob  as for imp_problem_activate, which comes first, with the numbers' indices behind
 *              it: "block.pose[2]", "*.pose[3-5]", or without indices for all numbers of a
 *              parameter; or several, with commas between them.
 * @return IMP_OK; IMP_E_ARG if an index is not below the count of numbers, or an active
 *         parameter matches nowhere or has a tie; IMP_E_UNSUPPORTED in fields of
 *         indices; IMP_E_NOMEM. After an error nothing more is held. */
IMP_API IMP_MUST_CHECK enum imp_status imp_problem_hold(imp_problem *problem,
                                                        const char *glob);

/** Length of x: the count of active variables. */
IMP_API size_t imp_problem_n_variables(const imp_problem *problem);
/** An active variable. */
struct imp_variable_info {
    size_t size;
    size_t param; /**< index of its parameter: the first that follows it, if several do */
    size_t element; /**< index inside the parameter */
    double lo, hi;  /**< bounds; may be infinite */
    bool held;      /**< imp_problem_hold: both bounds are its value */
};
#define IMP_VARIABLE_INFO_INIT IMP_INIT_ZERO(struct imp_variable_info)
/** Variable i < imp_problem_n_variables.
 * @param[out] info set its size first.
 * @return IMP_OK; IMP_E_ARG. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_problem_get_variable(const imp_problem *problem, size_t i,
                         struct imp_variable_info *info);
/** x [imp_problem_n_variables] from and to the scene. Setting refuses values outside
 * bounds.
 * @return IMP_OK; IMP_E_ARG. */
IMP_API enum imp_status imp_problem_get_x(const imp_problem *problem, double *x);
/** x [imp_problem_n_variables] is copied to the scene.
 * @return IMP_OK; IMP_E_ARG for a value that is not finite or outside its bounds:
 *         nothing is set. */
IMP_API IMP_MUST_CHECK enum imp_status imp_problem_set_x(imp_problem *problem,
                                                         const double *x);

enum imp_loss {
    IMP_LOSS_L2 = 0,      /**< 1/2 w (I - T)^2: unbiased value and gradient */
    IMP_LOSS_RELATIVE_L2, /**< 1/2 w (I - T)^2 / (T^2 + epsilon): unbiased */
    IMP_LOSS_L1,          /**< w |I - T|: biased near I = T */
    IMP_LOSS_LOG /**< 1/2 w (log(I + epsilon) - log(T + epsilon))^2: bias O(1/N^2) */
};

/** A picture to match through one sensor. The objective is the sum over pixels and
 * channels (Stam 2020, Eq. 10), over targets, plus the regularisers. */
struct imp_target {
    size_t size;
    int sensor;
    int width, height, channels; /**< must be the sensor's; channels 1 or the scene's */
    const float *pixels;         /**< [height][width][channels] */
    const float *weights;        /**< [height][width], >= 0; NULL: 1 everywhere */
    enum imp_loss loss;
    double epsilon;        /**< 0: 1e-2 */
    double scale;          /**< factor of this target's loss; 0: 1 */
    const float *noise_se; /**< [height][width][channels], 1 sigma of the picture's own
                                noise, for covariances; NULL: estimated from residuals */
};
#define IMP_TARGET_INIT IMP_INIT_ZERO(struct imp_target)
/** The target's arrays are copied.
 * @return IMP_OK; IMP_E_ARG if sizes differ from the sensor's, a value is not finite, or
 *         all weights are 0; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_problem_add_target(imp_problem *problem, const struct imp_target *target);

/** 1/2 weight |x - x0|^2 over the active variables that match `glob` (Tikhonov, the term
 * 1/2 eps |theta|^2 of Stam's Eq. 10); x0 is 0, or the values at this call if
 * `from_here`. @return IMP_OK; IMP_E_ARG if nothing matches or the weight is negative;
 * IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_problem_add_tikhonov(imp_problem *problem,
                                                                const char *glob,
                                                                double weight,
                                                                bool from_here);
/** 1/2 weight |grad x|^2, forward differences between neighbouring texels of textures, or
 * samples of spectra, that match `glob`. @return IMP_E_ARG if none has neighbours. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_problem_add_smoothness(imp_problem *problem, const char *glob, double weight);

/** Samples per pixel that imp_problem_objective takes for a target (imp_problem_reverse
 * for target -1), in place of run->spp: they are cut into replicates of equal
 * size, or into two sets of equal size, so it may be a few more.
 * @return IMP_OK; IMP_E_ARG if there is no such target or sensor. */
IMP_API IMP_MUST_CHECK enum imp_status imp_problem_get_spp(const imp_problem *problem,
                                                           int target,
                                                           const struct imp_run *run,
                                                           int *spp);

/**
 * Objective and gradient in one call, from the same walks.
 *
 * Quadratic losses through box filters take one pass with leave-one-out adjoints, so that
 * value and gradient have no bias (docs: estimators); others take two passes, and
 * objective->bias_order is the order of what is left. spp is rounded up to at least 2,
 * and so that replicates and sets have one size (imp_problem_get_spp).
 *
 * @param x         [imp_problem_n_variables]; NULL: the scene's values.
 * @param run       run->sensor is ignored; NULL for defaults.
 * @param[out] objective   may be NULL.
 * @param[out] gradient    [n], objective per unit of x; NULL: value only.
 * @param[out] gradient_se [n], one standard error; may be NULL.
 * @return IMP_OK; IMP_E_ARG without a target, or for an x outside its bounds;
 *         IMP_CANCELLED and IMP_E_PATHS, with nothing written; IMP_E_BIAS where the
 *         integrator's gradient would have one; IMP_E_NOMEM.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_problem_objective(imp_problem *problem, const double *x, const struct imp_run *run,
                      struct imp_estimate *objective, double *gradient,
                      double *gradient_se);

/** The same with NLopt's callback shape (payload: the problem). The run is the one set by
 * imp_problem_set_run; equal seeds make common random numbers. Failure gives HUGE_VAL.
 * x [n] and gradient [n], which may be NULL. */
IMP_API double imp_problem_nlopt(unsigned n, const double *x, double *gradient,
                                 void *problem);
/** Copied; NULL: the defaults. @return IMP_OK; IMP_E_ARG: the run before stays. */
IMP_API enum imp_status imp_problem_set_run(imp_problem *problem,
                                            const struct imp_run *run);

/**
 * Reverse derivative: gradient = J^T seed, J = d pixel / d x, for a given adjoint image.
 * @param seed_image [height][width][channels] of run->sensor, finite. It must come from
 *        other random numbers than `run`: an adjoint made from the same walks is
 *        correlated with J.
 * @param[out] gradient    [n], as imp_problem_objective's.
 * @param[out] gradient_se [n], one standard error; may be NULL.
 * @return as imp_problem_objective.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_problem_reverse(imp_problem *problem, const float *seed_image,
                    const struct imp_run *run, double *gradient, double *gradient_se);

/**
 * A number made of the picture: F = sum(adjoint * picture), and its gradient J^T adjoint.
 * The standard error of F is taken sample by sample: a filter wider than a pixel makes
 * neighbouring pixels share samples, so their errors may not be added as if independent.
 * @param adjoint [height][width][channels] of run->sensor, channels of the scene; NULL:
 * 1/(pixels channels), so that F is the mean of the picture. Not to be made from the same
 * random numbers.
 * @param run   NULL for defaults.
 * @param[out] value       may be NULL.
 * @param[out] gradient    [n], as imp_problem_objective's; NULL: value only.
 * @param[out] gradient_se [n], one standard error; may be NULL.
 * @return as imp_problem_objective; IMP_E_ARG if both value and gradient are NULL.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_problem_functional(imp_problem *problem, const float *adjoint,
                       const struct imp_run *run, struct imp_estimate *value,
                       double *gradient, double *gradient_se);

/** Forward derivative: the picture J x_dot in the scene's channels, with standard errors.
 * x_dot [n], in units of x. The caller destroys the film. @return as imp_render;
 * IMP_E_BIAS. */
IMP_API IMP_MUST_CHECK enum imp_status imp_problem_forward(imp_problem *problem,
                                                           const double *x_dot,
                                                           const struct imp_run *run,
                                                           imp_film **out);

/** One picture dI/dx_i for every active variable, from one set of walks: films [n], each
 * to be destroyed by the caller. n is limited to 256. primal, the picture itself in the
 * scene's channels whatever the film's pixel format, may be NULL; with nothing active and
 * films NULL it is all that is made. @return as imp_problem_forward. */
IMP_API IMP_MUST_CHECK enum imp_status imp_problem_jacobian(imp_problem *problem,
                                                            const struct imp_run *run,
                                                            imp_film **primal,
                                                            imp_film **films);

/**
 * F = sum(adjoint * picture) of the pictures that imp_problem_jacobian made, with
 * standard errors taken sample by sample (see imp_problem_functional): of the picture
 * itself, and of groups of derivative pictures, such as the three numbers of a colour. At
 * most a quarter of the pictures' walks (but 16 per pixel) are made again, without the
 * pictures: a part of them (imp_parts_create) is made with primal and films NULL.
 * @param adjoint  [height][width][channels], as imp_problem_functional's.
 * @param run      that of imp_problem_jacobian; with a time limit, it is not one here.
 * @param primal   the picture; borrowed.
 * @param films    [n] the derivative pictures, as they came; borrowed.
 * @param group    [n] which sum a number's picture belongs to, 0 <= group < n_groups;
 * NULL: each number is a sum of its own, and n_groups is ignored.
 * @param[out] value of the picture; may be NULL.
 * @param[out] sums  [n_groups], or [n].
 * @return IMP_OK; IMP_CANCELLED, with NaN for errors; all are NaN if primal was
 * interrupted before every pixel had its samples; IMP_E_ARG if the films are not this
 * problem's, and IMP_E_PATHS, with nothing written; IMP_E_NOMEM.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_problem_jacobian_sums(imp_problem *problem, const float *adjoint,
                          const struct imp_run *run, const imp_film *primal,
                          imp_film *const *films, const int *group, int n_groups,
                          struct imp_estimate *value, struct imp_estimate *sums);

/* ---- Fitting ------------------------------------------------------------------- */

enum imp_optimizer {
    IMP_ADAM = 0, /**< stochastic, fresh walks every iteration */
    IMP_LM,       /**< Gauss-Newton/Levenberg-Marquardt, unbiased J^T J; n <= 262144 */
    IMP_LBFGS,    /**< NLopt, common random numbers */
    IMP_MMA,
    IMP_SLSQP /**< NLopt, bounded, common random numbers */
};

/** A fit between two iterations. Pointers live during the call. */
struct imp_fit_step {
    size_t size;
    int iteration; /**< completed ones */
    size_t n;      /**< of the problem; 0 for Adam of more than 1024 variables, and of all
                          levels but the last: then x and history_x are NULL */
    const double *x; /**< [n] the best estimate so far */
    size_t n_history;
    const double *history, *history_se, *history_x; /**< as in imp_fit_result */
};
/** Called after each iteration from the thread that called imp_fit. The scene may be
 * rendered at these values (imp_problem_set_x, imp_render). Non-zero stops the fit. */
typedef int (*imp_fit_step_fn)(const struct imp_fit_step *step, void *payload);

/** Recursive control variates (docs/fitting.md): the walks of an iteration are evaluated
 * at the numbers of the one before, too, and what was known of the pictures there is
 * carried on. They are for IMP_ADAM, with losses L2 and relative L2, box filters,
 * walks from the sensor, and parameters that neither move rays nor are extinctions. */
enum imp_variates {
    IMP_VARIATES_AUTO = 0, /**< of more than 64 variables, where they are possible */
    IMP_VARIATES_ON,       /**< where not: an error with the reason */
    IMP_VARIATES_OFF
};

/** How the samples of a search are divided among the tiles (8 x 8 pixels) of its
 * targets. */
enum imp_allocation {
    IMP_ALLOCATION_DEFAULT = 0, /**< by variance; with variates of > 64 variables, even */
    IMP_ALLOCATION_EVEN,        /**< every pixel has the same */
    /** By the root of what a tile adds to the variance of the gradient, over what its
     * samples cost, as the iterations before have seen it: between 1/4 and 16 times the
     * samples of the run, at their cost. */
    IMP_ALLOCATION_VARIANCE
};

struct imp_fit_options {
    size_t size;
    enum imp_optimizer optimizer;
    int max_iterations;     /**< 0: 200 (Adam), 30 (others) */
    double learning_rate;   /**< Adam, as a fraction of each variable's scale; 0: 0.05. It
                                 falls with control variates (momentum) */
    double tolerance;       /**< stop when steps stay below this, relative; 0: 1e-4 */
    bool intervals;         /**< estimate covariance and 95 % intervals at the end */
    const char *checkpoint; /**< file, rewritten every few seconds; NULL: none */
    bool resume;            /**< start from the checkpoint if it is there */
    /** Adam: textures and volumes are fitted from coarse to fine. Level k of `levels` (at
     * most 16) has one variable for 2^(levels - k) cells along each axis, between which
     * the cells are linear, and an equal share of the iterations; a checkpoint holds the
     * last level. 0, 1: cells alone. With active poses, by Adam or Levenberg-Marquardt:
     * level k compares pictures through a tent of 2^(levels - k) pixels, with the targets
     * blurred alike, and the last through the film's own filter. */
    int levels;
    imp_fit_step_fn step; /**< NULL: not called */
    void *step_payload;
    /** IMP_LBFGS, IMP_MMA and IMP_SLSQP evaluate one draw of walks, which is kept
     * (walks.h) in at most so many bytes; 0: 2^30. Walks are traced each time where
     * these do not suffice. Objective and intervals of the answer are of fresh walks. */
    size_t memory;
    enum imp_variates control_variate;
    /** For IMP_ADAM, quadratic losses, box filters and walks from the sensor; others
     * have the same samples everywhere. */
    enum imp_allocation allocation;
    /** Adam: the part of the mean gradient that stays from one iteration to the next, its
     * beta1, in (0, 1); 0: 0.9, but 0.5 for numbers between two bounds in fits of more
     * than 64 numbers with control variates, whose gradients have little noise. The
     * learning rate of these falls as (1 + i/10)^-1/2 with iterations i, whatever
     * momentum is (docs/fitting.md). */
    double momentum;
    /** For IMP_LBFGS, IMP_MMA and IMP_SLSQP: walks are kept, too, where extinctions that
     * vary in space are fitted, with so much room to grow (imp_walks_options.headroom);
     * 0 or 1: none, and such walks are traced each time. */
    double headroom;
    bool no_recording; /**< walks are traced in each evaluation, none are kept */
    /** IMP_ADAM: vertex_positions of meshes are fitted in smooth steps: those of
     * u = (I + mesh_lambda L) x, L the uniform Laplacian of the mesh, with one step size for
     * all (Nicolet, Jacobson, Jakob 2021, "Large steps"). On a mesh with sides h steps are
     * smooth over about h sqrt(1.5 mesh_lambda). Vertices at the same place (seams) move
     * together, and whole places are held or none. 0: a 64th of the number of places; below
     * 0: steps of single vertices. A build without CXSparse refuses the
     * former by name. */
    double mesh_lambda;
};
#define IMP_FIT_OPTIONS_INIT IMP_INIT_ZERO(struct imp_fit_options)

struct imp_fit_variable {
    size_t size;
    double start, value;
    double se; /**< one standard error: measurement and Monte Carlo together */
    double lo95,
        hi95;     /**< 95 % interval; NaN if neither pictures nor a prior determine it */
    int at_bound; /**< -1: at the lower bound, 1: at the upper */
    bool determined; /**< 0: the picture does not determine it; an interval is then that
                            of the posterior */
};
#define IMP_FIT_VARIABLE_INIT IMP_INIT_ZERO(struct imp_fit_variable)

struct imp_fit_result {
    size_t size;
    int iterations;
    struct imp_estimate objective;
    size_t n_history;
    const double *history; /**< [n_history] objective of every iteration */
    const double *history_se;
    size_t n;
    const struct imp_fit_variable *variables; /**< [n]; NULL if n > 1024, where rows of
                                                   this size would take more memory than
                                                   the fit: imp_problem_get_fit_variable */
    double condition;                         /**< of the scaled J^T J; 0: not computed */
    const char *reason;                       /**< why it stopped */
    const char *warning; /**< e.g. what is not determined; NULL: none */
    double residual;    /**< root of sum w (I - T)^2 / sum w T^2 (log: of the mean squared
                             log ratio), our own noise taken off; NaN with l1 */
    double residual_hi; /**< the same two standard errors of the loss higher */
    double chi2, chi2_se; /**< per degree of freedom: the loss over what the targets'
                               noise alone leaves; 1 where the scene explains the
                               pictures. NaN where that noise is not known, or l1 */
    /** Where a bias is left: bound of the change of an answer by four times the samples, in
     * standard errors. NaN: no bias, or no intervals. */
    double shift;
    /** [n][n] of the variables, measurement and Monte Carlo together, in the directions
     * that the pictures determine and no bound holds. NULL: no intervals. */
    const double *covariance;
    int spp; /**< samples per pixel that each evaluation of the search took, of the
                  target with most of them */
    /** [n_history][n] where the objective was evaluated; NULL for n > 64. */
    const double *history_x;
    /** [n] the change of the variables that the pictures determine least, in units of x;
     * imp_problem_forward makes the picture of it. NULL where all variables are
     * determined, or there are no intervals. */
    const double *loosest;
    /** Which evaluations of the search were of recorded walks, or why none were; NULL: the
     * optimizer draws new ones each time. */
    const char *walks;
    const char *control_variate; /**< Adam: what it brought, or why there was none; NULL:
                                      not wanted */
    /** Chi-square that our own noise in the variables adds, over the `n` that the targets' noise takes from it:
     * tr(H C)/tr(H D) of their covariances C and D. NaN without intervals. */
    double own_part;
};

/** Fit the active parameters to the targets; the scene ends at the best estimate.
 * options and run may be NULL. The result belongs to the problem and lives until its next
 * fit.
 * @return IMP_OK; IMP_CANCELLED (the state reached is set, the checkpoint is written);
 *         IMP_E_ARG if nothing is active, there is no target, an option is out of its
 *         range or the checkpoint is another fit's; IMP_E_NUMERIC; and what
 *         imp_problem_objective returns; IMP_E_IO where another fit that runs writes the
 *         checkpoint. */
IMP_API IMP_MUST_CHECK enum imp_status imp_fit(imp_problem *problem,
                                               const struct imp_fit_options *options,
                                               const struct imp_run *run,
                                               const struct imp_fit_result **result);
/** May a fit begin to keep its state in this file? A fit, of bent rays too, holds PATH.lock while it
 * runs, so that a checkpoint has one writer; the lock ends with its process. Between machines it
 * counts where their common file system has locks (NFS without nolock has).
 * @return IMP_OK; IMP_E_ARG; IMP_E_IO: a fit that runs writes it (the message has its process);
 *         IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_checkpoint_free(imp_context *context,
                                                           const char *path);

/** Variable i < n of the problem's last fit, whatever n.
 * @return IMP_E_ARG also if there was no fit. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_problem_get_fit_variable(const imp_problem *problem, size_t i,
                             struct imp_fit_variable *variable);

/** A variable that is not active, and what it would bring to fit it too. */
struct imp_missing {
    size_t size;
    size_t param, element; /**< of the scene */
    bool factor;           /**< 1: the common factor of all values of a texture, volume or
                                list, which is 1 now; element is 0 */
    double value;          /**< now */
    double step,
        step_se; /**< by which it would move, the active variables following; in its
                                unit; by measurement and Monte Carlo */
    double chi2,
        chi2_se;   /**< expected drop of chi-square, in units of the pictures' noise,
                                and its Monte Carlo error */
    double chance; /**< Bonferroni-corrected p-value, for Gaussian noise: at most the
                                probability that any of the tested values differs so much
                                where all are right */
};

/** Which variable may be wrong? One sweep gives the score of all variables that are not
 * active and have a derivative; about 20 that exceed their Monte Carlo noise have
 * Gauss-Newton rows, by which the active ones follow them (docs/estimators.md 15.1). To
 * be called where the active values are fitted, and set in the scene. A parameter of
 * more than 8 values is tested through one common factor.
 * @param run       run->sensor is ignored; NULL for defaults.
 * @param[out] rows [n] in order of chi2 - 2 chi2_se; they belong to the problem, until
 *                the next call.
 * @return as imp_problem_objective; IMP_E_UNSUPPORTED with more than 236 active
 *         variables. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_problem_missing(imp_problem *problem, const struct imp_run *run,
                    const struct imp_missing **rows, size_t *n);

/* ---- Steps of an optimiser ------------------------------------------------------- */

enum imp_rule {
    IMP_RULE_ADAM = 0, /**< Kingma and Ba 2015, Algorithm 1 */
    IMP_RULE_SGD       /**< gradient descent with momentum */
};

struct imp_optimizer_rule {
    size_t size;
    enum imp_rule kind;
    double learning_rate; /**< > 0, in the unit of x (Adam) or x/gradient (SGD) */
    double beta1, beta2;  /**< Adam: decay of the moments, in [0, 1) */
    double epsilon;       /**< Adam: > 0, in the unit of the gradient */
    double momentum;      /**< SGD: in [0, 1) */
};
#define IMP_OPTIMIZER_RULE_INIT                                                          \
    IMP_INIT(struct imp_optimizer_rule, .learning_rate = 0.05, .beta1 = 0.9,             \
             .beta2 = 0.999, .epsilon = 1e-8)

/** Length of the state of imp_optimizer_step for n numbers. */
#define IMP_OPTIMIZER_STATE(n) (1 + 2 * (n))

/**
 * One step of a plain optimiser, for loops of a host's own: x [n] moves against gradient
 * [n], and is then put inside its bounds. imp_fit searches better: it has the errors of
 * gradients, chooses its pace by them, and ends with intervals.
 * @param rule  NULL for the defaults.
 * @param lo    [n]; NULL: no lower bounds.
 * @param hi    [n]; NULL: no upper bounds.
 * @param[in,out] state [IMP_OPTIMIZER_STATE(n)], of the caller: all zeros before the
 *              first step. state[0] is the number of steps taken.
 * @param[in,out] x     [n].
 * @return IMP_OK; IMP_E_ARG (message: imp_last_error(NULL)) for a number of the rule
 *         outside its range, a gradient that is not finite or a bound that no number
 *         keeps: nothing is changed.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_optimizer_step(const struct imp_optimizer_rule *rule, size_t n,
                   const double *gradient, const double *lo, const double *hi,
                   double *state, double *x);

/* ---- Checking ------------------------------------------------------------------ */

/** The outcome of a check. */
enum imp_verdict {
    IMP_VERDICT_OPEN = -1, /**< the check does not decide */
    IMP_VERDICT_WRONG = 0,
    IMP_VERDICT_RIGHT = 1
};
/** One line of a gradient check: a method, a parameter, two numbers that must agree. */
struct imp_check_row {
    size_t size;
    const char *method; /**< "frozen", "fresh", "dot", "euler", "loss", "ends"; "uniform",
                             "energy", "aim" (imp_check_options.sampling); rows that
                             compare draws with a density (docs/estimators.md 13 H) */
    const char *param;
    double step;                 /**< of a difference; 0: none */
    double value, reference, se; /**< se of the difference; 0: deterministic */
    double error; /**< relative error; where se > 0: |z|, z = (value - reference) / se */
    double limit; /**< of error; 0: a row for information (a step that is not the best) */
    enum imp_verdict ok; /**< they agree; they do not; too noisy to decide */
    int kinks;           /**< frozen walks at a kink that agree with one of its sides */
    double sees; /**< of a row that compares draws with a density: the smallest relative
                      error of the density that it would have found, with a probability of
                      0.9. Above 0.02 such a row does not decide, unless it fails. 0: of
                      other rows */
    const char *why; /**< why a row that has no reference decides nothing: a difference
                          that would press a shape into another; NULL: of other rows */
};
struct imp_check_options {
    size_t size;
    int paths;     /**< frozen walks; 0: 1000 */
    int fresh_spp; /**< samples per pixel of fresh-seed differences; 0: the run's */
    /** 1: check sampling in place of gradients. The picture, and one with directions
     * drawn uniformly and lights met by chance, are compared in 8 x 8 blocks: rows
     * "uniform", the worst block of each channel, and chi-square of all. Rows "energy":
     * the part of the light that arrives through directions that a density drew at the
     * first choice of a walk (value), and the part of these directions (reference); also
     * of each light and proxy, where there are several, 16 at most. Rows "aim": the part
     * of the directions towards a proxy in which anything lies. */
    bool sampling;
    /** The methods that are wanted, separated by commas: "frozen,directions"; NULL: all.
     * What no wanted row needs is not computed. */
    const char *only;
    /** Seconds that all rows together may take that compare draws with a density, before
     * those that fail are confirmed; 0: 20. A row ends when it sees an error of 2 %
     * (imp_check_row.sees), so that its numbers depend on the clock only where it does not. */
    double draws_s;
};
#define IMP_CHECK_OPTIONS_INIT IMP_INIT_ZERO(struct imp_check_options)
/** Check the gradients of all active parameters (docs: gradient checks). Rows belong to
 * the problem until its next check. @return IMP_OK also when rows fail: look at `ok`. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_check(imp_problem *problem, const struct imp_check_options *options,
          const struct imp_run *run, const struct imp_check_row **rows, size_t *n_rows);

/* ---- Testing the kinds of a scene ------------------------------------------------ */

enum imp_selftest_subject {
    IMP_SELFTEST_MATERIAL,
    IMP_SELFTEST_LIGHT,
    IMP_SELFTEST_CAMERA,
    IMP_SELFTEST_PHASE,  /**< phase functions of media */
    IMP_SELFTEST_MEDIUM, /**< what media are at places of their box, or at the origin */
    IMP_SELFTEST_SHAPE   /**< shapes; those of groups where the group has them */
};
/** One contract of one object, with the inputs that it has in the scene:
 *
 *   finite      answers for any direction: neither NaN nor infinite nor negative
 *   covers      a density wherever the value or a derivative is not 0
 *   normalised  integral of the density, lobes without one and missing draws: 1
 *   draws       chi-square of draws against the density
 *   albedo      by draws against quadrature
 *   energy      power that leaves, of 1 that comes in: at most 1
 *   reciprocal  directions exchanged (radiance over n^2); where not, IMP_VERDICT_OPEN
 *   derivative  against differences
 *   density     of a light's draws against its density for the same point
 *   light       by a light's own draws against directions drawn without it
 *   unit, smooth, filter    rays and the reconstruction filter of a camera
 *   part        scattering is not above the extinction
 *   bounded     extinction is not above what flights take for its bound
 *
 * and of shapes, along random lines through a box larger than theirs:
 *
 *   hits        are on the line at t, nearest first, with a finite surface
 *   normal      frames are orthonormal; neighbouring hits lie across ng
 *   uv          neighbouring hits differ by dp_du, dp_dv; `place` gives them back
 *   sides       normals of closed analytic shapes point outwards, or, mirrored or with
 *               flip_normals, inwards
 *   box         nothing lies outside of lo and hi
 *   met         rays of the scene meet the shape where its own functions do
 *   moves       hits of analytic shapes go with `move` and `placed`
 *   area        against the number of crossings, of triangles against their sum
 *   drawn       points by area lie on the surface, with its normal and uv
 *   points      are as many in each part of the box as its area says
 *   towards     points drawn towards a place lie where they say
 *   density     of these points, against the density for the same hit
 *   angle       mean of 1/density against the solid angle, in each part of the box */
struct imp_selftest_row {
    size_t size;
    const char *object, *kind, *contract;
    double value, reference;
    double se;      /**< of the difference; 0: none */
    double answers; /**< of a count: out of how many */
    double error;   /**< a count of failures, a relative error, or |z| */
    double limit;   /**< of error */
    double chance;  /**< of a value so far off, if all is right; -1: not statistical */
    enum imp_verdict
        ok; /**< open: not promised, and not so; or, where `sees` is above 0.02,
                              as it should be, with too few draws to tell */
    /** In a row that draws ("draws", "normalised", "albedo", "light", "area", "points", "angle"): the relative error of the
     * density or light that it would have found with a probability of 0.95, in all directions
     * or places together; of "draws" the root of the mean square over what is drawn. 0: of
     * other rows. */
    double sees;
};
struct imp_selftest_options {
    size_t size;
    int samples; /**< draws of an object; 0: 200,000, and up to 16 times as many until its
                         rows would see an error of 2 % (imp_selftest_row.sees) */
    int directions; /**< of sight, or places of reference, of an object; 0: 12 */
    uint64_t seed;
    imp_progress_fn progress; /**< may be NULL */
    void *progress_payload;
};
#define IMP_SELFTEST_OPTIONS_INIT IMP_INIT_ZERO(struct imp_selftest_options)
/** Test the contracts of kinds on the scene's own objects. Rows belong to the scene until
 * its next self-test; their names live as long as the scene.
 * @return IMP_OK also where rows fail: look at `ok`; IMP_CANCELLED without rows; IMP_E_ARG (an
 * unknown subject, too few samples) or IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_selftest(imp_scene *scene, enum imp_selftest_subject subject,
             const struct imp_selftest_options *options,
             const struct imp_selftest_row **rows, size_t *n_rows);

/* ---- Comparing pictures -------------------------------------------------------- */

struct imp_compare_result {
    size_t size;
    double rmse, relative_rmse,
        max_abs;           /**< of all channels; relative to the reference */
    double mean_a, mean_b; /**< of test and reference */
    /** Fraction of pixels whose z-test fails at 1 % over the whole picture. */
    double p_fail_fraction;
    double mean_z; /**< |z| of the picture's mean, worst channel */
    double over2;  /**< fraction of pixels with |z| > 2; 0.0455 expected */
    bool has_z;    /**< standard errors or a variance are there: z means something */
    bool agree;    /**< by z where it is there, else by relative_rmse */
};
struct imp_compare_options {
    size_t size;
    const imp_film *variance; /**< per sample, of `reference`; NULL: use the films' se */
    double n_test, n_reference; /**< samples per pixel; 0: unknown / exact */
    double floor; /**< of the variance; 0: 1e-4 * squared mean of the channel */
    bool xyz;     /**< compare X, Y, Z: pictures and variance are made to them from
                       R, G, B (or Y alone). Mitsuba's references keep the variance
                       of X, Y, Z so, as if it were a colour */
};
#define IMP_COMPARE_OPTIONS_INIT IMP_INIT_ZERO(struct imp_compare_options)
/** Do two pictures of one size show the same, within their noise? Every channel of
 * `reference` is matched with one of `test` by name, else by place. options may be NULL;
 * neither picture is changed.
 * @return IMP_OK also where they differ: look at `agree`; IMP_E_ARG if sizes or channels
 *         do not go together; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_compare(imp_context *context, const imp_film *test, const imp_film *reference,
            const struct imp_compare_options *options, struct imp_compare_result *result);

/* ---- Names of 0.1 -------------------------------------------------------------- */

IMP_DEPRECATED("imp_problem_n_variables")
static inline size_t imp_problem_n(const imp_problem *problem)
{
    return imp_problem_n_variables(problem);
}
IMP_DEPRECATED("imp_problem_get_fit_variable")
static inline enum imp_status imp_problem_fit_variable(const imp_problem *problem,
                                                       size_t i,
                                                       struct imp_fit_variable *variable)
{
    return imp_problem_get_fit_variable(problem, i, variable);
}
IMP_DEPRECATED("imp_film_text")
static inline const char *imp_film_get_text(const imp_film *film, const char *key)
{
    return imp_film_text(film, key);
}
IMP_DEPRECATED("imp_problem_get_spp")
static inline enum imp_status imp_problem_spp(const imp_problem *problem, int target,
                                              const struct imp_run *run, int *spp)
{
    return imp_problem_get_spp(problem, target, run, spp);
}
IMP_DEPRECATED("imp_problem_get_variable")
static inline enum imp_status imp_problem_variable(const imp_problem *problem, size_t i,
                                                   size_t *param, size_t *element,
                                                   double *lo, double *hi)
{
    struct imp_variable_info info = IMP_VARIABLE_INFO_INIT;
    const enum imp_status st = imp_problem_get_variable(problem, i, &info);
    if (st != IMP_OK) return st;
    if (param) *param = info.param;
    if (element) *element = info.element;
    if (lo) *lo = info.lo;
    if (hi) *hi = info.hi;
    return IMP_OK;
}

#ifdef __cplusplus
}
#endif
#endif
