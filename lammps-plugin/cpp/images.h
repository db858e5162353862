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
  // Begins anew, before a communication that carries one number for each ghost: along which directions this rank has
  // all of the box, and how many atoms and ghosts it has.
  void begin(const std::array<bool, 3> &closed, int owned, int ghosts);
  // What the communication calls. Images along closed directions are packed and unpacked by the rank itself.
  void pack(int n, const int *list, double *buf, int pbc_flag, const int *pbc);
  void unpack(int n, int first, const double *buf);

  // Whether what was told is of so many ghosts, and of these closed directions.
  bool know(const std::array<bool, 3> &closed, int ghosts) const { return closed == along && ghosts == told; }
  // For each ghost whether it is an image along a closed direction.
  const bool *flags() const { return image.get(); }

  // Whether images are elsewhere than a period from their atoms: some commands strain atoms and ghosts, and leave
  // the box as it is. A few of every side are looked at.
  bool have_moved(const LAMMPS_NS::Atom *atom, const LAMMPS_NS::Domain *domain) const;

 private:
  // A ghost, what it is an image of, and how many periods apart they are: x, y, z, yz, xz, xy.
  struct Watched {
    int ghost, of;
    std::array<int, 6> periods;
  };

  std::array<bool, 3> along{};
  int told = 0, owned = 0, room = 0;
  std::unique_ptr<bool[]> image;
  std::vector<Watched> watched;
  // Those of the swap that is being packed, numbered from the first ghost of it.
  std::vector<Watched> packed;
};

}    // namespace psidpd

#endif
