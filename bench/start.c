/* SPDX-License-Identifier: Apache-2.0
 *
 * The start with two meshes of a million triangles, beside what no program could leave out: the
 * same files read and copied, and Embree's tree of them. The library also places the vertices,
 * makes their normals (the files have none), volumes and a scene, and takes one sample. Wall and
 * processor seconds, each measurement in a process of its own, in rounds in which both take
 * turns; files come from the page cache, memory is of pages that were in use just before.
 *
 *     start [--rounds N] [--rows N] [--threads N]
 *
 * Prints rows for docs/speed.md. --rows: of a mesh, 4 rows (rows - 1) triangles. */
#include <embree3/rtcore.h>
#include <importon/importon.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { ROUNDS_MAX = 99, MESHES = 2, FACE_BYTES = 13 };

static const char *const file_of[MESHES] = {"left.ply", "right.ply"};
static const char scene_text[] =
    "<scene version='3.0.0'><integrator type='path'/><sensor type='perspective'>"
    "<float name='fov' value='40'/><transform name='to_world'><lookat origin='0,0,-9' "
    "target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' "
    "value='1'/><integer name='height' value='1'/><rfilter type='box'/></film></sensor>"
    "<emitter type='constant'/><shape type='ply'><string name='filename' "
    "value='left.ply'/></shape><shape type='ply'><string name='filename' "
    "value='right.ply'/></shape></scene>\n";

static void die(const char *what)
{
    fprintf(stderr, "start: %s\n", what);
    exit(3);
}

/* ---- The files --------------------------------------------------------------------- */

/* A bumpy ball about (x, 0, 0). */
static void mesh_write(const char *path, int rows, double x)
{
    const int columns = 2 * rows;
    FILE *f = fopen(path, "wb");
    if (!f) die("a mesh cannot be written");
    fprintf(f,
            "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\n"
            "property float y\nproperty float z\nelement face %d\n"
            "property list uchar int vertex_indices\nend_header\n",
            (rows + 1) * columns, 4 * rows * (rows - 1));
    for (int i = 0; i <= rows; i++)
        for (int j = 0; j < columns; j++) {
            const double theta = M_PI * i / rows, phi = 2 * M_PI * j / columns;
            const double r = 1 + .02 * sin(40 * theta) * cos(40 * phi) * sin(theta);
            const float p[3] = {(float)(x + r * sin(theta) * cos(phi)),
                                (float)(r * sin(theta) * sin(phi)),
                                (float)(r * cos(theta))};
            fwrite(p, sizeof *p, 3, f);
        }
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < columns; j++) {
            const int32_t a = i * columns + j, b = i * columns + (j + 1) % columns;
            const int32_t corner[2][3] = {{a, a + columns, b + columns},
                                          {a, b + columns, b}};
            for (int k = i == rows - 1; k < 2 - (i == 0); k++) {
                /* At the poles one of the two has no area. */
                fputc(3, f);
                fwrite(corner[k], sizeof **corner, 3, f);
            }
        }
    if (fclose(f) != 0) die("a mesh cannot be written");
}

/* ---- Embree alone ------------------------------------------------------------------- */

struct mesh {
    const char *path;
    float *positions;
    uint32_t *indices;
    size_t n_vertices, n_triangles;
};

static void *mesh_read(void *payload)
{
    struct mesh *m = payload;
    char line[256];
    FILE *f = fopen(m->path, "rb");
    if (!f) die("a mesh cannot be read");
    do {
        if (!fgets(line, sizeof line, f)) die("a mesh has no header");
        sscanf(line, "element vertex %zu", &m->n_vertices);
        sscanf(line, "element face %zu", &m->n_triangles);
    } while (strcmp(line, "end_header\n") != 0);
    const size_t bytes = m->n_triangles * FACE_BYTES;
    unsigned char *faces = malloc(bytes);
    m->positions = malloc((3 * m->n_vertices + 1) * sizeof *m->positions);
    m->indices = malloc(3 * m->n_triangles * sizeof *m->indices);
    if (!faces || !m->positions || !m->indices) die("out of memory");
    if (fread(m->positions, 12, m->n_vertices, f) != m->n_vertices ||
        fread(faces, 1, bytes, f) != bytes)
        die("a mesh is cut off");
    for (size_t k = 0; k < m->n_triangles; k++)
        memcpy(m->indices + 3 * k, faces + FACE_BYTES * k + 1, 12);
    free(faces);
    fclose(f);
    return NULL;
}

static void embree_start(int threads)
{
    struct mesh mesh[MESHES];
    pthread_t thread[MESHES];
    char config[64];
    for (int k = 0; k < MESHES; k++) mesh[k] = (struct mesh){.path = file_of[k]};
    if (threads > 1 && pthread_create(&thread[1], NULL, mesh_read, &mesh[1]) != 0)
        die("no thread");
    mesh_read(&mesh[0]);
    if (threads > 1) pthread_join(thread[1], NULL);
    else mesh_read(&mesh[1]);

    snprintf(config, sizeof config, "threads=%d,ignore_config_files=1", threads);
    RTCDevice device = rtcNewDevice(config);
    if (!device) die("Embree does not start");
    RTCScene scene = rtcNewScene(device);
    for (int k = 0; k < MESHES; k++) {
        const struct mesh *m = &mesh[k];
        RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                   m->positions, 0, 12, m->n_vertices);
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                   m->indices, 0, 12, m->n_triangles);
        rtcCommitGeometry(g);
        rtcAttachGeometry(scene, g);
        rtcReleaseGeometry(g);
    }
    rtcCommitScene(scene);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) die("Embree failed");
}

/* ---- The library --------------------------------------------------------------------- */

static void must(imp_context *ctx, enum imp_status st)
{
    if (st != IMP_OK) die(imp_last_error(ctx));
}

static void library_start(int threads)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    imp_context *ctx;
    imp_scene *scene;
    imp_film *film;
    o.threads = threads;
    must(NULL, imp_context_create(&o, &ctx));
    must(ctx, imp_scene_load(ctx, "scene.xml", NULL, &scene));
    run.spp = 1;
    must(ctx, imp_render(scene, &run, &film));
}

/* ---- Time ----------------------------------------------------------------------------- */

struct times {
    double wall, processor;
};

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Pages that the processes will get: used before, and free. On a virtual machine the first use
 * of a page that the host has taken back costs many times what clearing it does, and the process
 * with more memory would pay for that alone. */
static void pages_use(void)
{
    const size_t bytes = (size_t)1 << 30;
    void *p =
        mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (p == MAP_FAILED) return;
    (void)madvise(p, bytes, MADV_HUGEPAGE);
    memset(p, 1, bytes);
    munmap(p, bytes);
}

static struct times measure(void (*start)(int threads), int threads)
{
    struct times t;
    int pipes[2], status;
    pages_use();
    if (pipe(pipes) != 0) die("no pipe");
    const pid_t pid = fork();
    if (pid < 0) die("no process");
    if (pid == 0) {
        struct rusage u;
        const double begun = now();
        start(threads);
        t.wall = now() - begun;
        getrusage(RUSAGE_SELF, &u);
        t.processor = (double)(u.ru_utime.tv_sec + u.ru_stime.tv_sec) +
                      1e-6 * (double)(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
        _exit(write(pipes[1], &t, sizeof t) != sizeof t);
    }
    close(pipes[1]);
    if (read(pipes[0], &t, sizeof t) != sizeof t) die("a process failed");
    close(pipes[0]);
    waitpid(pid, &status, 0);
    return t;
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}
static double median(double *x, int n)
{
    qsort(x, (size_t)n, sizeof *x, by_value);
    return n % 2 ? x[n / 2] : (x[n / 2 - 1] + x[n / 2]) / 2;
}

/* x[0]: the library's, x[1]: Embree's. */
static void row(int threads, const char *what, double x[2][ROUNDS_MAX], int rounds)
{
    double ratio[ROUNDS_MAX];
    for (int r = 0; r < rounds; r++) ratio[r] = x[0][r] / x[1][r];
    const double library = median(x[0], rounds), embree = median(x[1], rounds);
    median(ratio, rounds);
    printf("| %d | %s | %.3f | %.3f | %.2f | %.2f to %.2f | %.2f |\n", threads, what,
           library, embree, library / embree, ratio[0], ratio[rounds - 1],
           x[0][0] / x[1][0]);
}

int main(int argc, char **argv)
{
    char folder[] = "/tmp/start-XXXXXX";
    int rounds = 9, rows = 501, most = 2;
    for (int k = 1; k < argc; k++) {
        int *to = !strcmp(argv[k], "--rounds")    ? &rounds
                  : !strcmp(argv[k], "--rows")    ? &rows
                  : !strcmp(argv[k], "--threads") ? &most
                                                  : NULL;
        if (!to || ++k == argc || (*to = atoi(argv[k])) < 1 || rounds > ROUNDS_MAX ||
            rows < 3 || rows > 10000) {
            fprintf(stderr, "usage: start [--rounds N] [--rows N] [--threads N]\n");
            return 2;
        }
    }
    if (!mkdtemp(folder) || chdir(folder) != 0) die("no folder to work in");
    for (int k = 0; k < MESHES; k++) mesh_write(file_of[k], rows, k ? 1.5 : -1.5);
    FILE *f = fopen("scene.xml", "w");
    if (!f || fputs(scene_text, f) < 0 || fclose(f) != 0)
        die("the scene cannot be written");

    printf(
        "| threads | seconds | library | Embree alone | ratio of medians | of %d rounds "
        "| of minima |\n|---|---|---|---|---|---|---|\n",
        rounds);
    for (int threads = 1; threads <= most; threads++) {
        double wall[2][ROUNDS_MAX], processor[2][ROUNDS_MAX];
        for (int r = -1; r < rounds; r++) /* the first does not count */
            for (int p = 0; p < 2; p++) {
                const struct times t = measure(p ? embree_start : library_start, threads);
                if (r >= 0) wall[p][r] = t.wall, processor[p][r] = t.processor;
            }
        row(threads, "wall", wall, rounds);
        row(threads, "processor", processor, rounds);
    }
    for (int k = 0; k < MESHES; k++) unlink(file_of[k]);
    unlink("scene.xml");
    if (chdir("/") == 0) rmdir(folder);
    return 0;
}
