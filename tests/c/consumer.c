/* A program in C, and in C++, that uses psidpd.h as a host would: periodic images as ghosts, slopes
 * forwarded to them, forces brought home. It checks what it can by itself and prints the rest. */

#include "psidpd.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define OWNED 12
#define MOST (27 * OWNED)

static const double box[3] = {2.3, 2.6, 2.1};

static const char *const model_text =
    "title = \"Warren 2003, set 6\"\n"
    "species = [\"F\"]\n"
    "[parameters]\n"
    "A = -40.0\n"
    "B = 25.0\n"
    "rd = 0.75\n"
    "[density.n]\n"
    "kernel = \"quadratic\"\n"
    "range = \"rd\"\n"
    "[excess_free_energy]\n"
    "F = \"pi/30 * rd^4 * B * n^2\"\n"
    "[[pair]]\n"
    "between = [\"F\", \"F\"]\n"
    "form = \"soft\"\n"
    "strength = \"A\"\n"
    "range = 1.0\n"
    "[[thermostat]]\n"
    "gamma = 4.5\n"
    "range = 1.0\n";

static void fail(int line, const char *what)
{
    fprintf(stderr, "line %d: %s; last error: %s\n", line, what, psidpd_last_error());
    exit(1);
}

#define CHECK(condition)                                                                           \
    do {                                                                                           \
        if (!(condition)) fail(__LINE__, #condition);                                              \
    } while (0)
#define OK(call) CHECK((call) == PSIDPD_STATUS_OK)
#define FAILS(call, status, text)                                                                  \
    do {                                                                                           \
        CHECK((call) == (status));                                                                 \
        CHECK(strstr(psidpd_last_error(), (text)) != NULL);                                        \
    } while (0)

/* Particles and their images. */
struct host {
    size_t all;
    size_t owner[MOST];
    double x[3 * MOST];
    double v[3 * MOST];
    int32_t tag[MOST];
    int32_t kind[MOST];
    double force[3 * MOST];
    psidpd_tally tally;
};

static double uniform(void)
{
    static uint32_t state = 2003;
    state = state * UINT32_C(1664525) + UINT32_C(1013904223);
    return state / 4294967296.0;
}

static void add_images(struct host *host, double cutoff)
{
    size_t i, all = OWNED;
    int a, b, c, k;
    /* Finite differences push particles out a little. */
    const double margin = cutoff + 0.01;
    for (i = 0; i < OWNED; i++) {
        for (a = -1; a <= 1; a++) {
            for (b = -1; b <= 1; b++) {
                for (c = -1; c <= 1; c++) {
                    const int shift[3] = {a, b, c};
                    int near = a != 0 || b != 0 || c != 0;
                    for (k = 0; k < 3; k++) {
                        const double y = host->x[3 * i + k] + shift[k] * box[k];
                        near = near && y > -margin && y < box[k] + margin;
                        host->x[3 * all + k] = y;
                        host->v[3 * all + k] = host->v[3 * i + k];
                    }
                    if (near) {
                        host->owner[all] = i;
                        host->tag[all] = host->tag[i];
                        host->kind[all] = host->kind[i];
                        all++;
                    }
                }
            }
        }
    }
    host->all = all;
}

/* A request for all results. */
static psidpd_request ask(const struct host *host, size_t owned, size_t all, const psidpd_step *step)
{
    psidpd_request request;
    request.particles.owned = owned;
    request.particles.all = all;
    request.particles.x = host->x;
    request.particles.tag = host->tag;
    request.particles.kind = host->kind;
    request.v = step != NULL ? host->v : NULL;
    request.step = step;
    request.want = PSIDPD_WANT_ENERGY | PSIDPD_WANT_VIRIAL | PSIDPD_WANT_PARTICLE_ENERGY |
                   PSIDPD_WANT_PARTICLE_VIRIAL | PSIDPD_WANT_DENSITIES;
    return request;
}

/* Energy, virial and forces on owned particles. */
static void evaluate(psidpd_engine *engine, struct host *host, int newton, const psidpd_step *step)
{
    psidpd_engine_facts facts;
    psidpd_request request;
    double *slopes;
    size_t length, g, k;
    OK(psidpd_engine_describe(engine, &facts));
    add_images(host, facts.cutoff);
    request = ask(host, OWNED, host->all, step);
    OK(psidpd_engine_first(engine, NULL, NULL, newton, &request));
    OK(psidpd_engine_slopes(engine, &slopes, &length));
    CHECK(length == host->all * facts.slope_width);
    for (g = OWNED; g < host->all; g++) {
        for (k = 0; k < facts.slope_width; k++) {
            slopes[g * facts.slope_width + k] = slopes[host->owner[g] * facts.slope_width + k];
        }
    }
    memset(host->force, 0, sizeof host->force);
    OK(psidpd_engine_second(engine, &request, host->force, &host->tally));
    for (g = OWNED; g < host->all; g++) {
        for (k = 0; k < 3; k++) {
            host->force[3 * host->owner[g] + k] += host->force[3 * g + k];
            CHECK(newton || host->force[3 * g + k] == 0.0);
        }
    }
}

static void print_outcome(const char *name, const struct host *host)
{
    size_t i;
    int k;
    printf("%s.energy %.17g\n", name, host->tally.excess + host->tally.pair);
    printf("%s.virial", name);
    for (k = 0; k < 6; k++) printf(" %.17g", host->tally.virial[k]);
    printf("\n%s.thermostat_virial", name);
    for (k = 0; k < 6; k++) printf(" %.17g", host->tally.thermostat_virial[k]);
    printf("\n%s.drag_virial", name);
    for (k = 0; k < 6; k++) printf(" %.17g", host->tally.drag_virial[k]);
    printf("\n%s.force", name);
    for (i = 0; i < 3 * OWNED; i++) printf(" %.17g", host->force[i]);
    printf("\n");
}

static void check_particle_sums(const psidpd_engine *engine, const struct host *host)
{
    psidpd_results results;
    double sum = 0.0, trace = 0.0;
    const double u = host->tally.excess + host->tally.pair;
    size_t i;
    OK(psidpd_engine_results(engine, &results));
    CHECK(results.energies == host->all && results.virials == 6 * host->all);
    for (i = 0; i < host->all; i++) {
        sum += results.energy[i];
        trace += results.virial[6 * i] + results.virial[6 * i + 1] + results.virial[6 * i + 2];
    }
    CHECK(fabs(sum - u) < 1e-10 * (1.0 + fabs(u)));
    sum = host->tally.virial[0] + host->tally.virial[1] + host->tally.virial[2];
    CHECK(fabs(trace - sum) < 1e-10 * (1.0 + fabs(sum)));
    CHECK(results.densities == OWNED);
    printf("density");
    for (i = 0; i < OWNED; i++) printf(" %.17g", results.density[i]);
    printf("\n");
}

/* Force = -dU/dx. */
static void check_gradient(psidpd_engine *engine, const struct host *start)
{
    static struct host here, moved;
    const double h = 1e-5;
    double worst = 0.0, largest = 0.0;
    size_t i;
    here = *start;
    evaluate(engine, &here, 1, NULL);
    for (i = 0; i < 3 * OWNED; i++) {
        double u[2], difference;
        int side;
        for (side = 0; side < 2; side++) {
            moved = *start;
            moved.x[i] += side == 0 ? -h : h;
            evaluate(engine, &moved, 1, NULL);
            u[side] = moved.tally.excess + moved.tally.pair;
        }
        difference = fabs(here.force[i] + (u[1] - u[0]) / (2.0 * h));
        if (difference > worst) worst = difference;
        if (fabs(here.force[i]) > largest) largest = fabs(here.force[i]);
    }
    printf("gradient %.3g %.3g\n", worst, largest);
    CHECK(largest > 1.0);
    CHECK(worst < 1e-7 * largest);
}

/* The same particles in a box of their own, and with ghosts told beforehand what is wanted: every precision, any
 * number of threads, and every path. The wide box is one that a sweep goes round. */
static void check_paths(const psidpd_model *model)
{
    enum { MANY = 200 };
    static double x[3 * MANY], v[3 * MANY], f[4][3 * MANY], mixed[3 * MANY], energy[4];
    static int32_t tag[MANY], kind[MANY], i[MANY * MANY / 2], j[MANY * MANY / 2];
    static double factor[MANY * MANY / 2];
    const psidpd_box domain = {{-1.0, 0.5, 2.0}, {3.1, 0, 0, 0.3, 3.4, 0, 0, 0, 3.2}, {1, 1, 1}};
    psidpd_settings settings = {PSIDPD_PRECISION_DOUBLE, PSIDPD_INSTRUCTIONS_BEST, 2};
    psidpd_engine_facts facts;
    const psidpd_step step = {9, 4, 0.01};
    psidpd_request request;
    psidpd_pairs pairs;
    psidpd_engine *engine, *plain;
    psidpd_tally tally;
    psidpd_path path;
    const char *text;
    psidpd_results results;
    double *slopes, range;
    size_t k, m, length;
    for (k = 0; k < 3 * MANY; k++) {
        x[k] = 3.0 * uniform();
        v[k] = uniform() - 0.5;
    }
    for (k = 0; k < MANY; k++) {
        tag[k] = (int32_t)k + 1;
        kind[k] = 0;
    }
    memset(&request, 0, sizeof request);
    request.particles.owned = MANY;
    request.particles.all = MANY;
    request.particles.x = x;
    request.particles.tag = tag;
    request.particles.kind = kind;
    request.v = v;
    request.step = &step;
    request.want = PSIDPD_WANT_ENERGY | PSIDPD_WANT_VIRIAL;

    settings.threads = 0;
    FAILS(psidpd_engine_new(model, 1.0, &settings, &engine), PSIDPD_STATUS_INVALID_ARGUMENT, "threads");
    settings.threads = 2;
    settings.precision = 7;
    FAILS(psidpd_engine_new(model, 1.0, &settings, &engine), PSIDPD_STATUS_INVALID_ARGUMENT, "precision");
    settings.precision = PSIDPD_PRECISION_DOUBLE;
    OK(psidpd_engine_new(model, 1.0, &settings, &engine));
    OK(psidpd_engine_describe(engine, &facts));
    CHECK(facts.settings.threads == 2 && facts.settings.precision == PSIDPD_PRECISION_DOUBLE);
    CHECK(facts.settings.instructions != PSIDPD_INSTRUCTIONS_BEST);
    FAILS(psidpd_engine_path(engine, &path, &text), PSIDPD_STATUS_CALL_ORDER, "nothing");
    FAILS(psidpd_engine_second(engine, &request, f[0], &tally), PSIDPD_STATUS_CALL_ORDER, "psidpd_engine_first");

    /* Two threads, then the portable kernels on one, then the reference, which knows of single particles. */
    OK(psidpd_engine_evaluate(engine, &domain, &request, f[0], &tally));
    energy[0] = tally.excess + tally.pair;
    OK(psidpd_engine_path(engine, &path, &text));
    CHECK(path == PSIDPD_PATH_SWEEP && strcmp(text, "cell sweep") == 0);
    FAILS(psidpd_engine_slopes(engine, &slopes, &length), PSIDPD_STATUS_CALL_ORDER, "psidpd_engine_first");
    OK(psidpd_engine_results(engine, &results));
    CHECK(results.energies == 0);
    settings.threads = 1;
    settings.instructions = PSIDPD_INSTRUCTIONS_PORTABLE;
    OK(psidpd_engine_new(model, 1.0, &settings, &plain));
    OK(psidpd_engine_evaluate(plain, &domain, &request, f[1], &tally));
    energy[1] = tally.excess + tally.pair;
    psidpd_engine_free(plain);
    request.want |= PSIDPD_WANT_PARTICLE_ENERGY | PSIDPD_WANT_DENSITIES;
    OK(psidpd_engine_evaluate(engine, &domain, &request, f[2], &tally));
    energy[2] = tally.excess + tally.pair;
    OK(psidpd_engine_path(engine, &path, &text));
    CHECK(path == PSIDPD_PATH_REFERENCE && strstr(text, "single particles") != NULL);
    OK(psidpd_engine_results(engine, &results));
    CHECK(results.energies == MANY);
    for (range = 0.0, k = 0; k < MANY; k++) range += results.energy[k];
    CHECK(fabs(range - energy[2]) < 1e-10 * (1.0 + fabs(energy[2])));
    CHECK(results.densities == MANY && results.density[0] > 0.0);

    /* Densities that forces need anyway change nothing. */
    request.want = PSIDPD_WANT_ENERGY | PSIDPD_WANT_DENSITIES;
    OK(psidpd_engine_evaluate(engine, &domain, &request, f[3], &tally));
    energy[3] = tally.excess + tally.pair;
    OK(psidpd_engine_path(engine, &path, &text));
    CHECK(path == PSIDPD_PATH_SWEEP);
    OK(psidpd_engine_results(engine, &results));
    CHECK(results.densities == MANY && results.density[0] > 0.0);
    for (m = 1; m < 4; m++) {
        CHECK(fabs(energy[m] - energy[0]) < 1e-9 * (1.0 + fabs(energy[0])));
        for (k = 0; k < 3 * MANY; k++) CHECK(fabs(f[m][k] - f[0][k]) < 1e-8 * (1.0 + fabs(f[0][k])));
    }
    memcpy(f[1], f[0], sizeof f[0]);

    /* In two halves: a box that is all there needs no ghosts. */
    memset(f[3], 0, sizeof f[3]);
    request.want = PSIDPD_WANT_ENERGY;
    OK(psidpd_engine_first(engine, &domain, NULL, 1, &request));
    OK(psidpd_engine_slopes(engine, &slopes, &length));
    CHECK(length == MANY * facts.slope_width);
    OK(psidpd_engine_second(engine, &request, f[3], NULL));
    FAILS(psidpd_engine_second(engine, &request, f[3], NULL), PSIDPD_STATUS_CALL_ORDER, "psidpd_engine_first");
    for (k = 0; k < 3 * MANY; k++) CHECK(fabs(f[3][k] - f[0][k]) < 1e-8 * (1.0 + fabs(f[0][k])));

    /* Mixed precision is mixed. */
    settings.precision = PSIDPD_PRECISION_MIXED;
    OK(psidpd_engine_new(model, 1.0, &settings, &plain));
    OK(psidpd_engine_evaluate(plain, &domain, &request, mixed, &tally));
    psidpd_engine_free(plain);
    for (range = 0.0, k = 0; k < 3 * MANY; k++) range = fmax(range, fabs(mixed[k] - f[0][k]) / (1.0 + fabs(f[0][k])));
    CHECK(range > 1e-12 && range < 1e-3);

    /* Pairs that the host lists, without a box: all of them are the search, and none are none. */
    pairs.count = 0;
    for (k = 0; k < MANY; k++) {
        for (m = 0; m < k; m++) {
            i[pairs.count] = (int32_t)k;
            j[pairs.count] = (int32_t)m;
            factor[pairs.count++] = 1.0;
        }
    }
    pairs.i = i;
    pairs.j = j;
    pairs.factor = factor;
    memset(f[0], 0, sizeof f[0]);
    memset(f[1], 0, sizeof f[1]);
    OK(psidpd_engine_first_of_pairs(engine, &pairs, 1, &request));
    OK(psidpd_engine_second(engine, &request, f[0], NULL));
    OK(psidpd_engine_path(engine, &path, &text));
    CHECK(path == PSIDPD_PATH_REFERENCE && strstr(text, "lists the pairs") != NULL);
    OK(psidpd_engine_first(engine, NULL, NULL, 0, &request));
    OK(psidpd_engine_second(engine, &request, f[1], NULL));
    for (k = 0; k < 3 * MANY; k++) CHECK(fabs(f[1][k] - f[0][k]) < 1e-8 * (1.0 + fabs(f[0][k])));
    i[0] = MANY;
    FAILS(psidpd_engine_first_of_pairs(engine, &pairs, 1, &request), PSIDPD_STATUS_INVALID_ARGUMENT, "does not exist");

    /* What cannot be. */
    request.want = 1u << 9;
    FAILS(psidpd_engine_evaluate(engine, &domain, &request, f[0], NULL), PSIDPD_STATUS_INVALID_ARGUMENT, "0x200");
    request.want = 0;
    request.particles.owned = MANY - 1;
    FAILS(psidpd_engine_evaluate(engine, &domain, &request, f[0], NULL), PSIDPD_STATUS_INVALID_ARGUMENT, "ghosts");
    request.particles.owned = MANY;
    FAILS(psidpd_engine_evaluate(engine, &domain, &request, x, NULL), PSIDPD_STATUS_INVALID_ARGUMENT, "overlap");
    FAILS(psidpd_engine_evaluate(engine, NULL, &request, f[0], NULL), PSIDPD_STATUS_NULL_POINTER, "box is NULL");
    {
        psidpd_box flat = domain;
        flat.edges[8] = 0.0;
        FAILS(psidpd_engine_evaluate(engine, &flat, &request, f[0], NULL), PSIDPD_STATUS_INVALID_ARGUMENT, "volume");
        flat = domain;
        flat.periodic[1] = 2;
        FAILS(psidpd_engine_evaluate(engine, &flat, &request, f[0], NULL), PSIDPD_STATUS_INVALID_ARGUMENT, "periodic");
    }
    psidpd_engine_free(engine);
}

/* Particles in a narrow box, which the library makes images for, against those with the host's own images. */
static void check_narrow_box(psidpd_engine *engine, const struct host *start, const psidpd_step *step)
{
    static struct host host, own;
    const psidpd_box domain = {{0, 0, 0}, {box[0], 0, 0, 0, box[1], 0, 0, 0, box[2]}, {1, 1, 1}};
    psidpd_request request;
    size_t k;
    host = *start;
    evaluate(engine, &host, 1, step);
    own = *start;
    request = ask(&own, OWNED, OWNED, step);
    memset(own.force, 0, sizeof own.force);
    OK(psidpd_engine_evaluate(engine, &domain, &request, own.force, &own.tally));
    CHECK(fabs(own.tally.pair - host.tally.pair) < 1e-10 * (1.0 + fabs(host.tally.pair)));
    CHECK(fabs(own.tally.virial[3] - host.tally.virial[3]) < 1e-9 * (1.0 + fabs(host.tally.virial[0])));
    for (k = 0; k < 3 * OWNED; k++) CHECK(fabs(own.force[k] - host.force[k]) < 1e-9 * (1.0 + fabs(host.force[k])));
}

static void check_model_errors(const psidpd_model *model, const char *missing_path)
{
    psidpd_model *none = NULL;
    psidpd_engine *engine = NULL;
    const char *text = NULL;
    psidpd_model_facts facts;
    FAILS(psidpd_model_open(missing_path, &none), PSIDPD_STATUS_FILE, missing_path);
    FAILS(psidpd_model_open(NULL, &none), PSIDPD_STATUS_NULL_POINTER, "path is NULL");
    FAILS(psidpd_model_open(missing_path, NULL), PSIDPD_STATUS_NULL_POINTER, "model is NULL");
    FAILS(psidpd_model_parse("bad.toml", "title = \"t\"\nspecies = [\"A\"]\nspeceis = 3\n", &none),
          PSIDPD_STATUS_MODEL, "bad.toml:3: speceis: unknown key");
    FAILS(psidpd_model_parse("bad.toml", "\xff", &none), PSIDPD_STATUS_INVALID_ARGUMENT, "UTF-8");
    FAILS(psidpd_model_parse("bad.toml", NULL, &none), PSIDPD_STATUS_NULL_POINTER, "text is NULL");
    CHECK(none == NULL);
    FAILS(psidpd_model_species_name(model, 1, &text), PSIDPD_STATUS_INVALID_ARGUMENT, "species 1");
    facts.species = 77;
    FAILS(psidpd_model_describe(NULL, &facts), PSIDPD_STATUS_NULL_POINTER, "model is NULL");
    FAILS(psidpd_model_describe(model, NULL), PSIDPD_STATUS_NULL_POINTER, "facts is NULL");
    CHECK(text == NULL && facts.species == 77);
    FAILS(psidpd_engine_new(NULL, 1.0, NULL, &engine), PSIDPD_STATUS_NULL_POINTER, "model is NULL");
    FAILS(psidpd_engine_new(model, 1.0, NULL, NULL), PSIDPD_STATUS_NULL_POINTER, "engine is NULL");
    FAILS(psidpd_engine_new(model, -1.0, NULL, &engine), PSIDPD_STATUS_MODEL, "kT");
    CHECK(engine == NULL);
    psidpd_model_free(NULL);
    psidpd_engine_free(NULL);
}

static void check_engine_errors(const psidpd_model *model, const struct host *start)
{
    static struct host host;
    psidpd_engine *engine;
    psidpd_engine_facts facts;
    psidpd_results results;
    psidpd_request request;
    psidpd_step step = {1, 2, 0.01};
    const int32_t too_high[1] = {1}, only_second[2] = {-1, 0};
    double *slopes;
    size_t length;
    host = *start;
    request = ask(&host, 2, 2, NULL);
    request.want = 0;
    OK(psidpd_engine_new(model, 1.0, NULL, &engine));
#define FIRST(newton) psidpd_engine_first(engine, NULL, NULL, (newton), &request)
#define SECOND(force) psidpd_engine_second(engine, &request, (force), NULL)

    FAILS(psidpd_engine_describe(NULL, &facts), PSIDPD_STATUS_NULL_POINTER, "engine is NULL");
    FAILS(psidpd_engine_describe(engine, NULL), PSIDPD_STATUS_NULL_POINTER, "facts is NULL");
    FAILS(psidpd_engine_map_kinds(engine, too_high, 1), PSIDPD_STATUS_INVALID_ARGUMENT, "species");
    FAILS(psidpd_engine_map_kinds(engine, NULL, 1), PSIDPD_STATUS_NULL_POINTER, "species is NULL");

    /* Out of order. */
    FAILS(SECOND(host.force), PSIDPD_STATUS_CALL_ORDER, "psidpd_engine_first");
    FAILS(psidpd_engine_slopes(engine, &slopes, &length), PSIDPD_STATUS_CALL_ORDER, "psidpd_engine_first");
    FAILS(psidpd_engine_results(engine, &results), PSIDPD_STATUS_CALL_ORDER, "psidpd_engine_evaluate");

    FAILS(psidpd_engine_first(NULL, NULL, NULL, 1, &request), PSIDPD_STATUS_NULL_POINTER, "engine");
    FAILS(psidpd_engine_first(engine, NULL, NULL, 1, NULL), PSIDPD_STATUS_NULL_POINTER, "request is");
    FAILS(FIRST(7), PSIDPD_STATUS_INVALID_ARGUMENT, "newton");
    request.particles.x = NULL;
    FAILS(FIRST(1), PSIDPD_STATUS_NULL_POINTER, "particles.x is NULL");
    request.particles.x = host.x;
    request.particles.owned = 3;
    FAILS(FIRST(1), PSIDPD_STATUS_INVALID_ARGUMENT, "3 are owned");
    request.particles.owned = 2;
    host.kind[1] = 4;
    FAILS(FIRST(1), PSIDPD_STATUS_ENGINE, "type 4");
    host.kind[1] = 0;
    host.tag[0] = 0;
    FAILS(FIRST(1), PSIDPD_STATUS_ENGINE, "tags");
    host.tag[0] = 1;
    request.step = &step;
    FAILS(FIRST(1), PSIDPD_STATUS_NULL_POINTER, "v is NULL");
    step.dt = 0.0;
    request.v = host.v;
    FAILS(FIRST(1), PSIDPD_STATUS_INVALID_ARGUMENT, "step.dt");
    request.v = NULL;
    request.step = NULL;
    request.want = 1u << 9;
    FAILS(FIRST(1), PSIDPD_STATUS_INVALID_ARGUMENT, "0x200");
    request.want = 0;

    OK(FIRST(1));
    FAILS(SECOND(NULL), PSIDPD_STATUS_NULL_POINTER, "force is NULL");
    request.v = host.force;
    FAILS(SECOND(host.force), PSIDPD_STATUS_INVALID_ARGUMENT, "overlap");
    request.v = NULL;
    OK(SECOND(host.force));
    OK(psidpd_engine_results(engine, &results));
    CHECK(results.energies == 0);
    OK(FIRST(1));
    request.particles.all = 3;
    FAILS(SECOND(host.force), PSIDPD_STATUS_INVALID_ARGUMENT, "changed");
    request.particles.all = 2;

    /* A message outlives successes, and types that are not mapped take no part. */
    OK(psidpd_engine_map_kinds(engine, only_second, 2));
    CHECK(strstr(psidpd_last_error(), "changed") != NULL);
    memset(host.force, 0, sizeof host.force);
    OK(FIRST(1));
    OK(SECOND(host.force));
    CHECK(host.force[0] == 0.0);
#undef FIRST
#undef SECOND
    psidpd_engine_free(engine);
}

/* A special pair with the factor 0 has no force. */
static void check_special_pairs(psidpd_engine *engine, const struct host *start)
{
    static struct host special, plain;
    const psidpd_special_pair pairs[1] = {{0, 1, 0.0}};
    const psidpd_box around = {{0, 0, 0}, {20, 0, 0, 0, 20, 0, 0, 0, 20}, {0, 0, 0}};
    psidpd_request request;
    plain = special = *start;
    memset(plain.force, 0, sizeof plain.force);
    memset(special.force, 0, sizeof special.force);
    request = ask(&plain, 2, 2, NULL);
    request.want = 0;
    plain.x[3] = plain.x[0] + 0.3;
    plain.x[4] = plain.x[1];
    plain.x[5] = plain.x[2];
    OK(psidpd_engine_evaluate(engine, &around, &request, plain.force, NULL));
    CHECK(plain.force[0] != 0.0);
    OK(psidpd_engine_set_special_pairs(engine, pairs, 1));
    OK(psidpd_engine_evaluate(engine, &around, &request, special.force, NULL));
    CHECK(special.force[0] == 0.0 && special.force[3] == 0.0);
    OK(psidpd_engine_set_special_pairs(engine, NULL, 0));
}

/* Drag and noise apart from the forces keep the momentum. */
static void check_thermostat(const psidpd_engine *engine, const struct host *start)
{
    static struct host host;
    psidpd_thermostat *thermostat = NULL;
    const psidpd_box around = {{0, 0, 0}, {2.3, 0, 0, 0, 2.6, 0, 0, 0, 2.1}, {1, 1, 1}};
    const psidpd_step step = {1, 2, 0.01};
    const double mass[1] = {1.0};
    double before = 0.0, after = 0.0, virial[6];
    psidpd_bodies bodies;
    size_t i;
    host = *start;
    bodies.count = OWNED;
    bodies.x = host.x;
    bodies.tag = host.tag;
    bodies.species = host.kind;
    bodies.mass = mass;
    bodies.frozen = NULL;
    OK(psidpd_thermostat_new(engine, &thermostat));
    OK(psidpd_thermostat_act(thermostat, &around, &bodies, PSIDPD_RULE_MIDPOINT, &step, host.v, virial));
    for (i = 0; i < OWNED; i++) {
        before += start->v[3 * i];
        after += host.v[3 * i];
    }
    CHECK(fabs(before - after) < 1e-12 && memcmp(host.v, start->v, 3 * OWNED * sizeof(double)) != 0);
    psidpd_thermostat_free(thermostat);
}

int main(int count, char **arguments)
{
    static struct host start, host;
    psidpd_model *model = NULL, *opened = NULL;
    psidpd_engine *engine = NULL;
    psidpd_step step;
    psidpd_model_facts said;
    psidpd_engine_facts facts;
    const char *text = NULL;
    size_t i;

    CHECK(count == 3);
    CHECK(psidpd_abi_version() == PSIDPD_ABI_VERSION);
    CHECK(strlen(psidpd_last_error()) == 0);
    printf("version %s\n", psidpd_version());

    OK(psidpd_model_parse("set-6", model_text, &model));
    OK(psidpd_model_describe(model, &said));
    CHECK(strcmp(said.title, "Warren 2003, set 6") == 0 && said.dimensions == 3 && said.species == 1);
    OK(psidpd_model_species_name(model, 0, &text));
    CHECK(strcmp(text, "F") == 0);

    /* The same from a file. */
    {
        FILE *file = fopen(arguments[1], "wb");
        CHECK(file != NULL && fputs(model_text, file) >= 0 && fclose(file) == 0);
        OK(psidpd_model_open(arguments[1], &opened));
        psidpd_model_free(model);
        model = opened;
    }
    check_model_errors(model, arguments[2]);

    OK(psidpd_engine_new(model, 1.0, NULL, &engine));
    OK(psidpd_engine_describe(engine, &facts));
    CHECK(facts.noise_range == 1.0 && facts.needs_velocities == 1);
    CHECK(strstr(facts.plan, "density pass  n") != NULL);

    for (i = 0; i < OWNED; i++) {
        int k;
        for (k = 0; k < 3; k++) {
            start.x[3 * i + k] = box[k] * uniform();
            start.v[3 * i + k] = uniform() - 0.5;
        }
        start.tag[i] = (int32_t)i + 1;
        start.kind[i] = 0;
    }
    printf("box %.17g %.17g %.17g\nx", box[0], box[1], box[2]);
    for (i = 0; i < 3 * OWNED; i++) printf(" %.17g", start.x[i]);
    printf("\nv");
    for (i = 0; i < 3 * OWNED; i++) printf(" %.17g", start.v[i]);
    printf("\n");

    check_engine_errors(model, &start);
    check_paths(model);
    /* The engine needs the model no more. */
    psidpd_model_free(model);

    host = start;
    evaluate(engine, &host, 0, NULL);
    print_outcome("newton_off", &host);
    host = start;
    evaluate(engine, &host, 1, NULL);
    print_outcome("newton_on", &host);
    check_particle_sums(engine, &host);
    step.seed = UINT64_C(1) << 40;
    step.number = 77;
    step.dt = 0.01;
    host = start;
    evaluate(engine, &host, 1, &step);
    print_outcome("thermal", &host);
    check_gradient(engine, &start);
    check_narrow_box(engine, &start, &step);
    check_special_pairs(engine, &start);
    check_thermostat(engine, &start);
    psidpd_engine_free(engine);
    return 0;
}
