/* Registers styles in a LAMMPS that has no plugin command. */

#include "force.h"
#include "lammps.h"
#include "modify.h"

#include <cstring>
#include <string>

using namespace LAMMPS_NS;

// Does what LAMMPS's own plugin command does: stores a creator. LAMMPS calls the creator of a pair style with
// the instance, and it returns a Pair; that of a fix style also takes the arguments, and returns a Fix.
extern "C" void psidpd_insert_style(void *lmp, const char *kind, const char *name, void (*creator)())
{
  auto *lammps = static_cast<LAMMPS *>(lmp);
  if (strcmp(kind, "fix") == 0)
    (*lammps->modify->fix_map)[name] = reinterpret_cast<Modify::FixCreator>(creator);
  else
    (*lammps->force->pair_map)[name] = reinterpret_cast<Force::PairCreator>(creator);
}
