/* Registers pair styles in a LAMMPS that has no plugin command, and checks what a version number
   does not tell. */

#include "force.h"
#include "lammps.h"

#include <dlfcn.h>
#include <string>

using namespace LAMMPS_NS;

extern "C" void psidpd_insert_style(void *lmp, const char *name, void *(*creator)(void *))
{
  // What LAMMPS's own plugin command stores: a creator is called with the instance and returns a Pair.
  (*static_cast<LAMMPS *>(lmp)->force->pair_map)[name] = reinterpret_cast<Force::PairCreator>(creator);
}

// Whether the MPI in this process is of the kind whose mpi.h the styles were compiled with: handles
// differ in size, and with them the layout of everything in LAMMPS that holds one.
extern "C" int psidpd_mpi_fits()
{
  const bool openmpi_here = dlsym(RTLD_DEFAULT, "ompi_mpi_comm_world") != nullptr;
#if defined(OPEN_MPI)
  return openmpi_here;
#else
  return !openmpi_here;
#endif
}
