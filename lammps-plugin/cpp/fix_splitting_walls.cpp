// Round walls that reflect atoms, and walls that are too stiff for the timestep.
//
// LAMMPS does not tell the potential of a wall, but its forces show. Of 10^6 atoms hardly one comes with five times the thermal
// velocity, and a wall gives it twice that when it goes back. Where the force of a wall would give more in one timestep, the atom
// has gone deeper than its energy allows, and leaves with more than it came with.

#include "fix_splitting.h"

#include "fix_dpd_wall.h"
#include "pair_psi.h"
#include "slices.h"

#include "atom.h"
#include "force.h"
#include "modify.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

using namespace LAMMPS_NS;
using namespace FixConst;
using namespace psidpd;

namespace {

// The most that a wall may change a velocity in a timestep, over the thermal velocity.
constexpr double HARDEST = 10.0;

bool is_wall(const char *style) { return strncmp(style, "wall/", 5) == 0 || strncmp(style, "indent", 6) == 0; }

}    // namespace

void FixSplitting::bounce(int part, double kicked)
{
  const int owned = atom->nlocal;
  if (part == 1 && owned > 0) std::fill_n(beyond[0], 3 * static_cast<size_t>(owned), 0.0);
  for (int k = 0; k < modify->nfix; k++)
    if (auto *wall = dynamic_cast<FixDPDWall *>(modify->fix[k]))
      if (modify->fmask[k] & POST_INTEGRATE) wall->reflect(part, kicked, groupbit, flat_mut(beyond, owned));
}

bool FixSplitting::is_watched(int k) const
{
  return (modify->fmask[k] & POST_FORCE) && is_wall(modify->fix[k]->style) && !too_stiff.count(modify->fix[k]->id);
}

void FixSplitting::watch(Fix *wall, int vflag)
{
  const int owned = atom->nlocal;
  covered.clear();
  if (owned > 0) covered.assign(atom->f[0], atom->f[0] + 3 * static_cast<size_t>(owned));
  wall->post_force(vflag);
  const double time = update->dt * force->ftm2v;
  struct {
    double size;
    int tag;
  } hardest{0.0, 0}, all;
  for (int i = 0; i < owned; i++) {
    if (!(atom->mask[i] & wall->groupbit & groupbit)) continue;
    double square = 0.0;
    for (int c = 0; c < 3; c++) {
      const double force_of_wall = atom->f[i][c] - covered[3 * static_cast<size_t>(i) + c];
      square += force_of_wall * force_of_wall;
    }
    const double mass = atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]];
    const double size = time * time * square * force->mvv2e / (mass * pair->kt());
    if (size > hardest.size) hardest = {size, static_cast<int>(atom->tag[i])};
  }
  MPI_Allreduce(&hardest, &all, 1, MPI_DOUBLE_INT, MPI_MAXLOC, world);
  if (!(all.size > HARDEST * HARDEST)) return;
  too_stiff.insert(wall->id);
  char size[32];
  snprintf(size, sizeof size, "%.1f", std::sqrt(all.size));
  warn(std::string("fix ") + wall->id + " (" + wall->style + ") at step " + std::to_string(update->ntimestep) + " pushes atom " +
       std::to_string(all.tag) + " by " + size +
       " thermal velocities in a timestep, more than a wall gives back to any atom: it heats the atoms and may lose them; use a "
       "shorter timestep, a softer wall, or fix wall/reflect");
}

void FixSplitting::watch_walls()
{
  for (int k = 0; k < modify->nfix; k++) {
    if (!is_watched(k)) continue;
    watch(modify->fix[k], 0);
    if (!covered.empty()) std::copy(covered.begin(), covered.end(), atom->f[0]);
  }
}
