/* Pairs that neigh_modify, or a hybrid, excludes from the style. */

#ifndef PSIDPD_EXCLUSIONS_H
#define PSIDPD_EXCLUSIONS_H

#include "psidpd-lammps/src/bridge.rs.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace LAMMPS_NS {
class Atom;
class Group;
class Neighbor;
}    // namespace LAMMPS_NS

namespace psidpd {

class Exclusions {
 public:
  // Most rules of neigh_modify for types and groups: a word has room for the two sides of each.
  static constexpr int most_rules = 16;

  // Stores at the setup of the style how many rules there are; `types` is the number of atom types.
  void begin(const LAMMPS_NS::Neighbor *neighbor, int types);
  // Number of pairs of types, groups and molecules that neigh_modify excluded at setup.
  int rules() const { return rules_at_setup; }
  // Whether there are as many rules as at setup.
  bool are_known(const LAMMPS_NS::Neighbor *neighbor) const { return count(neighbor) == rules_at_setup; }
  // Whether any pairs are excluded; all ranks agree.
  bool exclude(int **setflag) const { return rules_at_setup > 0 || !pairs_elsewhere(setflag).empty(); }
  // LAMMPS asked for the cut-off of a pair of types: a hybrid asks for its own pairs only.
  void ask(int i, int j) { asked[static_cast<size_t>(i - 1) * types + j - 1] = 1; }
  // Pairs of types with coefficients that a hybrid gives to other styles alone.
  std::vector<std::array<int, 2>> pairs_elsewhere(int **setflag) const;

  // Marks atoms and ghosts if the exclusions `act`, or none; returns why they cannot be marked, empty if they can.
  std::string find(const LAMMPS_NS::Atom *atom, const LAMMPS_NS::Neighbor *neighbor, const LAMMPS_NS::Group *group,
                   int **setflag, bool act);
  // Passes the marks to the engine, unless it has them.
  void tell(Style &style);
  // A new engine has no exclusions.
  void forget() { told = false; }
  size_t bytes() const { return marks.capacity() * sizeof(uint32_t); }

 private:
  static int count(const LAMMPS_NS::Neighbor *neighbor);

  int types = 0, rules_at_setup = 0;
  std::vector<char> asked;
  // Two words for each atom and ghost: sides of rules for types and groups, and the molecule.
  std::vector<uint32_t> marks;
  bool between_molecules = false, told = false;
};

}    // namespace psidpd

#endif
