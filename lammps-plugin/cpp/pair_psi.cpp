#include "pair_psi.h"

#include "compat.h"

#include "atom.h"
#include "citeme.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "neighbor.h"
#include "update.h"
#include "utils.h"

#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;
using namespace psidpd;

namespace {

const char cite_psidpd[] =
    "psidpd: many-body DPD from excess free energies\n\n"
    "@Article{Pagonabarraga01,\n"
    " author = {I. Pagonabarraga and D. Frenkel},\n"
    " title = {Dissipative particle dynamics for interacting systems},\n"
    " journal = {J.~Chem.~Phys.},\n volume = 115,\n pages = 5015,\n year = 2001\n}\n\n"
    "@Article{Trofimov02,\n"
    " author = {S. Y. Trofimov and E. L. F. Nies and M. A. J. Michels},\n"
    " title = {Thermodynamic consistency in dissipative particle dynamics simulations of strongly nonideal "
    "liquids and liquid mixtures},\n"
    " journal = {J.~Chem.~Phys.},\n volume = 117,\n pages = 9383,\n year = 2002\n}\n\n"
    "@Article{Warren03,\n"
    " author = {P. B. Warren},\n"
    " title = {Vapor-liquid coexistence in many-body dissipative particle dynamics},\n"
    " journal = {Phys.~Rev.~E},\n volume = 68,\n pages = 066702,\n year = 2003\n}\n\n";

// LAMMPS keeps an array of triples in one block; an empty array has no first row.
rust::Slice<const double> flat(double **rows, int count)
{
  if (count == 0) return {};
  return {rows[0], 3 * static_cast<size_t>(count)};
}

}    // namespace

PairPsi::PairPsi(LAMMPS *lmp, const char *name) : Pair(lmp), name(name)
{
  single_enable = 0;
  restartinfo = 0;
  manybody_flag = 1;
  // The virial is summed pair by pair: it needs no forces on ghosts.
  no_virial_fdotr_compute = 1;
  nextra = 2;
  pvector = new double[nextra];
  pvector[0] = pvector[1] = 0.0;
  if (lmp->citeme) lmp->citeme->add(cite_psidpd);
}

PairPsi::~PairPsi()
{
  delete[] pvector;
  if (allocated) {
    memory->destroy(setflag);
    memory->destroy(cutsq);
  }
}

void PairPsi::stop(const std::string &text)
{
  error->all(FLERR, std::string("Pair style ") + name + ": " + text);
}

void PairPsi::allocate()
{
  const int n = atom->ntypes;
  memory->create(setflag, n + 1, n + 1, "pair:setflag");
  memory->create(cutsq, n + 1, n + 1, "pair:cutsq");
  for (int i = 1; i <= n; i++)
    for (int j = 1; j <= n; j++) {
      setflag[i][j] = 0;
      cutsq[i][j] = 0.0;
    }
  allocated = 1;
}

void PairPsi::read_temperature(const char *arg)
{
  const double t = utils::numeric(FLERR, arg, false, lmp);
  if (!(t > 0.0) || !std::isfinite(t))
    stop(std::string("the temperature must be positive, found ") + arg);
  kt = force->boltz * t;
}

void PairPsi::read_seed(const char *arg)
{
  const bigint value = utils::bnumeric(FLERR, arg, false, lmp);
  if (value <= 0) stop(std::string("the seed must be a positive whole number, found ") + arg);
  seed = static_cast<uint64_t>(value);
}

void PairPsi::init_style()
{
  build_style();
  check_host();
  check_box();
  comm_forward = static_cast<int>((*style)->slope_width());
  if (!described && comm->me == 0) utils::logmesg(lmp, std::string((*style)->description()));
  described = true;
}

void PairPsi::check_host()
{
  if (strcmp(update->unit_style, "lj") != 0)
    stop(std::string("works in reduced units, found 'units ") + update->unit_style + "': use 'units lj'");
  if (!atom->tag_enable) stop("needs atom IDs: remove 'atom_modify id no'");
  if ((*style)->needs_velocities() && !comm->ghost_velocity)
    stop("the thermostat needs velocities of ghost atoms: add 'comm_modify vel yes'");
  if (atom->molecular != Atom::ATOMIC)
    for (int k = 1; k < 4; k++)
      if (force->special_lj[k] != 1.0)
        stop("computes all pairs, bonded or not: use 'special_bonds lj 1 1 1'");
  // neighbor->exclude is set only later, by neighbor->init().
  if (neighbor->nex_type + neighbor->nex_group + neighbor->nex_mol > 0)
    stop("computes all pairs: 'neigh_modify exclude' has no effect on it; remove it, or map types to NULL");
}

// Two images of one pair would draw the same noise in a box shorter than twice its range.
void PairPsi::check_box()
{
  const double range = (*style)->noise_range();
  const double *inverse = domain->h_inv;
  const double height[3] = {
      1.0 / std::sqrt(inverse[0] * inverse[0] + inverse[5] * inverse[5] + inverse[4] * inverse[4]),
      1.0 / std::sqrt(inverse[1] * inverse[1] + inverse[3] * inverse[3]), 1.0 / std::fabs(inverse[2])};
  for (int k = 0; k < domain->dimension; k++)
    if (domain->periodicity[k] && height[k] < 2.0 * range)
      stop("the box is " + std::to_string(height[k]) + " long in direction " + "xyz"[k] +
           ", less than twice the range of the thermostat (" + std::to_string(range) +
           "): images of a pair would share their noise; use a longer box");
}

void PairPsi::check_ghosts()
{
  if (domain->triclinic || comm->mode != Comm::SINGLE) return;
  const double cutoff = (*style)->cutoff();
  for (int k = 0; k < domain->dimension; k++)
    if (comm->cutghost[k] < cutoff)
      stop("ghost atoms reach " + std::to_string(comm->cutghost[k]) + ", the cut-off is " +
           std::to_string(cutoff) + ": raise it with 'comm_modify cutoff'");
}

double PairPsi::init_one(int i, int j)
{
  if (setflag[i][j] == 0)
    stop("no coefficients for types " + std::to_string(i) + " and " + std::to_string(j) +
         ": set them with pair_coeff");
  return (*style)->cutoff();
}

void PairPsi::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);
  if (neighbor->ago == 0) check_ghosts();

  const size_t owned = atom->nlocal;
  const int all = atom->nlocal + atom->nghost;
  const bool newton = force->newton_pair;
  const auto x = flat(atom->x, all);
  const auto v = flat(atom->v, all);
  const rust::Slice<const int32_t> tag{atom->tag, static_cast<size_t>(all)};
  const rust::Slice<const int32_t> kind{atom->type, static_cast<size_t>(all)};
  Style &fluid = **style;

  // Trouble on one rank stops all: the text names the particle.
  std::string trouble;
  try {
    fluid.densities(owned, x, tag, kind, newton);
  } catch (const std::exception &e) {
    trouble = e.what();
  }
  if (!trouble.empty())
    error->one(FLERR, "Pair style " + name + " at step " + std::to_string(update->ntimestep) + ": " + trouble);

  if (comm_forward > 0) forward_slopes(comm, this, 0);

  Request request;
  // A minimiser goes downhill in U: drag and noise have no place there.
  request.thermostat = fluid.needs_velocities() && update->whichflag != 2;
  request.seed = seed;
  request.step = static_cast<uint64_t>(update->ntimestep);
  request.dt = update->dt;
  request.energy = eflag_global != 0;
  request.virial = vflag_global != 0;
  request.particle_energy = eflag_atom != 0;
  request.particle_virial = vflag_atom != 0;
  const size_t reach = newton ? all : owned;
  rust::Slice<double> f;
  if (reach > 0) f = {atom->f[0], 3 * reach};
  Totals totals;
  try {
    totals = style_forces(fluid, owned, x, v, tag, kind, request, f);
  } catch (const std::exception &e) {
    trouble = e.what();
  }
  if (!trouble.empty())
    error->one(FLERR, "Pair style " + name + " at step " + std::to_string(update->ntimestep) + ": " + trouble);

  if (eflag_global) {
    eng_vdwl += totals.excess + totals.pair;
    pvector[0] = totals.excess;
    pvector[1] = totals.pair;
  }
  if (vflag_global)
    for (int k = 0; k < 6; k++) virial[k] += totals.virial[k];
  if (eflag_atom) {
    const auto energy = fluid.particle_energy();
    for (size_t i = 0; i < reach; i++) eatom[i] += energy[i];
  }
  if (vflag_atom) {
    const auto w = fluid.particle_virial();
    for (size_t i = 0; i < reach; i++)
      for (int k = 0; k < 6; k++) vatom[i][k] += w[6 * i + k];
  }
}

int PairPsi::pack_forward_comm(int n, int *list, double *buf, int, int *)
{
  const auto slopes = (*style)->slopes_mut();
  const int width = comm_forward;
  for (int i = 0; i < n; i++)
    for (int k = 0; k < width; k++) *buf++ = slopes[static_cast<size_t>(list[i]) * width + k];
  return n * width;
}

void PairPsi::unpack_forward_comm(int n, int first, double *buf)
{
  auto slopes = (*style)->slopes_mut();
  const int width = comm_forward;
  for (int i = first; i < first + n; i++)
    for (int k = 0; k < width; k++) slopes[static_cast<size_t>(i) * width + k] = *buf++;
}

double PairPsi::memory_usage()
{
  return Pair::memory_usage();
}
