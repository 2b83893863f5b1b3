/* SPDX-License-Identifier: Apache-2.0
 *
 * Functions and numbers are those of Open Image Denoise's documentation, version 2. */
#include "denoiser.h"
#include <dlfcn.h>
#include <string.h>

#define DEVICE_CPU    1
#define FORMAT_FLOAT3 3

#ifndef IMP_OIDN
#define IMP_OIDN "libOpenImageDenoise.so.2" /* by the loader's search path */
#endif

typedef void *handle; /* of a device, or a filter */
struct denoiser {
    handle (*new_device)(int type);
    void (*set_device_int)(handle device, const char *name, int value);
    void (*set_device_bool)(handle device, const char *name, bool value);
    void (*commit_device)(handle device);
    void (*release_device)(handle device);
    int (*get_error)(handle device, const char **message);
    handle (*new_filter)(handle device, const char *type);
    void (*set_image)(handle filter, const char *name, void *pixels, int format,
                      size_t width, size_t height, size_t offset, size_t pixel_stride,
                      size_t row_stride);
    void (*set_filter_bool)(handle filter, const char *name, bool value);
    void (*commit_filter)(handle filter);
    void (*execute_filter)(handle filter);
    void (*release_filter)(handle filter);
};

/* The library stays loaded: its threads outlive a device. */
static enum imp_status find(imp_context *ctx, struct denoiser *d)
{
    void *library = dlopen(IMP_OIDN, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    const struct {
        const char *name;
        void *to;
    } functions[] = {{"oidnNewDevice", &d->new_device},
                     {"oidnSetDeviceInt", &d->set_device_int},
                     {"oidnSetDeviceBool", &d->set_device_bool},
                     {"oidnCommitDevice", &d->commit_device},
                     {"oidnReleaseDevice", &d->release_device},
                     {"oidnGetDeviceError", &d->get_error},
                     {"oidnNewFilter", &d->new_filter},
                     {"oidnSetSharedFilterImage", &d->set_image},
                     {"oidnSetFilterBool", &d->set_filter_bool},
                     {"oidnCommitFilter", &d->commit_filter},
                     {"oidnExecuteFilter", &d->execute_filter},
                     {"oidnReleaseFilter", &d->release_filter}};
    if (!library)
        return imp__error(
            ctx, IMP_E_UNSUPPORTED,
            "Open Image Denoise 2 is not found (%s): configure importon with "
            "-Doidn=DIR, the folder that has it, or put its folder into "
            "LD_LIBRARY_PATH",
            IMP_OIDN);
    for (size_t k = 0; k < imp_count(functions); k++) {
        void *f = dlsym(library, functions[k].name);
        if (!f)
            return imp__error(ctx, IMP_E_UNSUPPORTED, "%s has no %s: it is not version 2",
                              IMP_OIDN, functions[k].name);
        memcpy(functions[k].to, &f, sizeof f);
    }
    return IMP_OK;
}

enum imp_status imp__denoiser_find(imp_context *ctx)
{
    struct denoiser d;
    return find(ctx, &d);
}

enum imp_status imp__denoise(imp_context *ctx, int width, int height, float *colour,
                             float *albedo, float *normal, float *out)
{
    enum imp_status st = IMP_OK;
    struct denoiser d;
    const char *message = NULL;
    handle device = NULL, filter = NULL;
    IMP_TRY(find(ctx, &d));
    device = d.new_device(DEVICE_CPU);
    if (!device) {
        d.get_error(NULL, &message);
        IMP_TRY(imp__error(ctx, IMP_E_UNSUPPORTED, "Open Image Denoise: %s",
                           message ? message : "no device"));
    }
    d.set_device_int(device, "numThreads", ctx->threads);
    d.set_device_bool(device, "setAffinity",
                      false); /* the host's threads are the host's */
    d.commit_device(device);
    filter = d.new_filter(device, "RT");
    if (filter) {
        const size_t w = (size_t)width, h = (size_t)height;
        d.set_image(filter, "color", colour, FORMAT_FLOAT3, w, h, 0, 0, 0);
        d.set_image(filter, "albedo", albedo, FORMAT_FLOAT3, w, h, 0, 0, 0);
        d.set_image(filter, "normal", normal, FORMAT_FLOAT3, w, h, 0, 0, 0);
        d.set_image(filter, "output", out, FORMAT_FLOAT3, w, h, 0, 0, 0);
        d.set_filter_bool(filter, "hdr", true);
        d.commit_filter(filter);
        d.execute_filter(filter);
    }
    if (d.get_error(device, &message))
        IMP_TRY(imp__error(ctx, IMP_E_UNSUPPORTED, "Open Image Denoise: %s",
                           message ? message : "failed"));
out:
    if (filter) d.release_filter(filter);
    if (device) d.release_device(device);
    return st;
}
