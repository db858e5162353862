#include "ghost_reach.h"

#include "atom.h"
#include "neighbor.h"

#include <cmath>

using namespace LAMMPS_NS;
using namespace psidpd;

void GhostReach::begin(const Atom *atom)
{
  const double *x = atom->nlocal > 0 ? atom->x[0] : nullptr;
  from.assign(x, x + 3 * static_cast<size_t>(atom->nlocal));
}

std::string GhostReach::lost(const Atom *atom, const Neighbor *neighbor) const
{
  if (from.size() != 3 * static_cast<size_t>(atom->nlocal)) return {};
  const double most = 0.25 * neighbor->skin * neighbor->skin;
  for (int i = 0; i < atom->nlocal; i++) {
    double square = 0.0;
    for (int c = 0; c < 3; c++) square += std::pow(atom->x[i][c] - from[3 * static_cast<size_t>(i) + c], 2);
    if (square > most)
      return "atom " + std::to_string(atom->tag[i]) + " has moved by " + std::to_string(std::sqrt(square)) +
          " since ghost atoms were found, more than half the skin of " + std::to_string(neighbor->skin) +
          ", and 'neigh_modify check no' has LAMMPS not look";
  }
  return {};
}
