/* SPDX-License-Identifier: Apache-2.0
 *
 * A second scene with the same objects and values, made from the first one's bytes. */
#include "twin_scene.h"
#include "scene/fingerprint.h"
#include "tree_file.h"
#include "walks_file.h"
#include <string.h>

enum imp_status imp__twin_take(const struct imp_scene *scene, const double *theta,
                               const struct imp_bytes *bytes, struct imp_scene **out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    imp_scene *twin = NULL;
    double *taken = imp__alloc(ctx, scene->n_theta + 1, sizeof *taken);
    if (!taken) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a second scene"));
    IMP_TRY(imp__tree_take(ctx, "recorded walks", bytes->data, bytes->size, &twin));
    bool same = twin->n_theta == scene->n_theta;
    if (same) imp__walks_theta_set(twin, theta);
    if (same) imp__walks_theta_get(twin, taken);
    same = same && memcmp(taken, theta, twin->n_theta * sizeof *taken) == 0 &&
           imp__fingerprint_evaluated(twin) == imp__fingerprint_evaluated(scene);
    if (!same)
        IMP_TRY(imp__error(ctx, IMP_E_UNSUPPORTED,
                           "recorded walks: this scene is not whole without its geometry "
                           "(a light that derives something from its shape, or "
                           "instances in instances)"));
    *out = twin;
    twin = NULL;
out:
    imp_scene_destroy(twin);
    imp__release(ctx, taken);
    return st;
}

enum imp_status imp__scene_twin(const struct imp_scene *scene, struct imp_scene **out)
{
    enum imp_status st = IMP_OK;
    struct imp_bytes bytes = {0};
    double *theta = imp__alloc(scene->ctx, scene->n_theta + 1, sizeof *theta);
    if (!theta)
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a second scene");
    imp__walks_theta_get(scene, theta);
    IMP_TRY(imp__tree_put(scene, theta, &bytes));
    IMP_TRY(imp__twin_take(scene, theta, &bytes, out));
out:
    imp__bytes_free(scene->ctx, &bytes);
    imp__release(scene->ctx, theta);
    return st;
}
