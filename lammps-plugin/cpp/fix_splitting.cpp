#include "fix_splitting.h"

#include "pair_psi.h"
#include "slices.h"

#include "angle.h"
#include "atom.h"
#include "bond.h"
#include "comm.h"
#include "dihedral.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "improper.h"
#include "kspace.h"
#include "modify.h"
#include "neighbor.h"
#include "update.h"
#include "utils.h"

#if __has_include("atom_vec.h")
#include "atom_vec.h"
#endif

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

using namespace LAMMPS_NS;
using namespace FixConst;
using namespace psidpd;

namespace {

// Shares of a step in the first kick and in the last, as in the native runner. With two stages the
// share makes the errors of averages in liquids small; so it does with the force gradient, whose scheme is of
// fourth order at 1/6, together with ξ.
constexpr double LAMBDA_OF_TWO_STAGES = 0.21;
constexpr double LAMBDA_OF_FORCE_GRADIENT = 0.17;
constexpr double GRADIENT_OF_FOURTH_ORDER = 1.0 / 24.0;

const char SCHEMES[] = "'two-stage', 'force-gradient' or 'aboba'";

bool begins(const char *text, const char *with)
{
  return strncmp(text, with, strlen(with)) == 0;
}

}    // namespace

FixSplitting::FixSplitting(LAMMPS *lmp, int narg, char **arg) :
    Fix(lmp, narg, arg), lambda(LAMBDA_OF_TWO_STAGES), gradient(GRADIENT_OF_FOURTH_ORDER)
{
  time_integrate = 1;
  dynamic_group_allow = 1;
  // compute_scalar() returns the iterations of the thermostat.
  scalar_flag = 1;
  global_freq = 1;
  extscalar = 0;
  // The pressure contains the virial of drag and noise.
  virial_global_flag = 1;
  thermo_virial = 1;
  std::fill_n(virial, 6, 0.0);

  if (narg < 4) stop(std::string("expected ") + SCHEMES);
  const std::string name = arg[3];
  if (name == "aboba") {
    scheme = Scheme::aboba;
  } else if (name == "force-gradient") {
    scheme = Scheme::force_gradient;
    lambda = LAMBDA_OF_FORCE_GRADIENT;
  } else if (name != "two-stage") {
    stop("unknown splitting '" + name + "': expected " + SCHEMES);
  }
  for (int k = 4; k < narg; k += 2) {
    const std::string key = arg[k];
    if (k + 1 >= narg) stop("keyword '" + key + "' needs a value");
    const std::string value = arg[k + 1];
    if (key == "every") {
      every = utils::bnumeric(FLERR, arg[k + 1], false, lmp);
      if (every < 1) stop("every must be 1 or more, found " + value);
    } else if (key == "lambda" && scheme != Scheme::aboba) {
      lambda = utils::numeric(FLERR, arg[k + 1], false, lmp);
      if (!(lambda >= 0.0 && lambda <= 0.5)) stop("lambda must be from 0 to 0.5, found " + value);
    } else if (key == "gradient" && scheme == Scheme::force_gradient) {
      gradient = utils::numeric(FLERR, arg[k + 1], false, lmp);
      if (!(gradient >= 0.0 && std::isfinite(gradient))) stop("gradient must be 0 or more, found " + value);
    } else if (key == "noise") {
      if (value != "gaussian" && value != "uniform")
        stop("unknown noise '" + value + "': expected 'gaussian' or 'uniform'");
      uniform = value == "uniform";
    } else {
      stop("unknown keyword '" + key + "': expected 'every'" +
           (scheme != Scheme::aboba ? ", 'lambda'" : "") +
           (scheme == Scheme::force_gradient ? ", 'gradient'" : "") + " or 'noise'");
    }
  }
  create_attribute = 1;
  maxexchange = scheme == Scheme::two_stage ? 9 : 12;
  grow_arrays(atom->nmax);
  atom->add_callback(Atom::GROW);
}

void FixSplitting::stop(const std::string &text, const char *file, int line)
{
  error->all(file, line, std::string("Fix ") + style + ": " + text);
}

void FixSplitting::warn(const std::string &text, const char *file, int line)
{
  if (comm->me == 0) error->warning(file, line, std::string("Fix ") + style + ": " + text);
}

int FixSplitting::setmask()
{
  return INITIAL_INTEGRATE | FINAL_INTEGRATE | PRE_FORCE | PRE_REVERSE | POST_RUN;
}

PairPsi *FixSplitting::find_pair()
{
  std::string why;
  PairPsi *found = PairPsi::only(force, why);
  if (!why.empty()) stop("uses the thermostat of one pair style" + why);
  if (!found) stop("needs pair_style dpd/psi, mdpd/psi or dpd/spline, whose thermostat it is");
  return found;
}

void FixSplitting::init()
{
  pair = find_pair();
  // The pressure of a minimisation must not contain what an earlier run left here.
  std::fill_n(virial, 6, 0.0);
  impulses = {};
  // The fix moves no atom while LAMMPS minimises.
  if (update->whichflag == 2) return;
  if (strcmp(update->integrate_style, "verlet") != 0)
    stop(std::string("works with 'run_style verlet' only, found '") + update->integrate_style + "'");
  const std::string why = pair->why_not_apart();
  if (!why.empty()) stop("cannot apply drag and noise here: " + why);
  check_styles_beside();
  check_others();
}

void FixSplitting::setup(int vflag)
{
  // A fix that was set up later may have excluded pairs.
  const std::string why = pair->why_not_apart();
  if (!why.empty()) stop("cannot apply drag and noise here: " + why);
  before = pair->effort();
  holds = false;
  show_virial(vflag);
}

void FixSplitting::show_virial(int vflag)
{
  v_init(vflag);
  if (vflag_global) std::copy(impulses.begin(), impulses.end(), virial);
}

void FixSplitting::initial_integrate(int vflag)
{
  if (!pair) stop("LAMMPS has not set it up: 'run N pre no' cannot follow a new fix");
  vflag_of_step = vflag;
  const double dt = update->dt;
  if (scheme == Scheme::aboba) {
    // The forces of the last timestep hold atoms at round walls, also where others were computed at its end.
    if (holds) pair->engine().copy(flat(shifts, atom->nlocal), flat_mut(atom->f, atom->nlocal));
    drift(0.5 * dt);
    bounce(1, 0.0);
    expect();
    evaluation = Evaluation::middle;
    return;
  }
  kick(lambda * dt);
  drift(0.5 * dt);
  bounce(1, lambda * dt);
  reflect();
  follow();
  const bool displaces = scheme == Scheme::force_gradient && gradient > 0.0;
  evaluation = displaces ? Evaluation::other : Evaluation::middle;
  compute_forces(0, 0);
  if (displaces) {
    evaluation = Evaluation::middle;
    compute_displaced_forces();
  }
  evaluation = Evaluation::end;
  kick((1.0 - 2.0 * lambda) * dt);
  drift(0.5 * dt);
  bounce(2, (0.5 - lambda) * dt);
  expect();
}

void FixSplitting::final_integrate()
{
  const double dt = update->dt;
  if (scheme != Scheme::aboba) {
    kick(lambda * dt);
    if (is_due()) act();
    show_virial(vflag_of_step);
    return;
  }
  watch_walls();
  kick(0.5 * dt);
  if (is_due()) act();
  show_virial(vflag_of_step);
  kick(0.5 * dt);
  drift(0.5 * dt);
  bounce(2, 0.5 * dt);
  reflect();
  // Fixes and computes that read the state at the end of a step find ghosts and, where asked for, energies there.
  const bigint step = update->ntimestep;
  const int eflag = (update->eflag_global == step ? 1 : 0) | (update->eflag_atom == step ? 2 : 0);
  holds = eflag || vflag_of_step;
  if (holds) {
    pair->engine().copy(flat(atom->f, atom->nlocal), flat_mut(shifts, atom->nlocal));
    follow();
    evaluation = Evaluation::end;
    compute_forces(eflag, vflag_of_step);
  } else {
    comm->forward_comm();
  }
}

// Tells the iterations of the thermostat in this run.
void FixSplitting::post_run()
{
  if (!pair || update->whichflag != 1) return;
  const Effort now = pair->effort();
  const uint64_t updates = now.updates - before.updates;
  if (updates > 0 && comm->me == 0) {
    const double mean = static_cast<double>(now.iterations - before.iterations) / static_cast<double>(updates);
    char text[300];
    snprintf(text, sizeof text,
             "Fix %s: the thermostat acted %llu times, with %.1f iterations on average, %zu at most; its pairs were those of the "
             "forces %llu times\n",
             style, static_cast<unsigned long long>(updates), mean, static_cast<size_t>(now.most),
             static_cast<unsigned long long>(now.listed - before.listed));
    utils::logmesg(lmp, std::string(text));
  }
}

double FixSplitting::compute_scalar()
{
  return pair ? pair->iterations() : 0.0;
}

Movers FixSplitting::movers() const
{
  const size_t owned = atom->nlocal;
  Movers movers{};
  movers.group = groupbit;
  movers.mask = {atom->mask, owned};
  movers.kind = {atom->type, owned};
  if (atom->rmass)
    movers.mass = {atom->rmass, owned};
  else
    movers.mass_of_kind = {atom->mass, static_cast<size_t>(atom->ntypes) + 1};
  return movers;
}

void FixSplitting::kick(double h)
{
  const int owned = atom->nlocal;
  if (owned > 0) pair->engine().kick(h * force->ftm2v, movers(), flat(atom->f, owned), flat_mut(atom->v, owned));
}

void FixSplitting::drift(double h)
{
  const int owned = atom->nlocal;
  if (owned > 0) pair->engine().drift(h, movers(), flat(atom->v, owned), flat_mut(atom->x, owned));
}

// Other fixes that act after atoms have moved, like those that make bonds, act once a step.
void FixSplitting::reflect()
{
  for (int k = 0; k < modify->nfix; k++)
    if ((modify->fmask[k] & POST_INTEGRATE) && begins(modify->fix[k]->style, "wall/")) modify->fix[k]->post_integrate();
}

bool FixSplitting::is_due() const
{
  return update->ntimestep % every == 0;
}

// The forces of the step are computed where the thermostat acts.
void FixSplitting::expect()
{
  if (is_due()) pair->expect_heat(static_cast<double>(every) * update->dt);
}

void FixSplitting::act()
{
  const int owned = atom->nlocal;
  masses.resize(owned);
  if (owned > 0)
    pair->engine().find_masses(force->mvv2e, movers(), {held.data(), held.size()}, {masses.data(), masses.size()});
  const uint64_t inaccurate = pair->effort().inaccurate;
  impulses = pair->heat(masses, {static_cast<double>(every) * update->dt, uniform, wants_virial(), has_setters});
  if (!warned && pair->effort().inaccurate > inaccurate) {
    warned = true;
    warn("the thermostat is inaccurate, as drag is too strong for this timestep; use a smaller gamma or timestep");
  }
  if (has_setters) keep_pushes();
}

void FixSplitting::follow()
{
  if (are_far())
    find_ghosts_anew();
  else
    comm->forward_comm();
}

// Whether atoms have moved too far since ghosts were last found. False if LAMMPS does not check distances.
bool FixSplitting::are_far()
{
  if (!neighbor->dist_check) return false;
  // This check is not part of a step of LAMMPS: its count of dangerous builds stays as it was.
  const bigint dangerous = neighbor->ndanger;
  const bool far = neighbor->check_distance();
  neighbor->ndanger = dangerous;
  return far;
}

// Does what LAMMPS does at the beginning of a step with new lists, without the fixes that insert or
// remove atoms: these act at their own step.
void FixSplitting::find_ghosts_anew()
{
  for (int k = 0; k < modify->nfix; k++) {
    Fix *fix = modify->fix[k];
    const bool due = fix->force_reneighbor && fix->next_reneighbor == update->ntimestep;
    if ((modify->fmask[k] & PRE_EXCHANGE) && !due) fix->pre_exchange();
  }
  if (domain->triclinic) domain->x2lamda(atom->nlocal);
  domain->pbc();
  if (domain->box_change) {
    domain->reset_box();
    comm->setup();
    if (neighbor->style) neighbor->setup_bins();
  }
  comm->exchange();
  comm->borders();
  if (domain->triclinic) domain->lamda2x(atom->nlocal + atom->nghost);
  modify->pre_neighbor();
  neighbor->build(1);
  modify->post_neighbor();
}

void FixSplitting::compute_forces(int eflag, int vflag)
{
  const size_t reach = atom->nlocal + (force->newton ? atom->nghost : 0);
  if (reach > 0) {
    memset(&atom->f[0][0], 0, 3 * reach * sizeof(double));
    if (atom->torque_flag) memset(&atom->torque[0][0], 0, 3 * reach * sizeof(double));
#if __has_include("atom_vec.h")
    // Some atom styles have forces on more than positions, which installed headers may not declare.
    if (atom->avec->forceclearflag) atom->avec->force_clear(0, reach * sizeof(double));
#endif
  }
  modify->pre_force(vflag);
  if (force->pair->compute_flag) force->pair->compute(eflag, vflag);
  if (atom->molecular != Atom::ATOMIC) {
    if (force->bond) force->bond->compute(eflag, vflag);
    if (force->angle) force->angle->compute(eflag, vflag);
    if (force->dihedral) force->dihedral->compute(eflag, vflag);
    if (force->improper) force->improper->compute(eflag, vflag);
  }
  if (force->kspace && force->kspace->compute_flag) force->kspace->compute(eflag, vflag);
  modify->pre_reverse(eflag, vflag);
  if (force->newton) comm->reverse_comm();
  add_forces(vflag);
}

// Fix pair reads the pair style at the first evaluation of a step that it sees: it sees that at the end only.
void FixSplitting::add_forces(int vflag)
{
  const auto is_reader = [&](int k) { return strcmp(modify->fix[k]->style, "pair") == 0; };
  bool all_alike = true;
  for (int k = 0; k < modify->nfix; k++) all_alike = all_alike && !is_reader(k) && !is_watched(k);
  if (all_alike) {
    modify->post_force(vflag);
    return;
  }
  // As LAMMPS does, dynamic groups first.
  for (const bool groups : {true, false})
    for (int k = 0; k < modify->nfix; k++) {
      if (!(modify->fmask[k] & POST_FORCE) || begins(modify->fix[k]->style, "GROUP") != groups || is_reader(k)) continue;
      if (is_watched(k))
        watch(modify->fix[k], vflag);
      else
        modify->fix[k]->post_force(vflag);
    }
}

extern "C" void *psidpd_create_dpd_splitting(void *lmp, int narg, char **arg)
{
  return static_cast<Fix *>(new FixSplitting(static_cast<LAMMPS *>(lmp), narg, arg));
}
