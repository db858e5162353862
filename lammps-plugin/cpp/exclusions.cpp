#include "exclusions.h"

#include "atom.h"
#include "group.h"
#include "neighbor.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace psidpd;

void Exclusions::begin(int number_of_types)
{
  types = number_of_types;
  asked.assign(static_cast<size_t>(types) * types, 0);
}

bool Exclusions::knows(int type, int **setflag) const
{
  for (int j = 1; setflag && j <= types; j++)
    if (setflag[std::min(type, j)][std::max(type, j)]) return true;
  return false;
}

std::vector<std::array<int, 2>> Exclusions::pairs_of_types(const Neighbor *neighbor, int **setflag) const
{
  std::vector<std::array<int, 2>> found;
  for (int k = 0; k < neighbor->nex_type; k++) {
    const int one = neighbor->ex1_type[k], other = neighbor->ex2_type[k];
    const std::array<int, 2> pair{std::min(one, other), std::max(one, other)};
    if (knows(pair[0], setflag) && knows(pair[1], setflag) && std::find(found.begin(), found.end(), pair) == found.end())
      found.push_back(pair);
  }
  return found;
}

int Exclusions::rules(const Neighbor *neighbor, int **setflag) const
{
  return static_cast<int>(pairs_of_types(neighbor, setflag).size()) + neighbor->nex_group + neighbor->nex_mol;
}

std::vector<std::array<int, 2>> Exclusions::pairs_elsewhere(int **setflag) const
{
  std::vector<std::array<int, 2>> found;
  for (int i = 1; i <= types; i++)
    for (int j = i; j <= types; j++)
      if (!asked[static_cast<size_t>(i - 1) * types + j - 1] && knows(i, setflag) && knows(j, setflag)) found.push_back({i, j});
  return found;
}

std::string Exclusions::find(const Atom *atom, const Neighbor *neighbor, const Group *group, int **setflag, bool act)
{
  marks.clear();
  forget();
  const auto elsewhere = pairs_elsewhere(setflag);
  auto pairs = elsewhere;
  for (const auto &pair : pairs_of_types(neighbor, setflag)) pairs.push_back(pair);
  const bool none = !act || !exclude(neighbor, setflag);
  if (!none && (pairs.size() + neighbor->nex_group > most_rules || neighbor->nex_mol > 1))
    return elsewhere.empty() ? "pairs were excluded after the setup of the style, perhaps by a fix, and are more than it can keep: run again"
                             : "the hybrid gives " + std::to_string(elsewhere.size()) +
            " pairs of its types to other styles; with the exclusions of neigh_modify at most " + std::to_string(most_rules) +
            " pairs can be left out";
  const bool by_molecule = !none && neighbor->nex_mol > 0;
  const int all = none ? 0 : atom->nlocal + atom->nghost;
  for (int i = 0; i < all; i++) {
    uint32_t sides = 0, bit = 1;
    const auto add = [&](bool one, bool other) {
      sides |= (one ? bit : 0) | (other ? bit << most_rules : 0);
      bit <<= 1;
    };
    for (const auto &pair : pairs) add(atom->type[i] == pair[0], atom->type[i] == pair[1]);
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
