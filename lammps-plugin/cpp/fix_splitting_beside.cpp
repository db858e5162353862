// Which fixes and pair styles may stand beside the fix.
//
// LAMMPS tells of a fix whether it moves atoms, whether it has a temperature, and when it acts. Random forces are scaled for
// one evaluation in a timestep, and states that each evaluation advances would go too fast, which LAMMPS does not tell: those
// fixes are known by name, and so are those that were tried. Of others a warning says when they act.

#include "fix_splitting.h"

#include "force.h"
#include "modify.h"
#include "pair.h"
#include "update.h"

#include <algorithm>
#include <cstring>

using namespace LAMMPS_NS;
using namespace FixConst;
using namespace psidpd;

namespace {

template <size_t count>
bool begins_with_one_of(const char *text, const char *const (&names)[count])
{
  return std::any_of(names, names + count, [=](const char *name) { return strncmp(text, name, strlen(name)) == 0; });
}

// Their random forces, or states, are those of one evaluation of forces in a timestep.
constexpr const char *ONE_EVALUATION[] = {
    "shake", "rattle", "langevin", "qtb", "ttm", "srd", "lb/", "smd", "tmd", "colvars", "plumed", "atc", "hyper/", "pimd",
    "drude/transform", "wall/gran", "wall/body", "electron/stopping", "rx", "append/atoms", "electrode/thermo", "grem", "imd",
    "nonaffine/displacement", "pafi", "press/langevin", "sgcmc"};

// The packages that replace parts of a timestep are fixes too.
constexpr const char *ONE_PACKAGE[] = {"package_omp", "package_intel"};

constexpr const char *TRIED[] = {
    "accelerate/cos", "adapt", "addforce", "addtorque", "ave", "balance", "bond/", "deform", "deposit", "dpd/wall", "drag",
    "dt/reset", "efield", "ehex", "evaporate", "external", "flow/gauss", "freeze", "gcmc", "gravity", "GROUP", "halt", "heat", "indent",
    "lineforce", "manifoldforce", "momentum", "oneway", "pair", "planeforce", "press/berendsen", "print", "propel/self",
    "property/atom", "recenter", "restrain", "rhok", "setforce", "spring", "SRP", "STORE", "store", "temp/berendsen", "temp/csvr",
    "temp/rescale", "thermal/conductivity", "ti/spring", "vector", "viscosity", "viscous", "wall/"};

// When a fix acts, in words; empty if only at ends of timesteps and of runs, or when neighbor lists are made.
std::string occasions(int mask)
{
  std::string text;
  const auto add = [&](int which, const char *when) {
    if (mask & which) text += (text.empty() ? "" : ", ") + std::string(when);
  };
  add(INITIAL_INTEGRATE | POST_INTEGRATE | FINAL_INTEGRATE, "where atoms move");
  add(PRE_EXCHANGE, "before atoms change ranks");
  add(PRE_FORCE | PRE_REVERSE | POST_FORCE, "wherever forces are computed");
  return text;
}

}    // namespace

void FixSplitting::check_styles_beside()
{
  for (const char *known : {"^dpd$", "^dpd/tstat", "^dpd/ext", "^dpd/coul", "^dpd/fdt", "^dpd/gpu", "^dpd/intel", "^dpd/kk",
                            "^dpd/omp", "^mdpd$", "^edpd", "^tdpd", "^brownian", "^gran"})
    if (Pair *beside = force->pair_match(known, 0, 1))
      stop(std::string("pair_style ") + force->pair_match_ptr(beside) +
           " beside it expects one evaluation of forces in a step of velocity Verlet: use fix nve");
}

void FixSplitting::check_others()
{
  for (int k = 0; k < modify->nfix; k++) {
    Fix *other = modify->fix[k];
    if (other == this) continue;
    const int mask = modify->fmask[k];
    const std::string name = std::string("fix ") + other->id + " (" + other->style + ")";
    if (dynamic_cast<const FixSplitting *>(other)) stop("only one such fix is allowed, and there is also " + name);
    if (other->time_integrate || other->rigid_flag)
      stop(name + " integrates too, and its atoms would be elsewhere when forces are computed: remove it; atoms that "
                  "no fix integrates stay where they are");
    if (scheme == Scheme::aboba && strcmp(other->style, "pair") == 0)
      stop(name + " reads the pair style where forces are first computed, with aboba in the middle of a step: use two-stage");
    int dimension = 0;
    const bool thermostats_forces = (mask & POST_FORCE) && other->extract("t_target", dimension);
    if (thermostats_forces || begins_with_one_of(other->style, ONE_EVALUATION) || begins_with_one_of(other->id, ONE_PACKAGE))
      stop(name + " expects one evaluation of forces in a step of velocity Verlet: use fix nve");
    const std::string when = occasions(mask);
    if (when.empty() || begins_with_one_of(other->style, TRIED)) continue;
    if (!named.insert(other->id).second) continue;
    warn(name + " was not tried beside it, and acts " + when + "; forces are computed " + evaluations() +
         " in a timestep: compare with fix nve at a short timestep");
  }
}

std::string FixSplitting::evaluations() const
{
  if (scheme == Scheme::aboba) return "once, with energies or the virial twice,";
  return scheme == Scheme::force_gradient && gradient > 0.0 ? "three times" : "twice";
}
