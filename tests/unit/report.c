/* SPDX-License-Identifier: Apache-2.0
 *
 * Reports: which texts are JSON, what a page holds of pictures and of hostile names, and
 * what is refused. */
#include "base/context.h"
#include "base/film.h"
#include "imp_tap.h"
#include "report/json_text.h"
#include <importon/report.h>
#include <stdlib.h>
#include <unistd.h>
#include <zlib.h>

static imp_context *ctx;
static char path[] = "/tmp/importon-report-XXXXXX";

static void grammar(void)
{
    static const char *const good[] = {"0",
                                       "-1.5e+30",
                                       "\"\"",
                                       "\"\\u00e9\\n\\\"\"",
                                       "true",
                                       " [ ] ",
                                       "{}",
                                       "[1,[2],{}]",
                                       "{\"a\":[1]}",
                                       "null",
                                       "1E5",
                                       "[[[[]]]]",
                                       "\"\xc3\xa9\"",
                                       "{\"a\":{\"b\":[true,false,null]},\"c\":0}"};
    static const char *const bad[] = {
        "",     "01",      "+1",          ".5",     "1.",         "1e",  "nan",
        "[1,]", "[1 2]",   "{\"a\"}",     "{a:1}",  "{\"a\":1,}", "[",   "]",
        "\"",   "\"\\x\"", "\"\\u12g4\"", "\"\n\"", "[1}",        "1 2", "tru",
        "[,1]", "{,}",     "'a'",         "\"\\",   "{\"a\":}",   "-"};
    char deep[2][140];
    size_t at;
    int wrong = 0;
    for (size_t i = 0; i < sizeof good / sizeof *good; i++)
        if (!imp__json_valid(good[i], &at)) wrong++, printf("# refused: %s\n", good[i]);
    tap_ok(!wrong, "values that are JSON");
    wrong = 0;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const size_t n = strlen(bad[i]);
        if (imp__json_valid(bad[i], &at) || at > n)
            wrong++, printf("# taken: %s (at %zu)\n", bad[i], at);
    }
    tap_ok(!wrong, "texts that are not, and no look behind their end");
    for (int k = 0; k < 2; k++) {
        const size_t n = 64 + (size_t)k;
        memset(deep[k], '[', n);
        memset(deep[k] + n, ']', n);
        deep[k][2 * n] = 0;
    }
    tap_ok(imp__json_valid(deep[0], &at) && !imp__json_valid(deep[1], &at),
           "64 brackets deep, and no deeper");
    const bool taken = imp__json_valid("[1, 2, x]", &at);
    tap_ok(!taken && at == 7, "where it stops to be JSON # byte %zu", at);
}

/* ---- The page ------------------------------------------------------------------- */

static char *page_text(void)
{
    char *text = NULL;
    FILE *f = fopen(path, "rb");
    if (!f) return NULL;
    fseek(f, 0, SEEK_END);
    const long n = ftell(f);
    rewind(f);
    if (n > 0 && (text = malloc((size_t)n + 1))) text[fread(text, 1, (size_t)n, f)] = 0;
    fclose(f);
    return text;
}

/* The JSON of a page, to be freed with the page. NULL if it is not whole. */
static char *page_data(char *page)
{
    static const char open[] = "<script type=\"application/json\" id=\"data\">";
    char *data = page ? strstr(page, open) : NULL, *end;
    if (!data) return NULL;
    data += sizeof open - 1;
    end = strstr(data, "</script>");
    if (!end || strchr(data, '<') != end) return NULL; /* nothing else begins a tag */
    *end = 0;
    return data;
}

static int base64_value(char c)
{
    static const char digit[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char *at = c ? strchr(digit, c) : NULL;
    return at ? (int)(at - digit) : -1;
}

/* The bytes [2 n] of n halves that a base64 text packs: low ones, then high ones; false: it
 * does not. */
static bool unpack(const char *text, unsigned char *halves, size_t n)
{
    unsigned char packed[4096];
    size_t bits = 0;
    for (; base64_value(*text) >= 0 && bits / 8 < sizeof packed - 1; text++, bits += 6) {
        const unsigned v = (unsigned)base64_value(*text) << (10 - bits % 8);
        if (bits % 8 == 0) packed[bits / 8] = 0;
        packed[bits / 8] |= (unsigned char)(v >> 8);
        packed[bits / 8 + 1] = (unsigned char)v;
    }
    uLongf size = (uLongf)(2 * n);
    return uncompress(halves, &size, packed, (uLong)(bits / 8)) == Z_OK && size == 2 * n;
}

/* Half i of n, by the definition of binary16. */
static double half_at(const unsigned char *halves, size_t n, size_t i)
{
    const unsigned char byte[2] = {halves[i], halves[n + i]};
    const unsigned h = byte[0] | (unsigned)byte[1] << 8;
    const int exponent = (int)(h >> 10 & 31), fraction = (int)(h & 1023);
    const double size = exponent == 31 ? fraction ? NAN : INFINITY
                        : exponent     ? ldexp(1 + fraction / 1024.0, exponent - 15)
                                       : ldexp(fraction, -24);
    return h & 0x8000 ? -size : size;
}

static imp_film *film_of(int channels, double largest)
{
    imp_film *film = NULL;
    if (imp_film_create(ctx, 7, 5, channels == 3 ? "R,G,B" : "Y", &film) != IMP_OK)
        return NULL;
    for (int i = 0; i < 35 * channels; i++)
        imp_film_mean(film)[i] = (float)(largest * sin(1 + 0.7 * i) * pow(0.8, i % 30));
    return film;
}

static void numbers(double largest)
{
    enum { CHANNELS = 3 };
    imp_film *film = film_of(CHANNELS, largest);
    struct imp_report_item item = IMP_REPORT_ITEM_INIT;
    struct imp_report report = IMP_REPORT_INIT;
    item.kind = "picture";
    item.film = film;
    report.items = &item;
    report.n_items = 1;
    double worst = 0;
    const enum imp_status st = imp_report_write(ctx, &report, path);
    char *page = page_text(), *data = page_data(page);
    const char *pixels = data ? strstr(data, "\"pixels\":\"") : NULL;
    const char *scale = data ? strstr(data, "\"scale\":") : NULL;
    if (st == IMP_OK && pixels && scale) {
        const double by = atof(scale + strlen("\"scale\":"));
        unsigned char halves[2 * 35 * CHANNELS] = {0};
        if (!unpack(pixels + strlen("\"pixels\":\""), halves, 35 * CHANNELS))
            worst = INFINITY;
        for (size_t i = 0; i < 35; i++)
            for (size_t c = 0; c < CHANNELS; c++) {
                const double v = imp_film_mean(film)[i * CHANNELS + c];
                worst = fmax(worst,
                             fabs(by * half_at(halves, 35 * CHANNELS, c * 35 + i) - v) /
                                 fabs(v));
            }
    } else worst = INFINITY;
    /* Half a unit in the last of 11 bits. */
    tap_ok(worst <= ldexp(1, -11), "pixels up to %g # relative error %.2e", largest,
           worst);
    free(page);
    imp_film_destroy(film);
}

static void not_finite(void)
{
    imp_film *film = film_of(1, 1);
    struct imp_report_item item = IMP_REPORT_ITEM_INIT;
    struct imp_report report = IMP_REPORT_INIT;
    item.kind = "picture";
    item.film = film;
    report.items = &item;
    report.n_items = 1;
    imp_film_mean(film)[0] = NAN;
    imp_film_mean(film)[1] = INFINITY;
    const enum imp_status st = imp_report_write(ctx, &report, path);
    char *page = page_text(), *data = page_data(page);
    const char *pixels = data ? strstr(data, "\"pixels\":\"") : NULL;
    unsigned char halves[70];
    size_t at = 0;
    tap_ok(st == IMP_OK && pixels && imp__json_valid(data, &at) &&
               unpack(pixels + 10, halves, 35) && isnan(half_at(halves, 35, 0)) &&
               isinf(half_at(halves, 35, 1)) && isfinite(half_at(halves, 35, 2)),
           "pixels that are not finite stay so, in a page that parses");
    free(page);
    imp_film_destroy(film);
}

static void hostile(void)
{
    imp_film *film = NULL;
    struct imp_report_item item[2] = {IMP_REPORT_ITEM_INIT, IMP_REPORT_ITEM_INIT};
    struct imp_report report = IMP_REPORT_INIT;
    size_t at = 0;
    if (imp_film_create(ctx, 1, 1, "</script><b>\".R", &film) != IMP_OK) film = NULL;
    item[0].kind = "picture";
    item[0].name = "</script><script>alert(1)</script>";
    item[0].film = film;
    item[1].kind = "fit<!--";
    item[1].json = "{\"reason\":\"</script>\\u003c<!--<script>\",\"n\":[1,2]}";
    report.title = "a \"title\" \\ with <b>\n\t\x01 and \xff";
    report.command = "importon fit '</script>'";
    report.items = item;
    report.n_items = 2;
    const enum imp_status st = imp_report_write(ctx, &report, path);
    char *page = page_text(), *data = page_data(page);
    tap_ok(film && st == IMP_OK && data && imp__json_valid(data, &at),
           "names that look like markup stay inside the data # %s",
           st == IMP_OK ? "" : imp_last_error(ctx));
    tap_ok(data && strstr(data, "\\u003c/script>\\u003cscript>alert(1)"),
           "and are there, spelled out");
    free(page);
    imp_film_destroy(film);
}

/* ---- Is the picture explained? ------------------------------------------------------- */

static double gaussian(uint64_t *state)
{
    double u[2];
    for (int k = 0; k < 2; k++) {
        *state = *state * 6364136223846793005u + 1442695040888963407u;
        u[k] = ((double)(*state >> 11) + 0.5) / 9007199254740992.;
    }
    return sqrt(-2 * log(u[0])) * cos(6.283185307179586 * u[1]);
}

enum { SIDE = 64 };

/* target, and a picture of it with noise whose standard errors are known; `bump` is added
 * to 8 x 12 pixels from (40, 4). The answer; NULL: there is none. */
static char *explained(uint64_t seed, int with_se, double bump, double told)
{
    imp_film *film[2];
    struct imp_report_item item[2] = {IMP_REPORT_ITEM_INIT, IMP_REPORT_ITEM_INIT};
    struct imp_report report = IMP_REPORT_INIT;
    uint64_t state = seed;
    for (int k = 0; k < 2; k++) {
        film[k] = NULL;
        if (imp__film_create(ctx, SIDE, SIDE, "R,G,B", with_se, &film[k]) != IMP_OK)
            return NULL;
        item[k].kind = "picture";
        item[k].role = k ? "picture" : "target";
        item[k].film = film[k];
    }
    for (int i = 0; i < SIDE * SIDE * 3; i++) {
        const int x = i / 3 % SIDE, y = i / 3 / SIDE;
        const double truth = 1 + 0.5 * sin(x * 0.2) * cos(y * 0.1), s = 0.02 * truth;
        for (int k = 0; k < 2; k++) {
            film[k]->mean[i] = (float)(truth + s * gaussian(&state));
            if (with_se) film[k]->se[i] = (float)(told * s);
        }
        if (x >= 40 && x < 48 && y >= 4 && y < 16)
            film[1]->mean[i] += (float)(bump * truth);
    }
    report.items = item;
    report.n_items = 2;
    char *page = NULL, *found = NULL;
    if (imp_report_data(ctx, &report, &page, NULL) == IMP_OK) {
        char *at = strstr(page, "{\"kind\":\"explained\"");
        if (at) found = strdup(at);
    }
    imp_free(ctx, page);
    imp_film_destroy(film[0]);
    imp_film_destroy(film[1]);
    return found;
}

static double number_after(const char *text, const char *key)
{
    const char *at = text ? strstr(text, key) : NULL;
    return at ? strtod(at + strlen(key), NULL) : NAN;
}

static void agreement(void)
{
    int yes = 0, no = 0;
    double sum = 0;
    for (uint64_t seed = 1; seed <= 40; seed++) {
        char *t = explained(seed, 1, 0, 1);
        sum += number_after(t, "\"chi2\":");
        yes += t && strstr(t, "\"explained\":true");
        no += t && strstr(t, "\"explained\":false");
        free(t);
    }
    /* A block's ratio of sums of 48 squares: its mean is 1 where the errors are exact. */
    tap_near(sum / 40, 1, 5 * sqrt(2. / (3 * SIDE * SIDE) / 40), 0,
             "chi-square of noise is 1");
    tap_ok(yes == 40 && !no, "noise alone is explained # %d of 40", yes);
    char *t = explained(3, 1, 0.05, 1);
    const double x = number_after(t, "\"regions\":[{\"x\":"),
                 y = number_after(t, "\"y\":"), w = number_after(t, ",\"width\":"),
                 h = number_after(t, ",\"height\":");
    tap_ok(t && strstr(t, "\"explained\":false") && strstr(t, "\"n_regions\":1,"),
           "a region that differs by 5 %% is not");
    tap_ok(x == 40 && y == 4 && w == 8 && h == 12, "it lies where it is # %g %g, %g x %g",
           x, y, w, h);
    tap_near(number_after(t, "\"relative\":"), 0.05, 0.02, 0, "and is told");
    free(t);
    t = explained(4, 1, 0, 0.5);
    tap_ok(t && strstr(t, "\"explained\":false") &&
               fabs(number_after(t, "\"chi2\":") - 4) < 0.3,
           "errors that are told too small # %g", number_after(t, "\"chi2\":"));
    free(t);
    t = explained(5, 0, 0.5, 1);
    tap_ok(t && strstr(t, "\"noise\":\"none\"") && strstr(t, "\"explained\":null") &&
               strstr(t, "\"chi2\":null") && number_after(t, "[{\"x\":") == 40,
           "without errors nothing is said but where the largest difference is");
    free(t);
}

static void refused(void)
{
    imp_film *film = film_of(1, 1);
    struct imp_report_item good = IMP_REPORT_ITEM_INIT;
    struct imp_report report = IMP_REPORT_INIT;
    good.kind = "picture";
    good.film = film;
    struct imp_report_item both = good, neither = good, nameless = good, text = good,
                           image = good;
    both.json = "1";
    neither.film = NULL;
    nameless.kind = "";
    text.film = NULL;
    text.json = "{\"a\": 1 2}";
    image.film = NULL;
    image.image = "GIF89a";
    image.image_size = 6;
    const struct imp_report_item bad[] = {both, neither, nameless, text, image};
    static const char *const says[] = {"needs one of", "needs one of", "no kind",
                                       "byte 8", "no PNG"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const struct imp_report_item pair[] = {good, bad[i]};
        report.items = pair;
        report.n_items = 2;
        const enum imp_status st = imp_report_write(ctx, &report, path);
        tap_ok(st == IMP_E_ARG && strstr(imp_last_error(ctx), "items[1]") &&
                   strstr(imp_last_error(ctx), says[i]),
               "%s # %s", says[i], imp_last_error(ctx));
    }
    report.items = &good;
    report.n_items = 1;
    tap_ok(imp_report_write(ctx, &report, "/nowhere/page.html") == IMP_E_IO,
           "a folder that is not there");
    report.n_items = 0;
    char *page = NULL;
    const enum imp_status st = imp_report_write(ctx, &report, path);
    tap_ok(st == IMP_OK && page_data(page = page_text()), "a report of nothing");
    free(page);
    imp_film_destroy(film);
}

int main(void)
{
    const int file = mkstemp(path);
    if (file < 0 || imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    close(file);
    grammar();
    numbers(1);
    numbers(3e30);
    numbers(2e-20);
    not_finite();
    hostile();
    refused();
    agreement();
    unlink(path);
    imp_context_destroy(ctx);
    return tap_done();
}
