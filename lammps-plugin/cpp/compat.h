/* What differs between the versions of LAMMPS that these styles compile against. */

#ifndef PSIDPD_COMPAT_H
#define PSIDPD_COMPAT_H

#include "comm.h"
#include "neighbor.h"
#include "pair.h"

#if __has_include("neigh_request.h")
#include "neigh_request.h"
#endif

namespace psidpd {

// forward_comm(Pair *) was called forward_comm_pair before 2022.
template <class Comm>
auto forward_values(Comm *comm, LAMMPS_NS::Pair *pair, int) -> decltype(comm->forward_comm(pair), void())
{
  comm->forward_comm(pair);
}

template <class Comm>
auto forward_values(Comm *comm, LAMMPS_NS::Pair *pair, long) -> decltype(comm->forward_comm_pair(pair), void())
{
  comm->forward_comm_pair(pair);
}

// Asks for a full neighbor list and returns true; or, where LAMMPS's headers do not let one ask, for its
// default half list and returns false.
// add_request(Pair *, flags), flag 1 for a full list, was request(Pair *, instance) before 2022.
template <class Neighbor>
auto request_list(Neighbor *neighbor, LAMMPS_NS::Pair *pair, int, int)
    -> decltype(neighbor->add_request(pair, 1), bool())
{
  neighbor->add_request(pair, 1);
  return true;
}

template <class Neighbor>
auto request_list(Neighbor *neighbor, LAMMPS_NS::Pair *pair, int instance, long)
    -> decltype(neighbor->request(pair, instance), bool())
{
  const int k = neighbor->request(pair, instance);
#if __has_include("neigh_request.h")
  neighbor->requests[k]->half = 0;
  neighbor->requests[k]->full = 1;
  return true;
#else
  (void) k;
  return false;
#endif
}

// Comm::TILED, which had no name before 2023.
inline bool is_tiled(const LAMMPS_NS::Comm *comm)
{
  return comm->style == 1;
}

}    // namespace psidpd

#endif
