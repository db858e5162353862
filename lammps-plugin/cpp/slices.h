/* Arrays of LAMMPS as slices of the bridge. */

#ifndef PSIDPD_SLICES_H
#define PSIDPD_SLICES_H

#include "rust/cxx.h"

#include <cstddef>

namespace psidpd {

// LAMMPS keeps an array of triples in one block; an empty array has no first row.
inline rust::Slice<const double> flat(double **rows, int count)
{
  if (count == 0) return {};
  return {rows[0], 3 * static_cast<std::size_t>(count)};
}

inline rust::Slice<double> flat_mut(double **rows, int count)
{
  if (count == 0) return {};
  return {rows[0], 3 * static_cast<std::size_t>(count)};
}

}    // namespace psidpd

#endif
