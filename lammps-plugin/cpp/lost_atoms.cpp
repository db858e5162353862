#include "lost_atoms.h"

#include "atom.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace psidpd;

namespace {

constexpr size_t most_named = 5;
// The set of IDs has at most this many words for each atom.
constexpr bigint most_words = 4;

// The IDs of the atoms of all ranks, as a set of bits in `words` words.
std::vector<uint64_t> present(const Atom *atom, MPI_Comm world, size_t words)
{
  std::vector<uint64_t> set(words, 0);
  for (int i = 0; i < atom->nlocal; i++) {
    const auto tag = static_cast<size_t>(atom->tag[i]);
    if (tag / 64 < words) set[tag / 64] |= uint64_t{1} << tag % 64;
  }
  MPI_Allreduce(MPI_IN_PLACE, set.data(), static_cast<int>(words), MPI_UINT64_T, MPI_BOR, world);
  return set;
}

// Number of atoms that LAMMPS counts and that no rank has.
bigint lost(const Atom *atom, MPI_Comm world)
{
  bigint here = atom->nlocal;
  MPI_Allreduce(MPI_IN_PLACE, &here, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  return atom->natoms - here;
}

}    // namespace

void LostAtoms::begin(const Atom *atom, MPI_Comm world)
{
  bigint last = 0;
  for (int i = 0; i < atom->nlocal; i++) last = std::max(last, static_cast<bigint>(atom->tag[i]));
  MPI_Allreduce(MPI_IN_PLACE, &last, 1, MPI_LMP_BIGINT, MPI_MAX, world);
  const bigint words = last / 64 + 1;
  known = present(atom, world, words <= most_words * (atom->natoms + 1) ? static_cast<size_t>(words) : 0);
  before = lost(atom, world);
  told = false;
}

std::string LostAtoms::missing(const Atom *atom, MPI_Comm world)
{
  if (told) return {};
  const bigint more = lost(atom, world) - before;
  if (more <= 0) return {};
  told = true;
  const auto now = present(atom, world, known.size());
  std::string names;
  size_t count = 0;
  for (size_t tag = 0; tag < 64 * known.size(); tag++) {
    const uint64_t bit = uint64_t{1} << tag % 64;
    if (!(known[tag / 64] & ~now[tag / 64] & bit) || ++count > most_named) continue;
    names += (names.empty() ? "" : ", ") + std::to_string(tag);
  }
  std::string text = std::to_string(more) + " of " + std::to_string(atom->natoms) + " atoms are lost";
  if (count > 0) text += ", with the IDs " + names + (count > most_named ? " and others" : "");
  return text;
}
