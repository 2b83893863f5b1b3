/* SPDX-License-Identifier: Apache-2.0
 *
 * The scene: its objects, and the parameters that describe it. Objects are made once from
 * a tree of nodes (scene_build.c), theta is a list of places where their values are
 * stored (theta.c), and rays are answered by intersect.c (intersector.h alone includes
 * Embree). */
#ifndef IMP_SCENE_H
#define IMP_SCENE_H

#include "access.h"
#include "aimed_directions.h"
#include "color/convert.h"
#include "color/wavelength.h"
#include "integrator.h"
#include "math/offset.h"
#include "math/vec.h"

enum imp_param_store { IMP_STORE_LANES, IMP_STORE_BULK, IMP_STORE_DOUBLES };

/* Someone who derived something from numbers of theta. */
struct imp_listener {
    struct imp_listener *next; /* began to listen later */
    void (*changed)(void *payload);
    void *payload;
    bool due; /* a value that it depends on has been set since the last call */
};
struct imp_watch { /* one of the listeners of a parameter */
    struct imp_watch *next;
    struct imp_listener *listener;
};

/* How the lanes of an input depend on its parameter values. */
enum imp_degree {
    IMP_DEGREE_LINEAR,
    IMP_DEGREE_FIRST, /* k times the parameters give k times the value */
    IMP_DEGREE_OTHER
};

struct imp_param {
    struct imp_param_info info;
    enum imp_degree degree;
    struct imp_watch *watches;
    enum imp_param_store store;
    imp_spec *lanes; /* LANES: info.count numbers in lanes 0.., a scalar in all of them */
    float *bulk;     /* BULK: [info.count] in place */
    float box[6];    /* of a volume: its file's, corner by corner */
    double *doubles; /* DOUBLES: [info.count] in place */
    bool probed;     /* an extinction depends on it: its derivative has side walks, and is
                        not that of a frozen walk (walk/media/probe.c) */
};

/* Ways of drawing wavelengths that a sensor has. */
enum { IMP_WAVES_UNIFORM, IMP_WAVES_IMPORTANCE, IMP_WAVES_DRAWN };

/* A graded index inside shapes. What it is, and how rays step through it, is internal to
 * src/bend; its coefficients are parameters like all others. */
struct imp_graded;
struct imp_body_numbers {
    const char *key;     /* below the medium's name: "field.coefficients" */
    size_t first, count; /* place in the field's theta */
    int n_dims;
    size_t dims[3];
    double *number, lo, hi;
    const char *why; /* the field itself allows no derivative; or NULL */
    int param;       /* -1 until the scene is built */
};
struct imp_body {
    const char *name;
    struct imp_graded *graded;    /* bend/inside.h; owned by the scene */
    double outside;               /* index around it */
    imp_v3 lo, hi;                /* of all shapes it fills */
    const struct imp_shape *ball; /* the sphere it fills, if nothing else is near it */
    struct imp_node *node;        /* where it was declared */
    int index;                    /* in the scene; -1: in no shape */
    int n_numbers;
    struct imp_body_numbers *numbers;
};

struct imp_light_tree;

/* An object of a room above, opaque here: destroyed with the scene. */
struct imp_owned {
    struct imp_owned *next; /* made earlier */
    void *object;
    void (*destroy)(void *object);
};

struct imp_scene {
    imp_context *ctx;
    struct imp_arena arena; /* nodes, objects, names */
    enum imp_color_mode mode;
    bool linear_colors; /* become spectra by the linear basis */
    int64_t spp;        /* that all its runs will take, about; 0: not known */
    int channels;       /* of a walk's radiance: 3 or 1 */
    int lanes;          /* of its values: 4 wavelengths, else as many as channels */
    const struct imp_wavelengths *wavelengths; /* [n_sensors][IMP_WAVES_DRAWN]; NULL:
                                                  colours */
    bool committed;
    /* The scene in a file of recorded walks, which no ray meets: shapes have no geometry. */
    bool rayless;
    enum imp_lenience
        lenient;          /* not IMP_LENIENT_OFF: it goes on without what there is not */
    const char **missing; /* [n_missing] a line for each */
    int n_missing;

    struct imp_node *root;   /* being built, or what the objects came from */
    struct imp_node **stack; /* open objects of imp_scene_begin */
    size_t n_stack, cap_stack;
    enum imp_status build_status; /* first failure of the building calls */
    char *build_error;
    struct imp_setting *settings, *last_setting; /* of the file, until it is made ... */
    struct imp_arena settings_arena;             /* ... and their text */
    char **search;                               /* [n_search] folders for files */
    size_t n_search;
    struct imp_tree *tree;  /* of the building calls, until commit (format/tree.h) */
    struct imp_arena files; /* what files held and objects copy; freed by commit */
    struct imp_owned *owned;
    /* Another scene with the same objects and values, in which walks are evaluated and no
     * ray meets anything. Set by the room that makes scenes from files and calls
     * (format/twin_scene.c); NULL: no such room made it. */
    enum imp_status (*twin)(const struct imp_scene *scene, struct imp_scene **out);

    int n_shapes, n_bsdfs, n_emitters, n_sensors, n_textures;
    int n_all_shapes;          /* with those of groups */
    struct imp_shape **shapes; /* [n_all_shapes] */
    int n_groups, n_covered;
    struct imp_group **groups; /* instances.h */
    struct imp_covered **covered;
    const struct imp_raised *raised; /* copies of shapes for bump maps in instances: the
                                        last one made (build_bumps.c); NULL: none */
    struct imp_group *world; /* its shapes and instances; NULL: there are no instances */
    struct imp_bsdf **bsdfs; /* every node, nested ones too */
    struct imp_emitter **emitters;
    struct imp_sensor **sensors;
    struct imp_texture **textures;
    int n_bodies;
    struct imp_body **bodies; /* attached to nodes; those in use have an index */
    int n_media;
    struct imp_medium **media; /* those that scatter */
    bool media_open;           /* some lie in others that their shapes do not name */
    bool *sealed; /* [n_media] no light sample leaves it (sealed.h); NULL: no media */
    bool *closed; /* [n_all_shapes] bounds a medium, and is closed; with `sealed` */
    struct imp_priorities *priorities; /* NULL: no shape has one */
    struct imp_bsdf *default_bsdf, *black_bsdf;
    const struct imp_integrator *integrator; /* NULL: none was written */
    int environment;                         /* emitter index of the first, -1: none */
    int n_environments;
    int *environments;   /* [n_environments] emitter indices: radiances of a ray add up */
    bool timed_lights;   /* some vary in time */
    double *light_cdf;   /* [n_emitters] by sampling_weight, last is 1 */
    bool lights_in_tree; /* some integrator chooses lights by the tree */
    bool grids_by_tree;  /* some integrator does so for grids of illuminances alone */
    struct imp_light_tree *light_tree; /* NULL: none does (light_tree.h) */
    int n_bsdf_mixing;
    struct imp_mixing **bsdf_mixing; /* [n_bsdfs] NULL: the integrator's */
    bool materials_mix;              /* some material has weights */
    int n_proxies;
    struct imp_proxy **proxies;
    struct imp_aims aims;

    size_t n_params, cap_params;
    struct imp_param *params;
    size_t n_theta;
    struct imp_listener *listeners;
    struct imp_pose *poses; /* in the order in which they were added (pose.h) */
    bool moved, reshaped; /* some pose has changed; a shape's, since the tree was made */
    _Atomic bool in_problem; /* a problem has been created, by any thread: no parameter is
                                added any more */

    void *intersector;
    imp_v3 lo, hi;        /* bounds of all shapes */
    struct imp_ball ball; /* around them */
    struct imp__access access;
};

/* ---- scene.c ------------------------------------------------------------------- */
/* An empty scene without folders to search; imp_scene_destroy ends it. */
enum imp_status imp__scene_new(imp_context *ctx, enum imp_color_mode mode,
                               enum imp_upsampling upsampling, struct imp_scene **out);
/* The last object owned is the first destroyed; on failure it is destroyed at once. */
enum imp_status imp__scene_own(struct imp_scene *scene, void *object,
                               void (*destroy)(void *object));
/* Objects have copied what they need of meshes and pictures. */
void imp__scene_release_files(struct imp_scene *scene);

/* ---- scene_build.c ------------------------------------------------------------------- */
/* Resolve references, make every object in document order, commit the intersector. Files
 * must have been attached to the nodes (format/resolve.c). `integrators` ends with NULL. */
enum imp_status imp__scene_build(struct imp_scene *scene,
                                 const struct imp_integrator_ops *const *integrators);

/* Around all shapes, with room for rays to start outside. */
struct imp_ball imp__ball_around(const struct imp_scene *scene);

/* ---- integrator.c -------------------------------------------------------------- */
enum imp_status imp__integrator_build(struct imp_scene *scene, struct imp_node *node,
                                      const struct imp_integrator_ops *const *kinds,
                                      struct imp_integrator *out);

/* When all objects are there: of an integrator and those in it. */
enum imp_status imp__integrator_ready(struct imp_scene *scene,
                                      const struct imp_integrator *i);

/* ---- scene_waves.c ------------------------------------------------------------- */
/* scene->wavelengths, when sensors and lights are there. */
enum imp_status imp__waves_build(struct imp_scene *scene);

/* ---- bodies.c ------------------------------------------------------------------- */
/* The medium of a shape: its numbers become parameters where it is met first. */
enum imp_status imp__build_body(struct imp_scene *scene, struct imp_node *node,
                                const char *parent, const struct imp_body **out);
/* When all objects are there: may these media be where they are, and which of their
 * coefficients have a derivative? */
enum imp_status imp__bodies_check(struct imp_scene *scene);

/* ---- theta.c ------------------------------------------------------------------- */
enum imp_status imp__theta_add(struct imp_scene *scene, const struct imp_param *param,
                               int *index);
/* Give every parameter its offset, in order of addition. */
void imp__theta_finish(struct imp_scene *scene);
/* Value k of a parameter. Setting does not check the bounds; the caller calls
 * imp__theta_announce after the last value, before anything is rendered. */
double imp__param_get(const struct imp_param *p, size_t k);
void imp__param_set(struct imp_param *p, size_t k, double value);
/* Call `changed` after numbers of this parameter have been set to others: once for all
 * parameters that are watched with this payload, those who began first come first. It
 * cannot fail, so what it needs is there before. */
enum imp_status imp__theta_watch(struct imp_scene *scene, int param,
                                 void (*changed)(void *payload), void *payload);
void imp__theta_announce(const struct imp_scene *scene);
/* IMP_E_ARG with a message if the value is not finite or outside the bounds. */
enum imp_status imp__param_check(const struct imp_scene *scene, const struct imp_param *p,
                                 size_t k, double value);

/* ---- intersect.c --------------------------------------------------------------- */
/* With those of its groups; renew: of what stands in the scene itself has moved, and groups have not. */
enum imp_status imp__intersector_create(struct imp_scene *scene);
enum imp_status imp__intersector_renew(struct imp_scene *scene);
void imp__intersector_destroy(struct imp_scene *scene);
size_t imp__intersector_bytes(const struct imp_scene *scene);
/* Nearest hit of o + t d, tmin < t < tmax, tmin >= 0, at a time. Rays that are not finite
 * hit nothing. */
bool imp__intersect_at(const struct imp_scene *scene, double time, const imp_v3 *o,
                       const imp_v3 *d, double tmin, double tmax, struct imp_hit *hit);
/* Is anything between? */
bool imp__occluded_at(const struct imp_scene *scene, double time, const imp_v3 *o,
                      const imp_v3 *d, double tmin, double tmax);
/* At time 0. */
static inline bool imp__intersect(const struct imp_scene *scene, const imp_v3 *o,
                                  const imp_v3 *d, double tmin, double tmax,
                                  struct imp_hit *hit)
{
    return imp__intersect_at(scene, 0, o, d, tmin, tmax, hit);
}
static inline bool imp__occluded(const struct imp_scene *scene, const imp_v3 *o,
                                 const imp_v3 *d, double tmin, double tmax)
{
    return imp__occluded_at(scene, 0, o, d, tmin, tmax);
}

static inline const struct imp_bsdf *imp__shape_bsdf(const struct imp_scene *scene,
                                                     const struct imp_shape *s)
{
    return s->bsdf >= 0    ? scene->bsdfs[s->bsdf]
           : s->bsdf == -2 ? scene->black_bsdf
                           : scene->default_bsdf;
}

#endif
