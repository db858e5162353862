/* Who is missing when atoms are lost: LAMMPS says only how many. */

#ifndef PSIDPD_LOST_ATOMS_H
#define PSIDPD_LOST_ATOMS_H

#include "lmptype.h"

#include <cstdint>
#include <mpi.h>
#include <string>
#include <vector>

namespace LAMMPS_NS {
class Atom;
}    // namespace LAMMPS_NS

namespace psidpd {

class LostAtoms {
 public:
  // Remembers the IDs of the atoms of all ranks.
  void begin(const LAMMPS_NS::Atom *atom, MPI_Comm world);
  // The first time that atoms are lost since then: how many, and which of those remembered.
  std::string missing(const LAMMPS_NS::Atom *atom, MPI_Comm world);

 private:
  // A bit for each ID; empty if IDs are too far apart.
  std::vector<uint64_t> known;
  // How many LAMMPS still counts that were lost before.
  LAMMPS_NS::bigint before = 0;
  bool told = false;
};

}    // namespace psidpd

#endif
