/* What a forward communication of the pair style carries from owners to ghosts. */

#ifndef PSIDPD_GHOST_EXCHANGE_H
#define PSIDPD_GHOST_EXCHANGE_H

#include "images.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace psidpd {

class GhostExchange {
 public:
  // Columns of the slopes, flags of images, or vectors.
  enum class Carries { slopes, images, vectors };

  // Which ghosts are images of this rank's atoms.
  Images images;
  // Vectors of atoms and ghosts.
  std::vector<double> vectors;
  // The first column of the slopes that is carried, and how many.
  int first_column = 0, columns = 0;

  // Runs `communicate`, which carries this.
  template <class Communicate>
  void carry(Carries what, Communicate communicate)
  {
    carries = what;
    communicate();
    carries = Carries::slopes;
  }

  // LAMMPS's communication calls these; `slopes` has `width` columns.
  int pack(int n, const int *list, double *buf, int pbc_flag, const int *pbc, const double *slopes, size_t width);
  void unpack(int n, int first, const double *buf, double *slopes, size_t width);

 private:
  Carries carries = Carries::slopes;
};

}    // namespace psidpd

#endif
