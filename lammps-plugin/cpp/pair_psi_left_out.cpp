// Pairs that LAMMPS lists, scales or excludes.

#include "pair_psi.h"

#include "atom.h"
#include "force.h"
#include "group.h"
#include "neigh_list.h"
#include "neighbor.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace psidpd;

// Reads the pairs of LAMMPS's list; a pair of two owned atoms occurs once.
void PairPsi::collect_pairs()
{
  const double *special = force->special_lj;
  const bool scaled = atom->molecular != Atom::ATOMIC;
  const int owned = atom->nlocal;
  pair_i.clear();
  pair_j.clear();
  pair_factor.clear();
  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii];
    for (int jj = 0; jj < list->numneigh[i]; jj++) {
      const int entry = list->firstneigh[i][jj];
      const int j = entry & NEIGHMASK;
      if (full_list && j < owned && j < i) continue;
      // A factor of 0 is an exclusion, as where LAMMPS leaves the pair out of its list.
      const double factor = special[sbmask(entry)];
      if (factor == 0.0) continue;
      pair_i.push_back(i);
      pair_j.push_back(j);
      if (scaled) pair_factor.push_back(factor);
    }
  }
}

// Collects each pair of bonded neighbors once if both atoms are of this rank, and otherwise with all
// ghosts of the second atom; the engine uses the nearest ghost.
void PairPsi::find_special()
{
  special.clear();
  special_owned = 0;
  told_special = SIZE_MAX;
  if (!why_listed.empty() || !is_scaled()) return;
  const int owned = atom->nlocal;
  const int *next_image = atom->sametag;
  const std::array<double, 3> factors{force->special_lj[1], force->special_lj[2], force->special_lj[3]};
  std::vector<SpecialPair> with_ghosts;
  for (int i = 0; i < owned; i++) {
    const tagint *neighbors = atom->special[i];
    const int *count = atom->nspecial[i];
    for (int k = 0; k < count[2]; k++) {
      const double factor = factors[k < count[0] ? 0 : k < count[1] ? 1 : 2];
      // In a ring two atoms may be neighbors along two paths: the shorter path counts.
      if (factor == 1.0 || std::find(neighbors, neighbors + k, neighbors[k]) != neighbors + k) continue;
      for (int j = atom->map(neighbors[k]); j >= 0; j = next_image[j])
        if (j >= owned)
          with_ghosts.push_back({i, j, factor});
        else if (i < j)
          special.push_back({i, j, factor});
    }
  }
  special_owned = special.size();
  special.insert(special.end(), with_ghosts.begin(), with_ghosts.end());
}

std::vector<std::array<int, 2>> PairPsi::pairs_elsewhere() const
{
  const int types = atom->ntypes;
  const auto has_coefficients = [&](int i) {
    for (int j = 1; j <= types; j++)
      if (setflag[std::min(i, j)][std::max(i, j)]) return true;
    return false;
  };
  std::vector<std::array<int, 2>> found;
  for (int i = 1; i <= types; i++)
    for (int j = i; j <= types; j++)
      if (!asked[static_cast<size_t>(i - 1) * types + j - 1] && has_coefficients(i) && has_coefficients(j))
        found.push_back({i, j});
  return found;
}

// Collects the exclusions of neigh_modify, and of a hybrid, as two words for each atom and ghost: sides of rules
// for types and groups, and the molecule.
void PairPsi::find_exclusions()
{
  marks.clear();
  told_marks = false;
  const auto elsewhere = pairs_elsewhere();
  const bool none = !why_listed.empty() || (rules == 0 && elsewhere.empty());
  if (!none && elsewhere.size() + neighbor->nex_type + neighbor->nex_group > most_rules)
    stop("the hybrid gives " + std::to_string(elsewhere.size()) + " pairs of its types to other styles; with the exclusions "
         "of neigh_modify at most " + std::to_string(most_rules) + " pairs can be left out");
  const bool by_molecule = !none && neighbor->nex_mol > 0;
  const int all = none ? 0 : atom->nlocal + atom->nghost;
  for (int i = 0; i < all; i++) {
    uint32_t sides = 0, bit = 1;
    const auto add = [&](bool one, bool other) {
      sides |= (one ? bit : 0) | (other ? bit << most_rules : 0);
      bit <<= 1;
    };
    for (const auto &pair : elsewhere) add(atom->type[i] == pair[0], atom->type[i] == pair[1]);
    for (int k = 0; k < neighbor->nex_type; k++)
      add(atom->type[i] == neighbor->ex1_type[k], atom->type[i] == neighbor->ex2_type[k]);
    for (int k = 0; k < neighbor->nex_group; k++)
      add(atom->mask[i] & group->bitmask[neighbor->ex1_group[k]], atom->mask[i] & group->bitmask[neighbor->ex2_group[k]]);
    const bool counts = by_molecule && (atom->mask[i] & group->bitmask[neighbor->ex_mol_group[0]]);
    marks.push_back(sides);
    marks.push_back(counts ? static_cast<uint32_t>(atom->molecule[i]) + 1 : 0);
  }
  between_molecules = by_molecule && !neighbor->ex_mol_intra[0];
}

// Passes the marks and the first `count` special pairs to the engine, unless it has them.
void PairPsi::tell_special(size_t count)
{
  if (!told_marks) attempt([&] { (*style)->set_exclusions({marks.data(), marks.size()}, between_molecules); });
  told_marks = true;
  if (told_special == count) return;
  attempt([&] { (*style)->set_special_pairs({special.data(), count}); });
  told_special = count;
}
