/* Whether ghosts still reach as far as they must, where LAMMPS is told not to check it. */

#ifndef PSIDPD_GHOST_REACH_H
#define PSIDPD_GHOST_REACH_H

#include <string>
#include <vector>

namespace LAMMPS_NS {
class Atom;
class Neighbor;
}    // namespace LAMMPS_NS

namespace psidpd {

class GhostReach {
 public:
  // Remembers where this rank's atoms are, as ghosts have been found there.
  void begin(const LAMMPS_NS::Atom *atom);
  // Describes an atom that has gone more than half the skin since then; empty if there is none.
  std::string lost(const LAMMPS_NS::Atom *atom, const LAMMPS_NS::Neighbor *neighbor) const;
  double bytes() const { return static_cast<double>(from.capacity() * sizeof(double)); }

 private:
  std::vector<double> from;
};

}    // namespace psidpd

#endif
