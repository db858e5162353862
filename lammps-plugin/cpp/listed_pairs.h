/* The pairs of a neighbor list of LAMMPS. */

#ifndef PSIDPD_LISTED_PAIRS_H
#define PSIDPD_LISTED_PAIRS_H

#include "psidpd-lammps/src/bridge.rs.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace LAMMPS_NS {
class Atom;
class Force;
class NeighList;
}    // namespace LAMMPS_NS

namespace psidpd {

class ListedPairs {
 public:
  // Whether the list is full: it has each pair of owned atoms twice.
  bool full = true;

  // Reads the pairs of the list; a pair of two owned atoms occurs once.
  Listed collect(const LAMMPS_NS::NeighList *list, const LAMMPS_NS::Atom *atom, const LAMMPS_NS::Force *force);
  size_t bytes() const;

 private:
  std::vector<int32_t> i, j;
  std::vector<double> factors;
};

}    // namespace psidpd

#endif
