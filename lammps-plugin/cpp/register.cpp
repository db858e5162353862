/* Registers pair styles in a LAMMPS that has no plugin command. */

#include "force.h"
#include "lammps.h"

#include <string>

using namespace LAMMPS_NS;

extern "C" void psidpd_insert_style(void *lmp, const char *name, void *(*creator)(void *))
{
  // What LAMMPS's own plugin command stores: a creator is called with the instance and returns a Pair.
  (*static_cast<LAMMPS *>(lmp)->force->pair_map)[name] = reinterpret_cast<Force::PairCreator>(creator);
}
