/* psidpd: forces of many-body dissipative particle dynamics from model files.
 *
 * SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Made from rust-core/c-api/src/ by cbindgen; change it there, then run
 *     PSIDPD_UPDATE_HEADER=1 cargo test -p psidpd-c-api header
 *
 * Reduced units: lengths in r_c, masses in m, energies in the unit of the model file. r_ij = r_i - r_j.
 *
 * Particles in a box of their own: psidpd_engine_evaluate. With ghosts: psidpd_engine_first; copy the
 * owners' numbers in psidpd_engine_slopes to their ghosts; psidpd_engine_second; add forces on ghosts
 * to their owners. psidpd_engine_path says whether the fast way was taken, and if not why. Drag and noise
 * act in the forces of a request with a step, or apart from the forces by psidpd_thermostat_act.
 *
 * If a function returns anything but PSIDPD_STATUS_OK, psidpd_last_error has the reason, and the places
 * for results are left alone. Under "Safety" is what no function can check.
 */

#ifndef PSIDPD_H
#define PSIDPD_H

#include <stddef.h>
#include <stdint.h>

/// The version of this interface. It goes up when a function or structure changes its meaning or
/// layout or goes away, not when one is added.
#define PSIDPD_ABI_VERSION 3

/// For psidpd_settings: pairs in double precision.
#define PSIDPD_PRECISION_DOUBLE 0

/// For psidpd_settings: pairs in single precision, with positions to 2^-32 of the box; sums, psi and totals in double.
#define PSIDPD_PRECISION_MIXED 1

/// For psidpd_settings: the best instruction set that the processor has.
#define PSIDPD_INSTRUCTIONS_BEST 0

/// For psidpd_settings: the instruction set that the library was compiled for.
#define PSIDPD_INSTRUCTIONS_PORTABLE 1

/// For psidpd_settings: AVX2 and FMA.
#define PSIDPD_INSTRUCTIONS_AVX2 2

/// For psidpd_settings: AVX-512 F, BW, DQ and VL.
#define PSIDPD_INSTRUCTIONS_AVX512 3

/// For psidpd_settings: AVX-512 with VBMI2.
#define PSIDPD_INSTRUCTIONS_AVX512_VBMI2 4

/// For `want`: compute the potential energy.
#define PSIDPD_WANT_ENERGY 1

/// For `want`: compute the virials.
#define PSIDPD_WANT_VIRIAL 2

/// For `want`: compute the energy of each particle.
#define PSIDPD_WANT_PARTICLE_ENERGY 4

/// For `want`: compute the virial of each particle.
#define PSIDPD_WANT_PARTICLE_VIRIAL 8

/// For `want`: sum every density of the model, also those that no force needs.
#define PSIDPD_WANT_DENSITIES 16

/// For psidpd_thermostat_act: the implicit midpoint rule over all pairs.
#define PSIDPD_RULE_MIDPOINT 0

/// For psidpd_thermostat_act: the exact Ornstein-Uhlenbeck process of each pair in turn.
#define PSIDPD_RULE_PAIRWISE 1

/// The outcome of a call. The values keep their meaning in every version; later versions may add some.
enum psidpd_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /// The call succeeded.
  PSIDPD_STATUS_OK = 0,
  /// An argument is out of its domain: a length, an index, a flag, a text that is not UTF-8.
  PSIDPD_STATUS_INVALID_ARGUMENT = 1,
  /// A pointer that must not be null is null.
  PSIDPD_STATUS_NULL_POINTER = 2,
  /// A file cannot be read.
  PSIDPD_STATUS_FILE = 3,
  /// A model file does not define a valid model, or not at this temperature.
  PSIDPD_STATUS_MODEL = 4,
  /// Forces cannot be computed for these particles: a position, tag, type, psi or force is invalid.
  /// The message names the particle.
  PSIDPD_STATUS_ENGINE = 5,
  /// A call that must precede this one has not been made, or has failed.
  PSIDPD_STATUS_CALL_ORDER = 6,
  /// An internal error of this library. The next evaluation makes the engine usable again.
  PSIDPD_STATUS_PANIC = 255,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum psidpd_status psidpd_status;
#else
typedef int32_t psidpd_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/// The path that an evaluation took.
enum psidpd_path
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /// The sweep over cells, with vector instructions and threads.
  PSIDPD_PATH_SWEEP = 0,
  /// The reference, over a list of pairs, in double precision and on one thread.
  PSIDPD_PATH_REFERENCE = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum psidpd_path psidpd_path;
#else
typedef int32_t psidpd_path;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/// The forces of one model at one temperature. One thread at a time may use an engine; different
/// threads may use different ones.
typedef struct psidpd_engine psidpd_engine;

/// A model file, read and checked. Threads may share one.
typedef struct psidpd_model psidpd_model;

/// The thermostat of an engine's model and temperature. One thread at a time may use it.
typedef struct psidpd_thermostat psidpd_thermostat;

/// The title of a model, and the number of its dimensions and species.
typedef struct psidpd_model_facts {
  /// The title; valid until the model is freed.
  const char *title;
  /// The number of dimensions of space, 2 or 3.
  size_t dimensions;
  /// The number of species; psidpd_model_species_name has their names.
  size_t species;
} psidpd_model_facts;

/// The settings of an engine. Results depend on the precision; instruction sets change them by rounding
/// errors only, and the number of threads does not change a bit. All bytes zero and one thread are the
/// settings that NULL stands for.
typedef struct psidpd_settings {
  /// PSIDPD_PRECISION_...
  int32_t precision;
  /// PSIDPD_INSTRUCTIONS_...; the best set of the processor replaces one that it lacks.
  int32_t instructions;
  /// Number of threads, from 1.
  size_t threads;
} psidpd_settings;

/// The facts of an engine that a host needs.
typedef struct psidpd_engine_facts {
  /// The longest range of any force: ghosts are needed this far from owned particles.
  double cutoff;
  /// The range of the random force, zero if there is none. Periodic boxes must be at least twice as long, or two images
  /// of a pair would share their noise.
  double noise_range;
  /// How many numbers per particle psidpd_engine_slopes has, to be forwarded to ghosts; zero if there are none.
  size_t slope_width;
  /// 1 if there is a thermostat, so that a request with a step needs velocities, of ghosts too; 0 if not.
  int32_t needs_velocities;
  /// How the engine computes, with the instruction set in use.
  struct psidpd_settings settings;
  /// A description of the computation, in lines; valid until the engine is freed.
  const char *plan;
} psidpd_engine_facts;

/// A pair with reduced strength, for instance two bonded particles.
///
/// `factor` scales the conservative interaction: the density and the pair energy have it. Drag and noise act at full
/// strength; only pairs with a factor of 0 do not interact at all.
typedef struct psidpd_special_pair {
  /// Array index, from 0, of the first particle, an owned one.
  uint32_t i;
  /// Array index of the second particle. If it is a ghost, the rank of its owner has the same pair too.
  uint32_t j;
  /// Factor of the conservative interaction.
  double factor;
} psidpd_special_pair;

/// Arrays of the last evaluation, of which an engine keeps those that were asked for; valid until the next evaluation
/// with the engine, and until it is freed.
typedef struct psidpd_results {
  /// Local densities of owned particles: of each particle those of the first density, one for each species, then those
  /// of the second ... Not corrected. None unless the evaluation was asked for PSIDPD_WANT_DENSITIES.
  const double *density;
  /// How many numbers `density` has.
  size_t densities;
  /// Energies of particles and ghosts: none unless the evaluation was asked for PSIDPD_WANT_PARTICLE_ENERGY. With
  /// `newton` 1 those of ghosts belong to their owners.
  const double *energy;
  /// How many numbers `energy` has.
  size_t energies;
  /// Virials of particles and ghosts, six numbers each: none unless the evaluation was asked for
  /// PSIDPD_WANT_PARTICLE_VIRIAL. With `newton` 1 those of ghosts belong to their owners.
  const double *virial;
  /// How many numbers `virial` has.
  size_t virials;
} psidpd_results;

/// A box: a corner, the three edges from there, and which of them are periods.
typedef struct psidpd_box {
  /// Position of the box's corner.
  double origin[3];
  /// The edges: x, y, z of the first, of the second, of the third. The first should be along x and the second in the
  /// plane of x and y; others are slower. In two dimensions the third is (0, 0, 1).
  double edges[9];
  /// For each edge 1 if the box is periodic along it, and 0 if it is open.
  int32_t periodic[3];
} psidpd_box;

/// Particles of one host or rank: owned particles first, then ghosts.
typedef struct psidpd_particles {
  /// Number of owned particles.
  size_t owned;
  /// Number of all particles, ghosts included.
  size_t all;
  /// Positions, `3 * all` numbers: x, y, z of the first, of the second, ... Ghosts are at the position of their image.
  const double *x;
  /// Particle numbers from 1 that never change, `all` of them; an image has its owner's.
  const int32_t *tag;
  /// Types, `all` of them: species indices from 0, unless psidpd_engine_map_kinds says otherwise.
  const int32_t *kind;
} psidpd_particles;

/// Seed, number and length of the time step, on which the thermostat depends.
typedef struct psidpd_step {
  /// Seed of the pair noise.
  uint64_t seed;
  /// Number of the step.
  uint64_t number;
  /// Time step, positive.
  double dt;
} psidpd_step;

/// The input of an evaluation, and the results that it should compute.
typedef struct psidpd_request {
  /// Owned particles and ghosts.
  struct psidpd_particles particles;
  /// Velocities, `3 * particles.all`; may be NULL without a step, or if there is no thermostat (see
  /// psidpd_engine_facts).
  const double *v;
  /// Seed, number and length of the time step, for the thermostat; NULL for conservative forces only.
  const struct psidpd_step *step;
  /// 0, or PSIDPD_WANT_... joined by `|`.
  uint32_t want;
} psidpd_request;

/// Sums over the particles and pairs of one host or rank; the sums of all ranks add up.
///
/// Virials are sums of r_ij (x) F_ij: xx, yy, zz, xy, xz, yz, so that `p = rho kT + tr W/(dV)`. Entries that were not asked
/// for are unspecified.
typedef struct psidpd_tally {
  /// Sum of psi over particles. The potential energy is `excess + pair`.
  double excess;
  /// Sum of phi over pairs.
  double pair;
  /// Virial of the conservative forces.
  double virial[6];
  /// Virial of the dissipative and random forces.
  double thermostat_virial[6];
  /// Virial of the dissipative forces alone.
  double drag_virial[6];
} psidpd_tally;

/// Pairs that the host lists: at least all within the cut-off, those of two owned particles once, those of an owned
/// particle and a ghost on either side. Pairs that are not listed do not interact.
typedef struct psidpd_pairs {
  /// Number of pairs.
  size_t count;
  /// Array index, from 0, of the first particle of each pair, which is owned.
  const int32_t *i;
  /// Array index of the second particle of each pair.
  const int32_t *j;
  /// Factor of each pair's conservative interaction; NULL if all factors are 1.
  const double *factor;
} psidpd_pairs;

/// The particles that a thermostat acts on.
typedef struct psidpd_bodies {
  /// Number of particles.
  size_t count;
  /// Positions, `3 * count` numbers. Positions outside the box along periodic edges stand for an image.
  const double *x;
  /// Particle numbers from 1, each different, `count` of them.
  const int32_t *tag;
  /// Species indices from 0, `count` of them.
  const int32_t *species;
  /// Mass of each species of the model, positive.
  const double *mass;
  /// For each particle 1 if its velocity is fixed, and 0 if not; NULL if none is fixed.
  const int32_t *frozen;
} psidpd_bodies;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/// The PSIDPD_ABI_VERSION that the library was built with. A program must stop if it
/// differs from the one in its header.
uint32_t psidpd_abi_version(void);

/// The version of the library, such as "1.2.3"; always valid.
const char *psidpd_version(void);

/// The message of the last call on this thread that failed, empty if none has. UTF-8.
///
/// Valid until the next call on this thread that fails, and until the thread ends. Calls that succeed
/// leave it alone, so look at the status first.
const char *psidpd_last_error(void);

/// Reads the model file at `path` and puts a new model in `*model`, to be freed with
/// psidpd_model_free. If it fails, `*model` is left alone.
///
/// # Errors
/// PSIDPD_STATUS_FILE if the file cannot be read, PSIDPD_STATUS_MODEL if something in it is
/// wrong; the message has line and key. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `path` ends with a zero byte; `model` can be written to.
psidpd_status psidpd_model_open(const char *path, struct psidpd_model **model);

/// Reads a model from `text`, UTF-8; `name` stands for the file in messages. Puts a new model in
/// `*model`, to be freed with psidpd_model_free. If it fails, `*model` is left alone.
///
/// # Errors
/// PSIDPD_STATUS_MODEL if something in the text is wrong; the message has line and key.
/// PSIDPD_STATUS_INVALID_ARGUMENT if `name` or `text` is not UTF-8. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `name` and `text` end with a zero byte; `model` can be written to.
psidpd_status psidpd_model_parse(const char *name, const char *text, struct psidpd_model **model);

/// Frees a model, and with it the texts that it has given out; NULL is ignored. Engines made from the
/// model live on.
///
/// # Safety
/// `model` is NULL or a model that has not been freed, and no other thread is using it.
void psidpd_model_free(struct psidpd_model *model);

/// Puts in `*facts` the title of the model, and the number of its dimensions and species.
///
/// # Errors
/// PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `model` is NULL or a model that has not been freed; `facts` can be written to.
psidpd_status psidpd_model_describe(const struct psidpd_model *model,
                                    struct psidpd_model_facts *facts);

/// Puts in `*name` the name of species `index`, from 0; valid until the model is freed.
///
/// # Errors
/// PSIDPD_STATUS_INVALID_ARGUMENT if there is no such species. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `model` is NULL or a model that has not been freed; `name` can be written to.
psidpd_status psidpd_model_species_name(const struct psidpd_model *model,
                                        size_t index,
                                        const char **name);

/// Makes an engine for `model` at temperature `kt`, in the energy unit of the model, and puts it in
/// `*engine`, to be freed with psidpd_engine_free. If it fails, `*engine` is left alone. The engine
/// does not need the model any more.
///
/// With `settings` NULL the engine computes in double precision on one thread, with the best instruction set of the
/// processor.
///
/// # Errors
/// PSIDPD_STATUS_MODEL if `kt` is not a positive number, or the model is not finite at it.
/// PSIDPD_STATUS_INVALID_ARGUMENT for invalid settings. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `model` is NULL or a model that has not been freed; `settings` is NULL or at settings; `engine` can be written to.
psidpd_status psidpd_engine_new(const struct psidpd_model *model,
                                double kt,
                                const struct psidpd_settings *settings,
                                struct psidpd_engine **engine);

/// Puts in `*facts` the facts of the engine that a host needs.
///
/// # Errors
/// PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `facts` can be written to.
psidpd_status psidpd_engine_describe(const struct psidpd_engine *engine,
                                     struct psidpd_engine_facts *facts);

/// Puts in `*path` the path that the last evaluation took, a psidpd_path, and in `*text` its description with
/// the reason; valid until the next psidpd_engine_path of this engine, and until the engine is freed.
///
/// # Errors
/// PSIDPD_STATUS_CALL_ORDER before the first evaluation. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `path` and `text` can be written to.
psidpd_status psidpd_engine_path(struct psidpd_engine *engine,
                                 psidpd_path *path,
                                 const char **text);

/// Frees an engine and all arrays and texts that it has given out; NULL is ignored.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed, and no other thread is using it.
void psidpd_engine_free(struct psidpd_engine *engine);

/// Maps the host's types to species, from the next evaluation on: `species[kind]` is the
/// species index of type `kind`, negative for particles that take no part. `species` is copied.
///
/// # Errors
/// PSIDPD_STATUS_INVALID_ARGUMENT if the model has no such species. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `species` has `length` entries.
psidpd_status psidpd_engine_map_kinds(struct psidpd_engine *engine,
                                      const int32_t *species,
                                      size_t length);

/// Sets the pairs with reduced strength, from the next evaluation on: `length` of them, which are copied; 0 for none.
/// Two particles must meet in one image only within the cut-off. They do not apply to pairs that the host lists.
///
/// # Errors
/// PSIDPD_STATUS_NULL_POINTER. Pairs of particles that are not there fail in the next evaluation.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `pairs` has `length` entries.
psidpd_status psidpd_engine_set_special_pairs(struct psidpd_engine *engine,
                                              const struct psidpd_special_pair *pairs,
                                              size_t length);

/// Puts in `*slopes` the place of the derivatives of psi, and in `*length` how many there are: of each
/// owned particle `slope_width` numbers, then as many of each ghost. Those of ghosts mean nothing; the host
/// must fill them in with their owners' before psidpd_engine_second.
///
/// Valid until the next evaluation with this engine, and until the engine is freed.
///
/// # Errors
/// PSIDPD_STATUS_CALL_ORDER without psidpd_engine_first. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `slopes` and `length` can be written to.
psidpd_status psidpd_engine_slopes(struct psidpd_engine *engine,
                                   double **slopes,
                                   size_t *length);

/// Puts in `*results` the places of the arrays of the last evaluation.
///
/// # Errors
/// PSIDPD_STATUS_CALL_ORDER without an evaluation. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `results` can be written to.
psidpd_status psidpd_engine_results(const struct psidpd_engine *engine,
                                    struct psidpd_results *results);

/// All forces on particles in a box of their own, without ghosts: adds them to `force`, `3 * particles.all` numbers, and
/// puts in `*tally` the requested sums. `tally` may be NULL.
///
/// Positions may be outside the box: along periodic edges they stand for an image.
///
/// # Errors
/// PSIDPD_STATUS_ENGINE for a position, psi or force that is not finite, a tag below 1, a type that is not mapped;
/// some forces may have been added then. PSIDPD_STATUS_INVALID_ARGUMENT for a box without volume, numbers of particles
/// that cannot be, ghosts, unknown bits in `want`, a `dt` that is not positive, or if `force` overlaps `x` or `v`.
/// PSIDPD_STATUS_NULL_POINTER; arrays may be NULL if there are no particles.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `box` and `request` are NULL or at such structures, whose arrays
/// are as long as they must be; `force` has `3 * particles.all` numbers and must overlap none of the others, nor what the
/// engine has given out; `tally` is NULL or can be written to. Nothing is kept of them.
psidpd_status psidpd_engine_evaluate(struct psidpd_engine *engine,
                                     const struct psidpd_box *box,
                                     const struct psidpd_request *request,
                                     double *force,
                                     struct psidpd_tally *tally);

/// First half of an evaluation with ghosts: all that needs no slopes of ghosts. psidpd_engine_second follows, with the same
/// request, when psidpd_engine_slopes have been copied from owners to ghosts.
///
/// `box` may be NULL: then ghosts stand for everything beyond the owned particles. Along a periodic
/// edge of the box the host owns all of it, and the engine applies the period; `image` has 1 for each
/// ghost that is the image of another particle along such an edge, which the engine leaves out, and 0
/// for the others, `particles.all - particles.owned` of them. It may be NULL if there is no such image.
///
/// With `newton` 1 the host adds forces on ghosts back to their owners, and every pair is computed once over all ranks; with
/// 0 ghosts get no forces. Either way the sweep computes pairs with ghosts on both sides and leaves ghosts without forces.
///
/// # Errors
/// As psidpd_engine_evaluate; PSIDPD_STATUS_INVALID_ARGUMENT also for other values of `newton` and `image`. After an error
/// there are no slopes.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `box` and `request` are NULL or at such structures, whose arrays
/// are as long as they must be; `image` is NULL or as long as said above. Nothing is kept of them.
psidpd_status psidpd_engine_first(struct psidpd_engine *engine,
                                  const struct psidpd_box *box,
                                  const int32_t *image,
                                  int32_t newton,
                                  const struct psidpd_request *request);

/// As psidpd_engine_first, with pairs that the host lists. `U` has the factor of a pair in its density and in its pair
/// energy; drag and noise act at full strength.
///
/// # Errors
/// As psidpd_engine_first; PSIDPD_STATUS_INVALID_ARGUMENT also for pairs of particles that are not there.
///
/// # Safety
/// As psidpd_engine_first; `pairs` is NULL or at such a structure, whose arrays are as long as it says.
psidpd_status psidpd_engine_first_of_pairs(struct psidpd_engine *engine,
                                           const struct psidpd_pairs *pairs,
                                           int32_t newton,
                                           const struct psidpd_request *request);

/// Second half of an evaluation: adds to `force`, `3 * particles.all` numbers, the forces on the particles, and puts in
/// `*tally` the requested sums. The request is that of the first half. `tally` may be NULL.
///
/// # Errors
/// PSIDPD_STATUS_CALL_ORDER without psidpd_engine_first or psidpd_engine_first_of_pairs right before; otherwise as
/// psidpd_engine_evaluate.
///
/// # Safety
/// As psidpd_engine_evaluate.
psidpd_status psidpd_engine_second(struct psidpd_engine *engine,
                                   const struct psidpd_request *request,
                                   double *force,
                                   struct psidpd_tally *tally);

/// Makes the thermostat of an engine, with its temperature, settings and threads, and puts it in `*thermostat`, to be freed
/// with psidpd_thermostat_free. If it fails, `*thermostat` is left alone. The thermostat does not need the engine any more.
///
/// # Errors
/// PSIDPD_STATUS_MODEL if no pair of species of the model has drag. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `thermostat` can be written to.
psidpd_status psidpd_thermostat_new(const struct psidpd_engine *engine,
                                    struct psidpd_thermostat **thermostat);

/// Applies drag and noise to the velocities `v`, `3 * bodies.count` numbers, for the time `step.dt` at fixed positions.
/// `rule` is PSIDPD_RULE_...; the noise is Gaussian and depends on the seed and the number of the step. Forces are then
/// computed without a step. `virial` is NULL or gets the virial of the impulses over `dt`: xx, yy, zz, xy, xz, yz.
///
/// # Errors
/// PSIDPD_STATUS_ENGINE for a position that is not finite. PSIDPD_STATUS_INVALID_ARGUMENT for an unknown rule, a species
/// that the model does not have, a mass that is not positive, a box without volume or narrower than twice the range of the
/// drag, a `dt` that is not positive, or if `v` overlaps `bodies.x`; `v` is left alone then. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `thermostat` is NULL or a thermostat that has not been freed; `box`, `bodies` and `step` are NULL or at such structures,
/// whose arrays are as long as said above; `v` is NULL or as long as said above; `virial` is NULL or has six numbers.
/// Neither overlaps the others. Nothing is kept of them.
psidpd_status psidpd_thermostat_act(struct psidpd_thermostat *thermostat,
                                    const struct psidpd_box *box,
                                    const struct psidpd_bodies *bodies,
                                    int32_t rule,
                                    const struct psidpd_step *step,
                                    double *v,
                                    double *virial);

/// Frees a thermostat; NULL is ignored.
///
/// # Safety
/// `thermostat` is NULL or a thermostat that has not been freed, and no other thread is using it.
void psidpd_thermostat_free(struct psidpd_thermostat *thermostat);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* PSIDPD_H */
