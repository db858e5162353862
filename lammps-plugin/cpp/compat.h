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
auto forward_slopes(Comm *comm, LAMMPS_NS::Pair *pair, int) -> decltype(comm->forward_comm(pair), void())
{
  comm->forward_comm(pair);
}

template <class Comm>
auto forward_slopes(Comm *comm, LAMMPS_NS::Pair *pair, long) -> decltype(comm->forward_comm_pair(pair), void())
{
  comm->forward_comm_pair(pair);
}

// add_request(Pair *, flags), flag 1 for a full list, came in 2022. What older versions need for one, the
// inside of a request, is not in their installed headers. Returns whether a list was requested.
template <class Neighbor>
auto request_full_list(Neighbor *neighbor, LAMMPS_NS::Pair *pair, int)
    -> decltype(neighbor->add_request(pair, 1), bool())
{
  neighbor->add_request(pair, 1);
  return true;
}

template <class Neighbor> bool request_full_list(Neighbor *, LAMMPS_NS::Pair *, long)
{
  return false;
}

}    // namespace psidpd

#endif
