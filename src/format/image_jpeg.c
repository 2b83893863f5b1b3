/* SPDX-License-Identifier: Apache-2.0
 *
 * JPEG, reading only. libjpeg ends the process on errors by default: here
 * errors jump back, and a file that ends early is an error, not a grey rest. Its memory
 * manager takes no hooks. */
#include "image.h"
#include <setjmp.h>
#include <stdio.h>
#include <string.h>

#include <jpeglib.h> /* needs stdio.h */

#include <jerror.h> /* needs jpeglib.h */

struct jpeg_job {
    struct jpeg_decompress_struct jpeg;
    struct jpeg_error_mgr errors;
    jmp_buf jump;
    imp_context *ctx;
    const char *name;
    imp_film *film;
    unsigned char *row;
    enum imp_status st;
    char message[JMSG_LENGTH_MAX];
};

static void on_error(j_common_ptr jpeg)
{
    struct jpeg_job *j = jpeg->client_data;
    (*jpeg->err->format_message)(jpeg, j->message);
    longjmp(j->jump, 1);
}
static void on_message(j_common_ptr jpeg, int level)
{
    const int code = jpeg->err->msg_code;
    if (level < 0 && (code == JWRN_JPEG_EOF || code == JWRN_HIT_MARKER)) on_error(jpeg);
}
static void on_output(j_common_ptr jpeg) { (void)jpeg; }

static bool decode(struct jpeg_job *j, const struct imp_bytes *file)
{
    if (setjmp(j->jump)) return false;
    jpeg_create_decompress(&j->jpeg);
    jpeg_mem_src(&j->jpeg, file->data, file->size);
    jpeg_read_header(&j->jpeg, TRUE);
    if (j->jpeg.jpeg_color_space == JCS_CMYK || j->jpeg.jpeg_color_space == JCS_YCCK) {
        j->st = imp__error(j->ctx, IMP_E_UNSUPPORTED, "%s: CMYK pictures are not read",
                           j->name);
        return false;
    }
    const bool grey = j->jpeg.jpeg_color_space == JCS_GRAYSCALE;
    j->jpeg.out_color_space = grey ? JCS_GRAYSCALE : JCS_RGB;
    j->jpeg.dct_method = JDCT_ISLOW;
    /* A block of 8 x 8 takes a bit at least (its DC coefficient), and a block may cover
     * four where colours are subsampled. */
    j->st = imp__image_film(j->ctx, j->name, j->jpeg.image_width, j->jpeg.image_height,
                            grey ? "Y" : "R,G,B", file->size, 4 * 512.0, &j->film);
    if (j->st != IMP_OK) return false;
    jpeg_start_decompress(&j->jpeg);
    const size_t n = (size_t)j->jpeg.output_width * (size_t)j->jpeg.output_components;
    if (j->jpeg.output_components != j->film->channels) return false;
    j->row = imp__alloc(j->ctx, n, 1);
    if (!j->row) {
        j->st = imp__error(j->ctx, IMP_E_NOMEM, "%s: out of memory", j->name);
        return false;
    }
    while (j->jpeg.output_scanline < j->jpeg.output_height) {
        float *to = j->film->mean + (size_t)j->jpeg.output_scanline * n;
        JSAMPROW rows[1] = {j->row};
        jpeg_read_scanlines(&j->jpeg, rows, 1);
        for (size_t i = 0; i < n; i++) to[i] = (float)(j->row[i] / 255.0);
    }
    jpeg_finish_decompress(&j->jpeg);
    return true;
}

enum imp_status imp__jpeg_parse(imp_context *ctx, const char *name,
                                const struct imp_bytes *file, imp_film **out)
{
    enum imp_status st = IMP_OK;
    struct jpeg_job *j = imp__alloc(ctx, 1, sizeof *j);
    if (!j) return imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", name);
    j->ctx = ctx;
    j->name = name;
    j->jpeg.err = jpeg_std_error(&j->errors);
    j->jpeg.client_data = j;
    j->errors.error_exit = on_error;
    j->errors.emit_message = on_message;
    j->errors.output_message = on_output;
    if (decode(j, file)) {
        *out = j->film;
        j->film = NULL;
    } else
        st = j->st != IMP_OK
                 ? j->st
                 : imp__error(ctx, IMP_E_SCENE, "%s: %s", name,
                              *j->message ? j->message : "not a JPEG picture");
    jpeg_destroy_decompress(&j->jpeg);
    imp__release(ctx, j->row);
    imp_film_destroy(j->film);
    imp__release(ctx, j);
    return st;
}
