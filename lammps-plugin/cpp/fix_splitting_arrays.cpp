// What the fix keeps of each atom: how far it is displaced, or the force that it is held by; how far behind a round wall it would be; and how
// drag and noise push it where its force is set.

#include "fix_splitting.h"

#include "atom.h"
#include "memory.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace psidpd;

FixSplitting::~FixSplitting()
{
  atom->delete_callback(id, Atom::GROW);
  memory->destroy(pushes);
  memory->destroy(beyond);
  memory->destroy(shifts);
}

void FixSplitting::grow_arrays(int most)
{
  memory->grow(pushes, most, 6, "dpd/splitting:pushes");
  memory->grow(beyond, most, 3, "dpd/splitting:beyond");
  if (scheme != Scheme::two_stage) memory->grow(shifts, most, 3, "dpd/splitting:shifts");
  for (; room < most; room++) set_arrays(room);
}

void FixSplitting::set_arrays(int i)
{
  std::fill_n(pushes[i], 6, 0.0);
  std::fill_n(beyond[i], 3, 0.0);
  if (shifts) std::fill_n(shifts[i], 3, 0.0);
}

void FixSplitting::copy_arrays(int from, int to, int)
{
  std::copy_n(pushes[from], 6, pushes[to]);
  std::copy_n(beyond[from], 3, beyond[to]);
  if (shifts) std::copy_n(shifts[from], 3, shifts[to]);
}

int FixSplitting::pack_exchange(int i, double *buf)
{
  double *end = std::copy_n(beyond[i], 3, std::copy_n(pushes[i], 6, buf));
  if (shifts) end = std::copy_n(shifts[i], 3, end);
  return static_cast<int>(end - buf);
}

int FixSplitting::unpack_exchange(int i, double *buf)
{
  std::copy_n(buf, 6, pushes[i]);
  std::copy_n(buf + 6, 3, beyond[i]);
  if (shifts) std::copy_n(buf + 9, 3, shifts[i]);
  return shifts ? 12 : 9;
}

double FixSplitting::memory_usage()
{
  const auto kept = static_cast<double>(home.capacity() + masses.capacity() + covered.capacity());
  return ((shifts ? 12.0 : 9.0) * room + kept) * sizeof(double) + static_cast<double>(held.capacity());
}
