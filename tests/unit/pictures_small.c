/* SPDX-License-Identifier: Apache-2.0
 *
 * BMP, TGA and PPM in all variants that are read, made byte by byte: pixel (x, y) of W x H
 * has the colour (x, y, x ^ y). Files cut off anywhere are errors, those with a bit changed
 * errors or pictures. */
#include "format/image.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>

enum { W = 5, H = 4 };

static imp_context *ctx;

struct file {
    unsigned char data[4096];
    size_t n;
};
static void put(struct file *f, unsigned long x, int bytes)
{
    for (int i = 0; i < bytes; i++) f->data[f->n++] = (unsigned char)(x >> (8 * i));
}
static unsigned code(int x, int y, int c)
{
    return (unsigned)(c == 0 ? 40 * x : c == 1 ? 50 * y : (40 * x) ^ (50 * y));
}
/* Of palettes, and of grey: the number of a pixel. */
static unsigned number(int x, int y, unsigned most)
{
    return (unsigned)(x + 3 * y) % most;
}

static enum imp_status parse(const struct file *f, imp_film **out)
{
    /* A copy of its own size, so that sanitizers see reads behind it. */
    unsigned char *copy = malloc(f->n ? f->n : 1);
    memcpy(copy, f->data, f->n);
    bool srgb = false;
    *out = NULL;
    const enum imp_status st =
        imp__image_parse(ctx, "small", &(struct imp_bytes){copy, f->n, f->n}, out, &srgb);
    free(copy);
    return st == IMP_OK && !srgb ? IMP_E_ARG : st;
}

/* colours: of a palette, whose colour k is (k, 2 k, 3 k); 0: none; grey: of numbers. */
static void check(const struct file *f, const char *name, unsigned colours, double top,
                  bool grey)
{
    imp_film *film;
    double worst = 0;
    const enum imp_status st = parse(f, &film);
    const bool fits = st == IMP_OK && film->width == W && film->height == H &&
                      film->channels == (grey ? 1 : 3);
    for (int k = 0; fits && k < W * H * film->channels; k++) {
        const int c = k % film->channels, x = k / film->channels % W,
                  y = k / film->channels / W;
        const double v = grey      ? number(x, y, 200)
                         : colours ? (double)((unsigned)(c + 1) * number(x, y, colours))
                                   : (double)code(x, y, c);
        worst = fmax(worst, fabs((double)film->mean[k] - v / top));
    }
    tap_ok(fits && worst < 1e-7, "%s # %s, %.1e", name,
           st == IMP_OK ? "read" : imp_last_error(ctx), worst);
    imp_film_destroy(film);

    int errors = 0, pictures = 0;
    for (size_t n = 0; n < f->n; n++) {
        struct file cut = *f;
        cut.n = n;
        errors += parse(&cut, &film) != IMP_OK;
        imp_film_destroy(film);
    }
    tap_ok(errors == (int)f->n, "%s: cut off at any byte # %d of %zu", name, errors,
           f->n);
    errors = 0;
    for (size_t n = 0; n < f->n; n++)
        for (int bit = 0; bit < 8; bit++) {
            struct file g = *f;
            g.data[n] ^= (unsigned char)(1 << bit);
            const enum imp_status s = parse(&g, &film);
            errors += s != IMP_OK;
            pictures += s == IMP_OK;
            imp_film_destroy(film);
        }
    tap_ok(pictures > 0 && errors > 0, "%s: a bit changed # %d errors, %d pictures", name,
           errors, pictures);
}

static void bmp(int bits, bool core, bool down, bool fields)
{
    struct file f = {.n = 0};
    const unsigned colours = bits > 8 ? 0 : 1u << bits > 60 ? 60 : 1u << bits;
    const unsigned header = core ? 12 : 40, entry = core ? 3 : 4,
                   table = bits > 8 ? 0 : entry * (core ? 1u << bits : colours);
    const unsigned stride = (unsigned)(W * bits + 31) / 32 * 4;
    const unsigned offset = 14 + header + table + (fields ? 12 : 0);
    put(&f, 'B' | 'M' << 8, 2);
    put(&f, offset + stride * H, 4);
    put(&f, 0, 4);
    put(&f, offset, 4);
    put(&f, header, 4);
    put(&f, W, core ? 2 : 4);
    put(&f, (unsigned long)(down ? -H : H), core ? 2 : 4);
    put(&f, 1, 2);
    put(&f, (unsigned long)bits, 2);
    if (!core) {
        put(&f, fields ? 3 : 0, 4);
        for (int k = 0; k < 3; k++) put(&f, 0, 4);
        put(&f, colours, 4);
        put(&f, 0, 4);
    }
    if (fields) {
        put(&f, 0xff0000, 4);
        put(&f, 0xff00, 4);
        put(&f, 0xff, 4);
    }
    for (unsigned k = 0; k < table / entry; k++) {
        put(&f, 3 * k, 1);
        put(&f, 2 * k, 1);
        put(&f, k, entry == 3 ? 1 : 2);
    }
    for (int j = 0; j < H; j++) {
        const int y = down ? j : H - 1 - j;
        const size_t row = f.n;
        for (int x = 0; x < W; x++) {
            if (bits > 8) {
                for (int c = 2; c >= 0; c--) put(&f, code(x, y, c), 1);
                if (bits == 32) put(&f, 77, 1);
                continue;
            }
            const size_t at = row + (size_t)(x * bits / 8);
            while (f.n <= at) put(&f, 0, 1);
            f.data[at] |=
                (unsigned char)(number(x, y, colours) << (8 - bits - x * bits % 8));
        }
        while ((f.n - row) % 4) put(&f, 0, 1);
    }
    char name[64];
    snprintf(name, sizeof name, "BMP, %d bits%s%s%s", bits, core ? ", OS/2" : "",
             down ? ", from the top" : "", fields ? ", fields" : "");
    check(&f, name, colours, 255, false);
}

static void tga(int type, int bits, bool packed, int corner)
{
    struct file f = {.n = 0};
    const unsigned colours = type == 1 ? 9 : 0;
    put(&f, 3, 1); /* bytes of a name */
    put(&f, type == 1, 1);
    put(&f, (unsigned long)(type | (packed ? 8 : 0)), 1);
    put(&f, type == 1 ? 2 : 0, 2); /* the palette's first index */
    put(&f, colours, 2);
    put(&f, type == 1 ? 24 : 0, 1);
    put(&f, 0, 4);
    put(&f, W, 2);
    put(&f, H, 2);
    put(&f, (unsigned long)bits, 1);
    put(&f, (unsigned long)corner << 4, 1);
    put(&f, 0x434241, 3);
    for (unsigned k = 0; k < colours; k++) put(&f, 3 * k | 2 * k << 8 | k << 16, 3);
    for (int k = 0; k < W * H; k++) {
        const int i = k % W, j = k / W, x = corner & 1 ? W - 1 - i : i,
                  y = corner & 2 ? j : H - 1 - j;
        /* Packets of one pixel each way, in turn: repeated once, and as it is. */
        if (packed) put(&f, k % 2 ? 128 : 0, 1);
        if (type == 1) put(&f, 2 + number(x, y, colours), 1);
        else if (type == 3) put(&f, number(x, y, 200), 1);
        else
            for (int c = 2; c >= 0; c--) put(&f, code(x, y, c), 1);
        if (bits == 32) put(&f, 77, 1);
    }
    char name[64];
    snprintf(name, sizeof name, "TGA, type %d, %d bits%s, corner %d", type, bits,
             packed ? ", packed" : "", corner);
    check(&f, name, colours, 255, type == 3);
}

/* Runs over the ends of rows. */
static void tga_runs(void)
{
    struct file f = {.n = 0};
    static const unsigned char head[18] = {0, 0, 11, 0, 0, 0, 0, 0, 0,
                                           0, 0, 0,  W, 0, H, 0, 8, 32};
    for (int k = 0; k < 18; k++) put(&f, head[k], 1);
    put(&f, 128 + 6, 1); /* seven of 10 */
    put(&f, 10, 1);
    put(&f, 2, 1); /* 20, 30, 40 */
    put(&f, 20 | 30 << 8 | 40 << 16, 3);
    put(&f, 128 + 9, 1); /* ten of 50 */
    put(&f, 50, 1);
    imp_film *film;
    bool right = parse(&f, &film) == IMP_OK;
    for (int k = 0; right && k < W * H; k++) {
        const int v = k < 7 ? 10 : k < 10 ? 20 + 10 * (k - 7) : 50;
        right = fabs((double)film->mean[k] - v / 255.0) < 1e-7;
    }
    tap_ok(right, "TGA: runs over the ends of rows");
    imp_film_destroy(film);
}

static void ppm(bool grey, int top)
{
    struct file f = {.n = 0};
    f.n = (size_t)sprintf((char *)f.data, "P%c\n# a comment\n%d %d\n%d\n",
                          grey ? '5' : '6', W, H, top);
    for (int k = 0; k < W * H * (grey ? 1 : 3); k++) {
        const int p = grey ? k : k / 3, x = p % W, y = p / W;
        const unsigned v = grey ? number(x, y, 200) : code(x, y, k % 3);
        if (top > 255) put(&f, v >> 8, 1);
        put(&f, v, 1);
    }
    char name[64];
    snprintf(name, sizeof name, "P%c, largest number %d", grey ? '5' : '6', top);
    check(&f, name, 0, top, grey);
}

int main(void)
{
    ctx = test_context(1);
    for (int core = 0; core < 2; core++) {
        bmp(1, core, false, false);
        bmp(4, core, false, false);
        bmp(8, core, false, false);
        bmp(24, core, false, false);
    }
    bmp(24, false, true, false);
    bmp(32, false, false, false);
    bmp(32, false, true, true);
    for (int packed = 0; packed < 2; packed++)
        for (int corner = 0; corner < 4; corner++) {
            tga(1, 8, packed, corner);
            tga(2, 24, packed, corner);
            tga(2, 32, packed, corner);
            tga(3, 8, packed, corner);
        }
    tga_runs();
    ppm(true, 255);
    ppm(false, 255);
    ppm(true, 300);
    ppm(false, 1000);
    imp_context_destroy(ctx);
    return tap_done();
}
