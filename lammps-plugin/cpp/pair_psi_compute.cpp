// Forces, and the values of atoms and pairs that are available after them.

#include "pair_psi.h"

#include "compat.h"
#include "slices.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "force.h"
#include "group.h"
#include "modify.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;
using namespace psidpd;

// Along a periodic direction with one rank only, all ghosts are images of this rank's atoms: the engine
// applies the period there instead. The exceptions are images that move at another speed, and boxes
// where some images do not exist.
Extent PairPsi::extent() const
{
  Extent extent{};
  std::copy_n(domain->boxlo, 3, extent.origin.begin());
  std::copy_n(domain->h, 6, extent.edges.begin());
  for (int k = 0; k < domain->dimension; k++) extent.periodic[k] = domain->periodicity[k];
  if (domain->deform_vremap || atom->firstgroupname) return extent;
  if (comm->nprocs > 1 && comm->layout == Comm::LAYOUT_TILED) return extent;
  for (int k = 0; k < domain->dimension; k++)
    extent.closed[k] = domain->periodicity[k] && (comm->nprocs == 1 || comm->procgrid[k] == 1);
  return extent;
}

// Whether all ghosts are images along closed directions.
bool PairPsi::is_alone(const Extent &extent) const
{
  if (comm->nprocs > 1 || !why_listed.empty()) return false;
  for (int k = 0; k < domain->dimension; k++)
    if (domain->periodicity[k] && !extent.closed[k]) return false;
  return true;
}

// Asks the rank that packs a ghost whether it is an image along a closed direction.
void PairPsi::find_images()
{
  const auto closed = extent().closed;
  // All ranks have the same box and so decide alike.
  const bool none = !why_listed.empty() || closed == std::array<bool, 3>{};
  exchange.images.begin(closed, atom->nlocal, none ? 0 : atom->nghost);
  if (none) return;
  comm_forward = 1;
  exchange.carry(GhostExchange::Carries::images, [this] { forward_values(comm, this, 0); });
}

// Flags of the ghosts that are images along closed directions. Where these are not known, the box is
// opened and all ghosts are used.
rust::Slice<const bool> PairPsi::left_out(Extent &extent, const Request &request) const
{
  // Images are flagged only along directions that were closed when ghosts were found.
  if (!strained && exchange.images.know(extent.closed, atom->nghost) && (*style)->fits(extent, request))
    return {exchange.images.flags(), static_cast<size_t>(atom->nghost)};
  extent.closed = {};
  return {};
}

// The atoms of this rank and the first ghosts, `count` in all.
Atoms PairPsi::atoms(size_t count) const
{
  Atoms atoms{};
  atoms.owned = atom->nlocal;
  atoms.x = flat(atom->x, static_cast<int>(count));
  atoms.v = flat(atom->v, static_cast<int>(count));
  atoms.tag = {atom->tag, count};
  atoms.kind = {atom->type, count};
  return atoms;
}

// Densities and slopes; without a neighbor list also all forces but those of the slopes of ghosts.
void PairPsi::find_densities(const Atoms &atoms, const Request &request, rust::Slice<double> f)
{
  if (why_listed.empty()) {
    Extent extent = this->extent();
    const auto images = left_out(extent, request);
    (*style)->densities(extent, images, force->newton_pair, atoms, request, f);
    return;
  }
  (*style)->densities_of_pairs(listed.collect(list, atom, force), force->newton_pair, atoms, request);
}

// Sends slopes from owners to ghosts.
void PairPsi::forward()
{
  const int width = static_cast<int>((*style)->facts().slope_width);
  // Inside a hybrid LAMMPS has sized its buffers before it knew the number of our columns; its buffers fit positions.
  const int most = force->pair == this ? width : 3;
  for (int first = 0; first < width; first += comm_forward) {
    comm_forward = std::min(most, width - first);
    exchange.first_column = first;
    exchange.columns = comm_forward;
    forward_values(comm, this, 0);
  }
}

void PairPsi::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);
  refresh();
  if (neighbor->ago == 0) {
    check_plane();
    check_ghosts();
    check_lost();
    if (domain->box_change) check_box();
    if (why_listed.empty() && special.are_scaled(atom, force) && is_narrow())
      stop("the box has become narrower than twice the cut-off, where special_bonds needs a neighbor list: run again");
    if (!displaced) ghost_reach.begin(atom);
    find_images();
    special.find(atom, force, why_listed.empty());
    const std::string trouble = exclusions.find(atom, neighbor, group, setflag, why_listed.empty());
    if (!trouble.empty()) stop(trouble);
    if (has_device() && exclusions.exclude(neighbor, setflag))
      stop("device gpu computes all pairs: it cannot leave out those of neigh_modify exclude, or those that a hybrid gives "
           "to other styles; use device cpu");
  }

  const size_t owned = atom->nlocal;
  const int all = atom->nlocal + atom->nghost;
  const bool newton = force->newton_pair;
  Style &fluid = **style;

  Request request;
  // A minimiser follows the gradient of U, to which drag and noise do not belong.
  request.thermostat = fluid.facts().needs_velocities && !apart && update->whichflag != 2;
  request.seed = given.seed;
  request.step = static_cast<uint64_t>(update->ntimestep);
  request.dt = update->dt;
  if (request.thermostat && !comm->ghost_velocity)
    stop("the thermostat needs velocities of ghost atoms: add 'comm_modify vel yes'");
  if (apart != has_splitting())
    stop("fix dpd/splitting was made or removed after the last setup: run without 'pre no'");
  if (wall_fixes != count_walls()) stop("fix dpd/wall was made or removed after the last setup: run without 'pre no'");
  if (request.thermostat && !(update->dt > 0.0))
    stop("the thermostat needs a timestep greater than 0, found " + std::to_string(update->dt));
  if (num_tally_compute > 0)
    stop("computes of the TALLY package get no pairs from it: use compute pe/atom, stress/atom, group/group or "
         "pair/local");
  request.energy = eflag_global != 0;
  request.virial = vflag_global != 0;
  request.particle_energy = eflag_atom != 0;
  request.particle_virial = vflag_atom != 0;

  const size_t reach = newton ? all : owned;
  rust::Slice<double> f;
  if (reach > 0) f = {atom->f[0], 3 * reach};
  const Extent box = extent();
  strained = exchange.images.have_moved(atom, domain);
  const bool alone = !strained && is_alone(box) && attempt([&] { return fluid.fits(box, request); });
  check_reach(alone);
  tell_left_out(alone);
  Totals totals;
  if (alone) {
    totals = attempt([&] { return fluid.evaluate(box, atoms(owned), request, f); });
    without_slopes = {atom->nlocal, atom->nghost};
  } else {
    const Atoms with_ghosts = atoms(all);
    attempt([&] { find_densities(with_ghosts, request, f); });
    forward();
    totals = attempt([&] { return fluid.forces(with_ghosts, request, f); });
    without_slopes = {-1, -1};
  }

  if (eflag_global) {
    eng_vdwl += totals.excess + totals.pair;
    pvector[0] = totals.excess;
    pvector[1] = totals.pair;
    pvector[2] = totals.below;
    pvector[3] = totals.above;
  }
  if (vflag_global)
    for (int k = 0; k < 6; k++) virial[k] += totals.virial[k];
  const double unit = fluid.facts().energy_unit;
  if (eflag_atom) {
    const auto energy = fluid.particle_energy();
    for (size_t i = 0; i < reach; i++) eatom[i] += unit * energy[i];
  }
  if (vflag_atom) {
    const auto w = fluid.particle_virial();
    for (size_t i = 0; i < reach; i++)
      for (int k = 0; k < 6; k++) vatom[i][k] += unit * w[6 * i + k];
  }
}

int PairPsi::pack_forward_comm(int n, int *list, double *buf, int pbc_flag, int *pbc)
{
  return exchange.pack(n, list, buf, pbc_flag, pbc, (*style)->slopes_mut().data(), (*style)->facts().slope_width);
}

void PairPsi::unpack_forward_comm(int n, int first, double *buf)
{
  exchange.unpack(n, first, buf, (*style)->slopes_mut().data(), (*style)->facts().slope_width);
}

// Passes pairs that are left out, or scaled, to the engine, unless it has them.
void PairPsi::tell_left_out(bool owned_alone)
{
  attempt([&] {
    exclusions.tell(**style);
    special.tell(**style, owned_alone);
  });
}

// Whether the atoms, their types and their distance are those of the last evaluation.
bool PairPsi::is_pair(int i, int j, int itype, int jtype, double rsq) const
{
  const int all = atom->nlocal + atom->nghost;
  if (i < 0 || j < 0 || i >= all || j >= all) return false;
  if (atom->type[i] != itype || atom->type[j] != jtype) return false;
  const double range = (*style)->facts().cutoff;
  double d[3];
  for (int k = 0; k < 3; k++) d[k] = atom->x[i][k] - atom->x[j][k];
  const auto agrees = [&] {
    const double here = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    return std::fabs(here - rsq) <= 1e-9 * std::max(range * range, here);
  };
  if (agrees()) return true;
  // Some callers pass the atom and mean its nearest image.
  const double *h = domain->h;
  const double edge[3][3] = {{h[0], 0.0, 0.0}, {h[5], h[1], 0.0}, {h[4], h[3], h[2]}};
  for (int k = 2; k >= 0; k--) {
    if (!domain->periodicity[k]) continue;
    const double n = std::round(d[k] / edge[k][k]);
    for (int c = 0; c <= k; c++) d[c] -= n * edge[k][c];
  }
  return agrees();
}

// Returns the energy of the terms that belong to pairs, without psi; the force is the whole conservative
// force, with the densities of the last step. Drag and noise are left out, as in LAMMPS's other DPD styles.
double PairPsi::single(int i, int j, int itype, int jtype, double rsq, double, double factor_lj, double &fforce)
{
  // Without densities a pair's energy depends on its distance alone, and not on the last evaluation.
  const bool many_body = (*style)->facts().slope_width > 0;
  if (many_body && !is_pair(i, j, itype, jtype, rsq))
    stop_here("asked for the energy of a pair that the last evaluation does not contain, as of an atom to be inserted or "
              "moved: a many-body energy is not a sum over pairs; fix gcmc and fix widom need full_energy with a many-body "
              "style, and pair_write cannot be used");
  if (many_body && without_slopes == std::array<int, 2>{atom->nlocal, atom->nghost}) {
    without_slopes = {-1, -1};
    attempt([&] { (*style)->fetch_slopes(atom->nlocal + atom->nghost); });
    forward();
  }
  const double r = std::sqrt(rsq);
  const auto [energy, along] = attempt([&] { return (*style)->single({itype, jtype}, r, {i, j}); });
  fforce = r > 0.0 ? factor_lj * along / r : 0.0;
  return factor_lj * energy;
}

void *PairPsi::extract(const char *what, int &dim)
{
  dim = 0;
  if (strcmp(what, "T") == 0 || strcmp(what, "temperature") == 0) return &given.temperature;
  return nullptr;
}

// "density" or "rho": local densities, one column for each density and species, in the order of the model
// file; "psi": excess free energy of each atom.
void *PairPsi::extract_peratom(const char *what, int &columns)
{
  const bool density = strcmp(what, "density") == 0 || strcmp(what, "rho") == 0;
  if (!density && strcmp(what, "psi") != 0) return nullptr;
  refresh();
  columns = 0;
  if (!density && has_device()) stop("device gpu has no psi of single atoms: use device cpu");
  if (!density) return attempt([&] { return const_cast<double *>((*style)->excess_of_owned().data()); });
  const size_t width = (*style)->facts().variables;
  if (width == 0) return nullptr;
  // Forces may not have needed all densities.
  tell_left_out(false);
  attempt([&] { (*style)->sum_densities(extent(), atoms(atom->nlocal + atom->nghost)); });
  const auto densities = (*style)->local_densities();
  double *first = const_cast<double *>(densities.data());
  if (width == 1) return first;
  columns = static_cast<int>(width);
  density_rows.resize(densities.size() / width + 1);
  for (size_t i = 0; i < density_rows.size(); i++) density_rows[i] = first + i * width;
  return density_rows.data();
}
