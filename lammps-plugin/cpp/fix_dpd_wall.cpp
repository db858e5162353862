#include "fix_dpd_wall.h"

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
#include <cstdlib>
#include <cstring>
#include <limits>

using namespace LAMMPS_NS;
using namespace FixConst;
using namespace psidpd;

namespace {

const char KEYWORDS[] = "'density', 'type', 'species', 'local/density', 'strength', 'velocity', 'drag', 'drag/range', "
                        "'viscosity' or 'fluid/density'";

std::string name_of(const WallOfFix &wall)
{
  return std::string(1, "xyz"[wall.axis]) + (wall.high ? "hi" : "lo");
}

bool is_number(const char *text)
{
  char *end = nullptr;
  strtod(text, &end);
  return end != text && *end == '\0';
}

}    // namespace

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
  while (k < narg && read_face(arg[k])) k++;
  if (matter.empty()) stop("expected faces of the box, xlo, xhi, ylo, yhi, zlo or zhi" + (k < narg ? std::string(", found '") + arg[k] + "'" : ""));
  while (k < narg) k = read_keyword(k, narg, arg);
  for (WallOfFix &wall : matter) {
    if (!(wall.density > 0.0)) stop("the density of the wall's matter is missing: add 'density RHO'");
    if (wall.viscosity > 0.0 && wall.drag >= 0.0) stop("viscosity determines the drag, and drag is given too: give one of them");
    if (wall.fluid_density > 0.0 && !(wall.viscosity > 0.0)) stop("fluid/density belongs to viscosity, which is not given");
    if (wall.fluid_density == 0.0) wall.fluid_density = wall.density;
    if (wall.velocity[wall.axis] != 0.0) stop("a wall moves along its face only, and " + name_of(wall) + " has a velocity across it");
    if (domain->dimension == 2 && wall.velocity[2] != 0.0) stop("in two dimensions there is no velocity along z");
  }
  check_faces();
  size_vector = size_array_rows = static_cast<int>(matter.size());
  size_array_cols = 3;
  taken.assign(matter.size(), OnWall{});
}

void FixDPDWall::stop(const std::string &text, const char *file, int line)
{
  error->all(file, line, std::string("Fix ") + style + ": " + text);
}

void FixDPDWall::warn(const std::string &text, const char *file, int line)
{
  if (comm->me == 0) error->warning(file, line, std::string("Fix ") + style + ": " + text);
}

bool FixDPDWall::read_face(const std::string &word)
{
  if (word.size() != 3 || word[0] < 'x' || word[0] > 'z') return false;
  const std::string end = word.substr(1);
  if (end != "lo" && end != "hi") return false;
  WallOfFix wall{};
  wall.axis = word[0] - 'x';
  wall.high = end == "hi";
  wall.strength = 1.0;
  wall.drag = wall.drag_range = -1.0;
  const auto is_same = [&](const WallOfFix &other) { return other.axis == wall.axis && other.high == wall.high; };
  if (std::any_of(matter.begin(), matter.end(), is_same)) stop("face " + word + " is named twice");
  matter.push_back(wall);
  return true;
}

double FixDPDWall::number(const char *text, const std::string &key, bool can_be_zero)
{
  const double value = utils::numeric(FLERR, text, false, lmp);
  if (!std::isfinite(value) || value < 0.0 || (value == 0.0 && !can_be_zero))
    stop(key + " must " + (can_be_zero ? "not be negative" : "be positive") + ", found " + text);
  return value;
}

int FixDPDWall::read_keyword(int k, int narg, char **arg)
{
  const std::string key = arg[k];
  const auto each = [this](auto change) { std::for_each(matter.begin(), matter.end(), change); };
  const int values = key == "velocity" ? 3 : 1;
  if (k + values >= narg)
    stop("keyword '" + key + "' needs " + (values == 1 ? "a value" : "three values"));
  const char *text = arg[k + 1];
  if (key == "density") {
    const double value = number(text, key, false);
    each([=](WallOfFix &wall) { wall.density = value; });
  } else if (key == "type") {
    const int type = utils::inumeric(FLERR, text, false, lmp);
    if (type < 1 || type > atom->ntypes) stop("there is no type " + std::string(text));
    each([=](WallOfFix &wall) { wall.kind = type; });
  } else if (key == "species") {
    const rust::String name = rust::String::lossy(text);
    each([&](WallOfFix &wall) { wall.species = name; });
  } else if (key == "local/density") {
    rust::Vec<double> all;
    for (; k + 1 < narg && (all.empty() || is_number(arg[k + 1])); k++) all.push_back(number(arg[k + 1], key, false));
    each([&](WallOfFix &wall) { wall.local_densities = all; });
    return k + 1;
  } else if (key == "strength") {
    const double value = number(text, key, true);
    each([=](WallOfFix &wall) { wall.strength = value; });
  } else if (key == "velocity") {
    std::array<double, 3> velocity{};
    for (int c = 0; c < 3; c++) {
      velocity[c] = utils::numeric(FLERR, arg[k + 1 + c], false, lmp);
      if (!std::isfinite(velocity[c])) stop(std::string("velocity must be finite, found ") + arg[k + 1 + c]);
    }
    each([=](WallOfFix &wall) { wall.velocity = velocity; });
  } else if (key == "drag") {
    const double value = number(text, key, true);
    each([=](WallOfFix &wall) { wall.drag = value; });
  } else if (key == "drag/range") {
    const double value = number(text, key, false);
    each([=](WallOfFix &wall) { wall.drag_range = value; });
  } else if (key == "viscosity") {
    const double value = number(text, key, false);
    each([=](WallOfFix &wall) { wall.viscosity = value; });
  } else if (key == "fluid/density") {
    const double value = number(text, key, false);
    each([=](WallOfFix &wall) { wall.fluid_density = value; });
  } else {
    stop("unknown keyword '" + key + "': expected " + KEYWORDS);
  }
  return k + 1 + values;
}

void FixDPDWall::check_faces()
{
  for (const WallOfFix &wall : matter) {
    const int axis = static_cast<int>(wall.axis);
    const std::string face = name_of(wall);
    if (axis >= domain->dimension) stop("a box of two dimensions has no face " + face);
    if (domain->periodicity[axis]) stop("the box is periodic across face " + face + ": a wall needs a 'boundary' of f there");
    if (domain->boundary[axis][wall.high] != 1)
      stop("face " + face + " follows the atoms: a wall needs a 'boundary' of f there, not s or m");
    // LAMMPS tilts a box along periodic directions only: the planes between the faces of z are across z.
    if (domain->triclinic && axis != 2) stop("in a tilted box only zlo and zhi can be walls, found " + face);
  }
}

void FixDPDWall::init()
{
  std::string why;
  pair = PairPsi::only(force, why);
  if (!pair) stop("needs pair_style dpd/psi, mdpd/psi or dpd/spline, whose atoms feel the wall" + why);
  if (force->pair_style && strcmp(force->pair_style, "hybrid/scaled") == 0)
    stop("pair_style hybrid/scaled scales the forces of walls too, and not what this fix reports: use hybrid or hybrid/overlay");
  check_faces();
  check_others();
  given.assign(3 * pair->walls().size(), 0.0);
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
  bool keeps = false;
  for (int k = 0; k < modify->nfix; k++) {
    const Fix *other = modify->fix[k];
    const std::string name = std::string("fix ") + other->id + " (" + other->style + ")";
    keeps = keeps || strncmp(other->style, "wall/", 5) == 0 || strcmp(other->style, "indent") == 0;
    const auto begins = [&](const char *with) { return strncmp(other->style, with, strlen(with)) == 0; };
    if ((other->rigid_flag || begins("shake") || begins("rattle")) && shares_atoms(other))
      stop(name + " keeps atoms of the group together, and drag and noise of the wall act on each by itself: leave them out of the group");
    for (const WallOfFix &one : matter)
      if (other->box_change & (Fix::BOX_CHANGE_X << one.axis)) stop("face " + name_of(one) + " moves, as " + name + " changes the box along it");
    const auto *wall = dynamic_cast<const FixDPDWall *>(other);
    if (!wall || wall == this) continue;
    for (const WallOfFix &one : matter)
      for (const WallOfFix &two : wall->matter)
        if (one.axis == two.axis && one.high == two.high) stop("face " + name_of(one) + " has a wall of " + name + " too");
  }
  if (keeps || warned || update->whichflag == 2) return;
  warned = true;
  std::string faces;
  for (const WallOfFix &wall : matter) faces += " " + name_of(wall) + " EDGE";
  warn("nothing keeps atoms from going through the face, and LAMMPS loses those that do: add 'fix ID all wall/reflect" + faces + "'");
}

int FixDPDWall::setmask()
{
  return POST_FORCE | MIN_POST_FORCE | END_OF_STEP;
}

void FixDPDWall::setup(int vflag)
{
  friction = {};
  std::fill(given.begin(), given.end(), 0.0);
  post_force(vflag);
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
  for (size_t k = 0; k < taken.size(); k++) virial[matter[k].axis] += taken[k].virial;
}

void FixDPDWall::end_of_step()
{
  if (!pair || update->whichflag != 1) return;
  const int owned = atom->nlocal;
  masses.assign(owned, std::numeric_limits<double>::infinity());
  for (int i = 0; i < owned; i++)
    if (atom->mask[i] & groupbit) masses[i] = force->mvv2e * (atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]]);
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
  const double mine = (matter[n].high ? 1.0 : -1.0) * taken[n].force;
  double all = 0.0;
  MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_SUM, world);
  return all;
}

double FixDPDWall::compute_array(int i, int j)
{
  const size_t k = 3 * static_cast<size_t>(first + i) + j;
  const double mine = k < given.size() ? given[k] : 0.0;
  double all = 0.0;
  MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_SUM, world);
  return all + (static_cast<size_t>(j) == matter[i].axis ? compute_vector(i) : 0.0);
}

extern "C" void *psidpd_create_dpd_wall(void *lmp, int narg, char **arg)
{
  return static_cast<Fix *>(new FixDPDWall(static_cast<LAMMPS *>(lmp), narg, arg));
}
