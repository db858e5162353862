#include "listed_pairs.h"

#include "atom.h"
#include "force.h"
#include "neigh_list.h"

using namespace LAMMPS_NS;
using namespace psidpd;

Listed ListedPairs::collect(const NeighList *list, const Atom *atom, const Force *force)
{
  const bool scaled = atom->molecular != Atom::ATOMIC;
  i.clear();
  j.clear();
  factors.clear();
  for (int ii = 0; ii < list->inum; ii++) {
    const int first = list->ilist[ii];
    for (int jj = 0; jj < list->numneigh[first]; jj++) {
      const int entry = list->firstneigh[first][jj];
      const int second = entry & NEIGHMASK;
      if (full && second < atom->nlocal && second < first) continue;
      // A factor of 0 is an exclusion, as where LAMMPS leaves the pair out of its list.
      const double factor = force->special_lj[entry >> SBBITS & 3];
      if (factor == 0.0) continue;
      i.push_back(first);
      j.push_back(second);
      if (scaled) factors.push_back(factor);
    }
  }
  Listed listed{};
  listed.i = {i.data(), i.size()};
  listed.j = {j.data(), j.size()};
  listed.factor = {factors.data(), factors.size()};
  return listed;
}

size_t ListedPairs::bytes() const
{
  return (i.capacity() + j.capacity()) * sizeof(int32_t) + factors.capacity() * sizeof(double);
}
