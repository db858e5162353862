#include "pair_psi.h"

#include "compat.h"
#include "fix_splitting.h"
#include "restart.h"

#include "atom.h"
#include "citeme.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix.h"
#include "force.h"
#include "group.h"
#include "memory.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <thread>

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

// Rules of neigh_modify for types and groups that a word has room for, with two sides each.
constexpr int most_rules = 16;

// LAMMPS keeps an array of triples in one block; an empty array has no first row.
rust::Slice<const double> flat(double **rows, int count)
{
  if (count == 0) return {};
  return {rows[0], 3 * static_cast<size_t>(count)};
}

// Distances between opposite faces of the box.
void heights(const Domain *domain, double *height)
{
  const double *inverse = domain->h_inv;
  height[0] = 1.0 / std::sqrt(inverse[0] * inverse[0] + inverse[5] * inverse[5] + inverse[4] * inverse[4]);
  height[1] = 1.0 / std::sqrt(inverse[1] * inverse[1] + inverse[3] * inverse[3]);
  height[2] = 1.0 / std::fabs(inverse[2]);
}

}    // namespace

PairPsi::PairPsi(LAMMPS *lmp, const char *name) : Pair(lmp), name(name)
{
  single_enable = 1;
  restartinfo = 1;
  manybody_flag = 1;
  // The virial is summed pair by pair: it needs no forces on ghosts.
  no_virial_fdotr_compute = 1;
  nextra = 4;
  pvector = new double[nextra];
  for (int k = 0; k < nextra; k++) pvector[k] = 0.0;
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

void PairPsi::stop(const std::string &text, const char *file, int line)
{
  error->all(file, line, "Pair style " + name + ": " + text);
}

void PairPsi::warn(const std::string &text, const char *file, int line)
{
  if (comm->me == 0) error->warning(file, line, "Pair style " + name + ": " + text);
}

void PairPsi::complain(const std::string &text)
{
  throw std::runtime_error(text);
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
  temperature = t;
}

double PairPsi::kt() const
{
  return force->boltz * temperature;
}

void PairPsi::read_seed(const char *arg)
{
  const bigint value = utils::bnumeric(FLERR, arg, false, lmp);
  if (value <= 0) stop(std::string("the seed must be a positive whole number, found ") + arg);
  seed = static_cast<uint64_t>(value);
}

// Keywords of every style, at the end of pair_style; the others are the style's own.
void PairPsi::read_keywords(int first, int narg, char **arg)
{
  mixed = false;
  threads = 1;
  for (int k = first; k < narg; k += 2) {
    const std::string key = arg[k];
    if (k + 1 >= narg) stop("keyword '" + key + "' needs a value");
    const std::string value = arg[k + 1];
    if (read_keyword(key, value)) continue;
    if (key == "precision") {
      if (value != "mixed" && value != "double")
        stop("unknown precision '" + value + "': expected 'mixed' or 'double'");
      mixed = value == "mixed";
    } else if (key == "threads") {
      const int count = utils::inumeric(FLERR, value.c_str(), false, lmp);
      if (count < 1) stop("threads must be 1 or more, found " + value);
      threads = count;
    } else {
      stop("unknown keyword '" + key + "': expected " + keywords());
    }
  }
}

void PairPsi::settings(int narg, char **arg)
{
  read_settings(narg, arg);
  arguments.assign(arg, arg + narg);
}

// Builds the engine, or brings it up to date: fix adapt may have changed what it was built with.
void PairPsi::refresh()
{
  if (style && !is_stale() && kt() == built_kt) return;
  if (!(temperature > 0.0) || !std::isfinite(temperature))
    stop("the temperature must be positive, found " + std::to_string(temperature));
  // A new engine knows of no special pairs and exclusions.
  told_special = SIZE_MAX;
  told_marks = false;
  std::string trouble;
  try {
    if (!style || is_stale())
      style.emplace(make_style(kt()));
    else
      (*style)->set_temperature(kt());
    (*style)->configure(mixed, threads);
  } catch (const std::exception &e) {
    trouble = e.what();
  }
  if (!trouble.empty()) stop(trouble);
  built_kt = kt();
}

void PairPsi::init_style()
{
  refresh();
  apart = FixSplitting::find(modify) != nullptr;
  check_host();
  check_callers();
  check_box();
  // Buffers are sized by this; what is sent later is never more.
  comm_forward = static_cast<int>((*style)->variables());

  why_listed.clear();
  const auto because = [this](const std::string &text) { why_listed += (why_listed.empty() ? "" : " and ") + text; };
  if (is_scaled()) {
    if (atom->molecular == Atom::TEMPLATE) because("special_bonds with atom_style template");
    if (atom->map_style == Atom::MAP_NONE) because("special_bonds without an atom map");
    if (is_narrow()) because("special_bonds in a box narrower than twice the cut-off");
  }
  rules = neighbor->nex_type + neighbor->nex_group + neighbor->nex_mol;
  if (neighbor->nex_type + neighbor->nex_group > most_rules || neighbor->nex_mol > 1)
    because("more exclusions of neigh_modify than it can keep");
  if (neighbor->includegroup) because("neigh_modify include");
  // These exclude a group of their own, and say so only when pair styles have asked for their lists.
  for (int k = 0; k < modify->nfix; k++) {
    const char *fix = modify->fix[k]->style;
    for (const char *known : {"gcmc", "widom", "charge/regulation"})
      if (strcmp(fix, known) == 0) because(std::string("fix ") + known);
  }
  if (!why_listed.empty()) full_list = request_list(neighbor, this, instance_me, 0);
  // With newton off a half list has the pairs of owned atoms with ghosts on both sides, which will do.
  if (!why_listed.empty() && !full_list && force->newton_pair)
    stop("with " + why_listed + " this version of LAMMPS needs 'newton off'");

  if (!described && comm->me == 0)
    utils::logmesg(lmp, std::string((*style)->description(search(), !why_listed.empty(), apart)));
  if (!described) advise();
  described = true;
}

// What has been asked for and does nothing, or less than nothing.
void PairPsi::advise()
{
  if (lmp->suffix_enable)
    warn("there is no accelerated variant: the suffix has no effect on it; it has the keywords 'precision mixed' and "
         "'threads'");
  const size_t here = std::thread::hardware_concurrency();
  if (here > 0 && threads > here)
    warn("threads " + std::to_string(threads) + " is more than the " + std::to_string(here) + " processors here");
}

std::string PairPsi::search()
{
  if (why_listed.empty()) {
    std::string text = "own cell list every step; no neighbor list is requested";
    // The only style of a simulation without bonds: nobody else leaves forces on ghosts either.
    if (comm->nprocs > 1 && force->newton && force->pair == this && atom->molecular == Atom::ATOMIC)
      text += "\n  advice        'newton off' saves sending back forces on ghosts: this style leaves none there";
    if (rules > 0) text += "\n  exclusions    pairs that neigh_modify excludes are left out";
    if (is_scaled())
      text += "\n  special bonds factors above 0 scale phi and w of bonded neighbors, not drag and noise; with 0 they do not "
              "interact\n  advice        in DPD 'special_bonds lj 1 1 1' is usual, bonded atoms interacting like all others";
    return text;
  }
  return std::string(full_list ? "full" : "half") + " neighbor list of LAMMPS, because of " + why_listed +
      ": pairs that are not in it do not interact, special factors scale phi and w";
}

// Coefficients are in the units of the simulation. Those of SI leave the range of single precision.
void PairPsi::check_units(const std::string &units)
{
  if (units != "real" && units != "metal")
    stop("works in units lj, real and metal, found 'units " + units + "'");
}

void PairPsi::check_host()
{
  if (strcmp(update->unit_style, "lj") != 0)
    check_units(update->unit_style);
  if (!atom->tag_enable) stop("needs atom IDs: remove 'atom_modify id no'");
  if ((*style)->needs_velocities() && !apart && !comm->ghost_velocity)
    stop("the thermostat needs velocities of ghost atoms: add 'comm_modify vel yes'");
}

bool PairPsi::is_scaled() const
{
  const double *factor = force->special_lj;
  return atom->molecular != Atom::ATOMIC && (factor[1] != 1.0 || factor[2] != 1.0 || factor[3] != 1.0);
}

bool PairPsi::is_narrow() const
{
  double height[3];
  heights(domain, height);
  for (int k = 0; k < domain->dimension; k++)
    if (domain->periodicity[k] && height[k] < 2.0 * (*style)->cutoff()) return true;
  return false;
}

// What works with energies of single pairs alone has nothing to work with where energies belong to particles.
void PairPsi::check_callers()
{
  if ((*style)->slope_width() == 0) return;
  for (int k = 0; k < modify->nfix; k++)
    if (strncmp(modify->fix[k]->style, "bond/swap", 9) == 0)
      stop("fix bond/swap decides on the energies of single pairs: it cannot be used with a many-body style");
  for (const char *bond : {"special", "quartic"})
    if (force->bond_match(bond))
      stop(std::string("bond_style ") + bond + " adds or takes away the forces of single pairs: it cannot be used with "
           "a many-body style");
}

// Two images of one pair would draw the same noise in a box shorter than twice its range.
void PairPsi::check_box()
{
  const double range = (*style)->noise_range();
  double height[3];
  heights(domain, height);
  for (int k = 0; k < domain->dimension; k++)
    if (domain->periodicity[k] && height[k] < 2.0 * range)
      stop("the box is " + std::to_string(height[k]) + " long in direction " + "xyz"[k] +
           ", less than twice the range of the thermostat (" + std::to_string(range) +
           "): images of a pair would share their noise; use a longer box");
}

// What a plane has no place for: older versions of LAMMPS fill several of them with a lattice.
void PairPsi::check_plane()
{
  if (domain->dimension != 2) return;
  double mine[2] = {-1e300, -1e300}, all[2];
  for (int i = 0; i < atom->nlocal; i++) {
    const double z = atom->x[i][2];
    mine[0] = std::max(mine[0], z);
    mine[1] = std::max(mine[1], -z);
  }
  MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_MAX, world);
  if (all[0] + all[1] > 1e-6 * (*style)->cutoff())
    stop("in two dimensions all atoms must have the same z, found " + std::to_string(-all[1]) + " to " +
         std::to_string(all[0]) + ": use a box that is thinner than the lattice, or 'set group all z 0'");
}

void PairPsi::check_ghosts()
{
  if (comm->mode != Comm::SINGLE) return;
  const double cutoff = (*style)->cutoff();
  double height[3] = {1.0, 1.0, 1.0};
  // In a triclinic box LAMMPS counts in fractions of the box.
  if (domain->triclinic) heights(domain, height);
  for (int k = 0; k < domain->dimension; k++) {
    const double reach = comm->cutghost[k] * height[k];
    if (reach < cutoff * (1.0 - 1e-12))
      stop("ghost atoms reach " + std::to_string(reach) + ", the cut-off is " + std::to_string(cutoff) +
           ": raise it with 'comm_modify cutoff'");
  }
}

double PairPsi::init_one(int i, int j)
{
  if (setflag[i][j] == 0)
    stop("no coefficients for types " + std::to_string(i) + " and " + std::to_string(j) +
         ": there is no mixing, set them with pair_coeff");
  refresh();
  return (*style)->cutoff();
}

// Trouble on one rank stops all: the text names the particle.
void PairPsi::stop_here(const std::string &text, const char *file, int line)
{
  error->one(file, line, "Pair style " + name + " at step " + std::to_string(update->ntimestep) + ": " + text);
}

// The pairs of LAMMPS's list, each of two owned atoms once.
void PairPsi::collect_pairs()
{
  const double *special = force->special_lj;
  const bool scaled = atom->molecular != Atom::ATOMIC;
  const int owned = atom->nlocal;
  pair_i.clear();
  pair_j.clear();
  pair_factor.clear();
  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii];
    for (int jj = 0; jj < list->numneigh[i]; jj++) {
      const int entry = list->firstneigh[i][jj];
      const int j = entry & NEIGHMASK;
      if (full_list && j < owned && j < i) continue;
      // A factor of 0 is an exclusion, as where LAMMPS leaves the pair out of the list.
      const double factor = special[sbmask(entry)];
      if (factor == 0.0) continue;
      pair_i.push_back(i);
      pair_j.push_back(j);
      if (scaled) pair_factor.push_back(factor);
    }
  }
}

// Each pair of bonded neighbors once, if both are of this rank; else with all ghosts of the second, of which the engine
// takes the one that is near.
void PairPsi::find_special()
{
  special.clear();
  special_owned = 0;
  told_special = SIZE_MAX;
  if (!why_listed.empty() || !is_scaled()) return;
  const int owned = atom->nlocal;
  const int *next_image = atom->sametag;
  const std::array<double, 3> factors{force->special_lj[1], force->special_lj[2], force->special_lj[3]};
  std::vector<SpecialPair> with_ghosts;
  for (int i = 0; i < owned; i++) {
    const tagint *neighbors = atom->special[i];
    const int *count = atom->nspecial[i];
    for (int k = 0; k < count[2]; k++) {
      const double factor = factors[k < count[0] ? 0 : k < count[1] ? 1 : 2];
      // In a ring a neighbor may be one in two ways: the shorter counts.
      if (factor == 1.0 || std::find(neighbors, neighbors + k, neighbors[k]) != neighbors + k) continue;
      for (int j = atom->map(neighbors[k]); j >= 0; j = next_image[j])
        if (j >= owned)
          with_ghosts.push_back({i, j, factor});
        else if (i < j)
          special.push_back({i, j, factor});
    }
  }
  special_owned = special.size();
  special.insert(special.end(), with_ghosts.begin(), with_ghosts.end());
}

// What neigh_modify excludes, as two words for each atom and ghost: sides of rules for types and groups, and the molecule.
void PairPsi::find_exclusions()
{
  marks.clear();
  told_marks = false;
  const bool none = !why_listed.empty() || rules == 0;
  const bool by_molecule = !none && neighbor->nex_mol > 0;
  const int all = none ? 0 : atom->nlocal + atom->nghost;
  for (int i = 0; i < all; i++) {
    uint32_t sides = 0, bit = 1;
    const auto add = [&](bool one, bool other) {
      sides |= (one ? bit : 0) | (other ? bit << most_rules : 0);
      bit <<= 1;
    };
    for (int k = 0; k < neighbor->nex_type; k++)
      add(atom->type[i] == neighbor->ex1_type[k], atom->type[i] == neighbor->ex2_type[k]);
    for (int k = 0; k < neighbor->nex_group; k++)
      add(atom->mask[i] & group->bitmask[neighbor->ex1_group[k]], atom->mask[i] & group->bitmask[neighbor->ex2_group[k]]);
    const bool counts = by_molecule && (atom->mask[i] & group->bitmask[neighbor->ex_mol_group[0]]);
    marks.push_back(sides);
    marks.push_back(counts ? static_cast<uint32_t>(atom->molecule[i]) + 1 : 0);
  }
  between_molecules = by_molecule && !neighbor->ex_mol_intra[0];
}

// Tells the engine of marks and the first so many special pairs, unless it knows them.
void PairPsi::tell_special(size_t count)
{
  if (!told_marks) attempt([&] { (*style)->set_exclusions({marks.data(), marks.size()}, between_molecules); });
  told_marks = true;
  if (told_special == count) return;
  attempt([&] { (*style)->set_special_pairs({special.data(), count}); });
  told_special = count;
}

// Along periodic directions in which there is one rank only, all ghosts are images of what that rank has: the engine
// goes round the box there instead. Not where images move at another speed, nor where some have none.
Extent PairPsi::extent() const
{
  Extent extent{};
  std::copy_n(domain->boxlo, 3, extent.origin.begin());
  std::copy_n(domain->h, 6, extent.edges.begin());
  if (domain->deform_vremap || atom->firstgroupname) return extent;
  if (comm->nprocs > 1 && comm->layout == Comm::LAYOUT_TILED) return extent;
  for (int k = 0; k < domain->dimension; k++)
    extent.closed[k] = domain->periodicity[k] && (comm->nprocs == 1 || comm->procgrid[k] == 1);
  return extent;
}

// Whether all ghosts, if there are any, are images along closed directions.
bool PairPsi::is_alone(const Extent &extent) const
{
  if (comm->nprocs > 1 || !why_listed.empty()) return false;
  for (int k = 0; k < domain->dimension; k++)
    if (domain->periodicity[k] && !extent.closed[k]) return false;
  return true;
}

// Asks which ghosts are images along closed directions: who packs them knows.
void PairPsi::find_images()
{
  const auto closed = extent().closed;
  // All ranks agree on the box.
  const bool none = !why_listed.empty() || closed == std::array<bool, 3>{};
  images.begin(closed, atom->nlocal, none ? 0 : atom->nghost);
  if (none) return;
  carries = Carries::images;
  comm_forward = 1;
  forward_values(comm, this, 0);
  carries = Carries::slopes;
}

// Which ghosts are images along closed directions. Where that is not known the box is opened, and all ghosts are taken.
rust::Slice<const bool> PairPsi::left_out(Extent &extent, const Request &request) const
{
  // Only what was closed when ghosts were found has all its images told.
  if (!strained && images.know(extent.closed, atom->nghost) && (*style)->fits(extent, request))
    return {images.flags(), static_cast<size_t>(atom->nghost)};
  extent.closed = {};
  return {};
}

void PairPsi::find_densities(int all, const Request &request)
{
  const size_t owned = atom->nlocal;
  const auto x = flat(atom->x, all);
  const rust::Slice<const int32_t> tag{atom->tag, static_cast<size_t>(all)};
  const rust::Slice<const int32_t> kind{atom->type, static_cast<size_t>(all)};
  if (why_listed.empty()) {
    Extent extent = this->extent();
    const auto images = left_out(extent, request);
    style_densities(**style, extent, images, owned, x, flat(atom->v, all), tag, kind, force->newton_pair,
                    request);
    return;
  }
  collect_pairs();
  densities_of_pairs(**style, owned, x, tag, kind, force->newton_pair, {pair_i.data(), pair_i.size()},
                     {pair_j.data(), pair_j.size()}, {pair_factor.data(), pair_factor.size()});
}

// Slopes from owners to ghosts.
void PairPsi::forward()
{
  const int width = static_cast<int>((*style)->slope_width());
  // Inside a hybrid LAMMPS has sized its buffers before it knew of our columns; those for positions fit.
  const int most = force->pair == this ? width : 3;
  for (first_column = 0; first_column < width; first_column += comm_forward) {
    comm_forward = std::min(most, width - first_column);
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
    if (domain->box_change) check_box();
    if (why_listed.empty() && neighbor->nex_type + neighbor->nex_group + neighbor->nex_mol != rules)
      stop("pairs were excluded after the style was set up, by a fix perhaps: run again");
    if (why_listed.empty() && is_scaled() && is_narrow())
      stop("the box has become narrower than twice the cut-off, where special_bonds needs a neighbor list: run again");
    find_images();
    find_special();
    find_exclusions();
  }

  const size_t owned = atom->nlocal;
  const int all = atom->nlocal + atom->nghost;
  const bool newton = force->newton_pair;
  const auto x = flat(atom->x, all);
  const auto v = flat(atom->v, all);
  const rust::Slice<const int32_t> tag{atom->tag, static_cast<size_t>(all)};
  const rust::Slice<const int32_t> kind{atom->type, static_cast<size_t>(all)};
  Style &fluid = **style;

  Request request;
  // A minimiser goes downhill in U: drag and noise have no place there.
  request.thermostat = fluid.needs_velocities() && !apart && update->whichflag != 2;
  request.seed = seed;
  request.step = static_cast<uint64_t>(update->ntimestep);
  request.dt = update->dt;
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
  strained = images.have_moved(atom, domain);
  const bool alone = !strained && is_alone(box) && attempt([&] { return fluid.fits(box, request); });
  tell_special(alone ? special_owned : special.size());
  Totals totals;
  if (alone) {
    totals = attempt([&] {
      return style_evaluate(fluid, box, flat(atom->x, owned), flat(atom->v, owned), {atom->tag, owned},
                            {atom->type, owned}, request, f);
    });
    without_slopes = {atom->nlocal, atom->nghost};
  } else {
    attempt([&] { find_densities(all, request); });
    forward();
    totals = attempt([&] { return style_forces(fluid, owned, x, v, tag, kind, request, f); });
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
  const double unit = fluid.energy_unit();
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

// Vectors from owners to ghosts.
void PairPsi::forward_vectors()
{
  carries = Carries::vectors;
  comm_forward = 3;
  forward_values(comm, this, 0);
  carries = Carries::slopes;
}

std::string PairPsi::why_not_apart() const
{
  if (!why_listed.empty()) return "pairs come from a neighbor list, because of " + why_listed;
  if (rules > 0) return "neigh_modify excludes pairs, whose drag and noise would have to be left out";
  const double *factor = force->special_lj;
  if (is_scaled() && (factor[1] == 0.0 || factor[2] == 0.0 || factor[3] == 0.0))
    return "special_bonds has factors of 0, for which drag and noise would have to be left out: use 'special_bonds lj "
           "1 1 1'";
  if (domain->deform_vremap) return "fix deform changes velocities at the edges of the box ('remap v')";
  return {};
}

void PairPsi::heat(int groupbit, double time, bool uniform, bool wants_virial, double *virial)
{
  refresh();
  const size_t owned = atom->nlocal;
  const int all = atom->nlocal + atom->nghost;
  masses.resize(owned);
  for (size_t i = 0; i < owned; i++) {
    const double mass = atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]];
    masses[i] = (atom->mask[i] & groupbit) ? mass : HUGE_VAL;
  }
  Heat what;
  what.seed = seed;
  what.step = static_cast<uint64_t>(update->ntimestep);
  what.uniform = uniform;
  what.time = time;
  what.virial = wants_virial;
  Style &fluid = **style;
  Extent box = extent();
  const Request forces{};
  const bool alone = !strained && is_alone(box) && attempt([&] { return fluid.fits(box, forces); });
  rust::Slice<const bool> flags;
  if (!alone) flags = attempt([&] { return left_out(box, forces); });
  const size_t reach = alone ? owned : all;
  const bool acts = attempt([&] {
    return thermostat_pairs(fluid, box, flags, flat(atom->x, static_cast<int>(reach)), {atom->tag, reach},
                            {atom->type, reach}, {masses.data(), owned}, what);
  });
  if (!acts) return;
  rust::Slice<double> v;
  if (owned > 0) v = {atom->v[0], 3 * owned};
  std::array<double, 6> w{};
  if (alone) {
    w = attempt([&] { return thermostat_alone(fluid, v); });
  } else {
    vectors.resize(3 * static_cast<size_t>(all));
    if (owned > 0) std::copy_n(atom->v[0], 3 * owned, vectors.begin());
    forward_vectors();
    const rust::Slice<double> shared{vectors.data(), vectors.size()};
    Round round = attempt([&] { return thermostat_begin(fluid, {vectors.data(), vectors.size()}); });
    while (round.wants != Wants::Nothing) {
      double total = 0.0;
      if (round.wants == Wants::Total)
        MPI_Allreduce(&round.part, &total, 1, MPI_DOUBLE, MPI_SUM, world);
      else
        forward_vectors();
      round = attempt([&] { return thermostat_go_on(fluid, total, shared, v); });
    }
    w = round.virial;
  }
  for (int k = 0; k < 6; k++) virial[k] += w[k];
}

int PairPsi::pack_forward_comm(int n, int *list, double *buf, int pbc_flag, int *pbc)
{
  if (carries == Carries::images) {
    images.pack(n, list, buf, pbc_flag, pbc);
    return n;
  }
  if (carries == Carries::vectors) {
    for (int i = 0; i < n; i++) buf = std::copy_n(&vectors[3 * list[i]], 3, buf);
    return 3 * n;
  }
  const auto slopes = (*style)->slopes_mut();
  const size_t width = (*style)->slope_width();
  for (int i = 0; i < n; i++)
    for (int k = 0; k < comm_forward; k++) *buf++ = slopes[list[i] * width + first_column + k];
  return n * comm_forward;
}

void PairPsi::unpack_forward_comm(int n, int first, double *buf)
{
  if (carries == Carries::images) {
    images.unpack(n, first, buf);
    return;
  }
  if (carries == Carries::vectors) {
    std::copy_n(buf, 3 * n, vectors.begin() + 3 * first);
    return;
  }
  auto slopes = (*style)->slopes_mut();
  const size_t width = (*style)->slope_width();
  for (int i = first; i < first + n; i++)
    for (int k = 0; k < comm_forward; k++) slopes[i * width + first_column + k] = *buf++;
}

// Whether atoms and ghosts, their types and their distance are those of the last evaluation.
bool PairPsi::is_pair(int i, int j, int itype, int jtype, double rsq) const
{
  const int all = atom->nlocal + atom->nghost;
  if (i < 0 || j < 0 || i >= all || j >= all) return false;
  if (atom->type[i] != itype || atom->type[j] != jtype) return false;
  const double range = (*style)->cutoff();
  double d[3];
  for (int k = 0; k < 3; k++) d[k] = atom->x[i][k] - atom->x[j][k];
  const auto agrees = [&] {
    const double here = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    return std::fabs(here - rsq) <= 1e-9 * std::max(range * range, here);
  };
  if (agrees()) return true;
  // Some callers have found the atom and take the nearest of its images.
  const double *h = domain->h;
  const double edge[3][3] = {{h[0], 0.0, 0.0}, {h[5], h[1], 0.0}, {h[4], h[3], h[2]}};
  for (int k = 2; k >= 0; k--) {
    if (!domain->periodicity[k]) continue;
    const double n = std::round(d[k] / edge[k][k]);
    for (int c = 0; c <= k; c++) d[c] -= n * edge[k][c];
  }
  return agrees();
}

// The energy is that of the terms that belong to pairs, without psi; the force is the whole conservative
// one, with the densities of the last step. Drag and noise are left out, as in LAMMPS's other DPD styles.
double PairPsi::single(int i, int j, int itype, int jtype, double rsq, double, double factor_lj, double &fforce)
{
  // Without densities a pair is a pair wherever its atoms are, and whether they are there at all.
  const bool many_body = (*style)->slope_width() > 0;
  if (many_body && !is_pair(i, j, itype, jtype, rsq))
    stop_here("asked for the energy of a pair that is not there, as of an atom to be inserted or moved: where energies "
              "belong to particles no single pair tells it; fix gcmc and fix widom need full_energy with a many-body "
              "style, and pair_write cannot be used");
  if (many_body && without_slopes == std::array<int, 2>{atom->nlocal, atom->nghost}) {
    without_slopes = {-1, -1};
    attempt([&] { (*style)->fetch_slopes(atom->nlocal + atom->nghost); });
    forward();
  }
  const double r = std::sqrt(rsq);
  const PairValue pair = attempt([&] { return style_single(**style, itype, jtype, i, j, r); });
  fforce = r > 0.0 ? factor_lj * pair.force / r : 0.0;
  return factor_lj * pair.energy;
}

void *PairPsi::extract(const char *what, int &dim)
{
  dim = 0;
  if (strcmp(what, "T") == 0 || strcmp(what, "temperature") == 0) return &temperature;
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
  if (!density) return attempt([&] { return const_cast<double *>((*style)->excess_of_owned().data()); });
  const size_t width = (*style)->variables();
  if (width == 0) return nullptr;
  // Forces may not have needed all of them.
  const size_t all = atom->nlocal + atom->nghost;
  tell_special(special.size());
  attempt([&] { (*style)->sum_densities(atom->nlocal, flat(atom->x, all), {atom->tag, all}, {atom->type, all}); });
  const auto densities = (*style)->densities_of_owned();
  double *first = const_cast<double *>(densities.data());
  if (width == 1) return first;
  columns = static_cast<int>(width);
  density_rows.resize(densities.size() / width + 1);
  for (size_t i = 0; i < density_rows.size(); i++) density_rows[i] = first + i * width;
  return density_rows.data();
}

// The temperature may have been changed since pair_style gave it.
void PairPsi::write_restart_settings(FILE *fp)
{
  auto now = arguments;
  if (!now.empty()) now[0] = exact(temperature);
  write_texts(fp, now);
}

void PairPsi::read_restart_settings(FILE *fp)
{
  auto texts = read_texts(fp, lmp);
  std::vector<char *> words;
  for (auto &text : texts) words.push_back(&text[0]);
  settings(static_cast<int>(words.size()), words.data());
}

void PairPsi::write_restart(FILE *fp)
{
  write_restart_settings(fp);
  write_texts(fp, coefficients());
}

void PairPsi::read_restart(FILE *fp)
{
  read_restart_settings(fp);
  if (!allocated) allocate();
  restore(read_texts(fp, lmp));
}

double PairPsi::memory_usage()
{
  double bytes = Pair::memory_usage();
  bytes += (pair_i.capacity() + pair_j.capacity()) * sizeof(int32_t) + pair_factor.capacity() * sizeof(double);
  bytes += special.capacity() * sizeof(SpecialPair) + marks.capacity() * sizeof(uint32_t);
  bytes += (vectors.capacity() + masses.capacity()) * sizeof(double);
  if (style) bytes += static_cast<double>((*style)->memory());
  return bytes;
}
