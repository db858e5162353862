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

  // Begins the setup of the style; `types` is the number of atom types.
  void begin(int types);
  // Number of pairs of types of the style, of groups and of molecules that are excluded now. Fixes add to them when LAMMPS sets
  // them up, after the pair styles.
  int rules(const LAMMPS_NS::Neighbor *neighbor, int **setflag) const;
  // Whether any pairs are excluded; all ranks agree.
  bool exclude(const LAMMPS_NS::Neighbor *neighbor, int **setflag) const
  {
    return rules(neighbor, setflag) > 0 || !pairs_elsewhere(setflag).empty();
  }
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
  // Whether the style has coefficients for a type.
  bool knows(int type, int **setflag) const;
  // Excluded pairs of types that the style knows, each once: fix srp excludes its own anew in each run.
  std::vector<std::array<int, 2>> pairs_of_types(const LAMMPS_NS::Neighbor *neighbor, int **setflag) const;

  int types = 0;
  std::vector<char> asked;
  // Two words for each atom and ghost: sides of rules for types and groups, and the molecule.
  std::vector<uint32_t> marks;
  bool between_molecules = false, told = false;
};

}    // namespace psidpd

#endif
