/* SPDX-License-Identifier: Apache-2.0
 *
 * Fingerprints of scenes: one word changed in a scene changes the part that it belongs
 * to, and no other; values of parameters with a derivative change none. */
#include "scene/fingerprint.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/hash.h"
#include "scene/scene.h"
#include "walk/core/walk_integrator.h"
#include <stdlib.h>

static imp_context *ctx;

struct prints {
    uint64_t objects, sensor, integrator, rays;
};

static struct prints prints_of(const imp_scene *s)
{
    return (struct prints){
        imp__fingerprint_objects(s), imp__fingerprint_sensor(s->sensors[0]),
        imp__walk_integrator_hash(imp__walk_integrator(s)), imp__fingerprint_rays(s)};
}
/* "osir" with a '-' for what is the same. */
static const char *differ(struct prints a, struct prints b)
{
    static char text[5];
    text[0] = a.objects == b.objects ? '-' : 'o';
    text[1] = a.sensor == b.sensor ? '-' : 's';
    text[2] = a.integrator == b.integrator ? '-' : 'i';
    text[3] = a.rays == b.rays ? '-' : 'r';
    return text;
}

/* ---- A word of a file ------------------------------------------------------------ */

static const char text[] =
    "<scene version='3.0.0'>"
    "<integrator type='path'><integer name='max_depth' value='5'/></integrator>"
    "<sensor type='perspective'><float name='fov' value='40'/><sampler "
    "type='independent'><integer name='sample_count' value='16'/></sampler>"
    "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' "
    "value='8'/><rfilter type='gaussian'/></film></sensor>"
    "<bsdf type='roughconductor' id='metal'><float name='alpha' value='0.25'/><string "
    "name='distribution' value='ggx'/></bsdf>"
    "<shape type='sphere'><float name='radius' value='1.5'/><ref id='metal'/></shape>"
    "<shape type='cube'><bsdf type='dielectric'><float name='int_ior' value='1.55'/>"
    "</bsdf></shape>"
    "<shape type='rectangle'><bsdf type='diffuse'><texture type='checkerboard' "
    "name='reflectance'><rgb name='color0' value='.1,.2,.3'/></texture></bsdf></shape>"
    "<emitter type='point'><rgb name='intensity' value='7,8,9'/></emitter></scene>";

/* Of a batch each sensor counts, also one whose rays are not among those that are asked. */
static void batch(void)
{
    static const char form[] =
        "<scene version='3.0.0'><sensor type='batch'><film type='hdrfilm'><integer "
        "name='width' value='8'/><integer name='height' value='2'/></film>"
        "<sensor type='perspective'/><sensor type='perspective'><transform "
        "name='to_world'><translate x='%d'/></transform></sensor>"
        "<sensor type='perspective'/><sensor type='perspective'/></sensor></scene>";
    char a[1024], b[1024];
    snprintf(a, sizeof a, form, 0);
    snprintf(b, sizeof b, form, 3);
    imp_scene *here = test_scene_text(ctx, a, IMP_RGB),
              *there = test_scene_text(ctx, b, IMP_RGB);
    const char *is = differ(prints_of(here), prints_of(there));
    tap_ok(is[1] == 's', "the second of four sensors of a batch moves # %s", is);
    imp_scene_destroy(here);
    imp_scene_destroy(there);
}

static void word(const char *from, const char *to, const char *expected, const char *what)
{
    char other[sizeof text + 64];
    const char *at = strstr(text, from);
    snprintf(other, sizeof other, "%.*s%s%s", (int)(at - text), text, to,
             at + strlen(from));
    imp_scene *a = test_scene_text(ctx, text, IMP_RGB);
    imp_scene *b = test_scene_text(ctx, other, IMP_RGB);
    const char *is = differ(prints_of(a), prints_of(b));
    tap_ok(strcmp(is, expected) == 0, "%s # %s", what, is);
    imp_scene_destroy(a);
    imp_scene_destroy(b);
}

static void words(void)
{
    word("'5'", "'5'", "----", "the same text");
    word("7,8,9", "1,2,3", "----", "light of another power");
    word("'0.25'", "'0.5'", "----", "another roughness");
    word(".1,.2,.3", ".4,.5,.6", "----", "another colour in a texture");
    word("'16'", "'64'", "----", "samples");
    /* The index that becomes a parameter is made of two properties, which are none. */
    word("'1.55'", "'1.5'", "o--r", "another refractive index");
    word("'1.5'", "'1.6'", "o---", "a larger sphere");
    word("ggx", "beckmann", "o---", "another distribution of normals");
    word("id='metal'>", "id='metal'><boolean name='sample_visible' value='false'/>",
         "o---", "a property more");
    word("diffuse'>", "diffuse' id='floor'>", "o---", "another name");
    word("'40'", "'41'", "-s--", "another field of view");
    word("gaussian", "box", "-s--", "another filter");
    word("value='8'", "value='9'", "-s--", "another width");
    word("'5'", "'6'", "--i-", "another depth");
}

/* The light that a sky sends is in the print, in all modes: of two skies that differ in nothing
 * else, here that of one in the other's scene. */
static void skies(void)
{
    static const char sky[] =
        "<scene version='3.0.0'><emitter type='sunsky'><vector name='sun_direction' "
        "x='%g' y='0' z='1'/></emitter></scene>";
    for (int mode = IMP_RGB; mode <= IMP_SINGLE; mode++) {
        imp_scene *s[2];
        char other[sizeof sky + 32];
        for (int k = 0; k < 2; k++) {
            snprintf(other, sizeof other, sky, k ? .5 : .2);
            s[k] = test_scene_text(ctx, other, (enum imp_color_mode)mode);
        }
        const uint64_t before = imp__fingerprint_objects(s[0]);
        void *own = s[0]->emitters[0]->self;
        s[0]->emitters[0]->self = s[1]->emitters[0]->self;
        tap_ok(imp__fingerprint_objects(s[0]) != before, "another sun, mode %d", mode);
        s[0]->emitters[0]->self = own;
        tap_ok(imp__fingerprint_objects(s[0]) == before, "and the first again");
        for (int k = 0; k < 2; k++) imp_scene_destroy(s[k]);
    }
}

/* ---- Arrays of a mesh ------------------------------------------------------------ */

static struct prints mesh_prints(const float *positions, const float *normals,
                                 const float *uvs)
{
    static const uint32_t indices[] = {0, 1, 2};
    imp_scene *s;
    test_must(ctx, imp_scene_create(ctx, IMP_RGB, &s));
    test_camera(s, 5, 30, 8, 8);
    imp_scene_begin(s, "shape", "mesh", NULL, NULL);
    imp_scene_mesh(s, 3, 1, positions, normals, uvs, indices);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    const struct prints p = prints_of(s);
    imp_scene_destroy(s);
    return p;
}

static void meshes(void)
{
    float x[] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, n[] = {0, 0, 1, 0, 0, 1, 0, 0, 1};
    float uv[] = {0, 0, 1, 0, 0, 1};
    const struct prints first = mesh_prints(x, n, uv);
    tap_ok(strcmp(differ(first, mesh_prints(x, n, uv)), "----") == 0, "the same mesh");
    x[4] += 1e-6f;
    tap_ok(strcmp(differ(first, mesh_prints(x, n, uv)), "o---") == 0, "a vertex moved");
    x[4] = 0;
    n[4] = 0.1f;
    tap_ok(strcmp(differ(first, mesh_prints(x, n, uv)), "o---") == 0, "a normal turned");
    n[4] = 0;
    uv[2] = 0.9f;
    tap_ok(strcmp(differ(first, mesh_prints(x, n, uv)), "o---") == 0, "another uv");
    tap_ok(strcmp(differ(first, mesh_prints(x, n, NULL)), "o---") == 0, "no uv");
    uv[2] = 1;
    tap_ok(strcmp(differ(first, mesh_prints(x, n, uv)), "----") == 0, "all as at first");
}

/* ---- Arrays ------------------------------------------------------------------------ */

static int by_value(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Of arrays of 0 to 70 bytes, of zeros and others, and of the others with one bit changed or
 * two words exchanged, no two have one hash; wherever in memory they lie it is the same. */
static void arrays(void)
{
    enum { MOST = 70 };
    static uint64_t hash[MOST * (8 * MOST + 16) + 2 * (MOST + 1)];
    static const unsigned char zeros[MOST];
    size_t n_hashes = 0, n_equal = 0, moved = 0;
    for (size_t n = 0; n <= MOST; n++) {
        unsigned char bytes[MOST], elsewhere[MOST + 1];
        uint64_t word[2];
        for (size_t k = 0; k < MOST; k++) bytes[k] = (unsigned char)(37 * k + 11);
        hash[n_hashes++] = imp__hash_array(0, zeros, n);
        hash[n_hashes++] = imp__hash_array(5, bytes, n);
        memcpy(elsewhere + 1, bytes, n);
        moved += imp__hash_array(5, elsewhere + 1, n) != hash[n_hashes - 1];
        for (size_t bit = 0; bit < 8 * n; bit++) {
            bytes[bit / 8] ^= (unsigned char)(1 << bit % 8);
            hash[n_hashes++] = imp__hash_array(5, bytes, n);
            bytes[bit / 8] ^= (unsigned char)(1 << bit % 8);
        }
        for (size_t k = 8; k + 8 <= n; k += 8) {
            memcpy(&word[0], bytes, 8);
            memcpy(&word[1], bytes + k, 8);
            memcpy(bytes, &word[1], 8);
            memcpy(bytes + k, &word[0], 8);
            hash[n_hashes++] = imp__hash_array(5, bytes, n);
            memcpy(bytes, &word[0], 8);
            memcpy(bytes + k, &word[1], 8);
        }
    }
    qsort(hash, n_hashes, sizeof *hash, by_value);
    for (size_t k = 1; k < n_hashes; k++) n_equal += hash[k] == hash[k - 1];
    tap_ok(n_hashes > 19000 && n_equal == 0 && moved == 0,
           "hashes of arrays # %zu, %zu of them equal", n_hashes, n_equal);
}

int main(void)
{
    ctx = test_context(1);
    words();
    batch();
    skies();
    meshes();
    arrays();
    imp_context_destroy(ctx);
    return tap_done();
}
