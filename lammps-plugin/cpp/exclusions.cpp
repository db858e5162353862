#include "exclusions.h"

#include "atom.h"
#include "group.h"
#include "neighbor.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace psidpd;

int Exclusions::count(const Neighbor *neighbor)
{
  return neighbor->nex_type + neighbor->nex_group + neighbor->nex_mol;
}

void Exclusions::begin(const Neighbor *neighbor, int number_of_types)
{
  types = number_of_types;
  rules_at_setup = count(neighbor);
  asked.assign(static_cast<size_t>(types) * types, 0);
}

std::vector<std::array<int, 2>> Exclusions::pairs_elsewhere(int **setflag) const
{
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

std::string Exclusions::find(const Atom *atom, const Neighbor *neighbor, const Group *group, int **setflag, bool act)
{
  marks.clear();
  forget();
  const auto elsewhere = pairs_elsewhere(setflag);
  const bool none = !act || (rules_at_setup == 0 && elsewhere.empty());
  if (!none && elsewhere.size() + neighbor->nex_type + neighbor->nex_group > most_rules)
    return "the hybrid gives " + std::to_string(elsewhere.size()) + " pairs of its types to other styles; with the "
           "exclusions of neigh_modify at most " + std::to_string(most_rules) + " pairs can be left out";
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
  return {};
}

void Exclusions::tell(Style &style)
{
  if (!told) style.set_exclusions({marks.data(), marks.size()}, between_molecules);
  told = true;
}
