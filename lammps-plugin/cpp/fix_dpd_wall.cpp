#include "fix_dpd_wall.h"

#include "fix_splitting.h"
#include "pair_psi.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "modify.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

using namespace LAMMPS_NS;
using namespace FixConst;
using namespace psidpd;

FixDPDWall::FixDPDWall(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg)
{
  dynamic_group_allow = 1;
  // Energies and forces are those of the last evaluation, and energy and virial belong to the system where fix_modify says so.
  scalar_flag = vector_flag = array_flag = 1;
  extscalar = extvector = extarray = 1;
  energy_global_flag = virial_global_flag = 1;
  global_freq = 1;
  nevery = 1;
  std::fill_n(virial, 6, 0.0);

  int k = 3;
  while (k < narg && (read_face(arg[k]) || read_round(k, narg, arg))) k++;
  if (matter.empty())
    stop("expected faces of the box, xlo, xhi, ylo, yhi, zlo or zhi, or a cylinder or a sphere" +
         (k < narg ? std::string(", found '") + arg[k] + "'" : ""));
  while (k < narg) k = read_keyword(k, narg, arg);
  for (WallOfFix &wall : matter) {
    if (!(wall.density > 0.0)) stop("the density of the wall's matter is missing: add 'density RHO'");
    if (wall.viscosity > 0.0 && wall.drag >= 0.0) stop("viscosity determines the drag, and drag is given too: give one of them");
    if (wall.fluid_density > 0.0 && !(wall.viscosity > 0.0)) stop("fluid/density belongs to viscosity, which is not given");
    if (wall.fluid_density == 0.0) wall.fluid_density = wall.density;
    for (int c = 0; c < 3; c++)
      if (wall.velocity[c] != 0.0 && is_across(wall, c))
        stop(wall.shape == Shape::Face ? "a wall moves along its face only, and " + name_of(wall) + " has a velocity across it"
                                       : "a cylinder moves along its axis only, and a sphere not at all");
    if (domain->dimension == 2 && wall.velocity[2] != 0.0) stop("in two dimensions there is no velocity along z");
  }
  check_surfaces();
  size_vector = size_array_rows = static_cast<int>(matter.size());
  size_array_cols = 3;
  taken.assign(matter.size(), OnWall{});
  pushed.assign(4 * matter.size(), 0.0);
}

void FixDPDWall::stop(const std::string &text, const char *file, int line)
{
  error->all(file, line, std::string("Fix ") + style + ": " + text);
}

void FixDPDWall::warn(const std::string &text, const char *file, int line)
{
  if (comm->me == 0) error->warning(file, line, std::string("Fix ") + style + ": " + text);
}

void FixDPDWall::init()
{
  std::string why;
  pair = PairPsi::only(force, why);
  if (!pair) stop("needs pair_style dpd/psi, mdpd/psi or dpd/spline, whose atoms feel the wall" + why);
  if (force->pair_style && strcmp(force->pair_style, "hybrid/scaled") == 0)
    stop("pair_style hybrid/scaled scales the forces of walls too, and not what this fix reports: use hybrid or hybrid/overlay");
  check_surfaces();
  check_others();
  given.assign(3 * pair->walls().size(), 0.0);
  pushed.assign(4 * matter.size(), 0.0);
  taken.assign(matter.size(), OnWall{});
  friction = {};
  std::fill_n(virial, 6, 0.0);
}

// Whether atoms of the group are in the group of another fix.
bool FixDPDWall::shares_atoms(const Fix *other) const
{
  const auto is_shared = [=](int mask) { return (mask & groupbit) && (mask & other->groupbit); };
  int mine = std::any_of(atom->mask, atom->mask + atom->nlocal, is_shared), any = 0;
  MPI_Allreduce(&mine, &any, 1, MPI_INT, MPI_MAX, world);
  return any;
}

// Whether fixes beside it can work, and whether atoms are kept from going through the face.
void FixDPDWall::check_others()
{
  if (update->whichflag == 1 && strcmp(update->integrate_style, "verlet") != 0)
    stop(std::string("works with 'run_style verlet' only, found '") + update->integrate_style + "'");
  splits = false;
  bool keeps = std::all_of(matter.begin(), matter.end(), [](const WallOfFix &wall) { return wall.shape != Shape::Face; });
  for (int k = 0; k < modify->nfix; k++) {
    const Fix *other = modify->fix[k];
    const std::string name = std::string("fix ") + other->id + " (" + other->style + ")";
    keeps = keeps || strncmp(other->style, "wall/", 5) == 0 || strcmp(other->style, "indent") == 0;
    const auto begins = [&](const char *with) { return strncmp(other->style, with, strlen(with)) == 0; };
    if ((other->rigid_flag || begins("shake") || begins("rattle")) && shares_atoms(other))
      stop(name + " keeps atoms of the group together, and drag and noise of the wall act on each by itself: leave them out of the group");
    splits = splits || dynamic_cast<const FixSplitting *>(other);
    for (const WallOfFix &one : matter)
      for (int c = 0; c < 3; c++)
        if (is_across(one, c) && (other->box_change & (Fix::BOX_CHANGE_X << c)))
          stop(one.shape == Shape::Face ? "face " + name_of(one) + " moves, as " + name + " changes the box along it"
                                        : "a " + name_of(one) + " stays as it is, and " + name + " changes the box across it");
    const auto *wall = dynamic_cast<const FixDPDWall *>(other);
    if (!wall || wall == this) continue;
    for (const WallOfFix &one : matter)
      for (const WallOfFix &two : wall->matter)
        if (is_same_face(one, two)) stop("face " + name_of(one) + " has a wall of " + name + " too");
  }
  if (keeps || warned || update->whichflag == 2) return;
  warned = true;
  std::string faces;
  for (const WallOfFix &wall : matter)
    if (wall.shape == Shape::Face) faces += " " + name_of(wall) + " EDGE";
  warn("nothing keeps atoms from going through the face, and LAMMPS loses those that do: add 'fix ID all wall/reflect" + faces + "'");
}

int FixDPDWall::setmask()
{
  const bool reflects = std::any_of(matter.begin(), matter.end(), [](const WallOfFix &wall) { return wall.shape != Shape::Face; });
  return POST_FORCE | MIN_POST_FORCE | END_OF_STEP | (reflects ? POST_INTEGRATE : 0);
}

void FixDPDWall::setup(int vflag)
{
  friction = {};
  std::fill(given.begin(), given.end(), 0.0);
  std::fill(pushed.begin(), pushed.end(), 0.0);
  if (update->whichflag == 1) check_atoms();
  post_force(vflag);
}

// Whether an atom is where no reflection leads out of.
void FixDPDWall::check_atoms()
{
  const int64_t mine = pair->find_in_matter();
  int64_t one = -1;
  MPI_Allreduce(&mine, &one, 1, MPI_INT64_T, MPI_MAX, world);
  if (one >= 0) stop("atom " + std::to_string(one) + " is in the matter of a cylinder or a sphere: move it to the side of the fluid, or delete it");
}

// Fixes that integrate have moved atoms by dt v, after half a kick.
void FixDPDWall::post_integrate()
{
  if (!pair) stop("LAMMPS has not set it up: 'run N pre no' cannot follow a new fix");
  if (splits) return;
  reflect(0, 0.5 * update->dt, ~0, {});
}

void FixDPDWall::reflect(int part, double kicked, int moved, rust::Slice<double> left)
{
  if (part < 2) std::fill(pushed.begin(), pushed.end(), 0.0);
  find_masses(groupbit, moved);
  pair->bounce(masses, {part, kicked}, first, pushed, left);
}

// Energies over squared velocities; infinite for atoms that are left as they are.
void FixDPDWall::find_masses(int group, int other)
{
  const int owned = atom->nlocal;
  masses.assign(owned, std::numeric_limits<double>::infinity());
  for (int i = 0; i < owned; i++)
    if ((atom->mask[i] & group) && (atom->mask[i] & other))
      masses[i] = force->mvv2e * (atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]]);
}

void FixDPDWall::post_force(int vflag)
{
  v_init(vflag);
  // Kept for what asks for it between runs, when the pair style may be another.
  const auto all = pair->engine().on_walls();
  const size_t end = std::min(all.size(), first + matter.size());
  taken.assign(all.begin() + std::min<size_t>(first, end), all.begin() + end);
  taken.resize(matter.size());
  show_virial();
}

void FixDPDWall::show_virial()
{
  std::copy(friction.begin(), friction.end(), virial);
  for (const OnWall &wall : taken)
    for (int c = 0; c < 6; c++) virial[c] += wall.virial[c];
}

void FixDPDWall::end_of_step()
{
  if (!pair || update->whichflag != 1) return;
  find_masses(groupbit, ~0);
  friction = pair->rub(masses, first, static_cast<int>(matter.size()), given);
  show_virial();
}

double FixDPDWall::compute_scalar()
{
  double mine = 0.0, all = 0.0;
  for (const OnWall &wall : taken) mine += wall.energy;
  MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_SUM, world);
  return all;
}

double FixDPDWall::compute_vector(int n)
{
  const OnWall &wall = taken[n];
  const double mine = matter[n].shape == Shape::Face ? wall.vector[matter[n].axis] : wall.force + pushed[4 * n + 3];
  double all = 0.0;
  MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_SUM, world);
  return all;
}

double FixDPDWall::compute_array(int i, int j)
{
  const size_t k = 3 * static_cast<size_t>(first + i) + j;
  const double mine = taken[i].vector[j] + pushed[4 * i + j] + (k < given.size() ? given[k] : 0.0);
  double all = 0.0;
  MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_SUM, world);
  return all;
}

extern "C" void *psidpd_create_dpd_wall(void *lmp, int narg, char **arg)
{
  return static_cast<Fix *>(new FixDPDWall(static_cast<LAMMPS *>(lmp), narg, arg));
}
