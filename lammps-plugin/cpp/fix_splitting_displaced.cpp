// Forces at displaced positions, for the force-gradient step.

#include "fix_splitting.h"
#include "pair_psi.h"
#include "slices.h"

#include "atom.h"
#include "comm.h"
#include "force.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace psidpd;

// Displaced atoms never change ranks: LAMMPS would lose them behind a side that is not periodic.
void FixSplitting::compute_displaced_forces()
{
  const double far = gradient * update->dt * update->dt * force->ftm2v;
  const int owned = atom->nlocal;
  if (owned > 0) pair->engine().find_shifts(far, movers(), flat(atom->f, owned), flat_mut(shifts, owned));
  pair->displace(true);
  shift();
  if (are_far()) {
    restore();
    pair->displace(false);
    find_ghosts_anew();
    pair->displace(true);
    shift();
    if (are_far())
      stop("the forces of step " + std::to_string(update->ntimestep) +
           " displace atoms by more than half the skin of " + std::to_string(neighbor->skin) +
           ": use a wider skin (command 'neighbor') or a shorter timestep");
  }
  comm->forward_comm();
  compute_forces(0, 0);
  restore();
  pair->displace(false);
}

void FixSplitting::shift()
{
  const int owned = atom->nlocal;
  home.resize(3 * static_cast<size_t>(owned));
  if (home.empty()) return;
  pair->engine().copy(flat(atom->x, owned), {home.data(), home.size()});
  pair->engine().shift(flat(shifts, owned), flat_mut(atom->x, owned));
  pair->mirror();
}

void FixSplitting::restore()
{
  if (!home.empty()) pair->engine().copy({home.data(), home.size()}, flat_mut(atom->x, atom->nlocal));
}
