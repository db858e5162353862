// Walls of matter, which fixes dpd/wall describe and the engine computes.

#include "pair_psi.h"

#include "fix_dpd_wall.h"
#include "slices.h"

#include "atom.h"
#include "fix.h"
#include "force.h"
#include "modify.h"
#include "update.h"

#include <algorithm>
#include <cstring>

using namespace LAMMPS_NS;
using namespace psidpd;

PairPsi *PairPsi::only(Force *force, std::string &why)
{
  PairPsi *found = nullptr;
  for (const char *name : {"dpd/psi", "mdpd/psi", "dpd/spline"}) {
    // A hybrid may contain a style several times: then its numbers count from 1.
    Pair *one = force->pair_match(name, 1, 1);
    if (!one) continue;
    if (found || force->pair_match(name, 1, 2) != one) {
      why = ", and the hybrid contains several";
      return nullptr;
    }
    found = dynamic_cast<PairPsi *>(one);
  }
  return found;
}

int PairPsi::count_walls() const
{
  const auto is_one = [](const Fix *fix) { return strcmp(fix->style, "dpd/wall") == 0; };
  return static_cast<int>(std::count_if(modify->fix, modify->fix + modify->nfix, is_one));
}

int PairPsi::find_walls()
{
  matter.clear();
  int count = 0;
  for (int k = 0; k < modify->nfix; k++) {
    auto *fix = dynamic_cast<FixDPDWall *>(modify->fix[k]);
    if (!fix) continue;
    count++;
    fix->first = static_cast<int>(matter.size());
    matter.insert(matter.end(), fix->walls().begin(), fix->walls().end());
  }
  return count;
}

void PairPsi::set_walls()
{
  if (matter == built_matter) return;
  const bool needs_mass = std::any_of(matter.begin(), matter.end(), [](const WallOfFix &wall) { return wall.viscosity > 0.0; });
  if (needs_mass && !atom->mass)
    complain("fix dpd/wall: viscosity needs masses of types, which this atom style does not have: give the drag instead");
  try {
    (*style)->set_walls({matter.data(), matter.size()}, needs_mass ? mean_mass() : 0.0);
  } catch (const std::exception &e) {
    complain(std::string("fix dpd/wall: ") + e.what());
  }
  built_matter = matter;
}

// Of the types of this style, as an energy over a squared velocity.
double PairPsi::mean_mass() const
{
  double sum = 0.0;
  int count = 0;
  for (int i = 1; i <= atom->ntypes; i++)
    if (setflag[i][i]) {
      sum += atom->mass[i];
      count++;
    }
  return force->mvv2e * sum / std::max(count, 1);
}

std::array<double, 6> PairPsi::rub(const std::vector<double> &masses, int first, int count, std::vector<double> &given_to_walls)
{
  refresh();
  const size_t owned = atom->nlocal;
  Rub what;
  what.seed = given.seed;
  what.step = static_cast<uint64_t>(update->ntimestep);
  what.time = update->dt;
  what.first = static_cast<size_t>(first);
  what.count = static_cast<size_t>(count);
  rust::Slice<double> v;
  if (owned > 0) v = {atom->v[0], 3 * owned};
  return attempt([&] {
    return (*style)->rub(extent(), atoms(owned), {masses.data(), owned}, what, {given_to_walls.data(), given_to_walls.size()}, v);
  });
}

void PairPsi::bounce(const std::vector<double> &masses, const Moved &moved, int first, std::vector<double> &pushed, rust::Slice<double> left)
{
  const int owned = atom->nlocal;
  Drift drift;
  drift.part = static_cast<uint8_t>(moved.part);
  drift.dt = update->dt;
  drift.kicked = moved.kicked;
  drift.first = static_cast<size_t>(first);
  drift.count = pushed.size() / 4;
  drift.mass = {masses.data(), masses.size()};
  drift.f = flat(atom->f, owned);
  attempt([&] {
    (*style)->bounce(extent(), drift, left, {pushed.data(), pushed.size()}, flat_mut(atom->x, owned), flat_mut(atom->v, owned));
  });
}

void PairPsi::mirror()
{
  attempt([&] { (*style)->mirror(extent(), flat_mut(atom->x, atom->nlocal)); });
}

int64_t PairPsi::find_in_matter()
{
  return attempt([&] { return (*style)->find_in_matter(extent(), atoms(atom->nlocal)); });
}
