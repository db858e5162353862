// Forces at displaced positions, for the force-gradient step.

#include "fix_splitting.h"
#include "pair_psi.h"
#include "slices.h"

#include "atom.h"
#include "comm.h"
#include "force.h"
#include "memory.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace psidpd;

FixSplitting::~FixSplitting()
{
  if (!shifts) return;
  atom->delete_callback(id, Atom::GROW);
  memory->destroy(shifts);
}

void FixSplitting::keep_shifts()
{
  maxexchange = 3;
  grow_arrays(atom->nmax);
  atom->add_callback(Atom::GROW);
}

void FixSplitting::grow_arrays(int most)
{
  memory->grow(shifts, most, 3, "dpd/splitting:shifts");
}

void FixSplitting::copy_arrays(int from, int to, int)
{
  std::copy_n(shifts[from], 3, shifts[to]);
}

int FixSplitting::pack_exchange(int i, double *buf)
{
  std::copy_n(shifts[i], 3, buf);
  return 3;
}

int FixSplitting::unpack_exchange(int i, double *buf)
{
  std::copy_n(buf, 3, shifts[i]);
  return 3;
}

double FixSplitting::memory_usage()
{
  const auto kept = static_cast<double>(home.capacity() + masses.capacity());
  return ((shifts ? 3.0 * atom->nmax : 0.0) + kept) * sizeof(double) + static_cast<double>(held.capacity());
}

// Displaced atoms never change ranks: LAMMPS would lose them behind a side that is not periodic.
void FixSplitting::compute_displaced_forces()
{
  const double far = gradient * update->dt * update->dt * force->ftm2v;
  const int owned = atom->nlocal;
  if (owned > 0) pair->engine().find_shifts(far, movers(), flat(atom->f, owned), flat_mut(shifts, owned));
  shift();
  if (are_far()) {
    restore();
    find_ghosts_anew();
    shift();
    if (are_far())
      stop("the forces of step " + std::to_string(update->ntimestep) +
           " displace atoms by more than half the skin of " + std::to_string(neighbor->skin) +
           ": use a wider skin (command 'neighbor') or a shorter timestep");
  }
  comm->forward_comm();
  compute_forces(0, 0);
  restore();
}

void FixSplitting::shift()
{
  const int owned = atom->nlocal;
  home.resize(3 * static_cast<size_t>(owned));
  if (home.empty()) return;
  pair->engine().copy(flat(atom->x, owned), {home.data(), home.size()});
  pair->engine().shift(flat(shifts, owned), flat_mut(atom->x, owned));
}

void FixSplitting::restore()
{
  if (!home.empty()) pair->engine().copy({home.data(), home.size()}, flat_mut(atom->x, atom->nlocal));
}
