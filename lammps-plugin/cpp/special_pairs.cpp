#include "special_pairs.h"

#include "atom.h"
#include "force.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace psidpd;

// Molecules of a template have their neighbors there, and delete_bonds may leave neighbors without bonds.
void SpecialPairs::begin(const Atom *atom, MPI_Comm world)
{
  int here = atom->molecular == Atom::TEMPLATE;
  for (int i = 0; atom->molecular == Atom::MOLECULAR && atom->nspecial && i < atom->nlocal; i++) here |= atom->nspecial[i][2] > 0;
  int any = 0;
  MPI_Allreduce(&here, &any, 1, MPI_INT, MPI_MAX, world);
  bonded = any != 0;
}

// A fix may make the first bond later.
bool SpecialPairs::are_scaled(const Atom *atom, const Force *force) const
{
  const double *factor = force->special_lj;
  return atom->molecular != Atom::ATOMIC && (bonded || atom->nbonds > 0) &&
      (factor[1] != 1.0 || factor[2] != 1.0 || factor[3] != 1.0);
}

// Collects each pair once if both atoms are of this rank, and otherwise with all ghosts of the second atom;
// the engine uses the nearest ghost.
void SpecialPairs::find(Atom *atom, const Force *force, bool act)
{
  pairs.clear();
  of_owned = 0;
  forget();
  if (!act || !are_scaled(atom, force)) return;
  const int owned = atom->nlocal;
  const int *next_image = atom->sametag;
  std::vector<SpecialPair> with_ghosts;
  for (int i = 0; i < owned; i++) {
    const tagint *neighbors = atom->special[i];
    const int *count = atom->nspecial[i];
    for (int k = 0; k < count[2]; k++) {
      const double factor = force->special_lj[k < count[0] ? 1 : k < count[1] ? 2 : 3];
      // In a ring two atoms may be neighbors along two paths: the shorter path counts.
      if (factor == 1.0 || std::find(neighbors, neighbors + k, neighbors[k]) != neighbors + k) continue;
      for (int j = atom->map(neighbors[k]); j >= 0; j = next_image[j])
        if (j >= owned)
          with_ghosts.push_back({i, j, factor});
        else if (i < j)
          pairs.push_back({i, j, factor});
    }
  }
  of_owned = pairs.size();
  pairs.insert(pairs.end(), with_ghosts.begin(), with_ghosts.end());
}

void SpecialPairs::tell(Style &style, bool owned_alone)
{
  const size_t count = owned_alone ? of_owned : pairs.size();
  if (told == count) return;
  style.set_special_pairs({pairs.data(), count});
  told = count;
}
