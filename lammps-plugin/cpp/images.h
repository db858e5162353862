/* Which ghosts are images of atoms that this rank has, and whether they are still where those atoms say. */

#ifndef PSIDPD_IMAGES_H
#define PSIDPD_IMAGES_H

#include <array>
#include <memory>
#include <vector>

namespace LAMMPS_NS {
class Atom;
class Domain;
}    // namespace LAMMPS_NS

namespace psidpd {

class Images {
 public:
  // Starts a communication that carries one number for each ghost. Stores along which directions this
  // rank has all of the box, and how many atoms and ghosts it has.
  void begin(const std::array<bool, 3> &closed, int owned, int ghosts);
  // LAMMPS's communication calls these. The rank itself packs and unpacks images along closed directions.
  void pack(int n, const int *list, double *buf, int pbc_flag, const int *pbc);
  void unpack(int n, int first, const double *buf);

  // Whether the stored flags belong to this number of ghosts and to these closed directions.
  bool know(const std::array<bool, 3> &closed, int ghosts) const { return closed == along && ghosts == told; }
  // For each ghost whether it is an image along a closed direction.
  const bool *flags() const { return image.get(); }

  // Whether an image is no longer a period from its atom: some commands strain atoms and ghosts, and
  // keep the box. Only a few images of each side are checked.
  bool have_moved(const LAMMPS_NS::Atom *atom, const LAMMPS_NS::Domain *domain) const;

 private:
  // A ghost, the atom that it is an image of, and the number of periods between them: x, y, z, yz, xz, xy.
  struct Watched {
    int ghost, of;
    std::array<int, 6> periods;
  };

  std::array<bool, 3> along{};
  int told = 0, owned = 0, room = 0;
  std::unique_ptr<bool[]> image;
  std::vector<Watched> watched;
  // Images of the swap that is being packed, numbered from the first ghost of it.
  std::vector<Watched> packed;
};

}    // namespace psidpd

#endif
