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
  // Describes lost atoms at the first call after a loss: their number, and the remembered IDs among them.
  std::string missing(const LAMMPS_NS::Atom *atom, MPI_Comm world);

 private:
  // A bit for each ID; empty if IDs are too far apart.
  std::vector<uint64_t> known;
  // Number of atoms that were lost before begin() and that LAMMPS still counts.
  LAMMPS_NS::bigint before = 0;
  bool told = false;
};

}    // namespace psidpd

#endif
