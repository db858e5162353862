/* Bonded neighbors whose interaction special_bonds scales. */

#ifndef PSIDPD_SPECIAL_PAIRS_H
#define PSIDPD_SPECIAL_PAIRS_H

#include "psidpd-lammps/src/bridge.rs.h"

#include <cstddef>
#include <cstdint>
#include <mpi.h>
#include <vector>

namespace LAMMPS_NS {
class Atom;
class Force;
}    // namespace LAMMPS_NS

namespace psidpd {

class SpecialPairs {
 public:
  // Looks, at the setup of the style, whether any atom has bonded neighbors; all ranks call this.
  void begin(const LAMMPS_NS::Atom *atom, MPI_Comm world);
  // Whether there are bonded neighbors, which special_bonds gives factors other than 1.
  bool are_scaled(const LAMMPS_NS::Atom *atom, const LAMMPS_NS::Force *force) const;

  // Collects the pairs with a factor other than 1 if `act`, or none.
  void find(LAMMPS_NS::Atom *atom, const LAMMPS_NS::Force *force, bool act);
  // Passes all pairs, or those of owned atoms alone, to the engine, unless it has them.
  void tell(Style &style, bool owned_alone);
  // A new engine has no special pairs.
  void forget() { told = SIZE_MAX; }
  size_t bytes() const { return pairs.capacity() * sizeof(SpecialPair); }

 private:
  bool bonded = false;
  // In the first `of_owned` pairs both atoms are of this rank; the others have ghosts.
  std::vector<SpecialPair> pairs;
  size_t of_owned = 0;
  // Number of pairs that the engine has; SIZE_MAX if these are outdated.
  size_t told = SIZE_MAX;
};

}    // namespace psidpd

#endif
